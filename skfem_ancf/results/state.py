"""States: positions, strains, stresses, energies, reactions of a configuration."""

import logging
from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from ..actions.bound import MemberForce
from ..actions.eigenstrain import EigenStrain
from ..actions.forces.springs import spring_force
from ..actions.item import Item
from ..actions.joints.base import Joint
from ..actions.obstacles.contact import Contact, contact_of, loads_of_contact
from ..beam import (Beam, BeamPoints, Distribution, Domain, DomainPoints, RigidBody, Sampled,
                    WhichBeam, WhichMember, require_body, select_beam, select_member,
                    station_of_node, stations_of_vector)
from ..core import (Array, Immutable, NearMisses, Place, cached_property, first_order, refuse,
                    require_flag, require_integer, require_option, step)
from ..equations.evaluation import UNSEEN
from ..equations.matrices import linear_energy, linear_external_force, linear_force
from ..equations.stability import Verdict, verdict
from ..equations.system import System
from ..recovery.fields import PLASTIC, DomainValues, Values, find_field, no_value
from ..recovery.recovered import Recovery
from ..recovery.resultants import ALONG_ELEMENT, Resultants, resultants
from ..recovery.section_forces import NotRecovered, SectionForces
from .checks import Checks, check
from .output import Output


# displacement, position and velocity of material points, for states, motions and paths

class MaterialPoints(NearMisses):
    """Methods for material points that use degrees of freedom only.

    For a motion or a path the first axis of arrays is that of instants, or of points of the path.

    Other Parameters
    ----------------
    point
        A material point (x, y) in the reference configuration, shape (2,); or many: a list of
        points, or an array (2, n) whose columns are points; for displacement, position and velocity
        also a RigidBody for its centre of mass.
    beam
        Beam or rigid body, name or number; by default found for each point.
    line
        Number of the line of a frame; by default found for each point. A point in several lines or
        beams belongs to the one with the nearest axis, here as in all loads and probes; to the
        first of them if several are equally near, as at a node.
    body
        A RigidBody, its name or number.
    """

    system: System
    u: Array
    v: Array

    @property
    def _places(self) -> Array:
        return self.u

    def _member(self, which: WhichMember) -> Any:
        system = self.system
        return select_member(system.beams, system.members[len(system.beams):], which)

    def u_of(self, beam: WhichMember) -> Array:
        """Displacements of the DOFs (..., n) of one beam or rigid body."""
        return self.u[..., self.system.of(self._member(beam))]

    def displacement(self, point: Any, beam: WhichMember = None, line: int | None = None) -> Array:
        """Displacement of material points, (..., 2) or (..., 2, n); MeshError outside the body."""
        return first_order(self.system.points.find(point, beam, line).displacement(self._places))

    def position(self, point: Any, beam: WhichMember = None, line: int | None = None) -> Array:
        """Position of material points, (..., 2) or (..., 2, n)."""
        at = self.system.points.find(point, beam, line)
        return at.start + first_order(at.displacement(self._places))

    def velocity(self, point: Any, beam: WhichMember = None, line: int | None = None) -> Array:
        """Velocity of material points, (..., 2) or (..., 2, n); zero where there is no motion."""
        return self.system.points.find(point, beam, line).velocity(self.u, self.v)

    def angle(self, body: WhichMember) -> Any:
        """Rotation (...) of a rigid body in radians, at most pi in magnitude."""
        found = require_body(self.system, body)
        return first_order(found.angle_at(self._places[..., self.system.of(found)]))

    def angular_velocity(self, body: WhichMember) -> Any:
        """Angular velocity (...) of a rigid body, counterclockwise; zero without motion."""
        found = require_body(self.system, body)
        s = self.system.of(found)
        return found.angular_velocity(self.u[..., s], self.v[..., s])


logger = logging.getLogger(__name__)

#: Difference of axial coordinates (element + xi) that is round-off.
SAME = 1e-6


class Reaction(NamedTuple):
    """Reaction of a support on the beam.

    Attributes
    ----------
    force
        Resultant, shape (2,); for a History (nt, 2), and the others (nt,).
    moment
        Moment about the deformed position of the support's axis point, counterclockwise; for a
        rigid body about its centre of mass, for a domain about the mean of the fixed nodes.
    coordinates
        Generalised force of each fixed degree of freedom by name, summed over the nodes.
    """

    force: np.ndarray
    moment: Any
    coordinates: dict


class State(Immutable, MaterialPoints, Output):
    """A configuration of a scene. It does not change; :meth:`replace` returns a changed copy.

    Parameters
    ----------
    system
        The :class:`~skfem_ancf.equations.system.System` of the scene.
    u, load, multipliers, t, acceleration, memory, base
        As in the attributes.
    converged, iterations, message, steps, doubt
        As in the attributes.
    force
        Internal force there, shape (N,), or None: it is computed when asked for.
    inertia, motion, origin
        Of an instant of a motion: the force of inertia and damping, shape (N,); its
        :class:`~skfem_ancf.dynamics.Motion`; its scheme, and what the run stored.
    verdict
        What the solver knows of its stability, or None: it is found when asked for.
    seen
        What the solver has seen to be within the range of the model, see
        :func:`skfem_ancf.equations.evaluation.examine`.

    Attributes
    ----------
    u
        Displacement of the degrees of freedom from the reference configuration, shape (N,).
    load
        Load factor.
    converged, iterations, message, steps
        Status of the solver; ``steps`` has the residuals of every iteration.
    multipliers
        Lagrange multipliers of the joints, shape (m,).
    t
        Time, in a motion; else None.
    acceleration
        Of the degrees of freedom, shape (N,), in a motion and of a mode; else None.
    doubt : str
        Where and how the solution left the path from the reference configuration; empty if it did
        not.
    memory
        What forces remember of the path, as anchors of friction, shape (n,), or None; see
        :class:`~skfem_ancf.equations.histories.Histories`.
    base : State or None
        The state of linearisation, for linear solutions and modes: strain, stress, section
        forces, rotations and reactions are of first order in the difference, the strain energy of
        second order. None for a state of large displacements.

    Other Parameters
    ----------------
    part
        Points of a beam, a :class:`~skfem_ancf.beam.layout.BeamPoints`.
    recover
        Use the recovered field, see :mod:`skfem_ancf.recovery.recovered`, if there is one
        (:attr:`recovered`), and section forces from the equilibrium of the body, to the accuracy
        of the solution; False for the field of the elements.
    field
        The name of a field in :data:`skfem_ancf.recovery.fields.FIELDS`, or a function or Field.
    filename, options
        The file, and options of the named function.
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
    memory: Array | None
    base: "State | None"
    _force: Array | None
    _inertia: Array | float
    _motion: Any
    _origin: Any
    _verdict: Verdict | None
    _seen: int

    def __init__(self, system: System, u: Array, load: float = 1.0, force: Array | None = None,
                 converged: bool = True, iterations: int = 0, message: str = "",
                 steps: Iterable[Any] = (), multipliers: Array | None = None,
                 t: float | None = None, inertia: Array | float = 0.0,
                 acceleration: Array | None = None, motion: Any = None, origin: Any = None,
                 verdict: Verdict | None = None, doubt: str = "",
                 memory: Array | None = None, base: "State | None" = None,
                 seen: int = UNSEEN) -> None:
        m = system.constraints.m
        multipliers = np.zeros(m) if multipliers is None else multipliers
        refuse(u.shape != (system.N,) or multipliers.shape != (m,), "u and multipliers must have "
               "shapes ({},) and ({},) in this scene, got {} and {}", system.N, m, u.shape,
               multipliers.shape)
        vars(self).update(
            system=system, u=u, load=load, multipliers=multipliers, converged=converged,
            iterations=iterations, message=message, steps=tuple(steps), t=t,
            acceleration=acceleration, doubt=doubt, memory=memory, base=base, _force=force,
            _inertia=inertia, _verdict=verdict, _motion=motion, _origin=origin, _seen=seen)

    def replace(self, **changes: Any) -> "State":
        """A copy with changed attributes, as ``replace(message="guess")``. ``error_estimate``,
        ``scene`` and ``refinements`` are those of an adaptive solution. Raises NameUnknown if an
        attribute is not known."""
        known = [name for name in vars(self) if not name.startswith("_")]
        known += [name for name in ("error_estimate", "scene", "refinements")
                  if name not in known]
        for name in changes:
            require_option("attribute of State", name, known)
        other = self._thawed()
        for name, value in changes.items():
            setattr(other, name, value)
        if {"u", "multipliers", "system", "load", "t"} & set(changes):
            other._verdict, other._force, other._seen = None, None, UNSEEN
        if {"u", "multipliers", "system"} & set(changes):
            other._motion = other._origin = other.memory = None
        other._freeze()
        return other

    def __repr__(self):
        return (f"<State of {len(self.system.beams)} beam(s), {self.system.N} coordinates, load "
                f"{self.load:g}: {self.message}>")

    def __str__(self):
        lines = [repr(self)[1:-1]]
        if self.base is not None:
            about = "a state under load" if self.base.u.any() else "the reference configuration"
            lines.append(f"  linear, for small displacements from {about}: no verdict on stability")
        elif self.t is None:
            lines.append(f"  equilibrium: {self.verdict}")
        if self.beams:
            lines += [f"  {line}" for line in str(self.checks).splitlines()]
        return "\n".join(lines)

    @property
    def verdict(self) -> Verdict | None:
        """Stability of an equilibrium, a :class:`~skfem_ancf.equations.stability.Verdict`. None for
        an instant of a motion, and for a linear solution, for which ``scene.buckling()`` gives the
        critical load."""
        if self._verdict is None and self.t is None and self.base is None:
            self._verdict = verdict(self._equations, np.array(self.u), self.load, self.multipliers)
        return self._verdict

    @property
    def stability(self) -> str | None:
        """"stable", "unstable" or "singular" (to round-off); "undecided" is possible with loads
        that have no potential, see ``state.verdict.note``. None where :attr:`verdict` is."""
        return None if self.verdict is None else self.verdict.stability

    @property
    def negative_pivots(self) -> int | None:
        """Number of unstable directions: negative eigenvalues of the constrained tangent. None
        where :attr:`verdict` is."""
        return None if self.verdict is None else self.verdict.negative_pivots

    @cached_property
    def checks(self) -> Checks:
        """Checks of the law's range and the mesh, a :class:`~skfem_ancf.results.checks.Checks`."""
        return check(self)

    @property
    def beams(self) -> tuple[Beam, ...]:
        """The beams of the scene."""
        return tuple(self.system.beams)

    @property
    def bodies(self) -> tuple[RigidBody, ...]:
        """The rigid bodies of the scene."""
        return tuple(self.system.bodies)

    @property
    def q(self) -> Array:
        """Degrees of freedom in the deformed configuration, beam after beam, shape (N,)."""
        return np.concatenate([b.q0 for b in self.system.members]) + self.u

    @property
    def v(self) -> Array:  # type: ignore[override]
        """Velocity of the degrees of freedom, shape (N,); zero where there is no motion."""
        return np.zeros_like(self.u) if self._motion is None else self._motion.v

    @cached_property
    def _equations(self):
        """The system after the history of this state."""
        return self.system.after(self.memory)

    # linear solutions

    @cached_property
    def _places(self) -> Array:
        """Displacement at which fields are evaluated, (N,); for a linear solution a step from its
        base."""
        return self.u if self.base is None else step(self.base.u, self.u)

    def _places_of(self, beam):
        return self._places[self.system.of(self._member(beam))]

    @property
    def _unit(self):
        """Factor of load factors: a step for a linear solution from rest, else 1."""
        base = self.base
        return 1.0 if base is None or base.load or base.u.any() else step(0.0, 1.0)

    @property
    def _acted(self):
        """Displacement at which forces act, (N,): that of the base in linear theory."""
        return self.u if self.base is None else self.base.u

    @property
    def _time(self):
        return self.load if self.t is None else self.t

    # at material points

    def strain(self, point: Any, beam: WhichBeam = None, recover: bool = True,
               line: int | None = None) -> Array:
        """Green-Lagrange strain (eps_xx, eps_yy, eps_xy) in the beam's frame, (3,) or (3, n). In a
        domain the components are in global axes. For a linear solution the linear strain. Raises
        InputError if several lines or beams are equally near to a point, as at a node."""
        def of(part):
            if not isinstance(part, BeamPoints):
                return self.values_of(part, recover).strain
            return part.strain(self._places, self._recovery_of(part.number) if recover else None)

        values = self._at_points(of, point, beam, recover, line)
        if np.iscomplexobj(values):
            values = first_order(values)
        return (values.T * [1.0, 1.0, 0.5]).T

    def stress(self, point: Any, beam: WhichBeam = None, recover: bool = True,
               line: int | None = None) -> Array:
        """Second Piola-Kirchhoff stress (S_xx, S_yy, S_xy) in the beam's frame, (3,) or (3, n)."""
        return self._at_points(lambda part: self.values_of(part, recover).S, point, beam, recover,
                               line)

    def field(self, field: Any, point: Any, beam: WhichBeam = None,
              recover: bool = True, line: int | None = None) -> Array:
        """Any field at material points, () or (n,); components of vectors and tensors come first.

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
        found = find_field(field)
        out = self._at_points(lambda part: found.of(self.values_of(part, recover)), point, beam,
                              recover, line)
        if found.name in PLASTIC and found.name != "yield_ratio" and np.isnan(out).all():
            raise no_value(found)  # the ratio of what does not yield is NaN
        return out

    def _at_points(self, of, point, beam, recover, line):
        """What a function returns of the points of each member, in the order of the points."""
        require_flag("recover", recover)
        at = self.system.points.find(point, beam, line, ask=True)
        return at.gather([of(part) for part in at.parts])

    def values_of(self, part: Any, recover: bool = True) -> Values:
        """All fields at points of a member, for pictures and files, too."""
        if isinstance(part, DomainPoints):
            return DomainValues(part.body, part.start, *part.fields(self._places))
        return Values(part, self._places, partial(self._recovery_of, part.number) if recover else
                      None, self._eigenstrains(part.beam), self._with_history(part.beam))

    def _with_history(self, beam):
        return (self.base or self)._equations.histories.beam(beam)

    def _eigenstrains(self, beam):
        return [(self._unit * self.load * load.factor(self.t), load) for load in self.system.loads
                if isinstance(load, EigenStrain) and load.beam is beam]

    # derivatives of static solutions by parameters

    def gradient(self, J: Any, wrt: Sequence[Any]) -> list[Array]:
        """Derivatives of a reading of this static solution by parameters of its scene.

        A list with an array of the shape of each parameter; with the first axis of J if J is an
        array. One linear system for all parameters; fields cost about as much as numbers.

        Parameters
        ----------
        J
            The name of a sensor of the scene, a :class:`~skfem_ancf.dynamics.sensors.Sensor`, or a
            function of the State that returns a number or an array; see
            :class:`~skfem_ancf.Design`. A function is also called with states of changed beams: it
            names these by number or name.
        wrt
            Parameters as ``(object, name)``: a beam, material, rigid body or item of the scene, and
            an argument of it that is a number or an array. Beams have the arguments of their
            material and mesh, too. ``(beam, "height", "nodes")`` and ``(beam, "height",
            "elements")`` are fields; "E" and "width" may be fields as well.

        Examples
        --------
        The deflection of a cantilever is 4 F L^3 / (E b h^3):

        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line([0, 1], 0.01), ElementBeamCable(5),
        ...             StVenantKirchhoff(2e8, 0.3), width=0.01)
        >>> scene = Scene(beam).clamp("left").sensor("tip", "displacement", at=(1, 0))
        >>> state = scene.point_force((0, -1e-4), at=(1, 0)).solve_static()
        >>> by_h, by_E = state.gradient("tip", [(beam, "height"), (beam, "E")])
        >>> w = state.displacement((1, 0))[1]
        >>> round(float(by_h[1] * 0.01 / w), 3), round(float(by_E[1] * 2e8 / w), 3)
        (-3.0, -1.0)
        """
        return self._derivatives(wrt, [J])

    def sensitivity(self, wrt: Sequence[Any]) -> list[Array]:
        """Derivatives of all displacements of this static solution by few parameters: a list of
        arrays (N, ...) with the axes of each parameter.

        Parameters
        ----------
        wrt
            As for :meth:`gradient`.
        """
        return self._derivatives(wrt)

    def _derivatives(self, wrt, readings=()):
        refuse(self.system.derivatives is None, "this state does not know its scene, as after a "
               "pickle: solve it again, or use a skfem_ancf.Design")
        return self.system.derivatives(self, wrt, readings).found()

    # recovered fields

    def recovery(self, beam: WhichBeam = None) -> Recovery | None:
        """The recovered field of a beam, a :class:`~skfem_ancf.recovery.recovered.Recovery`. None
        where the field cannot be recovered; :attr:`recovered` has the reason."""
        return self._recovery_of(self.beams.index(select_beam(self.beams, beam)))

    def _recovery_of(self, k, fields=True):
        """:meth:`recovery` of beam ``k``; with ``fields=False`` section forces suffice."""
        if k not in self._recoveries:
            # states of a motion are recovered together
            mates, known = [one for one in vars(self).get("_mates", [self])
                            if k not in one._recoveries], []
            for one in mates:
                try:
                    known.append((one, one._section_forces(k)))
                except NotRecovered as failure:
                    one._recoveries[k] = failure
            with np.errstate(all="ignore"):
                together = Recovery.together([forces for _, forces in known],
                                             [one._places_of(k) for one, _ in known])
            for (one, _), found in zip(known, together):
                one._recoveries[k] = found
            for one in mates:
                if why := one._recoveries[k].why:
                    logger.info("%r: strain and stress are those of the elements: %s",
                                self.beams[k], why)
        found = self._recoveries[k]
        return None if isinstance(found, NotRecovered) or fields and found.why else found

    def _section_forces(self, number):
        """The SectionForces of a beam; raises NotRecovered."""
        beam, system, unit, base = self.beams[number], self.system, self._unit, self.base
        if base is not None and not np.iscomplexobj(unit):
            raise NotRecovered("it is linearised about a state that is not free of load, a mode of "
                               "it: its strain and stress are those of the elements")
        s = system.of(beam)
        acting = [(unit * self.load, load, self.t) for load in system.loads]
        acting += [(unit, e.load, self._time) for e in system.forces.elements
                   if isinstance(e, MemberForce) and e.load]
        loads: list[Any] = []
        for scale, load, t in acting:
            if load.beam is beam:
                at_rest = base is not None and not load.first_order
                factor, now = load.factor_and_load(t)
                if isinstance(load, EigenStrain):  # of nonlinear laws it has its size in itself
                    factor = load.factor(t)
                loads.append((scale * factor, now.distribution(
                    (base if at_rest else self).u_of(number))))
        points: list[Any] = []
        if base is None and (system.forces.contacts.groups or system.forces.changing):
            points = loads_of_contact(self, beam, s)
            loads.append((1.0, Distribution(stations=tuple(e + xi for e, xi, _ in points),
                                            points=tuple(points))))
        sampled, places = self._distributed(beam)
        acceleration = viscous = None
        if self.acceleration is not None:
            acceleration = unit * (self.acceleration + system.damping.mass * self.v
                                   + system.modal_damping.acceleration(self.v))[s]
        time = system.retardation[number]
        if self.t is not None and time:
            viscous = beam.kernel.viscous_forces(self.u[s], self.v[s], time)
        with np.errstate(all="ignore"):
            return SectionForces(self._with_history(beam), self._places_of(number), loads,
                                 [*self._stations[number], *places], acceleration, sampled,
                                 viscous, len(points) > 0)

    def _distributed(self, beam):
        """Densities of distributed force elements, and axial coordinates of concentrated ones."""
        system, base = self._equations, self.base
        sampled: list[Sampled] = []
        places: list[float] = []
        elements = [e for e in system.forces.elements
                    if e.distributed and not e.groups and not hasattr(e, "loads_on")]
        if not elements:
            return sampled, places
        tables = system.backend.tables.plain.forces
        force = -(system.forces.part_forces(tables, self.u, self.v) if base is None else self._unit
                  * system.forces.small_part_forces(tables, self.load, base.u, self.u - base.u))
        for element in elements:
            if element.along is None:
                raise NotRecovered(f"the distribution of {element!r} along the beam is not known")
            where, facets, at = element.along
            if where is not beam:
                continue
            places += at
            rows = system.forces.rows_of(element)
            for group in facets:
                w = np.linalg.solve(np.vander(group.xi, increasing=True).T,
                                    1.0 / np.arange(1, len(group.xi) + 1))  # of its own rule
                values = force[:, rows[len(w) * group.chosen[:, None] + np.arange(len(w))]] / w
                sampled.append(Sampled(group.where, group.elements, group.xi, values))
        return sampled, places

    @property
    def recovered(self) -> dict[Any, str]:
        """For each beam, by name or number, "" if its fields are recovered, else the reason: dict.
        Recovery needs an equilibrium, static or dynamic, and known distributions of loads.
        Otherwise strain and stress are those of the elements."""
        out = {}
        for k, beam in enumerate(self.beams):
            self._recovery_of(k)
            out[k if beam.name is None else beam.name] = self._recoveries[k].why
        return out

    @cached_property
    def _recoveries(self):
        return {}

    @cached_property
    def _stations(self):
        """Axial coordinates (element + xi) of supports and joints, a list for each beam."""
        system = self.system
        fixed = np.zeros(system.N, dtype=bool)
        fixed[system.constraints.fixed] = True
        acting, own = self._equations.forces.acting_rows(self._acted, self._time)
        J = None
        if system.constraints.m or len(acting):
            J = sparse.vstack([system.constraints.sparse_jacobian(self._acted, self._time),
                               acting]).tocsc()
        out: list[list[float]] = []
        for beam, s in zip(system.beams, system.slices):
            nodes = np.nonzero(np.any(fixed[s].reshape(-1, beam.nd), axis=1))[0]
            found = [station_of_node(beam.mesh, int(k)) for k in nodes]
            here = None if J is None else J[:, s]
            for row in () if here is None else here[np.unique(here.indices)].toarray():
                found += _acting_at(beam, row)
            places = np.sort([x for row in own[:, s] for x in _acting_at(beam, row)])
            # forces of one point differ by round-off
            out.append([*found, *places[np.diff(places, prepend=-1.0) > SAME]])
        return out

    def resultants(self, at: Any = None, beam: WhichBeam = None, recover: bool = True,
                   line: int | None = None, sections: int = ALONG_ELEMENT) -> Resultants:
        """Normal force, shear force and bending moment along a beam, with the strains of its axis.

        Raises InputError if several lines or beams are equally near to a point, as at a node.

        Parameters
        ----------
        at
            Points on the sections: one, shape (2,), or many, shape (2, n) or a list; None for some
            sections in each element, and both sides of forces between nodes.
        sections
            Number of sections in each element without ``at``, its ends included.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.01), ElementBeamANCF(2),
        ...             StVenantKirchhoff(E=2e11, nu=0.3), width=0.01)
        >>> state = Scene(beam).clamp("left").point_force((0, -1), at=(1, 0)).solve_static()
        >>> state.resultants([(0, 0), (0.5, 0)]).M.round(4).tolist()
        [-1.0, -0.5]
        """
        recover, chain, places, one = require_flag("recover", recover), None, None, False
        sections = require_integer("sections", sections, 2, 10000)
        if at is not None:
            found = self.system.points.find(at, beam, line, ask=True)
            refuse(len(found.parts) != 1, "points are in several beams: choose one with beam=")
            part, one = found.parts[0], found.one
            k, places = part.number, (part.e, part.X[0])
        else:
            if line is not None:
                beam, chain = self.system.points.chain_of(line, beam)
            k = self.beams.index(select_beam(self.beams, beam))
        of = self.beams[k]
        values = resultants(self._with_history(of), self._places_of(of),
                            self._recovery_of(k, fields=False) if recover else None,
                            self._eigenstrains(of), places, chain, sections)
        return values.first() if one else values

    # of the whole

    def contact(self, obstacle: int | Item | None = None,
                on: WhichMember = None) -> Contact:
        """Contact points and pressures of obstacles, and of members that touch each other.

        Raises InputError if there is no contact.

        Parameters
        ----------
        obstacle
            The number of an obstacle, or the item: an :class:`~skfem_ancf.Obstacle` or
            :class:`~skfem_ancf.BodyContact`; None for all.
        on
            The member whose surface it is, by object, name or number; None for all, with the forces
            on both sides of members that touch each other.
        """
        return contact_of(self, obstacle, on)

    @property
    def strain_energy(self) -> float:
        """Strain energy of the scene. It is W(E) of the total strain, also under temperatures and
        eigenstrains E0: the field "energy" is W(E - E0), and the difference is the potential of
        these loads."""
        if self.base is not None:
            return linear_energy(self._equations, self.base.u, self.u - self.base.u, self.load)
        return self._equations.strain_energy(self.u, self._time)

    @property
    def internal_force(self) -> Array:
        """Internal force on all degrees of freedom, shape (N,)."""
        if self._force is None:
            self._force = (
                self._equations.internal_force(self.u, self.t, self.load) if self.base is None else
                linear_force(self._equations, self.base.u, self.u - self.base.u, self.load))
        return self._force

    def reactions(self, boundary: Place | None, beam: WhichMember = None) -> Reaction:
        """Reactions of the supports at a boundary: force, moment, and by degree of freedom.

        Supports are clamps, pins and fixed DOFs, at any angle, and joints between a section, or a
        rigid body, and the ground with linear equations, as a line or a given position.

        Parameters
        ----------
        boundary
            The name of a boundary, or other facets as in scikit-fem; nodes of a frame, see
            :meth:`Frame.nodes <skfem_ancf.scene.frame.Frame.nodes>`, without ``beam``.
        """
        system, frame = self.system, self.system.constraints.frame
        if frame is not None and beam is None:
            multipliers = self.multipliers[:len(frame.equations)]
            return Reaction(*frame.reaction(boundary, self._acted, multipliers))
        member = self._member(beam)
        s = system.of(member)
        nodes = np.unique(member.dofs(boundary) // member.nd)
        there = np.zeros(system.N, dtype=bool)
        there[s].reshape(-1, member.nd)[nodes] = True
        support = self._support_force()
        force, touched = system.constraints.force_on(there, self.multipliers, support)
        total = np.where(system.constraints.free, 0.0, support) + force
        forces = total[s].reshape(-1, member.nd // 2, 2)[nodes]
        arm = (member.q0_local + self._acted[s]).reshape(-1, member.nd // 2, 2)[nodes]
        one, centre = np.ones(len(nodes)), arm[0, 0].copy()
        if isinstance(member, Domain):  # a unit translation, of DOFs that are no positions too
            one = member.rigid_motions()[::2, 0][nodes]
            centre = one @ arm[:, 0] / one.sum()
        arm[:, 0] -= one[:, None] * centre
        moment = np.sum(arm[..., 0] * forces[..., 1] - arm[..., 1] * forces[..., 0])
        holds = (~system.constraints.free | touched)[s].reshape(-1, member.nd)[nodes].any(axis=0)
        names = {n: float(v) for n, v, held in zip(
            member.dofnames, np.tensordot(one, forces, 1).ravel(), holds) if held}
        refuse(frame is not None and not names, "no support of beam {!r} at {!r}: for supports of "
               "a frame give its nodes, without beam=", beam, boundary)
        return Reaction(one @ forces[:, 0], float(moment), names)

    def _support_force(self):
        """Force of the supports, (N,): minus all other forces and inertia."""
        system = self.system
        loads = system.external_force(self.u, self.t) if self.base is None else (
            linear_external_force(system, self.base.u, self.u - self.base.u))
        total = self.internal_force - self.load * loads + self._inertia
        if system.constraints.joints:
            total = total + self.multipliers @ system.constraints.full_jacobian(
                self._acted, self._time)
        return total

    def spring_force(self, spring: Any = 0) -> float:
        """Tension of a spring, or moment of a torsional spring against its rotation, with the force
        of the dashpot.

        Parameters
        ----------
        spring
            One of ``scene.elements``, or its number among the springs and torsional springs of the
            scene, in the order in which they were added.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line([0, 1], 0.1), ElementBeamCable(5),
        ...             StVenantKirchhoff(1e9, 0.3), width=0.1)
        >>> scene = Scene(beam).pin("left").spring(100.0, ((1, 0), (1, 1)), length=0.9)
        >>> state = scene.line_load((0, -20.0)).solve_static()
        >>> round(state.spring_force(), 2)
        10.0
        """
        self._equations.forces.recall()
        return spring_force(self.system.forces.elements, spring, self.u, self.v,
                            None if self.base is None else self.base.u)

    def joint_force(self, joint: Joint) -> Array:
        """Force of a joint on its first beam, in the order of ``joint.equations``; (m,)."""
        return self.system.constraints.joint_force(
            joint, self.multipliers, self._support_force(), self._acted, self._time)


def _acting_at(beam, row):
    """Where a nodal force (N,) acts; between neighbouring nodes it is at both."""
    loaded = np.nonzero(np.any(row.reshape(-1, beam.nd) != 0, axis=1))[0]
    return stations_of_vector(beam, row) or [station_of_node(beam.mesh, int(k)) for k in loaded]
