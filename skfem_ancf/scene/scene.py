"""Scenes: beams, actions on them, and their solutions."""

from collections.abc import Callable, Sequence
from copy import copy
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from skfem.assembly import Basis

from ..actions.bound import BoundConstraint, BoundForce
from ..actions.forces import PointMass
from ..actions.item import Item
from ..actions.joints import Joint
from ..actions.loads import Load, bind_load
from ..actions.point_force import PointForce
from ..beam import Beam, WhichBeam, WhichMember, projected, select_beam
from ..core import (Array, ArrayLike, ConvergenceError, InputError, Interrupted, NameUnknown,
                    StrPath, ask, ask_field, refuse, require_finite, require_finite_scalar,
                    require_function, require_label, require_option, require_positive)
from ..dynamics import Scheme, choose_scheme, get_scheme
from ..dynamics.schemes import RTOL
from ..dynamics.history import History
from ..dynamics.integrate import follow, integrate, resume
from ..dynamics.sensors import Sensor, locate
from ..equations.matrices import SceneMatrices, linear_external_force, linear_force, matrices_of
from ..equations.system import System
from ..results.checks import warn_of, warn_of_meetings, warn_of_points
from ..results.modes import Buckling, FrequencyResponse, Modes
from ..results.output import scene_html
from ..results.path import CriticalPoint, Path
from ..results.state import State
from ..solvers import continuation, eigen, newton
from ..solvers.continuation import Point
from ..visuals.matplotlib import plot_scene
from ..visuals.pyvista import Explorer
from .control import Held, LinearModel, Stepper
from .design import Gradient
from .model import Entry, Model
from .quasistatic import StepHistory, Steps, run
from .solve import (DEGREES, GOALS, MOST_ELEMENTS, Plan, configuration, displacement,
                    frequency_errors, make_plan, solve_adaptive, solve_static)

if TYPE_CHECKING:
    from typing_extensions import Self

#: Iterative refinement of linear solutions: largest number of solves with one factorisation,
#: largest number of degrees of freedom, and relative size of a correction to stop at.
LINEAR_SOLVES, SOLVED_AGAIN, CLOSE = 4, 50000, 1e-13


class Scene(Model):
    """Beams, rigid bodies and domains, what acts on them, and their solutions.

    ================  =========================================================================
    *supports*        ``clamp``, ``pin``, ``fix`` (single degrees of freedom)
    *loads*           ``gravity``, ``point_force``, ``follower_force``, ``moment``, ``line_load``,
                      ``traction``, ``pressure``, ``temperature``, ``eigenstrain``,
                      ``load`` (a form of scikit-fem), ``energy`` (a density of yours)
    *joints*          ``hinge``, ``weld``, ``slider``, ``motor``, ``joint`` (others, by name)
    *other forces*    ``spring``, ``torsional_spring``, ``foundation``, ``point_mass``, ``drag``,
                      ``damping``, ``control``, ``obstacle``, ``contact`` (of members with each
                      other), ``add`` (any item, also yours)
    *statics*         ``solve_static``, ``solve_linear``; ``run``: over a time, without inertia;
                      ``continuation``: the path through snaps; ``buckling``
    *motion*          ``integrate``, ``initial_velocity``, ``sensor``, ``sensors``, ``resume``;
                      ``stepper``: step by step; ``modes``, ``linearize``,
                      ``frequency_response``
    *look*            ``plot``: before it is solved; ``plan``: what a solution will compute;
                      ``explore``: solved as a slider or an arrow is moved; ``units``;
                      ``beams``, ``bodies``, ``domains``, ``items``, ``loads``, ``joints``,
                      ``elements``, ``beam`` (by name)
    *change*          ``replace``: the same with other loads, beams, materials
    *equations*       ``matrices``, ``free``, ``basis``, ``state``, ``N``, ``system``
    ================  =========================================================================

    Methods that add something return the scene, so that they can be chained; those of joints
    return the joint: ``state.joint_force(joint)`` is its force. Each adds an item:
    ``scene.spring(...)`` is ``scene.add(Spring(...))``, and :class:`~skfem_ancf.Spring` describes
    the arguments. In a scene of several beams they take ``beam=``: a Beam, its name or its number;
    many take a RigidBody, too. Loads take ``amplitude=``: a function of time by which they are
    multiplied in :meth:`run` and :meth:`integrate`.

    Parameters
    ----------
    *beams
        One or more :class:`~skfem_ancf.Beam`, :class:`~skfem_ancf.RigidBody` or
        :class:`~skfem_ancf.Domain`, numbered in this order.

    Other Parameters
    ----------------
    beam
        Beam, name or number; None for the only one.
    scheme
        A scheme, or a name from :data:`skfem_ancf.dynamics.SCHEMES`.
    progress
        Show a progress bar: True, False, or None for "if it takes long".

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

    def __init__(self, *beams: Any) -> None:
        super().__init__(*beams)
        # number of the beam -> (as given, for its degrees of freedom)
        self._velocities: dict[int, tuple[Any, Array]] = {}
        self._sensors: dict[str, Sensor] = {}

    def __repr__(self):
        bodies = f"{len(self.bodies)} rigid bodies, " if self.bodies else ""
        bodies += f"{len(self.domains)} domain(s), " if self.domains else ""
        return (f"<Scene of {len(self.beams)} beam(s), {bodies}{len(self._fixed)} fixed "
                f"coordinates, {len(self.loads)} load(s)>")

    _repr_html_ = scene_html

    @property
    def system(self) -> System:
        """The discrete equations, built on first use."""
        with self._lock:
            if self._system is None:
                layout, loads, elements = self.layout, self._all(Load), self._all(BoundForce)
                masses = [x for x in elements if isinstance(x, PointMass) and x.mass]
                weights = [bind_load(PointForce(x.mass * g, x.at, None, one.amplitude), one.beam)
                           for one in loads if (g := getattr(one, "g", None)) is not None
                           for x in masses if layout.beam(x.beam) is one.beam]
                self._system = System(
                    layout.beams, [*loads, *weights], np.array(list(self._fixed), dtype=int),
                    np.array(list(self._fixed.values()), dtype=float),
                    list(self._all(BoundConstraint)), self._damping, list(elements),
                    layout.bodies, eigen.rest_modes, layout.domains)
                self._system.items = self.items
                # a copy has no equations: with self, memory would wait for a garbage collection
                self._system.derivatives = partial(Gradient, copy(self))
                warn_of_meetings(self._system)
            self._system.units = self._units
            return self._system

    @property
    def free(self) -> Array:
        """Numbers of the degrees of freedom without supports: the unknowns."""
        return np.flatnonzero(self.system.constraints.free)

    def basis(self, beam: WhichBeam = None) -> Basis:
        """The scikit-fem ``Basis`` of the position field of a beam.

        Its quadrature is exact for products of two functions. Its degree of freedom k is number
        ``scene.layout.offset(beam) + k`` of the scene. In a scene of one beam the position of a
        State is ``basis.interpolate(state.q)``.
        """
        return select_beam(self.beams, beam).exact_basis()

    def matrices(self, state: State | None = None) -> SceneMatrices:
        """Mass, damping, tangent stiffness, force and constraints in a state, as SciPy's sparse.

        A named tuple ``M, D, K, force, J`` for all degrees of freedom; the unknowns are
        :attr:`free`.

        Parameters
        ----------
        state
            A State of this scene, as from :meth:`state`; None for the reference configuration
            without loads.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line([0, 1], height=0.1), ElementBeamANCF(2),
        ...                    StVenantKirchhoff(2e8, 0.3, 7800), width=0.1)).clamp("left")
        >>> M, D, K, force, J = scene.matrices()
        >>> K[scene.free][:, scene.free].shape
        (10, 10)
        """
        with self._lock:
            state = self.state(load=0.0) if state is None else state
            return matrices_of(self.system, configuration(self.system, state))

    def _on(self, beams):
        scene = super()._on(beams)
        for k, (v, _) in self._velocities.items():
            refuse(not callable(v) and scene.layout.members[k].N != self.layout.members[k].N,
                   "initial_velocity by coordinates cannot be put on another mesh")
            scene.initial_velocity(v, k)
        scene._sensors = self._sensors
        return scene

    def replace(self, beam: WhichBeam = None, loads: Sequence[Load] | None = None,
                beams: Sequence[Beam] | None = None, **changes: Any) -> "Self":
        """The scene with other loads, on other beams, or with changed arguments of one beam.

        On an unchanged mesh a state of the old scene is a good ``solve_static(start=state)``.
        Raises NameUnknown if an argument or the beam is not known, InputError if the mesh differs
        and a boundary was given by facet numbers, or velocities by DOFs, MeshError if a place or a
        point is not found on the other mesh.

        Parameters
        ----------
        loads
            Loads instead of all loads of the scene, as ``[PointForce((0, -2), at=(1, 0))]``; may
            contain those of ``scene.loads``.
        beams
            As many beams as the scene has, in the same order: boundaries given by a name, a point
            or a function are found again on them.
        **changes
            Arguments of :class:`Beam`, as ``material=...``, ``width=...`` or ``mesh=...``.

        Examples
        --------
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, PointForce, Scene
        >>> from skfem_ancf import StVenantKirchhoff
        >>> soft, stiff = StVenantKirchhoff(1e8, 0.3), StVenantKirchhoff(2e8, 0.3)
        >>> beam = Beam(MeshBeam.init_line([0, 1], 0.01), ElementBeamCable(5), soft, width=0.01)
        >>> scene = Scene(beam).clamp("left").point_force((0, -1e-3), at=(1, 0))
        >>> other = scene.replace(material=stiff, loads=[PointForce((0, -2e-3), at=(1, 0))])
        >>> state = other.solve_static(start=scene.solve_static())
        """
        with self._lock:
            if changes or (loads is None and beams is None):
                k = self.layout.beams.index(select_beam(self.beams, beam))
                beams = list(self.beams if beams is None else beams)
                try:
                    beams[k] = beams[k].replace(**changes)
                except NameUnknown as error:
                    if error.name in changes:  # arguments of the scene are known, too
                        error = NameUnknown(error.kind, error.name,
                                            ["loads", "beams", *error.known])
                    raise error from None
            scene = self if beams is None else self._on(beams)
            if loads is None:
                return scene
            given = loads if isinstance(loads, (list, tuple)) else [None]
            refuse(not all(isinstance(one, Load) for one in given), "loads must be a list of "
                   "Loads, as [PointForce((0, -2), at=(1, 0))], got {!r}", loads)
            scene = copy(scene)
            # nodes of a frame have no bound parts before it is solved
            scene._entries = tuple(entry for entry in scene._entries if not all(
                isinstance(one, Load) for one in entry.bound or (entry.given,)))
            scene._put(*loads)
            return scene

    def plan(self, kind: str = "static") -> Plan:
        """Which elements, solver and scheme a solution takes, and why; ``print`` it.

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
        >>> print(plan["linear solver"])
        banded Cholesky, half bandwidth 15
        """
        with self._lock:
            return make_plan(self.system, kind)

    def solve_linear(self) -> State:
        """The small-displacement solution: one assembly, one factorisation.

        All quantities of the State are linear in the load: strain and stress of small
        displacements, rotations, section forces, reactions on the undeformed body; the strain
        energy is ``u . K u / 2``. Loads keep the direction of the reference configuration.
        ``state.stability`` is None, see :meth:`buckling`; ``state.checks`` tells whether rotations
        are small; ``state.base`` is the reference configuration. Raises SupportError if a rigid
        motion is not constrained, InputError if the solution penetrates an obstacle.
        """
        with self._lock:
            system = self.system
            warn_of_points(system)
            system.constraints.require_supports()
            zero, none = np.zeros(system.N), np.zeros(system.constraints.m)
            system.assemble(zero, 1.0, geometric=False)
            system.solver.factorize(zero, 1.0, none)
            u, multipliers = np.zeros(system.N), none
            u[system.constraints.fixed] = system.constraints.values(1.0)
            gap = system.constraints.constraint(zero, 1.0)
            J = system.constraints.full_jacobian(zero, 1.0)
            # refine with residuals from strains: the stiffness has round-off in bending
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

    def solve_static(self, start: State | None = None, adapt: float | None = None, *,
                     method: str = "auto", tol: float = 1e-8, max_iterations: int = 30,
                     first_step: float = 1.0, min_step: float = 1e-4, stable: bool = True,
                     progress: bool | None = None, goal: str = GOALS[0],
                     max_elements: int = MOST_ELEMENTS, max_degree: int = DEGREES[-1]) -> State:
        """The equilibrium under full load.

        Raises SupportError if a rigid motion is not constrained, ConvergenceError if there is no
        convergence; its ``state`` is the last converged State.

        Parameters
        ----------
        start
            A State to start from, of this scene or of one with equal meshes and elements; the
            reference configuration by default. :meth:`state` makes one from DOFs.
        adapt
            Tolerance of the error: raise the degree of elements where the solution is smooth,
            refine the meshes elsewhere. The State has the refined beams, the estimate
            ``error_estimate`` and the ``refinements``.
        method, tol, max_iterations, first_step, min_step, progress
            As for :func:`skfem_ancf.solvers.solve_static`.
        stable
            Return stable equilibria only; with False any equilibrium at the end of the load steps,
            see ``state.stability``.
        goal, max_elements, max_degree
            For ``adapt``: the error of the "displacement" or of the "strain", see
            :func:`skfem_ancf.scene.solve.solve_adaptive`; limits of refinement.

        Warns
        -----
        StabilityWarning
            If the path loses stability before the full load and another equilibrium was found, or
            if the equilibrium is unstable under loads without a potential.
        ModelWarning
            If a fibre is compressed beyond the range of the law, or the mesh is too coarse.
        """
        find = partial(newton.solve_static, method=method, tol=tol, max_iterations=max_iterations,
                       first_step=first_step, min_step=min_step, progress=progress, stable=stable)
        with self._lock:
            if adapt is None:
                refuse((goal, max_elements, max_degree) != (GOALS[0], MOST_ELEMENTS, DEGREES[-1]),
                       "goal=, max_elements= and max_degree= need adapt=, a tolerance")
                system = self.system
                u = None if start is None else displacement(system, start)
                state = solve_static(system, u, system.histories.of_state(start), find)
            else:
                refuse(start is not None, "an adaptive solution begins at the reference "
                       "configuration: give adapt= without start=")
                state = solve_adaptive(self, adapt, max_elements, goal, max_degree, find)
            warn_of(state)
            return state

    plot = plot_scene

    def explore(self, load: "PointForce | Callable[[float], Item | Scene]",
                interval: ArrayLike = (0.0, 1.0), value: float | None = None, *, title: str = "",
                field: Any = None, limits: ArrayLike | None = None,
                thickness: float | str = "auto", off_screen: bool | None = None,
                window_size: tuple[int, int] = (1000, 700)) -> Explorer:
        """A pyvista view in which the equilibrium follows a slider, or a force that is dragged.

        Parameters
        ----------
        load
            A function of a number that returns an additional item, as a load, or another scene of
            the same meshes: a slider sets the number. Or an additional PointForce: its arrow is
            dragged by the handle at its tip.
        interval, value, title
            Ends of the slider, shape (2,), its start, by default the end, and its name.
        field, limits, thickness, off_screen, window_size
            As for :func:`skfem_ancf.visuals.pyvista.view`. Default limits are those of the states
            at the ends and at the start.

        Returns
        -------
        Explorer
            ``explorer.plotter.show()`` opens a window, or a cell of a notebook (by
            ``pip install 'pyvista[jupyter]'``).
        """
        def solve(x, start):
            made = PointForce(x, *at) if dragged else ask("load({:g})", load, x)
            scene = made if isinstance(made, Scene) else copy(self).add(made)
            try:
                return scene.solve_static(start=start)
            except (InputError, ConvergenceError):  # the start may be the cause
                return scene.solve_static()

        dragged = isinstance(load, PointForce)
        at = (load.at, load.beam) if isinstance(load, PointForce) else ()
        picture: dict[str, Any] = dict(field=field, limits=limits, thickness=thickness,
                                       off_screen=off_screen, window_size=window_size)
        if isinstance(load, PointForce):
            made = Explorer(solve, [require_finite("the force", load.total, (2,))], **picture)
            made.arrow(lambda state: state.position(*at))
            return made
        require_function("load", load, "of a number that returns an item or a scene")
        low, high = require_finite("interval", interval, (2,))
        value = high if value is None else require_finite_scalar("value", value)
        refuse(not low <= value <= high or low == high, "interval must be two numbers that grow, "
               "with value between, got {!r} and {:g}", interval, value)
        made = Explorer(solve, [low, high, value], **picture)
        made.slider(low, high, title)
        return made

    def state(self, u: ArrayLike | None = None, multipliers: ArrayLike | None = None,
              load: float = 1.0) -> State:
        """A State of this scene with a given displacement, as a start of solutions or for output.

        It is not an equilibrium: ``converged`` is False.

        Parameters
        ----------
        u
            Displacement of the DOFs from the reference configuration, beam after beam, shape (N,);
            zero by default.
        multipliers
            Lagrange multipliers of the joints, shape (m,); zero by default.
        load
            Load factor, for modes about the state and its reactions.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
        >>> scene = Scene(Beam(MeshBeam.init_line([0, 0.5, 1], height=0.1), ElementBeamANCF(1),
        ...                    StVenantKirchhoff(E=1.0, nu=0.3), width=0.1))
        >>> scene.state(np.tile([0.0, 0.2, 0, 0, 0, 0], 3)).displacement((1, 0)).round(6).tolist()
        [0.0, 0.2]
        """
        system = self.system
        u = np.zeros(system.N) if u is None else np.array(require_finite("u", u, (system.N,)))
        if multipliers is not None:
            m = system.constraints.m
            multipliers = np.array(require_finite("multipliers", multipliers, (m,)))
        return State(system, u, require_finite_scalar("load", load), converged=False,
                     message="given coordinates", multipliers=multipliers)

    def continuation(self, branch: CriticalPoint | None = None, *, steps: int = 100,
                     ds: float = 0.02, ds_max: float | None = None, max_load: float | None = None,
                     until: Callable[[Point], bool] | None = None, tol: float = 1e-8,
                     max_iterations: int = 15, locate: float | None = 1e-8, side: int = 1,
                     progress: bool | None = None) -> Path:
        """The equilibrium path through limit and snap-back points, by arc length.

        Raises InputError if an argument is out of range or the branch point belongs to another
        scene, ConvergenceError if the path cannot be followed further; its ``state`` is the Path so
        far.

        Parameters
        ----------
        branch
            A bifurcation in the ``critical_points`` of a path of this scene: follow the branch
            there.
        steps, ds, ds_max, max_load, until, tol, max_iterations, locate, side, progress
            As for :func:`skfem_ancf.solvers.continuation`.

        Examples
        --------
        Buckling of a column at pi^2 E I / (4 L^2), with both paths:

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
        with self._lock:
            system = self.system
            system.constraints.require_supports()
            system.forces.contacts.require_path()
            system.forces.contacts.require_clear(np.zeros(system.N), 0.0)
            if branch is not None:
                refuse(not isinstance(branch, CriticalPoint) or branch.kind != "bifurcation",
                       "branch must be a bifurcation of path.critical_points, got {!r}", branch)
                refuse(branch.state.system is not system, "the branch point belongs to another "
                       "scene, or to this one before it was changed")
            try:
                return Path(system, *continuation(
                    system, steps, ds, ds_max, max_load, until, tol, max_iterations, locate,
                    branch, side, progress))
            except (ConvergenceError, Interrupted) as error:
                raise type(error)(str(error), Path(system, *error.state)) from None

    def linearize(self, state: State | None, inputs: Sequence[Any],
                  outputs: Sequence[str | Sensor] | None = None) -> LinearModel:
        """A linear model about a state, for control, transfer functions and frequency responses.

        Raises InputError if an input or output cannot be linearised, or the state moves.

        Parameters
        ----------
        state
            A State at rest, prestress and contact included; None for the reference configuration.
        inputs
            What acts beside the loads of the scene: Loads, as ``PointForce((0, 1), at=(1, 0))``,
            ``Temperature(1.0)`` or ``Motor("left", torque=1.0)``, each a unit input; or joints of
            the scene that prescribe a motion, as returned by :meth:`joint`, whose position or
            angle is the input. A list, or a dict with their names.
        outputs
            Names of sensors of the scene, see :meth:`sensor`; all of them by default.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import (Beam, ElementBeamCable, KelvinVoigt, MeshBeam, PointForce,
        ...                         Scene, StVenantKirchhoff)
        >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.01), ElementBeamCable(5),
        ...             StVenantKirchhoff(2e8, 0.3, 7800), width=0.01, damping=KelvinVoigt(1e-3))
        >>> scene = Scene(beam).clamp("left").sensor("tip", "displacement", at=(1, 0))
        >>> model = scene.linearize(None, [PointForce((0, 1), at=(1, 0))])
        >>> A, B, C, D, T = model.state_space(modes=3)
        >>> poles = np.sort_complex(np.linalg.eigvals(A))
        >>> bool(np.all(poles.real < 0)), A.shape, C.shape
        (True, (6, 6), (2, 6))
        """
        with self._lock:
            about = self.state(load=0.0) if state is None else state
            return LinearModel(self.system, configuration(self.system, about),
                               list(self._inputs(inputs)), self._located(outputs))

    def frequency_response(self, frequencies: ArrayLike, inputs: Sequence[Any],
                           outputs: Sequence[str | Sensor] | None = None,
                           about: State | None = None, modes: int | None = None
                           ) -> FrequencyResponse:
        """The response to harmonic inputs, with the damping of the scene.

        Parameters
        ----------
        frequencies
            Angular frequencies in rad/s, shape (n,).
        inputs, outputs, about
            As for :meth:`linearize`; ``about`` is the state.
        modes
            Superpose this number of lowest modes and the static response of all others; by default
            the response is direct, one factorisation for each frequency.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import (Beam, ElementBeamCable, KelvinVoigt, MeshBeam, PointForce,
        ...                         Scene, StVenantKirchhoff)
        >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.01), ElementBeamCable(5),
        ...             StVenantKirchhoff(2e8, 0.3, 7800), width=0.01, damping=KelvinVoigt(1e-3))
        >>> scene = Scene(beam).clamp("left").sensor("tip", "displacement", at=(1, 0))
        >>> response = scene.frequency_response([0.0, 3.0], [PointForce((0, 1), at=(1, 0))])
        >>> float(response.of("tip 1")[0].real.round(4))                    # 4 L^3 / (E b h^3)
        2.0
        """
        return self.linearize(about, inputs, outputs).frequency_response(frequencies, modes)

    def initial_velocity(self, v: ArrayLike | Callable[[Array], Array],
                         beam: WhichMember = None) -> "Self":
        """The velocity at the start of :meth:`integrate`.

        Components that violate supports and joints are removed by impulses.

        Parameters
        ----------
        v
            The velocity of all points, shape (2,), or a function of points x, shape (2, ...), of
            the reference configuration that returns velocities (2, ...); or velocities of the
            degrees of freedom, shape (beam.N,). For a rigid body the function is evaluated at its
            centre of mass and near it.
        """
        with self._lock:
            k = self.layout.number(beam)
            member, found = self.layout.members[k], v
            function: Any = v
            uniform = (isinstance(v, (list, tuple)) and len(v) == 2) or (
                getattr(v, "shape", None) == (2,))
            if uniform or callable(v):
                constant = require_finite("v", v, (2,)) if uniform else np.zeros(2)

                def field(x: Array) -> Array:
                    return np.multiply.outer(constant, np.ones(x[0].shape)) if uniform else (
                        ask_field("v(x)", function, x))

                found = projected(member, field) if isinstance(member, Beam) else (
                    member.velocity_of(field))
            found = require_finite("v", found, (member.N,))
            self._velocities = {**self._velocities, k: (v, found)}
        return self

    @property
    def _velocity(self):
        """The initial velocity, shape (N,)."""
        return np.concatenate([self._velocities[k][1] if k in self._velocities else np.zeros(b.N)
                               for k, b in enumerate(self.layout.members)])

    def integrate(self, t_end: float, dt: float | str,
                  scheme: str | Scheme | type[Scheme] = "energy-momentum",
                  start: State | None = None, *, t_start: float | None = None,
                  t_eval: ArrayLike | None = None, tol: float | None = None, rtol: float = RTOL,
                  breakpoints: ArrayLike = (), until: Callable[[State], float] | None = None,
                  checkpoint: StrPath | None = None, every: int | None = None,
                  check: bool = False, progress: bool | None = None) -> History:
        """The motion from the reference configuration, or from a given state.

        Parameters
        ----------
        t_end
            Time at the end.
        dt
            Step size, or "auto": controlled by an error estimate, see ``rtol``. Functions of time
            are sampled at 4097 times, so that no step skips an event longer than the sampling
            interval; give ``breakpoints`` for shorter ones.
        scheme
            A scheme, a name from :data:`skfem_ancf.dynamics.SCHEMES`, or "auto": chosen by joints,
            damping, stiffness, contact and ``rtol``, see :meth:`plan`.
        start
            A State to start from, or None for the reference configuration. An instant of a motion
            (``history.state(k)``) continues with its velocity and time; any other State starts with
            the scene's :meth:`initial_velocity`.
        t_start
            Time at the start; by default that of ``start``, or 0.
        t_eval
            Times to store, shape (n,); every step by default. An instant within a step is computed
            by a shorter step from the same start, without effect on the motion.
        tol
            Relative error of the iteration in a step, in the energy norm; that of the scheme by
            default.
        rtol
            Tolerance of ``dt="auto"``: the error of the displacement per step, relative to the size
            of the scene and in proportion to the step size. Of motions that are small beside the
            scene it is at most 100 ``rtol`` of their largest mean displacement. The global error
            may be larger: ``check`` measures it.
        breakpoints
            Times, shape (n,), at which loads or motions jump or have a kink: a step ends there with
            the values before, and the next one starts with the values after.
        until
            A function of the State that returns a number: the motion ends where it changes its
            sign, within a step; ``history.event`` is the time. It is evaluated after each step: two
            changes within one step are not detected. Not with ``checkpoint``.
        checkpoint
            A file (``.npz``) for checkpoints, from which :meth:`resume` continues.
        every
            Steps between two checkpoints; by default a minute, with at most a twentieth of the time
            spent on writing.
        check
            Integrate again with half the step size: ``history.error`` is the largest difference at
            the stored instants. Not with ``checkpoint``.

        Raises
        ------
        ConvergenceError
            If a step fails; its ``state`` is the History so far.
        Interrupted
            On Ctrl-C; its ``state`` is the History so far.

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
        with self._lock:
            u = None if start is None else displacement(self.system, start)
            if isinstance(scheme, str) and scheme == "auto":
                scheme = choose_scheme(self.system, require_positive("rtol", rtol)).scheme
            return integrate(self.system, get_scheme(scheme), start, u, self._velocity,
                             self._located(), progress, until, check, checkpoint, every, t_start,
                             t_end=t_end, dt=dt, t_eval=t_eval, tol=tol, rtol=rtol,
                             breakpoints=breakpoints)

    def run(self, steps: Steps | ArrayLike, increments: int = 20, start: State | None = None, *,
            tol: float = 1e-8, max_iterations: int = 30, min_step: float = 1e-4,
            stable: bool = True, progress: bool | None = None) -> StepHistory:
        """Quasi-static steps: equilibria over time, each from the previous one.

        Loads, supports, temperatures, obstacles and joints follow their functions of time, as in a
        motion, without inertia. Friction depends on the history. An increment that fails is cut.
        Where the path ends (a snap), the strategies of :meth:`solve_static` lead to another
        equilibrium, and ``history.jumps`` has the time.

        Parameters
        ----------
        steps
            :class:`~skfem_ancf.Steps` with names, or the time at the end, or several times at
            which an increment ends.
        increments
            Number of equal increments of each step, whose ends are instants of the history. Cuts
            add instants between them.
        start
            A State to begin with, or None for the equilibrium at the time 0. An instant of a
            history goes on from its time, other states from 0. It may be one of a scene of the
            same beams with other supports, joints and loads, as the previous phase of an assembly.
            Forces of removed supports and joints are reduced in load steps.
        tol, max_iterations, stable, progress
            As for :meth:`solve_static`.
        min_step
            The smallest increment, relative to the largest.

        Raises
        ------
        ConvergenceError
            If no equilibrium is found; its ``state`` is the StepHistory so far.
        Interrupted
            On Ctrl-C; its ``state`` is the StepHistory so far.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, Steps, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.01), ElementBeamANCF(2),
        ...             StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)
        >>> steps = Steps(load=1.0, unload=1.0)
        >>> scene = Scene(beam).clamp("left").point_force(
        ...     (0, -0.1), at="right", amplitude=steps.ramp(load=1.0, unload=0.0))
        >>> history = scene.run(steps, increments=4)
        >>> history.displacement((1, 0)).shape, bool(abs(history.u[-1]).max() < 1e-9)
        ((9, 2), True)
        """
        with self._lock:
            system = self.system
            system.constraints.require_independent_joints()
            if system.constraints.adrift:
                system.constraints.require_supports()
            warn_of_points(system)
            return run(system, steps, increments, start, self._located(), tol=tol,
                       max_iterations=max_iterations, min_step=min_step, stable=stable,
                       progress=progress)

    def sensor(self, name: str, what: str | Callable[[State], Any], at: Any = None,
               beam: WhichBeam = None, recover: bool = False, line: int | None = None) -> "Self":
        """Record a quantity at every step of motions: ``history.sensors[name]``.

        States may then be stored sparsely, by ``integrate(..., t_eval=...)``.

        Parameters
        ----------
        name
            Its name; a second sensor of the same name replaces the first.
        what, at, beam, recover, line
            As for :class:`~skfem_ancf.dynamics.sensors.Sensor`.

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
        refuse(require_label("name", name) is None, "the name of a sensor must be a text, got None")
        sensor = Sensor(what, at, beam, recover, line)
        with self._lock:
            locate(sensor, self.system)
            self._sensors = {**self._sensors, name: sensor}
            if self._system is not None:
                self._system.derivatives = partial(Gradient, copy(self))
        return self

    def _located(self, names=None):
        """Names and sensors, all or some of the scene or given as such."""
        found = dict(self._sensors) if names is None else dict[str, Sensor]()
        for one in names or ():
            found.update({repr(one)[1:-1]: one} if isinstance(one, Sensor) else {
                one: self._sensors[require_option("sensor", one, self._sensors)]})
        for sensor in found.values():
            locate(sensor, self.system)
        return list(found.items())

    def _inputs(self, inputs):
        """For each input its name, the bound Loads, and the joint of the scene, if it is one."""
        named = inputs.items() if isinstance(inputs, dict) else [
            (f"{type(one).__name__} {k}", one) for k, one in enumerate(inputs)]
        for name, item in named:
            joint = next((one for one in self.joints if isinstance(item, Joint) and item.driver
                          and one.same(item)), None)
            loads = self._bound(item).bound if joint is None and isinstance(item, Item) else ()
            refuse(joint is None and not (loads and all(isinstance(one, Load) for one in loads)),
                   "an input is a Load, as PointForce((0, 1), at=(1, 0)), or a joint of the scene "
                   "that prescribes a motion, got {!r}", item)
            yield name, loads, joint

    @property
    def sensors(self) -> dict[str, Sensor]:
        """The sensors by name."""
        return dict(self._sensors)

    def stepper(self, dt: float, inputs: Any = (), scheme: str | Scheme | type[Scheme] =
                "energy-momentum", start: State | None = None) -> Stepper:
        """The motion one step at a time, with inputs that are given at each step.

        Parameters
        ----------
        dt
            Size of a step.
        inputs
            As for :meth:`linearize`: Loads beside those of the scene, whose sizes are constant in a
            step, and joints that prescribe a motion, which goes straight to the value given.
        scheme
            As for :meth:`integrate`, not "auto".
        start
            A State to start from; by default the reference configuration with the
            :meth:`initial_velocity`.

        Examples
        --------
        >>> from skfem_ancf import (Beam, ElementBeamCable, MeshBeam, PointForce, Scene,
        ...                         StVenantKirchhoff)
        >>> scene = Scene(Beam(MeshBeam.init_line([0, 1], 0.01), ElementBeamCable(5),
        ...                    StVenantKirchhoff(2e8, 0.3, 7800), width=0.01)).clamp("left")
        >>> scene = scene.sensor("tip", "velocity", at=(1, 0))
        >>> stepper = scene.stepper(1e-2, {"force": PointForce((0, 1), at=(1, 0))})
        >>> for _ in range(5):
        ...     stepper = stepper.step([0.1 - 0.5 * stepper.readings["tip"][1]])
        """
        with self._lock:
            scene, held = copy(self), dict[str, Held]()
            entries, first = list(self._entries), 0.0 if start is None else start.t or 0.0
            for name, loads, joint in self._inputs(inputs):
                held[name] = one = Held(0.0 if joint is None else getattr(joint, joint.driver)(
                    first), joint is not None)
                if joint is None:
                    entries.append(Entry(loads[0], tuple(
                        load._with(amplitude=one) for load in loads)))
                else:
                    moved = joint._with(**{joint.driver: one})
                    entries = [Entry(e.given, tuple(moved if x is joint else x for x in e.bound))
                               for e in entries]
            scene._entries, scene._system = tuple(entries), None
            return Stepper(scene, get_scheme(scheme), require_positive("dt", dt), held, start,
                           self._velocity)

    def resume(self, path: StrPath, scheme: str | Scheme | type[Scheme] | None = None,
               progress: bool | None = None) -> History:
        """Continue a motion from its checkpoint to its end.

        On the same machine the results are bitwise those of an uninterrupted run if both are
        compiled or both are not, except instants of ``t_eval`` within a step, which agree to the
        tolerance.

        Parameters
        ----------
        path
            The file of ``integrate(..., checkpoint=path)``; writing continues.
        scheme
            The scheme, if it is user-defined.

        Raises
        ------
        CheckpointError
            If the file cannot be read, is damaged, or is of other beams, bodies or meshes. Loads,
            materials and joints are not compared.

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
        return follow(*resume(self.system, path, scheme, self._located()), progress)

    def modes(self, k: int, state: State | None = None) -> Modes:
        """The k lowest natural frequencies and their shapes. A ModelWarning says if the mesh is
        coarse for a frequency: an estimated error above 3 %.

        Parameters
        ----------
        k
            Number of modes.
        state
            The state to linearise about, prestress included; the reference configuration by
            default.

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
        with self._lock:
            start = self.state(load=0.0) if state is None else configuration(self.system, state)
            if state is None:
                self.system.forces.contacts.require_clear(np.array(start.u), 0.0)
            found = eigen.modes(self.system, start, k)
            found.errors = np.full(len(found.frequencies), np.nan)
            if state is None:
                found.errors = frequency_errors(self, found)
            return found

    def buckling(self, k: int = 1, state: State | None = None) -> Buckling:
        """The k lowest buckling load factors and their shapes.

        Raises InputError if there is no positive factor, or loads without a potential cause flutter
        first; if the state is unstable or has other supports, SupportError if a rigid motion is not
        constrained.

        Parameters
        ----------
        k
            Number of factors.
        state
            An equilibrium whose loads are constant, as dead loads: the factors are those on the
            loads of this scene, added to it. It may be one of a scene with the same beams, supports
            and joints and other loads. By default the equilibrium without loads, in which
            prestressed springs act, and energies with ``scaled=False``.

        Examples
        --------
        A cantilever column with a dead load of 40 % of Euler's load carries 60 % more:

        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, PointForce, Scene
        >>> from skfem_ancf import StVenantKirchhoff
        >>> column = Scene(Beam(MeshBeam.init_line([0, 1, 2], 0.01), ElementBeamCable(5),
        ...                     StVenantKirchhoff(12e6, 0.3), width=1.0)).clamp("left")
        >>> euler = np.pi**2 / 16
        >>> dead = column.replace(loads=[PointForce((-0.4 * euler, 0), at=(2, 0))]).solve_static()
        >>> live = column.replace(loads=[PointForce((-euler, 0), at=(2, 0))])
        >>> live.buckling(1, dead).factors.round(3).tolist()
        [0.6]
        """
        with self._lock:
            if state is not None:
                configuration(self.system, state)
            return eigen.buckling(self.system, k, state)
