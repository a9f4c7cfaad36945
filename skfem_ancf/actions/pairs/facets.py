"""Surfaces of beams, rigid bodies and domains: facets, which are polynomial curves. Plane vectors
are complex numbers. Point ``zeta`` in [-1, 1] of a facet is at ``c(zeta) = start(zeta) +
sum(weights(zeta) * z[dofs])``, where z are the displacements of pairs of degrees of freedom. Its
outer normal is ``side * 1j * c' / |c'|``, and the surface is at ``offset`` along it: half the
height for a cable, whose curve is its axis, else 0."""

from typing import Any, NamedTuple

import numpy as np
import scipy

from ...beam import Beam, RigidBody
from ...beam.kernels.section import beam_gradients
from ...core import Array, gauss_lobatto, refuse
from ..obstacles.obstacle import face_width, lobatto, stiffest

#: Points across the end of a beam.
ACROSS = 3
#: Points along an edge of a rigid body, and largest number of such intervals.
EDGE, PARTS = 4, 50
#: Radius of convex corners, in heights; least change of direction there; distance of ends that
#: meet, largest distance of the arc from the corner, both in radii, and in lengths of facets.
ROUND, TURN, MEET, LONGEST, PART = 0.05, 0.35, 1e-2, 3.0, 0.25


class Facets(NamedTuple):
    """Facets (F,) with B pairs of degrees of freedom each, and points of the surface (P,).
    ``members``, ``chains`` and ``curves`` are numbers of their members, of the chains of these, and
    of smooth parts of their surfaces; ``places`` and ``lengths`` where facets begin along these and
    how long they are, ``spans`` that along an axis. ``heights`` is how thick the member is,
    ``stiffness`` its pressure per penetration, infinite if not known. Points have a facet,
    ``zeta``, and an area, per width for bodies and domains."""

    dofs: Array  # (F, B)
    weights: Array  # coefficients of powers of zeta, (F, B, n)
    starts: Array  # (F, n)
    sides: Array
    offsets: Array
    members: Array
    chains: Array
    curves: Array
    places: Array
    lengths: Array
    spans: Array
    heights: Array
    stiffness: Array
    ends: Array  # zeta of the ends of the facet before its corners were rounded, (F, 2)
    of: Array  # facets of points, (P,)
    zeta: Array
    areas: Array


def facets_of(layout: Any, members: Any, origin: complex) -> Facets:
    """The facets of some members of a layout, by number."""
    parts: list[Facets] = []
    for k in members:
        member, first = layout.members[k], layout.offset(k) // 2
        make = (_of_beam if isinstance(member, Beam) else
                _of_body if isinstance(member, RigidBody) else _of_domain)
        for part in make(member):
            curves, chains = (x + (1 + max(map(np.max, before)) if before else 0) for x, before in (
                (part.curves, [one.curves for one in parts]),
                (part.chains, [one.chains for one in parts if one.members[0] != k])))
            parts.append(part._replace(dofs=part.dofs + first, curves=curves, chains=chains,
                                       members=np.full(len(part.dofs), k)))
    return _joined(parts, origin)


def _joined(parts, origin):
    first = np.cumsum([0, *(len(part.dofs) for part in parts)])
    B, n = (max(part.weights.shape[k] for part in parts) for k in (1, 2))
    found = []
    for part, at in zip(parts, first):
        _, b, k = part.weights.shape
        starts = np.pad(part.starts, ((0, 0), (0, n - k)))
        starts[:, 0] -= origin
        found.append(part._replace(
            dofs=np.concatenate([part.dofs, np.tile(part.dofs[:, :1], B - b)], axis=1),
            weights=np.pad(part.weights, ((0, 0), (0, B - b), (0, n - k))), starts=starts,
            of=part.of + at))
    return Facets(*(np.concatenate(x) for x in zip(*found)))


def _facets(dofs, weights, x, zeta, rule, widths, **values):
    """Facets from weights (F, B, n) and places x (F, n) at n points zeta, with points of a rule."""
    # ``values`` are other fields, numbers or (F,).
    F, (points, w) = len(dofs), rule
    fit = np.linalg.inv(np.vander(zeta, increasing=True)).T
    starts, number = x @ fit, np.arange(F)
    speed = np.abs(np.polynomial.polynomial.polyval(
        points, np.polynomial.polynomial.polyder(starts.T)))
    one = dict.fromkeys(("offsets", "chains", "places", "spans"), 0) | values
    one["curves"] = one["chains"] if np.ndim(one["spans"]) else number
    kinds = {name: value + (0 * number if name in ("chains", "curves") else np.zeros(F))
             for name, value in one.items()}
    return Facets(dofs=dofs, weights=weights @ fit, starts=starts, members=number,
                  ends=np.tile([-1.0, 1.0], (F, 1)),
                  lengths=speed @ w, of=np.repeat(number, len(points)), zeta=np.tile(points, F),
                  areas=(speed * w * widths).ravel(), **kinds)


def rounded(f: Facets, radius: float) -> Facets:
    """Facets with an arc at each convex corner of outlines, which moves with the material there.

    At a sharp corner the closest face, and with it the force, would change from one to the other.
    Corners remain points that press on other members.
    """
    n = max(f.starts.shape[1], 4)
    f = f._replace(starts=np.pad(f.starts, ((0, 0), (0, n - f.starts.shape[1]))),
                   weights=np.pad(f.weights, ((0, 0), (0, 0), (0, n - f.weights.shape[2]))))
    number, both = np.arange(len(f.sides)), np.array([-1.0, 1.0])
    T = f.starts[:, 1:] * np.arange(1.0, n) @ np.vander(both, n - 1, increasing=True).T
    x = f.starts @ np.vander(both, n, increasing=True).T + (
        1j * f.sides * f.offsets)[:, None] * T / np.abs(T)
    # counterclockwise a facet begins at zeta = side
    first, last = ((sign * f.sides > 0.0).astype(int) for sign in (1.0, -1.0))
    tangent = -f.sides[:, None] * T / np.abs(T)
    trees = [scipy.spatial.cKDTree(np.column_stack([y.real, y.imag])) for y in (
        x[number, last], x[number, first])]
    met = trees[0].sparse_distance_matrix(trees[1], MEET * radius, output_type="ndarray")
    a, b = met["i"], met["j"]
    turn = np.angle(np.conj(tangent[a, last[a]]) * tangent[b, first[b]])
    some = (f.members[a] == f.members[b]) & (turn > TURN)
    a, b, turn = a[some], b[some], turn[some]
    long = np.minimum(np.minimum(radius * np.tan(0.5 * turn), LONGEST * radius),
                      PART * np.minimum(f.lengths[a], f.lengths[b]))
    handle = 4.0 / 3.0 * np.tan(0.25 * turn) * long / np.tan(0.5 * turn)
    zeta = np.tile(both, (len(number), 1))
    for e, end in ((a, last[a]), (b, first[b])):
        zeta[e, end] -= both[end] * long / np.abs(T[e, end])
    curves = 1 + np.max(f.curves) + np.arange(len(a))
    arcs = [_arc(f, zeta, *corner) for corner in zip(a, b, last[a], first[b], handle, curves)]
    return _joined([_trimmed(f, zeta, np.append(a, b), np.append(last[a], first[b]), np.append(
        long, long)), *arcs], 0.0)


def _arc(f, zeta, a, b, last, first, handle, curve):
    """The arc from the last end of a to the first one of b: a cubic that is tangent to both."""
    n = f.starts.shape[1]
    dofs, at = np.unique(np.append(f.dofs[a], f.dofs[b]), return_inverse=True)
    controls, places = np.zeros((4, len(dofs)), complex), np.zeros(4, complex)
    for e, end, k, sign in ((a, last, 0, 1.0), (b, first, 3, -1.0)):
        z, own = zeta[e, end], at[:f.dofs.shape[1]] if e == a else at[f.dofs.shape[1]:]
        slope = np.append(0.0, np.arange(1.0, n) * z ** np.arange(n - 1.0))
        size = np.abs(f.starts[e] @ slope)
        at_end = z ** np.arange(n) + 1j * f.sides[e] * f.offsets[e] / size * slope
        for row, by in ((k, at_end), (k + int(sign), at_end - (
                sign * f.sides[e] * handle / size) * slope)):
            np.add.at(controls[row], own, f.weights[e] @ by)
            places[row] = f.starts[e] @ by
    side = f.sides[b if f.spans[b] == 0.0 else a]  # that of the end of a beam
    nodes = gauss_lobatto(4)
    s = 0.5 - 0.5 * side * nodes
    fit = np.linalg.inv(np.vander(nodes, increasing=True)) @ np.column_stack(
        [(1.0 - s)**3, 3.0 * s * (1.0 - s)**2, 3.0 * s * s * (1.0 - s), s**3])
    e = b if f.spans[b] == 0.0 else a
    return Facets(
        dofs[None], np.pad((fit @ controls).T, ((0, 0), (0, n - 4)))[None],
        np.pad(fit @ places, (0, n - 4))[None], sides=np.array([side]), offsets=np.zeros(1),
        members=f.members[[e]], chains=f.chains[[e]], curves=np.array([curve]),
        places=f.places[[e]], lengths=np.array([np.abs(places[3] - places[0])]),
        spans=np.zeros(1), heights=f.heights[[e]], stiffness=f.stiffness[[e]],
        ends=np.array([[-2.0, 2.0]]), of=np.zeros(0, int), zeta=np.zeros(0), areas=np.zeros(0))


def _trimmed(f, zeta, e, end, long):
    """Facets between two zeta (F, 2), with points at the corners: ends of e, cut by long."""
    n, F = f.starts.shape[1], len(f.sides)
    middle, half = 0.5 * (zeta[:, 1] + zeta[:, 0]), 0.5 * (zeta[:, 1] - zeta[:, 0])
    nodes, cut = gauss_lobatto(n), half < 1.0
    old = np.vander((middle[cut, None] + half[cut, None] * nodes).ravel(), n, increasing=True)
    by = np.linalg.inv(np.vander(nodes, increasing=True)) @ old.reshape(-1, n, n)
    weights, starts, ends = f.weights.copy(), f.starts.copy(), f.ends.copy()
    weights[cut] = weights[cut] @ by.transpose(0, 2, 1)
    starts[cut] = (by @ starts[cut][..., None])[..., 0]
    ends[cut] = np.where(zeta[cut] == ends[cut], ends[cut], (
        ends[cut] - middle[cut, None]) / half[cut, None])
    widths = np.bincount(f.of, f.areas, F) / f.lengths
    return f._replace(
        weights=weights, starts=starts, ends=ends, lengths=half * f.lengths, spans=half * f.spans,
        places=f.places + 0.5 * (1.0 + zeta[:, 0]) * f.spans, of=np.append(f.of, e),
        zeta=np.append(f.zeta, ends[e, end]), areas=np.append(half[f.of] * f.areas,
                                                              widths[e] * long))


def _of_beam(beam):
    """Bottom and top, and both ends of each chain."""
    mesh, element, mapping = beam.mesh, beam.element, beam.mesh.mapping()
    refuse(not beam.has_sections and mesh.heights is not None, "contact knows cables of constant "
           "height only, not {!r}: take an element with sections, as ElementBeamANCF(2)", beam)
    E = stiffest(beam.across, np.arange(mesh.nelements))[0]
    common = {"heights": mesh.height, "stiffness": E / mesh.height}
    dofs = mesh.t[0][:, None] * (beam.nd // 2) + np.arange(beam.nd)
    ends = np.append(np.flatnonzero(np.diff(mesh.chains)), mesh.nelements - 1)
    begins = np.append(0, ends[:-1] + 1)
    s = np.cumsum(mesh.lengths) - mesh.lengths
    n = element.axis_degree + 1 + mapping.height_degree
    nodes, rule = gauss_lobatto(n), _rule(element.axis_degree + 2)
    for side, eta in ((-1.0, 0.0), (1.0, 1.0)):
        at = eta if beam.has_sections else 0.5
        X = np.array([0.5 + 0.5 * nodes, np.full(n, at)])
        where = np.array([0.5 + 0.5 * rule[0], np.full(len(rule[0]), at)])
        width = face_width(beam.across, int(eta), where, np.arange(mesh.nelements))
        yield _facets(dofs, element.values(mapping, X).transpose(1, 0, 2),
                      _complex(mapping.F(X)), nodes, rule, width, sides=side, chains=mesh.chains,
                      offsets=0.0 if beam.has_sections else 0.5 * mesh.height, places=s,
                      spans=mesh.lengths + np.zeros(mesh.nelements), **common)
    n = max(element.order, 1) + 1
    nodes, rule = gauss_lobatto(n), _rule(ACROSS)
    for e, xi, side in ((begins, 0.0, 1.0), (ends, 1.0, -1.0)):
        X, where = (np.array([np.full(len(y), xi), 0.5 + 0.5 * y]) for y in (nodes, rule[0]))
        weights = element.values(mapping, X, e).transpose(1, 0, 2) + 0j
        if not beam.has_sections:
            slopes = beam_gradients(mesh, element, X, e)[0][0].transpose(0, 2, 1)
            weights += 0.5j * mesh.height * nodes * slopes
        yield _facets(dofs[e], weights, _complex(mapping.F(X, e)), nodes, rule,
                      beam.across.outline(where, e), sides=side, chains=mesh.chains[e],
                      places=s[e] + xi * mesh.lengths[e], **common)


def _of_body(body):
    """The edges of the outline."""
    z = _complex(body.outline)
    if np.sum(np.imag(np.conj(z) * np.roll(z, -1))) < 0.0:
        z = z[::-1]  # counterclockwise
    ends = np.array([z, np.roll(z, -1)]).T
    weights = np.stack([np.ones(ends.shape), ends], axis=1)
    turn, F = np.exp(1j * body.angle), len(z)
    thick = float(np.min(np.ptp(body.outline, axis=1)))
    n = int(np.clip(np.ceil(np.max(np.abs(np.diff(ends))) / thick), 1, PARTS))
    (x, w), left = _rule(EDGE), 2.0 * np.arange(n)[:, None] / n - 1.0  # on n equal intervals
    rule = (left + (1.0 + x) / n).ravel(), np.tile(w / n, n)
    yield _facets(np.tile([0, 1], (F, 1)), weights, _complex(body.position) + turn * ends,
                  np.array([-1.0, 1.0]), rule, 1.0, sides=-1.0, heights=thick,
                  stiffness=np.inf)


def _of_domain(domain):
    """The edges of the boundary."""
    n = domain.basis.elem.maxdeg + 1
    nodes = gauss_lobatto(n)
    trace = domain.basis.boundary(quadrature=(0.5 + 0.5 * nodes[None], np.ones(n)))
    weights = np.array([np.asarray(trace.basis[k][0])[0] for k in range(0, trace.Nbfun, 2)])
    dofs = domain.numbers(trace.element_dofs[::2]) // 2
    kept = np.argsort(-np.abs(weights).max(axis=2), axis=0, kind="stable")
    kept = kept[:int(np.max(np.sum(np.abs(weights).max(axis=2) > 1e-12, axis=0)))]
    x = _complex(np.asarray(trace.global_coordinates()))
    normal = _complex(np.asarray(trace.normals))[:, 0]
    side = np.sign(np.real(np.conj(normal) * 1j * (x[:, -1] - x[:, 0])))
    weights = np.take_along_axis(weights, kept[..., None], axis=0).transpose(1, 0, 2)
    thick = min(np.ptp(x.real), np.ptp(x.imag))
    yield _facets(np.take_along_axis(dofs, kept, axis=0).T, weights, x, nodes, _rule(n + 1), 1.0,
                  sides=side, heights=thick, stiffness=np.inf)


def _rule(n):
    """Gauss-Lobatto points and weights on [-1, 1]."""
    x, w = lobatto(n)
    return 2.0 * x - 1.0, 2.0 * w


def _complex(x):
    return x[0] + 1j * x[1]
