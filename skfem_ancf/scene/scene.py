"""A scene: beams, supports and loads, and what can be asked of them."""

from __future__ import annotations

from copy import copy
from functools import wraps
from itertools import accumulate
from threading import RLock
from typing import TYPE_CHECKING, Any

import numpy as np

from ..solvers import eigen
from ..actions.axial import FollowerForce, LineLoad
from ..beam.beam import Beam
from ..beam.layout import select_member
from ..results.checks import warn_of
from ..materials.damping import Damping
from ..results.arguments import configuration, displacement
from ..dynamics import choose_scheme, get_scheme
from ..dynamics.choice import RTOL
from ..dynamics.checkpoint import resume
from ..dynamics.integrate import follow, integrate
from ..dynamics.sensors import Sensor, locate
from ..actions.eigenstrain import EigenStrain, Temperature, products, require_alone, takes_time
from ..beam.masses import projected
from ..core.kept import cached_property
from ..actions.obstacles import Obstacle
from ..actions.forces import (Control, Drag, ForceElement, Foundation, PointMass, Spring,
                              TorsionalSpring, bind_force)
from ..core.errors import (ConvergenceError, InputError, Interrupted, StabilityWarning,
                           SupportError, ask_field, require_finite, require_finite_scalar,
                           require_label, require_option, require_options, require_positive, shown,
                           warn)
from ..actions.joints import Joint, bind_joint, get_joint
from ..actions.joints.base import both_of, is_ground, members_at, named_place, nearest_of
from ..actions.joints.prescribed import Turned
from ..actions.loads import (EndMoment, FormLoad, Load, PointForce, Pressure, Traction, Weight,
                             bind_load)
from ..results.path import CriticalPoint, Path
from ..mesh.places import as_point, node_of, on_other_mesh
from .plan import make_plan
from ..results.state import State
from ..beam.rigid import RigidBody, on_body
from ..solvers import continuation, newton
from .adapt import solve_adaptive
from ..actions.supports import Support
from ..equations.system import System
from ..equations.linearised import linear_external_force, linear_force

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import ArrayLike
    from skfem.assembly import LinearForm

    from ..dynamics.base import Scheme
    from ..dynamics.history import History
    from ..solvers.eigen import Buckling, Modes
    from ..actions.obstacles import Shape
    from .plan import Plan
    from ..core.types import Array, Place, StrPath, TimeFunction
    from ..beam.layout import WhichBeam, WhichMember

OPTIONS = ("method", "tol", "max_iterations", "first_step", "min_step", "progress", "stable")
#: How often a linear system is solved at most, with one factorisation; the coordinates up to which
#: it is more than once; and the correction relative to the displacement at which it is enough.
LINEAR_SOLVES, SOLVED_AGAIN, CLOSE = 4, 50000, 1e-13


def _alone(method):
    """One thread at a time: a solution works in the arrays of the scene's system."""
    @wraps(method)
    def locked(self, *args, **kwargs):
        with self._lock:
            return method(self, *args, **kwargs)

    return locked


class _Things(tuple):
    """The loads or joints of a scene."""

    def append(self, thing):
        raise InputError("the loads and joints of a scene are not changed by hand: "
                         "scene.add(thing) takes a Load or a Joint of your own")

    extend = insert = remove = clear = append


class Scene:
    """Beams and rigid bodies with supports and loads.

    Methods that add a support or a load return the scene, so that they can be chained. In a
    scene of several beams they take ``beam=``: a Beam, its name or its number; many take a
    RigidBody there, too. Loads take ``amplitude=``: a function of time by which they are multiplied
    in :meth:`integrate`.

    Parameters
    ----------
    *beams
        One or more :class:`~skfem_ancf.Beam`, and :class:`~skfem_ancf.RigidBody` among them. Bodies
        are numbered behind the beams.

    Examples
    --------
    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
    >>> mesh = MeshBeam.init_line(np.linspace(0, 1, 17), height=0.01)
    >>> material = StVenantKirchhoff(E=2e8, nu=0.3, density=7800)
    >>> scene = Scene(Beam(mesh, ElementBeamANCF(3), material, width=0.01))
    >>> state = scene.clamp("left").gravity((0, -9.81)).solve_static()
    >>> state.converged, bool(-0.91 < state.displacement((1, 0))[1] < -0.88)
    (True, True)
    """

    def __init__(self, *beams: Beam | RigidBody | Sequence[Beam | RigidBody]) -> None:
        if len(beams) == 1 and isinstance(beams[0], (list, tuple)):
            beams = tuple(beams[0])
        for b in beams:
            if not isinstance(b, (Beam, RigidBody)):
                raise InputError(f"a scene is made of Beams and RigidBodies, got {shown(b)}")
        if not beams:
            raise InputError("a scene needs a Beam or a RigidBody at least, got none")
        names = [b.name for b in beams if b.name is not None]  # type: ignore[union-attr]
        if len(set(names)) < len(names) or len(set(map(id, beams))) < len(beams):
            raise InputError(f"the beams of a scene must be different, and so must their names: "
                             f"{names}")
        self._beams = tuple(b for b in beams if isinstance(b, Beam))
        self._bodies = tuple(b for b in beams if isinstance(b, RigidBody))
        self._lock = RLock()
        self._supports: tuple[Support, ...] = ()
        # (number of the beam, coordinate) -> displacement
        self._fixed: dict[tuple[int, int], float] = {}
        # pairs (as given, bound), those of loads with the number of the beam before them
        self._loads: tuple[tuple[int, Load, Load], ...] = ()
        self._joints: tuple[tuple[Joint, Joint], ...] = ()
        # number of the beam -> (as given, bound)
        self._velocities: dict[int, tuple[Any, Array]] = {}
        self._elements: tuple[tuple[ForceElement, ForceElement], ...] = ()
        self._damping: Damping | None = None
        self._sensors: dict[str, Sensor] = {}
        self._system: System | None = None

    def __getstate__(self):
        """What was given and bound: the equations are built again."""
        return {name: value for name, value in vars(self).items()
                if name not in ("_lock", "_system", "_places", "N")}

    def __setstate__(self, state):
        vars(self).update(state, _lock=RLock(), _system=None)

    def __copy__(self):
        other = object.__new__(type(self))
        its = vars(other)
        its.update(vars(self), _lock=RLock(), _system=None)  # none of the others changes
        its.pop("_places", None)
        its.pop("N", None)
        return other

    def __deepcopy__(self, memo):
        return copy(self)

    def __repr__(self):
        bodies = f"{len(self._bodies)} rigid bodies, " if self._bodies else ""
        return (f"<Scene of {len(self.beams)} beam(s), {bodies}{len(self._fixed)} fixed "
                f"coordinates, {len(self.loads)} load(s)>")

    def _repr_html_(self):
        from ..visuals.html import scene_html

        return scene_html(self)

    @property
    def beams(self) -> tuple[Beam, ...]:
        """The beams."""
        return self._beams

    @property
    def bodies(self) -> tuple[RigidBody, ...]:
        """The rigid bodies."""
        return self._bodies

    @property
    def members(self) -> tuple[Beam | RigidBody, ...]:
        """The beams, and behind them the rigid bodies: in the order of their numbers."""
        return *self._beams, *self._bodies

    @property
    def supports(self) -> tuple[Support, ...]:
        """What is held: a tuple of :class:`~skfem_ancf.actions.supports.Support`."""
        return self._supports

    @property
    def loads(self) -> tuple[Load, ...]:
        """The loads, bound to the beams: a tuple of :class:`~skfem_ancf.actions.loads.Load`."""
        return _Things(bound for _, _, bound in self._loads)

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints, bound to the beams: a tuple of :class:`~skfem_ancf.actions.joints.Joint`."""
        return _Things(bound for _, bound in self._joints)

    @property
    def elements(self) -> tuple[ForceElement, ...]:
        """The force elements, bound to the beams: springs, foundations, masses, those of your own.

        A tuple of :class:`~skfem_ancf.actions.forces.ForceElement`.
        """
        return _Things(bound for _, bound in self._elements)

    def beam(self, beam: WhichMember = None) -> Any:
        """The Beam or RigidBody meant by itself, a name, a number, or None for the only beam."""
        return self.members[self._number(beam)]

    @cached_property
    def _places(self) -> dict:
        """Number and first coordinate of each beam, by the identity of the object."""
        first = accumulate((b.N for b in self.members), initial=0)
        return {id(b): (k, n) for k, (b, n) in enumerate(zip(self.members, first))}

    def _number(self, beam):
        if beam is None and len(self._beams) + len(self._bodies) == 1:
            return 0
        if isinstance(beam, Beam):  # without asking all the others
            found = self._places.get(id(beam))
            if found is not None:
                return found[0]
        if type(beam) is int and 0 <= beam < len(self._beams):
            return beam
        return self._places[id(select_member(self._beams, self._bodies, beam))][0]

    def _number_at(self, at, beam):
        """As :meth:`_number`; if no beam is named, that of the one that has the point."""
        if beam is None and at is not None and len(self.members) > 1:
            found = nearest_of(self, at, members_at(self, at))
            if len(found) == 1:
                return found[0]
        return self._number(beam)

    def _number_of_beam(self, beam):
        """As :meth:`_number`; raises InputError of a rigid body."""
        k = self._number(beam)
        if k >= len(self._beams):
            raise InputError(f"this is asked of beams, got {self.members[k]!r}")
        return k

    def offset(self, beam: WhichMember) -> int:
        """Number of the first coordinate of a beam or body among those of the scene."""
        return self._places[id(self.beam(beam))][1]

    @cached_property
    def N(self) -> int:
        """Number of coordinates of the scene."""
        return sum(b.N for b in self.members)

    # what it is made of

    def _put(self, supports=(), loads=(), joints=(), velocities=(), elements=()):
        """Bind everything, then keep it: what fails leaves the scene as it was.

        Loads come as (number of the beam, load), velocities as (number of the beam, v).
        """
        with self._lock:
            fixed = dict(self._fixed)
            for support in supports:
                support.bind(self.members[support.beam], fixed)
            loads = tuple((k, load, bind_load(load, self.members[k])) for k, load in loads)
            require_alone([(k, load) for k, _, load in self._loads + loads])
            bound = [bind_joint(joint, self) for joint in joints]
            joints = tuple(zip(map(self._portable, joints), bound))
            velocities = {k: (v, self._bind_velocity(k, v)) for k, v in velocities}
            bound = [bind_force(element, self) for element in elements]
            elements = tuple(zip(map(self._portable, elements), bound))
            self._fixed, self._supports = fixed, self._supports + tuple(supports)
            self._loads, self._joints = self._loads + loads, self._joints + joints
            self._elements = self._elements + elements
            self._velocities = {**self._velocities, **velocities}
            if supports or loads or joints or elements:
                self._system = None
        return self

    def _portable(self, joint):
        """A copy of a joint as it was given, with beams by number: it fits other meshes."""
        joint = joint._unsealed()
        for name, value in vars(joint).items():
            vars(joint)[name] = self._numbered(value)
        joint._seal()
        return joint

    def _numbered(self, value):
        """The number of a Beam, tuples and lists with numbers in place of them, or the value."""
        if isinstance(value, Beam):  # rigid bodies stay the same on other meshes
            return self._number(value)
        if not isinstance(value, (tuple, list)):
            return value
        inner = [self._numbered(v) for v in value]
        return value if all(a is b for a, b in zip(inner, value)) else tuple(inner)

    def add(self, thing: Load | Joint | ForceElement) -> Scene:
        """Add a load, a joint or a force element, of the package's or of your own.

        Parameters
        ----------
        thing
            A :class:`~skfem_ancf.actions.loads.Load`, a :class:`~skfem_ancf.actions.joints.Joint`
            or a :class:`~skfem_ancf.actions.forces.ForceElement`. The scene keeps it as it is now,
            and binds a copy to its beams; on another mesh, as for ``solve_static(adapt=...)``, it
            is bound again.

        Returns
        -------
        Scene
            Itself. Ask a State or History for the force of a joint with ``joint_force(thing)``.

        Raises
        ------
        InputError
            If it is neither, or does not keep to the interface.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> from skfem_ancf.actions.loads import Load
        >>> class TipForce(Load):
        ...     def force(self, u):
        ...         out = np.zeros(self.beam.N)
        ...         out[-self.beam.nd + 1] = -1e-3
        ...         return out
        >>> scene = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.01),
        ...                    ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3), width=0.01))
        >>> len(scene.clamp("left").add(TipForce()).loads)
        1
        """
        if isinstance(thing, Joint):
            return self._put(joints=[thing])
        if isinstance(thing, Load):
            return self._put(loads=[(self._number(thing.beam), thing)])
        if isinstance(thing, ForceElement):
            return self._put(elements=[thing])
        raise InputError(f"a scene takes a Load or a Joint or a ForceElement, got {shown(thing)}: "
                         "derive yours from skfem_ancf.actions.loads.Load, "
                         "skfem_ancf.actions.joints.Joint or "
                         "skfem_ancf.actions.forces.ForceElement")

    # supports

    def clamp(self, boundary: Place, beam: WhichBeam = None, thickness: str = "fixed") -> Scene:
        """Weld a face, or hold it as a plane.

        Parameters
        ----------
        boundary
            A place: the name of a boundary; a point (x, y) of the stress-free body, which means
            the section of a node; a function of the points x that returns truth values; or
            numbers of facets as an array of integers. See
            :func:`skfem_ancf.mesh.places.facets_of`. A RigidBody is held fast as a whole.
        beam
            The beam, its name or its number, in a scene of several.
        thickness
            "fixed": the position of every material point of the face is fixed, that is ``r`` and
            the section coordinates at the node; the slope ``r_X``, a strain measure there, stays
            free. "free": ``r`` is fixed and the section stays in its plane, but may get thinner
            or thicker there. With nu not zero a welded face causes a boundary layer as long as
            the beam is high, which long elements exaggerate; the plane does not.

        Returns
        -------
        Scene
            Itself.
        """
        boundary, beam = on_body(boundary, beam)
        k = self._number(beam)
        beam = b = self.members[k]
        require_option("thickness", thickness, ("fixed", "free"))
        if isinstance(b, RigidBody):
            return self._put([Support(k, boundary)])
        welded = b.has_sections if thickness == "fixed" else None
        if welded:
            return self._put([Support(k, boundary, tuple(b.element.welded), welded=True)])
        return self._put([Support(k, boundary, "r", welded=welded)],
                         joints=[get_joint("plane", at=boundary, beam=beam, name="of a clamp")])

    def pin(self, boundary: Place, beam: WhichBeam = None) -> Scene:
        """Fix the position of the axis; the section may turn.

        Parameters
        ----------
        boundary
            A place, as for :meth:`clamp`; of a rigid body a point, or None for its centre of mass.
        beam
            The beam, its name or its number, in a scene of several; or a RigidBody.

        Returns
        -------
        Scene
            Itself.
        """
        boundary, beam = on_body(boundary, beam)
        k = self._number(beam)
        member = self.members[k]
        if isinstance(member, RigidBody):
            at = tuple(map(float, member.place(boundary)))
            return self._put(joints=[get_joint("hinge", beams=("ground", k), at=at,
                                               name="of a pin")])
        return self._put([Support(k, boundary, "r", on_axis=True)])

    def fix(self, boundary: Place, names: str | Sequence[str] | None = None,
            displacement: float = 0.0, beam: WhichBeam = None) -> Scene:
        """Fix coordinates by their scikit-fem names.

        Parameters
        ----------
        boundary
            A place, as for :meth:`clamp`.
        names
            As ``["r^1", "r_Y0^2"]``; ``"r"`` means both components; None means all.
        displacement
            Their displacement at full load, in the unit of the coordinate; it grows with the load.
        beam
            The beam, its name or its number, in a scene of several.

        Returns
        -------
        Scene
            Itself.

        Raises
        ------
        NameUnknown
            If a name is not known; the message lists the known ones.
        SupportError
            If a coordinate is given two displacements.
        """
        if isinstance(names, (list, set, frozenset, np.ndarray)):
            names = tuple(names)
        if callable(displacement):
            raise InputError("displacement must be a number, got a function: what moves by a "
                             'function of time is scene.joint("position", at=..., r=...), or '
                             '"angle"')
        return self._put([Support(self._number(beam), boundary, names,
                                  require_finite_scalar("displacement", displacement))])

    def joint(self, joint: str | Joint, **options: Any) -> Joint:
        """Add a joint, held by Lagrange multipliers.

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

        Returns
        -------
        Joint
            Ask a State or History for its force with ``joint_force(joint)``.

        Raises
        ------
        NameUnknown
            If the joint's name is not known.
        SupportError
            When solving, if joints repeat or contradict each other or the supports.

        Notes
        -----
        In statics the time of a motion is the load factor. A joint that only fixes coordinates
        is eliminated like a support.
        """
        self._put(joints=[get_joint(joint, **options)])
        return self._joints[-1][1]

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

        Returns
        -------
        Joint
            A :class:`~skfem_ancf.actions.joints.Hinge`; ask a State or History for its force with
            ``joint_force(joint)``.

        Raises
        ------
        InputError
            If a place is of no beam and no body, or of several.

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
        beams, at = self._joined(places)
        return self.joint("hinge", beams=beams, at=at, name=name)

    def weld(self, *places: Any, name: str | None = None, apart: bool = False) -> Joint:
        """Join beams and rigid bodies: points stay together, and sections keep their angles.

        The point of a beam may be anywhere, inside of an element too: so the end of one is welded
        to the middle of another, or several meet in one point.

        Parameters
        ----------
        *places
            As for :meth:`hinge`; (beam, "right") is the axis at that end.
        name
            What messages call the joint.
        apart
            Allow that the points are apart in the stress-free state: the weld draws them together.

        Returns
        -------
        Joint
            A :class:`~skfem_ancf.actions.joints.Weld`.

        Raises
        ------
        InputError
            If a place is of no beam and no body, or of several, or the points are apart.
        """
        beams, at = self._joined(places)
        return self.joint("weld", beams=beams, at=at, name=name, apart=apart)

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

        Returns
        -------
        Joint
            A :class:`~skfem_ancf.actions.joints.Sleeve`, whose ``distance(state.u)`` says where
            along the axis the point is, or a :class:`~skfem_ancf.actions.joints.Slot`.

        Raises
        ------
        InputError
            If the point is not on the axis.
        ConvergenceError
            When solving, if the point leaves the beam at an end.
        """
        at = tuple(named_place(self, at))
        if is_ground(on) or isinstance(self.beam(on), RigidBody):
            if direction is None:
                raise InputError(f"a slider on {shown(on)} needs the direction of its line")
            return self.joint("slot", at=at, on=on, direction=direction, angle=angle, name=name)
        if direction is not None:
            raise InputError("a slider on a beam moves along its axis: give no direction")
        return self.joint("sleeve", at=at, on=on, angle=angle, name=name)

    def motor(self, at: Any, angle: TimeFunction = None, speed: Any = None, torque: Any = None,
              other: Any = None) -> Joint | Load:
        """Turn a rigid body or a section: by a given angle, at a given speed, or with a torque.

        Parameters
        ----------
        at
            A RigidBody, or (beam, place) with a place that is one section, as (0, "left").
        angle
            The angle from that of the start as a function of time, in radians.
        speed
            Angular velocity, a number or a function of time: the angle is its integral from the
            time 0.
        torque
            Moment, a number or a function of time; a function counts as one in statics, as every
            amplitude.
        other
            What the motor stands on, as ``at``: the angle is measured from it, and it takes the
            torque with the opposite sign. The ground by default.

        Returns
        -------
        Joint or Load
            Of a joint ``joint_force`` is the moment of the motor.

        Raises
        ------
        InputError
            Unless one of angle, speed and torque is given.

        Notes
        -----
        A torque that depends on the state is one of ``scene.control``.
        """
        given = [name for name, value in (("angle", angle), ("speed", speed), ("torque", torque))
                 if value is not None]
        if len(given) != 1:
            raise InputError("a motor has an angle, a speed or a torque: give one of them, got "
                             f"{given or 'none'}")
        at = both_of("at", at)
        if torque is not None:
            return self._torque(at, torque, other)
        if speed is not None:
            angle = Turned(speed)
        if other is None:
            return self.joint("angle", beam=at[0], at=at[1], angle=angle)
        return self.joint("turn", at=at, other=other, angle=angle)

    def _torque(self, at, torque, other):
        """Moments of a motor; the first of them."""
        M, amplitude = (1.0, torque) if callable(torque) else (
            require_finite_scalar("torque", torque), None)
        loads, places, couple = [], [(at, 1.0)], None
        if other is not None:
            couple = object()
            places.append((both_of("other", other), -1.0))
        for (which, place), sign in places:
            k = self._number(which)
            loads.append((k, EndMoment(self.members[k], place, sign * M, amplitude, couple)))
        n = len(self._loads)
        return self._put(loads=loads)._loads[n][2]

    def _joined(self, places):
        """Beams and places of a joint."""
        if len(places) == 1:
            at = require_finite("the point of a joint", places[0], (2,))
            found = members_at(self, at)
            if len(found) < 2:
                names = [self.members[k].name or k for k in found]
                raise InputError(f"a joint at {shown(places[0])} needs two beams or rigid bodies "
                                 f"there, found {names}: name a place of each, as "
                                 "(beam, (x, y)) or ('ground', (x, y))")
            return found, tuple(map(float, at))
        pairs = [named_place(self, place) for place in places]
        return [which for which, _ in pairs], [at for _, at in pairs]

    # loads

    def gravity(self, g: ArrayLike, beam: WhichBeam = None,
                amplitude: TimeFunction = None) -> Scene:
        """Weight of every beam and rigid body, or of one.

        Parameters
        ----------
        g
            Acceleration, shape (2,), as ``(0, -9.81)``.
        beam
            The beam or the rigid body, its name or its number; None for all.
        amplitude
            A function of time by which the force is multiplied in a motion.

        Returns
        -------
        Scene
            Itself.
        """
        load = Weight(g, None, amplitude)
        beams = range(len(self.members)) if beam is None else [self._number(beam)]
        return self._put(loads=[(k, load) for k in beams])

    def point_force(self, force: ArrayLike, at: ArrayLike, beam: WhichBeam = None,
                    amplitude: TimeFunction = None) -> Scene:
        """A dead force on a material point.

        Parameters
        ----------
        force
            The force, shape (2,).
        at
            The point: its place (x, y) in the stress-free body, or "right" for the axis at that
            end; of a rigid body also None, for its centre of mass.
        beam
            The beam, its name or its number, where several have the point; or a RigidBody.
        amplitude
            A function of time by which the force is multiplied in a motion.

        Returns
        -------
        Scene
            Itself.
        """
        at, beam = on_body(at, beam)
        k = self._number_at(at, beam)
        return self._put(loads=[(k, PointForce(force, at, None, amplitude))])

    def follower_force(self, force: ArrayLike, at: ArrayLike, beam: WhichBeam = None,
                       amplitude: TimeFunction = None, line: int | None = None) -> Scene:
        """A force on a material point that turns with the tangent of the axis, or with a body.

        Parameters
        ----------
        force
            The force in the stress-free state, shape (2,).
        at
            The point: its place (x, y) in the stress-free body, shape (2,).
        beam
            The beam, its name or its number, where several have the point.
        amplitude
            A function of time by which the force is multiplied in a motion.
        line
            The number of the line whose tangent it is, of a frame where lines meet; of another
            scene that of the chain of elements of the beam.

        Returns
        -------
        Scene
            Itself.

        Raises
        ------
        InputError
            If the axes of several lines are nearest to the point and none is named.
        """
        at, beam = on_body(at, beam)
        chain = None
        if line is not None:
            beam, chain = self.system.points.chain_of(line, beam)
        k = self._number_at(at, beam)
        one = self.members[k]
        if chain is None and isinstance(one, Beam) and not one.mesh.is_chain:
            self.system.points.find(as_point(at, one.mesh), one, ask=True)
        return self._put(loads=[(k, FollowerForce(force, at, None, amplitude, chain))])

    def line_load(self, force: ArrayLike | Callable[[Array], Array], beam: WhichBeam = None,
                  amplitude: TimeFunction = None) -> Scene:
        """A dead force per length of the axis.

        Parameters
        ----------
        force
            Force per length of the stress-free axis: constant, shape (2,), or a function of the
            points x (2, ...) of the axis that returns (2, ...).
        beam
            The beam, its name or its number, in a scene of several.
        amplitude
            A function of time by which the force is multiplied in a motion.

        Returns
        -------
        Scene
            Itself.
        """
        return self._put(loads=[(self._number(beam), LineLoad(force, None, amplitude))])

    def traction(self, boundary: Place, t: ArrayLike | Callable[[Array], Array],
                 beam: WhichBeam = None, amplitude: TimeFunction = None) -> Scene:
        """A dead traction on a surface, per area of the stress-free body.

        On a cable it acts on the axis, without the moment by the distance of the face: a
        ModelWarning says how large that is where it is more than a hundredth.

        Parameters
        ----------
        boundary
            A place, as for :meth:`clamp`.
        t
            Force per area: constant, shape (2,), or a function of the points x (2, ...) that
            returns (2, ...).
        beam
            The beam, its name or its number, in a scene of several.
        amplitude
            A function of time by which the force is multiplied in a motion.

        Returns
        -------
        Scene
            Itself.
        """
        return self._put(loads=[(self._number(beam), Traction(boundary, t, None, amplitude))])

    def pressure(self, boundary: Place, p: float, beam: WhichBeam = None,
                 amplitude: TimeFunction = None) -> Scene:
        """A pressure on a surface that stays normal to it as it deforms.

        On the bottom and the top of a cable it acts on its axis, as long as that is: on a curve
        of radius R its resultant is off by h / (2 R) of it.

        Parameters
        ----------
        boundary
            A place, as for :meth:`clamp`.
        p
            Force per area of the deformed surface; positive pushes.
        beam
            The beam, its name or its number, in a scene of several.
        amplitude
            A function of time by which the force is multiplied in a motion.

        Returns
        -------
        Scene
            Itself.
        """
        k = self._number_of_beam(beam)
        load = Pressure(self._beams[k], boundary, require_finite_scalar("p", p), amplitude)
        return self._put(loads=[(k, load)])

    def temperature(self, change: Any, beam: WhichBeam = None,
                    amplitude: TimeFunction = None) -> Scene:
        """A change of the temperature: materials expand by their ``thermal_expansion``.

        Parameters
        ----------
        change
            In degrees from the stress-free state: a number, or a function of material coordinates
            x, the parameter of the axis, and y, the distance from it, arrays of one shape; or of
            (x, y, t), which statics take at t = 1.
        beam
            The beam, its name or its number, in a scene of several.
        amplitude
            A function of time by which it is multiplied in a motion.

        Returns
        -------
        Scene
            Itself.

        Raises
        ------
        InputError
            If no material of the beam expands.

        Examples
        --------
        >>> from skfem_ancf import (Beam, ElementBeamANCFCubic, MeshBeam, Scene, Section,
        ...                         StVenantKirchhoff)
        >>> steel = StVenantKirchhoff(E=2e11, nu=0.3, thermal_expansion=12e-6)
        >>> brass = StVenantKirchhoff(E=1e11, nu=0.3, thermal_expansion=19e-6)
        >>> strip = Section.layers((0.001, steel), (0.001, brass), width=0.01)
        >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 0.2, 9), height=0.002),
        ...             ElementBeamANCFCubic(2), section=strip)
        >>> state = Scene(beam).clamp("left").temperature(100.0).solve_static()
        >>> float(round(state.displacement((0.2, 0.0))[1], 3))  # brass is at the top
        -0.01
        """
        k, at = self._number(beam), self._beams[self._number(beam)]
        if not takes_time(change):
            return self._put(loads=[(k, Temperature(change, None, amplitude))])
        return self._put(loads=[(k, Temperature(f, None, c.times(amplitude)))
                                for f, c in products("the temperature", change, at)])

    def eigenstrain(self, xx: Any = None, yy: Any = None, xy: Any = None, beam: WhichBeam = None,
                    amplitude: TimeFunction = None) -> Scene:
        """A strain that the body would have without stress: of growth, muscles, drying, voltage.

        The stress is that of what the strain is more: of E - E0. In the beam's frame; of a cable
        ``xx`` alone acts.

        Parameters
        ----------
        xx, yy, xy
            eps_xx, eps_yy and eps_xy: numbers, or functions of material coordinates (x, y), arrays
            of one shape, or of (x, y, t), which statics take at t = 1.
        beam
            The beam, its name or its number, in a scene of several.
        amplitude
            A function of time by which it is multiplied in a motion.

        Returns
        -------
        Scene
            Itself.

        Raises
        ------
        InputError
            If no component is given, if a function of (x, y, t) is no sum of few products of one
            of (x, y) and one of t, or if the beam has another stress-free strain, and a law that is
            not linear.
        """
        if xx is None and yy is None and xy is None:
            raise InputError("a stress-free strain has a component: give xx, yy or xy")
        k, at, loads = self._number(beam), self._beams[self._number(beam)], []
        given: dict[str, Any] = {}
        for name, value in (("xx", xx), ("yy", yy), ("xy", xy)):
            if takes_time(value):
                for f, c in products(f"eps_{name}", value, at):
                    part: dict[str, Any] = {name: f}
                    loads.append(EigenStrain(**part, amplitude=c.times(amplitude)))
            else:
                given[name] = value
        if not loads or any(value is not None for value in given.values()):
            loads.append(EigenStrain(**given, amplitude=amplitude))
        return self._put(loads=[(k, load) for load in loads])

    def moment(self, boundary: Place, M: float, beam: WhichBeam = None,
               amplitude: TimeFunction = None) -> Scene:
        """A moment on an end section, that turns with it, or on a rigid body.

        Parameters
        ----------
        boundary
            A place that is one section, as "right" or the point of a node; or a RigidBody.
        M
            The moment (force times length), counterclockwise.
        beam
            The beam, its name or its number, in a scene of several.
        amplitude
            A function of time by which the moment is multiplied in a motion.

        Returns
        -------
        Scene
            Itself.
        """
        boundary, beam = on_body(boundary, beam)
        k = self._number(beam)
        member = self.members[k]
        if not isinstance(member, RigidBody):
            node_of(member.mesh, boundary)  # raises MeshError unless it is one section
        load = EndMoment(member, boundary, require_finite_scalar("M", M), amplitude)
        return self._put(loads=[(k, load)])

    def load(self, form: LinearForm, boundary: Place | None = None, beam: WhichBeam = None,
             amplitude: TimeFunction = None) -> Scene:
        """Any scikit-fem ``LinearForm`` as a dead load.

        Parameters
        ----------
        form
            It is assembled once, on the stress-free body: it knows ``w.x``, ``w.h`` and, on a
            boundary, ``w.n``.
        boundary
            A place, as for :meth:`clamp`; None for the body.
        beam
            The beam, its name or its number, in a scene of several.
        amplitude
            A function of time by which the force is multiplied in a motion.

        Returns
        -------
        Scene
            Itself.
        """
        return self._put(loads=[(self._number(beam), FormLoad(form, boundary, None, amplitude))])

    # force elements

    def spring(self, k: Any, between: Sequence[Any], damping: Any = 0.0,
               length: float | None = None) -> Scene:
        """A spring between two points, with a dashpot along the same line.

        Parameters
        ----------
        k
            Stiffness (force per length), zero or positive; or a function of the elongation that
            returns the force, positive in tension; or a pair of that and its potential.
        between
            Two places, each (x, y): the material point there, or the point of the ground where no
            beam is; or (beam, (x, y)) with a Beam, a name or a number; or ("ground", (x, y)).
        damping
            Force per velocity, zero or positive; or a function of the rate of the length.
        length
            Length without force; that of the stress-free state by default.

        Returns
        -------
        Scene
            Itself.

        Raises
        ------
        InputError
            If a number is negative, no end is a point of a beam, or both are at one place.
        """
        return self._put(elements=[Spring(k, between, damping, length)])

    def torsional_spring(self, k: Any, at: Place, damping: Any = 0.0, beam: WhichBeam = None,
                         other: Any = None, angle: float = 0.0) -> Scene:
        """A moment against the angle by which a section turns, with a dashpot.

        Parameters
        ----------
        k
            Moment per angle, zero or positive; or a function of the angle that returns the moment;
            or a pair of that and its potential. The angle is taken in (-pi, pi] about ``angle``.
        at
            A place that is one section, as "right" or the point of a node.
        damping
            Moment per angular velocity, zero or positive; or a function of it.
        beam
            The beam, its name or its number, in a scene of several.
        other
            The section to which it is joined, as (beam, place), or a RigidBody; None: the ground.
        angle
            The angle without moment, from the stress-free state.

        Returns
        -------
        Scene
            Itself.
        """
        return self._put(elements=[TorsionalSpring(k, at, damping, beam, other, angle)])

    def control(self, law: Callable[..., Any], at: Any, kind: str = "force", other: Any = None,
                points: Mapping[str, Any] | None = None,
                sections: Mapping[str, Any] | None = None, dt: float | None = None,
                beam: WhichBeam = None) -> Scene:
        """A force or a moment as a function of time and of what is measured: a controller, a motor.

        Parameters
        ----------
        law
            A function ``law(t, name=..., ...)`` of the time, in statics the load factor, and of
            what is measured. It returns the force (2,), or the moment, counterclockwise.
        at
            Where it acts: a point as for :meth:`spring`, or for a moment a section as for
            :meth:`torsional_spring`, or (beam, place).
        kind
            "force" or "moment".
        other
            Where the opposite acts, as ``at``; None for the ground.
        points
            Names and places of points whose ``position`` and ``velocity`` (2,) the law is told.
        sections
            Names and places of sections whose ``angle`` from the stress-free state, in (-pi, pi],
            and ``rate`` it is told.
        dt
            Time between two samples: the law is asked at the start of a motion and every ``dt``
            from there, and its value is held; None to ask it at every time, in each iteration.
        beam
            The beam, its name or its number, in a scene of several, of places that name none.

        Returns
        -------
        Scene
            Itself.

        Raises
        ------
        InputError
            If a place is not known, or the law does not return what it should at the start.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> arm = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.05), ElementBeamCable(3),
        ...            StVenantKirchhoff(2e11, 0.3, 7800), width=0.05)
        >>> scene = Scene(arm).pin("left").control(
        ...     lambda t, joint: 4000.0 * (0.2 - joint.angle) - 300.0 * joint.rate, at="left",
        ...     kind="moment", sections={"joint": "left"})
        >>> history = scene.integrate(0.4, 5e-3, scheme="generalized-alpha")
        >>> x, y = history.position((1, 0))[-1]
        >>> bool(abs(np.arctan2(y, x) - 0.2) < 0.01)
        True
        """
        return self._put(elements=[Control(law, at, kind, other, points, sections, dt, beam)])

    def foundation(self, k: float, side: Place = "bottom", one_sided: bool = False,
                   damping: float = 0.0, beam: WhichBeam = None) -> Scene:
        """Winkler's foundation: springs along the normal of a side in the stress-free state.

        Parameters
        ----------
        k
            Force per area of the side and displacement, zero or positive.
        side
            A place of the boundary, as for :meth:`clamp`; of a cable the axis below it is held.
        one_sided
            It pushes and does not pull.
        damping
            Force per area and velocity, zero or positive.
        beam
            The beam, its name or its number, in a scene of several.

        Returns
        -------
        Scene
            Itself.
        """
        return self._put(elements=[Foundation(k, side, one_sided, damping, beam)])

    def drag(self, density: float, normal: float, tangential: float = 0.0,
             beam: WhichBeam = None) -> Scene:
        """A force against the velocity of the axis, quadratic in it.

        ``density width / 2 (normal |v_n| v_n + tangential |v_t| v_t)`` per length of the
        stress-free axis.

        Parameters
        ----------
        density
            Mass per volume of what is around, at rest; zero or positive.
        normal, tangential
            Coefficients across and along the axis, zero or positive.
        beam
            The beam, its name or its number; None for all.

        Returns
        -------
        Scene
            Itself.
        """
        beams = range(len(self._beams)) if beam is None else [self._number_of_beam(beam)]
        return self._put(elements=[Drag(density, normal, tangential, k) for k in beams])

    def point_mass(self, mass: float, at: ArrayLike, inertia: float = 0.0,
                   beam: WhichBeam = None) -> Scene:
        """A mass on a material point; gravity on its beam acts on it too.

        Parameters
        ----------
        mass
            Zero or positive.
        at
            The point: its place (x, y) in the stress-free body, shape (2,).
        inertia
            Moment of inertia about the point of what turns with the section of a node, zero or
            positive.
        beam
            The beam, its name or its number, in a scene of several.

        Returns
        -------
        Scene
            Itself.
        """
        return self._put(elements=[PointMass(mass, at, inertia, beam)])

    def obstacle(self, shape: Shape, friction: float = 0.0, stiffness: float | None = None,
                 beam: WhichBeam = None, **options: Any) -> Scene:
        """Something that the surface of beams cannot enter.

        Parameters
        ----------
        shape
            A :class:`~skfem_ancf.actions.obstacles.Circle`,
            :class:`~skfem_ancf.actions.obstacles.Line`,
            :class:`~skfem_ancf.actions.obstacles.Polygon` or
            :class:`~skfem_ancf.actions.obstacles.SignedDistance`.
        friction
            Coulomb's coefficient, zero or positive.
        stiffness
            Pressure per penetration, positive; ``E / height`` of each beam by default.
        beam
            The beam, its name or its number; all of the scene by default.
        **options
            Those of :class:`~skfem_ancf.actions.obstacles.Obstacle`: ``method``, ``position``,
            ``angle``, ``damping``, ``points``, ``width``, ``tolerance``.

        Returns
        -------
        Scene
            Itself. ``state.contact()`` says where it is touched and how hard.

        Raises
        ------
        InputError
            If a number is out of range, or the obstacle cuts a beam in the stress-free state.

        Examples
        --------
        A cantilever that rests on a pin:

        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> from skfem_ancf.actions.obstacles import Circle
        >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 17), height=0.01), ElementBeamANCF(2),
        ...             StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)
        >>> scene = Scene(beam).clamp("left").gravity((0, -9.81))
        >>> scene = scene.obstacle(Circle((0.8, -0.15), 0.1))
        >>> state = scene.solve_static()
        >>> bool(-0.06 < state.displacement((0.8, 0))[1] < -0.04)
        True
        """
        return self._put(elements=[Obstacle(shape, friction, stiffness, beam, **options)])

    # damping

    def damping(self, mass: float = 0.0, stiffness: float = 0.0,
                modal: ArrayLike = ()) -> Scene:
        """Damping of the whole scene: Rayleigh's, and of modes.

        A mode of the angular frequency omega gets the damping ratio ``mass / (2 omega) + stiffness
        omega / 2``. It acts in motions; materials may have their own, ``Beam(...,
        damping=KelvinVoigt(time))``. A second call takes the place of the first.

        Parameters
        ----------
        mass
            Factor on the mass matrix, in 1 / time: a force ``mass M v``, which resists rigid
            motions too.
        stiffness
            Factor on the stiffness, in units of time: that of a material that resists the rate of
            its strain, see :class:`~skfem_ancf.KelvinVoigt`, with its stiffness in the
            stress-free state. So it turns with the body and lets rigid motions alone.
        modal
            Damping ratios of the lowest modes of the stress-free scene, shape (k,). What resists
            is a constant matrix: for vibrations about the stress-free state, not for bodies that
            turn or bend far. Rigid motions, of frequency zero, have no ratio and are not counted:
            of a free beam the first ratio is that of its first bending.

        Returns
        -------
        Scene
            Itself.

        Raises
        ------
        InputError
            If a number is negative.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.01), ElementBeamCable(5),
        ...                    StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)).clamp("left")
        >>> history = scene.gravity((0, -9.81)).damping(mass=2.0).integrate(0.05, 1e-3)
        >>> bool(np.all(np.diff(history.dissipated) > 0))
        True
        """
        with self._lock:
            self._damping, self._system = Damping(mass, stiffness, modal), None
        return self

    # solution

    @property
    def system(self) -> System:
        """The discrete equations, built when first asked for."""
        with self._lock:
            if self._system is None:
                offsets = [n for _, n in self._places.values()]
                fixed = np.array([offsets[k] + d for k, d in self._fixed], dtype=int)
                values = np.array(list(self._fixed.values()), dtype=float)
                loads = [bound for _, _, bound in self._loads] + self._weights()
                self._system = System(self._beams, loads, fixed, values,
                                      [bound for _, bound in self._joints], self._damping,
                                      [bound for _, bound in self._elements], self._bodies,
                                      eigen.rest_modes)
            return self._system

    def _weights(self):
        """Loads by which gravity acts on point masses."""
        if not self._elements:
            return []
        masses = [x for x in self.elements if isinstance(x, PointMass) and x.mass]
        return [bind_load(PointForce(mass.mass * load.g, mass.at, None, load.amplitude),
                          self.members[k])
                for k, load, _ in self._loads if isinstance(load, Weight)
                for mass in masses if self._number(mass.beam) == k]

    def with_beams(self, beams: Sequence[Beam]) -> Scene:
        """The same supports, loads, joints, velocities and rigid bodies on other beams.

        Parameters
        ----------
        beams
            As many beams, in the same order; a boundary given by a name, a point or a function
            is found again on them.

        Raises
        ------
        InputError
            If a boundary was given by facet numbers, or velocities by coordinates, and the mesh
            of their beam is another one.
        MeshError
            If a place or a point is not found on the other mesh.
        """
        self._require_beams(beams)
        return self._put_on(Scene(*beams, *self._bodies), [joint for joint, _ in self._joints])

    def _require_beams(self, beams):
        if (not isinstance(beams, (list, tuple)) or len(beams) != len(self._beams)
                or not all(isinstance(beam, Beam) for beam in beams)):
            raise InputError(f"beams must be a list of {len(self._beams)} Beam(s), got "
                             f"{shown(beams)}")

    def _put_on(self, scene, joints):
        """What this scene has, on another of as many beams and the same bodies."""
        scene._damping, scene._sensors = self._damping, self._sensors
        changed = [a.mesh is not b.mesh for a, b in zip(self._beams, scene.beams)]
        changed += [False] * len(self._bodies)

        def require_portable(thing, moved):
            for name, value in vars(thing).items():
                if moved and name in ("boundary", "at", "side") and not on_other_mesh(value):
                    raise InputError(f"{thing!r} is at facets given by numbers, {value!r}, and "
                                     "cannot be put on another mesh: give names or functions")

        for support in self._supports:
            require_portable(support, changed[support.beam])
        for k, load, _ in self._loads:
            require_portable(load, changed[k])
        for joint in joints:
            require_portable(joint, any(changed))
        for element, _ in self._elements:
            require_portable(element, any(changed))
        for k, (v, _) in self._velocities.items():
            if changed[k] and not callable(v):
                raise InputError("initial_velocity was given by coordinates and cannot be put on "
                                 "another mesh: give names or functions")
        return scene._put(self._supports, [(k, load) for k, load, _ in self._loads],
                          joints,
                          [(k, v) for k, (v, _) in self._velocities.items()],
                          [element for element, _ in self._elements])

    def replace(self, beam: WhichBeam = None, loads: Sequence[Load] | None = None,
                **changes: Any) -> Scene:
        """The same scene with other loads, or with some arguments of one beam changed.

        Parameters
        ----------
        beam
            The beam that is changed, its name or its number; None for the only one.
        loads
            Loads in place of all that the scene has, as :meth:`add` takes them:
            ``[PointForce((0, -2), at=(1, 0))]`` of :mod:`skfem_ancf.actions.loads`. Those of
            ``scene.loads`` may be among them.
        **changes
            Arguments of :class:`Beam`, as ``material=...``, ``width=...`` or ``mesh=...``.

        Returns
        -------
        Scene
            Another one. A state of this scene is a good start for its
            ``solve_static(start=state)``, if the mesh has not changed.

        Raises
        ------
        NameUnknown
            If an argument or the beam is not known.
        InputError
            As :meth:`with_beams`.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> material = StVenantKirchhoff(E=2e8, nu=0.3, density=7800)
        >>> scene = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.01),
        ...                    ElementBeamCable(5), material, width=0.01))
        >>> state = scene.clamp("left").gravity((0, -9.81)).solve_static()
        >>> stiffer = scene.replace(material=material.replace(E=2.02e8))
        >>> new = stiffer.solve_static(start=state)
        >>> new.iterations < state.iterations
        True
        >>> bool(new.displacement((1, 0))[1] > state.displacement((1, 0))[1])
        True

        The same with half of the weight, and a force:

        >>> from skfem_ancf.actions.loads import PointForce, Weight
        >>> half = scene.replace(loads=[Weight((0, -4.9)), PointForce((0, 0.02), at=(1, 0))])
        >>> bool(half.solve_static().displacement((1, 0))[1] > state.displacement((1, 0))[1])
        True
        """
        with self._lock:
            scene = self
            if changes or loads is None:
                k = self._number_of_beam(beam)
                beams = list(self._beams)
                beams[k] = beams[k].replace(**changes)
                scene = self.with_beams(beams)
            return scene if loads is None else scene._loaded(loads)

    def _loaded(self, loads):
        """The same scene with other loads."""
        if not isinstance(loads, (list, tuple)) or not all(isinstance(x, Load) for x in loads):
            raise InputError("loads must be a list of Loads, as [PointForce((0, -2), at=(1, 0))], "
                             f"got {shown(loads)}; classes are in skfem_ancf.actions.loads")
        given = tuple((self._number(load.beam), load) for load in loads)
        bound = tuple((k, load, bind_load(load, self.members[k])) for k, load in given)
        require_alone([(k, load) for k, _, load in bound])
        other = self.__copy__()
        other._loads = bound
        return other

    @_alone
    def plan(self, kind: str = "static") -> Plan:
        """What a solution computes, keeps constant or skips, and why; ``print`` it.

        Parameters
        ----------
        kind
            "static", "linear" or "dynamic".

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line([0, 0.5, 1], height=0.01), ElementBeamANCF(2),
        ...                    StVenantKirchhoff(2e8, 0.0, 7800), width=0.01))
        >>> plan = scene.clamp("left").gravity((0, -9.81)).plan()
        >>> plan["mass"].status, plan["Poisson coupling"].status, plan["dead loads"].status
        ('skipped', 'skipped', 'constant')
        """
        return make_plan(self, kind)

    @_alone
    def solve_linear(self) -> State:
        """The small-displacement solution: one assembly, one factorisation.

        It is that of linear theory, in proportion to the load. All that is asked of the State is
        linear: the strain of small displacements and its stress, rotations, section forces,
        reactions on the undeformed body; the strain energy is ``u . K u / 2``. Loads keep the
        direction that they have without displacement. It says nothing of stability,
        ``state.stability`` is None, see :meth:`buckling`; ``state.checks`` says how far the body
        turns, which is to be small.

        Returns
        -------
        State
            Its ``base`` is the stress-free state.

        Raises
        ------
        SupportError
            If a rigid motion is free.
        InputError
            If the solution enters an obstacle.
        """
        system = self.system
        system.constraints.require_supports()
        zero, none = np.zeros(system.N), np.zeros(system.constraints.m)
        system.assemble(zero, 1.0, geometric=False)
        system.solver.factorize(zero, 1.0, none)
        u, multipliers = np.zeros(system.N), none
        u[system.constraints.fixed] = system.constraints.values(1.0)
        gap = system.constraints.constraint(zero, 1.0)
        J = system.constraints.full_jacobian(zero, 1.0)
        # solved again with what sums of strains leave: an assembled stiffness rounds off bending
        for _ in range(LINEAR_SOLVES if system.N <= SOLVED_AGAIN else 1):
            rest = (linear_external_force(system, zero, u) - linear_force(system, zero, u)
                    - multipliers @ J)
            du, dm = system.solver.solve(rest, -gap - J @ u)
            u, multipliers = u + du, multipliers + dm
            if np.max(np.abs(du)) <= CLOSE * np.max(np.abs(u)):
                break
        system.forces.contacts.require_free(u, "solve_linear()", "solve_static()")
        return State(system, u, iterations=1, message="linear, one factorisation",
                     multipliers=multipliers, base=State(system, zero, load=0.0))

    def solve_static(self, start: State | None = None, adapt: float | None = None,
                     **options: Any) -> State:
        """The equilibrium under the full load.

        Parameters
        ----------
        start
            A State to start from, of this scene or of one whose beams have equal meshes and
            elements; the stress-free state by default. :meth:`state` makes one of coordinates.
        adapt
            Tolerance of the error: raise the degree of elements that have one, where the solution
            is smooth (up to ``max_degree=``), else refine the meshes where it is, starting from
            those given. The state's ``error_estimate`` says what was reached, its
            ``refinements`` what was done; its beams are the refined ones. With
            ``goal="strain"`` it is the error of the strain. See
            :func:`skfem_ancf.scene.adapt.solve_adaptive`.
        **options
            Those of :func:`skfem_ancf.solvers.newton.solve_static`: ``method``, ``tol``,
            ``max_iterations``, ``first_step``, ``min_step``, ``progress``, ``stable``. By default
            the equilibrium is a stable one; ``stable=False`` takes any that the load steps lead
            to, and ``state.stability`` says what it is.

        Returns
        -------
        State

        Raises
        ------
        SupportError
            If a rigid motion is free.
        ConvergenceError
            If there is no convergence; its ``state`` is the last converged State.

        Warns
        -----
        StabilityWarning
            If the path loses its stability before the full load, so that the solution went on to
            another equilibrium, or if loads without a potential leave it unstable.
        ModelWarning
            If a fibre is compressed beyond what the law is good for, or the mesh is too coarse
            for the curvature found; ``state.checks`` has the numbers.
        """
        with self._lock:
            if adapt is not None:
                if start is not None:
                    raise InputError("an adaptive solution begins each mesh from its stress-free "
                                     "state: give adapt= without start=")
                state = solve_adaptive(self, adapt, **options)
            else:
                u = None if start is None else displacement(self.system, start)
                memory = self.system.forces.contacts.of_state(start)
                state = self._solve(u, memory=memory, **options)
            self._warn(state)
        return state

    def _warn(self, state):
        """Say what makes a static solution doubtful."""
        if state.doubt:
            warn(f"{state.doubt}; the state is {state.verdict}", StabilityWarning)
        warn_of(state)

    def state(self, u: ArrayLike | None = None, multipliers: ArrayLike | None = None,
              load: float = 1.0) -> State:
        """A State of this scene with given coordinates: a start, or a shape to look at.

        Parameters
        ----------
        u
            Displacement of the coordinates from the stress-free state, beam after beam, shape
            (N,); zero by default. What it comes from is not asked: so coordinates of another
            scene are taken over.
        multipliers
            Of the joints, shape (m,); zero by default.
        load
            Factor on the loads, for modes about the state and its reactions.

        Returns
        -------
        State
            It is no equilibrium, ``converged`` is False.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line([0, 0.5, 1], height=0.1), ElementBeamANCF(1),
        ...                    StVenantKirchhoff(E=1.0, nu=0.3), width=0.1))
        >>> lifted = scene.state(np.tile([0.0, 0.2, 0, 0, 0, 0], 3))
        >>> lifted.displacement((1, 0)).round(6).tolist()
        [0.0, 0.2]
        """
        system = self.system
        u = np.zeros(system.N) if u is None else np.array(require_finite("u", u, (system.N,)))
        if multipliers is not None:
            m = system.constraints.m
            multipliers = np.array(require_finite("multipliers", multipliers, (m,)))
        return State(system, u, require_finite_scalar("load", load), converged=False,
                     message="given coordinates", multipliers=multipliers)

    def _solve(self, u, memory=None, **options):
        require_options("solve_static", options, OPTIONS,
                        "; first_step=0.1 begins with a tenth of the load; with adapt= those of "
                        "statics.adapt.solve_adaptive too")
        system = self.system
        system.constraints.require_independent_joints()
        if system.constraints.adrift:
            system.constraints.require_supports()
        try:
            result = newton.solve_static(system, u, memory=memory, **options)
        except Interrupted as error:
            raise Interrupted(str(error), self._state(error.state)) from None
        except ConvergenceError as error:
            if system.constraints.missing_supports:
                raise SupportError(f"{system.constraints.missing_supports}. No stable equilibrium "
                                   "was found in which the loads hold what is free") from error
            state = self._state(error.state)
            raise ConvergenceError(_with_findings(str(error), state), state) from None
        return self._state(result)

    @_alone
    def continuation(self, branch: CriticalPoint | None = None, **options: Any) -> Path:
        """The equilibrium path through limit and snap-back points, by arc length.

        Parameters
        ----------
        branch
            One of the ``critical_points`` of an earlier path of this scene, of kind "bifurcation":
            follow the path that leaves the other one there.
        **options
            Those of :func:`skfem_ancf.solvers.continuation.continuation`: ``steps``, ``ds``,
            ``ds_max``, ``max_load``, ``until``, ``tol``, ``max_iterations``, ``locate``, ``side``,
            ``progress``.

        Returns
        -------
        Path
            With ``limit_points()``, ``bifurcation_points()`` and ``critical_points``.

        Raises
        ------
        InputError
            If an argument is out of range or the branch point belongs to another scene.
        ConvergenceError
            If the path cannot be followed further; its ``state`` is the Path so far.

        Examples
        --------
        Euler's column buckles at pi^2 E I / (4 L^2); its two paths:

        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> column = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.01), ElementBeamCable(5),
        ...               StVenantKirchhoff(12e6, 0.3), width=1.0)
        >>> scene = Scene(column).clamp("left").point_force((-1, 0), (1, 0))
        >>> path = scene.continuation(max_load=3, ds=1e-4)
        >>> bool(abs(path.bifurcation_points()[0] / (np.pi**2 / 4) - 1) < 1e-3), path.stable[-1]
        (True, False)
        >>> buckled = scene.continuation(branch=path.critical_points[0], max_load=3, ds=0.05)
        >>> float(buckled.load[-1]), buckled.stable[-1]
        (3.0, True)
        """
        system = self.system
        system.constraints.require_supports()
        system.forces.contacts.require_path()
        critical = None if branch is None else _branch(branch, system)
        try:
            return Path(system, *continuation(system, branch=critical, **options))
        except (ConvergenceError, Interrupted) as error:
            raise type(error)(str(error), Path(system, *error.state)) from None

    def initial_velocity(self, v: ArrayLike | Callable[[Array], Array],
                         beam: WhichBeam = None) -> Scene:
        """The velocity at the start of :meth:`integrate`.

        What supports and joints do not allow of it they stop by impulses.

        Parameters
        ----------
        v
            The velocity of all points, shape (2,), or a function of the points x, shape (2, ...),
            of the stress-free body that returns velocities (2, ...); or velocities of the
            coordinates, shape (beam.N,). Of a rigid body the function is asked at its centre of
            mass and beside it.
        beam
            The beam, its name or its number, in a scene of several; or a RigidBody.

        Returns
        -------
        Scene
            Itself.
        """
        return self._put(velocities=[(self._number(beam), v)])

    def _bind_velocity(self, k, v):
        beam = self.members[k]
        if (isinstance(v, (list, tuple)) and len(v) == 2) or getattr(v, "shape", None) == (2,):
            uniform = require_finite("v", v, (2,))
            return self._bind_velocity(k, lambda x: np.multiply.outer(uniform, np.ones(x[0].shape)))
        if callable(v) and isinstance(beam, RigidBody):
            v = beam.velocity_of(lambda x: ask_field("v(x)", v, x))
        elif callable(v):
            v = projected(beam, lambda x: ask_field("v(x)", v, x))
        return require_finite("v", v, (beam.N,))

    @_alone
    def integrate(self, t_end: float, dt: float | str,
                  scheme: str | Scheme | type[Scheme] = "energy-momentum",
                  start: State | None = None, **options: Any) -> History:
        """The motion from the stress-free state, or from a given one.

        Parameters
        ----------
        t_end
            Time at the end.
        dt
            Step size, or "auto".
        scheme
            A scheme, a name from :data:`skfem_ancf.dynamics.SCHEMES`, or "auto": by joints,
            damping, stiffness, contact and ``rtol``, as :meth:`plan` says.
        start
            A State to start from, or None for the stress-free state. An instant of a motion
            (``history.state(k)``) goes on with its velocity, from its time; every other State
            starts with the scene's :meth:`initial_velocity`.
        **options
            Those of :func:`skfem_ancf.dynamics.integrate.integrate`: ``t_eval``, ``tol``,
            ``rtol``, ``t_start``, ``breakpoints``, ``checkpoint``, ``every``, ``progress``,
            ``until``, ``check``.

        Returns
        -------
        History

        Raises
        ------
        ConvergenceError
            If a step fails; its ``state`` is the History up to there.
        Interrupted
            On Ctrl-C; its ``state`` is the History up to there.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.01),
        ...                    ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3, 7800), width=0.01))
        >>> history = scene.pin("left").gravity((0, -9.81)).integrate(t_end=0.02, dt=1e-3)
        >>> bool(np.ptp(history.total_energy) < 1e-12)
        True
        """
        velocity = np.concatenate([self._velocities[k][1] if k in self._velocities else np.zeros(
            b.N) for k, b in enumerate(self.members)]) if self._velocities else None
        u = None if start is None else displacement(self.system, start)
        if isinstance(scheme, str) and scheme == "auto":
            rtol = require_positive("rtol", options.get("rtol", RTOL))
            scheme = choose_scheme(self.system, rtol).scheme
        return integrate(self.system, t_end, dt, get_scheme(scheme), u, velocity, start=start,
                         sensors=self._checked_sensors(), **options)

    def sensor(self, name: str, what: str | Callable[[State], Any], at: Any = None,
               beam: WhichBeam = None, recover: bool = False, line: int | None = None) -> Scene:
        """Write something down at every step of motions: ``history.sensors[name]``.

        States may then be stored sparsely, by ``integrate(..., t_eval=...)``.

        Parameters
        ----------
        name
            Its name; a second sensor of a name takes the place of the first.
        what
            "position", "displacement", "velocity" or "acceleration" of points; "strain", "stress"
            or another field there; "N", "Q", "M", "force", "curvature", "shear" or "angle" of
            sections; "joint_force"; or a function of the State that returns a number or an array.
        at
            Points, as for :meth:`State.displacement <skfem_ancf.results.State.displacement>`; a
            joint of the scene for its force; None for a function.
        beam
            The beam, its name or its number; found if it is not given.
        recover
            Recovered fields and section forces, a millisecond a step and beam; by default those of
            the elements.
        line
            The number of the line, of a frame; found if it is not given.

        Returns
        -------
        Scene
            Itself.

        Raises
        ------
        NameUnknown
            If the quantity is not known.
        MeshError
            If a point is outside the body.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.01),
        ...                    ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3, 7800), width=0.01))
        >>> scene = scene.pin("left").gravity((0, -9.81)).sensor("tip", "position", at=(1, 0))
        >>> history = scene.integrate(t_end=0.02, dt=1e-3, t_eval=[0.02])
        >>> len(history), history.sensors["tip"].shape, history.sensors.t.shape
        (1, (21, 2), (21,))
        """
        if require_label("name", name) is None:
            raise InputError("the name of a sensor must be a text, got None")
        sensor = Sensor(what, at, beam, recover, line)
        with self._lock:
            locate(sensor, self.system)
            self._sensors = {**self._sensors, name: sensor}
        return self

    @property
    def sensors(self) -> dict[str, Sensor]:
        """The sensors by name."""
        return dict(self._sensors)

    def _checked_sensors(self):
        for sensor in self._sensors.values():
            locate(sensor, self.system)
        return list(self._sensors.items())

    def resume(self, path: StrPath, scheme: str | Scheme | type[Scheme] | None = None,
               progress: bool | None = None) -> History:
        """Go on with a motion from its checkpoint, to the end that it was given.

        On the same machine its numbers are those of a run that was not interrupted, bit for bit if
        both are compiled or both are not; instants of ``t_eval`` within a step are to the tolerance
        of the iteration.

        Parameters
        ----------
        path
            The file of ``integrate(..., checkpoint=path)``, which goes on to be written.
        scheme
            The scheme, if it is one of your own; the file knows those of the package.
        progress
            Show a progress bar: True, False, or None for "if it takes long".

        Returns
        -------
        History
            Of the whole motion.

        Raises
        ------
        CheckpointError
            If the file cannot be read, is damaged, or of another scene. Functions of time are
            compared at 33 times only.

        Examples
        --------
        >>> import tempfile
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.01),
        ...                    ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3, 7800), width=0.01))
        >>> scene = scene.pin("left").gravity((0, -9.81))
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     history = scene.integrate(0.02, 1e-3, checkpoint=folder + "/run.npz", every=5)
        ...     again = scene.resume(folder + "/run.npz")
        >>> bool(np.array_equal(again.u, history.u))
        True
        """
        return follow(*resume(self.system, path, scheme, self._checked_sensors()), progress)

    @_alone
    def modes(self, k: int, state: State | None = None) -> Modes:
        """The k lowest natural frequencies and their shapes.

        Parameters
        ----------
        k
            How many.
        state
            The state about which the beams vibrate, prestress included; stress-free by default.

        Returns
        -------
        Modes
            With ``frequencies`` in rad/s, ``shapes`` and ``mode(i, amplitude)``; ``flutter`` and
            complex ``eigenvalues`` where loads follow the body.

        Raises
        ------
        InputError
            If k is out of range.
        SupportError
            If joints are not independent in this state.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 17), height=0.01),
        ...                    ElementBeamANCF(3), StVenantKirchhoff(2e8, 0.3, 7800), width=0.01))
        >>> EI, rhoA = 2e8 * 0.01**4 / 12, 7800 * 0.01**2
        >>> ratio = scene.clamp("left").modes(1).frequencies[0] / (3.5160 * np.sqrt(EI / rhoA))
        >>> bool(abs(ratio - 1) < 5e-3)
        True
        """
        if state is None:
            state = self.state(load=0.0)
        state = configuration(self.system, state)
        return eigen.modes(self.system, state, k)

    @_alone
    def buckling(self, k: int = 1) -> Buckling:
        """The k lowest load factors at which the stress-free state buckles, and their shapes.

        Returns
        -------
        Buckling
            With ``factors`` on the loads of the scene and ``shapes``.

        Raises
        ------
        InputError
            If there is no positive factor, or loads that follow the body make it flutter first.
        SupportError
            If a rigid motion is free.
        """
        return eigen.buckling(self.system, k)

    def _state(self, result):
        return State(self.system, result.u, result.load, result.force, result.converged,
                     result.iterations, result.message, result.steps, result.multipliers,
                     doubt=result.doubt, memory=result.memory)


def _with_findings(message, state):
    """A message, and what the last state that converged is beyond."""
    found = state.checks.findings
    if not found:
        return message
    return f"{message}. At the load level {state.load:.6g} already " + "; ".join(found)


def _branch(point, system):
    """What a CriticalPoint of a path of a system was made from."""
    if not isinstance(point, CriticalPoint) or point.kind != "bifurcation":
        raise InputError("branch must be a point of path.critical_points of kind 'bifurcation', "
                         f"got {shown(point)}")
    if point.state.system is not system:
        raise InputError("the branch point belongs to another scene, or to this one before it was "
                         "changed: follow its path again")
    return point.critical
