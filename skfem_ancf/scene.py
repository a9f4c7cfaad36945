"""A scene: beams, supports and loads, and what can be asked of them."""

from copy import copy
from functools import wraps

import numpy as np
from skfem.assembly import LinearForm, asm

from . import eigen, forms
from .beam import Beam, select_beam
from .dynamics import get_scheme
from .dynamics.integrate import integrate
from .errors import (ConvergenceError, InputError, NameUnknown, SupportError, require_finite,
                     require_finite_scalar)
from .joints import Joint, get_joint
from .loads import DeadLoad, EndMoment, Pressure
from .path import Path
from .plan import make_plan
from .results import State
from .statics import continuation, newton
from .statics.adapt import solve_adaptive
from .system import System


def _recorded(method):
    """Keep the call, so that the scene can be built again on other meshes."""

    @wraps(method)
    def wrapper(self, *args, **kwargs):
        outermost = not self._inside
        self._inside = True
        try:
            result = method(self, *args, **kwargs)
        finally:
            if outermost:
                self._inside = False
        if outermost:
            self._calls.append((method.__name__, args, kwargs))
        return result

    return wrapper


class Scene:
    """Beams with supports and loads.

    Methods that add a support or a load return the scene, so that they can be chained. In a
    scene of several beams they take ``beam=``: a Beam, its name or its number. Loads take
    ``amplitude=``: a function of time by which they are multiplied in :meth:`integrate`.

    Parameters
    ----------
    *beams
        One or more :class:`~skfem_ancf.Beam`.

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

    def __init__(self, *beams):
        if len(beams) == 1 and isinstance(beams[0], (list, tuple)):
            beams = tuple(beams[0])
        if not beams:
            raise InputError("a scene needs at least one beam")
        for b in beams:
            if not isinstance(b, Beam):
                raise InputError(f"a scene is made of Beams, got {b!r}")
        names = [b.name for b in beams if b.name is not None]
        if len(set(names)) < len(names) or len(set(map(id, beams))) < len(beams):
            raise InputError(f"the beams of a scene must be different, and so must their names: "
                             f"{names}")
        self.beams = beams
        self.loads = []
        self.joints = []
        self._calls, self._inside = [], False
        self._velocity = {}
        self._fixed = {}  # (number of the beam, coordinate) -> displacement
        self._system = None

    def __repr__(self):
        return (f"<Scene of {len(self.beams)} beam(s), {len(self._fixed)} fixed coordinates, "
                f"{len(self.loads)} load(s)>")

    def beam(self, beam=None):
        """The Beam meant by a Beam, a name, a number, or None where there is only one."""
        return select_beam(self.beams, beam)

    def offset(self, beam):
        """Number of the first coordinate of a beam among those of the scene."""
        return sum(b.N for b in self.beams[:self.beams.index(self.beam(beam))])

    @property
    def N(self):
        """Number of coordinates of the scene."""
        return sum(b.N for b in self.beams)

    # supports

    def _fix(self, beam, dofs, displacement=0.0):
        k = self.beams.index(beam)
        values = np.broadcast_to(displacement, np.shape(dofs))
        for d, v in zip(dofs, values):
            before = self._fixed.get((k, int(d)))
            if before is not None and before != v:
                raise SupportError(
                    f"coordinate {beam.dofnames[int(d) % beam.nd]} of node {int(d) // beam.nd} is "
                    f"fixed twice, with displacements {before!r} and {float(v)!r}")
            self._fixed[k, int(d)] = float(v)
        self._system = None
        return self

    @_recorded
    def clamp(self, boundary, beam=None, thickness="fixed"):
        """Weld a face, or hold it as a plane.

        Parameters
        ----------
        boundary
            A boundary name, or anything else scikit-fem takes for facets.
        thickness
            "fixed": the position of every material point of the face is fixed, that is ``r`` and
            the section coordinates at the node; the slope ``r_X``, a strain measure there, stays
            free. "free": ``r`` is fixed and the section stays in its plane, but may get thinner
            or thicker there. With nu not zero a welded face causes a boundary layer as long as
            the beam is high, which long elements exaggerate; the plane does not.
        """
        beam = select_beam(self.beams, beam)
        if thickness not in ("fixed", "free"):
            raise NameUnknown("thickness", thickness, ("fixed", "free"))
        if thickness == "fixed" and not beam.is_cable:
            return self._fix(beam, beam.dofs(boundary, beam.element.welded))
        self._fix(beam, beam.dofs(boundary, "r"))
        self.joint("plane", at=boundary, beam=beam)
        return self

    @_recorded
    def pin(self, boundary, beam=None):
        """Fix the position of the axis; the section may turn."""
        beam = select_beam(self.beams, beam)
        return self._fix(beam, beam.dofs(boundary, "r"))

    @_recorded
    def fix(self, boundary, names=None, displacement=0.0, beam=None):
        """Fix coordinates by their scikit-fem names.

        Parameters
        ----------
        boundary
            A boundary name, or anything else scikit-fem takes for facets.
        names
            As ``["r^1", "r_Y0^2"]``; ``"r"`` means both components; None means all.
        displacement
            Their displacement at full load; it grows with the load.

        Raises
        ------
        NameUnknown
            If a name is not known; the message lists the known ones.
        SupportError
            If a coordinate is given two displacements.
        """
        beam = select_beam(self.beams, beam)
        return self._fix(beam, beam.dofs(boundary, names),
                         require_finite_scalar("displacement", displacement))

    @_recorded
    def joint(self, joint, **options):
        """Add a joint, held by Lagrange multipliers.

        Parameters
        ----------
        joint
            A name from :data:`skfem_ancf.joints.JOINTS` with its options, or a Joint:

            * ``"hinge", beams=(a, b), at=point``: two beams share a point,
            * ``"weld", beams=(a, b), at=("right", "left")``: two end sections keep their angle,
            * ``"line", at=point, direction=(1, 0)``: a point slides on a line,
            * ``"circle", at=point, center=(0, 0)``: a point slides on a circle,
            * ``"position", at=point, r=function``: a point follows ``r(t)``,
            * ``"angle", at="left", angle=function``: a section turns by ``angle(t)``,
            * ``"plane", at="left"``: a section stays in its plane.

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
        joint = get_joint(joint, **options)
        joint.bind(self)
        self.joints.append(joint)
        self._system = None
        return joint

    # loads

    def _load(self, load, amplitude=None):
        if amplitude is not None and not callable(amplitude):
            raise InputError(f"an amplitude is a function of time, got {amplitude!r}")
        load.amplitude = amplitude
        self.loads.append(load)
        self._system = None
        return self

    @_recorded
    def gravity(self, g, beam=None, amplitude=None):
        """Weight of every beam, or of one.

        Parameters
        ----------
        g
            Acceleration, shape (2,), as ``(0, -9.81)``.
        """
        g = require_finite("g", g, (2,))
        for b in self.beams if beam is None else [select_beam(self.beams, beam)]:
            self._load(DeadLoad(b, b.weight(g)), amplitude)
        return self

    @_recorded
    def point_force(self, force, at, beam=None, amplitude=None):
        """A dead force (2,) on the material point ``at`` of the stress-free body."""
        force = require_finite("force", force, (2,))
        beam = select_beam(self.beams, beam)
        dofs, weights = beam.probe(at)
        vector = np.zeros(beam.N)
        np.add.at(vector, dofs, np.outer(force, weights))
        return self._load(DeadLoad(beam, vector), amplitude)

    @_recorded
    def traction(self, boundary, t, beam=None, amplitude=None):
        """A dead traction on a surface, per area of the stress-free body.

        Parameters
        ----------
        boundary
            A boundary name, or anything else scikit-fem takes for facets.
        t
            Constant, shape (2,), or a function of the points x (2, ...) that returns (2, ...).
        """
        beam = select_beam(self.beams, beam)
        if not callable(t):
            t = require_finite("t", t, (2,))
        basis = beam.facet_basis(boundary, intorder=12 if callable(t) else None)
        return self._load(DeadLoad(beam, asm(forms.traction(t, beam.width), basis)), amplitude)

    @_recorded
    def pressure(self, boundary, p, beam=None, amplitude=None):
        """A pressure on a surface that stays normal to it as it deforms; positive pushes."""
        beam = select_beam(self.beams, beam)
        return self._load(Pressure(beam, boundary, require_finite_scalar("p", p)), amplitude)

    @_recorded
    def moment(self, boundary, M, beam=None, amplitude=None):
        """A moment on an end section, counterclockwise, that turns with it."""
        beam = select_beam(self.beams, beam)
        return self._load(EndMoment(beam, beam.section_node(boundary),
                                    require_finite_scalar("M", M)), amplitude)

    @_recorded
    def load(self, form, boundary=None, beam=None, amplitude=None):
        """Any scikit-fem ``LinearForm``, as a dead load on the body or on a boundary of it."""
        beam = select_beam(self.beams, beam)
        if not isinstance(form, LinearForm):
            raise InputError(f"a load is a scikit-fem LinearForm, got {form!r}")
        basis = beam.exact_basis() if boundary is None else beam.facet_basis(boundary)
        return self._load(DeadLoad(beam, asm(form, basis)), amplitude)

    # solution

    @property
    def system(self):
        """The discrete equations, built when first asked for."""
        if self._system is None:
            offsets = np.concatenate([[0], np.cumsum([b.N for b in self.beams])])
            fixed = np.array([offsets[k] + d for k, d in self._fixed], dtype=int)
            self._system = System(self.beams, self.loads, fixed,
                                  np.array(list(self._fixed.values()), dtype=float), self.joints)
        return self._system

    def with_beams(self, beams):
        """The same supports, loads and joints on other beams.

        Parameters
        ----------
        beams
            As many beams, in the same order; a boundary given by a name, a point or a function
            is found again on them.

        Raises
        ------
        InputError
            If a boundary was given by facet numbers, or velocities by coordinates.
        """
        scene = Scene(*beams)
        known = {id(a): b for a, b in zip(self.beams, beams)}

        def moved(value):
            if isinstance(value, Joint):
                return copy(value)  # bound to the new scene below
            if isinstance(value, tuple) and any(id(v) in known for v in value):
                return tuple(map(moved, value))
            return known.get(id(value), value)

        for name, args, kwargs in self._calls:
            first = args[0] if args else kwargs.get("boundary", kwargs.get("v"))
            if name in ("clamp", "pin", "fix", "traction", "pressure", "moment",
                        "initial_velocity") and not (isinstance(first, str) or callable(first)):
                raise InputError(f"{name}({first!r}) cannot be put on another mesh: give names or "
                                 "functions")
            getattr(scene, name)(*map(moved, args), **{k: moved(v) for k, v in kwargs.items()})
        return scene

    def plan(self, kind="static"):
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

    def solve_linear(self):
        """The small-displacement solution: one assembly, one factorisation, one solve.

        Returns
        -------
        State

        Raises
        ------
        SupportError
            If a rigid motion is free.
        """
        system = self.system
        system.require_supports()
        zero, none = np.zeros(system.N), np.zeros(system.m)
        system.assemble(zero, 1.0, geometric=False)
        du0 = np.zeros(system.N)
        du0[system.fixed] = system.values(1.0)
        load, phi = system.external_force(zero), -system.constraint(zero, 1.0)
        if np.any(du0):
            load = load - system.multiply(du0)
            phi = phi - system.full_jacobian(zero, 1.0) @ du0
        system.factorize(zero, 1.0, none)
        du, multipliers = system.solve(load, phi)
        return State(system, du + du0, force=None, iterations=1, message="linear, one solve",
                     multipliers=multipliers)

    def solve_static(self, start=None, adapt=None, **options):
        """The equilibrium under the full load.

        Parameters
        ----------
        start
            A State to start from; the stress-free state by default.
        adapt
            Tolerance of the error: refine the meshes where it is, starting from those given. The
            state's ``error_estimate`` says what was reached; its beams are the refined ones. See
            :func:`skfem_ancf.statics.adapt.solve_adaptive`.
        **options
            Those of :func:`skfem_ancf.statics.newton.solve_static`: ``method``, ``tol``,
            ``max_iterations``, ``first_step``, ``min_step``, ``progress``.

        Returns
        -------
        State

        Raises
        ------
        SupportError
            If a rigid motion is free.
        ConvergenceError
            If there is no convergence; its ``state`` is the last converged State.
        """
        if adapt is not None:
            return solve_adaptive(self, adapt, **options)
        return self._solve(None if start is None else start.u, **options)

    def _solve(self, u, **options):
        system = self.system
        system.require_supports()
        try:
            result = newton.solve_static(system, u, **options)
        except ConvergenceError as error:
            raise ConvergenceError(str(error), self._state(error.state)) from None
        return self._state(result)

    def continuation(self, **options):
        """The equilibrium path through limit and snap-back points, by arc length.

        Parameters
        ----------
        **options
            Those of :func:`skfem_ancf.statics.continuation.continuation`: ``steps``, ``ds``,
            ``ds_max``, ``max_load``, ``until``, ``tol``, ``max_iterations``, ``progress``.

        Returns
        -------
        Path

        Raises
        ------
        ConvergenceError
            If the path cannot be followed further; its ``state`` is the Path so far.
        """
        system = self.system
        system.require_supports()
        try:
            return Path(system, continuation(system, **options))
        except ConvergenceError as error:
            raise ConvergenceError(str(error), Path(system, error.state)) from None

    @_recorded
    def initial_velocity(self, v, beam=None):
        """The velocity at the start of :meth:`integrate`.

        Parameters
        ----------
        v
            Velocities of the coordinates, shape (beam.N,), or a function of the points x, shape
            (2, ...), of the stress-free body that returns velocities (2, ...).
        """
        beam = select_beam(self.beams, beam)
        if callable(v):
            basis = beam.exact_basis()
            rate = require_finite("v(x)", v(np.asarray(basis.global_coordinates())))
            v = basis.project(np.broadcast_to(rate, (2, basis.nelems, len(basis.W))))
        self._velocity[id(beam)] = require_finite("v", v, (beam.N,))
        return self

    def integrate(self, t_end, dt, scheme="energy-momentum", start=None, **options):
        """The motion from the stress-free state, or from a given one.

        Parameters
        ----------
        t_end
            Time at the end.
        dt
            Step size, or "auto".
        scheme
            A scheme or a name from :data:`skfem_ancf.dynamics.SCHEMES`.
        start
            A State to start from, or None for the stress-free state.
        **options
            Those of :func:`skfem_ancf.dynamics.integrate.integrate`: ``t_eval``, ``tol``,
            ``rtol``, ``t_start``, ``progress``.

        Returns
        -------
        History

        Raises
        ------
        ConvergenceError
            If a step fails; its ``state`` is the History up to there.

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
        velocity = np.concatenate([self._velocity.get(id(b), np.zeros(b.N)) for b in self.beams])
        u = None if start is None else require_finite("start.u", start.u, (self.N,))
        return integrate(self.system, t_end, dt, get_scheme(scheme), u, velocity, **options)

    def modes(self, k, state=None):
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
            With ``frequencies`` in rad/s, ``shapes`` and ``mode(i, amplitude)``.

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
            state = State(self.system, np.zeros(self.N), load=0.0)
        return eigen.modes(self.system, state, k)

    def buckling(self, k=1):
        """The k lowest load factors at which the stress-free state buckles, and their shapes.

        Returns
        -------
        Buckling
            With ``factors`` on the loads of the scene and ``shapes``.
        """
        return eigen.buckling(self.system, k)

    def _state(self, result):
        return State(self.system, result.u, result.load, result.force, result.converged,
                     result.iterations, result.message, result.steps, result.multipliers)
