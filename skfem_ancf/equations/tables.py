"""Tables of the equations of a scene, the arguments of kernels."""

from collections.abc import Sequence
from copy import copy
from typing import Annotated, Any, NamedTuple
from weakref import proxy, ref

import numpy as np

from ..core import F1, F2, I1, I2, Array, Band, cached_property, constant, handle_of
from ..beam.strain_energy import (BEGIN, KIND, Body, FlatBody, body_of, copies_of,
                                  eigenstrain_body_of, stress_size, viscous_body_of)
from ..actions.forces.kernels import ForceTables
from ..beam.kernels.kernel import remembering
from ..beam.kernels.tables import CABLE, HISTORY, LINEAR, OF_H, linearised
from ..beam.kernels.moments import MomentPack
from ..actions.loads import Load
from ..actions.tables import JointTables, LoadTables

#: Empty tables.
_NO_INTS = np.zeros(0, np.int64)
_NO_NODES = np.zeros((2, 0), np.int64)
_NO_JOINTS = constant(JointTables(_NO_INTS, _NO_INTS, _NO_INTS, np.zeros(0), _NO_INTS, _NO_INTS,
                                  np.zeros(0), 0))
_NO_MOMENTS = constant(MomentPack(np.zeros((0, 2, 0), np.int64), np.zeros((0, 0)),
                                  np.zeros((0, 2)), np.zeros(0), _NO_INTS))
_NO_BODY = constant(FlatBody(_NO_INTS, np.zeros((0, KIND + 1), np.int64)))
_NO_EIGENSTRAINS = np.zeros((0, 0))
_NO_FACTORS = Band(np.zeros(0), _NO_INTS, 1, 0, 0)


class Axes(NamedTuple):
    """What shows that beams are within the range of the model, see
    :func:`~skfem_ancf.equations.evaluation.examine`."""

    nodes: I2  # first DOFs of the left and right nodes of all elements, (2, n)
    rest: F2  # in the reference: r_X at both nodes, chord, turn back, (8, n)
    limits: F1  # of cables: a factor of each stress, at most 1 within the range; or empty


class Equations(NamedTuple):
    """The equations of a scene for kernels."""

    body: Annotated[Any, FlatBody]  # strain energy: a Body, or a FlatBody for compiled code
    loads: LoadTables
    joints: JointTables
    fixed: I1  # numbers of fixed DOFs
    free: F1  # 1 for free DOFs, else 0
    K: Band  # work: the tangent
    viscous: Annotated[Any, FlatBody]  # as body, of viscous stresses; body itself without any
    forces: ForceTables
    copies: Annotated[Any, FlatBody]  # as body, for several displacements, see Tables.copied
    sizes: F1  # Constraints.coordinate_sizes
    history: F1  # Histories.values
    span: F1  # Histories.span
    lasting: int  # 1 if steps change the history, 3 if materials have one
    factors: Band  # work of compiled code: factors of K
    axes: Axes


class UserDefined:
    """The items of a system without tables. Times are nan in statics; results are added to ``out``
    (N,). Force elements are called through ``forces``."""

    def __init__(self, system: Any, loads: Sequence[Load]) -> None:
        self._system, self.forces, self._loads = proxy(system), system.forces, list(loads)
        self.add_custom_joints = system.constraints.add_custom_joints

    def add_custom_force(self, t: float, scale: float, u: Array, out: Array) -> None:
        """Add the force of the loads."""
        for load in self._loads:
            s = self._system.of(load)
            factor, acting = load.factor_and_load(None if np.isnan(t) else t)
            out[s] += scale * factor * acting.force(u[s])

    def add_custom_mean_force(self, t: float, u0: Array, u1: Array, out: Array) -> None:
        """Add the mean force of the loads from u0 to u1."""
        for load in self._loads:
            s, (factor, acting) = self._system.of(load), load.factor_and_load(t)
            force = acting.force(u1[s]) if np.array_equal(u0[s], u1[s]) else acting.mean_force(
                u0[s], u1[s])
            out[s] += factor * force

    def subtract_custom_stiffness(self, t: float, scale: float, u: Array, flat: Array) -> None:
        """Subtract the derivative of :meth:`add_custom_force` from the entries (n,) of a band."""
        # An infinite time stands for linear theory, in which the package's loads have no stiffness.
        system = self._system
        for load in self._loads:
            if np.isinf(t) and not load.first_order:
                continue
            first, (factor, acting) = system.of(load).start, load.factor_and_load(
                t if np.isfinite(t) else None)
            i, j, v = map(np.asarray, acting.stiffness(u[system.of(load)]))
            keep = np.full(len(v), not system.symmetric) | (i >= j)
            at = system.K.position(first + i, first + j)
            np.add.at(flat, at[keep], -scale * factor * v[keep])


class Tables:
    """The tables of a system, and their time-dependent parts. ``plain`` are the Equations for
    NumPy; ``motion_varies`` is True if a joint moves with time, ``turns`` if its Jacobian in the
    reference configuration does."""

    def __init__(self, system: Any) -> None:
        # a weak reference, since the system refers to the tables
        self._system = ref(system)
        self._user_defined: UserDefined | None = None
        # constant loads, moments, linear loads, eigenstrains, others
        self._loads: list[list[Any]] = [[], [], [], [], []]
        for load in system.loads:
            kind = (0 if load.constant else 1 if load.turning else 2 if load.linear else
                    3 if load.eigen_stresses else 4)
            self._loads[kind].append(load)
        self.motion_varies = any(joint.moving for joint in system.constraints.joints)
        self.turns = any(joint.turning for joint in system.constraints.joints)
        histories, constraints, joints = system.histories, system.constraints, _NO_JOINTS
        #: g at the time 0
        self._slope = np.zeros((1, 0))
        if constraints.joints:
            k, i, j, v = constraints.seconds
            gk, gi, g = constraints.slopes
            k, i, j, gk, gi = (packed(x, np.int64) for x in (k, i, j, gk, gi))
            self._slope = packed(g)[None]
            joints = JointTables(k, i, j, packed(v), gk, gi, constraints.equation_sizes(gk, gi, g),
                                 0 if constraints.tabled else self.handle)
        body = body_of(system.beams, system.slices, joined=not system.viscous)
        if histories.path_dependent:
            body = body.after(histories.of_beams)
        forces = system.forces.tables(system.K.position, system.symmetric, self.handle if (
            system.forces.custom or system.forces.changing) else 0)
        self.plain = Equations(body, self._load_tables(), joints,
                               constraints.fixed, constraints.mask, system.K,
                               viscous_body_of(body, system.beams, system.retardation),
                               forces, body, constraints.coordinate_sizes,
                               histories.values, histories.span, histories.lasting,
                               _NO_FACTORS, self._axes(body))

    @property
    def system(self) -> Any:
        system = self._system()
        assert system is not None
        return system

    @cached_property
    def parts(self) -> list[str]:
        """Compiled parts that the scene uses, see :mod:`skfem_ancf.equations.loops`."""
        forces, packs = self.plain.forces, self.plain.body.packs
        used = {"StrainTables": len(packs) > 0, "cables": any(t.kind == CABLE for t in packs),
                "moments": self.plain.loads.moments.M.size > 0,
                "joints": self.system.constraints.m > 0, "elements": forces.number > 0,
                "laws": any(t.law.kind != LINEAR for t in packs),
                "histories": any(t.law.kind == HISTORY for t in packs),
                "contacts": forces.contacts.number > 0,
                "pairs": forces.paired > 0,
                "eigenstrains": len(self.plain.loads.eigenstrains) > 0}
        return [name for name, yes in used.items() if yes]

    @cached_property
    def linearised(self) -> "Tables | None":
        """Tables with the laws at zero strain; None if all are linear, or one has a history."""
        body = self.plain.body
        kinds = {t.law.kind for t in body.packs}
        if kinds <= {LINEAR} or HISTORY in kinds:
            return None
        body = Body([linearised(t) for t in body.packs], body.table)
        return self.with_equations(self.plain._replace(body=body, viscous=body, copies=body))

    def elastic_from(self, u: Array) -> "Tables":
        """Tables whose laws with a history are elastic from their stress at u (N,)."""
        return self.with_equations(self.plain._replace(body=self.plain.body.elastic_from(u)))

    def copied(self, n: int) -> "Tables":
        """Tables for n displacements at once."""
        return self.with_equations(self.plain._replace(
            copies=copies_of(self.plain.body, n, self.system.N)))

    def with_equations(self, plain: Equations) -> "Tables":
        """A copy with other equations."""
        tables = copy(self)
        tables.plain = plain
        return tables

    def after(self, system: Any) -> "Tables":
        """A copy for a system with another history."""
        histories, plain = system.histories, self.plain
        tables = self.with_equations(plain)
        tables._system = ref(system)
        body, loads, elements = plain.body, plain.loads, list[Any]()
        if histories.path_dependent:
            body = body.after(histories.of_beams)
            if self._loads[3]:  # the beams with eigenstrains, with their histories
                those: Any = loads.eigenstrained
                for beam in self._eigenstrained:
                    some = those.elements[len(elements):len(elements) + len(beam.kernel.tables)]
                    past = histories.past(beam)
                    elements += some if past is None else remembering(some, past)
                those = Body(those.packs, those.table, elements=elements)
                loads = loads._replace(eigenstrained=those)
        if plain.forces.custom:
            tables._user_defined = None
        forces = plain.forces._replace(
            contacts=system.forces.contacts.tables, clear=system.forces.clear,
            rested=system.forces.rested, pairs=system.forces.pairs,
            custom=tables.handle if plain.forces.custom else 0)
        tables.plain = plain._replace(
            body=body, viscous=body if plain.viscous is plain.body else plain.viscous,
            copies=body, loads=loads, forces=forces, history=histories.values,
            span=histories.span)
        return tables

    def _axes(self, body):
        """The Axes."""
        # Stresses are strains times moduli in linear laws without coupling; of cables half the
        # length, or half the curvature of a radius of half the height, are far from sections that
        # overlap.
        system, nodes, rest, limits = self.system, [_NO_NODES], [np.zeros((8, 0))], []
        for beam, s in zip(system.beams, system.slices):
            axis = beam.q0_local.view(complex).reshape(-1, beam.nd // 2)[:, :2]
            (left, a), (right, b) = axis[beam.mesh.t].transpose(0, 2, 1)
            parts = np.array([a, b, right - left, a * b.conj()])
            rest.append(parts.view(float).reshape(4, -1, 2).transpose(0, 2, 1).reshape(8, -1))
            nodes.append(s.start + beam.nd * beam.mesh.t)
        high = max([beam.mesh.height for beam in system.beams], default=0.0)
        if all(t.kind == CABLE and t.law.kind == LINEAR and t.pattern.ns == len(t.H[0])
               for t in body.packs) and all(beam.mesh.is_straight for beam in system.beams):
            for t in body.packs:
                size = np.array([[2.0], [high]]) / t.H.reshape(len(t.H), 2, -1)
                limits.append(size.take(t.at[:, OF_H], 0).ravel())
        return Axes(np.concatenate(nodes, axis=1), np.concatenate(rest, axis=1),
                    np.concatenate([np.zeros(0), *limits]))

    @property
    def calls_back(self) -> bool:
        """True if kernels call Python."""
        contacts = self.system.forces.contacts
        return self._user_defined is not None or contacts.moving or contacts.custom

    @property
    def handle(self) -> int:
        if self._user_defined is None:
            self._user_defined = UserDefined(self.system, self._loads[-1])
            self._handle = handle_of(self._user_defined)
        return self._handle

    @property
    def stresses(self) -> Array:
        """A work array for the stresses of all beams."""
        return np.zeros(self.stresses_size)

    @cached_property
    def stresses_size(self) -> int:
        return stress_size(self.plain.body)

    # loads

    def _load_tables(self):
        s = self.system
        steady, turning, linear, eigen, others = self._loads
        self._rows = [load for load in steady if load.amplitude is not None]
        vectors = np.zeros((1 + len(self._rows) + len(linear), s.N))
        vectors[0] = s.constant_force
        for row, load in enumerate(self._rows, 1):
            vectors[row, s.of(load)] += load.force(None)
        eigenstrains = self._eigenstrains(eigen)
        if not linear:
            return LoadTables(vectors, self._moments(turning), _NO_INTS, _NO_INTS, np.zeros(0),
                              _NO_INTS, *eigenstrains, self.handle if others else 0)
        entries, first = [[np.zeros(0)] * 4], len(vectors) + len(turning)
        for k, load in enumerate(linear):
            zero, at = np.zeros(load.beam.N), s.of(load)
            vectors[1 + len(self._rows) + k, at] = load.force(zero)
            i, j, v = load.stiffness(zero)
            entries.append((at.start + i, at.start + j, v, np.full(len(v), first + k)))
        i, j, v, k = (np.concatenate(column) for column in zip(*entries))
        return LoadTables(vectors, self._moments(turning), *(x.astype(np.int64) for x in (i, j)),
                          v.astype(float), k.astype(np.int64), *eigenstrains,
                          self.handle if others else 0)

    def _eigenstrains(self, loads):
        """The beams with eigenstrains, and a row of these for each load."""
        if not loads:
            return _NO_BODY, _NO_EIGENSTRAINS
        of = {id(load.beam): load.beam for load in loads}
        self._eigenstrained = beams = list(of.values())
        body = eigenstrain_body_of(beams, [self.system.of(beam) for beam in beams])
        first = np.cumsum([0, *(len(beam.kernel.tables) for beam in beams)])[:-1]
        begins = dict(zip(of, body.table[first, BEGIN]))
        rows = np.zeros((len(loads), stress_size(body)))
        for row, load in zip(rows, loads):
            begin = begins[id(load.beam)]
            values = np.concatenate([x.ravel() for x in load.eigen_stresses])
            row[begin:begin + len(values)] = values
        return body, rows

    def _moments(self, turning):
        if not turning:
            return _NO_MOMENTS
        n, most = len(turning), max((load.dofs.shape[1] for load in turning), default=0)
        dofs, c = np.zeros((n, 2, most), dtype=np.int64), np.zeros((n, most))
        start = np.zeros((n, 2))
        for k, load in enumerate(turning):
            size, first = load.dofs.shape[1], self.system.of(load).start
            dofs[k] = first + load.dofs[:, :1]  # padding, with weight zero
            dofs[k, :, :size], c[k, :size] = first + load.dofs, load.c
            start[k] = load.direction(np.zeros(load.beam.N))
        opposite = np.full(n, -1, dtype=np.int64)
        for k, load in enumerate(turning):
            for i in range(k if load.couple is not None else 0):
                if turning[i].couple is load.couple:
                    opposite[[i, k]] = k, i
        return MomentPack(dofs, c, start, np.array([load.M for load in turning], dtype=float),
                          opposite)

    @property
    def _columns(self):
        """The load of each factor; None for the constant loads."""
        _, turning, linear, eigen, _ = self._loads
        return [None, *self._rows, *linear, *turning, *linear, *eigen]

    def factors(self, times: Array) -> Array:
        """Load factors at times (n,), shape (n, k), or one row if constant."""
        varying, n = self._amplitudes
        out = np.empty((len(times) if varying else 1, n))
        out.fill(1.0)
        for k, amplitude in varying:
            out[:, k] = amplitude(times).reshape(len(times))
        return out

    @cached_property
    def _amplitudes(self):
        """Numbers and functions of time-dependent factors, and the number of all factors."""
        columns = self._columns
        return [(k, load.amplitude.sampled)
                for k, load in enumerate(columns)
                if load is not None and load.amplitude is not None], len(columns)

    @cached_property
    def prestressed(self) -> bool:
        """True if a load acts as prestress in the first tangent, see :meth:`static_factors`."""
        return any(load.prestress for load in [*self._loads[2], *self._loads[3]])

    def static_factors(self, scale: float, before: float | None = None) -> Array:
        """Load factors (k,) in statics at the load factor ``scale``."""
        # ``before`` is the load factor of the initial state, for prestress in the first tangent.
        out = scale * self._at_rest
        if before is None or not self.prestressed:
            return out
        last = [*self._loads[2], *self._loads[3]]
        for k, load in enumerate(last, len(out) - len(last)):
            if load.prestress:
                out[k] = before * load.at_rest
        return out

    def linear_factors(self, scale: float) -> Array:
        """Load factors for the load stiffness in linear theory: of user-defined loads only."""
        own = [load is not None and load.first_order for load in self._columns]
        return np.where(own, self.static_factors(scale), 0.0)

    @cached_property
    def _at_rest(self):
        """Load factors in statics at full load."""
        return np.array([1.0 if load is None else load.at_rest for load in self._columns])

    # joints

    @property
    def linear_joints(self) -> bool:
        """True if the joint equations are linear and constant in time."""
        joints = self.plain.joints
        return not (len(joints.hk) or joints.custom or self.motion_varies)

    def slopes(self, times: Array) -> Array:
        """g of all joints at times (n,), shape (n, k), or one row if constant."""
        s = self.system
        if not self.turns:
            return self._slope
        return _beside([joint.slope_entries(times, s.N)[2] for joint in s.constraints.joints])

    def driven(self, times: Array) -> Array:
        """c and, if time-dependent, g of all joints at times (n,), shape (n, m + k) or (n, m)."""
        if not self.turns:
            return self.system.constraints.offsets(times)
        s = self.system
        both = zip(*(joint.terms(times, s.N) for joint in s.constraints.joints))
        return np.hstack([_beside(x) for x in both])

    def at(self, t: float) -> tuple[Array, Array]:
        """c (m,) and g (k,) of all joints at one time."""
        if not self.motion_varies and not self.plain.joints.custom:
            c, g = self.still
            return c[0, 0], g[0, 0]
        times, m = np.array([t]), self.system.constraints.m
        found = self.driven(times)[0]
        return found[:m], found[m:] if self.turns else self.slopes(times)[0]

    @cached_property
    def still(self) -> tuple[Array, Array]:
        """Constant c and g with two rates, (1, 3, m) and (1, 3, k); zero where time-dependent."""
        s, joints, first = self.system, self.plain.joints, np.zeros(1)
        c, g = np.zeros((1, 3, s.constraints.m)), np.zeros((1, 3, len(joints.gk)))
        if s.constraints.m and not joints.custom:
            if not self.motion_varies:
                c[:, 0] = s.constraints.offsets(first)
            if not self.turns:
                g[:, 0] = self.slopes(first)
        return c, g


def packed(values: Any, dtype: Any = np.float64) -> Any:
    """A contiguous, writable array for compiled code."""
    return np.require(values, dtype, ["C", "W"])


def _beside(arrays):
    """Arrays (n, ...) side by side."""
    return packed(arrays[0] if len(arrays) == 1 else np.hstack(arrays))
