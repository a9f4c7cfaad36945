"""What scenes of one topology differ by: numbers, as functions of their parameters.

Everything that a static solution takes of a scene is arrays, those of
:class:`~skfem_ancf.equations.Equations` most of all. Scenes whose integers and shapes are equal
differ by floats only. A few scenes are built; from these the floats of all others follow by
:class:`~skfem_ancf.polynomials.Polynomial`, where that is exact to round-off.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from .polynomials import Polynomial

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from .equations import Equations
    from .readings import Reading
    from .scene import Scene
    from .types import Array

#: Largest surplus of a number, relative to the size of those beside it, that is round-off; their
#: largest error at scenes that were not asked; and the round-off of a number, relative to itself,
#: beyond which a member is solved alone.
ROUND_OFF, EXACT, LOST = 2e-14, 1e-12, 1e-9
#: Arrays whose round-off is that of another one, of the same tuple; those of quantities that have
#: nothing to do with each other, all of them or along the first axis; and those whose rows and
#: columns have units of their own.
BESIDE, APART, FIRST = {"held_skew": "held"}, {"noise"}, {"stiffness"}
MATRICES = {"table", "transposed", "constant", "symmetric", "skew"}
#: How much larger the round-off of what is small in these may be, on curves.
CURVED = 64.0


class Unlike(Exception):
    """Scenes that cannot be solved together; the message says why."""


class NotBuilt(Unlike):
    """One of them could not be built, or what is read of it not be found."""


class Solved(NamedTuple):
    """All that a static solution takes of a scene.

    Attributes
    ----------
    equations
        :class:`~skfem_ancf.equations.Equations`, without room for the tangent.
    factors, before
        Of loads, at full load and before the first correction from zero.
    offsets, slopes
        Of joints, see :meth:`~skfem_ancf.equations.Tables.at`.
    held
        Displacements of the fixed coordinates.
    noise
        Square of the noise of a correction's work.
    spread
        See :class:`~skfem_ancf.statics.iteration.Members`.
    start, slender
        Of :class:`~skfem_ancf.checks.Screen`, the first as real and imaginary parts.
    points
        Coordinates, weights and places of the points that are read, and whether they are off the
        axis of a cable, for each reading and beam.
    """

    equations: Equations
    factors: Array
    before: Array
    offsets: Array
    slopes: Array
    held: Array
    noise: Array
    spread: Array
    start: Array
    slender: Array
    points: tuple[Any, ...]


class Numbers:
    """A scene as numbers.

    Parameters
    ----------
    scene, readings
        The scene, and what will be read of it.

    Attributes
    ----------
    scene, solved
        The scene, and its :class:`Solved`.
    same
        What has to be equal.
    arrays
        Those of floats by their places.
    vector
        All of them, one behind the other.
    """

    def __init__(self, scene: Scene, readings: Sequence[Reading]) -> None:
        system = scene.system
        if system.machine.tables.alone:
            raise Unlike(system.machine.tables.alone)
        system.require_supports()
        tables, screen = system.machine.tables, system.screen
        self.scene, self.located = scene, [reading.located(scene) for reading in readings]
        self.solved = Solved(
            tables.plain._replace(K=cast(Any, ()), viscous=(), copies=()),
            tables.static_factors(1.0), tables.static_factors(1.0, 0.0), *tables.at(1.0),
            system.values(1.0),
            np.array([system.work_noise**2]), np.array([system.noise]),
            np.array([screen.start.real, screen.start.imag]), screen.slender,
            tuple(tuple((part.dofs, part.weights, part.start, int(part.off_axis))
                        for part in located.parts) for located in self.located))
        self.arrays: dict[Any, Array] = {}
        same: list[tuple[Any, ...]] = []
        for place, value in _leaves(self.solved):
            if isinstance(value, np.ndarray) and value.dtype.kind == "f":
                self.arrays[place] = value
                same.append((place, value.shape))
            elif isinstance(value, np.ndarray):
                same.append((place, value.shape, value.tobytes()))
            else:
                same.append((place, value))
        self.same = same
        self.vector = np.concatenate([x.ravel() for x in self.arrays.values()])


def _leaves(x: Any, place: tuple = ()) -> Iterator[tuple[tuple, Any]]:
    """Places and values of what is no tuple."""
    if not isinstance(x, tuple):
        yield place, x
        return
    for k, part in enumerate(x):
        if hasattr(x, "_fields") and x._fields[k] in ("handle", "contacts", "sizes"):
            continue  # of the one scene; there are no obstacles; what is next to nothing
        yield from _leaves(part, (*place, k))


def _name(solved, place):
    """What its tuple calls an array, and the names of that tuple."""
    for step in place[:-1]:
        solved = solved[step]
    fields = getattr(solved, "_fields", ())
    return (fields[place[-1]] if fields else ""), fields


def _sizes(x, name):
    """What the round-off of each number of an array is compared with, of the same shape.

    The largest of all. Of matrices at most :data:`CURVED` times the largest of the row times that
    of the column, over that of all; or the number, if that is larger.
    """
    x = np.abs(x)
    if name in APART:
        return x
    if name not in MATRICES:
        axes = tuple(range(int(name in FIRST), x.ndim))
        return np.broadcast_to(np.max(x, axis=axes, keepdims=True), x.shape)
    rows, columns = (np.max(x, axis=k, keepdims=True) for k in (-1, -2))
    top = np.max(rows, axis=-2, keepdims=True)
    return np.maximum(x, np.minimum(top, CURVED * rows * (columns / (top + 1e-300))))


def _with(x: Any, arrays: dict, place: tuple = ()) -> Any:
    """The same tuple with other arrays at some places."""
    if not isinstance(x, tuple):
        return arrays.get(place, x)
    parts = [_with(part, arrays, (*place, k)) for k, part in enumerate(x)]
    return type(x)(*parts) if hasattr(x, "_fields") else tuple(parts)


class Family:
    """Scenes of one topology.

    Parameters
    ----------
    build
        From parameters, shape (d,), to a Scene.
    readings
        What will be read of them.
    low, high
        The box of the parameters, shape (d,).
    most
        How many scenes may be built.

    Attributes
    ----------
    one
        The :class:`Numbers` of the first one that was built.
    asked
        How many were built.
    scale, which
        Number i of a scene is ``scale[i]`` times the function ``which[i]`` of its parameters, of
        the arrays that are not the same for all, one behind the other.

    Raises
    ------
    Unlike
        If they are not, or their numbers are no polynomials of the parameters.
    """

    def __init__(self, build: Callable[[Array], Scene], readings: Sequence[Reading], low: Array,
                 high: Array, most: int) -> None:
        self._build, self._readings = build, readings
        self.one: Any = None
        polynomial = Polynomial(self.numbers, low, high, self._size, most)
        if polynomial.rest > 1.0:
            raise Unlike(f"{most} scenes did not suffice to see how the numbers of all depend on "
                         "the parameters")
        self.asked, self._polynomial = polynomial.asked, polynomial
        self._sort(polynomial.surplus)

    def numbers(self, x: Array) -> Array:
        """The vector of :class:`Numbers` for parameters (d,); raises Unlike."""
        return self._numbers(x).vector

    def _numbers(self, x):
        try:
            found = Numbers(self._build(x), self._readings)
        except Unlike:
            raise
        except Exception as error:  # of the caller's function, which may raise anything
            raise NotBuilt(f"build, or what is read, failed for {x}: {error!r}") from error
        if self.one is None:
            self.one = found
            ends = np.cumsum([0] + [x.size for x in found.arrays.values()])
            self._at = {place: slice(a, b) for place, a, b in zip(found.arrays, ends, ends[1:])
                        if a < b}
            self._names = {place: _name(found.solved, place) for place in self._at}
        elif found.same != self.one.same:
            raise Unlike("topologies differ")
        return found

    def _scales(self, x):
        """What the round-off of each number is compared with."""
        out = np.empty_like(x)
        for place, s in self._at.items():
            name, beside = self._names[place]
            out[s] = _sizes(x[s].reshape(self.one.arrays[place].shape), name).ravel()
            if name in BESIDE:
                other = self._at[place[:-1] + (beside.index(BESIDE[name]),)]
                out[s] = np.maximum(out[s], np.max(np.abs(x[other])))
        return out

    def _size(self, surplus, largest):
        return float(np.max(np.abs(surplus) / (ROUND_OFF * self._scales(largest) + 1e-300)))

    def _sort(self, surplus):
        """Find the different functions among the numbers."""
        noise = self._scales(np.max(np.abs(surplus), axis=0)) * ROUND_OFF
        surplus = surplus.copy()
        surplus[1:][np.abs(surplus[1:]) <= noise] = 0.0
        changes = np.any(surplus[1:] != 0.0, axis=0)
        self.places = [place for place, s in self._at.items() if np.any(changes[s])]
        columns, noise = (np.concatenate([x[..., self._at[place]] for place in self.places]
                                         or [x[..., :0]], axis=-1) for x in (surplus, noise))
        ends = np.cumsum([0] + [self.one.arrays[place].size for place in self.places])
        self._slices = {place: slice(a, b) for place, a, b in zip(self.places, ends, ends[1:])}
        top = np.argmax(np.abs(columns), axis=0)
        self.scale = columns[top, np.arange(columns.shape[1])]
        unit = columns / np.where(self.scale == 0.0, 1.0, self.scale)
        constant = ~np.any(columns[1:] != 0.0, axis=0)
        unit[:, constant] = np.eye(len(columns))[:, :1]
        keys = np.ascontiguousarray(unit.round(9).T + 0.0).view(f"V{8 * len(columns)}").ravel()
        _, first, which = np.unique(keys, return_index=True, return_inverse=True)
        which = which.ravel()
        apart = np.flatnonzero(np.any(np.abs(self.scale * (unit[:, first[which]] - unit))
                                      > noise, axis=0))
        which[apart] = len(first) + np.arange(len(apart))
        self.which, self._functions = which.astype(np.int64), unit[:, np.append(first, apart)]

    def values(self, x: Array) -> Array:
        """The functions at parameters (n, d), shape (n, functions)."""
        return np.ascontiguousarray(self._polynomial.basis(x) @ self._functions)

    def exact(self, x: Array) -> Array:
        """Which of parameters (n, d) have numbers that are not lost beside those of others.

        A number has the round-off of the largest that any member has in its place, unless its sign
        changes: then it is small by chance, or it is nothing since a parameter is 0.
        """
        values = self.values(x)
        values = np.abs(values[:, np.all(values * values[0] >= 0.0, axis=0)])
        noise = ROUND_OFF * np.max(values, axis=0, initial=0.0)
        nothing = (values <= noise) & np.any(x == 0.0, axis=1)[:, None]
        return np.all((LOST * values >= noise) | nothing, axis=1)

    def solved(self, numbers: Array) -> Solved:
        """A :class:`Solved` whose arrays are views of numbers."""
        return _with(self.one.solved, {
            place: numbers[s].reshape(self.one.arrays[place].shape)
            for place, s in self._slices.items()})

    def array(self, place: tuple, values: Array) -> Array | None:
        """An array of several scenes, one row for each; None if it is the same for all.

        Parameters
        ----------
        place
            Where it is in :class:`Solved`.
        values
            What :meth:`values` has given, shape (n, functions).
        """
        s = self._slices.get(place)
        if s is None:
            return None
        return (self.scale[s] * values[:, self.which[s]]).reshape(
            -1, *self.one.arrays[place].shape)

    def tried(self, x: Array) -> Scene:
        """A scene of parameters (d,); raises Unlike if its numbers are others than these."""
        found, mine = self._numbers(x), self.one.vector.copy()
        values = self.values(x[None])[0]
        for place, s in self._slices.items():
            mine[self._at[place]] = self.scale[s] * values[self.which[s]]
        largest = self._scales(np.maximum(np.abs(found.vector), np.abs(mine)))
        if np.any(np.abs(found.vector - mine) > EXACT * largest + 1e-300):
            raise Unlike("the numbers of the scenes are no polynomials of the parameters")
        return found.scene
