"""Two end sections are welded at the angle they have in the stress-free state."""

import numpy as np

from .base import Joint, cross_terms, pair, rotation, section


class Weld(Joint):
    """The axis points coincide, and the directions of the two sections keep their angle.

    The direction of a section is the best straight line through its face, so the face may still
    warp and change its thickness.

    Parameters
    ----------
    beams
        Two beams, by Beam, name or number.
    at
        The end section of each beam, as ``("right", "left")``.
    """

    equations = ("force along x", "force along y", "moment")
    constant = False

    def __init__(self, beams, at, name=None):
        self.beams, self.at, self.name = beams, at if isinstance(at, (tuple, list)) else pair(
            at, "the sections at="), name

    def bind(self, scene):
        (self.a, self.da), (self.b, self.db) = (
            section(scene, beam, at) for beam, at in zip(self.beams, self.at))
        angle = np.arctan2(*self.da.start[::-1]) - np.arctan2(*self.db.start[::-1])
        self.Q = rotation(angle)
        self.N = scene.N
        self.rows = np.array([self.a.row(e, scene.N) - self.b.row(e, scene.N) for e in np.eye(2)])

    def value(self, u, t):
        d, e = self.da(u), self.Q @ self.db(u)
        return np.append(self.a(u) - self.b(u), e[0] * d[1] - e[1] * d[0])

    def jacobian(self, u, t):
        d, e = self.da(u), self.Q @ self.db(u)
        turn = self.da.row((-e[1], e[0]), self.N) + self.db.row(self.Q.T @ (d[1], -d[0]), self.N)
        return np.vstack([self.rows, turn])

    def curvature(self, u, t, multipliers):
        i, j, v = cross_terms(self.da, self.db, self.Q)
        return i, j, -multipliers[2] * v
