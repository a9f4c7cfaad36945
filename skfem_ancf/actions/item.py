"""The protocol of all that acts in a scene."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import numpy as np
from numpy.typing import ArrayLike

from ..beam.layout import Layout
from ..core.errors import InputError, require_finite
from ..core.immutable import Immutable
from ..core.types import Array

if TYPE_CHECKING:
    from typing_extensions import Self


class Item(Immutable):
    """What acts in a scene: base class of loads, supports, joints, force elements, and of yours.

    An item is described without a mesh. :meth:`skfem_ancf.Scene.add` keeps a copy of it and binds
    another to the degrees of freedom (DOFs) of the scene, and again on another mesh, as for
    ``solve_static(adapt=...)``. A custom class defines what it has of

    * ``energy(u, t)``: its potential energy, a number,
    * ``force(u, v, t)``: the force that it exerts on the DOFs, shape (N,); by default minus the
      gradient of the energy,
    * ``stiffness(u, v, t)`` and ``damping(u, v, t)``: the derivatives of the force by u and by v,
      as arrays or sparse matrices (N, N); by default differences of the force,
    * ``constraint(u, t)``: what Lagrange multipliers hold at zero, shape (m,),
    * ``jacobian(u, t)``: the derivative of that by u, shape (m, N); by default by differences,
    * ``mass()``: what it adds to the mass matrix, (N, N), between DOFs of one node.

    Here u and v are the displacement and the velocity of all DOFs of the scene, shape (N,), and t
    is the time, in statics the load factor. Derivatives by differences take complex steps, to
    round-off, where the functions take complex arrays.

    :class:`~skfem_ancf.actions.loads.Load`, :class:`~skfem_ancf.actions.joints.Joint` and
    :class:`~skfem_ancf.actions.forces.ForceElement` are other kinds of items: for what is
    scaled with the loads, for sparse constraints, and for forces on few points.

    Attributes
    ----------
    symmetric : bool
        The stiffness is symmetric: the force has a potential. Where it is not, say so in the class.
    moving : bool
        The constraint depends on time; False saves asking for that.
    dofs
        Numbers of the DOFs that energy and force depend on and act on, which :meth:`bind` may set;
        all by default, which makes matrices dense: for small scenes.
    name : str or None
        What messages call it.

    Examples
    --------
    A spring of fourth order, known by its energy:

    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamCable, Item, MeshBeam, Scene, StVenantKirchhoff
    >>> from skfem_ancf.actions.places import point
    >>> class Quartic(Item):
    ...     def __init__(self, k, at):
    ...         self.k, self.at = k, at
    ...     def bind(self, layout):
    ...         bound = super().bind(layout)
    ...         bound.point = point(layout, None, self.at)
    ...         bound.dofs = bound.point.dofs
    ...         return bound
    ...     def energy(self, u, t):
    ...         d = self.point(u) - self.point.start
    ...         return self.k / 4 * np.sum(d**2)**2
    >>> beam = Beam(MeshBeam.init_line([0, 0.5, 1], height=0.01), ElementBeamCable(5),
    ...             StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)
    >>> scene = Scene(beam).clamp("left").gravity((0, -9.81)).add(Quartic(1e3, (1, 0)))
    >>> bool(-0.2 < scene.solve_static().displacement((1, 0))[1] < -0.1)
    True
    """

    symmetric = True
    moving = True
    dofs: Any = None
    name: str | None = None
    _key: str

    def __new__(cls, *args: Any, **options: Any) -> Self:
        made = super().__new__(cls)
        #: by which copies are known again: bound ones, on another mesh, in another process
        vars(made)["_key"] = uuid4().hex
        return made

    def expand(self, layout: Layout) -> Sequence[Item]:
        """What it consists of in a scene: itself by default, or one item for each of some beams."""
        return (self,)

    def bind(self, layout: Any) -> Any:
        """The item on the DOFs of a scene, given its :class:`~skfem_ancf.beam.layout.Layout`.

        By default a copy. Leave ``self`` as it is, which is bound to other meshes later.
        """
        return self._thawed()

    def same(self, other: Any) -> bool:
        """True if both were made at once: one is a copy of the other, bound or not."""
        return self._key == getattr(other, "_key", None)

    def __repr__(self) -> str:
        parts = [type(self).__name__, self.name]
        return f"<{' '.join(part for part in parts if part)}>"

    def _with(self, **changes):
        """A copy with other attributes."""
        other = self._thawed()
        for name, value in changes.items():
            setattr(other, name, value)
        return other


def require_entries(what: str, i: ArrayLike, j: ArrayLike, v: ArrayLike, n: int) -> None:
    """Raise InputError unless rows, columns and values are entries of an n x n matrix."""
    i, j = np.asarray(i), np.asarray(j)
    v = require_finite(what, v, (None,))
    if i.dtype.kind not in "iu" or j.dtype.kind not in "iu" or not i.shape == j.shape == v.shape:
        raise InputError(f"{what} must be rows, columns and values of one length, got shapes "
                         f"{i.shape}, {j.shape}, {v.shape}")
    if len(i) and not (0 <= min(i.min(), j.min()) and max(i.max(), j.max()) < n):
        raise InputError(f"{what} has entries in rows and columns {min(i.min(), j.min())} to "
                         f"{max(i.max(), j.max())}: there are 0 to {n - 1}")


def takes_time(function: Any) -> bool:
    """True if a function takes three arguments, x, y and t."""
    if not callable(function):
        return False
    try:
        kinds = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return False
    return sum(p.default is p.empty and p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)
               for p in kinds) == 3


def beside(check: Callable[[Array, Array], None], sizes: Array) -> None:
    """Call a check of derivatives at displacements at which nothing is zero by chance.

    At one of two it may fail: there may be a kink.
    """
    angles = np.arange(len(sizes))
    try:
        check(1e-4 * sizes * np.cos(angles), 1e-6 * sizes * np.sin(angles + 1.0))
    except InputError:
        check(1e-4 * sizes * np.cos(angles + 2.0), 1e-6 * sizes * np.sin(angles + 3.0))
