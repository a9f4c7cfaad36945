"""Stress and history variables between the integration points of laws with a history. They are
linear between the points, also across the section: at the edge of a plastic zone the stress has a
kink, at which polynomials oscillate; and it is no function of the strain alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..core import Array
from .kernels.kernel import Past
from ..materials import HistoryMaterial


def remembers(beam: Any) -> bool:
    """True if a material of a beam has a history."""
    return any(has_history(beam, k) for k in range(len(beam.across.layers)))


def with_history(beam: Any, history: Array) -> Any:
    """A beam with a history (n,) of its materials, for stress, energy and element forces."""
    other = object.__new__(type(beam))
    vars(other).update({name: x for name, x in vars(beam).items()
                        if name not in ("layers", "terms", "basis", "interpolation")})
    vars(other)["kernel"] = beam.kernel.remembering(Past(history, np.zeros(1), history))
    return other


def elements_of(beam: Any, k: int) -> Any:
    """The elements of layer k of a beam, with their history."""
    if not beam.has_sections:
        return beam.kernel.elements[k]
    layer = beam.across.layers[k]
    return next(e for one, e in zip(beam.kernel.integrals, beam.kernel.elements)
                if one.layer is layer)


def interpolated(beam: Any, k: int, values: Array, e: Array, X: Array) -> Array:
    """Values (c, points, ne) of layer k at points X (2, n) of elements e (n,), (c, n)."""
    if beam.has_sections:
        term = beam.layers[k].terms[0]
        along, across = term.axis[0], term.section[0]
    else:
        layer = beam.across.layers[k]
        along, across = beam.kernel.points, layer.measure.gauss(max(layer.material.points, 2))[0]
    values = values.reshape(len(values), len(along), len(across), -1)
    out = np.zeros((len(values), len(e)))
    (i, s), (j, t) = _places(along, X[0]), _places(across, X[1])
    for di, a in ((0, 1.0 - s), (1, s)):
        for dj, b in ((0, 1.0 - t), (1, t)):
            out += a * b * values[:, i + di, j + dj, e]
    return out


def _places(nodes, x):
    """Number of the interval of points, and their place in it, beyond [0, 1] outside."""
    k = np.clip(np.searchsorted(nodes, x) - 1, 0, len(nodes) - 2)
    return k, (x - nodes[k]) / (nodes[k + 1] - nodes[k])


def has_history(beam: Any, k: int) -> bool:
    """True if the material of layer k has a history."""
    return isinstance(beam.across.layers[k].material, HistoryMaterial)


def by_history(beam: Any, e: Array, X: Array, ask: Callable[[Any, Array], Array],
               other: float) -> Array:
    """A field (n,) of materials and histories (k, n) at points; ``other`` without a history."""
    like = np.zeros((len(e), 1))

    def of(k):
        if not has_history(beam, k):
            return like + other
        history = interpolated(beam, k, elements_of(beam, k).history, e, X)
        return ask(beam.across.layers[k].material, history)[:, None]

    return beam.across.of_layers(X[:, :, None], like, of, e, False)[:, 0]


def cable_forces(beam: Any, u: Array, e: Array, xi: Array) -> tuple[Array, Array]:
    """Normal force and moment (n,) of a cable, from the stress at its integration points."""
    kernel, n = beam.kernel, len(beam.kernel.points)
    T = sum(of.stress(of.strain(*of.at(np.array(u))[1:3])) for of in kernel.elements)
    T = T.reshape(2, n, -1) / kernel.weights.T
    k, s = _places(kernel.points, xi)
    N, M = (1.0 - s) * T[:, k, e] + s * T[:, k + 1, e]
    return N, M
