"""A point or a section follows a given motion."""

import numpy as np

from ..sampling import sample
from .base import Joint, point, section


class PrescribedPosition(Joint):
    """r = r(t) for a material point. At a node of the axis it only fixes coordinates.

    Parameters
    ----------
    at
        The material point.
    r
        The motion: a function of time that returns the position (2,).
    beam
        The beam, by Beam, name or number; None where there is only one.
    """

    equations = ("force along x", "force along y")
    moving = True

    def __init__(self, at, r, beam=None, name=None):
        self.at, self.motion, self.beam, self.name = at, r, beam, name

    def bind(self, scene):
        self.r = point(scene, self.beam, self.at)
        self.rows = np.array([self.r.row(e, scene.N) for e in np.eye(2)])

    def value(self, u, t):
        return self.r(u) - np.asarray(self.motion(t), dtype=float)

    def offset(self, times, N):
        return self.r.start - sample(self.motion, times)

    def jacobian(self, u, t):
        return self.rows


class PrescribedAngle(Joint):
    """The direction of an end section has turned by angle(t): e(t) x d = 0.

    Parameters
    ----------
    at
        The end section, "left" or "right".
    angle
        The angle in radians as a function of time, from the stress-free state,
        counterclockwise.
    beam
        The beam, by Beam, name or number; None where there is only one.
    """

    equations = ("moment",)
    constant = False
    moving = True

    def __init__(self, at, angle, beam=None, name=None):
        self.at, self.angle, self.beam, self.name = at, angle, beam, name

    def bind(self, scene):
        _, self.d = section(scene, self.beam, self.at)
        self.N, self.start = scene.N, np.arctan2(*self.d.start[::-1])

    def value(self, u, t):
        a, d = self.start + self.angle(t), self.d(u)
        return np.array([np.cos(a) * d[1] - np.sin(a) * d[0]])

    def jacobian(self, u, t):
        a = self.start + self.angle(t)
        return self.d.row((-np.sin(a), np.cos(a)), self.N)[None]

    def _normals(self, times):
        a = self.start + sample(self.angle, times)
        return np.array([-np.sin(a), np.cos(a)]).T

    def offset(self, times, N):
        return self._normals(times) @ self.d.start[:, None]

    def slope(self, times, N):
        values = self._normals(times)[:, :, None] * self.d.weights
        return self.d.dofs.ravel(), values.reshape(len(times), 1, -1)
