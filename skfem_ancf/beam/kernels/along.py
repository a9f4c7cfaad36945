"""Sections of cables: tangent, stretch and curvature at any points, for the fields of the body."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .cable import cable_strain, cross

if TYPE_CHECKING:
    from ..interior import Interior
    from ...core.types import Array


def from_first_node(q_e: Array) -> Array:
    """Coordinates of elements as seen from their first node: the same slopes with less round-off.

    Parameters
    ----------
    q_e
        Coordinates, or displacements of them, shape (..., nb, 2).
    """
    q_e = q_e.copy()
    q_e[..., q_e.shape[-2] // 2, :] -= q_e[..., 0, :]
    q_e[..., 0, :] = 0.0
    return q_e


def stretched(xx: Array) -> tuple[Array, Array]:
    """The stretch of a fibre, and the stretch minus 1 without cancellation.

    Parameters
    ----------
    xx
        Its Green-Lagrange strain, shape (...).
    """
    stretch = np.sqrt(1.0 + 2.0 * xx)
    return stretch, 2.0 * xx / (1.0 + stretch)


class CableSections:
    """Sections of a cable: what of their strain does not depend on the state.

    Parameters
    ----------
    beam, xi, tind
        A beam of a cable, points xi of shape (np,) or (ne, np), elements tind (ne,) or None for
        all.
    """

    def __init__(self, beam: Interior, xi: Array, tind: Array | None) -> None:
        kernel, mesh, element = beam.kernel, beam.mesh, beam.element
        t = kernel.t if tind is None else kernel.t[:, tind]
        L = (mesh.lengths if tind is None else mesh.lengths[tind])
        if len(np.shape(xi)) == 1:
            xi = np.broadcast_to(xi, (t.shape[1], len(xi)))
        powers = np.array([*range(element.nodal_dofs)] * 2) - 1.0
        scale = (L[:, None] ** powers)[:, None, :]
        G1 = element.axis(xi, 1).transpose(1, 2, 0) * scale
        G2 = element.axis(xi, 2).transpose(1, 2, 0) * (scale / L[:, None, None])
        q = element.rigid(mesh)
        q[0] = mesh.p
        q_e = np.concatenate([q[:, :, t[0]], q[:, :, t[1]]]).transpose(2, 0, 1)
        q_e = from_first_node(q_e)
        a0, b0 = G1 @ q_e, (0.0 if mesh.is_straight else 1.0) * (G2 @ q_e)
        frame, (n, ne) = np.concatenate([a0, b0], axis=1).transpose(1, 2, 0), a0.shape[1::-1]
        square0 = np.sum(a0 * a0, axis=-1)
        #: Curvature in the stress-free state, (ne, np).
        self.kappa0 = cross(a0, b0) / square0
        self._pack = kernel.packs[0]._replace(
            frame=frame, length0=np.sqrt(square0).T, kappa0=self.kappa0.T,
            frame_place=np.arange(ne))
        self._slopes, self._shape = np.concatenate([G1, G2], axis=1), (n, ne)
        self.tangent0 = np.moveaxis(a0 / np.sqrt(square0)[..., None], -1, 0)

    def __call__(self, u_e: Array) -> tuple[Array, Array]:
        """Unit tangents (2, ne, np), and extension and change of curvature, (2, ne, np).

        Parameters
        ----------
        u_e
            Displacements of the coordinates of the elements, shape (ne, nb, 2).
        """
        d, (n, ne) = (self._slopes @ from_first_node(u_e)).transpose(1, 2, 0), self._shape
        r, strain = np.empty_like(d), np.empty((2, n, ne), d.dtype)
        length, kappa = np.empty((2, n, ne), d.dtype)
        cable_strain(self._pack, 0, d, r, length, kappa, strain)
        if np.iscomplexobj(strain) and not u_e.real.any():
            strain.real = 0.0  # not round-off, where the axis is curved
        tangent = (r[:n] / length[:, None]).transpose(1, 2, 0)
        return tangent, strain.swapaxes(1, 2)
