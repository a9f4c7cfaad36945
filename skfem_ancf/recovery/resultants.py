"""Force and moment in the sections of a beam, with the strains of the axis that go with them."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ..beam.kernels.along import CableSections
from ..core.linear import angle_of, first_order, unwrapped
from ..core.quadrature import gauss
from ..mesh.mapping import cross
from .section_forces import Sections
from ..beam.distribution import SNAP

if TYPE_CHECKING:
    from ..beam.interpolation import Part
    from ..beam.configuration import Configuration
    from ..core.types import Array

#: Sections in an element, both ends included, where none are named.
ALONG_ELEMENT = 9
#: Part of an element over which the slope of the moment of a cable is taken.
NEAR = 1e-3


@dataclass(frozen=True, repr=False)
class Resultants:
    """Section forces and strains along one beam.

    They are what the part of the beam behind a section (of larger arc length) does to the part
    before it. Where they jump, a section that is named gives the value before the jump; without
    names both sides are there.

    Attributes
    ----------
    s
        Arc length along the stress-free axis, shape (n,).
    x
        Place of the section on the stress-free axis, shape (2, n).
    N
        Normal force along the deformed axis, positive in tension.
    Q
        Shear force along the normal of the deformed axis, which is its tangent turned by +90
        degrees. A straight beam has dM/ds = -Q where no moment acts.
    M
        Bending moment about the deformed axis, counterclockwise: it presses the upper fibres.
    curvature
        Change of the rate at which the sections turn along the stress-free axis, per length. A
        cable has N = EA (stretch - 1) and M = EI curvature, if its axis is at the centroid.
    stretch
        Length of the axis over that in the stress-free state.
    shear
        Angle from the normal of the section to the axis, in radians.
    angle
        Direction of the deformed axis, in radians.
    force
        N and Q along the global axes, shape (2, n).
    recovered : bool
        They follow from equilibrium. If not, from the stress of the elements, and Q of a cable,
        which has no shear strain, is NaN.

    In a motion all but ``s`` and ``x`` have the instants as their first axis; of a single section
    they have no axis n.
    """

    s: Array
    x: Array
    N: Array
    Q: Array
    M: Array
    curvature: Array
    stretch: Array
    shear: Array
    angle: Array
    force: Array
    recovered: bool

    def __repr__(self) -> str:
        largest = ", ".join(f"{name} {np.min(v):.4g} to {np.max(v):.4g}"
                            for name, v in (("N", self.N), ("Q", self.Q), ("M", self.M)))
        return f"<Resultants of {np.size(self.s)} section(s): {largest}>"

    @property
    def t(self) -> Array:
        """Unit vectors along the deformed axis, shape (..., 2, n)."""
        return np.stack([np.cos(self.angle), np.sin(self.angle)], -2)


    def first(self) -> Resultants:
        """Those of the first section, without the axis n."""
        values: dict[str, Any] = {
            f.name: value if isinstance(value := getattr(self, f.name), bool) else value[..., 0]
            for f in fields(self)}
        return Resultants(**values)


def over_time(instants: list[Resultants]) -> Resultants:
    """The Resultants of several instants at the same sections as one."""
    first = instants[0]
    values: dict[str, Any] = {f.name: np.array([getattr(r, f.name) for r in instants])
                              for f in fields(first)}
    return Resultants(**{**values, "s": first.s, "x": first.x,
                         "recovered": all(r.recovered for r in instants)})


def resultants(state: Configuration, number: int, part: Part | None = None,
               recover: bool = True, chain: int | None = None) -> Resultants:
    """The Resultants of a beam.

    Parameters
    ----------
    state
        A :class:`~skfem_ancf.results.State`.
    number
        The number of the beam.
    part
        Points through which the sections go; None for all elements.
    recover
        From equilibrium, where it can be had; False for the stress of the elements.
    chain
        The chain of elements that all sections are of, if there are no points; None for all.

    Returns
    -------
    Resultants
    """
    beam = state.beams[number]
    recovery = state.balance(beam) if recover else None
    if part is None:
        e, xi, after = _everywhere(beam, None if recovery is None else recovery.forces.cuts)
        if chain is not None:
            on = beam.mesh.chains[e] == chain
            e, xi, after = e[on], xi[on], after[on]
    else:
        e, xi, after = part.e, part.X[0], np.zeros(len(part.e), dtype=bool)
    lengths = _arc(beam, e, xi)
    x = beam.mesh.mapping().F(np.array([xi, 0.5 + 0.0 * xi])[:, :, None], e)[..., 0]
    values = (_own(state, beam, e, xi) if recovery is None else
              _recovered(recovery, e, xi, after))
    if recovery is not None and not beam.has_sections:
        values.update(_strains_of_cable(state, beam, e, xi, values["N"], values["M"]))
    return Resultants(lengths, x, **{name: first_order(value) for name, value in values.items()},
                      recovered=recovery is not None)


def _everywhere(beam, cuts):
    """Sections of all elements, both sides of point loads inside of them too."""
    ne = beam.mesh.nelements
    e = np.repeat(np.arange(ne), ALONG_ELEMENT)
    xi = np.tile(np.linspace(0.0, 1.0, ALONG_ELEMENT), ne)
    after = np.zeros(len(e), dtype=bool)
    for cut in [] if cuts is None else cuts[cuts % 1.0 != 0]:
        e, xi = np.append(e, [int(cut)] * 2), np.append(xi, [cut % 1.0] * 2)
        after = np.append(after, [False, True])
    order = np.lexsort((after, xi, e))
    return e[order], xi[order], after[order]


def _arc(beam, e, xi):
    """Arc length along the stress-free axis."""
    x, w = gauss(8)
    mapping = beam.mesh.mapping()

    def speed(points, tind=None):
        J = mapping.DF(np.array([points, 0.5 + 0.0 * points]), tind)[:, 0]
        return np.hypot(*J)

    start = np.append(0.0, np.cumsum(speed(x) @ w))
    return start[e] + xi * (speed(xi[:, None] * x, e) @ w)


def _directions(angle):
    return (np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)]))


def _recovered(recovery, e, xi, after):
    forces = recovery.forces
    cuts, end = forces.cuts, xi > 1.0 - SNAP
    place = e + np.where(end, 1.0, np.where(xi < SNAP, 0.0, xi))
    side = np.full(len(e), 0.5)
    for cut in cuts[cuts % 1.0 != 0]:
        place = np.where(np.abs(place - cut) < SNAP, cut, place)
        on = e == int(cut)
        side[on] = np.where((place[on] > cut) | after[on], 1.0, 0.0)
    # a node at a cut belongs to the piece of its own element
    before = (end | (place % 1.0 != 0)) & ~after
    piece = np.where(before, np.searchsorted(cuts, place),
                     np.searchsorted(cuts, place, side="right")) - 1
    piece = np.clip(piece, 0, len(cuts) - 2)
    R, M = forces.at(e, xi, side)
    out = np.empty((4, len(e)), R.dtype)
    s = recovery.arc(e, xi)
    for k in np.unique(piece):
        on = piece == k
        spline = _axis(recovery.pieces[k])
        out[:, on] = spline(s[on]).T
    angle, stretch, shear, curvature = out
    t, n = _directions(angle)
    return dict(N=np.sum(R * t, axis=0), Q=np.sum(R * n, axis=0), M=M, curvature=curvature,
                stretch=stretch, shear=shear, angle=angle, force=R)


def _axis(piece):
    """A spline of angle, stretch and shear of the axis, and the change of curvature.

    The direction of a section is that of 12 / h^3 int Y r dY, of which the derivatives across the
    section follow from its strain.
    """
    eps = piece.strain
    phi, stretch = piece.at_axis(piece.angle), np.sqrt(1.0 + 2.0 * eps[0])
    lam_y = np.sqrt(1.0 + 2.0 * eps[1])
    across = piece.angle + np.arccos(np.clip(eps[2] / (stretch * lam_y), -1.0, 1.0))
    r_Y = lam_y * _directions(across)[0]
    d = piece.across(piece.from_axis(r_Y) * piece.Y)
    normal = unwrapped(angle_of(*d)) - 0.5 * np.pi
    shear = phi - normal
    shear = shear - 2.0 * np.pi * np.round(shear.real / (2.0 * np.pi))
    # not the derivative of the angle, which is fitted to that of the elements
    start = (piece.g[:, 0] - piece.g[:, -1]) / (piece.Y[..., -1] - piece.Y[..., 0])
    curvature = piece.rate - start - piece.d_ds(shear[:, None])[:, 0]
    values = np.array([phi, piece.at_axis(stretch), shear, curvature])
    return scipy.interpolate.CubicSpline(piece.s, values.T)


def _own(state, beam, e, xi):
    """From the stress of the elements, integrated across the section."""
    if not beam.has_sections:
        return _own_of_cable(state, beam, e, xi)
    u, mapping = state.places_of(beam), beam.mesh.mapping()
    X, area = _across(beam, e, xi)
    of = beam.kinematics
    S = of.stress(beam, of.strain(beam, u, X, e), u, X, e) - state.eigen_stress(beam, X, e)
    H, frame = of.gradients(beam, u, X, e)
    F = H + frame
    P = F[:, 0] * S[0] + F[:, 1] * S[2]
    axis = np.array([xi, 0.5 + 0.0 * xi])[:, :, None]

    def position(points):
        return mapping.F(points, e) + of.displacements(beam, u, points, e)

    arm = position(X) - position(axis)
    R, M = np.sum(P * area, axis=-1), np.sum(cross(arm, P) * area, axis=-1)
    angle, stretch, shear, curvature = _axis_of_element(beam, u, e, xi)
    t, normal = _directions(angle)
    return dict(N=np.sum(R * t, axis=0), Q=np.sum(R * normal, axis=0), M=M, curvature=curvature,
                stretch=stretch, shear=shear, angle=angle, force=R)


def _across(beam, e, xi):
    """Points across sections, shape (2, n, m), and the areas that they stand for."""
    eta, breadth = (np.concatenate(parts, axis=1) for parts in zip(*(
        beam.across.points(slab, e, xi, max(beam.element.order, 1) + 2)
        for slab in beam.across.slabs)))
    X = np.array([xi[:, None] + 0.0 * eta, eta])
    return X, breadth * beam.mesh.mapping().height(X[0], e)[0]


def _own_of_cable(state, beam, e, xi):
    """Of a cable from EA and EI; the shear force is the slope of the moment in the element."""
    found = _forces_of_cable(state, beam, e, xi)
    near = np.clip([xi - NEAR, xi + NEAR], 0.0, 1.0)
    a, b = (_forces_of_cable(state, beam, e, x) for x in near)
    middle = 0.5 * np.sum(near, axis=0)
    speed = np.hypot(*beam.mesh.mapping().DF(np.array([middle, 0.5 + 0.0 * xi])[:, :, None], e)[
        :, 0, :, 0])
    Q = (a["M"] - b["M"]) / (speed * found["stretch"] * (near[1] - near[0]))
    t, normal = _directions(found["angle"])
    return dict(found, Q=Q, force=found["N"] * t + Q * normal)


def _forces_of_cable(state, beam, e, xi):
    """Normal force and moment of a cable, and the strains of its axis."""
    angle, stretch, shear, curvature = _cable_axis(beam, state.places_of(beam), e, xi)
    EA, ES, EI = beam.across.moments(xi[:, None], e)[..., 0]
    N0, M0 = _stress_free_of_cable(state, beam, e, xi)
    N = EA * (stretch - 1.0) - ES * curvature - N0
    M = EI * curvature - ES * (stretch - 1.0) - M0
    return dict(N=N, M=M, curvature=curvature, stretch=stretch, shear=shear, angle=angle)


def _strains_of_cable(state, beam, e, xi, N, M):
    """Stretch and change of curvature of a cable under a normal force and a moment."""
    EA, ES, EI = beam.across.moments(xi[:, None], e)[..., 0]
    N0, M0 = _stress_free_of_cable(state, beam, e, xi)
    N, M, det = N + N0, M + M0, EA * EI - ES * ES
    return dict(stretch=1.0 + (EI * N + ES * M) / det, curvature=(EA * M + ES * N) / det)


def _stress_free_of_cable(state, beam, e, xi):
    """Normal force and moment that the stress-free strains of a cable would take."""
    (X, area), unit = _across(beam, e, xi), state.unit
    out = np.zeros((2, len(e)), type(unit))
    for factor, load in state.eigenstrains(beam):
        S0 = load.nominal_at(X, e, unit * factor)[0] * area
        out += np.sum(S0, axis=-1), -np.sum(S0 * beam.mesh.mapping().offset(X, e), axis=-1)
    return out


def _cable_axis(beam, u, e, xi):
    at = CableSections(beam, xi[:, None], e)
    tangent, (eps, kappa) = at(beam.kernel.gather(u, e))
    t = tangent[..., 0]
    return angle_of(*t), 1.0 + eps[:, 0], 0.0 * xi, kappa[:, 0]


class _Body:
    """What :class:`~skfem_ancf.recovery.section_forces.Sections` asks of section forces."""

    def __init__(self, beam):
        self.beam = beam


def _axis_of_element(beam, u, e, xi):
    """Angle, stretch, shear and change of curvature of the kinematics of the element."""
    eta, w = gauss(beam.element.order + 2)
    lever = 12.0 * (eta - 0.5) * w
    sections, axis = (Sections(_Body(beam), e, xi, points) for points in (eta, np.array([0.5])))
    out = []
    for q in (beam.q0_local, beam.q0_local + u):
        q = beam.kernel.gather(q)
        d, rate = (sections.field(q, slope) @ lever for slope in (False, True))
        r = axis.field(q, slope=True)[..., 0]
        turn = cross(d, rate) / np.sum(d * d, axis=0)
        out.append((unwrapped(angle_of(*r)), np.sqrt(np.sum(r * r, axis=0)),
                    angle_of(np.sum(d * r, axis=0), cross(d, r)) + 0.5 * np.pi, turn))
    (_, speed, shear0, turn0), (angle, size, shear, turn) = out
    return angle, size / speed, shear - shear0, (turn - turn0) / speed
