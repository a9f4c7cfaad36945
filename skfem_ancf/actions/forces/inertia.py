"""Point masses, and a frame of reference that rotates with its centrifugal and Coriolis forces."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from scipy import sparse

from ...beam import Beam, Layout, WhichBeam, WhichMember
from ...core import (Array, ArrayLike, refuse, require_finite, require_finite_scalar,
                     require_not_negative, shown)
from ..item import Item, on_each
from ..places import Vector, point, section
from ..symbols import Symbol
from .base import ForceElement, KernelElement


class PointMass(ForceElement):
    """A mass on a material point, optionally with a moment of inertia.

    Parameters
    ----------
    mass
        Zero or positive.
    at
        The point (x, y) in the reference configuration, or the name of an end.
    inertia
        Moment of inertia about the point, zero or positive; the point must then be on the section
        of a node.
    beam
        Beam, name or number, in a scene of several.
    """

    def __init__(self, mass: float, at: ArrayLike, inertia: float = 0.0,
                 beam: WhichBeam = None) -> None:
        self.mass = require_not_negative("mass", mass)
        self.inertia = require_not_negative("inertia", inertia)
        self.at = at if isinstance(at, str) else tuple(require_finite("at", at, (2,)).tolist())
        self.beam = beam
        refuse(not self.mass and not self.inertia, "a point mass needs a mass or an inertia that "
               "is positive, got two zeros")

    def bind(self, layout: Layout) -> list[Vector]:
        self._masses = [(self.mass, point(layout, self.beam, self.at))]
        if self.inertia:
            self._masses.append((self.inertia, section(layout, self.beam, self.at)[1]))
        return [place for _, place in self._masses]

    def parts(self) -> list[KernelElement]:
        return []

    def mass_entries(self) -> tuple[Array, Array, Array]:
        """Rows, columns and values added to the mass matrix, shapes (k,)."""
        rows, columns, values = [], [], []
        for size, place in self._masses:
            for dofs, weights in zip(place.dofs, place.weights):
                rows.append(np.repeat(dofs, len(dofs)))
                columns.append(np.tile(dofs, len(dofs)))
                values.append(size * np.outer(weights, weights).ravel())
        return np.concatenate(rows), np.concatenate(columns), np.concatenate(values)

    def symbols(self, layout: Layout) -> Iterable[Symbol]:
        yield Symbol("mass", (point(layout, self.beam, self.at),), text="m = ", value=self.mass,
                     show=True)

    def __repr__(self) -> str:
        return f"<PointMass {self.mass:g} at {shown(self.at)}>"


class RotatingFrame(ForceElement):
    """Describe a scene in a frame that turns at a constant angular velocity.

    All positions, displacements and supports are those in the frame. On each mass act the
    centrifugal force ``dm Omega^2 (r - center)`` and the Coriolis force ``2 dm Omega (v_y, -v_x)``:
    a static solution is a steady rotation, ``scene.linearize`` about it has both, ``scene.modes``
    the first of them. They act on point masses of these beams, too.

    Parameters
    ----------
    speed
        Angular velocity Omega of the frame, in radians per time, counterclockwise.
    center
        The point about which it turns, shape (2,).
    beam
        Beam, rigid body or domain, name or number; all of them by default.

    Examples
    --------
    The blade of a rotor stretches by rho Omega^2 L^3 / (3 E) at its tip:

    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, RotatingFrame, Scene
    >>> from skfem_ancf import StVenantKirchhoff
    >>> blade = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.01), ElementBeamCable(5),
    ...              StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)
    >>> scene = Scene(blade).clamp("left").add(RotatingFrame(3.0))
    >>> tip = scene.solve_static().displacement((1, 0))
    >>> bool(abs(tip[0] / (7800 * 3.0**2 / (3 * 2e8)) - 1) < 1e-3)
    True
    """

    distributed = True
    symmetric = False

    def __init__(self, speed: float, center: ArrayLike = (0.0, 0.0),
                 beam: WhichMember = None) -> None:
        self.speed = require_finite_scalar("speed", speed)
        self.center, self.beam = require_finite("center", center, (2,)), beam

    def expand(self, layout: Layout) -> Sequence[Item]:
        return on_each(self, range(len(layout.members)))

    def bind(self, layout: Layout) -> list[Vector]:
        member, first = layout.beam(self.beam), layout.offset(self.beam)
        along_x, along_y, turn = member.rigid_motions().T
        around = np.column_stack([along_x, along_y]) @ (member.origin - self.center)
        #: positions and directions relative to the centre, (n, 2)
        self._rest = around.reshape(-1, 2) + np.column_stack([turn[1::2], -turn[::2]])
        if isinstance(member, Beam):
            M = sparse.csr_array(member.mass())
        else:
            i, j, values = member.mass_entries()
            M = sparse.csr_array((values, (i, j)), shape=(member.N, member.N))
        self._own, self._slice = M[::2][:, ::2], slice(first, first + member.N)
        self._set_mass(self._own)
        return [Vector(np.zeros(2), first + k + np.arange(2)[:, None], 1.0)
                for k in range(0, member.N, 2)]

    def _set_mass(self, M):
        self._mass = sparse.coo_array(M)
        i, j = self._mass.coords
        # the derivatives by both components of both
        c, d = np.divmod(np.arange(4), 2)
        self.entries = ((2 * i[:, None] + c).ravel(), (2 * j[:, None] + d).ravel())

    def with_masses(self, masses: Sequence[Any], N: int) -> "RotatingFrame":
        """A copy of the bound frame that acts on point masses, too.

        Parameters
        ----------
        masses, N
            Bound elements with a mass, and the number of degrees of freedom of the scene.
        """
        other, M = self._thawed(), self._own
        for one in masses:
            i, j, values = one.mass_entries()
            whole = sparse.csr_array((values, (i, j)), shape=(N, N))
            M = M + whole[self._slice, self._slice][::2][:, ::2]
        other._set_mass(M)
        other._freeze()
        return other

    def force(self, x: Array, v: Array, t: float) -> Array:
        w = self.speed
        return self._mass @ (w * w * (self._rest + x)
                             + 2.0 * w * np.column_stack([v[:, 1], -v[:, 0]]))

    def potential(self, x: Array) -> float:
        r = self._rest + x
        return -0.5 * self.speed**2 * float(np.sum(r * (self._mass @ r)))

    def stiffness(self, x: Array, v: Array, t: float) -> Array:
        return np.outer(self.speed**2 * self._mass.data, [1.0, 0.0, 0.0, 1.0]).ravel()

    def resistance(self, x: Array, v: Array, t: float) -> Array:
        return np.outer(2.0 * self.speed * self._mass.data, [0.0, 1.0, -1.0, 0.0]).ravel()

    def __repr__(self) -> str:
        return f"<RotatingFrame {self.speed:g} rad per time>"
