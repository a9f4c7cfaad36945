"""The mesh of the lines of a frame: several chains of elements."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

import numpy as np

from ..core.errors import InputError, MeshError, shown
from ..core.types import Array
from .curve import Curve
from .mesh_beam import MeshBeam
from .taper import heights_of


def chain_of(s: Array) -> Array:
    """Chain number of parameters (n,), which run from 2 k to 2 k + 1 on chain k."""
    return np.floor(0.5 * s).astype(int)


class MeshLines(MeshBeam):
    """Chains of elements; ``s`` runs from 2 k to 2 k + 1 along chain k."""

    kind = "lines"

    @property
    def parameters(self) -> Array:
        """Parameter of each node on its local chain, from 0 to 1, shape (nvertices,)."""
        s = cast("Array", self.s)
        return s - 2.0 * chain_of(s)

    def _heights_of(self, height):
        return heights_of_chains(height, self.s, self.t)


class Heights:
    """Height of chains as a function of parameters, from 2 k to 2 k + 1 on chain k.

    ``given`` has for each chain, or once for all, a number or a function of parameters in [0, 1].
    """

    def __init__(self, given: Sequence[float | Callable[[Array], Any]]) -> None:
        self.given = tuple(given)

    def __repr__(self) -> str:
        return ", ".join(map(shown, self.given))

    def __call__(self, s: Array) -> Array:
        chain, out = chain_of(s), np.empty(len(s))
        local = s - 2.0 * chain
        if len(self.given) == 1:
            return _values(self.given[0], local)
        for k in np.unique(chain).tolist():
            here = chain == k
            out[here] = _values(self.given[k], local[here])
        return out


def _values(height, s):
    return height(s) if callable(height) else np.full(len(s), float(height))


def heights_of_chains(height: Any, s: Array, t: Array, numbers: Any = None
                      ) -> tuple[float, Array | None, Any]:
    """As :func:`~.taper.heights_of`, for a number, a function, or a list with one for each chain.

    Functions take parameters (n,) in [0, 1]; messages identify chains by their ``numbers``.
    """
    chain = chain_of(s)
    local = s - 2.0 * chain
    if not isinstance(height, list):
        largest, heights, _ = heights_of(height, local, t)
        return largest, heights, None if heights is None else Heights([height])
    if not any(map(callable, height)) and len(set(height)) == 1:
        return heights_of(height[0], local, t)
    most, heights, of = 0.0, np.empty((4, t.shape[1])), chain[t[0]]
    for k, one in enumerate(height):
        try:
            largest, some, _ = heights_of(one, local, t[:, of == k])
        except (InputError, MeshError) as error:
            line = k if numbers is None else numbers[k]
            raise type(error)(f"line {line}: {error}") from None
        most, heights[:, of == k] = max(most, largest), largest if some is None else some
    return most, heights, Heights(height)


class Axes:
    """The axes of chains, a Curve for parameters from 2 k to 2 k + 1 on chain k.

    ``arcs`` has the curves of chains by number. The others are straight, with starts ``start`` and
    end-to-end vectors ``way``, (2, k).
    """

    def __init__(self, arcs: Mapping[int, Curve], start: Array, way: Array) -> None:
        self.arcs, self.start, self.way = dict(arcs), start, way

    def _parts(self, s):
        chain = chain_of(s)
        return chain, s - 2 * chain, [(arc, chain == k) for k, arc in self.arcs.items()
                                      if np.any(chain == k)]

    def nodes(self, s: Array) -> tuple[Array, Array]:
        """Positions and unit tangents at parameters ``s``, both of shape (2, n)."""
        chain, s, parts = self._parts(s)
        way = self.way[:, chain]
        p, tangent = self.start[:, chain] + s * way, way / np.hypot(*way)
        for arc, here in parts:
            p[:, here], tangent[:, here] = arc.nodes(s[here])
        return p, tangent

    def turning(self, s: Array) -> Array:
        """Derivative of the unit normal by arc length at parameters ``s``, shape (2, n)."""
        _, s, parts = self._parts(s)
        out = np.zeros((2, len(s)))
        for arc, here in parts:
            out[:, here] = arc.turning(s[here])
        return out

    def lengths(self, a: Array, b: Array) -> Array:
        """Arc lengths from parameters ``a`` to ``b`` on the same chains, all of shape (n,)."""
        chain, x, parts = self._parts(a)
        y = b - 2 * chain
        out = (y - x) * np.hypot(*self.way[:, chain])
        for arc, here in parts:
            out[here] = arc.lengths(x[here], y[here])
        return out

    def moved(self, A: Array, shift: Array) -> Axes:
        """The axes ``A r(s) + shift``."""
        return Axes({k: arc.moved(A, shift) for k, arc in self.arcs.items()},
                    A @ self.start + shift[:, None], A @ self.way)
