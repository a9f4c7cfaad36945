"""Section forces and axial strains of a beam."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from ..beam import Beam, cable_forces, kinematics, remembers
from ..beam.strains import cable_axis, on_grid, stress_at
from ..core import Array, angle_of, first_order, gauss, require_module, unwrapped
from ..mesh.mapping import cross
from .recovered import Recovery
from .section_forces import ArcLength, Sections

#: Default number of sections in an element, both ends included.
ALONG_ELEMENT = 9
#: Fraction of an element for the difference quotient of a cable's moment.
NEAR = 1e-3


@dataclass(frozen=True, repr=False)
class Resultants:
    """Section forces and strains along one beam.

    They are the action of the part behind a section (of larger arc length) on the part before it.
    At a jump, a requested section gives the value before it; by default both values are included.

    Attributes
    ----------
    s
        Arc length along the reference axis, shape (n,).
    x
        Section positions on the reference axis, shape (2, n).
    normal
        Unit normals of the reference axis, its tangent turned by +90 degrees, shape (2, n).
    chain
        Number of the chain of elements in the beam, in a frame of the line in its group, (n,).
    N
        Normal force along the deformed axis, positive in tension.
    Q
        Shear force along the normal of the deformed axis, the tangent turned by +90 degrees. In a
        straight beam without distributed moment dM/ds = -Q.
    M
        Bending moment about the deformed axis, counterclockwise: it compresses the upper fibres.
    curvature
        Change of the rotation of sections per reference length. For a cable with its axis at the
        centroid, N = EA (stretch - 1) and M = EI curvature.
    stretch
        Deformed over reference length of the axis.
    shear
        Angle from the section normal to the axis, in radians.
    angle
        Direction of the deformed axis, in radians.
    force
        N and Q in global axes, shape (2, n).
    recovered : bool
        True if they follow from equilibrium. Otherwise they follow from the stress of the elements,
        and Q of a cable is NaN.

    In a motion all but the first four have the instants as first axis; for a single section there
    is no axis n.
    """

    s: Array
    x: Array
    normal: Array
    chain: Array
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

    def to_dataframe(self) -> Any:
        """A ``pandas.DataFrame`` with a row per section, in a motion per instant and section.

        Its columns are the attributes, with ``x``, ``y`` and ``force_x``, ``force_y`` for the
        components of positions and forces. Raises MissingExtra if pandas is not installed.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line([0, 0.5, 1], height=0.1), ElementBeamANCF(2),
        ...             StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)
        >>> state = Scene(beam).clamp("left").point_force((2, 0), at=(1, 0)).solve_static()
        >>> state.resultants([(0.2, 0), (0.7, 0)]).to_dataframe().N.round(6).tolist()
        [2.0, 2.0]
        """
        pandas = require_module("pandas", "arrays")
        shape, several = self.N.shape, np.ndim(self.s)
        axis = -1 - several
        columns = {"s": self.s, "x": self.x[0], "y": self.x[1]} | {
            name: getattr(self, name) for name in (
                "N", "Q", "M", "curvature", "stretch", "shear", "angle")} | {
            f"force_{c}": np.take(self.force, k, axis) for k, c in enumerate("xy")}
        index = None
        if len(shape) > several:
            index = pandas.MultiIndex.from_product(
                [range(shape[0]), range(np.size(self.s))], names=["instant", "section"])
        return pandas.DataFrame({name: np.broadcast_to(values, shape).ravel()
                                 for name, values in columns.items()}, index)

    def first(self) -> "Resultants":
        """The first section, without the axis n."""
        values: dict[str, Any] = {
            f.name: value if isinstance(value := getattr(self, f.name), bool) else value[..., 0]
            for f in fields(self)}
        return Resultants(**values)


def over_time(instants: list[Resultants]) -> Resultants:
    first = instants[0]
    values: dict[str, Any] = {f.name: np.array([getattr(r, f.name) for r in instants])
                              for f in fields(first)}
    still = {name: getattr(first, name) for name in ("s", "x", "normal", "chain")}
    return Resultants(**values | still | {"recovered": all(r.recovered for r in instants)})


def resultants(beam: Beam, u: Array, recovery: Recovery | None = None,
               eigen: Sequence[tuple[Any, Any]] = (), at: tuple[Array, Array] | None = None,
               chain: int | None = None, sections: int = ALONG_ELEMENT) -> Resultants:
    """The Resultants of a beam for a displacement ``u`` (N,) or a complex step."""
    # They follow from the recovery, or from the stress of the elements; ``eigen`` are factors and
    # loads of eigenstrains. Sections are elements and xi ``at``, or all of the beam or one chain,
    # ``sections`` in each element.
    if at is None:
        # with both sides of cuts inside elements
        cuts = np.zeros(0) if recovery is None else recovery.forces.cuts
        ne, inside = beam.mesh.nelements, cuts[cuts % 1.0 != 0.0]
        e = np.append(np.repeat(np.arange(ne), sections), np.repeat(inside.astype(int), 2))
        xi = np.append(np.tile(np.linspace(0.0, 1.0, sections), ne), np.repeat(inside % 1.0, 2))
        after = np.append(np.zeros(ne * sections, dtype=bool), np.tile([False, True], len(inside)))
        on = np.lexsort((after, xi, e))
        if chain is not None:
            on = on[beam.mesh.chains[e[on]] == chain]
        e, xi, after = e[on], xi[on], after[on]
    else:
        (e, xi), after = at, np.zeros(len(at[0]), dtype=bool)
    if recovery is not None:
        values = _recovered(recovery, u, e, xi, after)
        if not (beam.has_sections or remembers(beam)):  # strains from the section forces
            EA, ES, EI = beam.across.moments(xi[:, None], e)[..., 0]
            N0, M0 = _eigen_forces_of_cable(beam, eigen, e, xi)
            N, M, det = values["N"] + N0, values["M"] + M0, EA * EI - ES * ES
            values |= dict(stretch=1.0 + (EI * N + ES * M) / det,
                           curvature=(EA * M + ES * N) / det)
    elif beam.has_sections:
        # integrate the stress of the elements across the section
        X, area = _across(beam, e, xi)
        S = on_grid(stress_at, beam, u, X, e) - sum(
            load.stress_at(u, X, e, factor) for factor, load in eigen)
        F = np.add(*kinematics.gradients(beam, u, X, e))
        P = F[:, 0] * S[0] + F[:, 1] * S[2]

        def position(points):
            return beam.mesh.mapping().F(points, e) + kinematics.displacements(beam, u, points, e)

        arm = position(X) - position(_on_axis(xi))
        values = _result(np.sum(P * area, axis=-1), np.sum(cross(arm, P) * area, axis=-1),
                         *_axis_of_element(beam, u, e, xi))
    else:
        # resultants of a cable from EA and EI; the shear force is the slope of the moment
        N, M = _forces_of_cable(beam, u, eigen, e, xi)
        near = np.clip([xi - NEAR, xi + NEAR], 0.0, 1.0)
        a, b = (_forces_of_cable(beam, u, eigen, e, x)[1] for x in near)
        J = beam.mesh.mapping().DF(_on_axis(0.5 * np.sum(near, axis=0)), e)[:, 0, :, 0]
        angle, stretch, *_ = strains = _axis_of_element(beam, u, e, xi)
        Q = (a - b) / (np.hypot(*J) * stretch * (near[1] - near[0]))
        t = np.array([np.cos(angle), np.sin(angle)])
        values = dict(_result(N * t + Q * np.array([-t[1], t[0]]), M, *strains), N=N, Q=Q)
    mapping = beam.mesh.mapping()
    x, (a, b) = mapping.F(_on_axis(xi), e)[..., 0], mapping.DF(_on_axis(xi), e)[:, 0, :, 0]
    arc = ArcLength(beam) if recovery is None else recovery.arc
    return Resultants(arc.at(e, xi), x, np.array([-b, a]) / np.hypot(a, b), beam.mesh.chains[e],
                      recovered=recovery is not None, **{
        name: first_order(value) for name, value in values.items()})


def _on_axis(xi):
    return np.array([xi, 0.5 + 0.0 * xi])[:, :, None]


def _result(R, M, angle, stretch, shear, curvature):
    """Normal and shear force of a force (2, n), and the rest, by name."""
    t = np.array([np.cos(angle), np.sin(angle)])
    return dict(N=np.sum(R * t, axis=0), Q=cross(t, R), M=M, curvature=curvature,
                stretch=stretch, shear=shear, angle=angle, force=R)


def _recovered(recovery, u, e, xi, after):
    """Section forces, and strains of the axis, or those of the elements where fields diverge."""
    segment, beam = recovery.segment_of(e, xi, after), recovery.beam
    R, M = recovery.forces.at(e, xi, recovery.forces.cuts[segment])
    if not recovery.segments:
        return _result(R, M, *_axis_of_element(beam, u, e, xi))
    out = np.empty((4, len(e)), R.dtype)
    s = recovery.arc.at(e, xi)
    for k in np.unique(segment):
        one, on = recovery.segments[k], segment == k
        # angle, stretch and shear of the axis, and change of curvature
        stretch, lam_y = np.sqrt(1.0 + 2.0 * one.strain[:2])
        across = one.angle + np.arccos(np.clip(one.strain[2] / (stretch * lam_y), -1.0, 1.0))
        r_Y = lam_y * np.array([np.cos(across), np.sin(across)])
        d = one.over_height(one.from_axis(r_Y) * one.Y)
        phi = one.at_axis(one.angle)
        shear = phi + 0.5 * np.pi - unwrapped(angle_of(*d))
        shear = shear - 2.0 * np.pi * np.round(shear.real / (2.0 * np.pi))
        # not from the derivative of the angle, which is fitted to the elements
        start = (one.g[:, 0] - one.g[:, -1]) / (one.Y[..., -1] - one.Y[..., 0])
        curvature = one.rate - start - one.along.d_ds(shear[:, None])[:, 0]
        values = np.array([phi, one.at_axis(stretch), shear, curvature])
        out[:, on] = one.splined(one.with_slopes(values[..., None]), s[on], np.ones((on.sum(), 1)))
    return _result(R, M, *out)


def _across(beam, e, xi):
    """Points across sections, shape (2, n, m), and their areas."""
    eta, breadth = (np.concatenate(parts, axis=1) for parts in zip(*(
        beam.across.points(layer, e, xi, max(beam.element.order + 2, 3, getattr(
            layer.material, "points", 0)))
        for layer in beam.across.layers)))
    X = np.array([xi[:, None] + 0.0 * eta, eta])
    return X, breadth * beam.mesh.mapping().height(X[0], e)[0]


def _forces_of_cable(beam, u, eigen, e, xi):
    """Normal force and moment of a cable."""
    if remembers(beam) and not np.iscomplexobj(u):
        return cable_forces(beam, u, e, xi)
    _, strain, curvature, _ = cable_axis(beam, u, e, xi)
    EA, ES, EI = beam.across.moments(xi[:, None], e)[..., 0]
    N0, M0 = _eigen_forces_of_cable(beam, eigen, e, xi)
    return EA * strain - ES * curvature - N0, EI * curvature - ES * strain - M0


def _eigen_forces_of_cable(beam, eigen, e, xi):
    """Normal force and moment of the eigenstrains of a cable."""
    X, area = _across(beam, e, xi)
    S0 = sum((load.nominal_at(X, e, factor)[0] for factor, load in eigen), 0.0) * area
    return np.sum(S0, axis=-1), -np.sum(S0 * beam.mesh.mapping().offset(X, e), axis=-1)


def _axis_of_element(beam, u, e, xi):
    """Angle, stretch, shear and change of curvature of the element's kinematics."""
    if not beam.has_sections:
        (_, t), strain, curvature, _ = cable_axis(beam, u, e, xi)
        return angle_of(*t), 1.0 + strain, 0.0 * xi, curvature
    eta, w = gauss(beam.element.order + 2)
    lever = 12.0 * (eta - 0.5) * w
    sections, axis = Sections(beam, e, xi, eta), Sections(beam, e, xi)
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
