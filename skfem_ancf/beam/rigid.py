"""A planar rigid body."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..core import (Array, ArrayLike, Immutable, angle_of, read_only, rebuilt, refuse,
                    require_finite, require_finite_scalar, require_label, require_names,
                    require_positive)
from ..mesh.places import as_point

#: Names of the DOFs: position of the centre of mass, and director.
NAMES = ("r^1", "r^2", "d^1", "d^2")


class RigidBody(Immutable):
    """A planar rigid body. It is immutable; :meth:`replace` returns a changed copy.

    Its degrees of freedom are the position r of the centre of mass and a unit director d. The point
    (a, b) of the body frame is at ``r + a d + b d'``, with d' = d turned by 90 degrees. Positions
    are linear in the DOFs, the mass matrix is constant, and ``d . d = 1`` is a constraint with a
    multiplier.

    A material point is named by its initial position (x, y) and may lie outside of the outline. See
    Garcia de Jalon, Bayo: "Kinematic and dynamic simulation of multibody systems", Springer (1994),
    chapter 2: natural coordinates.

    Parameters
    ----------
    mass
        The mass, positive.
    inertia
        Moment of inertia about the centre of mass, positive.
    position
        Initial position of the centre of mass, shape (2,).
    angle
        Initial angle of the body frame, in radians, counterclockwise.
    name
        Name in messages.
    outline
        Corners of a polygon in the body frame, relative to the centre of mass: a list of points, or
        an array of shape (n, 2) or (2, n). It is used in plots and files, and to locate points. The
        default is the square plate with this mass and inertia.

    Other Parameters
    ----------------
    u, v
        Displacement of the degrees of freedom and its rate, shape (4,) or (..., 4).

    Examples
    --------
    A heavy body on the end of a light cantilever, of frequency sqrt(3 E I / (m L^3)):

    >>> import numpy as np
    >>> from skfem_ancf import (Beam, ElementBeamCable, MeshBeam, RigidBody, Scene,
    ...                         StVenantKirchhoff)
    >>> beam = Beam(MeshBeam.init_line([0, 0.5, 1], 0.01), ElementBeamCable(5),
    ...             StVenantKirchhoff(12e9, 0.3, 1e-3), width=0.01)
    >>> body = RigidBody(mass=2.0, inertia=1e-6, position=(1, 0), name="bob")
    >>> scene = Scene(beam, body).clamp("left")
    >>> weld = scene.joint("weld", beams=(beam, body), at=(1, 0))
    >>> bool(abs(scene.modes(1).frequencies[0] / np.sqrt(3 * 10.0 / 2.0) - 1) < 1e-4)
    True
    """

    N = nd = 4

    def __init__(self, mass: float, inertia: float, position: ArrayLike = (0.0, 0.0),
                 angle: float = 0.0, name: str | None = None,
                 outline: ArrayLike | None = None) -> None:
        self.mass = require_positive("mass", mass)
        self.inertia = require_positive("inertia", inertia)
        for name_of, value in (("mass", self.mass), ("inertia", self.inertia)):
            refuse(value < np.finfo(float).tiny, "{} is too small, its inverse overflows: got {!r}",
                   name_of, value)
        self.position = require_finite("position", position, (2,))
        self.angle = require_finite_scalar("angle", angle)
        self.name = require_label("name", name)
        if outline is None:
            half = 0.5 * np.sqrt(6.0 * self.inertia / self.mass)
            points = half * np.array([[-1.0, 1.0, 1.0, -1.0], [-1.0, -1.0, 1.0, 1.0]])
        else:
            points = require_finite("outline", outline)
            if points.ndim == 2 and points.shape[1] == 2:  # n >= 3, so that (2, n) differs
                points = points.T
            refuse(points.ndim != 2 or len(points) != 2 or points.shape[1] < 3 or not points.any(),
                   "an outline is a polygon of at least three corners, relative to the centre of "
                   "mass: a list of points, or an array of shape (n, 2), got {!r}", outline)
        self.outline = points
        c, s = np.cos(self.angle), np.sin(self.angle)
        self.q0 = np.array([*self.position, c, s])
        #: :attr:`q0` with the position relative to :attr:`origin`.
        self.q0_local = np.array([0.0, 0.0, c, s])
        #: Names of the DOFs.
        self.dofnames = list(NAMES)
        #: Initial centre of mass, shape (2,).
        self.origin = self.position
        #: The mass.
        self.total_mass = self.mass
        #: Largest distance of the outline from the centre of mass.
        self.size = float(np.max(np.hypot(*points)))
        #: Typical changes of the DOFs when the body moves by its size, (4,).
        self.sizes = np.array([self.size, self.size, 1.0, 1.0])
        self._frame = read_only(np.array([[c, -s], [s, c]]))

    def __repr__(self):
        who = "" if self.name is None else f"{self.name} "
        return (f"<RigidBody {who}of mass {self.mass:g} and inertia {self.inertia:g} at "
                f"({self.position[0]:g}, {self.position[1]:g})>")

    def replace(self, **changes: Any) -> "RigidBody":
        """A copy with some arguments of the constructor changed, as ``mass=2.0``."""
        return rebuilt(self, changes)

    # the interface of a beam

    def mass_entries(self) -> tuple[Array, Array, Array]:
        """Rows, columns and values (4,) of the mass matrix."""
        k = np.arange(4)
        return k, k, np.array([self.mass, self.mass, self.inertia, self.inertia])

    def weight(self, g: ArrayLike) -> Array:
        """The dead load of an acceleration ``g`` (2,), shape (4,)."""
        return np.append(self.mass * require_finite("g", g, (2,)), np.zeros(2))

    def velocity_of(self, field: Callable[[Array], Array]) -> Array:
        """DOF rates (4,) in a velocity field, a function of initial points (2, n)."""
        v = field(self.position[:, None] + self.size * np.array([[0.0, 1.0], [0.0, 1.0]])
                  * self.q0[2:, None])
        n = np.array([-self.q0[3], self.q0[2]])
        return np.append(v[:, 0], n * (n @ (v[:, 1] - v[:, 0])) / self.size)

    def rigid_motions(self) -> Array:
        """Two translations and the rotation about :attr:`origin`, (4, 3)."""
        out = np.zeros((4, 3))
        out[0, 0] = out[1, 1] = 1.0
        out[2:, 2] = -self.q0[3], self.q0[2]
        return out

    def dofs(self, boundary: Any = None, names: str | Sequence[str] | None = None) -> Array:
        """Numbers of DOFs by name, shape (n,).

        Parameters
        ----------
        boundary
            None, or a point.
        names
            From :attr:`dofnames`, or without component, as ``"r"``; None for all.
        """
        if boundary is not None and not isinstance(boundary, RigidBody):
            self.place(boundary)
        if names is None:
            return np.arange(4)
        names = require_names("degree of freedom", names, [*NAMES, "r", "d"])
        return np.array([k for k, full in enumerate(NAMES)
                         if full in names or full.rsplit("^", 1)[0] in names])

    def direction(self) -> tuple[Array, Array]:
        """Number (2, 1) and weight (1,) of the DOFs of the director."""
        return np.array([[2], [3]]), np.ones(1)

    # points

    def place(self, at: Any) -> Array:
        """An initial point (x, y) as an array (2,); None for the centre of mass."""
        return self.position if at is None else as_point(at)

    def local(self, x: ArrayLike) -> Array:
        """Coordinates in the body frame of initial points (2, ...)."""
        x = require_finite("x", x)
        refuse(x.ndim < 1 or len(x) != 2, "x must have shape (2, ...), got {}", x.shape)
        return np.tensordot(self._frame.T, x - self.position.reshape((2,) + (1,) * (x.ndim - 1)), 1)

    def probe(self, at: Any) -> tuple[Array, Array]:
        """Numbers and weights (2, 3) of the DOFs in the position of a material point. The position
        is ``sum(q[dofs] * weights, axis=1)``; None is the centre of mass."""
        a, b = self.local(self.place(at))
        return np.array([[0, 2, 3], [1, 3, 2]]), np.array([[1.0, a, -b], [1.0, a, b]])

    def contains(self, x: ArrayLike) -> Array:
        """Whether initial points (2, n) are in the outline, shape (n,)."""
        p = self.local(require_finite("x", x, (2, None))).T
        corners = self.outline.T
        inside, near = np.zeros(len(p), dtype=bool), np.zeros(len(p), dtype=bool)
        for a, b in zip(corners, np.roll(corners, -1, axis=0)):
            edge = b - a
            along = np.clip(((p - a) @ edge) / max(edge @ edge, 1e-300), 0.0, 1.0)
            near |= np.hypot(*(p - a - along[:, None] * edge).T) <= 1e-9 * self.size
            between = (a[1] > p[:, 1]) != (b[1] > p[:, 1])
            with np.errstate(divide="ignore", invalid="ignore"):
                inside ^= between & (p[:, 0] < a[0] + (p[:, 1] - a[1]) * edge[0] / edge[1])
        return inside | near

    def outline_at(self, u: Array) -> Array:
        """The outline (2, n) at a displacement (4,)."""
        q = self.q0 + u
        d = q[2:]
        return q[:2, None] + np.array([[d[0], -d[1]], [d[1], d[0]]]) @ self.outline

    def angle_at(self, u: Array) -> Array:
        """The angle at displacements (..., 4), within pi of :attr:`angle`."""
        d = self._frame.T @ (self.q0[2:] + u[..., 2:])[..., None]
        return self.angle + angle_of(d[..., 0, 0], d[..., 1, 0])

    def angular_velocity(self, u: Array, v: Array) -> Array:
        """The angular velocity, counterclockwise, for displacements and rates (..., 4)."""
        d = self.q0[2:] + u[..., 2:]
        return d[..., 0] * v[..., 3] - d[..., 1] * v[..., 2]


def on_body(place: Any, beam: Any) -> tuple[Any, Any]:
    """Place and beam; a RigidBody given as place becomes the beam."""
    return (None, place) if isinstance(place, RigidBody) else (place, beam)
