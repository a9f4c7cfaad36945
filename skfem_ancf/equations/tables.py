"""The equations of a scene as tables that kernels take."""

from copy import copy
from functools import cached_property, partial
from typing import Annotated, Any, NamedTuple
from weakref import ref

import numpy as np

from ..core.band import Band
from ..beam.strain_energy import (BEGIN, KIND, FlatBody, body_of, copies_of, pushed_body_of,
                                  stress_size, viscous_body_of)
from ..actions.forces.kernels import ForceTables
from ..beam.kernels.law import LINEAR
from ..beam.kernels.moments import MomentPack
from ..beam.kernels.tables import linearised
from ..core.callbacks import handle_of
from ..core.sampling import sample
from ..core.source import F1, I1
from ..actions.tables import JointTables, LoadTables
from .user_defined import UserDefined
from ..core.types import Array

#: Of a scene without them.
_NO_INTS = np.zeros(0, np.int64)
_NO_JOINTS = JointTables(_NO_INTS, _NO_INTS, _NO_INTS, np.zeros(0), _NO_INTS, _NO_INTS,
                         np.zeros(0), 0)
_NO_MOMENTS = MomentPack(np.zeros((0, 2, 0), np.int64), np.zeros((0, 0)), np.zeros((0, 2)),
                         np.zeros(0), _NO_INTS)
_NO_BODY = FlatBody(_NO_INTS, np.zeros((0, KIND + 1), np.int64))
_NO_PUSHES = np.zeros((0, 0))


class Equations(NamedTuple):
    """A scene for kernels.

    Attributes
    ----------
    body
        A :class:`~skfem_ancf.beam.strain_energy.Body`; a ``FlatBody`` for compiled code.
    loads, joints
        :class:`~skfem_ancf.actions.tables.LoadTables`,
        :class:`~skfem_ancf.actions.tables.JointTables`.
    fixed, free
        Fixed coordinates, and for each one 1 or 0.
    K
        The band for the tangent, work space.
    forces
        :class:`~skfem_ancf.actions.forces.kernels.ForceTables`.
    viscous
        As ``body``, of what resists the rates of strains; the same where nothing does.
    copies
        As ``body``, of several times all coordinates, one behind the other; see
        :meth:`Tables.copied`, the same where nobody has asked.
    sizes
        Those of the coordinates, see
        :attr:`skfem_ancf.equations.constraints.Constraints.coordinate_sizes`.
    """

    body: Annotated[Any, FlatBody]
    loads: LoadTables
    joints: JointTables
    fixed: I1
    free: F1
    K: Band
    viscous: Annotated[Any, FlatBody]
    forces: ForceTables
    copies: Annotated[Any, FlatBody]
    sizes: F1


class Tables:
    """The tables of a system, and what of them depends on time.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.equations.system.System`.

    Attributes
    ----------
    plain : Equations
        What the functions of :mod:`skfem_ancf.core.source` take.
    motion_varies, turns : bool
        A joint moves with time; its derivative in the reference configuration does.
    """

    def __init__(self, system: Any) -> None:
        # the system has the tables: without a circle both go when nobody asks for them any more
        self._system = ref(system)
        self._user_defined: UserDefined | None = None
        self._sort(system.loads)
        self.motion_varies = any(joint.moving for joint in system.constraints.joints)
        self.turns = any(joint.turning for joint in system.constraints.joints)
        joints = self._joints()
        body = body_of(system.beams, system.slices, joined=not system.viscous)
        self.plain = Equations(body, self._load_tables(), joints,
                               system.constraints.fixed, system.constraints.mask, system.K.band,
                               viscous_body_of(body, system.beams, system.retardation),
                               self._forces(), body, system.constraints.coordinate_sizes)

    @property
    def system(self) -> Any:
        """Whose they are."""
        system = self._system()
        assert system is not None
        return system

    def _sort(self, loads):
        # of the constant kind, moments, linear ones, stress-free strains, others
        self._loads: list[list[Any]] = [[], [], [], [], []]
        for load in loads:
            self._loads[_kind(load)].append(load)

    @property
    def asks(self) -> bool:
        """True if kernels ask the system in Python, by its handle."""
        plain = self.plain
        return bool(plain.loads.own or plain.joints.own or plain.forces.own)

    @cached_property
    def parts(self) -> list[str]:
        """What of :data:`skfem_ancf.equations.loops.PARTS` the scene has."""
        forces = self.plain.forces
        return [*["StrainTables"] * (len(self.plain.body.packs) > 0),
                *["elements"] * (forces.number > 0), *["contacts"] * (forces.contacts.number > 0)]

    @cached_property
    def linearised(self) -> "Tables | None":
        """The same with laws of constant moduli, those without strain; None if all are such."""
        body = self.plain.body
        if all(t.law.kind == LINEAR for t in body.packs):
            return None
        body = body._replace(packs=tuple(map(linearised, body.packs)))
        return self.with_equations(self.plain._replace(body=body, viscous=body, copies=body))

    def copied(self, n: int) -> "Tables":
        """The same with ``n`` copies of all coordinates, whose forces a kernel finds together."""
        return self.with_equations(self.plain._replace(
            copies=copies_of(self.plain.body, n, self.system.N)))

    def with_equations(self, plain: Equations) -> "Tables":
        """The same with other numbers."""
        tables = copy(self)
        tables.plain = plain
        return tables

    def _forces(self):
        s = self.system
        return s.forces.tables(s.K.position, s.symmetric, self.handle if s.forces.own else 0)

    @property
    def handle(self) -> int:
        """What kernels know the user-defined items by."""
        if self._user_defined is None:
            self._user_defined = UserDefined(self.system, self._loads[-1])
            self._handle = handle_of(self._user_defined)
        return self._handle

    @property
    def stresses(self) -> Array:
        """Room for the stresses of all beams."""
        return np.zeros(self._stress_size)

    @cached_property
    def _stress_size(self):
        return stress_size(self.plain.body)

    # loads

    def _load_tables(self):
        s = self.system
        steady, turning, linear, pushing, others = self._loads
        self._rows = [load for load in steady if load.amplitude is not None]
        vectors = np.zeros((1 + len(self._rows) + len(linear), s.N))
        vectors[0] = s.constant_force
        for row, load in enumerate(self._rows, 1):
            vectors[row, s.of(load)] += load.force(None)
        pushed = self._pushed(pushing)
        if not linear:
            return LoadTables(vectors, self._moments(turning), _NO_INTS, _NO_INTS, np.zeros(0),
                              _NO_INTS, *pushed, self.handle if others else 0)
        entries, first = [[np.zeros(0)] * 4], len(vectors) + len(turning)
        for k, load in enumerate(linear):
            zero, at = np.zeros(load.beam.N), s.of(load)
            vectors[1 + len(self._rows) + k, at] = load.force(zero)
            i, j, v = load.stiffness(zero)
            entries.append((at.start + i, at.start + j, v, np.full(len(v), first + k)))
        i, j, v, k = (np.concatenate(column) for column in zip(*entries))
        return LoadTables(vectors, self._moments(turning), *(x.astype(np.int64) for x in (i, j)),
                          v.astype(float), k.astype(np.int64), *pushed,
                          self.handle if others else 0)

    def _pushed(self, loads):
        """The beams with stress-free strains, and these, a row for each load."""
        if not loads:
            return _NO_BODY, _NO_PUSHES
        of = {id(load.beam): load.beam for load in loads}
        beams = list(of.values())
        body = pushed_body_of(beams, [self.system.of(beam) for beam in beams])
        first = np.cumsum([0, *(len(beam.kernel.tables) for beam in beams)])[:-1]
        begins = dict(zip(of, body.table[first, BEGIN]))
        rows = np.zeros((len(loads), stress_size(body)))
        for row, load in zip(rows, loads):
            begin, values = begins[id(load.beam)], np.concatenate([x.ravel() for x in load.pushes])
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
            dofs[k] = first + load.dofs[:, :1]  # what is left over has no weight
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
        """The load of each factor; None for all that are constant."""
        _, turning, linear, pushing, _ = self._loads
        return [None, *self._rows, *linear, *turning, *linear, *pushing]

    def factors(self, times: Array) -> Array:
        """Factors of the loads, shape (n, k); of one row where none has an amplitude."""
        varying, n = self._amplitudes
        out = np.empty((len(times) if varying else 1, n))
        out.fill(1.0)
        for k, amplitude in varying:
            out[:, k] = amplitude(times).reshape(len(times))
        return out

    @cached_property
    def _amplitudes(self):
        """Functions of factors that vary, with their numbers, and the number of all factors."""
        columns = self._columns
        return [(k, partial(sample, load.amplitude, name="amplitude"))
                for k, load in enumerate(columns)
                if load is not None and load.amplitude is not None], len(columns)

    @cached_property
    def prestressed(self) -> bool:
        """True if the first tangent has other factors of loads, see :meth:`static_factors`."""
        return any(load.prestress for load in [*self._loads[2], *self._loads[3]])

    def static_factors(self, scale: float, before: float | None = None) -> Array:
        """Factors of the loads in statics, where an amplitude counts as one; shape (k,).

        Parameters
        ----------
        scale
            The load factor.
        before
            That of the state to start from, for the first tangent, of loads that prestress.
        """
        out = scale * self._at_rest
        if before is None or not self.prestressed:
            return out
        last = [*self._loads[2], *self._loads[3]]
        for k, load in enumerate(last, len(out) - len(last)):
            if load.prestress:
                out[k] = before * load.at_rest
        return out

    def linear_factors(self, scale: float) -> Array:
        """As :meth:`static_factors` for the stiffness of loads in linear theory: of the user's own.

        That the package's loads follow the body is of second order there.
        """
        own = [load is not None and load.first_order for load in self._columns]
        return np.where(own, self.static_factors(scale), 0.0)

    @cached_property
    def _at_rest(self):
        """Factors of the loads in statics at full load."""
        return np.array([1.0 if load is None else load.at_rest for load in self._columns])

    # joints

    def _joints(self):
        s = self.system
        #: g at the time 0
        self._slope = np.zeros((1, 0))
        if not s.constraints.joints:
            return _NO_JOINTS
        k, i, j, v = s.constraints.seconds
        gk, gi, g = s.constraints.slopes
        k, i, j, gk, gi = (packed(x, np.int64) for x in (k, i, j, gk, gi))
        self._slope = packed(g)[None]
        return JointTables(k, i, j, packed(v), gk, gi, s.constraints.equation_sizes(gk, gi, g),
                           0 if s.constraints.tabled else self.handle)

    @property
    def linear_joints(self) -> bool:
        """True if the equations of joints are linear in the coordinates, the same at all times."""
        joints = self.plain.joints
        return not (len(joints.hk) or joints.own or self.motion_varies)

    def offsets(self, times: Array) -> Array:
        """c of all joints at the times, shape (n, m)."""
        s = self.system
        if not s.constraints.joints:
            return np.zeros((len(times), 0))
        return _beside([joint.offset(times, s.N) for joint in s.constraints.joints])

    def slopes(self, times: Array) -> Array:
        """g of all joints at the times, shape (n, k); of one row where none turns."""
        s = self.system
        if not self.turns:
            return self._slope
        return _beside([joint.slope_entries(times, s.N)[2] for joint in s.constraints.joints])

    def driven(self, times: Array) -> Array:
        """c of all joints at the times and behind them g, shape (n, m + k).

        Of joints whose derivatives do not depend on time c alone, shape (n, m).
        """
        offsets = self.offsets(times)
        return np.hstack([offsets, self.slopes(times)]) if self.turns else offsets

    def at(self, t: float) -> tuple[Array, Array]:
        """c and g of all joints at one time, shapes (m,) and (k,)."""
        if not self.motion_varies and not self.plain.joints.own:
            c, g = self.still
            return c[0, 0], g[0, 0]
        times, m = np.array([t]), self.system.constraints.m
        found = self.driven(times)[0]
        return found[:m], found[m:] if self.turns else self.slopes(times)[0]

    @cached_property
    def still(self) -> tuple[Array, Array]:
        """c and g of joints that do not move with both rates, (1, 3, m) and (1, 4, k).

        g twice: at the end of a step and where the joints act. What moves, and joints that are no
        tables, have zeros.
        """
        s, joints, first = self.system, self.plain.joints, np.zeros(1)
        c, g = np.zeros((1, 3, s.constraints.m)), np.zeros((1, 4, len(joints.gk)))
        if s.constraints.m and not joints.own:
            if not self.motion_varies:
                c[:, 0] = self.offsets(first)
            if not self.turns:
                g[:, :2] = self.slopes(first)
        return c, g


def packed(values: Any, dtype: Any = np.float64) -> Any:
    """An array as compiled code takes it: contiguous and writable, of one type."""
    return np.require(values, dtype, ["C", "W"])


def _beside(arrays):
    """Arrays (n, ...) beside each other, as compiled code takes them."""
    return packed(arrays[0] if len(arrays) == 1 else np.hstack(arrays))


def _kind(load):
    """Number of the kind of table that a load goes to."""
    if load.constant:
        return 0
    if load.turning:
        return 1
    if load.linear:
        return 2
    return 3 if load.pushes else 4
