"""A scene in numbers: free coordinates, loads, joints, residual, tangent and its solution."""

from __future__ import annotations

import logging
from itertools import accumulate, count, pairwise
from math import sqrt
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from ..core.band import factorize, fix, solve_dependent
from .bordered import BorderedMatrix, gives_way
from .condensation import Condensed
from .constraints import Constraints
from ..materials.damping import UNDAMPED, Damping
from .step_condensation import EliminatedMass, condensed
from ..core.errors import InputError, shown
from .evaluation import CARRY, FORCE, MEAN, TANGENT, VISCOUS, evaluate
from ..actions.forces.system import Forces
from ..actions.forces.texts import add_resisting_force
from ..actions.joints.director import UnitDirector
from ..core.kept import cached_property
from ..core.origin import ours
from ..core.linalg import INACCURATE, NO_FACTORS, BandMatrix, Inertia, dense
from .backend import Machine
from ..mesh.mesh_beam import reach
from ..beam.points import Points
from .signature import determinant_sign, inertia_of, null_basis, row_sizes

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ..beam.beam import Beam
    from .border import Factors
    from ..actions.forces.base import ForceElement
    from ..actions.joints.base import Joint
    from ..actions.loads import EndMoment, Load
    from ..beam.rigid import RigidBody
    from ..core.types import Array

logger = logging.getLogger(__name__)
_NONE = np.zeros(0)
EPS = float(np.finfo(float).eps)
#: Equations of the nodes of a frame above which steps of a motion eliminate them.
MANY = 48
#: Coordinates up to which the tangent on the tangent space of joints is a dense matrix.
DENSE = 100


class System:
    """The discrete equations of a scene.

    The unknown is the displacement ``u`` of all coordinates from the stress-free state, beam
    after beam, and a multiplier for each equation of a joint:
    ``M u'' + f(u) + J^T lambda = load Q(u)``, ``Phi(u, t) = 0``, ``J = dPhi / du``.

    Parameters
    ----------
    beams
        The beams, in order.
    loads
        The loads of all beams.
    fixed, values
        Numbers of the fixed coordinates and their displacements at full load, shape (n,).
    joints
        Joints, already bound.
    damping
        A :class:`~skfem_ancf.materials.damping.Damping`, or None.
    elements
        Force elements, already bound.
    bodies
        Rigid bodies, whose coordinates come behind those of the beams.
    rest_modes
        ``rest_modes(system, k)`` returns k angular frequencies above those of rigid motions about
        the reference configuration, and their shapes (k, N); modal damping asks for them.
    """

    def __init__(self, beams: Sequence[Beam], loads: Sequence[Load], fixed: Array, values: Array,
                 joints: Sequence[Joint] = (), damping: Damping | None = None,
                 elements: Sequence[ForceElement] = (),
                 bodies: Sequence[RigidBody] = (),
                 rest_modes: Callable[[System, int], tuple[Array, Array]] | None = None) -> None:
        self._given: tuple[Any, ...] = (
            tuple(beams), tuple(loads), fixed, values, tuple(joints), damping, tuple(elements),
            tuple(bodies), rest_modes)
        self._rest_modes = rest_modes
        self.beams, self.bodies, self.loads = list(beams), list(bodies), list(loads)
        self.members: list[Beam | RigidBody] = [*beams, *bodies]
        offsets = list(accumulate((b.N for b in self.members), initial=0))
        self.offsets, self.N = np.array(offsets), offsets[-1]
        self.slices = [slice(a, b) for a, b in pairwise(offsets)]
        self._index = {id(b): k for k, b in enumerate(self.members)}
        self.size = (_extent(self.bodies) if not beams else beams[0].size if len(beams) == 1
                     else reach([b.mesh for b in self.beams]))
        self.constraints = Constraints(self.members, self.slices, self.size, fixed, values,
                                       [*self._directors(fixed), *joints],
                                       self._held_by_elements if elements else None)
        self.forces = Forces(elements, self.N, self.bandwidth)
        self._take_loads()
        self.damping = UNDAMPED if damping is None else damping
        self.retardation = [self.damping.stiffness + (b.damping.time if b.damping else 0.0)
                            for b in self.beams]
        self.viscous = any(time > 0.0 for time in self.retardation)

    def _take_loads(self):
        steady = [load.constant and load.amplitude is None for load in self.loads]
        self._varying: list[Any] = [load for load, of in zip(self.loads, steady) if not of]
        self.symmetric = all(load.symmetric for load in self.loads) and self.forces.symmetric
        self.constant_force = np.zeros(self.N)
        for load, of in zip(self.loads, steady):
            if of:
                s = self.of(load)
                self.constant_force[s] += load.force(np.zeros(s.stop - s.start))

    def _directors(self, fixed):
        """The conditions of the bodies' directors, but of those that are held fast."""
        return [UnitDirector(body, self.of(body).start) for body in self.bodies
                if len(np.intersect1d(fixed, self.of(body).start + np.arange(2, 4))) < 2]

    def _held_by_elements(self):
        """The stiffness of force elements in the stress-free state, sparse."""
        zero = np.zeros(self.N)
        i, j, v = self.forces.entries(self.machine.tables.plain.forces, 0.0, zero, zero, 0.0)
        return sparse.csr_array((v, (i, j)), shape=(self.N, self.N))

    @cached_property
    def points(self) -> Points:
        """What finds material points, a :class:`~skfem_ancf.beam.points.Points`."""
        frame = self.constraints.frame
        return Points(self.beams, self.slices, self.bodies, None if frame is None else frame.lines)

    def __getstate__(self):
        """What it was made of: work arrays and factors are made again."""
        return self._given

    def __setstate__(self, given):
        self.__init__(*given)

    def __copy__(self):
        return self

    def __deepcopy__(self, memo):
        return self  # it is the same equations, however many states have them

    def of(self, load_or_beam: Load | Beam | RigidBody) -> slice:
        """The slice of the coordinates that a load, a beam or a rigid body has."""
        return self.slices[self._index[id(getattr(load_or_beam, "beam", load_or_beam))]]

    # forces and energies

    def external_force(self, u: Array, t: float | None = None) -> Array:
        """The force of all loads at full size, shape (N,); at time ``t`` if it is given.

        Parameters
        ----------
        u
            Displacement, shape (N,).
        t
            Time; None for full size.
        """
        if not self._varying:
            return self.constant_force
        out = self.constant_force.copy()
        for load in self._varying:
            s, (factor, acting) = self.of(load), load.acting(t)
            out[s] += factor * acting.force(u[s])
        return out

    @cached_property
    def depends_on_time(self) -> bool:
        """True if supports, joints or loads may ask functions of time."""
        return self.varies or self.machine.tables.motion_varies

    @cached_property
    def varies(self) -> bool:
        """True if supports or loads may ask functions of time."""
        return bool(self._varying) or self.constraints.moves

    def _require_coordinates(self, u):
        if u.shape != (self.N,):
            raise InputError(f"the displacement of the scene's coordinates has shape ({self.N},), "
                             f"got {u.shape}; the state of another mesh?")

    def internal_force(self, u: Array, t: float | None = None, load: float = 1.0) -> Array:
        """The force of beams and force elements, shape (N,).

        Parameters
        ----------
        u
            Displacement, shape (N,).
        t, load
            Time, for force elements; in statics the load factor in place of it.
        """
        self._require_coordinates(u)
        if not self.forces.elements and not u.any():
            return self._force_at_rest.copy()
        return self._evaluate(FORCE, u, load=load, t=t)

    @cached_property
    def _force_at_rest(self):
        """That of beams that are not displaced: of laws of one's own alone it may not be zero."""
        return np.zeros(self.N) if self._linear else self._evaluate(FORCE, np.zeros(self.N))

    def linear_force(self, base: Array, d: Array, load: float = 1.0) -> Array:
        """As :meth:`internal_force` in statics, linearised.

        Parameters
        ----------
        base, d
            A displacement about which it is, and what is added to it, shape (N,).
        load
            The load factor.
        """
        return self.internal_force(base, None, load) + self._stiffness_times(base, d, load)

    def _stiffness_times(self, base, d, load):
        """The tangent of the internal force times a vector; sums of strains, where it can be."""
        out, at_rest = np.zeros(self.N), not base.any()
        if not d.any():
            return out
        for beam, s in zip(self.beams, self.slices):
            k = beam.kernel
            out[s] = k.scatter(k.small_forces(d[s]) if at_rest else _times_elements(
                k.tangents(base[s]), k.gather(d[s])))
        if self.forces.elements:
            i, j, v = self.forces.entries(self.machine.tables.plain.forces, load, base, 0.0 * base,
                                          0.0)
            np.add.at(out, i, v * d[j])
        return out

    def linear_energy(self, base: Array, d: Array, load: float = 1.0) -> float:
        """The strain energy, and the potential of force elements, to second order.

        Parameters
        ----------
        base, d, load
            As for :meth:`linear_force`, shape (N,).
        """
        if base.any() or self.forces.elements:
            second = 0.5 * d @ self._stiffness_times(base, d, load)
        else:
            second = sum(b.kernel.small_energy(d[s]) for b, s in zip(self.beams, self.slices))
        return float(self.strain_energy(base, load) + second
                     + self.internal_force(base, None, load) @ d)

    def linear_external_force(self, base: Array, d: Array) -> Array:
        """The force of all loads in statics at full size, linearised as it is solved with.

        That loads of the package follow the body is of second order in small displacements from
        the stress-free state. The force of a load of the user's may depend on these otherwise, as
        that of a spring.

        Parameters
        ----------
        base, d
            As for :meth:`linear_force`, shape (N,).
        """
        out = np.array(self.external_force(base))
        strains: list[Any] = [] if base.any() else [one for one in self.loads if one.pushes]
        for one in strains:  # of laws that are not linear
            s = self.of(one)
            out[s] += one.beam.kernel.scatter(one.small_forces(one.at_rest)) - (
                one.acting(None)[1].force(base[s]))
        for one in self._varying:
            if not one.constant and (base.any() or not ours(one)):
                s, (factor, acting) = self.of(one), one.acting(None)
                i, j, v = acting.stiffness(base[s])
                np.add.at(out[s], i, factor * np.asarray(v) * d[s][j])
        return out

    def mean_internal_force(self, u0: Array, u1: Array, t: float | None = None) -> Array:
        """The internal force whose work from u0 to u1 is the change of the strain energy.

        Parameters
        ----------
        u0, u1
            Displacements, shape (N,).
        t
            Time, for force elements.
        """
        return self._evaluate(MEAN, u0, u1, t=t)

    @property
    def damped(self) -> bool:
        """True if something resists velocities."""
        return self.viscous or bool(self.damping) or self.forces.resists

    def damping_force(self, u: Array, v: Array, t: float | None = None) -> Array:
        """The force at u that resists the velocity v, shape (N,).

        Parameters
        ----------
        u, v
            Displacement and velocity, shape (N,).
        t
            Time, for force elements.
        """
        force = self._evaluate(VISCOUS, u, v) if self.viscous else np.zeros(self.N)
        if self.forces.resists:
            add_resisting_force(self.machine.tables.plain.forces, 0.0 if t is None else t, u, v,
                                force)
        if self.damping.mass:
            force += self.damping.mass * self.mass.multiply(v)
        return force + (self.damped_modes @ v) @ self.damped_modes

    def damping_acceleration(self, v: Array) -> Array:
        """The acceleration whose inertia is the damping of the mass and of modes, shape (N,).

        Parameters
        ----------
        v
            Rate of the coordinates, shape (N,).
        """
        return self.damping.mass * v + (self.damped_modes @ v) @ self._damped_shapes

    @cached_property
    def _damped_shapes(self):
        """The modes whose products with the mass are :attr:`damped_modes`."""
        if not len(self.damped_modes):
            return self.damped_modes
        return splu(self.mass.tocsc()).solve(self.damped_modes.T).T

    def sample(self, u: Array, v: Array, t: float, first: bool) -> None:
        """Ask controls whose law is asked now and then, if it is their time.

        Parameters
        ----------
        u, v, t
            Displacement of the coordinates and its rate, shape (N,), and time.
        first
            A motion begins.
        """
        if self.forces.sampled:
            self.forces.sample(self.machine.tables.plain.forces, u, v, t, first)

    def small_part_forces(self, base: Array, d: Array, load: float = 1.0) -> Array:
        """As :meth:`part_forces` in statics, linearised; shape (2, parts).

        Parameters
        ----------
        base, d, load
            As for :meth:`linear_force`, shape (N,).
        """
        return self.forces.small_part_forces(self.machine.tables.plain.forces, load, base, d)

    def part_forces(self, u: Array, v: Array) -> Array:
        """What resists on the points of force elements that are no own ones, shape (2, parts).

        Parameters
        ----------
        u, v
            Displacement of the coordinates and its rate, shape (N,).
        """
        return self.forces.part_forces(self.machine.tables.plain.forces, u, v)

    @cached_property
    def damped_modes(self) -> Array:
        """Rows (k, N): what resists v by damped modes is their product with that of rows and v."""
        ratios = self.damping.modal
        if not ratios.any() or self._rest_modes is None:
            return np.zeros((0, self.N))
        frequencies, shapes = self._rest_modes(self, len(ratios))
        weights = np.sqrt(2.0 * ratios * np.maximum(frequencies, 0.0))
        rows = np.array([c * self.mass.multiply(shape) for c, shape in zip(weights, shapes)])
        return np.ascontiguousarray(rows[weights > 0.0])

    def _evaluate(self, what, u, v=None, load=1.0, t=None, stresses=None, carried=None,
                  use_carried=False, geometric=True):
        """Run :func:`~skfem_ancf.equations.evaluation.evaluate`; returns the force."""
        tables = self.machine.tables
        u, v = np.array(u, dtype=float), np.array(u if v is None else v, dtype=float)
        first = what == TANGENT and t is None and not geometric
        factors = tables.linear_factors(load) if first else tables.static_factors(load)
        time = np.inf if first else np.nan if t is None else float(t)
        if what == TANGENT and t is not None and self._varying:
            factors = load * tables.factors(np.array([t]))[0]
        none = tables.stresses if stresses is None or carried is None else None
        force = np.zeros(self.N)
        run = self.machine.of(evaluate)
        run(what, u, v, factors, time, float(load), use_carried,
            none if stresses is None else stresses, none if carried is None else carried, force)
        return force

    def momentum(self, v: Array) -> Array:
        """Linear momentum of the coordinates' velocities, shape (2,)."""
        p = self.mass.multiply(v)
        total = np.zeros(2)
        for beam, s in zip(self.members, self.slices):  # a unit translation moves every r by one
            total += p[s].reshape(-1, beam.nd)[:, :2].sum(axis=0)
        return total

    def angular_momentum(self, u: Array, v: Array) -> float:
        """Angular momentum about the origin.

        Parameters
        ----------
        u, v
            Displacement and velocity, shape (N,).
        """
        p, total = self.mass.multiply(v), 0.0
        for beam, s in zip(self.members, self.slices):
            q, pb = (beam.q0 + u[s]).reshape(-1, 2), p[s].reshape(-1, 2)
            total += np.sum(q[:, 0] * pb[:, 1] - q[:, 1] * pb[:, 0])
        return float(total)

    def strain_energy(self, u: Array, t: float = 1.0) -> float:
        """Strain energy of all beams, and the potential of force elements.

        Parameters
        ----------
        u
            Displacement, shape (N,).
        t
            Time, for obstacles that move; in statics the load factor.
        """
        energy = self.energy_of_beams(u) if u.any() else self._energy_at_rest
        return float(energy + self.energy_of_forces(u, t))

    def energy_of_beams(self, u: Array) -> Any:
        """The beams' part of :meth:`strain_energy`, of one displacement or many at once.

        Parameters
        ----------
        u
            Shape (N,) or (k, N).

        Returns
        -------
        float or ndarray
            Shape () or (k,).
        """
        return sum(b.kernel.energy(u[..., s]) for b, s in zip(self.beams, self.slices))

    def energy_of_forces(self, u: Array, t: float = 1.0) -> float:
        """The potential of force elements.

        Parameters
        ----------
        u, t
            Displacement, shape (N,), and time, as of :meth:`strain_energy`.
        """
        if not self.forces.elements:
            return 0.0
        return self.forces.potential(self.machine.tables.plain.forces, u, t)

    @cached_property
    def _energy_at_rest(self):
        """That of beams that are not displaced."""
        return 0.0 if self._linear else self.energy_of_beams(np.zeros(self.N))

    @property
    def _linear(self):
        """True if the laws of all beams are linear."""
        return all(beam.kernel.linear for beam in self.beams)

    def load_potential(self, u: Array, t: float | None = None,
                       turned: Array | None = None) -> float:
        """Potential of the loads; loads without one count as zero.

        Parameters
        ----------
        u
            Displacement, shape (N,).
        t
            Time; None for full size.
        turned
            The angles by which the sections of moments have turned, in the order of these, shape
            (k,), k at least their number; by default those of u, of which whole turns are counted
            along a beam only.
        """
        total, number = 0.0, count()
        for load in self.loads:
            factor, acting = load.acting(t)
            if turned is not None and load.turning:
                total -= factor * cast("EndMoment", load).M * turned[next(number)]
            else:
                total += factor * (acting.potential(u[self.of(load)]) or 0.0)
        return float(total)

    @cached_property
    def stiffness_scale(self) -> float:
        """eps times the square root of modulus times volume: the round-off of strains of 1."""
        return EPS * sqrt(self.energy_of_strains)

    @cached_property
    def energy_of_strains(self) -> float:
        """Modulus times volume, or :attr:`energy_of_bodies`."""
        return sum(b.kernel.scale for b in self.beams) or self.energy_of_bodies

    @cached_property
    def energy_of_bodies(self) -> float:
        """What springs and loads do to rigid bodies over the scene's size; zero with beams.

        One where there are neither: a mechanism that is driven, in which no force has a unit.
        """
        if self.beams:
            return 0.0
        springs = abs(self._held_by_elements())
        force = np.max(np.abs(self.external_force(np.zeros(self.N))))
        held = springs.max() if springs.nnz else 0.0
        return float(held * self.size**2 + force * self.size) or 1.0

    @cached_property
    def inertia_of_places(self) -> float:
        """The mass times places and directions, squared; zero where no joint knows them.

        Of rigid bodies, whose directions are unit vectors, and where functions of time are places:
        joints close to eps times these, however little has moved.
        """
        if not self.bodies and not self.constraints.drives:
            return 0.0
        turn = np.concatenate([b.rigid_motions() @ (-b.origin[1], b.origin[0], 1.0)
                               for b in self.members])
        return float(turn @ self.mass.multiply(turn))

    @cached_property
    def work_noise(self) -> float:
        """Round-off of a correction's work, as a square root.

        A displacement of the scene's size is known to eps times that size, its gradient in an
        element to that over the element's length; the stiffness is that of the beam's mean section.
        """
        if not self.beams:
            return self.stiffness_scale
        total = sum([b.kernel.scale / float(b.mesh.lengths.sum())
                     * float(np.add.reduce(1.0 / b.mesh.lengths)) for b in self.beams])
        return EPS * self.size * sqrt(total)

    @cached_property
    def noise(self) -> float:
        """How much larger the round-off of a residual is than that of the strains."""
        return sqrt(max(b.nd for b in self.members))

    def inverted(self, u: Array) -> bool:
        """True if a body is turned inside out somewhere."""
        return any(kernel.inverted(u[s]) for kernel, s in self._turning_over)

    @cached_property
    def _turning_over(self):
        """Kernels of beams that may be turned inside out, and their coordinates: not of cables."""
        return [(b.kernel, s) for b, s in zip(self.beams, self.slices) if b.has_sections]

    @cached_property
    def machine(self) -> Machine:
        """What runs texts on the equations of this system."""
        return Machine(self)

    # what texts ask of it, see skfem_ancf.core.callbacks

    def add_own_force(self, t: float, scale: float, u: Array, out: Array) -> None:
        """Add the force of the loads that no text knows.

        Parameters
        ----------
        t, scale
            Time, nan for none, and a factor.
        u, out
            Displacement, and what is added to, shape (N,).
        """
        for load in self.machine.tables.own_loads:
            s, (factor, acting) = self.of(load), load.acting(None if np.isnan(t) else t)
            out[s] += scale * factor * acting.force(u[s])

    def add_own_mean_force(self, t: float, u0: Array, u1: Array, out: Array) -> None:
        """As :meth:`add_own_force`, of their mean force.

        Parameters
        ----------
        t
            Time.
        u0, u1, out
            Displacements, and what is added to, shape (N,).
        """
        for load in self.machine.tables.own_loads:
            s, (factor, acting) = self.of(load), load.acting(t)
            force = acting.force(u1[s]) if np.array_equal(u0[s], u1[s]) else acting.mean_force(
                u0[s], u1[s])
            out[s] += factor * force

    def subtract_own_stiffness(self, t: float, scale: float, u: Array, flat: Array) -> None:
        """Subtract the derivative of :meth:`add_own_force` from the numbers of a band matrix.

        Parameters
        ----------
        t, scale, u
            As there; u of shape (N,). An infinite time is that of the first tangent in statics, and
            of linear theory: the stiffness of the package's own loads is of second order there.
        flat
            The numbers of the matrix, shape (n,).
        """
        for load in self.machine.tables.own_loads:
            s = self.of(load)
            if np.isinf(t) and ours(load):
                continue
            factor, acting = load.acting(t if np.isfinite(t) else None)
            i, j, v = acting.stiffness(u[s])
            keep = np.full(len(v), not self.symmetric) | (np.asarray(i) >= np.asarray(j))
            factor = scale * factor
            at = self.K._position(s.start + np.asarray(i), s.start + np.asarray(j))
            np.add.at(flat, at[keep], -factor * np.asarray(v)[keep])

    def add_own_joints(self, what: int, t: float, u: Array, v: Array, out: Array) -> None:
        """What joints that no text knows do.

        Parameters
        ----------
        what
            0: Phi. 1: J v. 2: J^T v, v of shape (m,). 3: J. 4: the second derivative of Phi in the
            direction v. In a step that conserves energy, 5: J of u and v at its ends; 6: the force
            of impulses, of u at its end and v of the velocities at its ends, u at its begin and
            the impulses, shape (3 N + m,).
        t, u, v
            Time, displacement (N,) and a vector, (N,) where no other shape is said.
        out
            What is set, or added to, shape (m,), (N,) or (m N,).
        """
        if what == 0:
            out[:] = self.constraints.constraint(u, t)
        elif what == 1:
            out += self.constraints.full_jacobian(u, t) @ v
        elif what == 2:
            out += v @ self.constraints.full_jacobian(u, t)
        elif what == 3:
            out += dense(self.constraints.full_jacobian(u, t)).ravel()
        elif what == 4:
            out += self.constraints.quadratic(u, t, v)
        elif what == 5:
            out += self.constraints.mean_jacobian(v, u, t).ravel()
        else:
            v0, v1, u0 = v[:3 * self.N].reshape(3, self.N)
            out += self.constraints.mean_turning(u0, u, v0, v1, t, v[3 * self.N:])

    def solve_own(self, t: float, u: Array, multipliers: Array, R: Array, phi: Array, du: Array,
                  dm: Array) -> bool:
        """Factorise and solve where no border about the band will do; False if that fails.

        Parameters
        ----------
        t, u, multipliers
            Time, and where the joints are linearised, shapes (N,) and (m,).
        R, phi
            Right-hand sides, shapes (N,) and (m,).
        du, dm
            The solution, shapes (N,) and (m,).
        """
        try:
            self.factorize(u, t, multipliers)
            du[:], dm[:] = self.solve(R, phi)
        except NO_FACTORS as error:
            logger.debug("no factors: %s", error)
            return False
        return True

    # mass

    @cached_property
    def mass(self) -> BandMatrix:
        """The mass matrix, a :class:`~skfem_ancf.core.linalg.BandMatrix`; assembled once."""
        M = self.new_band()
        for beam, offset in zip(self.beams, self.offsets):
            for part in beam.kernel.chunks():
                M.add_elements(beam.mass_elements(part), int(offset), beam.nd, beam.mesh.t[0, part])
        for mass in self.forces.masses:
            M.add(*mass.mass_entries())
        for body in self.bodies:
            i, j, values = body.mass_entries()
            M.add(self.of(body).start + i, self.of(body).start + j, values)
        return M

    @cached_property
    def mass_factors(self) -> BandMatrix:
        """The factors of the mass matrix with its supports fixed; made once."""
        M = self.new_band().combine(1.0, self.mass, 0.0, self.mass)
        fix(M.band, self.constraints.fixed)
        if not factorize(M.band):
            if self.forces.masses:
                raise InputError("the mass matrix is singular to round-off: a mass or an inertia "
                                 f"of {shown(self.forces.masses)} is too large beside the beams")
            raise np.linalg.LinAlgError("the mass matrix is not positive definite")
        M.take_factors()
        if not self.by_nodes and M.definite:
            M.to_cholesky()  # solved with by LAPACK at once; texts have those of the band
        return M

    def mass_solver(self, u: Array, t: float, J: Any = None
                    ) -> Callable[[Array, Array], tuple[Array, Array]]:
        """A function of b (N,) and rate (m,): x and l with M x + J^T l = b and J x = rate.

        The first at free coordinates; x is zero at fixed ones.

        Parameters
        ----------
        u, t
            Where J is taken, shape (N,), and when.
        J
            :meth:`full_jacobian` there, shape (m, N), where it is known.
        """
        if self.by_nodes:
            mass = self._mass_by_nodes
            mass.forget()

            def solve_by_nodes(b: Array, rate: Array) -> tuple[Array, Array]:
                mass.forget(factors=False)
                return mass.solve(u, t, b, rate)

            return solve_by_nodes
        M, free = self.mass_factors, self.constraints.free
        if not self.constraints.m:
            return lambda b, rate: (M.solve(b * free), _NONE)
        J = (J * self.constraints.mask if isinstance(J, np.ndarray)
             else self.constraints.jacobian(u, t))
        Y = M.solve(J.T if isinstance(J, np.ndarray) else dense(J.T))
        S = J @ Y

        def solve(b: Array, rate: Array) -> tuple[Array, Array]:
            x = M.solve(b * free)
            multipliers = J @ x - rate
            if not solve_dependent(S.copy(), multipliers):
                raise np.linalg.LinAlgError("the joints hold nothing in this state")
            return x - Y @ multipliers, multipliers

        return solve

    # tangent

    @cached_property
    def integrators(self) -> list[Any]:
        """Those of motions that have ended, whose work arrays the next one takes."""
        return []

    def new_band(self) -> BandMatrix:
        """An empty band matrix of the scene."""
        return BandMatrix(self.N, self.bandwidth, self.symmetric)

    @property
    def bandwidth(self) -> int:
        """Subdiagonals of the tangent and of the mass matrix."""
        return max(2 * b.nd for b in self.members) - 1

    @cached_property
    def K(self) -> BandMatrix:
        """The tangent, filled by :meth:`assemble`."""
        return self.new_band()

    def assemble(self, u: Array, load: float = 1.0, carried: Array | None = None,
                 geometric: bool = True, t: float | None = None) -> tuple[Array,
                 tuple[Array, Array]]:
        """Internal force, and the tangent of the residual into :attr:`K`.

        Parameters
        ----------
        u
            Displacement, shape (N,).
        load
            Factor on the loads, which may have a stiffness.
        carried
            Stresses (n,) for the geometric part, as :meth:`stress_step` returns them.
        geometric
            Include the geometric part, and the stiffness of loads that follow the body. Both grow
            with the load: linear theory has none of them.
        t
            Time, for loads with an amplitude.

        Returns
        -------
        force, evaluations
            The internal force (N,), and the pieces that :meth:`stress_step` takes.
        """
        self._require_coordinates(u)
        self.K.clear()
        self._assembled = np.array(u), float(load if t is None else t)
        stresses = self.machine.tables.stresses
        if not geometric:
            carried = np.zeros_like(stresses)
        force = self._evaluate(TANGENT, u, None, load, t, stresses, carried, carried is not None,
                               geometric)
        return force, (u.copy(), stresses)

    def stress_step(self, evaluations: tuple[Array, Array], du: Array) -> Array:
        """Stresses carried to ``u + du`` by linearisation.

        Parameters
        ----------
        evaluations
            What :meth:`assemble` returned.
        du
            Increment of the displacement, shape (N,).
        """
        u, stresses = evaluations
        carried = np.zeros_like(stresses)
        self._evaluate(CARRY, u, du, stresses=stresses, carried=carried)
        return carried

    def multiply(self, v: Array) -> Array:
        """The assembled tangent times a vector, before :meth:`factorize`."""
        out = self.K.multiply(v)
        if self.forces.far:
            i, j, values = self._far_entries()
            out = out + np.bincount(i, values * v[j], self.N)
        return out

    def factorize(self, u: Any = None, t: float = 0.0, multipliers: Any = None) -> None:
        """Fix the supports in the tangent and factorise it, with the joints where there are any.

        Parameters
        ----------
        u, t
            Where the joints are linearised, shape (N,), and when.
        multipliers
            Theirs, shape (m,).
        """
        fix(self.K.band, self.constraints.fixed)
        if not self.coupled:
            self.K.factorize()
            return
        if self.condensed is not None:
            self.condensed.factorize(self.K, u, multipliers)
            return
        if u is not None:
            self._assembled = np.array(u), float(t)
        self._J = self.constraints.jacobian(u, t)
        i, j, v = (np.append(a, b) for a, b in zip(
            self.constraints.curvature_entries(u, t, multipliers), self._far_entries()))
        self._outside, self._sparse = (i, j, v), None
        if self.constraints.bordered:
            along, springs = self.constraints.stiff
            sizes = self.constraints.coordinate_sizes * self.constraints.mask
            self._factors = BorderedMatrix(self.K, self._J, i, j, v, springs, sizes,
                                           self.constraints.loose, along)
            self._border = self._factors.factors
        else:
            self._sparse = self._sparse_factors(self._whole())

    @cached_property
    def condensed(self) -> Condensed | None:
        """What condenses a frame to its nodes; None of other scenes, and where more is coupled."""
        frame = self.constraints.frame
        if (frame is None or not self.constraints.condensable or not self.symmetric
                or self.forces.far):
            return None
        return condensed(self)

    @cached_property
    def by_nodes(self) -> bool:
        """True if steps of a motion eliminate the nodes of a frame; few equations are a border."""
        return (self.constraints.condensable and not self.forces.far and self.constraints.m > MANY
                and not len(self.damping.modal))

    @cached_property
    def _mass_by_nodes(self):
        return EliminatedMass(self)

    @property
    def coupled(self) -> bool:
        """True if the equations have more than a band: multipliers, or elements far apart."""
        return bool(self.constraints.joints) or self.forces.far

    def _far_entries(self):
        """What force elements have outside of the band, at free coordinates, where it was made."""
        i, j, w, place = self.forces.far_entries()
        if not len(i):
            return i, j, w
        u, t = self._assembled
        D = self.forces.stiffness(self.machine.tables.plain.forces, t, u, 0.0 * u, 0.0)
        return i, j, w * D[place] * (self.constraints.free[i] & self.constraints.free[j])

    def inertia(self) -> Inertia:
        """Signs of the eigenvalues of the tangent that :meth:`factorize` has factorised.

        Of the free coordinates, and with joints on the tangent space of their equations: how many
        directions there are in which the scene gives way. Of a tangent that is not symmetric they
        are those of its symmetric part.

        Returns
        -------
        Inertia
            With ``negative``, the number of negative eigenvalues, and ``singular``, whether one is
            zero to round-off.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line([0, 0.5, 1], 0.01), ElementBeamCable(5),
        ...                    StVenantKirchhoff(2e8, 0.3), width=0.01)).pin("left").pin("right")
        >>> system = scene.system
        >>> u = np.zeros(system.N)
        >>> u.reshape(-1, 6)[:, 0] = [0, -1e-4, -2e-4]  # compressed by 2.4 times Euler's load
        >>> u.reshape(-1, 6)[:, 2] = -2e-4
        >>> _ = system.assemble(u)
        >>> system.factorize(u)
        >>> system.inertia()
        Inertia(negative=1, singular=False)
        """
        if not self.coupled:
            K = self.K if self.symmetric else self.K.symmetric_part()
            return K.inertia()
        if self.condensed is not None:
            return self.condensed.inertia()
        if self.constraints.bordered and self._factors.is_definite():
            return Inertia(0, False)
        K = self._reduced()
        return inertia_of(0.5 * (K + K.T))

    def take_factors(self, factors: Factors) -> None:
        """Note that an iteration has left factors in :attr:`K`, and about it.

        Parameters
        ----------
        factors
            Those of the border.
        """
        self.K.take_factors()
        self._border = factors

    def stays(self) -> bool:
        """True if the factors left by an iteration say that no direction gives way.

        Those of its last tangent, which is that of the solution but for the last correction.
        """
        K = self.K
        if self.condensed is not None:
            return self.condensed.ready and self.condensed.inertia() == Inertia(0, False)
        if (not K.definite or self.forces.far or self.bodies
                or (self.constraints.joints and not self.constraints.bordered)):
            return False
        # what is definite is so on the tangent space of the joints
        return not self.constraints.joints or not len(self._border.S) or not gives_way(self._border)

    def determinant_sign(self) -> int:
        """The sign of the determinant of what :meth:`inertia` counts: 1 or -1.

        -1 is an odd number of negative eigenvalues, of a tangent that is not symmetric too.
        """
        if not self.coupled:
            return self.K.determinant_sign()
        if self.condensed is not None:
            return -1 if self.condensed.inertia().negative % 2 else 1
        return determinant_sign(self._reduced())

    def _whole(self):
        """The tangent with what joints add to it, sparse."""
        if self.constraints.bordered:
            return self._factors.tocsc()
        i, j, v = self._outside
        return self.K.tocsc() + sparse.csc_array((v, (i, j)), shape=(self.N, self.N))

    def _reduced(self):
        """The tangent on the tangent space of the joints, sparse of many coordinates.

        What stiff springs hold in a border lets go of with the round-off of their stiffness: of
        slender beams that is more than bending.
        """
        size = self.constraints.coordinate_sizes
        if self.constraints.bordered and self.N <= DENSE:
            T = null_basis(self._J * size) * size[:, None]
            return T.T @ self._factors.toarray() @ T
        T = sparse.csr_array(null_basis(sparse.csr_array(self._J * size)).multiply(size[:, None]))
        return (T.T @ self._whole() @ T).tocsc()

    def _sparse_factors(self, K):
        """Of K with the joints, all rows and columns over their sizes: pivots need one unit."""
        J, size = sparse.csr_array(self._J), self.constraints.coordinate_sizes
        root = np.sqrt(np.mean((np.abs(K.diagonal()) * size**2)[self.constraints.free])) or 1.0
        self._sizes = np.append(size / root, root / row_sizes(J.multiply(size)))
        S = sparse.dia_array((self._sizes[None], 0), shape=2 * self._sizes.shape)
        return splu((S @ sparse.block_array([[K, J.T], [J, None]]) @ S).tocsc())

    def solve(self, residual: Array, phi: Any = None) -> tuple[Array, Array]:
        """Solve with the factors.

        Parameters
        ----------
        residual
            Shape (N,); its fixed coordinates are ignored.
        phi
            What the constraints should change by, shape (m,), where there are joints.

        Returns
        -------
        du, multipliers
            The increments; the second is empty without joints.
        """
        b = residual * self.constraints.mask
        if not self.coupled:
            return self.K.solve(b), _NONE
        phi = _NONE if phi is None else phi
        if self.condensed is not None:
            return self.condensed.solve(b, phi)
        if self._sparse is None:
            x, multipliers, error = self._factors.solve(b, phi)
            if error < INACCURATE:
                return x, multipliers
            logger.debug("border inaccurate by %.3g: sparse LU", error)
            self._sparse = self._sparse_factors(self._factors.tocsc())
        x = self._sizes * self._sparse.solve(self._sizes * np.append(b, phi))
        if self.constraints.bordered:
            x[self.N:] += self._factors.factors.stiffness * phi
        return x[:self.N], x[self.N:]


def _times_elements(K, u_e):
    """Products of element matrices (ne, 2 nb, 2 nb) and vectors (ne, nb, 2)."""
    return np.einsum("eij,ej->ei", K, u_e.reshape(len(K), -1)).reshape(u_e.shape)


def _extent(bodies):
    """How far bodies reach."""
    corners = np.concatenate([body.outline_at(np.zeros(body.N)) for body in bodies], axis=1)
    return float(np.max(np.ptp(corners, axis=1)))
