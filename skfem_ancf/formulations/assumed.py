"""Assumed strain: free of membrane and curvature-thickness locking, two points along the axis."""

import numpy as np

from ..quadrature import gauss
from .base import Formulation, Term


class Assumed(Formulation):
    """eps_xx and eps_xy at two Gauss points along the axis, eps_yy interpolated from the nodes.

    A cubic axis cannot keep |r_X| constant while it bends, and sections that turn linearly get
    thinner between two nodes that have turned: sampled where they are exact, neither is seen. One
    spurious mode is left, equal r_X at both nodes with r at rest, and is held by
    ``1/2 alpha E I / L |c|^2``, ``c = (A_1 r_X1 + A_2 r_X2) / 2 - (r_2 - r_1) / L``, where A_i
    turns and scales the stress-free tangent onto the chord (the identity for a straight element),
    so that c vanishes there, turns with the beam, and the term is objective and quadratic.

    Parameters
    ----------
    alpha
        Size of the stabilisation.
    """

    name = "assumed"

    def __init__(self, alpha=1.0):
        self.alpha = alpha

    def terms(self, element, material):
        _, section = self.full_rules(element)
        law = material.law(material.shear_factor(element))
        return [Term(law, gauss(2), section, {"yy": (0.0, 1.0)})]

    def stabilisation(self, mesh, element, material, width):
        same = mesh.is_straight and np.ptp(mesh.lengths) <= 1e-13 * np.max(mesh.lengths)
        tind = np.arange(1 if same else mesh.nelements)
        L, nd = mesh.lengths[tind], 2 * element.nodal_dofs
        left, right = mesh.t[:, tind]
        chord = (mesh.p[:, right] - mesh.p[:, left]) / L
        C = np.zeros((len(tind), 2, 2 * nd))
        for node, at, sign in ((0, left, -1.0), (1, right, 1.0)):
            t = mesh.p_X[:, at]
            # a + i b = chord / tangent in the complex plane
            a = np.sum(chord * t, axis=0) / np.sum(t * t, axis=0)
            b = (chord[1] * t[0] - chord[0] * t[1]) / np.sum(t * t, axis=0)
            A = np.array([[a, -b], [b, a]])
            C[:, :, node * nd:node * nd + 2] -= sign * np.eye(2) / L[:, None, None]
            C[:, :, node * nd + 2:node * nd + 4] += 0.5 * np.moveaxis(A, -1, 0)
        k = self.alpha * material.E * width * mesh.height**3 / 12.0 / L
        return k[:, None, None] * (C.transpose(0, 2, 1) @ C)
