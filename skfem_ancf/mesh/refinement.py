"""Refinement: halve elements, with new nodes on the curve and the same names."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from skfem.generic_utils import OrientedBoundary

from ..core.types import Array
from .mapping import halved as halved_heights, heights_of


def halved(mesh: Any, ix: Array) -> Any:
    """The mesh with elements ``ix`` (k,) halved; new nodes are on the curve."""
    marked = np.zeros(mesh.nelements, dtype=bool)
    marked[ix] = True
    new = _midpoints(mesh, ix)
    where = mesh.t[1, ix]
    fields: dict[str, Any] = {name: np.insert(getattr(mesh, name), where, new[name], axis=-1)
                              for name in ("doflocs", "p_X", "p_Y", "p_XY")
                              if getattr(mesh, name) is not None}
    if mesh.s is not None:
        fields["s"] = np.insert(mesh.s, where, new["s"])
    # children of element e: first[e], and first[e] + 1 if it was marked
    first = np.arange(mesh.nelements) + np.concatenate([[0], np.cumsum(marked)[:-1]])
    parent = np.repeat(np.arange(mesh.nelements), 1 + marked)
    node = np.arange(mesh.p.shape[1]) + np.searchsorted(where, np.arange(mesh.p.shape[1]),
                                                        side="right")
    left = node[mesh.t[0, parent]]
    left[first[ix] + 1] += 1
    lengths = mesh.lengths[parent]
    if mesh.curve is None:
        lengths = np.where(marked[parent], lengths / 2, lengths)
    else:
        lengths[first[ix]], lengths[first[ix] + 1] = new["lengths"]
    fields.update(t=np.array([left, left + 1]), _boundaries=None, _subdomains=None)
    if mesh.taper is not None and mesh.s is not None:
        fields["heights"] = heights_of(mesh.taper, fields["s"], fields["t"])[1]
    elif mesh.heights is not None:
        fields["heights"] = halved_heights(mesh.heights, marked)
    m = replace(mesh, lengths=lengths, **fields)
    m._boundaries = _refined_names(mesh, m, first, marked, node)
    if mesh._subdomains is not None:
        m._subdomains = {name: np.nonzero(np.isin(parent, e))[0].astype(np.int32)
                         for name, e in mesh._subdomains.items()}
    m._freeze()
    return m


def by_element(mesh: Any, at: Array) -> Any:
    """A curved mesh of disconnected elements with one-sided rates of turning at nodes ``at`` (k,).

    Cubic and higher directors share one nodal derivative, which fits neither side of a jump of the
    curvature.
    """
    mesh, n, node = mesh.with_sections("cubic"), mesh.nelements, mesh.t.T.ravel()
    fields: dict[str, Any] = {name: getattr(mesh, name)[:, node]
                              for name in ("doflocs", "p_X", "p_Y", "p_XY")}
    ends = np.array([np.tile([0.0, 1.0], (n, 1)), np.full((n, 2), 0.5)])
    bent = mesh.mapping().curvature(ends, np.arange(n)).ravel()
    for k in (2 * at - 1, 2 * at):
        fields["p_XY"][:, k] = -bent[k] * fields["p_X"][:, k]
    fields.update(t=np.arange(2 * n).reshape(-1, 2).T, _boundaries=None, _subdomains=None)
    return replace(mesh, s=None, curve=None, taper=None, **fields)


def _midpoints(mesh, ix):
    """Position, gradients, parameter and, on a curve, lengths for the middle of elements."""
    out = {}
    if mesh.s is not None:
        out["s"] = 0.5 * (mesh.s[mesh.t[0, ix]] + mesh.s[mesh.t[1, ix]])
    if mesh.curve is None:
        middle = np.array([[0.5], [0.5]])
        mapping = mesh._mapping()
        J = mapping.DF(middle, ix)[..., 0]
        return {**out, "doflocs": mapping.F(middle, ix)[..., 0],
                "p_X": J[:, 0] / mesh.lengths[ix],
                "p_Y": J[:, 1] / np.ravel(mapping.height(middle[0], ix)[0]),
                "p_XY": mapping.turning(middle, ix)[..., 0] / mesh.lengths[ix]}
    a, b = mesh.s[mesh.t[:, ix]]
    p, tangent = mesh.curve.nodes(out["s"])
    return {**out, "doflocs": p, "p_X": tangent, "p_Y": np.array([-tangent[1], tangent[0]]),
            "p_XY": mesh.curve.turning(out["s"]),
            "lengths": (mesh.curve.lengths(a, out["s"]), mesh.curve.lengths(out["s"], b))}


def _refined_names(mesh, m, first, marked, node):
    """Boundaries of the refined mesh ``m``."""
    tags = mesh._boundaries
    if tags is None:
        return None
    # of each facet the first child, and whether there is another behind it
    n, children = m.p.shape[1], np.append(marked, marked)
    start = np.concatenate([node, n + first, n + m.nelements + first])
    two = np.append(np.zeros(len(node), dtype=bool), children)
    out = {}
    for name, facets in tags.items():
        f = np.asarray(facets)
        source = np.repeat(np.arange(len(f)), 1 + two[f])
        new = start[f[source]] + np.append(False, source[1:] == source[:-1])[:len(source)]
        order = np.argsort(new, kind="stable")
        out[name] = new[order].astype(np.int32)
        if getattr(facets, "ori", None) is not None:
            out[name] = OrientedBoundary(out[name], np.asarray(facets.ori)[source][order])
    return out
