"""Members of a sweep that are scenes of one topology, solved together in compiled code."""

from __future__ import annotations

import logging
import os
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextvars import copy_context
from functools import partial
from queue import SimpleQueue
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np

from . import compiled
from .alike import Family, NotBuilt, Unlike
from .kernels.section import SectionPack, side_by_side
from .linalg import BandMatrix
from .polynomials import Polynomial
from .statics.iteration import (CONVERGED, Members, Target, Unknowns, equilibrium,
                                room_for_iterations)
from .statics.newton import rules_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from .readings import Reading, Readings
    from .scene import Scene
    from .types import Array

logger = logging.getLogger(__name__)

#: Members of a call of compiled code, and elements that are checked at once.
CHUNK, ELEMENTS = 128, 1024
#: A family has so many members at least, and for each scene that is built to learn of it.
LEAST, EACH = 16, 4
#: Members that are built and solved alone, too: at least, and for each so many one; and how far
#: these solutions may differ, relative.
TRIED, OF, NEAR = 2, 2500, 1e-6
#: Members that are built only: so many in all, or for so many members one.
BUILT, FOR = 16, 8
#: Error of a start that is given, relative, and how large it may be for a start to be given at
#: all; members for each one that is solved to find starts, and for each that is solved from zero,
#: too, to see whether a start leads to what zero leads to.
START, USEFUL, STARTS, CHECKED = 1e-10, 1e-2, 16, 1000
#: Method, tolerance and most iterations of ``solve_static``.
OPTIONS = "mixed", 1e-8, 30
#: Members that are solved alone since they may be out of the range of law or mesh, about.
WARNED = 4
#: How often members at the ends of a parameter are left out, if they cannot be built.
ROUNDS = 4
#: Why members are alone.
SMALL = "their numbers are so much smaller than those of others that digits would be lost"
#: What is compiled in one thread at a time.
_LOCK = Lock()


class Lane:
    """The arrays in which a thread solves members.

    Parameters
    ----------
    family
        A :class:`~skfem_ancf.alike.Family`.
    """

    def __init__(self, family: Family) -> None:
        one = family.one
        system = one.scene.system
        self.family, self.numbers = family, np.empty(len(family.scale))
        solved = family.solved(self.numbers)
        band = BandMatrix(system.N, system.bandwidth, True).band
        body = solved.equations.body
        equations = solved.equations._replace(K=band, viscous=body, copies=body)
        tables = system.machine.tables.with_equations(equations)
        self._machine = system.machine.with_tables(tables)
        self._solved, N, m = solved, system.N, system.m
        self._target = Target(solved.factors, solved.before, 1.0, 1.0, solved.offsets,
                              solved.slopes, np.zeros(N), np.zeros(len(solved.held)))
        self._rules = rules_of(system, *OPTIONS)
        self._room = room_for_iterations(equations, m)
        self._x = Unknowns(np.empty(N), np.empty(m), np.empty(N), tables.stresses, tables.stresses)
        self._record = np.empty((OPTIONS[-1] + 1, 2))

    def solve(self, values: Array, u: Array, given: bool) -> Array:
        """Solve members.

        Parameters
        ----------
        values
            What the family says of their parameters, shape (n, functions).
        u
            Where they start, shape (n, N); becomes their solutions.
        given
            False for a start from zero.

        Returns
        -------
        ndarray
            As ``found`` of :class:`~skfem_ancf.statics.iteration.Members`.
        """
        solved, found = self._solved, np.zeros((len(u), 3), dtype=np.int64)
        found[:, 2] = given
        members = Members(self.numbers, self.family.scale, self.family.which, values, solved.noise,
                          solved.held, solved.factors, solved.spread, u, found)
        args = self._target, self._rules, self._x, self._room, self._record, members
        with np.errstate(all="ignore"):  # what overflows is seen in the residual
            with _LOCK:
                run = self._machine.of(equilibrium)
                if equilibrium.__name__ not in compiled.LOADED:
                    run(*args)
                    return found
            run(*args)
        return found


class Batch:
    """Members of one topology.

    Parameters
    ----------
    build
        From parameters, shape (d,), to a Scene.
    readings
        What is read of them.
    x
        Their parameters, shape (n, d), all of which differ between some.

    Attributes
    ----------
    kept
        Which of them are members.

    Raises
    ------
    Unlike
        If they cannot be solved together.
    """

    def __init__(self, build: Callable[[Array], Scene], readings: Sequence[Reading], x: Array
                 ) -> None:
        if len(x) < LEAST:
            raise Unlike(f"fewer than {LEAST} are alike")
        if not x.shape[1]:
            raise Unlike("they are all the same")
        low, high = np.min(x, axis=0), np.max(x, axis=0)
        self.family = Family(build, readings, low, high, len(x) // EACH)
        self.kept = np.flatnonzero(self.family.exact(x))
        if len(self.kept) < LEAST:
            raise Unlike(SMALL)
        self.x, self._readings = x[self.kept], readings
        tried = np.random.default_rng(0).choice(len(self.x), max(TRIED, len(x) // OF),
                                                replace=False)
        scenes = [self.family.tried(self.x[k]) for k in tried]
        for k in evenly(self.x, min(BUILT, len(self.x) // FOR)):
            self.family.tried(self.x[k])
        self.lane = Lane(self.family)
        self.start: Polynomial | None = None
        if len(self.x) >= STARTS * LEAST:
            self._find_starts(build, low, high, len(self.x) // STARTS)
        self._compare(tried, scenes)

    def _find_starts(self, build, low, high, most):
        """Solutions as polynomials of the parameters, where they are such, nearly."""
        def solution(x):
            u, found = self._from_zero(self.lane, self.family.values(x[None]))
            return u[0] if found[0, 0] == CONVERGED else build(x).solve_static().u

        try:
            start = Polynomial(solution, low, high, lambda surplus, largest: float(
                np.max(np.abs(surplus)) / (START * np.max(largest) + 1e-300)), most)
        except Exception:  # of the caller's function, or a scene has no equilibrium
            logger.debug("no polynomial of solutions", exc_info=True)
            return
        if start.rest * START > USEFUL:
            return
        self.start = start
        some = np.random.default_rng(1).choice(len(self.x), max(LEAST // 2, len(self.x) // CHECKED))
        u, _, good, _ = self.solve(self.lane, some)
        known, found = self._from_zero(self.lane, self.family.values(self.x[some]))
        both = good & (found[:, 0] == CONVERGED)
        if np.any(_apart(u[both], known[both]) > NEAR):
            self.start = None  # another branch

    def _compare(self, tried, scenes):
        """Solve some alone: by load steps, from zero."""
        u, _, good, _ = self.solve(self.lane, tried)
        for scene, mine, there in zip(scenes, u, good):
            if not there:
                continue
            try:
                its = scene.solve_static().u
            except Exception:  # that member will fail alone, and say why
                logger.debug("a member has no solution alone", exc_info=True)
                continue
            if _apart(mine, its) > NEAR:
                raise Unlike("a member that was solved alone has another equilibrium")

    def solve(self, lane: Lane, which: Array) -> tuple[Array, Array, Array, Array]:
        """Solve members.

        Parameters
        ----------
        lane
            The arrays of this thread.
        which
            Numbers of the members, shape (k,).

        Returns
        -------
        u, found, good, doubtful
            Displacements (k, N); status, linear systems and start (k, 3); which are solved, and
            which may be out of the range of law or mesh: (k,).
        """
        x = self.x[which]
        values = self.family.values(x)
        if self.start is None:
            u, found = self._from_zero(lane, values)
        else:
            begun = np.ascontiguousarray(self.start(x))
            u = begun.copy()
            found = lane.solve(values, u, True)
            more = np.flatnonzero(found[:, 1] > 1)  # those of one correction have not come far
            far = more[_apart(u[more], begun[more]) > USEFUL]
            if len(far):  # it may have come to another branch
                u[far], found[far] = self._from_zero(lane, values[far])
        good = found[:, 0] == CONVERGED
        u[~good] = 0.0
        upright, doubtful = self._checked(u, values)
        return u, found, good & upright, good & upright & doubtful

    def _from_zero(self, lane, values):
        """Displacements, and what :meth:`Lane.solve` says, without a start."""
        u = np.zeros((len(values), self.family.one.scene.system.N))
        return u, lane.solve(values, u, False)

    def _checked(self, u, values):
        """Which are not turned inside out, and which may be out of range; shape (k,)."""
        elements = sum(beam.mesh.nelements for beam in self.family.one.scene.beams)
        most = max(1, ELEMENTS // elements)  # what they take together stays in cache
        parts = [self._checked_few(u[k:k + most], values[k:k + most])
                 for k in range(0, len(u), most)]
        return [np.concatenate(x) for x in zip(*parts)]

    def _checked_few(self, u, values):
        family, solved = self.family, self.family.one.solved
        system, places = family.one.scene.system, _Places(family, values)
        start = places("start")
        start = None if start is None else start[:, 0] + 1j * start[:, 1]
        doubtful = ~system.screen.passes(u, start, places("slender"))
        good = np.ones(len(u), dtype=bool)
        first, packs = 0, solved.equations.body.packs
        for beam, s in zip(system.beams, system.slices):
            last, n = first + len(beam.kernel.packs), s.stop - s.start
            tables = [places.pack(k, pack, len(u), n) for k, pack in
                      enumerate(packs[first:last], first) if isinstance(pack, SectionPack)]
            good &= ~beam.kernel.inverted_members(tables, u[:, s])
            first = last
        return good, doubtful

    def read(self, u: Array, which: Array) -> dict[str, Array]:
        """What is read of solutions: from name to an array, one row for each.

        Parameters
        ----------
        u, which
            Displacements (k, N), and the numbers of the members.
        """
        family, out = self.family, {}
        places = _Places(family, self.family.values(self.x[which]) if family.places else None)
        for k, (item, located) in enumerate(zip(self._readings, family.one.located)):
            values = []
            for j, part in enumerate(located.parts):
                weights, start = (places("points", k, j, m) for m in (1, 2))
                moved = part.displacement(u) if weights is None else np.sum(
                    weights[:, :, None] * u[:, part.dofs], axis=1)
                if item.what == "position":
                    moved = moved + (part.start if start is None else start)
                values.append(moved)
            out[item.name] = located.gather(values)
        return out


def evenly(x: Array, count: int) -> Array:
    """Members spread evenly over the values of each parameter, so that little hides between.

    Parameters
    ----------
    x
        Parameters, shape (n, d).
    count
        About how many, of all parameters together.

    Returns
    -------
    ndarray
        Their numbers.
    """
    n, d = x.shape
    each = max(1, count // d)
    places = ((np.arange(each) + 0.5) / each * n).astype(int)
    return np.unique(np.argsort(x, axis=0)[places])


def _apart(u, v):
    """How far displacements are from others, relative; of each row."""
    return np.max(np.abs(u - v), axis=-1) / (np.max(np.abs(v), axis=-1) + 1e-300)


class _Places:
    """Arrays of some members by their names."""

    def __init__(self, family, values):
        self.family, self.values = family, values

    def __call__(self, name, *more):
        place = self.family.one.solved._fields.index(name), *more
        return self.family.array(place, self.values)

    def pack(self, k, pack, members, N):
        """The pack number k of members side by side."""
        solved, changed = self.family.one.solved, {}
        at = solved._fields.index("equations"), solved.equations._fields.index("body"), 0, k
        for name, axis in (("table", 0), ("frame", 2)):
            x = self.family.array((*at, pack._fields.index(name)), self.values)
            if x is not None:
                count = pack.start.size // x.shape[1 + axis]
                x = np.moveaxis(x, 1 + axis, 1)  # (members, 1 or elements, ...)
                x = np.repeat(x.reshape(-1, *x.shape[2:]), count, axis=0)
                changed[name] = np.ascontiguousarray(np.moveaxis(x, 0, axis))
        return side_by_side(pack._replace(**changed), members, N)


def threads_of(workers: int | None) -> int:
    """How many threads solve: as many as are asked for, or as there are processors."""
    if workers is not None:
        return workers
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:
        return os.cpu_count() or 1


def families(members: Sequence[dict[str, Any]], columns: dict[str, Array], places: Sequence[int]
             ) -> Iterator[tuple[Array, list[tuple[str, int]], Array]]:
    """Members that may be of one topology: equal but for floats.

    Parameters
    ----------
    members, columns
        Parameters of all, as dicts and as arrays by name, one row for each member.
    places
        Which of them are asked for.

    Yields
    ------
    places, names, x
        Some of the places; of floats that differ among them the name, and the number in what that
        is for a member; and their values, (n, d).
    """
    if not len(places):
        return
    at, first = np.array(places), members[places[0]]
    floats = {name: x.reshape(len(x), -1) for name, x in columns.items() if x.dtype.kind == "f"}
    others = [name for name in first if name not in floats]
    groups: dict[Any, Any] = {} if others else {None: np.arange(len(at))}
    for k, place in enumerate(places) if others else ():
        member = members[place]
        groups.setdefault(tuple(_key(member[name]) for name in others), []).append(k)
    for found in groups.values():
        mine = at[found]
        names = [(name, int(k)) for name, x in floats.items()
                 for k in np.flatnonzero(np.any(x[mine] != x[mine[0]], axis=0))]
        yield mine, names, np.array([floats[name][mine, k] for name, k in names]).reshape(
            len(names), len(mine)).T


def _key(value):
    """Equal only of values that are the same to every function; of unknown objects it is which."""
    if value is None or type(value) in (bool, int, float, complex, str, bytes):
        return type(value), repr(value)
    if type(value) in (list, tuple):
        return type(value), tuple(map(_key, value))
    if type(value) is dict:
        return dict, tuple((_key(name), _key(one)) for name, one in value.items())
    if isinstance(value, np.generic) or type(value) is np.ndarray and not value.dtype.hasobject:
        return value.dtype, value.shape, value.tobytes()
    return type(value), id(value)


def _built(build, member, names, values):
    """The scene of a member some of whose floats are others."""
    member = dict(member)
    for (name, k), value in zip(names, values):
        given = member[name]
        if np.ndim(given):
            x = np.array(given, dtype=float)
            x.reshape(-1)[k] = value
            member[name] = x if isinstance(given, np.ndarray) else type(given)(x.tolist())
        else:
            member[name] = float(value)
    return build(**member)


def _batch(build, items, x):
    """A Batch of members, and which they are: without those at the ends that cannot be built."""
    keep = np.arange(len(x))
    for left in range(ROUNDS, -1, -1):
        try:
            return Batch(build, items, x[keep]), keep
        except NotBuilt:
            ends = np.unique([np.argmin(x[keep], axis=0), np.argmax(x[keep], axis=0)])
            out = [k for k in ends if _fails(build, x[keep[k]])]
            if not out or not left:
                raise
            keep = np.delete(keep, out)
    raise AssertionError


def _fails(build, x):
    try:
        build(x)
    except Exception:  # of the caller's function, which may raise anything
        return True
    return False


def solve_together(build: Callable[..., Scene], readings: Readings,
                   members: Sequence[dict[str, Any]],
                   columns: dict[str, Array], places: Sequence[int], threads: int, said: list[str]
                   ) -> Iterator[tuple[Array, dict[str, Array]]]:
    """Solve members of one topology together; yields their places and arrays of what was read.

    Parameters
    ----------
    build, readings
        From parameters to a scene, and what is read of it.
    members, columns, places
        Parameters of all, as dicts and as arrays by name, and which are computed.
    threads
        How many threads.
    said
        Lines are added to it: what was done, and why not all is together.
    """
    if not readings.at_points:
        said.append("each member was solved alone: what is read is a function of the State")
        return
    alone: dict[str, int] = {}
    for found, names, x in families(members, columns, places):
        finite = np.all(np.isfinite(x), axis=1)
        _count(alone, "a parameter is not finite", np.sum(~finite))
        found, x = found[finite], x[finite]
        if not len(found):
            continue
        try:
            build_at = partial(_built, build, members[found[0]], names)
            batch, kept = _batch(build_at, readings.items, x)
        except Unlike as reason:
            _count(alone, str(reason), len(found))
            continue
        _count(alone, "build, or what is read, fails at an end of a parameter",
               len(found) - len(kept))
        found = found[kept]
        _count(alone, SMALL, len(found) - len(batch.kept))
        found = found[batch.kept]
        counts = np.zeros(5, dtype=int)
        for which, values, good, doubtful, iterations in _spread(batch, threads):
            warned = np.flatnonzero(doubtful)[:max(0, WARNED - counts[4])]  # alone they will warn
            keep = np.delete(np.arange(len(doubtful)), warned)
            counts += len(good), len(keep), *iterations, doubtful.sum()
            yield found[which[good][keep]], {name: x[keep] for name, x in values.items()}
        said.append(_report(batch, counts))
        logger.info(said[-1])
    said += [f"{count} members were solved alone: {reason}" for reason, count in alone.items()]


def _count(alone, reason, members):
    """Add up members by the reason why they are solved alone."""
    if members:
        alone[reason] = alone.get(reason, 0) + int(members)
        logger.info("%d members are solved alone: %s", members, reason)


def _report(batch, counts):
    """How members were solved together, in words."""
    return (f"{counts[1]} of {counts[0]} members were solved together: {batch.family.asked} scenes "
            f"were built to know all, {counts[2]} linear systems, {counts[3]} from zero"
            + (f", the others from a polynomial of {batch.start.asked} solutions"
               if batch.start is not None else "")
            + (f"; {counts[4]} may be out of the range of law or mesh, some of which were solved "
               "alone, with a warning where they are" if counts[4] else ""))


def _spread(batch, threads):
    """Chunks of members in threads: which, what is read of the good ones, which those are, which
    of them are doubtful, and how many linear systems were solved and how many members from zero.
    """
    n, lanes = len(batch.x), SimpleQueue()
    threads = max(1, min(threads, n // CHUNK))
    for lane in [batch.lane, *(Lane(batch.family) for _ in range(threads - 1))]:
        lanes.put(lane)

    def solve(which):
        lane = lanes.get()
        try:
            u, found, good, doubtful = batch.solve(lane, which)
        finally:
            lanes.put(lane)
        values = batch.read(u[good], which[good])
        return which, values, good, doubtful[good], (found[:, 1].sum(), np.sum(found[:, 2] != 1))

    chunks = np.array_split(np.arange(n), -(-n // CHUNK))
    with ThreadPoolExecutor(threads) as pool:
        flying = {pool.submit(copy_context().run, solve, chunk) for chunk in chunks}
        try:
            while flying:
                done, flying = wait(flying, return_when=FIRST_COMPLETED)
                for future in done:
                    yield future.result()
        finally:
            for future in flying:
                future.cancel()
