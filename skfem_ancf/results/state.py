"""What a solution knows: positions, strains, stresses, energies, reactions."""

from __future__ import annotations

import logging
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..beam.layout import select_beam, select_member
from ..core.errors import InputError, NameUnknown, require_flag, shown
from ..actions.eigenstrain import EigenStrain
from ..recovery.fields import Values, find_field
from ..core.frozen import Frozen
from ..core.kept import cached_property
from ..core.linear import first_order, step
from ..beam.interpolation import Part
from ..beam.points import require_body
from ..recovery.recovered import actions, recover
from ..recovery.resultants import Resultants, resultants
from ..recovery.section_forces import NotRecovered

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path


    from ..beam.beam import Beam
    from .checks import Checks
    from ..actions.joints.base import Joint
    from ..actions.obstacles.contact import Contact
    from ..recovery.recovered import Recovery
    from ..beam.rigid import RigidBody
    from ..equations.stability import Verdict
    from ..equations.system import System
    from ..core.types import Array, Place, StrPath
    from ..beam.layout import WhichBeam, WhichMember

logger = logging.getLogger(__name__)

#: Rows of recovered fields.
STRAIN, STRESS = slice(0, 3), slice(3, 6)


class Reaction(NamedTuple):
    """What a support does to the beam.

    Attributes
    ----------
    force
        Resultant, shape (2,); of a History (nt, 2), and what follows (nt,).
    moment
        Moment about the deformed position of the support's axis point, counterclockwise; of a
        rigid body about its centre of mass.
    coordinates
        The force on each fixed coordinate by name, summed over the nodes.
    """

    force: np.ndarray
    moment: Any
    coordinates: dict


class State(Frozen):
    """A configuration of a scene. It does not change; :meth:`replace` returns a changed copy.

    Parameters
    ----------
    system
        The :class:`~skfem_ancf.equations.system.System` of the scene.
    u
        Displacement of the coordinates, shape (N,).
    load
        Load factor.
    force
        Internal force there, shape (N,), or None: it is computed when asked for.
    converged, iterations, message, steps, doubt
        As in the attributes.
    multipliers
        Of the joints, shape (m,); zero by default.
    t, inertia, acceleration, motion, origin
        Of an instant of a motion: its time; the force of inertia and damping, and the
        acceleration of the
        coordinates, shape (N,); its :class:`~skfem_ancf.dynamics.Motion`; its scheme, and what the
        run kept.
    verdict
        What is known of its stability, or None: it is found when asked for.
    memory
        What load steps have left behind at obstacles, shape (n,), or None.
    base
        As in the attributes.

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
        Of the coordinates, shape (N,), in a motion and of a mode; else None.
    doubt : str
        Where and how the way to it left the path from the stress-free state; empty if it did not.
    base : State or None
        The state about which this one is linearised: of a linear solution that without load, of a
        mode that which vibrates. All that is asked is of first order in the difference: strain,
        stress, section forces, rotations, reactions; the strain energy of second order. None of a
        state of large displacements.
    """

    system: System
    u: Array
    load: float
    converged: bool
    iterations: int
    message: str
    steps: tuple[Any, ...]
    t: float | None
    acceleration: Array | None
    multipliers: Array
    doubt: str
    _force: Array | None
    _inertia: Array | float
    base: State | None
    _motion: Any
    _origin: Any
    _verdict: Verdict | None
    _checks: Checks | None
    _memory: Array | None

    def __init__(self, system: System, u: Array, load: float = 1.0, force: Array | None = None,
                 converged: bool = True, iterations: int = 0, message: str = "",
                 steps: Iterable[Any] = (), multipliers: Array | None = None,
                 t: float | None = None, inertia: Array | float = 0.0,
                 acceleration: Array | None = None, motion: Any = None, origin: Any = None,
                 verdict: Verdict | None = None, doubt: str = "",
                 memory: Array | None = None, base: State | None = None) -> None:
        m = system.constraints.m
        multipliers = np.zeros(m) if multipliers is None else multipliers
        for name, value, size in (("u", u, system.N), ("multipliers", multipliers, m)):
            if np.shape(value) != (size,):
                raise InputError(f"{name} must have shape ({size},) in this scene, got "
                                 f"{np.shape(value)}")
        # at once, as each by itself is looked at whether it may be set; _motion, _origin are the
        # Motion of an instant, its scheme, and what a run of it keeps
        vars(self).update(
            system=system, u=u, load=load, converged=converged, iterations=iterations,
            message=message, steps=tuple(steps), t=t, acceleration=acceleration,
            multipliers=multipliers, doubt=doubt, base=base, _force=force, _inertia=inertia,
            _motion=motion, _origin=origin, _verdict=verdict, _checks=None, _memory=memory)

    def replace(self, **changes: Any) -> State:
        """The same state with other attributes, as ``replace(message="guess")``.

        ``error_estimate``, ``scene`` and ``refinements`` are those of an adaptive solution.

        Raises
        ------
        NameUnknown
            If an attribute is not known.
        """
        known = [name for name in vars(self) if not name.startswith("_")]
        known += [name for name in ("error_estimate", "scene", "refinements")
                  if name not in known]
        for name in changes:
            if name not in known:
                raise NameUnknown("attribute of State", name, known)
        other = object.__new__(type(self))
        vars(other).update(vars(self), **changes)
        for name in ("_recoveries", "actions", "together", "places"):
            vars(other).pop(name, None)
        if {"u", "multipliers", "system", "load", "t"} & set(changes):
            vars(other).update(_verdict=None, _checks=None, _force=None)
        if {"u", "multipliers", "system"} & set(changes):
            vars(other).update(_motion=None, _origin=None, _memory=None)
        other._seal()
        return other

    def __repr__(self):
        return (f"<State of {len(self.system.beams)} beam(s), {self.system.N} coordinates, load "
                f"{self.load:g}: {self.message}>")

    def __str__(self):
        lines = [repr(self)[1:-1]]
        if self.base is not None:
            about = "a state under load" if self.base.u.any() else "the stress-free state"
            lines.append(f"  linear, for small displacements from {about}: no verdict on stability")
        elif self.t is None:
            lines.append(f"  equilibrium: {self.verdict}")
        if self.beams:
            lines += [f"  {line}" for line in str(self.checks).splitlines()]
        return "\n".join(lines)

    def contact_memory(self) -> AbstractContextManager[None]:
        """What its points remember of obstacles, lent to the equations while it is asked."""
        return self.system.forces.contacts.lent(self._memory)

    @property
    def verdict(self) -> Verdict | None:
        """What the tangent says of an equilibrium: a
        :class:`~skfem_ancf.equations.stability.Verdict`; None for an instant of a motion, and for a
        linear solution: ``scene.buckling()`` tells up to which load that is stable.
        """
        from ..equations.stability import verdict

        if self._verdict is None and self.t is None and self.base is None:
            with self.contact_memory():
                self._verdict = verdict(self.system, np.array(self.u), self.load, self.multipliers)
        return self._verdict

    @property
    def stability(self) -> str | None:
        """"stable", "unstable" or "singular" (to round-off); "undecided" is possible with loads
        that have no potential, see ``state.verdict.note``. None where :attr:`verdict` is.
        """
        return None if self.verdict is None else self.verdict.stability

    @property
    def negative_pivots(self) -> int | None:
        """Number of directions that give way: negative eigenvalues of the tangent at the free
        coordinates, on the tangent space of the joints. None where :attr:`verdict` is.
        """
        return None if self.verdict is None else self.verdict.negative_pivots

    @property
    def checks(self) -> Checks:
        """How far the state is from what law and mesh are good for: a
        :class:`~skfem_ancf.results.checks.Checks`.
        """
        from .checks import check

        if self._checks is None:
            self._checks = check(self)
        return self._checks

    @property
    def beams(self) -> tuple[Beam, ...]:
        """The beams of the scene."""
        return tuple(self.system.beams)

    @property
    def q(self) -> Array:
        """Absolute coordinates, beam after beam, shape (N,)."""
        return np.concatenate([b.q0 for b in self.system.members]) + self.u

    @cached_property
    def places(self) -> Array:
        """Displacement of the coordinates as fields are asked at it, shape (N,): of a linear
        solution the :func:`~skfem_ancf.core.linear.step` from its base.
        """
        return self.u if self.base is None else step(self.base.u, self.u)

    def places_of(self, beam: WhichMember) -> Array:
        """Those of :attr:`places` of one beam or rigid body."""
        return self.places[self.system.of(select_member(self.beams, self.system.bodies, beam))]

    @property
    def from_rest(self) -> bool:
        """True if it is linearised about the stress-free state without load."""
        return self.base is not None and self.base.load == 0.0 and not self.base.u.any()

    @property
    def v(self) -> Array:
        """Velocity of the coordinates, shape (N,); zero where there is no motion."""
        return np.zeros_like(self.u) if self._motion is None else self._motion.v

    @property
    def bodies(self) -> tuple[RigidBody, ...]:
        """The rigid bodies of the scene."""
        return tuple(self.system.bodies)

    def u_of(self, beam: WhichMember) -> Array:
        """Coordinate displacements of one beam or rigid body."""
        return self.u[self.system.of(select_member(self.beams, self.system.bodies, beam))]

    def angle(self, body: WhichMember) -> float:
        """The angle of a rigid body, in radians, no more than pi from that of the start.

        Parameters
        ----------
        body
            The RigidBody, its name or its number.
        """
        found = require_body(self.system, body)
        return float(first_order(found.angle_at(self.places[self.system.of(found)])))

    def angular_velocity(self, body: WhichMember) -> float:
        """The angular velocity of a rigid body, counterclockwise; zero where there is no motion.

        Parameters
        ----------
        body
            The RigidBody, its name or its number.
        """
        found = require_body(self.system, body)
        s = self.system.of(found)
        return float(found.angular_velocity(self.u[s], self.v[s]))

    # at material points

    def displacement(self, point: Any, beam: WhichMember = None, line: int | None = None) -> Array:
        """Displacement of material points.

        Parameters
        ----------
        point
            A material point, named by its place (x, y) in the stress-free body, or many: a list of
            points, or an array (2, n) whose columns are points; a RigidBody for its centre of mass.
        beam
            The beam or rigid body, its name or its number; found for each point if it is not given.
        line
            The number of the line, of a frame; found for each point if it is not given. A point
            that is in several lines or beams is one of that whose axis is nearest, here as in all
            loads and readings; of the first of them if several are as near, as at a node.

        Returns
        -------
        ndarray
            Shape (2,), or (2, n) for many points.

        Raises
        ------
        MeshError
            If a point is outside the body.
        """
        return first_order(self.system.points.find(point, beam, line).displacement(self.places))

    def position(self, point: Any, beam: WhichMember = None, line: int | None = None) -> Array:
        """Position of material points, (2,) or (2, n); parameters are those of
        :meth:`displacement`.

        Parameters
        ----------
        point
            One point, shape (2,), or many, as for :meth:`displacement`.
        beam
            The beam, its name or its number; found if it is not given.
        line
            As for :meth:`displacement`.
        """
        at = self.system.points.find(point, beam, line)
        return at.start + first_order(at.displacement(self.places))

    def velocity(self, point: Any, beam: WhichMember = None, line: int | None = None) -> Array:
        """Velocity of material points, (2,) or (2, n); zero where there is no motion.

        Parameters are those of :meth:`displacement`.

        Parameters
        ----------
        point
            One point, shape (2,), or many, as for :meth:`displacement`.
        beam
            The beam, its name or its number; found if it is not given.
        line
            As for :meth:`displacement`.
        """
        return self.system.points.find(point, beam, line).velocity(self.u, self.v)

    def strain(self, point: Any, beam: WhichBeam = None, recover: bool = True,
               line: int | None = None) -> Array:
        """Green-Lagrange strain (eps_xx, eps_yy, eps_xy) in the beam's frame, (3,) or (3, n).

        Of a linear solution the linear strain.

        Parameters
        ----------
        point, beam
            As for :meth:`displacement`: one point, shape (2,), or many.
        recover
            The recovered field, see :mod:`skfem_ancf.recovery`, where there is one
            (:attr:`recovered`); False for the strain of the element at the point.
        line
            The number of the line, of a frame; found for each point if it is not given.

        Raises
        ------
        InputError
            If several lines or beams are as near to a point, as at a node: their strains differ.
        """
        at = self.system.points.find(point, beam, line, ask=True)
        recover = require_flag("recover", recover)
        values = at.gather([self._strain(part, recover) for part in at.parts])
        values[2] *= 0.5
        return values

    def stress(self, point: Any, beam: WhichBeam = None, recover: bool = True,
               line: int | None = None) -> Array:
        """Second Piola-Kirchhoff stress (S_xx, S_yy, S_xy) in the beam's frame, (3,) or (3, n).

        Parameters are those of :meth:`strain`.

        Parameters
        ----------
        point, beam, recover, line
            As for :meth:`strain`: one point, shape (2,), or many.
        """
        at = self.system.points.find(point, beam, line, ask=True)
        recover = require_flag("recover", recover)
        return at.gather([self._stress(part, recover) for part in at.parts])

    def field(self, field: Any, point: Any, beam: WhichBeam = None,
              recover: bool = True, line: int | None = None) -> Array:
        """Any field at material points.

        Parameters
        ----------
        field
            A name of :data:`skfem_ancf.recovery.fields.FIELDS`, as "von_mises", or a function or
            Field of your own, see :mod:`skfem_ancf.recovery.fields`.
        point
            One point, shape (2,), or many, shape (2, n) or a list.
        beam, recover, line
            As for :meth:`strain`.

        Returns
        -------
        ndarray
            Shape () or (n,); vectors and tensors have their 2 or 3 components first.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.1), ElementBeamANCF(2),
        ...             StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)
        >>> state = Scene(beam).clamp("left").point_force((0, -0.1), at=(1, 0)).solve_static()
        >>> float(state.field("von_mises", (0.5, 0.05)).round(-1))
        300.0
        """
        at = self.system.points.find(point, beam, line, ask=True)
        recover = require_flag("recover", recover)
        field = find_field(field)
        return at.gather([field.of(Values(part, self.places, partial(
            self._recovery_of, part.number) if recover else None, self.eigen))
            for part in at.parts])

    def eigen(self, part: Part, stress: bool = False) -> Any:
        """The stress-free strain at points, or what the stress of the elements is less by for it.

        Parameters
        ----------
        part
            A :class:`~skfem_ancf.beam.interpolation.Part`.
        stress
            The latter.

        Returns
        -------
        ndarray
            Shape (3, n), or 0.
        """
        if not isinstance(part, Part):
            raise InputError("part must be points of a beam, a "
                             f"skfem_ancf.beam.interpolation.Part, got {shown(part)}")
        if require_flag("stress", stress):
            return first_order(self.eigen_stress(part.beam, part.at, part.e)[..., 0])
        return sum(factor * load.strain_at(part.at, part.e)[..., 0]
                   for factor, load in self.eigenstrains(part.beam))

    def eigen_stress(self, beam: Beam, X: Array, e: Array) -> Array:
        """What the stress of the elements is less by for stress-free strains, (3, n, m).

        Of a linear solution a :func:`~skfem_ancf.core.linear.step`.

        Parameters
        ----------
        beam
            One of the beams.
        X, e
            Reference points (2, n, m) and their elements (n,).
        """
        u, unit = self.places_of(beam), self.unit
        return np.zeros((3, *X.shape[1:])) + sum(
            load.stress_at(u, X, e, unit * factor) for factor, load in self.eigenstrains(beam))

    @property
    def unit(self) -> Any:
        """What factors of loads are times: of a linear solution from rest a
        :func:`~skfem_ancf.core.linear.step`, else 1.
        """
        return step(0.0, 1.0) if self.from_rest else 1.0

    def eigenstrains(self, beam: WhichBeam = None) -> list[tuple[float, EigenStrain]]:
        """Factors and loads of stress-free strains on a beam."""
        beam = select_beam(self.beams, beam)
        return [(self.load * load.factor(self.t), load) for load in self.system.loads
                if isinstance(load, EigenStrain) and load.beam is beam]

    def _strain(self, part, recover):
        r = self._recovery_of(part.number) if recover else None
        return first_order(part.strain(self.places)) if r is None else r.at(part, STRAIN)

    def _stress(self, part, recover):
        r = self._recovery_of(part.number) if recover else None
        return (first_order(part.stress(self.places)) - self.eigen(part, True) if r is None else
                r.at(part, STRESS))

    # recovered fields

    def recovery(self, beam: WhichBeam = None) -> Recovery | None:
        """The recovered field of a beam, a :class:`~skfem_ancf.recovery.Recovery`, or None.

        None where the field cannot be recovered; :attr:`recovered` says why.
        """
        return self._recovery_of(self.beams.index(select_beam(self.beams, beam)))

    def balance(self, beam: WhichBeam = None) -> Recovery | None:
        """The :class:`~skfem_ancf.recovery.Recovery` with the section forces of a beam, or None.

        A section given by numbers has these, but no fields.

        Parameters
        ----------
        beam
            The beam, its name or its number, in a scene of several.
        """
        return self._recovery_of(self.beams.index(select_beam(self.beams, beam)), fields=False)

    def _recovery_of(self, k, fields=True):
        if k not in self._recoveries:
            states = [state for state in self.together if k not in state._recoveries]
            for state, found in zip(states, recover(states, k)):
                state._recoveries[k] = found
                if why := state._why(k):
                    logger.info("%r: strain and stress are those of the elements: %s",
                                self.beams[k], why)
        found = self._recoveries[k]
        return None if isinstance(found, NotRecovered) or fields and found.why else found

    def _why(self, k):
        found = self._recoveries[k]
        return str(found) if isinstance(found, NotRecovered) else found.why

    @property
    def recovered(self) -> dict[Any, str]:
        """For each beam, by name or number, "" if its fields are recovered, else why not: dict.

        Recovered fields need an equilibrium (of statics or of a motion) under loads of which it is
        known where they act. Elsewhere strain and stress are those of the elements.
        """
        out = {}
        for k, beam in enumerate(self.beams):
            self.recovery(beam)
            out[k if beam.name is None else beam.name] = self._why(k)
        return out

    @cached_property
    def _recoveries(self):
        return {}

    @cached_property
    def together(self) -> Sequence[State]:
        """States of the same scene whose fields are recovered with those of this one."""
        return (self,)

    @cached_property
    def actions(self) -> list[list[float]]:
        """Where supports and joints act on each beam: element + xi, a list a beam."""
        first = self.together[0]
        if first is not self and not self.system.constraints.joints:
            return first.actions  # of supports: always the same
        return actions(self)

    def resultants(self, at: Any = None, beam: WhichBeam = None,
                   recover: bool = True, line: int | None = None) -> Resultants:
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
        line
            The number of the line, of a frame; found from ``at`` if it is not given: a section is
            one of the line whose axis is nearest to the point. Without ``at`` all sections of it.

        Returns
        -------
        Resultants
            With ``s``, ``N``, ``Q``, ``M``, ``curvature``, ``stretch``, ``shear``, ``angle`` and
            ``force``, see :class:`~skfem_ancf.recovery.resultants.Resultants` for their signs.

        Raises
        ------
        InputError
            If several lines or beams are as near to a point, as at a node: each has its own.

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
            chain = None
            if line is not None:
                beam, chain = self.system.points.chain_of(line, beam)
            number = self.beams.index(select_beam(self.beams, beam))
            return resultants(self, number, None, recover, chain)
        found = self.system.points.find(at, beam, line, ask=True)
        if len(found.parts) != 1:
            raise InputError("the points are in several beams: ask for the resultants of each, "
                             "with beam=")
        part = found.parts[0]
        values = resultants(self, part.number, part, recover)
        return values.first() if found.one else values

    # of the whole

    def contact(self, obstacle: int | None = None) -> Contact:
        """Where the body touches obstacles, and how hard.

        Parameters
        ----------
        obstacle
            The number of an obstacle, in the order in which they were given; None for all.

        Returns
        -------
        Contact
            With ``points``, ``force``, ``pressure``, ``gap``, ``total`` and ``penetration``, see
            :class:`~skfem_ancf.actions.obstacles.Contact`.

        Raises
        ------
        InputError
            If there are no obstacles, or none of that number.
        """
        from ..actions.obstacles.contact import contact_of

        return contact_of(self, obstacle)

    @property
    def strain_energy(self) -> float:
        """Strain energy of the scene.

        It is W(E) of all the strain, also under temperatures and eigenstrains E0: these are loads,
        and their potential is what W(E - E0), the field "energy", has less.
        """
        with self.contact_memory():
            if self.base is not None:
                return self.system.linear_energy(self.base.u, self.u - self.base.u, self.load)
            return self.system.strain_energy(self.u, self.load if self.t is None else self.t)

    @property
    def internal_force(self) -> Array:
        """Internal force on all coordinates, shape (N,)."""
        if self._force is None:
            with self.contact_memory():
                self._force = (
                    self.system.internal_force(self.u, self.t, self.load) if self.base is None else
                    self.system.linear_force(self.base.u, self.u - self.base.u, self.load))
        return self._force

    def reactions(self, boundary: Place | None, beam: WhichMember = None) -> Reaction:
        """What the supports at a boundary do to the beam: force, moment, and by coordinate.

        Supports are clamps, pins and what is fixed, at any angle, and joints that hold a section,
        or a rigid body, to the ground by linear equations, as a line or a given position.

        Parameters
        ----------
        boundary
            A boundary name, or anything else scikit-fem takes for facets; of a frame nodes, see
            :meth:`Frame.nodes <skfem_ancf.scene.frame.Frame.nodes>`.
        beam
            The beam, its name or its number, in a scene of several.

        Returns
        -------
        Reaction

        Raises
        ------
        InputError
            If a beam of a frame is named that no support holds there: clamps and pins hold nodes.
        """
        frame = self.system.constraints.frame
        if frame is not None and beam is None:
            multipliers = self.multipliers[:len(frame.equations)]
            return Reaction(*frame.reaction(boundary, self._acted, multipliers))
        member: Any = select_member(self.beams, self.system.bodies, beam)
        s = self.system.of(member)
        nodes, there = member.nodes(boundary), np.zeros(self.system.N, dtype=bool)
        there[s].reshape(-1, member.nd)[nodes] = True
        force, touched = self.system.constraints.force_on(there, self.multipliers)
        total = np.where(self.system.constraints.free, 0.0, self._support_force()) + force
        forces = total[s].reshape(-1, member.nd // 2, 2)[nodes]
        q = (member.q0_local + self._acted[s]).reshape(-1, member.nd // 2, 2)[nodes]
        arm = q.copy()
        arm[:, 0] -= q[0, 0]
        moment = np.sum(arm[..., 0] * forces[..., 1] - arm[..., 1] * forces[..., 0])
        by_name = dict(zip(member.dofnames, forces.sum(axis=0).ravel()))
        holds = (~self.system.constraints.free | touched)[s].reshape(-1, member.nd)[nodes]
        held = set(np.nonzero(holds.any(axis=0))[0])
        names = {n: float(v) for k, (n, v) in enumerate(by_name.items()) if k in held}
        if frame is not None and not names:
            raise InputError(f"no support of beam {shown(beam)} at {shown(boundary)}: what holds "
                             "the nodes of a frame is asked of nodes, without beam=")
        return Reaction(forces[:, 0].sum(axis=0), float(moment), names)

    def _support_force(self):
        """What supports do to the coordinates, (N,): all other forces and inertia, negated."""
        system = self.system
        loads = system.external_force(self.u, self.t) if self.base is None else (
            system.linear_external_force(self.base.u, self.u - self.base.u))
        total = self.internal_force - self.load * loads + self._inertia
        t = self.load if self.t is None else self.t
        if system.constraints.joints:
            total = total + self.multipliers @ system.constraints.full_jacobian(self._acted, t)
        return total

    @property
    def _acted(self):
        """Where forces act, as a displacement (N,): in linear theory where the base is."""
        return self.u if self.base is None else self.base.u

    def joint_force(self, joint: Joint) -> Array:
        """What a joint does to its first beam, in the order of ``joint.equations``; (m,)."""
        t = self.load if self.t is None else self.t
        return self.system.constraints.joint_force(
            joint, self.multipliers, self._support_force(), self._acted, t)

    # files and pictures

    def _repr_html_(self) -> str:
        from ..visuals.html import state_html

        return state_html(self)

    def save(self, filename: StrPath, **options: Any) -> Path:
        """Write the deformed body for ParaView.

        Parameters
        ----------
        filename
            Path that ends with .vtu.
        **options
            Those of :func:`skfem_ancf.io.vtu.save_vtu`.

        Returns
        -------
        pathlib.Path
            The file.
        """
        from ..io.vtu import save_vtu

        return save_vtu(self, filename, **options)

    def to_pyvista(self, **options: Any) -> Any:
        """The body as a grid of pyvista.

        Parameters
        ----------
        **options
            Those of :func:`skfem_ancf.visuals.pyvista.to_pyvista`.
        """
        from ..visuals.pyvista import to_pyvista

        return to_pyvista(self, **options)

    def view(self, field: Any = "eps_yy", **options: Any) -> Any:
        """Put the body into a plotter of pyvista, and return it.

        Parameters
        ----------
        field
            As for :meth:`plot`.
        **options
            Those of :func:`skfem_ancf.visuals.pyvista.view`.
        """
        from ..visuals.pyvista import view

        return view(self, field, **options)

    def plot_resultants(self, beam: WhichBeam = None, **options: Any) -> Any:
        """Draw the three diagrams; see :func:`skfem_ancf.visuals.diagrams.plot_resultants`.

        Parameters
        ----------
        beam
            The beam, its name or its number.
        **options
            Those of :func:`skfem_ancf.visuals.diagrams.plot_resultants`.
        """
        from ..visuals.diagrams import plot_resultants

        return plot_resultants(self, beam, **options)

    def plot(self, field: str = "eps_yy", **options: Any) -> Any:
        """Draw the deformed body.

        Parameters
        ----------
        field
            What it is coloured by, as for :func:`skfem_ancf.visuals.matplotlib.plot_state`.
        **options
            Those of :func:`skfem_ancf.visuals.matplotlib.plot_state`.

        Returns
        -------
        matplotlib.axes.Axes
        """
        from ..visuals.matplotlib import plot_state

        return plot_state(self, field, **options)
