"""The discrete equations of a scene: forces, tangent, mass and constraints."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from itertools import accumulate, count, pairwise
from typing import Any, cast

import numpy as np
from scipy import sparse

from ..actions.forces.base import ForceElement
from ..actions.forces.domain import DomainForce
from ..actions.forces.kernels import add_resisting_force
from ..actions.forces.system import Forces
from ..actions.joints.base import Joint
from ..actions.joints.director import UnitDirector
from ..actions.loads import EndMoment, Load
from ..beam.beam import Beam
from ..beam.domain import Domain
from ..beam.kinematics import folded
from ..beam.points import Points
from ..beam.rigid import RigidBody
from ..core.errors import InputError
from ..core.linalg import BandMatrix
from ..core.types import Array
from ..materials.damping import UNDAMPED, Damping
from ..mesh.mesh_beam import reach
from .backend import Backend
from .constraints import Constraints
from .evaluation import CARRY, FORCE, MEAN, TANGENT, VISCOUS, evaluate
from .linear_solver import LinearSolver
from .mass_solver import MassSolver, ModalDamping
from .scales import Scales


class System:
    """The discrete equations of a scene.

    The unknown is the displacement ``u`` of all degrees of freedom from the reference
    configuration, beam after beam, and a multiplier for each equation of a joint:
    ``M u'' + f(u) + J^T lambda = load Q(u)``, ``Phi(u, t) = 0``, ``J = dPhi / du``.

    Parameters
    ----------
    beams
        The beams, in order.
    loads
        The loads of all beams.
    fixed, values
        Numbers of the fixed degrees of freedom and their displacements at full load, shape (n,).
    joints
        Joints, already bound.
    damping
        A :class:`~skfem_ancf.materials.damping.Damping`, or None.
    elements
        Force elements, already bound.
    bodies
        Rigid bodies, whose degrees of freedom come behind those of the beams.
    domains
        Domains, whose degrees of freedom come last.
    rest_modes
        ``rest_modes(system, k)`` returns k angular frequencies above those of rigid motions about
        the reference configuration, and their shapes (k, N); modal damping asks for them.

    Other Parameters
    ----------------
    u, v, t
        Displacement and velocity, shape (N,), and time; None is full size of loads.
    load
        Load factor of statics.

    Attributes
    ----------
    members : list
        Beams, rigid bodies and domains, with ``slices`` of the degrees of freedom.
    constraints : Constraints
        Supports and joints.
    forces : Forces
        Force elements.
    symmetric : bool
        The tangent is symmetric, as all loads and force elements have a potential.
    items : tuple or None
        What acts, as it was given, for pictures; None of a copy in another process.
    units : tuple of str or None
        Units of force and length, for pictures and files.
    clock : float or None
        The time at which statics takes functions of time, see :meth:`stopped_at`; None for full
        size of loads.
    """

    def __init__(self, beams: Sequence[Beam], loads: Sequence[Load], fixed: Array, values: Array,
                 joints: Sequence[Joint] = (), damping: Damping | None = None,
                 elements: Sequence[ForceElement] = (), bodies: Sequence[RigidBody] = (),
                 rest_modes: Callable[[System, int], tuple[Array, Array]] | None = None,
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
            self.size = max(self.size, _extent(self.bodies) if not beams else beams[0].size
                            if len(beams) == 1 else reach([b.mesh for b in self.beams]))
        directors = [UnitDirector(body, self.of(body).start) for body in self.bodies
                     if len(np.intersect1d(fixed, self.of(body).start + np.arange(2, 4))) < 2]
        self.constraints = Constraints(self.members, self.slices, self.size, fixed, values,
                                       [*directors, *joints],
                                       self._holding if elements or any(
                                           map(_holds, self.loads)) or any(
                                               domain.held for domain in domains) else None)
        self.forces = Forces([*elements, *(DomainForce(domain, self.of(domain).start)
                                           for domain in domains)], self.N, self.bandwidth)
        self.symmetric = all(load.symmetric for load in self.loads) and self.forces.symmetric
        self.damping = UNDAMPED if damping is None else damping
        if self.damping.stiffness and domains:
            raise InputError("damping(stiffness=...) resists rates of strains, which the forms of "
                             f"{domains[0]!r} do not know: give beams KelvinVoigt(time) as their "
                             "damping=, and the scene damping(modal=...) or damping(mass=...)")
        self._rest_modes = rest_modes
        self.items: tuple[Any, ...] | None = None
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
        """What it was made of: work arrays and factors are made again."""
        return self._given

    def __setstate__(self, given):
        self.__init__(*given)

    def __copy__(self):
        return self

    def __deepcopy__(self, memo):
        return self  # it is the same equations, however many states have them

    def of(self, load_or_member: Load | Beam | RigidBody | Domain) -> slice:
        """The slice of the degrees of freedom of a member, or of a load's."""
        return self.slices[self._index[id(getattr(load_or_member, "beam", load_or_member))]]

    # what belongs to it, made when it is asked for

    @cached_property
    def points(self) -> Points:
        """What finds material points."""
        frame = self.constraints.frame
        return Points(self.beams, self.slices, self.members[len(self.beams):],
                      None if frame is None else frame.lines)

    @cached_property
    def backend(self) -> Backend:
        """What runs kernels on the tables of this system, in NumPy or compiled."""
        return Backend(self)

    @cached_property
    def scales(self) -> Scales:
        """Energies and their round-off."""
        return Scales(self)

    @cached_property
    def solver(self) -> LinearSolver:
        """What factorises :attr:`K` with supports and joints, and solves with it."""
        return LinearSolver(self)

    @cached_property
    def mass_solver(self) -> MassSolver:
        """What solves with the mass matrix, supports and joints."""
        return MassSolver(self)

    # loads

    @contextmanager
    def stopped_at(self, t: float) -> Iterator[None]:
        """Statics takes functions of time at the time t."""
        before, self.clock = self.clock, t
        try:
            yield
        finally:
            self.clock = before

    def external_force(self, u: Array, t: float | None = None) -> Array:
        """The force of all loads at full size, shape (N,)."""
        t = self.clock if t is None else t
        out = self.constant_force.copy()
        for load in self._varying:
            s, (factor, acting) = self.of(load), load.acting(t)
            out[s] += factor * acting.force(u[s])
        return out

    def load_potential(self, u: Array, t: float | None = None,
                       turned: Array | None = None) -> float:
        """Potential of the loads; loads without one count as zero.

        Parameters
        ----------
        u, t
            As for :meth:`external_force`, shape (N,).
        turned
            The angles by which the sections of moments have turned, in the order of these, shape
            (k,); by default those of u, of which whole turns are counted along a beam only.
        """
        t, total, number = self.clock if t is None else t, 0.0, count()
        for load in self.loads:
            factor, acting = load.acting(t)
            if turned is not None and load.turning:
                total -= factor * cast("EndMoment", load).M * turned[next(number)]
            else:
                total += factor * (acting.potential(u[self.of(load)]) or 0.0)
        return float(total)

    @property
    def varies(self) -> bool:
        """True if supports or loads may ask functions of time."""
        return bool(self._varying) or self.constraints.moves

    # beams and force elements

    def internal_force(self, u: Array, t: float | None = None, load: float = 1.0) -> Array:
        """The force of beams and force elements, shape (N,)."""
        self._require_displacement(u)
        if not (u.any() or self.forces.elements) and all(b.kernel.linear for b in self.beams):
            return np.zeros(self.N)  # without round-off
        return self._evaluate(FORCE, u, load=load, t=t)

    def mean_internal_force(self, u0: Array, u1: Array, t: float | None = None) -> Array:
        """The internal force whose work from u0 to u1, shape (N,), is the change of the energy."""
        return self._evaluate(MEAN, u0, u1, t=t)

    def strain_energy(self, u: Array, t: float = 1.0) -> float:
        """Strain energy of all beams, and the potential of force elements."""
        return float(self.energy_of_beams(u) + self.energy_of_forces(u, t))

    def energy_of_beams(self, u: Array) -> Any:
        """The beams' part of :meth:`strain_energy`: of u (N,) a number, of (k, N) an array (k,)."""
        return sum(b.kernel.energy(u[..., s]) for b, s in zip(self.beams, self.slices))

    def energy_of_forces(self, u: Array, t: float = 1.0) -> float:
        """The force elements' part of :meth:`strain_energy`."""
        if not self.forces.elements:
            return 0.0
        return self.forces.potential(self.backend.tables.plain.forces, u, t)

    def inverted(self, u: Array) -> bool:
        """True if a body is turned inside out somewhere."""
        return any(b.kernel.inverted(u[s]) for b, s in zip(self.beams, self.slices)
                   if b.has_sections) or any(d.inverted(u[self.of(d)]) for d in self.domains)

    def folded(self, u: Array) -> bool:
        """True if the axis turns back within an element of a beam."""
        return any(folded(b, u[s]) for b, s in zip(self.beams, self.slices))

    def stiffness_at_rest(self) -> sparse.csr_array:
        """The stiffness of force elements in the reference configuration, shape (N, N)."""
        zero = np.zeros(self.N)
        i, j, v = self.forces.entries(self.backend.tables.plain.forces, 0.0, zero, zero, 0.0)
        return sparse.csr_array((v, (i, j)), shape=(self.N, self.N))

    def _holding(self):
        """The stiffness that may hold what supports leave free."""
        K = self.stiffness_at_rest()
        for load in filter(_holds, self.loads):
            first, (i, j, v) = self.of(load).start, load.stiffness(np.zeros(load.beam.N))
            K = K - sparse.csr_array((v, (first + i, first + j)), shape=K.shape)
        return K

    # damping

    @cached_property
    def retardation(self) -> list[float]:
        """The retardation time of each beam."""
        return [self.damping.stiffness + (b.damping.time if b.damping else 0.0)
                for b in self.beams]

    @property
    def viscous(self) -> bool:
        """True if a beam resists the rates of its strains."""
        return any(time > 0.0 for time in self.retardation)

    @property
    def damped(self) -> bool:
        """True if something resists velocities."""
        return self.viscous or bool(self.damping) or self.forces.resists

    @cached_property
    def modal_damping(self) -> ModalDamping:
        """The damping of single modes."""
        return ModalDamping(self, self._rest_modes)

    def damping_force(self, u: Array, v: Array, t: float | None = None) -> Array:
        """The force that resists the velocity v at u, shape (N,)."""
        force = self._evaluate(VISCOUS, u, v) if self.viscous else np.zeros(self.N)
        if self.forces.resists:
            add_resisting_force(self.backend.tables.plain.forces, 0.0 if t is None else t, u, v,
                                force)
        if self.damping.mass:
            force += self.damping.mass * self.mass.multiply(v)
        return force + self.modal_damping.force(v)

    # matrices

    @property
    def bandwidth(self) -> int:
        """Subdiagonals of the tangent and of the mass matrix."""
        return max([2 * b.nd - 1 for b in self.members] + [d.bandwidth for d in self.domains])

    def new_band(self) -> BandMatrix:
        """An empty band matrix of the scene."""
        return BandMatrix(self.N, self.bandwidth, self.symmetric)

    @cached_property
    def mass(self) -> BandMatrix:
        """The mass matrix; assembled once."""
        M = self.new_band()
        for beam, s in zip(self.beams, self.slices):
            for first in range(0, beam.mesh.nelements, 1024):  # bounds the memory
                part = slice(first, first + 1024)
                M.add_elements(beam.mass_elements(part), s.start, beam.nd, beam.mesh.t[0, part])
        for mass in self.forces.masses:
            M.add(*mass.mass_entries())
        for body in self.members[len(self.beams):]:
            i, j, values = body.mass_entries()
            M.add(self.of(body).start + i, self.of(body).start + j, values)
        return M

    @cached_property
    def K(self) -> BandMatrix:
        """The tangent within the band, filled by :meth:`assemble`."""
        return self.new_band()

    def assemble(self, u: Array, load: float = 1.0, carried: Array | None = None,
                 geometric: bool = True, t: float | None = None) -> tuple[Array, Array]:
        """Internal force, and the tangent of the residual into :attr:`K`.

        Parameters
        ----------
        u
            Displacement, shape (N,).
        load
            Factor on the loads, which may have a stiffness.
        carried
            Stresses (n,) for the geometric part, as :meth:`carried_stress` returns them.
        geometric
            Include the geometric part, and the stiffness of loads that follow the body. Both grow
            with the load: linear theory has none of them.
        t
            Time, for loads with an amplitude.

        Returns
        -------
        force, stresses
            The internal force (N,), and the stresses (n,) that :meth:`carried_stress` takes.
        """
        self._require_displacement(u)
        t = self.clock if t is None else t
        self.K.clear()
        self.solver.assembled_at(u, load if t is None else t)
        stresses = self.backend.tables.stresses
        if not geometric:
            carried = np.zeros_like(stresses)
        force = self._evaluate(TANGENT, u, None, load, t, (stresses, carried), geometric)
        return force, stresses

    def carried_stress(self, u: Array, stresses: Array, du: Array) -> Array:
        """Stresses (n,) at u, shape (N,), carried to ``u + du`` by linearisation."""
        carried = np.zeros_like(stresses)
        self._evaluate(CARRY, u, du, stresses=(stresses, carried))
        return carried

    def _evaluate(self, what, u, v=None, load=1.0, t=None, stresses=(None, None), geometric=True):
        """Run :func:`~skfem_ancf.equations.evaluation.evaluate`; returns the force."""
        tables, t = self.backend.tables, self.clock if t is None else t
        u, v = np.array(u, dtype=float), np.array(u if v is None else v, dtype=float)
        first = what == TANGENT and t is None and not geometric
        factors = tables.linear_factors(load) if first else tables.static_factors(load)
        time = np.inf if first else np.nan if t is None else float(t)
        if what == TANGENT and t is not None and self._varying:
            factors = load * tables.factors(np.array([t]))[0]
        none = tables.stresses if stresses[1] is None else None
        of, carried = (none if x is None else x for x in stresses)
        force = np.zeros(self.N)
        self.backend.of(evaluate)(what, u, v, factors, time, float(load),
                                  stresses[1] is not None, of, carried, force)
        return force

    def _require_displacement(self, u):
        if u.shape != (self.N,):
            raise InputError(f"the displacement of the scene's coordinates has shape ({self.N},), "
                             f"got {u.shape}; the state of another mesh?")


def _holds(load):
    return load.first_order and not load.constant


def _extent(bodies):
    """How far bodies reach."""
    corners = np.concatenate([body.outline_at(np.zeros(body.N)) for body in bodies], axis=1)
    return float(np.max(np.ptp(corners, axis=1)))
