"""What a solution knows: positions, strains, stresses, energies, reactions."""

import logging
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .beam import select_beam
from .errors import InputError, NameUnknown, require_flag, teaching
from .frozen import Frozen
from .recovery import actions, recover
from .resultants import resultants
from .section_forces import NotRecovered

logger = logging.getLogger(__name__)


class Reaction(NamedTuple):
    """What a support does to the beam.

    Attributes
    ----------
    force
        Resultant, shape (2,).
    moment
        Moment about the deformed position of the support's axis point, counterclockwise.
    coordinates
        The force on each fixed coordinate by name, summed over the nodes.
    """

    force: np.ndarray
    moment: float
    coordinates: dict


@teaching
class State(Frozen):
    """A configuration of a scene. It does not change; :meth:`replace` returns a changed copy.

    Attributes
    ----------
    u
        Displacement of the coordinates from the stress-free state, shape (N,).
    load
        Load factor.
    converged, iterations, message, steps
        How the solver got here; ``steps`` holds the residuals of every iteration.
    t
        Time, in a motion; else None.
    acceleration
        Of the coordinates, shape (N,), in a motion; else None.
    doubt : str
        Where and how the way to it left the path from the stress-free state; empty if it did not.
    """

    def __init__(self, system, u, load=1.0, force=None, converged=True, iterations=0, message="",
                 steps=(), multipliers=None, t=None, inertia=0.0, acceleration=None, motion=None,
                 origin=None, verdict=None, doubt=""):
        self.system, self.u, self.load = system, u, load
        self.converged, self.iterations, self.message = converged, iterations, message
        self.steps = tuple(steps)
        self._force, self.t, self._inertia = force, t, inertia
        self.acceleration = acceleration
        # the Motion of an instant, its scheme, and what a run of it keeps
        self._motion, self._origin = motion, origin
        self.multipliers = np.zeros(system.m) if multipliers is None else multipliers
        self.doubt, self._verdict, self._checks = doubt, verdict, None
        for name, size in (("u", system.N), ("multipliers", system.m)):
            if np.shape(getattr(self, name)) != (size,):
                raise InputError(f"{name} must have shape ({size},) in this scene, got "
                                 f"{np.shape(getattr(self, name))}")

    def replace(self, **changes):
        """The same state with other attributes, as ``replace(message="guess")``.

        ``error_estimate`` and ``scene`` are those of an adaptive solution.

        Raises
        ------
        NameUnknown
            If an attribute is not known.
        """
        known = [name for name in vars(self) if not name.startswith("_")]
        known += [name for name in ("error_estimate", "scene") if name not in known]
        for name in changes:
            if name not in known:
                raise NameUnknown("attribute of State", name, known)
        other = object.__new__(type(self))
        vars(other).update(vars(self), **changes)
        for name in ("_recoveries", "_actions"):
            vars(other).pop(name, None)
        if {"u", "multipliers", "system", "load", "t"} & set(changes):
            vars(other).update(_verdict=None, _checks=None)
        if {"u", "multipliers", "system"} & set(changes):
            vars(other).update(_force=None, _motion=None, _origin=None)
        other._seal()
        return other

    def __repr__(self):
        return (f"<State of {len(self.system.beams)} beam(s), {self.system.N} coordinates, load "
                f"{self.load:g}: {self.message}>")

    def __str__(self):
        lines = [repr(self)[1:-1]]
        if self.t is None:
            lines.append(f"  equilibrium: {self.verdict}")
        return "\n".join(lines + [f"  {line}" for line in str(self.checks).splitlines()])

    @property
    def verdict(self):
        """What the tangent says of an equilibrium: a
        :class:`~skfem_ancf.statics.stability.Verdict`; None for an instant of a motion.
        """
        from .statics.stability import verdict

        if self._verdict is None and self.t is None:
            self._verdict = verdict(self.system, np.array(self.u), self.load, self.multipliers)
        return self._verdict

    @property
    def stability(self):
        """"stable", "unstable" or "singular" (to round-off); "undecided" is possible with loads
        that have no potential, see ``state.verdict.note``. None for an instant of a motion.
        """
        return self.verdict and self.verdict.stability

    @property
    def negative_pivots(self):
        """Number of directions that give way: negative eigenvalues of the tangent at the free
        coordinates, on the tangent space of the joints. None for an instant of a motion.
        """
        return self.verdict and self.verdict.negative_pivots

    @property
    def checks(self):
        """How far the state is from what law and mesh are good for: a
        :class:`~skfem_ancf.checks.Checks`.
        """
        from .checks import check

        if self._checks is None:
            self._checks = check(self)
        return self._checks

    @property
    def beams(self):
        """The beams of the scene."""
        return self.system.beams

    @property
    def q(self):
        """Absolute coordinates, beam after beam, shape (N,)."""
        return np.concatenate([b.q0 for b in self.beams]) + self.u

    @property
    def v(self):
        """Velocity of the coordinates, shape (N,); zero where there is no motion."""
        return np.zeros_like(self.u) if self._motion is None else self._motion.v

    def u_of(self, beam):
        """Coordinate displacements of one beam."""
        return self.u[self.system.of(select_beam(self.beams, beam))]

    # at material points

    def displacement(self, point, beam=None):
        """Displacement of material points.

        Parameters
        ----------
        point
            A material point, named by its place (x, y) in the stress-free body, or many: an array
            (2, n), or a list of points.
        beam
            The beam, its name or its number; found for each point if it is not given.

        Returns
        -------
        ndarray
            Shape (2,), or (2, n) for many points.

        Raises
        ------
        MeshError
            If a point is outside the body.
        """
        return self.system.points.find(point, beam).displacement(self.u)

    def position(self, point, beam=None):
        """Position of material points, (2,) or (2, n); parameters are those of
        :meth:`displacement`.
        """
        at = self.system.points.find(point, beam)
        return at.start + at.displacement(self.u)

    def velocity(self, point, beam=None):
        """Velocity of material points, (2,) or (2, n); zero where there is no motion.

        Parameters are those of :meth:`displacement`.
        """
        return self.system.points.find(point, beam).velocity(self.u, self.v)

    def strain(self, point, beam=None, recover=True):
        """Green-Lagrange strain (eps_xx, eps_yy, eps_xy) in the beam's frame, (3,) or (3, n).

        Parameters
        ----------
        point, beam
            As for :meth:`displacement`.
        recover
            The recovered field, see :mod:`skfem_ancf.recovery`, where there is one
            (:attr:`recovered`); False for the strain of the element at the point.
        """
        at, recover = self.system.points.find(point, beam), require_flag("recover", recover)
        values = at.gather([self._strain(part, recover) for part in at.parts])
        values[2] *= 0.5
        return values

    def stress(self, point, beam=None, recover=True):
        """Second Piola-Kirchhoff stress (S_xx, S_yy, S_xy) in the beam's frame, (3,) or (3, n).

        Parameters are those of :meth:`strain`.
        """
        at, recover = self.system.points.find(point, beam), require_flag("recover", recover)
        return at.gather([self._stress(part, recover) for part in at.parts])

    def _strain(self, part, recover):
        r = self._recovery_of(part.number) if recover else None
        if r is not None:
            return r.at(part, slice(0, 3))
        return part.beam.strain(self.u[part.coordinates], part.at, part.e)[..., 0]

    def _stress(self, part, recover):
        r = self._recovery_of(part.number) if recover else None
        if r is not None:
            return r.at(part, slice(3, 6))
        return part.beam.stress(self.u[part.coordinates], part.at, part.e)[..., 0]

    # recovered fields

    def recovery(self, beam=None):
        """The recovered field of a beam, a :class:`~skfem_ancf.recovery.Recovery`, or None.

        None where the field cannot be recovered; :attr:`recovered` says why.
        """
        return self._recovery_of(self.beams.index(select_beam(self.beams, beam)))

    def _recovery_of(self, k):
        found = self._recoveries.get(k)
        if found is None:
            beam = self.beams[k]
            try:
                found = recover(self, beam, self._actions[k])
            except NotRecovered as reason:
                logger.info("%r: strain and stress are those of the elements: %s", beam, reason)
                found = reason
            self._recoveries[k] = found
        return None if isinstance(found, NotRecovered) else found

    @property
    def recovered(self):
        """For each beam, by name or number, "" if its fields are recovered, else why not: dict.

        Recovered fields need an equilibrium (of statics or of a motion) under loads of which it is
        known where they act. Elsewhere strain and stress are those of the elements.
        """
        out = {}
        for k, beam in enumerate(self.beams):
            self.recovery(beam)
            found = self._recoveries[k]
            out[k if beam.name is None else beam.name] = (
                str(found) if isinstance(found, NotRecovered) else "")
        return out

    @cached_property
    def _recoveries(self):
        return {}

    @cached_property
    def _actions(self):
        return actions(self)

    def resultants(self, at=None, beam=None, recover=True):
        """Normal force, shear force and bending moment along a beam, with the strains of its axis.

        Parameters
        ----------
        at
            Points through which the sections go: one, shape (2,), or many, shape (2, n) or a list;
            None for nine sections in each element, and both sides of forces between nodes.
        beam
            The beam, its name or its number, in a scene of several; found from ``at``.
        recover
            From the equilibrium of the body, exact up to the iteration of the solution, where it
            can be had (:attr:`recovered`); False for the stress of the elements, integrated.

        Returns
        -------
        Resultants
            With ``s``, ``N``, ``Q``, ``M``, ``curvature``, ``stretch``, ``shear``, ``angle`` and
            ``force``, see :class:`~skfem_ancf.resultants.Resultants` for their signs.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.01), ElementBeamANCF(2),
        ...             StVenantKirchhoff(E=2e11, nu=0.3), width=0.01)
        >>> state = Scene(beam).clamp("left").point_force((0, -1), at=(1, 0)).solve_static()
        >>> sections = state.resultants([(0, 0), (0.5, 0)])
        >>> sections.M.round(4).tolist(), sections.Q.round(4).tolist()
        ([-1.0, -0.5], [-1.0, -1.0])
        """
        recover = require_flag("recover", recover)
        if at is None:
            return resultants(self, self.beams.index(select_beam(self.beams, beam)), None, recover)
        found = self.system.points.find(at, beam)
        if len(found.parts) != 1:
            raise InputError("the points are in several beams: ask for the resultants of each, "
                             "with beam=")
        part = found.parts[0]
        values = resultants(self, part.number, part, recover)
        return values.first() if found.one else values

    # of the whole

    @property
    def strain_energy(self):
        """Strain energy of the scene."""
        return self.system.strain_energy(self.u)

    @property
    def internal_force(self):
        """Internal force on all coordinates, shape (N,)."""
        if self._force is None:
            self._force = self.system.internal_force(self.u)
        return self._force

    def reactions(self, boundary, beam=None):
        """What the supports at a boundary do to the beam: force, moment, and by coordinate.

        Parameters
        ----------
        boundary
            A boundary name, or anything else scikit-fem takes for facets.
        beam
            The beam, its name or its number, in a scene of several.

        Returns
        -------
        Reaction
        """
        beam = select_beam(self.beams, beam)
        s = self.system.of(beam)
        total = np.where(self.system.free, 0.0, self._support_force())
        nodes = beam.nodes(boundary)
        forces = total[s].reshape(-1, beam.nd // 2, 2)[nodes]
        q = (beam.q0_local + self.u[s]).reshape(-1, beam.nd // 2, 2)[nodes]
        arm = q.copy()
        arm[:, 0] -= q[0, 0]
        moment = np.sum(arm[..., 0] * forces[..., 1] - arm[..., 1] * forces[..., 0])
        by_name = dict(zip(beam.dofnames, forces.sum(axis=0).ravel()))
        held = set(np.nonzero(~self.system.free[s].reshape(-1, beam.nd)[nodes].all(axis=0))[0])
        names = {n: float(v) for k, (n, v) in enumerate(by_name.items()) if k in held}
        return Reaction(forces[:, 0].sum(axis=0), float(moment), names)

    def _support_force(self):
        """What supports do to the coordinates, (N,): all other forces and inertia, negated."""
        total = (self.internal_force - self.load * self.system.external_force(self.u, self.t)
                 + self._inertia)
        t = self.load if self.t is None else self.t
        if self.system.joints:
            total = total + self.multipliers @ self.system.full_jacobian(self.u, t)
        return total

    def joint_force(self, joint):
        """What a joint does to its first beam, in the order of ``joint.equations``; (m,)."""
        return self.system.joint_force(joint, self.multipliers, self._support_force())

    # files and pictures

    def save(self, filename, **options):
        """Write the deformed body for ParaView; see :func:`skfem_ancf.io.vtu.save_vtu`."""
        from .io.vtu import save_vtu

        return save_vtu(self, filename, **options)

    def plot_resultants(self, beam=None, **options):
        """Draw the three diagrams; see :func:`skfem_ancf.visuals.diagrams.plot_resultants`."""
        from .visuals.diagrams import plot_resultants

        return plot_resultants(self, beam, **options)

    def plot(self, field="eps_yy", **options):
        """Draw the deformed body; see :func:`skfem_ancf.visuals.matplotlib.plot_state`."""
        from .visuals.matplotlib import plot_state

        return plot_state(self, field, **options)
