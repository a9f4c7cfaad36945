"""What a scene is made of: beams, rigid bodies and items, and the methods that add items."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from threading import RLock
from typing import TYPE_CHECKING, Any, Concatenate, NamedTuple, ParamSpec, TypeVar

from numpy.typing import ArrayLike

from ..actions.axial import FollowerForce, LineLoad
from ..actions.binding import bind_item
from ..actions.eigenstrain import EigenStrain, Temperature, require_alone
from ..actions.energy import Energy
from ..actions.form_load import FormLoad
from ..actions.forces import (Control, Drag, ForceElement, Foundation, PointMass, Spring,
                              TorsionalSpring)
from ..actions.item import Item
from ..actions.joints import Hinge, Joint, Motor, Weld, get_joint
from ..actions.joints.sliders import slider
from ..actions.loads import EndMoment, Load, Pressure, Traction, Weight
from ..actions.point_force import PointForce
from ..actions.obstacles import Obstacle
from ..actions.places import joined
from ..actions.supports import Clamp, Pin, Support
from ..beam.beam import Beam
from ..beam.domain import Domain
from ..beam.layout import Layout, WhichMember
from ..beam.rigid import RigidBody
from ..core.errors import InputError, require_text, shown
from ..core.near_misses import NearMisses
from ..core.types import TimeFunction
from ..materials.damping import Damping
from ..mesh.places import on_other_mesh

if TYPE_CHECKING:
    from typing_extensions import Self

P = ParamSpec("P")
M = TypeVar("M", bound="Model")


def adds(name: str, item: Callable[P, Item]) -> Callable[Concatenate[M, P], M]:
    """A method of a scene that adds an item of a class, whose arguments it takes.

    The class describes them, so that ``help(Scene)`` is short.
    """
    def method(self, *arguments, **options):
        return self.add(item(*arguments, **options))

    signature, about = inspect.signature(item), (inspect.getdoc(item) or "").split("\n\n")[0]
    itself = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    of = getattr(item, "__name__", name)
    method.__doc__ = f"{about} Arguments: those of :class:`~skfem_ancf.{of}`."
    method.__name__, method.__qualname__ = name, f"Model.{name}"
    vars(method).update(item=item, __signature__=signature.replace(
        parameters=[itself, *signature.parameters.values()], return_annotation="Self"))
    return method


class Entry(NamedTuple):
    """An item as it was given, with beams by number, and what it is on the DOFs of the scene."""

    given: Item
    bound: tuple[Any, ...]


class Model(NearMisses):
    """Beams, rigid bodies, and what acts on them: the description of a :class:`Scene`."""

    def __init__(self, *beams: Any) -> None:
        if len(beams) == 1 and isinstance(beams[0], (list, tuple)):
            beams = tuple(beams[0])
        #: Beams, bodies and the numbers of their degrees of freedom.
        self.layout = Layout(*beams)
        self._entries: tuple[Entry, ...] = ()
        self._fixed: dict[int, float] = {}
        self._damping: Damping | None = None
        self._units: tuple[str, str] | None = None
        self._system: Any = None
        self._lock = RLock()

    def __getstate__(self):
        """Without the equations, which are built again."""
        return {name: value for name, value in vars(self).items() if name != "_lock"} | {
            "_system": None}

    def __setstate__(self, state):
        vars(self).update(state, _lock=RLock())

    @property
    def beams(self) -> tuple[Beam, ...]:
        """The beams."""
        return self.layout.beams

    @property
    def bodies(self) -> tuple[RigidBody, ...]:
        """The rigid bodies."""
        return self.layout.bodies

    @property
    def domains(self) -> tuple[Domain, ...]:
        """The domains."""
        return self.layout.domains

    @property
    def N(self) -> int:
        """Number of degrees of freedom."""
        return self.layout.N

    @property
    def items(self) -> tuple[Item, ...]:
        """All that acts, as it was given, in the order in which it was added."""
        return tuple(entry.given for entry in self._entries)

    @property
    def loads(self) -> tuple[Load, ...]:
        """The loads, bound to the beams: a tuple of :class:`~skfem_ancf.actions.loads.Load`."""
        return self._all(Load)

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints, bound to the beams: a tuple of :class:`~skfem_ancf.actions.joints.Joint`."""
        return self._all(Joint)

    @property
    def elements(self) -> tuple[ForceElement, ...]:
        """The force elements, bound: springs, foundations, masses, obstacles, your own."""
        return self._all(ForceElement)

    def _all(self, kind):
        return tuple(one for entry in self._entries for one in entry.bound if isinstance(one, kind))

    def beam(self, beam: WhichMember = None) -> Any:
        """The Beam or RigidBody meant by itself, a name, a number, or None for the only beam."""
        return self.layout.beam(beam)

    def _bound(self, item):
        """An entry, of which nothing is kept yet."""
        if not isinstance(item, Item):
            raise InputError(f"the item must be an Item, as a Spring, a Load or a Joint, got "
                             f"{shown(item)}: derive yours from skfem_ancf.Item")
        bound = [part for one in item.expand(self.layout) for part in bind_item(one, self.layout)]
        given = item._with(**{name: self._numbered(value) for name, value in vars(item).items()
                              if not name.startswith("_")})
        given._freeze()
        return Entry(given, tuple(bound))

    def _numbered(self, value):
        """The number of a Beam, tuples and lists with numbers in place of them, or the value."""
        if isinstance(value, Beam):  # rigid bodies stay the same on other meshes
            return self.layout.number(value)
        if not isinstance(value, (tuple, list)):
            return value
        inner = [self._numbered(v) for v in value]
        return value if all(a is b for a, b in zip(inner, value)) else tuple(inner)

    def _put(self, *items):
        """Bind everything, then keep it: what fails leaves the scene as it was.

        Returns what the items are bound to.
        """
        with self._lock:
            entries, fixed = [self._bound(item) for item in items], dict(self._fixed)
            bound = [one for entry in entries for one in entry.bound]
            for one in bound:
                if isinstance(one, Support):
                    one.hold(fixed)
            require_alone([*self.loads, *(one for one in bound if isinstance(one, Load))])
            self._entries, self._fixed, self._system = self._entries + tuple(entries), fixed, None
        return bound

    def add(self, item: Item) -> Self:
        """Add a load, a support, a joint, a force element, or a custom item.

        Parameters
        ----------
        item
            An :class:`~skfem_ancf.Item`. The scene keeps it as it is now, and binds a copy to its
            beams; on another mesh, as for ``solve_static(adapt=...)``, it is bound again.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, Clamp, ElementBeamANCF, MeshBeam, PointForce, Scene
        >>> from skfem_ancf import StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.01),
        ...                    ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3), width=0.01))
        >>> state = scene.add(Clamp("left")).add(PointForce((0, -1e-3), at=(1, 0))).solve_static()
        >>> state.converged
        True
        """
        self._put(item)
        return self

    def units(self, force: str, length: str) -> Self:
        """Say in which units the numbers of the scene are, for pictures, files and tables.

        No number changes: all units fit together, as N, mm, MPa and tonnes.

        Parameters
        ----------
        force, length
            As "N" and "mm": stresses are then said to be in MPa, in other units in "lbf/in²".

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line([0, 500, 1000], height=10), ElementBeamANCF(2),
        ...                    StVenantKirchhoff(E=2.1e5, nu=0.3), width=10)).units("N", "mm")
        >>> state = scene.clamp("left").point_force((0, -5), at=(1000, 0)).solve_static()
        >>> ax = state.plot("S_xx")                                 # $S_{xx}$ (MPa)
        """
        for name, value in (("force", force), ("length", length)):
            if not require_text(name, value):
                raise InputError(f"{name} must be the name of a unit, got {shown(value)}")
        self._units = (force, length)
        return self

    # items: a new one is one line here

    clamp = adds("clamp", Clamp)
    pin = adds("pin", Pin)
    fix = adds("fix", Support)
    gravity = adds("gravity", Weight)
    point_force = adds("point_force", PointForce)
    follower_force = adds("follower_force", FollowerForce)
    line_load = adds("line_load", LineLoad)
    traction = adds("traction", Traction)
    pressure = adds("pressure", Pressure)
    temperature = adds("temperature", Temperature)
    eigenstrain = adds("eigenstrain", EigenStrain)
    moment = adds("moment", EndMoment)
    load = adds("load", FormLoad)
    energy = adds("energy", Energy)
    spring = adds("spring", Spring)
    torsional_spring = adds("torsional_spring", TorsionalSpring)
    control = adds("control", Control)
    foundation = adds("foundation", Foundation)
    drag = adds("drag", Drag)
    point_mass = adds("point_mass", PointMass)
    obstacle = adds("obstacle", Obstacle)

    # joints

    def joint(self, joint: str | Joint, **options: Any) -> Joint:
        """Add a joint, enforced by Lagrange multipliers.

        In statics the time of a motion is the load factor. A joint that only fixes degrees of
        freedom is eliminated like a support.

        Parameters
        ----------
        joint
            A name from :data:`skfem_ancf.actions.joints.JOINTS` with its options, or a Joint:

            * ``"hinge", beams=(a, b), at=point``: two beams share a point, see :meth:`hinge`,
            * ``"weld", beams=(a, b), at=("right", "left")``: two sections keep their angle, see
              :meth:`weld`,
            * ``"line", at=point, direction=(1, 0)``: a point slides on a line,
            * ``"circle", at=point, center=(0, 0)``: a point slides on a circle,
            * ``"position", at=point, r=function``: a point follows ``r(t)``,
            * ``"angle", at="left", angle=function``: a section turns by ``angle(t)``,
            * ``"plane", at="left"``: a section stays in its plane,
            * ``"sleeve", at=(a, point), on=b``, ``"slot", at=(a, point), on=body, direction=d``:
              a point slides along a beam, along a line of a body, see :meth:`slider`.
        **options
            Arguments of the joint's class, where it is given by its name.

        Raises
        ------
        NameUnknown
            If the joint's name is not known.
        SupportError
            When solving, if joints contradict each other or the supports.
        """
        return self._put(get_joint(joint, **options))[0]

    def hinge(self, *places: Any, name: str | None = None) -> Joint:
        """Join material points of beams and rigid bodies: they stay together, and may turn.

        Parameters
        ----------
        *places
            One point (x, y), at which two beams or bodies or more meet; or a place for each of
            them: (beam, (x, y)) with a Beam, a RigidBody, a name or a number, (beam, "right"), a
            point that only one of them has, ("ground", (x, y)), or a RigidBody for its centre of
            mass.
        name
            What messages call the joint.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> a, b = (Beam(MeshBeam.init_line([0, 1, 2], 0.1, origin=origin, angle=angle),
        ...              ElementBeamCable(), StVenantKirchhoff(1e6, 0.3), width=0.1)
        ...         for origin, angle in (((0, 0), 0.0), ((1, 0), 1.5707963267948966)))
        >>> scene = Scene(a, b).clamp("left", a).clamp("right", b)
        >>> scene.hinge((1, 0)).equations
        ('force along x', 'force along y')
        """
        return self.joint(Hinge(*joined(self.layout, places), name))

    def weld(self, *places: Any, name: str | None = None, apart: bool = False) -> Joint:
        """Join beams and rigid bodies: points stay together, and sections keep their angles.

        The point of a beam may be anywhere, inside of an element too: so the end of one is welded
        to the middle of another, or several meet in one point.

        Parameters
        ----------
        *places
            As for :meth:`hinge`; (beam, "right") is the axis at that end. Of a
            :class:`~skfem_ancf.Domain` a boundary, as (domain, "right"), which moves with the end
            or side of a beam, as (beam, "left"), or with a rigid body.
        name
            What messages call the joint.
        apart
            Allow that the points are apart in the reference configuration: the weld draws them
            together.
        """
        return self.joint(Weld(*joined(self.layout, places), name, apart))

    def slider(self, at: Any, on: WhichMember, direction: ArrayLike | None = None,
               angle: bool = False, name: str | None = None) -> Joint:
        """A material point slides along the axis of a beam, or along a line of a rigid body.

        Parameters
        ----------
        at
            The point: (x, y) if one beam or body alone has it, (beam, (x, y)) with a Beam, a
            RigidBody, a name or a number, ("ground", (x, y)), a RigidBody for its centre of mass.
        on
            The beam, along whose axis it slides, however far that bends; or a RigidBody or
            "ground".
        direction
            Direction of the line of a body or the ground in the state of the start, shape (2,).
        angle
            Keep the angle between the section at the point and the axis or the line: a sleeve that
            carries a moment.
        name
            What messages call the joint.
        """
        return self.joint(slider(self.layout, at, on, direction, angle, name))

    def motor(self, at: Any, angle: TimeFunction = None, speed: Any = None, torque: Any = None,
              other: Any = None) -> Joint | Load:
        """Add a :class:`~skfem_ancf.Motor`; returns its joint, or the load of a torque.

        Parameters
        ----------
        at, angle, speed, torque, other
            As for :class:`~skfem_ancf.Motor`.
        """
        return self._put(Motor(at, angle, speed, torque, other))[0]

    def damping(self, mass: float = 0.0, stiffness: float = 0.0, modal: ArrayLike = ()) -> Self:
        """Damping of the whole scene: Rayleigh's, and of modes.

        A mode of the angular frequency omega gets the damping ratio ``mass / (2 omega) + stiffness
        omega / 2``. It acts in motions; materials may have their own, ``Beam(...,
        damping=KelvinVoigt(time))``. A second call takes the place of the first.

        Parameters
        ----------
        mass, stiffness
            A rate by which velocities decay, and a retardation time of all beams.
        modal
            Damping ratios of the lowest modes that are no rigid motions, shape (k,).
        """
        with self._lock:
            self._damping, self._system = Damping(mass, stiffness, modal), None
        return self

    # other beams, other loads

    def _bare(self, beams):
        """A scene of other beams on which nothing acts that was added."""
        return type(self)(*beams, *self.bodies, *self.domains)

    def _on(self, beams):
        """The same on other beams."""
        if (not isinstance(beams, (list, tuple)) or len(beams) != len(self.beams)
                or not all(isinstance(beam, Beam) for beam in beams)):
            raise InputError(f"beams must be a list of {len(self.beams)} Beam(s), got "
                             f"{shown(beams)}")
        scene = self._bare(beams)
        added = self.items[len(scene._entries):]
        changed = {k for k, (a, b) in enumerate(zip(self.beams, beams)) if a.mesh is not b.mesh}
        for item in added if changed else ():
            which = getattr(item, "beam", None)
            for name in ("boundary", "at", "side"):
                place = getattr(item, name, None)
                if not on_other_mesh(place) and (which is None or self.layout.number(
                        which) in changed):
                    raise InputError(f"{item!r} is at facets given by numbers, {place!r}, and "
                                     "cannot be put on another mesh: give names or functions")
        scene._damping, scene._units = self._damping, self._units
        scene._put(*added)
        return scene
