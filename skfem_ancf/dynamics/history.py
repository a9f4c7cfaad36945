"""What a motion was: times, positions, energies, momenta."""

from __future__ import annotations

from itertools import chain
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, require_finite, require_index, require_path, shown
from ..actions.forces.turns import Turns
from ..core.kept import cached_property
from ..beam.points import require_body
from ..equations.momentum import angular_momentum, momentum
from ..recovery.resultants import over_time
from ..results.points import MaterialPoints
from ..results.state import Reaction, State
from .base import Motion, contacts_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import ArrayLike

    from ..actions.joints.base import Joint
    from ..recovery.resultants import Resultants
    from ..equations.system import System
    from ..core.types import Array, Place, StrPath
    from ..beam.layout import WhichBeam, WhichMember
    from .base import Scheme, Steps

    Columns = tuple[Array, ...]

#: What is stored of a Motion.
COLUMNS = ("t", "u", "v", "acceleration", "algorithmic", "multipliers", "force", "before",
           "dissipated", "turns")
_COLUMNS_OF = attrgetter(*COLUMNS)
#: Attributes of a motion that has ended that are made when one of them is asked for.
_LATE = {"t", "u", "v", "acceleration", "multipliers", "dissipated", "_others", "_memories"}
#: Instants of a picture where none are named.
STROBES = 8


class History(MaterialPoints):
    """A motion at its stored instants.

    Parameters
    ----------
    system, scheme
        What was integrated, and how.
    run
        The :class:`~skfem_ancf.dynamics.run.Run` that stores its instants here.

    Attributes
    ----------
    t
        Times, shape (nt,).
    u, v, acceleration
        Displacement of the coordinates and its rates, shape (nt, N).
    multipliers
        Of the joints, shape (nt, m).
    dissipated
        The work of damping since the start, shape (nt,), which does not fall: in each step that at
        its mean velocity and middle place with the energy-momentum scheme, for which it is exact,
        and with generalized-alpha; by the scheme's own rule with others. What a scheme itself
        damps is not in it.
    sensors
        What the sensors of the scene have read at every step, by name: a
        :class:`~skfem_ancf.dynamics.sensors.Readings` with its times ``t``.
    event
        The time at which ``integrate(until=...)`` has ended it; None if nothing did.
    steps
        Steps of the motion; the instants may be fewer or more.
    substeps
        Parts into which steps that did not converge were cut.
    rejected
        Steps that the automatic step size took again.
    iterations, factorizations
        Residuals solved for, and tangents factorised, in all steps.
    error
        With ``integrate(..., check=True)`` the largest difference of the position of a node or a
        rigid body from that of the same motion in steps half as long, over the size of the scene;
        NaN where these steps have failed. None without a check.
    """

    COLUMNS = COLUMNS
    t: Array
    u: Array
    v: Array
    acceleration: Array
    multipliers: Array
    dissipated: Array
    _others: tuple[Array, ...]
    _memories: list[Sequence[Any]]

    def __init__(self, system: System, scheme: Scheme, run: Any) -> None:
        self.system, self.scheme, self._run = system, scheme, run
        self.error: float | None = None
        self._rows: list[Motion] = []  # behind those of the blocks
        self._blocks: list[tuple[Columns, Sequence[Any]]] = []
        self._kept: Any = None
        self._turns = Turns(system)

    def append(self, y: Motion) -> None:
        """Store an instant."""
        self._rows.append(y)

    def extend(self, taken: Steps) -> None:
        """Store the instants after some steps."""
        if self._rows:
            self._blocks, self._rows = self._stored(), []
        self._blocks.append((taken.columns(), taken.memories))

    def _stored(self):
        """All of it in blocks: columns in their order, and memories."""
        if not self._rows:
            return self._blocks
        columns = tuple(map(np.array, zip(*map(_COLUMNS_OF, self._rows))))
        return [*self._blocks, (columns, [y.memory for y in self._rows])]

    def _remembered(self):
        """The memories of all of it, in the same blocks."""
        return [*(memories for _, memories in self._blocks), [y.memory for y in self._rows]]

    def _end(self):
        """The time of the last instant that is stored; -inf before the first."""
        if self._rows:
            return self._rows[-1].t
        if not self._blocks:
            return -np.inf
        (times, *_), _ = self._blocks[-1]
        return times[-1]

    def end(self, y: Motion) -> None:
        """Store the last instant, if it is not stored."""
        if self._end() < y.t:
            self._rows.append(y)

    def columns(self) -> dict[str, Array]:
        """What was stored, as arrays by their names in :attr:`COLUMNS`."""
        stored = self._stored()
        if not stored:
            N, m = self.system.N, self.system.constraints.m
            sizes = {"t": (), "before": (), "dissipated": (), "multipliers": (m,), "force": (m,),
                     "turns": (self._turns.number,)}
            return {name: np.zeros((0, *sizes.get(name, (N,)))) for name in self.COLUMNS}
        columns = zip(*(columns for columns, _ in stored))
        return dict(zip(self.COLUMNS, map(np.concatenate, columns)))

    def restore(self, columns: dict[str, Array], memories: Sequence[Any]) -> None:
        """Fill an empty History with what :meth:`columns` gave.

        Parameters
        ----------
        columns
            Arrays by their names in :attr:`COLUMNS`.
        memories
            What the scheme kept at each instant, :attr:`memories`.
        """
        self._blocks.append((tuple(columns[name] for name in self.COLUMNS), memories))

    @property
    def memories(self) -> list[Any]:
        """What the scheme itself kept at each instant."""
        return list(chain.from_iterable(self._remembered()))

    def close(self) -> History:
        """Nothing more comes: what was stored are arrays from now on."""
        run = self._run
        self.event, self.sensors = run.event, run.recorder.readings()
        if run.y is not None and self._end() == run.y.t:
            self._kept = run.remember()  # of the last instant: the factors too
        self.steps, self.rejected = run.steps, run.rejected
        self.iterations = run.integrator.iterations
        self.factorizations = run.integrator.factorizations
        self.substeps = run.integrator.substeps
        self._run = None
        return self

    def __getattr__(self, name):
        """Arrays are made of what was stored where one of them is asked for."""
        made = vars(self)
        if name not in _LATE or made.get("_run", self) is not None:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        columns, memories = self.columns(), self._remembered()
        if name not in made:  # another thread may have made them
            made["_others"] = tuple([columns.pop(x) for x in ("algorithmic", "force", "before",
                                                                  "turns")])
            made.update(columns, _memories=memories)
            self._blocks, self._rows = [], []
        return made[name]

    def __len__(self):
        return len(self.t)

    def __repr__(self):
        span = f", t = {self.t[0]:g} to {self.t[-1]:g}" if len(self) else ""
        cut = "".join(f", {n} {what}" for n, what in (
            (self.substeps, "substeps"), (self.rejected, "rejected")) if n)
        return (f"<History of {len(self)} instants{span}, {self.scheme!r}, {self.steps} steps"
                f"{cut}, {self.iterations} iterations, {self.factorizations} factorisations>")

    def state(self, k: int) -> State:
        """The instant ``k`` as a State: strain, reactions (inertia included), plots, files.

        It has the velocity too, and what the scheme needs to go on: :meth:`Scene.integrate
        <skfem_ancf.Scene.integrate>` from it (``start=``) continues the motion.
        """
        k = require_index("k", k, len(self))
        algorithmic, force, before, turns = (x[k] for x in self._others)
        motion = Motion(float(self.t[k]), self.u[k], self.v[k], self.acceleration[k], algorithmic,
                        self.multipliers[k], force, float(before), self._memory(k),
                        float(self.dissipated[k]), turns)
        return self.instant(motion, self._kept if k == len(self) - 1 else None)

    def _memory(self, k):
        for memories in self._memories:
            if k < len(memories):
                return memories[k]
            k -= len(memories)

    def instant(self, motion: Motion, kept: Any = None) -> State:
        """A Motion of this system as a State.

        Parameters
        ----------
        motion
            The :class:`~skfem_ancf.dynamics.base.Motion`.
        kept
            What its run kept there, or None.
        """
        inertia, memory = self.system.mass.multiply(motion.acceleration), contacts_of(motion)
        if self.system.damped:
            with self.system.forces.contacts.lent(memory):
                inertia = inertia + self.system.damping_force(motion.u, motion.v, motion.t)
        return State(self.system, motion.u, load=1.0, converged=True, t=motion.t,
                     message=f"t = {motion.t:g}", multipliers=motion.multipliers,
                     inertia=inertia, acceleration=motion.acceleration, motion=motion,
                     origin=(self.scheme, kept), memory=memory)

    def states(self, instants: Iterable[int] | None = None) -> Iterator[State]:
        """States one after the other.

        Parameters
        ----------
        instants
            Their numbers, shape (n,); all by default.

        Returns
        -------
        iterator of State
        """
        return map(self.state, range(len(self)) if instants is None else [
            require_index("instants", k, len(self)) for k in _numbers(instants)])

    def __iter__(self):
        return self.states()

    # at material points

    def angle(self, body: WhichMember) -> Array:
        """The angle of a rigid body at all instants, in radians, shape (nt,); turns are counted.

        Parameters
        ----------
        body
            The RigidBody, its name or its number.
        """
        found = require_body(self.system, body)
        k = self._turns.moments + self.system.bodies.index(found)
        return found.angle + self._others[-1][:, k]

    def strain(self, point: ArrayLike, beam: WhichBeam = None, recover: bool = True,
               line: int | None = None) -> Array:
        """Strain (eps_xx, eps_yy, eps_xy) at all instants, (nt, 3) or (nt, 3, n).

        Parameters are those of :meth:`State.strain <skfem_ancf.results.State.strain>`.

        Parameters
        ----------
        point
            One point, shape (2,), or many, as for :meth:`displacement`.
        beam
            The beam, its name or its number; found if it is not given.
        recover, line
            As for :meth:`State.strain <skfem_ancf.results.State.strain>`.
        """
        at = self.system.points.find(point, beam, line, ask=True)
        return np.array([state.strain(at, recover=recover) for state in self])

    def stress(self, point: ArrayLike, beam: WhichBeam = None, recover: bool = True,
               line: int | None = None) -> Array:
        """Second Piola-Kirchhoff stress at all instants, (nt, 3) or (nt, 3, n).

        Parameters are those of :meth:`State.strain <skfem_ancf.results.State.strain>`.

        Parameters
        ----------
        point
            One point, shape (2,), or many, as for :meth:`displacement`.
        beam
            The beam, its name or its number; found if it is not given.
        recover, line
            As for :meth:`State.strain <skfem_ancf.results.State.strain>`.
        """
        at = self.system.points.find(point, beam, line, ask=True)
        return np.array([state.stress(at, recover=recover) for state in self])

    def field(self, field: Any, point: ArrayLike, beam: WhichBeam = None,
              recover: bool = True, line: int | None = None) -> Array:
        """Any field at all instants.

        Parameters
        ----------
        field, beam, recover, line
            Those of :meth:`State.field <skfem_ancf.results.State.field>`.
        point
            One point, shape (2,), or many, shape (2, n) or a list.

        Returns
        -------
        ndarray
            Shape (nt, ...).
        """
        at = self.system.points.find(point, beam, line, ask=True)
        return np.array([state.field(field, at, recover=recover) for state in self])

    def resultants(self, at: ArrayLike, beam: WhichBeam = None, recover: bool = True,
                   line: int | None = None) -> Resultants:
        """Section forces and strains of the axis at all instants.

        Parameters
        ----------
        at
            Points through which the sections go: one, shape (2,), or many, shape (2, n) or a list.
        beam, recover, line
            Those of :meth:`State.resultants <skfem_ancf.results.State.resultants>`.

        Returns
        -------
        Resultants
            Its arrays begin with the axis of the instants, (nt,) or (nt, n).
        """
        found = self.system.points.find(at, beam, line, ask=True)
        return over_time([state.resultants(found, recover=recover) for state in self])

    def joint_force(self, joint: Joint) -> Array:
        """What a joint does to its first beam at all instants, shape (nt, m)."""
        return np.array([state.joint_force(joint) for state in self])

    def reactions(self, boundary: Place | None, beam: WhichMember = None) -> Reaction:
        """What the supports at a boundary do to the beam at all instants.

        Parameters
        ----------
        boundary, beam
            Those of :meth:`State.reactions <skfem_ancf.results.State.reactions>`.

        Returns
        -------
        Reaction
            Of arrays: the force has the shape (nt, 2), the moment and each coordinate (nt,).

        Examples
        --------
        What the pin of a pendulum carries:

        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line([0, 1], height=0.01), ElementBeamCable(5),
        ...             StVenantKirchhoff(E=2e11, nu=0.3, density=1e4), width=0.01)
        >>> history = Scene(beam).pin("left").gravity((0, -8)).integrate(t_end=0.01, dt=1e-3)
        >>> history.reactions("left").force.shape
        (11, 2)
        """
        force, moment, names = zip(*(state.reactions(boundary, beam) for state in self))
        return Reaction(np.array(force), np.array(moment),
                        {name: np.array([at[name] for at in names]) for name in names[0]})

    # of the whole

    @cached_property
    def strain_energy(self) -> Array:
        """Strain energy, with the potential of force elements, shape (nt,)."""
        system, contacts = self.system, self.system.forces.contacts
        out = np.zeros(len(self)) + system.energy_of_beams(self.u)
        if system.forces.elements:
            for k, memory in enumerate(chain.from_iterable(self._memories)):
                with contacts.lent((memory or {}).get("contacts")):
                    out[k] += system.energy_of_forces(self.u[k], self.t[k])
        return out

    @cached_property
    def kinetic_energy(self) -> Array:
        """Kinetic energy, shape (nt,)."""
        return np.array([0.5 * v @ self.system.mass.multiply(v) for v in self.v])

    @cached_property
    def potential_energy(self) -> Array:
        """Potential of the loads, zero in the stress-free state, shape (nt,).

        That of moments counts whole turns, which are followed from step to step.
        """
        return np.array([self.system.load_potential(u, t, turned) for u, t, turned in zip(
            self.u, self.t, self._others[-1])])

    @property
    def total_energy(self) -> Array:
        """Sum of the three energies, shape (nt,); with :attr:`dissipated` it stays the same."""
        return self.strain_energy + self.kinetic_energy + self.potential_energy

    @cached_property
    def momentum(self) -> Array:
        """Linear momentum, shape (nt, 2)."""
        return np.array([momentum(self.system, v) for v in self.v])

    @cached_property
    def angular_momentum(self) -> Array:
        """Angular momentum about the origin of the coordinates, shape (nt,)."""
        return np.array([angular_momentum(self.system, u, v) for u, v in zip(self.u, self.v)])

    # files and pictures

    def _repr_html_(self):
        from ..visuals.html import history_html

        return history_html(self)

    def to_pyvista(self, **options: Any) -> Any:
        """One mesh of pyvista that takes every instant, in place.

        Parameters
        ----------
        **options
            Those of :func:`skfem_ancf.visuals.pyvista.to_pyvista`.

        Returns
        -------
        Series
            Its ``mesh`` is at the first instant, ``update(k)`` puts it at another, see
            :class:`skfem_ancf.visuals.pyvista.Series`.
        """
        from ..visuals.pyvista import Series

        return Series(self, **options)

    def plot(self, field: Any = "eps_yy", times: ArrayLike | None = None, **options: Any) -> Any:
        """Draw the body at several times in one picture, as a stroboscope shows it.

        Parameters
        ----------
        field
            What it is coloured by, as for :func:`skfem_ancf.visuals.matplotlib.plot_state`.
        times
            Of each the stored instant that is nearest is drawn, shape (n,); by default eight, from
            first to last.
        **options
            Those of :func:`skfem_ancf.visuals.matplotlib.plot_state`.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.01), ElementBeamCable(),
        ...             StVenantKirchhoff(E=2e8, nu=0.3, density=7800), width=0.01)
        >>> history = Scene(beam).pin("left").gravity((0, -9.81)).integrate(0.1, 0.01)
        >>> history.plot("displacement", times=[0, 0.05, 0.1]).get_xlabel()
        'x'
        """
        from ..visuals.matplotlib import plot_state

        if not len(self):
            raise InputError("the history has no instants")
        first, last = self.t[0], self.t[-1]
        wanted = np.linspace(first, last, STROBES) if times is None else np.ravel(
            require_finite("times", times))
        if not len(wanted) or wanted.min() < first or wanted.max() > last:
            raise InputError(f"times must be instants of the motion, from {first:g} to {last:g}, "
                             f"at least one; got {shown(times)}")
        instants = np.unique(np.argmin(np.abs(self.t - wanted[:, None]), axis=1))
        return plot_state(list(self.states(instants)), field, **options)

    def animate(self, filename: StrPath, field: Any = "eps_yy", **options: Any) -> Any:
        """Write a film; see :func:`skfem_ancf.visuals.animation.animate`.

        Parameters
        ----------
        filename
            Ends with .gif or .mp4.
        field
            The field that colours the body.
        **options
            Those of :func:`skfem_ancf.visuals.animation.animate`.
        """
        from ..visuals.animation import animate

        return animate(self, filename, field, **options)

    def save(self, filename: StrPath, progress: bool | None = None, **options: Any) -> None:
        """Write a time series for ParaView.

        Parameters
        ----------
        filename
            Ends with .pvd, for a list and one .vtu for each instant, or with .vtkhdf, for one file
            with all of them, in which the cells are stored once.
        progress
            Show a progress bar: True, False, or None for "if it takes long".
        **options
            Those of :func:`skfem_ancf.io.vtu.save_vtu`.
        """
        from ..io.pvd import PvdWriter
        from ..io.vtkhdf import VtkHdfWriter
        from ..core.progress import progress_bar

        path = require_path("filename", filename, (".pvd", ".vtkhdf"))
        kind = VtkHdfWriter if path.suffix.lower() == ".vtkhdf" else PvdWriter
        with kind(path, **options) as writer, progress_bar(
                progress, total=len(self), desc="files") as bar:
            writer.extend(self, lambda: bar.update(1))


def _numbers(instants):
    if isinstance(instants, (str, bytes, dict, set)) or not hasattr(instants, "__iter__"):
        raise InputError(f"instants must be a list of their numbers, got {shown(instants)}")
    return instants
