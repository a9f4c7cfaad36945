"""The description of a scene: beams, rigid bodies and items, and methods that add items."""

import inspect
from collections.abc import Callable
from copy import copy
from threading import RLock
from typing import TYPE_CHECKING, Any, Concatenate, NamedTuple, ParamSpec, TypeVar


from ..actions.bound import BoundConstraint, BoundForce
from ..actions.eigenstrain import EigenStrain, Temperature
from ..actions.energy import Energy
from ..actions.form_load import FormLoad
from ..actions.forces import (Control, Drag, ForceElement, Foundation, PointMass, Spring,
                              TorsionalSpring)
from ..actions.item import Item
from ..actions.joints import Hinge, Joint, Motor, Weld, get_joint
from ..actions.joints.sliders import slider
from ..actions.loads import EndMoment, LineLoad, Load, Pressure, Traction, Weight
from ..actions.point_force import FollowerForce, PointForce
from ..actions.obstacles import Obstacle
from ..actions.pairs import BodyContact
from ..actions.places import joined
from ..actions.supports import Clamp, Pin, Support
from ..beam import Beam, Domain, Layout, RigidBody, WhichMember
from ..core import ArrayLike, NearMisses, TimeFunction, refuse, require_text
from ..materials.damping import Damping
from ..mesh.places import on_other_mesh

if TYPE_CHECKING:
    from typing_extensions import Self

P = ParamSpec("P")
M = TypeVar("M", bound="Model")


def adds(name: str, item: Callable[P, Item]) -> Callable[Concatenate[M, P], M]:
    """A method of a scene that adds an item of a class, with the arguments of the class."""
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


#: Names of units that are no units of force, or of length.
OTHER = {"force": ("m", "cm", "mm", "um", "µm", "nm", "km", "in", "ft"),
         "length": ("N", "kN", "MN", "mN", "uN", "µN", "nN", "lb", "lbf", "kip", "kgf", "dyn")}


class Entry(NamedTuple):
    """An unbound item, with beams by number, and its bound parts."""

    given: Item
    bound: tuple[Any, ...]


class Model(NearMisses):
    """Beams, rigid bodies, and items: the description of a :class:`Scene`.

    Other Parameters
    ----------------
    name
        Name of the joint in messages.
    """

    def __init__(self, *beams: Any) -> None:
        if len(beams) == 1 and isinstance(beams[0], (list, tuple)):
            beams = tuple(beams[0])
        #: Beams, bodies and their numbering of degrees of freedom.
        self.layout = Layout(*beams)
        self._entries: tuple[Entry, ...] = ()
        self._fixed: dict[int, float] = {}
        self._damping: Damping | None = None
        self._units: tuple[str, str] | None = None
        self._system: Any = None
        self._lock = RLock()

    def __getstate__(self):
        """Without the equations, which are rebuilt."""
        return {name: value for name, value in vars(self).items() if name != "_lock"} | {
            "_system": None}

    def __setstate__(self, state):
        vars(self).update(state, _lock=RLock())

    def __copy__(self):
        other = object.__new__(type(self))
        vars(other).update(vars(self), _lock=RLock(), _system=None)
        return other

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
        """All items in the order in which they were added."""
        return tuple(entry.given for entry in self._entries)

    @property
    def loads(self) -> tuple[Load, ...]:
        """The loads, bound to the beams: a tuple of :class:`~skfem_ancf.actions.loads.Load`."""
        return self._all(Load)

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints, bound to the beams: a tuple of :class:`~skfem_ancf.actions.joints.Joint`."""
        return self._all(BoundConstraint)

    @property
    def elements(self) -> tuple[ForceElement, ...]:
        """The bound force elements: springs, foundations, masses, obstacles, user-defined ones."""
        return self._all(BoundForce)

    def _all(self, kind):
        return tuple(one for entry in self._entries for one in entry.bound if isinstance(one, kind))

    def beam(self, beam: WhichMember = None) -> Any:
        """The Beam or RigidBody for itself, a name, a number, or None for the only beam."""
        return self.layout.beam(beam)

    def _bound(self, item):
        """An entry; the scene is not changed."""
        refuse(not isinstance(item, Item), "the item must be an Item, as a Spring, a Load or a "
               "Joint, got {!r}: derive yours from skfem_ancf.Item", item)
        bound = [part for one in item.expand(self.layout) for part in one.bound_on(self.layout)]
        numbers = {name: number for name, value in vars(item).items()
                   if isinstance(value, (Beam, tuple, list)) and name[0] != "_"
                   and (number := self._numbered(value)) is not value}
        if numbers:
            item = item._with(**numbers)
            item._freeze()
        return Entry(item, tuple(bound))

    def _numbered(self, value):
        """Replace Beams by numbers, in tuples and lists too."""
        if isinstance(value, Beam):  # rigid bodies stay the same on other meshes
            return self.layout.number(value)
        if not isinstance(value, (tuple, list)):
            return value
        inner = [self._numbered(v) for v in value]
        return value if all(a is b for a, b in zip(inner, value)) else tuple(inner)

    def _put(self, *items):
        """Bind all items before adding them, so that errors leave the scene unchanged."""
        # Returns the bound parts.
        with self._lock:
            entries, fixed = [self._bound(item) for item in items], dict(self._fixed)
            bound = [one for entry in entries for one in entry.bound]
            for one in bound:
                if isinstance(one, Support):
                    one.hold(fixed)
                elif isinstance(one, EigenStrain):
                    others = [x for x in (*self.loads, *bound) if x is not one and isinstance(
                        x, EigenStrain) and x.beam is one.beam]
                    refuse(one.grows and others, "the material of {!r} is nonlinear, so "
                           "eigenstrains cannot be superposed: give their sum as one, a function "
                           "of (x, y), or such a function times one of t", one.beam)
            self._entries, self._fixed, self._system = self._entries + tuple(entries), fixed, None
        return bound

    def add(self, item: Item) -> "Self":
        """Add a load, a support, a joint, a force element, or a user-defined item.

        Parameters
        ----------
        item
            An :class:`~skfem_ancf.Item`, as ``PointForce((0, -1e-3), at=(1, 0))``. The scene binds
            a copy to its beams, again for every other mesh, as in ``solve_static(adapt=...)``.

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

    def units(self, force: str, length: str) -> "Self":
        """Set the units of the scene for pictures, files and tables.

        Numbers do not change: use consistent units, as N, mm, MPa and tonnes.

        Parameters
        ----------
        force, length
            As "N" and "mm", with stresses in MPa; other units give a compound, as "lbf/in²".

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line([0, 500, 1000], height=10), ElementBeamANCF(2),
        ...                    StVenantKirchhoff(E=2.1e5, nu=0.3), width=10)).units("N", "mm")
        >>> state = scene.clamp("left").point_force((0, -5), at=(1000, 0)).solve_static()
        >>> ax = state.plot("S_xx")                                 # $S_{xx}$ (MPa)
        """
        for name, value in (("force", force), ("length", length)):
            refuse(not require_text(name, value) or value in OTHER[name], "{} must be the name of "
                   "its unit, got {!r}: the order is units(force, length)", name, value)
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
    contact = adds("contact", BodyContact)

    # joints

    def joint(self, joint: str | Joint, **options: Any) -> Joint:
        """Add a joint, enforced by Lagrange multipliers.

        In statics the time of a prescribed motion is the load factor. A joint that only fixes
        degrees of freedom is eliminated like a support.

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
            * ``"angle", at="left", angle=function``: a section rotates by ``angle(t)``,
            * ``"plane", at="left"``: a section stays in its plane,
            * ``"sleeve", at=(a, point), on=b``, ``"slot", at=(a, point), on=body, direction=d``:
              a point slides along a beam, or along a line of a body, see :meth:`slider`.
        **options
            Arguments of the joint's class, for a name.

        Raises
        ------
        NameUnknown
            If the joint's name is not known.
        SupportError
            When solving, if joints contradict each other or the supports.
        """
        return self._put(get_joint(joint, **options))[0]

    def hinge(self, *places: Any, name: str | None = None) -> Joint:
        """Join material points of beams and rigid bodies, with free rotation.

        Parameters
        ----------
        *places
            One point (x, y), at which two or more beams or bodies meet; or a place for each of
            them: (beam, (x, y)) with a Beam, a RigidBody, a name or a number, (beam, "right"), a
            point that only one of them has, ("ground", (x, y)), or a RigidBody for its centre of
            mass.

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
        """Join beams and rigid bodies rigidly: sections keep their relative angles.

        Points may be inside elements: the end of a beam can be welded to the middle of another, and
        several beams can meet in a point.

        Parameters
        ----------
        *places
            As for :meth:`hinge`; (beam, "right") is the axis at that end. For a
            :class:`~skfem_ancf.Domain` a boundary, as (domain, "right"), which is bonded to the end
            or side of a beam, as (beam, "left"), or to a rigid body.
        apart
            Allow a distance between the points in the reference configuration, which the weld
            closes.
        """
        return self.joint(Weld(*joined(self.layout, places), name, apart))

    def slider(self, at: Any, on: WhichMember, direction: ArrayLike | None = None,
               angle: bool = False, name: str | None = None) -> Joint:
        """A material point slides along the axis of a beam, or along a line of a rigid body.

        Parameters
        ----------
        at
            The point: (x, y) if only one beam or body has it, (beam, (x, y)) with a Beam, a
            RigidBody, a name or a number, ("ground", (x, y)), a RigidBody for its centre of mass.
        on
            The beam along whose axis it slides; or a RigidBody or "ground".
        direction
            Initial direction of the line of a body or the ground, shape (2,).
        angle
            Keep the angle between the section at the point and the axis or the line: the slider
            transmits a moment.
        """
        return self.joint(slider(self.layout, at, on, direction, angle, name))

    def motor(self, at: Any, angle: TimeFunction = None, speed: Any = None, torque: Any = None,
              other: Any = None) -> Joint | Load:
        """Add a :class:`~skfem_ancf.Motor`; returns its joint, or the load for a torque.

        Parameters
        ----------
        at, angle, speed, torque, other
            As for :class:`~skfem_ancf.Motor`.
        """
        return self._put(Motor(at, angle, speed, torque, other))[0]

    def damping(self, mass: float = 0.0, stiffness: float = 0.0, modal: ArrayLike = ()) -> "Self":
        """Rayleigh and modal damping of the whole scene, which replaces an earlier one.

        A mode of the angular frequency omega has the damping ratio ``mass / (2 omega) + stiffness
        omega / 2``. For damping of one material use ``Beam(..., damping=KelvinVoigt(time))``.

        Parameters
        ----------
        mass, stiffness
            Mass-proportional rate (1 / time), and a retardation time of all beams.
        modal
            Damping ratios of the lowest flexible modes, shape (k,).
        """
        with self._lock:
            self._damping, self._system = Damping(mass, stiffness, modal), None
        return self

    # other beams, other loads

    def _bare(self, beams):
        return type(self)(*beams, *self.bodies, *self.domains)

    def _on(self, beams):
        """The same on other beams."""
        refuse(not isinstance(beams, (list, tuple)) or len(beams) != len(self.beams)
                   or not all(isinstance(beam, Beam) for beam in beams), "beams must be a list of "
               "{} Beam(s), got {!r}", len(self.beams), beams)
        scene = self._bare(beams)
        added = self.items[len(scene._entries):]
        changed = {k for k, (a, b) in enumerate(zip(self.beams, beams)) if a.mesh is not b.mesh}
        for item in added if changed else ():
            which = getattr(item, "beam", None)
            for name in ("boundary", "at", "side"):
                place = getattr(item, name, None)
                refuse(not on_other_mesh(place) and (which is None or self.layout.number(
                            which) in changed), "{!r} is at facets given by numbers, {!r}, and "
                       "cannot be put on another mesh: give names or functions", item, place)
        scene._damping, scene._units = self._damping, self._units
        scene._put(*added)
        return scene

    def _rebuilt(self, beams, bodies, items):
        """The same on other beams, with other bodies and items in the same order."""
        other = copy(self)
        other.layout = Layout(*self.beams, *bodies, *self.domains)
        other._entries = tuple(entry._replace(given=item)
                               for entry, item in zip(self._entries, items))
        return other._on(beams)
