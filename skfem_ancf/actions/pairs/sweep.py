"""Motions far from contact: discs around parts of members do not meet."""

from typing import Any

import numpy as np

from ...core import Array

#: Largest number of parts of a chain; largest turn of a part of a beam that cannot touch itself, in
#: radians, and its least stretch.
PARTS, ARC, LEAST = 32, 1.4, 0.85


def swept_apart(search: Any, z: Array) -> Array:
    """True for straight ways between displacements (n + 1, N) on which nothing comes near, (n,)."""
    # Parts that a beam leads to by an arc of less than ARC cannot touch each other, see
    # :mod:`skfem_ancf.actions.contact.stretches`.
    t = search.tables
    order = np.lexsort((t.places, t.chains))
    sizes = np.bincount(t.chains)
    share = np.concatenate([np.arange(n) * min(n, PARTS) // max(n, 1) for n in sizes])
    first = np.flatnonzero(np.diff(t.chains[order] * (PARTS + 1) + share, prepend=-1))
    c = (t.starts + np.einsum("bkf,nbf->nkf", t.weights, z[:, t.dofs]))[..., order]
    part = np.repeat(np.arange(len(first)), np.diff(first, append=len(order)))
    middle = np.add.reduceat(c[:, 0], first, axis=1) / np.bincount(part)
    radius = np.maximum.reduceat(np.max(np.abs(c[:, 0] - middle[:, part]) + np.sum(
        np.abs(c[:, 1:]), axis=1) + t.offsets[order], axis=0), first)
    i, j = np.triu_indices(len(first))
    member, chain = t.members[order[first]], t.chains[order[first]]
    some = search.allowed[member[i], member[j]]
    some[some] = ~((chain[i] == chain[j]) & _in_arc(t, order, first, c, i, j))[some]
    i, j = i[some], j[some]
    a = middle[:, i] - middle[:, j]
    way, a = np.diff(a, axis=0), a[:-1]
    along = np.clip(-(a * way.conj()).real / np.maximum(np.abs(way) ** 2, 1e-300), 0.0, 1.0)
    return np.all(np.abs(a + along * way) > radius[i] + radius[j], axis=1)


def _in_arc(t, order, first, c, i, j):
    """True for pairs of parts of chains between which it turns by less than ARC, (n + 1, pairs)."""
    faces = (t.sides[order] < 0.0) & (t.spans[order] > 0.0)
    slope, turned = c[:, 1, faces], np.zeros((len(c), len(order) + 1))
    with np.errstate(invalid="ignore"):
        inner = np.arcsin(np.sum(np.arange(2, c.shape[1])[:, None] * np.abs(
            c[:, 2:, faces]), axis=1) / np.abs(slope))
    others = np.diff(t.chains[order[faces]], prepend=-1) != 0
    turned[:, 1:][:, faces] = np.abs(np.angle(slope * np.roll(slope, 1, axis=1).conj())) * ~others
    turned = np.cumsum(turned, axis=1)
    turn = turned[:, np.append(first[1:], len(order))[j]] - turned[:, first[i] + 1]
    long = np.all(2.0 * np.abs(c[:, 1]) >= LEAST * t.spans[order], axis=1)
    return np.all((turn + 2.0 * inner.max(axis=1, initial=0.0)[:, None] < ARC) & long[:, None], axis=0)
