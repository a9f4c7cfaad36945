"""Loads: their force on the coordinates of a beam, its derivative, and its potential."""

import numpy as np
from skfem.assembly import asm

from . import forms
from .errors import require_finite


class Load:
    """Base class: a force on the coordinates of one beam as a function of their displacement.

    Attributes
    ----------
    beam
        The beam it acts on.
    constant : bool
        The force does not depend on the displacement.
    symmetric : bool
        The derivative of the force is symmetric: the load has a potential.
    amplitude
        A function of time by which the force is multiplied in dynamics, or None.
    """

    constant = True
    symmetric = True

    amplitude = None

    def __init__(self, beam):
        self.beam = beam

    def factor(self, t):
        """The amplitude at time ``t``; 1 without one, or in statics, where ``t`` is None."""
        return 1.0 if self.amplitude is None or t is None else float(self.amplitude(t))

    def mean_force(self, u0, u1):
        """A mean of the force between two displacements whose work is exact if it can be."""
        return self.force(0.5 * (u0 + u1))

    def force(self, u):
        """Force at the displacement ``u`` of the beam's coordinates, shape (beam.N,)."""
        raise NotImplementedError

    def stiffness(self, u):
        """Derivative of the force: rows, columns and values."""
        raise NotImplementedError

    def potential(self, u):
        """The potential, minus the work done from the stress-free state; None if there is none."""
        return None


class DeadLoad(Load):
    """A force that keeps its direction and size."""

    def __init__(self, beam, vector):
        super().__init__(beam)
        self.vector = require_finite("the load", vector, (beam.N,))

    def force(self, u):
        return self.vector

    def potential(self, u):
        return -float(self.vector @ u)


class Pressure(Load):
    """A pressure that stays normal to the deformed surface: linear in the position in the plane."""

    constant = False
    symmetric = False

    def __init__(self, beam, facets, p):
        super().__init__(beam)
        basis = beam.facet_basis(facets)
        self.matrix = (p * asm(forms.pressure(beam.width), basis)).tocoo()
        self._rows = self.matrix.tocsr()

    def force(self, u):
        return self._rows @ (self.beam.q0_local + u)

    def stiffness(self, u):
        return self.matrix.row, self.matrix.col, self.matrix.data


class EndMoment(Load):
    """A moment M on a section: M times the angle of the section is its potential, negated.

    The section's direction is ``d = 12 / h^3 int Y r dY``, the best fit of a straight line to the
    deformed face, and its angle that of ``d``. The force is a traction linear in Y and normal
    to ``d``; it turns with the section.
    """

    constant = False

    def __init__(self, beam, node, M):
        super().__init__(beam)
        self.M = M
        self.node = node
        self.dofs, self.c = beam.section_direction(node)

    def direction(self, u):
        """The section's direction d, shape (2,)."""
        return (self.beam.q0_local[self.dofs] + u[self.dofs]) @ self.c

    def angle(self, u):
        """The angle by which the section has turned, in radians.

        Whole turns are counted along the beam, from the section at its other end, whose own angle
        is taken in (-pi, pi].
        """
        nd = self.beam.nd
        rows = self.dofs - self.node * nd + nd * np.arange(self.beam.N // nd)[:, None, None]
        start = self.beam.q0_local[rows] @ self.c
        now = start + u[rows] @ self.c
        turn = (now @ [1.0, 1.0j]) / (start @ [1.0, 1.0j])
        if self.node == 0:
            turn = turn[::-1]
        return float(np.angle(turn[0]) + np.sum(np.angle(turn[1:] / turn[:-1])))

    def force(self, u):
        d = self.direction(u)
        out = np.zeros(self.beam.N, dtype=d.dtype)
        out[self.dofs] = np.outer(np.array([-d[1], d[0]]) * self.M / (d @ d), self.c)
        return out

    def stiffness(self, u):
        a, b = self.direction(u)
        H = np.array([[2 * a * b, b * b - a * a], [b * b - a * a, -2 * a * b]])
        H *= self.M / (a * a + b * b) ** 2
        values = np.einsum("ij,k,l->ikjl", H, self.c, self.c)
        rows = np.broadcast_to(self.dofs[:, :, None, None], values.shape)
        cols = np.broadcast_to(self.dofs[None, None, :, :], values.shape)
        return rows.ravel(), cols.ravel(), values.ravel()

    def mean_force(self, u0, u1):
        # the discrete gradient of Gonzalez (1996): its work is the change of the angle
        force = self.force(0.5 * (u0 + u1))
        step = (u1 - u0)[self.dofs] @ self.c
        if step @ step > 0:
            d0, d1 = self.direction(u0), self.direction(u1)
            angle = np.arctan2(d0[0] * step[1] - d0[1] * step[0], d0 @ d1)
            missing = self.M * angle - force @ (u1 - u0)
            force[self.dofs] += np.outer(step, self.c) * missing / (step @ step)
        return force

    def potential(self, u):
        return -self.M * self.angle(u)
