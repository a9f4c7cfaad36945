"""The discrete equations of a scene: forces, tangent, mass and constraints."""

from collections.abc import Callable, Sequence
from functools import wraps
from itertools import accumulate, count, pairwise
from math import sqrt
from typing import Any, TypeVar, cast
from weakref import proxy

import numpy as np
from scipy import sparse

from ..actions.bound import BoundConstraint, BoundForce, MemberForce
from ..actions.contact.tables import ANCHORED
from ..actions.forces.kernels import add_resisting_force
from ..actions.forces.system import Forces
from ..actions.joints.base import UnitDirector
from ..actions.joints.nodes import chain_places
from ..actions.loads import EndMoment, Load
from ..actions.tables import MATERIALS, carry_eigenstrains
from ..beam import Beam, Domain, PointLocator, RigidBody, bent
from ..core import Array, BandMatrix, cached_property, refuse
from ..materials.damping import UNDAMPED, Damping
from ..mesh.mesh_beam import reach
from . import evaluation
from .backend import Backend
from .constraints import Constraints
from .histories import Histories
from .linear_solver import LinearSolver, MassSolver, ModalDamping

# energy scales of a scene, for round-off

EPS = float(np.finfo(float).eps)


class Scales:
    """Energy scales of a system that do not depend on a displacement."""

    def __init__(self, system: Any) -> None:
        self._system = proxy(system)

    @cached_property
    def energy_of_strains(self) -> float:
        """Modulus times volume, or :attr:`energy_of_bodies`."""
        s = self._system
        return (sum(b.kernel.scale for b in s.beams) + sum(d.scale for d in s.domains)
                or self.energy_of_bodies)

    @cached_property
    def energy_of_bodies(self) -> float:
        """Energy scale of springs and loads for rigid bodies alone, else 0; 1 without any force."""
        s = self._system
        if s.beams or s.domains:
            return 0.0
        springs = abs(s.element_stiffness())
        force = np.max(np.abs(s.external_force(np.zeros(s.N))))
        stiffness = springs.max() if springs.nnz else 0.0
        return float(stiffness * s.size**2 + force * s.size) or 1.0

    @cached_property
    def strain_noise(self) -> float:
        """Root of the energy of strains of size eps: eps sqrt(modulus times volume)."""
        return EPS * sqrt(self.energy_of_strains)

    @cached_property
    def work_noise(self) -> float:
        """Root of the work of a correction that is round-off."""
        # The round-off of displacements is eps times the size of the scene, that of their gradients
        # is larger by one over the length of an element.
        s = self._system
        if not s.beams and not s.domains:
            return self.strain_noise
        total = sum(b.kernel.scale / float(b.mesh.lengths.sum())
                    * float((1.0 / b.mesh.lengths).sum()) for b in s.beams)
        total += sum(float(abs(d.matrix().diagonal()).sum()) for d in s.domains)
        return EPS * s.size * sqrt(total)

    @cached_property
    def force_noise(self) -> float:
        """:attr:`work_noise` of a residual, which sums the round-off of all DOFs of a node."""
        return self.work_noise * sqrt(max(b.nd for b in self._system.members))

    @cached_property
    def bending_eigenvalue(self) -> float:
        """omega^2 of the slowest bending of a beam as long as the scene, about."""
        # For rigid bodies, that of their total mass on one spring of the scene's stiffness.
        s = self._system
        if not s.beams:
            mass = sum(body.total_mass for body in s.members)
            return self.energy_of_strains / (mass * s.size**2) or 1.0
        return float(min((b.across.bending[:, None] / b.across.moments(
            np.array([0.5]), what="mass")[0]).min() for b in s.beams)) * (np.pi / s.size) ** 4

    @cached_property
    def inertia_of_places(self) -> float:
        """Mass times squared positions, for the round-off of joints of bodies and of motions."""
        s = self._system
        if not s.bodies and not s.constraints.drives:
            return 0.0
        turn = np.concatenate([b.rigid_motions() @ (-b.origin[1], b.origin[0], 1.0)
                               for b in s.members])
        return float(turn @ s.mass.multiply(turn))


T = TypeVar("T")


def shared(make: Callable[[Any], T]) -> T:
    """A property that is computed once for a scene, whatever its history."""
    @wraps(make)
    def of_whole(self):
        return make(self) if self._whole is None else getattr(self._whole, make.__name__)

    return cached_property(of_whole)  # type: ignore[return-value]


class System:
    """The discrete equations of a scene.

    The unknowns are the displacement ``u`` of all degrees of freedom from the reference
    configuration, and a multiplier for each equation of a joint: ``M u'' + f(u) + J^T lambda = load
    Q(u)``, ``Phi(u, t) = 0``, ``J = dPhi / du``. Methods take displacement and velocity u and v
    (N,), time t (None for loads at full size) and the load factor of statics.

    DOFs are in the order of the ``members``: beams, bodies, domains; ``fixed`` ones have the
    displacements ``values`` at full load. ``rest_modes(system, k)`` returns k angular frequencies
    and shapes (k, N) for modal damping. ``symmetric``: all loads and force elements have a
    potential; ``items`` are the actions as given, for plots (None in a copy in another process),
    ``derivatives`` those of a :class:`~skfem_ancf.scene.design.Gradient`, ``clock`` the time in
    statics, see :meth:`at`.
    """

    def __init__(self, beams: Sequence[Beam], loads: Sequence[Load], fixed: Array, values: Array,
                 joints: Sequence[BoundConstraint] = (), damping: Damping | None = None,
                 elements: Sequence[BoundForce] = (), bodies: Sequence[RigidBody] = (),
                 rest_modes: "Callable[[System, int], tuple[Array, Array]] | None" = None,
                 domains: Sequence[Domain] = ()) -> None:
        self._given: tuple[Any, ...] = (
            tuple(beams), tuple(loads), fixed, values, tuple(joints), damping, tuple(elements),
            tuple(bodies), rest_modes, tuple(domains))
        self.beams, self.bodies, self.loads = list(beams), list(bodies), list(loads)
        self.domains = list(domains)
        self.members: list[Any] = [*beams, *bodies, *domains]
        ends = list(accumulate((member.N for member in self.members), initial=0))
        self.N, self.slices = ends[-1], [slice(a, b) for a, b in pairwise(ends)]
        self._index = {id(member): k for k, member in enumerate(self.members)}
        self.size = max([0.0, *(domain.size for domain in domains)])
        if beams or bodies:
            corners = [body.outline_at(np.zeros(body.N)) for body in bodies if not beams]
            self.size = max(self.size, beams[0].size if len(beams) == 1 else
                            reach([b.mesh for b in self.beams]) if beams else
                            float(np.max(np.ptp(np.concatenate(corners, axis=1), axis=1))))
        directors = [UnitDirector(body, self.of(body).start) for body in self.bodies
                     if len(np.intersect1d(fixed, self.of(body).start + np.arange(2, 4))) < 2]
        self.constraints = Constraints(self.members, self.slices, self.size, fixed, values,
                                       [*directors, *joints],
                                       self._holding if elements or any(
                                           map(_holds, self.loads)) or any(
                                               domain.held for domain in domains) else None)
        self.forces = Forces([*elements, *(MemberForce(domain, self.of(domain).start)
                                           for domain in domains)], self.N, self.bandwidth,
                             None if self.constraints.frame is None else chain_places(self.beams))
        self._whole: System | None = None
        self.histories = Histories(self.forces, self.beams, self.slices)
        self.forces = self.histories.forces
        self.symmetric = all(load.symmetric for load in self.loads) and self.forces.symmetric
        self.damping = UNDAMPED if damping is None else damping
        refuse(self.damping.stiffness and domains, "damping(stiffness=...) acts on strain rates, "
               "which the forms of {[0]!r} do not have: give beams damping=KelvinVoigt(time), and "
               "the scene damping(modal=...) or damping(mass=...)", domains)
        self._rest_modes = rest_modes
        self.items: tuple[Any, ...] | None = None
        self.derivatives: Any = None
        self.units: tuple[str, str] | None = None
        self.clock: float | None = None
        self._varying: list[Any] = []
        self.constant_force = np.zeros(self.N)
        for load in self.loads:
            if load.constant and load.amplitude is None:
                self.constant_force[self.of(load)] += load.force(np.zeros(load.beam.N))
            else:
                self._varying.append(load)

    def __getstate__(self):
        return self._given

    def __setstate__(self, given):
        self.__init__(*given)

    def __copy__(self):
        return self

    def __deepcopy__(self, memo):
        return self

    def after(self, history: Array | None = None, span: float = 0.0) -> "System":
        """The equations after a history (n,), by default at rest, for an increment of a time span.
        It is a system of its own, which a search in contact or the kernels of steps may change; all
        that no history changes is shared."""
        if not self.histories.values.size:
            return self
        whole, other = self._whole or self, object.__new__(System)
        vars(other).update((name, x) for name, x in vars(whole).items()
                           if name not in ("backend", "solver", "_spare"))
        other._whole, other.clock = whole, self.clock
        other.histories = whole.histories.after(history, span)
        other.forces = other.histories.forces
        return other

    def recycled(self, history: Array | None, span: float) -> "System":
        """:meth:`after` for an increment, in the arrays of an earlier one if there was one: its
        tables for compiled code, and what it knows about where nothing touches, stay."""
        if not self.histories.values.size:
            return self
        other = vars(self._whole or self).pop("_spare", None)
        if other is None:
            return self.after(history, span)
        other.clock = self.clock
        other.histories.put(history)
        other.histories.span[0] = span
        for pair in other.forces.pairs:  # search anew: facets are near, and steps begin, elsewhere
            pair.skin[:], pair.start_at[:] = 0.0, np.nan
        return other

    def recycle(self) -> None:
        """Leave the arrays of this increment to the next one."""
        if self._whole is not None and self.histories is not self._whole.histories:
            vars(self._whole)["_spare"] = self

    def sticking(self) -> "System":
        """The equations in whose tangents all points that touch an obstacle stick."""
        if not self.forces.contacts.anchored:
            return self
        other = self.after(self.histories.values, float(self.histories.span[0]))
        # Points that have slipped are at the limit of friction, on one side of it or the other by
        # the last digit; and of a disturbance either way friction resists one.
        other.forces.contacts.tables.memory[ANCHORED] *= 2.0
        return other

    def of(self, load_or_member: Load | Beam | RigidBody | Domain) -> slice:
        """The DOFs of a member, or of the member of a load."""
        return self.slices[self._index[id(getattr(load_or_member, "beam", load_or_member))]]

    # parts

    @shared
    def points(self) -> PointLocator:
        """Location of material points."""
        frame = self.constraints.frame
        return PointLocator(self.beams, self.slices, self.members[len(self.beams):],
                      None if frame is None else frame.lines)

    @cached_property
    def backend(self) -> Backend:
        """Runs kernels in NumPy or compiled."""
        whole = self._whole
        return Backend(self) if whole is None else whole.backend.after(
            whole.backend.tables.after(self))

    @shared
    def scales(self) -> Scales:
        """Energy scales and round-off."""
        return Scales(self)

    @cached_property
    def solver(self) -> LinearSolver:
        """Solves with :attr:`K`, supports and joints."""
        return LinearSolver(self) if self._whole is None else self._whole.solver.after(self)

    @shared
    def mass_solver(self) -> MassSolver:
        """Solves with the mass matrix, supports and joints."""
        return MassSolver(self)

    @shared
    def without_contact(self) -> "System | None":
        """The equations without contact of members, after the same histories; None if there is
        none."""
        given, elements = list(self._given), self._given[6]
        given[6] = [e for e in elements if not hasattr(e, "broad_search")]
        if len(given[6]) == len(elements):
            return None
        other = System(*given)
        other.histories = self.histories.of(other.forces)
        other.forces = other.histories.forces
        return other

    @shared
    def starts_untouched(self) -> bool:
        """True if members do not touch in the reference configuration."""
        return all(hasattr(e, "least_gap") and e.least_gap(np.zeros((len(at) // 2, 2))) > 0.0
                   for e, at in self.forces.changing)

    # loads

    def at(self, t: float) -> "System":
        """The equations in which functions of time are those at t in statics."""
        other = object.__new__(System)
        vars(other).update(vars(self), clock=t, backend=self.backend, solver=self.solver,
                           _whole=self._whole or self)
        return other

    def external_force(self, u: Array, t: float | None = None) -> Array:
        """The force of all loads at full size, shape (N,)."""
        t = self.clock if t is None else t
        out = self.constant_force.copy()
        for load in self._varying:
            s, (factor, acting) = self.of(load), load.factor_and_load(t)
            out[s] += factor * acting.force(u[s])
        return out

    def load_potential(self, u: Array, t: float | None = None,
                       turned: Array | None = None) -> float:
        """Potential of the loads; loads without a potential count as zero."""
        # ``turned`` (k,) are the rotations of the sections of moments, with whole turns; by default
        # those of u.
        t, total, number = self.clock if t is None else t, 0.0, count()
        for load in self.loads:
            factor, acting = load.factor_and_load(t)
            if turned is not None and load.turning:
                total -= factor * cast("EndMoment", load).M * turned[next(number)]
            else:
                total += factor * (acting.potential(u[self.of(load)]) or 0.0)
        return float(total)

    @property
    def varies(self) -> bool:
        """True if supports or loads may depend on time."""
        return bool(self._varying) or self.constraints.moves

    # beams and force elements

    def internal_force(self, u: Array, t: float | None = None, load: float = 1.0) -> Array:
        """The force of beams and force elements, shape (N,)."""
        self._require_displacement(u)
        if not (u.any() or self.forces.elements) and all(b.kernel.linear for b in self.beams):
            return np.zeros(self.N)  # without round-off
        self._carry(t, load)
        return self._force(evaluation.force, u, at=self._time(load, t))

    def mean_internal_force(self, u0: Array, u1: Array, t: float | None = None) -> Array:
        """The internal force (N,) whose work from u0 to u1 is the change of the strain energy."""
        self._carry(t, 1.0)
        return self._force(evaluation.mean_force, u0, u1, at=self._time(1.0, t))

    def accept(self, u0: Array, u: Array, load: float, t: float) -> tuple[Array | None, float]:
        """The history after an increment in statics from u0 to u, and what it dissipates."""
        # ``t`` is the time of obstacles and items.
        self._carry(None, load)
        return self.histories.accept(u0, u, t)

    def _carry(self, t, load):
        """Let materials with a history have the eigenstrains of the loads."""
        if self.histories.lasting >= MATERIALS:
            t, tables = self.clock if t is None else t, self.backend.tables
            carry_eigenstrains(tables.plain.loads, tables.static_factors(load) if t is None else
                               load * tables.factors(np.array([t]))[0])

    def strain_energy(self, u: Array, t: float = 1.0) -> float:
        """Strain energy of beams and potential of force elements."""
        return float(self.energy_of_beams(u) + self.energy_of_forces(u, t))

    def energy_of_beams(self, u: Array) -> Any:
        """Strain energy of the beams: for u (N,) a number, for (k, N) an array (k,)."""
        if not u.any() and all(b.kernel.linear for b in self.beams):
            return np.zeros(u.shape[:-1])[()]
        return sum(self.histories.kernel(b).energy(u[..., s])
                   for b, s in zip(self.beams, self.slices))

    def energy_of_forces(self, u: Array, t: float = 1.0) -> float:
        if not self.forces.elements:
            return 0.0
        return self.forces.potential(self.backend.tables.plain.forces, u, t)

    def inverted(self, u: Array) -> bool:
        """True if an element is turned inside out."""
        for beam, s in zip(self.beams, self.slices):
            if beam.has_sections and beam.kernel.inverted(u[s]):
                return True
        for domain in self.domains:
            if domain.inverted(u[self.of(domain)]):
                return True
        return False

    def folded(self, u: Array) -> bool:
        """True if the axis folds back within an element."""
        return any(bent(beam, u[s])[1] for beam, s in zip(self.beams, self.slices))

    def element_stiffness(self, u: Array | None = None, at: float = 0.0) -> sparse.csr_array:
        """The stiffness of force elements, shape (N, N), by default in the reference configuration.
        ``at`` is the time, or the load factor in statics."""
        u = np.zeros(self.N) if u is None else u
        i, j, v = self.forces.entries(self.backend.tables.plain.forces, at, u, 0.0 * u, 0.0)
        return sparse.csr_array((v, (i, j)), shape=(self.N, self.N))

    def _holding(self):
        """Stiffness that may constrain rigid motions: of force elements and user-defined loads."""
        K = self.element_stiffness()
        for load in filter(_holds, self.loads):
            first, (i, j, v) = self.of(load).start, load.stiffness(np.zeros(load.beam.N))
            K = K - sparse.csr_array((v, (first + i, first + j)), shape=K.shape)
        return K

    # damping

    @shared
    def retardation(self) -> list[float]:
        """The retardation time of each beam."""
        return [self.damping.stiffness + (b.damping.time if b.damping else 0.0)
                for b in self.beams]

    @property
    def viscous(self) -> bool:
        """True if a beam has viscous damping."""
        return max(self.retardation, default=0.0) > 0.0

    @property
    def damped(self) -> bool:
        """True if a force depends on velocities."""
        return self.viscous or bool(self.damping) or self.forces.resists

    @shared
    def modal_damping(self) -> ModalDamping:
        return ModalDamping(self, self._rest_modes)

    def damping_force(self, u: Array, v: Array, t: float | None = None) -> Array:
        """The damping force at u and v, shape (N,)."""
        force = self._force(evaluation.viscous_force, u, v) if self.viscous else np.zeros(self.N)
        if self.forces.resists:
            add_resisting_force(self.backend.tables.plain.forces, 0.0 if t is None else t, u, v,
                                force)
        if self.damping.mass:
            force += self.damping.mass * self.mass.multiply(v)
        return force + self.modal_damping.force(v)

    # matrices

    @property
    def bandwidth(self) -> int:
        """Number of subdiagonals of tangent and mass matrix."""
        return max([2 * b.nd - 1 for b in self.members] + [d.bandwidth for d in self.domains])

    def new_band(self) -> BandMatrix:
        return BandMatrix.zeros(self.N, self.bandwidth, self.symmetric)

    @shared
    def mass(self) -> BandMatrix:
        M = self.new_band()
        for beam, s in zip(self.beams, self.slices):
            for first in range(0, beam.mesh.nelements, 1024):  # to limit the memory
                part = slice(first, first + 1024)
                M.add_elements(beam.mass_elements(part), s.start, beam.nd, beam.mesh.t[0, part])
        for mass in self.forces.masses:
            M.add(*mass.mass_entries())
        for body in self.members[len(self.beams):]:
            i, j, values = body.mass_entries()
            M.add(self.of(body).start + i, self.of(body).start + j, values)
        return M

    @shared
    def K(self) -> BandMatrix:
        """The tangent within the band, set by :meth:`assemble`."""
        return self.new_band()

    def assemble(self, u: Array, load: float = 1.0, independent: Array | None = None,
                 geometric: bool = True, t: float | None = None) -> tuple[Array, Array]:
        """The internal force (N,) and stresses (n,); the tangent of the residual is in :attr:`K`.
        Its geometric part, with the stiffness of follower loads, has the ``independent`` stresses
        (see :meth:`linearised_stress`) if given; linear theory has none."""
        self._require_displacement(u)
        t = self.clock if t is None else t
        self.K.clear()
        self.solver.assembled_at(u, load if t is None else t)
        tables = self.backend.tables
        stresses, force, at = tables.stresses, np.zeros(self.N), self._time(load, t)
        if not geometric:
            independent = np.zeros_like(stresses)
        factors, time = tables.static_factors(load), np.nan if t is None else float(t)
        if t is None and not geometric:
            factors, time = tables.linear_factors(load), np.inf
        elif t is not None and self._varying:
            factors = load * tables.factors(np.array([t]))[0]
        self._carry(t, load)
        given = tables.stresses if independent is None else independent
        with np.errstate(all="ignore"):
            self.backend.of(evaluation.tangent)(
                np.array(u, dtype=float), factors, time, float(load), at, independent is not None,
                stresses, given, force)
        return force, stresses

    def linearised_stress(self, u: Array, stresses: Array, du: Array) -> Array:
        """Stresses (n,) at u, linearised to ``u + du``: S + C B(u) du."""
        independent = np.zeros_like(stresses)
        with np.errstate(all="ignore"):
            self.backend.of(evaluation.linearised)(u, du, stresses, independent)
        return independent

    def _force(self, kernel, *displacements, **at):
        """The force (N,) of a function of :mod:`skfem_ancf.equations.evaluation`."""
        force = np.zeros(self.N)
        with np.errstate(all="ignore"):
            self.backend.of(kernel)(*(np.array(u, dtype=float) for u in displacements),
                                    *at.values(), force)
        return force

    def _time(self, load, t):
        """The time, or the load factor in statics."""
        t = self.clock if t is None else t
        return float(load if t is None else t)

    def _require_displacement(self, u):
        refuse(u.shape != (self.N,), "the displacement must have the shape ({},), got {}: is it "
               "the state of another mesh?", self.N, u.shape)


def _holds(load):
    return not load.constant and load.first_order
