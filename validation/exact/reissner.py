"""The geometrically exact beam of Reissner and Simo, on its own: positions and angles as unknowns.

N = EA g1, Q = GA g2 and M = EI theta' with (1 + g1, g2) = R(theta)^T r'. Lagrange elements with
reduced integration against locking; the mass is constant, so time integration is that of an
ordinary differential equation.
"""

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import leggauss
from scipy.integrate import solve_ivp
from scipy.linalg import cho_factor, cho_solve, eigh


class Reissner:
    """A straight beam from ``start`` to ``end``; unknowns x, y, theta of each node, (3, n)."""

    def __init__(self, EA, EI, GA, rhoA, rhoI, start, end, elements, degree=3):
        start, end = np.asarray(start, float), np.asarray(end, float)
        self.length = float(np.hypot(*(end - start)))
        n, nodes = elements * degree + 1, np.linspace(0.0, 1.0, degree + 1)
        self.dofs = degree * np.arange(elements)[:, None] + np.arange(degree + 1)
        shapes = [Polynomial.fromroots(np.delete(nodes, k)) for k in range(degree + 1)]
        shapes = [p / p(x) for p, x in zip(shapes, nodes)]
        h = self.length / elements

        def tables(points):
            x, w = leggauss(points)
            x = 0.5 + 0.5 * x
            return (np.array([p(x) for p in shapes]), np.array([p.deriv()(x) for p in shapes]) / h,
                    0.5 * h * w)

        self.N, self.D, self.w = tables(degree)
        N, _, w = tables(degree + 1)
        M = np.zeros((n, n))
        for dofs in self.dofs:
            M[np.ix_(dofs, dofs)] += (N * w) @ N.T
        self.mass, self.EA, self.EI, self.GA = M, EA, EI, GA
        self.inertia = np.array([rhoA, rhoA, rhoI])
        self.rest = np.zeros((3, n))
        self.rest[:2] = start[:, None] + np.outer(end - start, np.linspace(0.0, 1.0, n))
        self.rest[2] = np.arctan2(*(end - start)[::-1])

    def force(self, q):
        """Internal force (3, n)."""
        at = q[:, self.dofs]
        x, y, turn = at @ self.D
        c, s = np.cos(at[2] @ self.N), np.sin(at[2] @ self.N)
        along, across = self.EA * (c * x + s * y - 1.0), self.GA * (c * y - s * x)
        X, Y = c * along - s * across, s * along + c * across
        parts = np.array([(X * self.w) @ self.D.T, (Y * self.w) @ self.D.T,
                          (self.EI * turn * self.w) @ self.D.T
                          + ((X * y - Y * x) * self.w) @ self.N.T])
        out = np.zeros_like(q)
        np.add.at(out, (slice(None), self.dofs), parts)
        return out

    def frequencies(self, k):
        """The lowest k angular frequencies when the start is clamped."""
        n = self.rest.size
        free = np.setdiff1d(np.arange(n), np.arange(3) * self.rest.shape[1])
        step = 1e-6 * np.eye(n)[free].reshape(-1, *self.rest.shape)
        K = np.array([(self.force(self.rest + d) - self.force(self.rest - d)).ravel()[free]
                      for d in step]) / 2e-6
        M = np.kron(np.diag(self.inertia), self.mass)[np.ix_(free, free)]
        return np.sqrt(eigh(0.5 * (K + K.T), M, eigvals_only=True)[:k])

    def motion(self, load, times, accuracy=1e-9):
        """Positions (times, 3, n) from rest under the force ``load(t)`` (3,) on the start."""
        shape, factor = self.rest.shape, cho_factor(self.mass)

        def rate(t, z):
            q, v = z.reshape(2, *shape)
            f = -self.force(q)
            f[:, 0] += load(t)
            return np.concatenate([v.ravel(), (
                cho_solve(factor, f.T).T / self.inertia[:, None]).ravel()])

        z, out, now = np.concatenate([self.rest, 0.0 * self.rest]).ravel(), [], 0.0
        for t in times:
            z = solve_ivp(rate, (now, t - 1e-12), z, "DOP853", rtol=accuracy,
                          atol=accuracy).y[:, -1]
            now = t
            out.append(z.reshape(2, *shape)[0])
        return np.array(out)
