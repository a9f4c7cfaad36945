"""Shear correction of sections other than rectangles of one material."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial.legendre import legvander

from ..core.quadrature import gauss, lagrange
from .section import Layer

#: Points in each interval of a section.
POINTS = 24


def shear_factor(layers: Sequence[Layer], order: int) -> float:
    """Factor on the shear moduli of a section whose shear strain is a polynomial across it.

    The shear stress in bending is ``b tau = Q S / (E I)`` (Jourawski), with S the E-weighted first
    moment of the area beyond. Sections of order N >= 1 represent it by polynomials of degree N - 1,
    the best fit to ``tau / G`` in the energy, and are too stiff by the energy of the remainder. A
    rectangle has 5/6 for N = 1 and 2, and 1 from N = 3 on.
    """
    t, w = gauss(POINTS)
    till = np.array([b * (gauss(POINTS)[1] @ lagrange(t, b * t)) for b in t])
    y, dy, b, E, G = (np.array(rows) for rows in zip(*_points(layers, np.pi * t, np.pi * w)))
    EA = np.sum(dy * b * E)
    first = E * b * (y - np.sum(dy * b * E * y) / EA)
    S = np.cumsum(np.append(0.0, np.sum(dy * first, axis=1)))[:-1, None] + (
        first * dy / w) @ till.T
    tau, p = S / b, legvander(2.0 * y.ravel() - 1.0, order - 1)
    A = p.T @ ((dy * b * G).ravel()[:, None] * p)
    r = p.T @ (dy * b * tau).ravel()
    return float(r @ np.linalg.solve(A, r) / np.sum(dy * b * tau**2 / G))


def _points(layers, t, w):
    """Points in each interval with weights, widths and moduli."""
    for layer in layers:
        law, m = layer.material, layer.measure
        for low, high, width in m.pieces:
            half = 0.5 * (high - low)
            eta, one = 0.5 * (low + high) - half * np.cos(t), np.ones(len(t))
            width = (width(eta) if callable(width) else width) * layer.width / m.mean
            yield (eta, half * np.sin(t) * w, width * one,
                   law.axial_modulus * one, law.G * one)
