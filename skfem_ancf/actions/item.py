"""Protocol of all items of a scene."""

import inspect
from collections.abc import Iterable, Sequence
from os import urandom
from typing import TYPE_CHECKING, Any

from ..beam import Layout
from ..core import Immutable, InputError, explained, refuse
from .bound import Bound, user_parts

if TYPE_CHECKING:
    from typing_extensions import Self


class Item(Immutable, Bound):
    """Base class of loads, supports, joints, force elements and user-defined items.

    An item is described without a mesh. :meth:`skfem_ancf.Scene.add` binds a copy to the degrees of
    freedom (DOFs) of the scene, again for every other mesh, as in ``solve_static(adapt=...)``. A
    user-defined class defines some of

    * ``energy(u, t)``: potential energy, a number,
    * ``force(u, v, t)``: force on the DOFs, shape (N,); by default minus the gradient of the
      energy,
    * ``stiffness(u, v, t)`` and ``damping(u, v, t)``: derivatives of the force by u and by v,
      arrays or sparse matrices (N, N); by default differences of the force,
    * ``constraint(u, t)``: equations that Lagrange multipliers keep at zero, shape (m,),
    * ``jacobian(u, t)``: its derivative by u, shape (m, N); by default by differences,
    * ``mass()``: contribution to the mass matrix, (N, N), between DOFs of one node,
    * with a memory: ``start()``, its history at rest, (k,), and ``evaluate(u, v, t, history, dt)``
      in place of the force, which returns the force and the history after an increment ``dt``. Then
      ``energy(u, history)`` is what it stores, and derivatives have these arguments,
    * what else :class:`~skfem_ancf.actions.forces.ForceElement` describes, as ``mean_force`` and
      ``corrected``, with displacements in place of positions.

    Here u and v are displacement and velocity of all DOFs of the scene, shape (N,), and t is the
    time, in statics the load factor. Differences take complex steps, exact to round-off, where the
    functions accept complex arrays.

    Derive from :class:`~skfem_ancf.actions.loads.Load` for loads,
    :class:`~skfem_ancf.actions.joints.Joint` for sparse constraints and
    :class:`~skfem_ancf.actions.forces.ForceElement` for forces on few points.

    Attributes
    ----------
    symmetric : bool
        The stiffness is symmetric: the force has a potential. Set it to False otherwise.
    moving : bool
        The constraint depends on time; False saves its evaluation.
    dissipates : bool
        What an item with a memory takes and does not store is dissipated. Set it to False for a
        load, whose work comes from outside.
    dofs
        Numbers of the DOFs that energy and force depend on and act on, which :meth:`bind` may set;
        all by default, with dense matrices: for small scenes.
    name : str or None
        Name in messages.

    Examples
    --------
    A quartic spring, defined by its energy:

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
    dissipates = True
    dofs: Any = None

    def __new__(cls, *args: Any, **options: Any) -> "Self":
        made = super().__new__(cls)
        #: identifies copies: bound ones, on another mesh, in another process
        vars(made)["_key"] = urandom(16)
        return made

    def expand(self, layout: Layout) -> "Sequence[Item]":
        """The items it consists of: itself, or one for each of several beams."""
        return (self,)

    def bind(self, layout: Any) -> Any:
        """A copy bound to the DOFs of a scene, of a :class:`~skfem_ancf.beam.layout.Layout`. Do not
        change ``self``, which is bound to other meshes later."""
        return self._thawed()

    def bound_on(self, layout: Layout) -> list[Any]:
        """What equations see of it, bound and checked: forces, constraints, loads, supports."""
        hint = ("its energy(u, t), force(u, v, t) and constraint(u, t) take displacements and "
                f"velocities of all degrees of freedom, shape ({layout.N},)")
        with explained("{!r} fails in the reference configuration", hint, InputError, self):
            bound = self.bind(layout)
            refuse(not isinstance(bound, Item), "bind(layout) of {!r} must return an Item, got "
                   "{!r}", self, bound)
            out = user_parts(bound, layout)
        refuse(not out, "{!r} does nothing: an item defines energy(u, t), force(u, v, t), "
               "constraint(u, t) or mass()", self)
        return out

    def symbols(self, layout: Layout) -> Iterable[Any]:
        """What a picture shows of it: a list of :class:`skfem_ancf.actions.symbols.Symbol`, with
        its beam by number; nothing by default.

        Examples
        --------
        A user-defined item, drawn as a mass:

        >>> from skfem_ancf import Beam, ElementBeamCable, Item, MeshBeam, Scene, StVenantKirchhoff
        >>> from skfem_ancf.actions.places import point
        >>> from skfem_ancf.actions.symbols import Symbol
        >>> class Magnet(Item):
        ...     def energy(self, u, t):
        ...         return 1e-3 * u[-4]**2
        ...     def symbols(self, layout):
        ...         return [Symbol("mass", (point(layout, 0, "right"),), text="magnet ", value=7.0)]
        >>> beam = Beam(MeshBeam.init_line([0, 1, 2], height=0.1), ElementBeamCable(3),
        ...             StVenantKirchhoff(E=1e6, nu=0.3), width=0.1)
        >>> [text.get_text() for text in Scene(beam).clamp("left").add(Magnet()).plot().texts]
        ['magnet 7']
        """
        return ()

    def __repr__(self) -> str:
        parts = [type(self).__name__, self.name]
        return f"<{' '.join(part for part in parts if part)}>"

    def _with(self, **changes):
        other = self._thawed()
        for name, value in changes.items():
            setattr(other, name, value)
        return other


def on_each(item: Any, members: Sequence[int]) -> Sequence[Any]:
    """An item on the beam that it names, or without one on each of some members, by number."""
    return (item,) if item.beam is not None else [item._with(beam=k) for k in members]


def takes(function: Any, n: int) -> bool:
    """True for a function of n required arguments, as x, y and t."""
    try:
        kinds = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):  # no function, or a built-in one
        return False
    return sum(p.default is p.empty and p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)
               for p in kinds) == n
