"""Kinematics of sections. With sections, positions are linear in the DOFs. Sections of a cable stay
normal to the axis and contract so that S_yy = 0."""

from typing import Any

import numpy as np

from ..core import Array, ModelWarning, first_order, gauss, refuse, warn
from ..mesh.places import as_point
from .kernels import CableKernel, SectionKernel
from .strains import cable_axis, fibres, points_of_grid

#: Kernels of the strain energy by the kinematics of elements.
KERNELS: dict[str, Any] = {"sections": SectionKernel, "cable": CableKernel}


def require_cable(beam: Any) -> None:
    """Raise InputError unless the law is Hooke's; warn about a neglected shear stiffness."""
    for layer in beam.across.layers:
        refuse(not layer.material.is_hooke, "a cable has Hooke's law along its axis and the "
               "bending stiffness E I: it cannot have the law of {!r}. Use StVenantKirchhoff, or "
               "an element with sections, as ElementBeamANCFCubic(2)", layer.material)
    section, GA = beam.section, getattr(beam.section, "GA", None)
    if GA is None:
        return
    share = 3.0 * section.EI / (GA * float(np.min(beam.mesh.chain_lengths))**2)
    if share > 1e-3:
        warn(f"a cable has no shear deformation and ignores GA={GA:g} of {section!r}, which would "
             f"add {share:.1%} to the deflection of a cantilever of its length: use an element "
             "with sections, as ElementBeamANCFCubic(2), or leave GA out", ModelWarning)


def locate(beam: Any, point: Any) -> tuple[int, Array]:
    """The element of a material point (x, y) or named end, and its point (xi, eta) of the cell."""
    # Raises MeshError outside of the beam.
    e, X, _ = beam.finder.inside(as_point(point, beam.mesh)[:, None])
    return int(e[0]), X[:, 0]


def probe_reference(beam: Any, e: int, X: Array) -> tuple[Array, Array]:
    """As :meth:`Beam.probe <skfem_ancf.Beam.probe>`, for a point (2,) of the reference cell."""
    dofs = beam.mesh.t[0, e] * beam.nd + np.arange(2 * beam.nd).reshape(-1, 2).T
    X = np.reshape(X, (2, 1, 1))
    return dofs, beam.element.values(beam.mesh.mapping(), X, np.array([e])).ravel()


def element_dofs(beam: Any, elements: Array | None = None) -> Array:
    """DOFs (n, 2 nd) of elements (n,), by default of all."""
    first = beam.nd * (beam.mesh.t[0] if elements is None else beam.mesh.t[0, elements])
    return np.asarray(first[:, None] + np.arange(2 * beam.nd))


def entries_of(dofs: Array) -> tuple[Array, Array]:
    """Rows and columns (n k k,) of element matrices with these DOFs (n, k)."""
    rows, columns = np.broadcast_arrays(dofs[:, :, None], dofs[:, None])
    return rows.ravel(), columns.ravel()


def direction(beam: Any, node: int) -> tuple[Array, Array]:
    """DOFs (2, n) and weights (n,) of ``12 / h^3 int Y r dY`` of a section."""
    # For a cable, those of the tangent.
    if not beam.has_sections:
        return node * beam.nd + 2 + np.arange(2).reshape(2, 1), np.ones(1)
    eta, w = gauss(beam.element.order + 1)
    h = beam.mesh.node_height(node)
    first = next(k for k, f in enumerate(beam.element.functionals) if f[2] > 0)
    f = beam.element.functionals[first:first + beam.element.section.number]
    c = np.array([12.0 * h ** (f[k][2] - 1) * np.sum(
        w * (eta - 0.5) * beam.element.section(eta - 0.5, k)[0]) for k in range(len(f))])
    return node * beam.nd + 2 * first + np.arange(2 * len(f)).reshape(-1, 2).T, c


def direction_weights(beam: Any, e: int, xi: float) -> Array:
    """Weights (nb,) of the shape functions in the :func:`direction` inside an element."""
    if not beam.has_sections:
        rows = beam.element.local(np.array([[xi], [0.5]]), beam.mesh.height)
        return rows[1][:, 0] * beam.mesh.lengths[e] ** (rows[3] - 1.0)
    eta, w = gauss(beam.element.order + 1)
    h = float(np.ravel(beam.mesh.mapping().height(np.array([xi]), np.array([e]))[0])[0])
    rows = beam.element.local(np.array([xi + 0.0 * eta, eta]), h)
    return 12.0 / h * (rows[0] @ (w * (eta - 0.5))) * beam.mesh.lengths[e] ** rows[3]


def plane(beam: Any, tangent: Array) -> tuple[Array, list[int]]:
    """The normal (2,) of a section's plane, and the numbers of the derivatives within the plane."""
    if not beam.has_sections:
        return np.array([-tangent[1], tangent[0]]), [1]
    return tangent, [k for k, (_, along, across) in enumerate(beam.element.functionals)
                     if along == 0 and across > 0]


def gradients(beam: Any, u: Array, X: Array, tind: Array | None) -> tuple[Array, Array]:
    """As :meth:`Beam.gradients <skfem_ancf.Beam.gradients>`, unchecked; u may be complex."""
    mapping = beam.mesh.mapping()
    if beam.has_sections:
        u_e = beam.kernel.gather(u, slice(None) if tind is None else tind)
        slopes, frame = beam.element.slopes(mapping, X, tind)
        return np.einsum("ebi,bjep->ijep", u_e, slopes, optimize=True), frame
    e, P, shape = points_of_grid(beam.mesh.nelements, X, tind)
    (_, tangent), *axis = cable_axis(beam, u, e, P[0])
    longer, ratio = fibres(beam, e, P, *axis)
    with np.errstate(invalid="ignore"):  # a section may vanish
        across = np.sqrt(1.0 + 2.0 * ratio * (longer + 0.5 * longer * longer))
    F = np.stack([(1.0 + longer) * tangent, across * np.array([-tangent[1], tangent[0]])], axis=1)
    frame = mapping.frame(X, tind)
    return F.reshape(2, 2, *shape) - frame, frame


def displacements(beam: Any, u: Array, X: Array, tind: Array | None) -> Array:
    """As :meth:`Beam.displacements <skfem_ancf.Beam.displacements>`; u may be complex."""
    mapping = beam.mesh.mapping()
    u_e = beam.kernel.gather(u, slice(None) if tind is None else tind)
    out = np.einsum("eki,kep->iep", u_e, beam.element.values(mapping, X, tind), optimize=True)
    if beam.has_sections:
        return out
    e, P, shape = points_of_grid(beam.mesh.nelements, X, tind)
    before, after = cable_axis(beam, u, e, P[0])[0]
    turn = (after - before).reshape(2, *shape)
    return out + mapping.offset(X, tind) * np.array([-turn[1], turn[0]])


def shortest(beam: Any, u: Array) -> float:
    """The smallest axial stretch at the integration points, of cables in the outer fibres."""
    return float(beam.kernel.shortest(u) if beam.has_sections else
                 beam.kernel.outer_stretches(u).min())


def deformation(beam: Any, u: Array) -> tuple[Array, Array]:
    """det F and principal stretches at the integration points."""
    # They are linear in a :func:`~skfem_ancf.core.linear.step`.
    if not beam.has_sections:
        along = beam.kernel.outer_stretches(u)
        ratio = beam.across.layers[0].material.lateral_ratio
        if np.iscomplexobj(u):
            return along + ratio * (1.0 - along), along
        return along * np.sqrt(np.maximum(1.0 - ratio * (along * along - 1.0), 0.0)), along
    det, stretches = [], []
    for term in beam.terms:
        H, frame = gradients(beam, u, term.quadrature[0], None)
        F = H + frame
        C = first_order(np.einsum("ikep,ijep->kjep", F, F))
        middle, half = 0.5 * (C[0, 0] + C[1, 1]), 0.5 * (C[0, 0] - C[1, 1])
        root = np.hypot(half, C[0, 1])
        square = np.array([middle - root, middle + root]).ravel()
        stretches.append(0.5 + 0.5 * square if np.iscomplexobj(F) else
                         np.sqrt(np.maximum(square, 0.0)))
        det.append(first_order(F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]).ravel())
    return np.concatenate(det), np.concatenate(stretches)


def tangents(beam: Any, u: Array | float) -> Array:
    """Derivative r_X at the nodes as complex numbers, for a displacement (N,) or 0."""
    return (beam.q0_local + u).view(complex)[1::beam.nd // 2]


def bent(beam: Any, u: Array) -> tuple[float, bool]:
    """Largest rotation of the axis over an element, and True if it folds back within one."""
    # Then a chord is opposite to a tangent at its end.
    axis, t = beam.q0_local.reshape(-1, beam.nd // 2, 2)[:, :2], beam.mesh.t
    r, slope = (axis + u.reshape(axis.shape[0], -1, 2)[:, :2])[t].view(complex)[..., 0].transpose(
        2, 0, 1)
    turn = slope[1] * slope[0].conj()
    if not beam.mesh.is_straight:
        before = axis[t].view(complex)[:, :, 1, 0]
        turn *= before[0] * before[1].conj()
    back = ((r[1] - r[0]).conj() * slope).real
    return float(np.abs(np.arctan2(turn.imag, turn.real)).max()), bool(back.min() < 0.0)
