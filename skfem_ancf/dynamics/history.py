"""The result of a time integration, its momentum and its energy."""

from collections.abc import Iterable, Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..actions.forces.springs import Turns
from ..actions.joints.base import Joint
from ..beam import WhichBeam, WhichMember, require_body
from ..core import (Array, ArrayLike, Place, StrPath, progress_bar, refuse, require_finite,
                    require_index)
from ..equations.system import System
from ..io import PvdWriter, to_xarray
from ..recovery.resultants import Resultants, over_time
from ..results.output import history_html, report_of_history, total_force
from ..results.state import MaterialPoints, Reaction, State
from ..visuals.matplotlib import animate, plot_curve, plot_state
from ..visuals.pyvista import Series
from .base import Motion, Motions, Scheme
from .sensors import Readings


# linear and angular momentum of a scene

def momentum(system: System, v: Array) -> Array:
    """Linear momentum of a velocity (N,), shape (2,)."""
    return total_force(system, v, system.mass.multiply(v))[:2]


def angular_momentum(system: System, u: Array, v: Array) -> float:
    """Angular momentum about the origin, for displacement and velocity (N,)."""
    return float(total_force(system, u, system.mass.multiply(v))[2])


#: Number of states whose fields are recovered together.
TOGETHER = 32


def state_of(system: System, scheme: Scheme, y: Motion, arrays: Any = None) -> State:
    """The State of a Motion, with the arrays for continuing the run, or None."""
    inertia = np.zeros(system.N)
    if np.any(y.acceleration):  # a quasi-static run needs no density
        inertia = system.mass.multiply(y.acceleration)
    if system.damped:
        inertia = inertia + system.after(y.history).damping_force(y.u, y.v, y.t)
    return State(system, y.u, load=1.0, converged=True, t=y.t, message=f"t = {y.t:g}",
                 multipliers=y.multipliers, inertia=inertia, acceleration=y.acceleration, motion=y,
                 origin=(scheme, arrays), memory=y.history)


class History(MaterialPoints):
    """A motion at its stored instants.

    Parameters
    ----------
    system, scheme
        The system that was integrated, and the scheme.
    columns
        Stored arrays (nt, ...) by the names of the attributes of Motion.
    last
        The last instant and the arrays for continuing the run; either may be None.
    sensors, counts
        As below; the latter by name.

    Attributes
    ----------
    t
        Times, shape (nt,).
    u, v, acceleration
        Displacement, velocity and acceleration of the degrees of freedom, shape (nt, N).
    multipliers
        Lagrange multipliers of the joints, shape (nt, m).
    dissipated
        Work of damping since the start, shape (nt,), exact with the energy-momentum scheme.
        Numerical damping of the scheme is not included.
    sensors
        Readings of the sensors at every step, by name: a
        :class:`~skfem_ancf.dynamics.sensors.Readings` with its times ``t``.
    event
        The time at which ``integrate(until=...)`` stopped, or None.
    steps
        Number of steps; independent of the number of stored instants.
    substeps
        Number of smaller steps taken in place of steps that did not converge.
    rejected
        Steps that the automatic step size repeated.
    iterations, factorizations
        Total numbers of linear solutions and of factorised tangents.
    error
        With ``integrate(..., check=True)``, the largest difference in position from the same motion
        with half the step size, relative to the size of the scene; NaN if that failed.

    Other Parameters
    ----------------
    at, field, recover
        As ``point``; a field, and whether to use the recovered one, as for
        :class:`~skfem_ancf.results.State`; shape (2,) or (2, n).
    """

    event: float | None
    error: float | None
    steps: int
    substeps: int
    rejected: int
    iterations: int
    factorizations: int

    def __init__(self, system: System, scheme: Scheme, columns: dict[str, Array],
                 last: tuple[Motion | None, Any], sensors: Readings, **counts: Any) -> None:
        self.system, self.scheme, self.sensors = system, scheme, sensors
        self._columns, self._last, self.error = columns, last, None
        self.t, self.u, self.v = columns["t"], columns["u"], columns["v"]
        self.acceleration, self.multipliers = columns["acceleration"], columns["multipliers"]
        self.dissipated = columns["dissipated"]
        for name, value in counts.items():
            setattr(self, name, value)

    def __len__(self):
        return len(self.t)

    def __repr__(self):
        span = f", t = {self.t[0]:g} to {self.t[-1]:g}" if len(self) else ""
        cut = "".join(f", {n} {what}" for n, what in (
            (self.substeps, "substeps"), (self.rejected, "rejected")) if n)
        return (f"<{type(self).__name__} of {len(self)} instants{span}, {self.scheme!r}, "
                f"{self.steps} steps{cut}, {self.iterations} iterations, "
                f"{self.factorizations} factorisations>")

    def state(self, k: int) -> State:
        """The instant ``k`` as a State: strain, reactions (with inertia), plots, files.
        :meth:`Scene.integrate <skfem_ancf.Scene.integrate>` with ``start=`` this state continues
        the motion."""
        k = require_index("k", k, len(self))
        last, arrays = self._last
        if last is not None and k == len(self) - 1 and last.t == self.t[k]:
            return state_of(self.system, self.scheme, last, arrays)
        return state_of(self.system, self.scheme, Motions(self._columns)[k])

    def states(self, instants: Iterable[int] | None = None) -> Iterator[State]:
        """Iterate over the states with these numbers; all by default."""
        refuse(isinstance(instants, (str, bytes, dict, set)) or not (
            instants is None or hasattr(instants, "__iter__")),
            "instants must be a list of their numbers, got {!r}", instants)
        return self._states(range(len(self)) if instants is None else [
            require_index("instants", k, len(self)) for k in instants])

    def _states(self, instants):
        for k in range(0, len(instants), TOGETHER):
            states = [self.state(j) for j in instants[k:k + TOGETHER]]
            for one in states:
                vars(one)["_mates"] = states
            yield from states

    def __iter__(self):
        return self.states()

    # at material points

    def angle(self, body: WhichMember) -> Array:
        """The angle of a rigid body (object, name or number), with whole turns, shape (nt,)."""
        found = require_body(self.system, body)
        k = Turns(self.system).moments + self.system.bodies.index(found)
        return found.angle + self._columns["turns"][:, k]

    def _read(self, what, point, beam, line, *args, **options):
        """Call a method of every state at given points."""
        at = self.system.points.find(point, beam, line, ask=True)
        return [getattr(state, what)(*args, at, **options) for state in self]

    def strain(self, point: ArrayLike, beam: WhichBeam = None, recover: bool = True,
               line: int | None = None) -> Array:
        """Strain (eps_xx, eps_yy, eps_xy) at all instants, (nt, 3) or (nt, 3, n)."""
        return np.array(self._read("strain", point, beam, line, recover=recover))

    def stress(self, point: ArrayLike, beam: WhichBeam = None, recover: bool = True,
               line: int | None = None) -> Array:
        """Second Piola-Kirchhoff stress at all instants, (nt, 3) or (nt, 3, n)."""
        return np.array(self._read("stress", point, beam, line, recover=recover))

    def field(self, field: Any, point: ArrayLike, beam: WhichBeam = None,
              recover: bool = True, line: int | None = None) -> Array:
        """Any field of :meth:`State.field <skfem_ancf.results.State.field>`, shape (nt, ...)."""
        return np.array(self._read("field", point, beam, line, field, recover=recover))

    def resultants(self, at: ArrayLike, beam: WhichBeam = None, recover: bool = True,
                   line: int | None = None) -> Resultants:
        """Section forces and strains of the axis at all instants: arrays (nt,) or (nt, n)."""
        return over_time(self._read("resultants", at, beam, line, recover=recover))

    def joint_force(self, joint: Joint) -> Array:
        """Multipliers of a joint, its force on the first beam, at all instants, shape (nt, m)."""
        return np.array([state.joint_force(joint) for state in self])

    def spring_force(self, spring: Any = 0) -> Array:
        """Force of a spring at all instants, shape (nt,), as of
        :meth:`State.spring_force <skfem_ancf.results.State.spring_force>`."""
        return np.array([state.spring_force(spring) for state in self])

    def reactions(self, boundary: Place | None, beam: WhichMember = None) -> Reaction:
        """Support reactions at a boundary at all instants.

        ``force`` has the shape (nt, 2); ``moment`` and each degree of freedom have (nt,).

        Parameters
        ----------
        boundary, beam
            As for :meth:`State.reactions <skfem_ancf.results.State.reactions>`.

        Examples
        --------
        The reaction of the pin of a pendulum:

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

    # energies and momenta

    @cached_property
    def strain_energy(self) -> Array:
        """Strain energy and potential of force elements, shape (nt,)."""
        system, memories = self.system, self._columns["history"]
        out = np.zeros(len(self))
        remembers = system.histories.lasting > 1
        if not remembers:
            out += system.energy_of_beams(self.u)
        if system.forces.elements or remembers:
            for k, memory in enumerate(memories):
                now = system.after(memory if memory.size else None)
                out[k] += now.energy_of_forces(self.u[k], self.t[k])
                if remembers:
                    out[k] += now.energy_of_beams(self.u[k])
        return out

    @cached_property
    def kinetic_energy(self) -> Array:
        """Kinetic energy, shape (nt,)."""
        if not np.any(self.v):
            return np.zeros(len(self))
        return np.array([0.5 * v @ self.system.mass.multiply(v) for v in self.v])

    @cached_property
    def potential_energy(self) -> Array:
        """Potential of the loads, zero in the reference configuration, shape (nt,). The potential
        of a moment counts whole turns."""
        return np.array([self.system.load_potential(u, t, turned) for u, t, turned in zip(
            self.u, self.t, self._columns["turns"])])

    @property
    def total_energy(self) -> Array:
        """Sum of strain, kinetic and potential energy, shape (nt,). The sum with :attr:`dissipated`
        is constant unless loads depend on time or have no potential, as those that follow the
        body."""
        return self.strain_energy + self.kinetic_energy + self.potential_energy

    @cached_property
    def momentum(self) -> Array:
        """Linear momentum, shape (nt, 2)."""
        return np.array([momentum(self.system, v) for v in self.v])

    @cached_property
    def angular_momentum(self) -> Array:
        """Angular momentum about the origin, shape (nt,)."""
        return np.array([angular_momentum(self.system, u, v) for u, v in zip(self.u, self.v)])

    # files and pictures

    _repr_html_ = history_html

    def to_pyvista(self, fields: Any = None, subdivide: tuple[int, int] = (8, 4),
                   lagrange: bool = False, undeformed: bool = False,
                   recover: bool = True) -> Series:
        """A pyvista mesh at the first instant; ``update(k)`` moves it to the instant k.

        Parameters
        ----------
        fields, subdivide, lagrange, undeformed, recover
            As for :func:`skfem_ancf.visuals.pyvista.to_pyvista`.
        """
        return Series(self, fields, subdivide, lagrange, undeformed, recover)

    def plot(self, field: Any = None, times: ArrayLike | None = None, ax: Any = None, *,
             thickness: float | str = "auto", undeformed: bool = True, colorbar: bool = True,
             cmap: Any = None, limits: tuple[float, float] | None = None, title: str | None = None,
             unit: str | None = None, subdivide: tuple[int, int] = (16, 8),
             filename: StrPath | None = None, dpi: float = 200, recover: bool = True,
             scale: float | str = 1.0, loads: bool = False, supports: bool = False) -> Any:
        """Draw the body at several times in one plot, the earlier ones paler; returns the Axes.

        Parameters
        ----------
        times
            Times, shape (n,); the nearest stored instants are drawn. The default is eight instants
            from first to last.
        field, ax, thickness, undeformed, colorbar, cmap, limits, title, unit
            As for :func:`skfem_ancf.visuals.matplotlib.plot_state`.
        subdivide, filename, dpi, recover, scale, loads, supports
            As there.

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
        refuse(not len(self), "the history has no instants")
        first, last = self.t[0], self.t[-1]
        wanted = np.linspace(first, last, 8) if times is None else np.ravel(
            require_finite("times", times))
        refuse(not len(wanted) or wanted.min() < first or wanted.max() > last, "times must be "
               "instants of the motion, from {:g} to {:g}; got {!r}", first, last, times)
        instants = np.unique(np.argmin(np.abs(self.t - wanted[:, None]), axis=1))
        return plot_state(list(self.states(instants)), field, ax, thickness=thickness,
                          undeformed=undeformed, colorbar=colorbar, cmap=cmap, limits=limits,
                          title=title, unit=unit, subdivide=subdivide, filename=filename, dpi=dpi,
                          recover=recover, scale=scale, loads=loads, supports=supports, fade=True)

    def plot_curve(self, x: Any, y: Any, ax: Any = None, *, xlabel: str | None = None,
                   ylabel: str | None = None, title: str | None = None,
                   filename: StrPath | None = None, dpi: float = 200, **line: Any) -> Any:
        """Plot one quantity against another, such as a force against a displacement.

        Parameters
        ----------
        x, y
            "t", the name of a scalar sensor, the name and component of a vector sensor such as
            ("tip", 1), or an array (nt,).
        ax, title, filename, dpi
            As for :meth:`plot`.
        xlabel, ylabel
            Labels of the axes; the names of sensors by default.
        **line
            Options of matplotlib's ``Axes.plot``, such as ``color`` and ``label``.

        Examples
        --------
        >>> import numpy as np
        >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff
        >>> beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), height=0.01), ElementBeamCable(),
        ...             StVenantKirchhoff(E=2e8, nu=0.3, density=7800), width=0.01)
        >>> scene = Scene(beam).pin("left").gravity((0, -9.81)).sensor("tip", "position", (1, 0))
        >>> scene.integrate(0.1, 0.01).plot_curve("t", ("tip", 1)).get_ylabel()
        'tip 1'
        """
        curves, labels = list[Array](), list[str]()
        for name, of, label in (("x", x, xlabel), ("y", y, ylabel)):
            if not isinstance(of, (str, tuple)):
                values, text = require_finite(name, np.asarray(of, dtype=float), (None,)), ""
            elif of == "t":
                values, text = self.sensors.t if len(self.sensors.t) else self.t, "t"
            else:
                sensor, *parts = (of,) if isinstance(of, str) else of
                values, text = self.sensors[sensor], " ".join(map(str, (sensor, *parts)))
                for part in parts:
                    values = values.reshape(len(values), -1)
                    values = values[:, require_index("component", part, values.shape[1])]
                refuse(values.ndim != 1, "the sensor {!r} reads numbers of shape {}: give its name "
                       "and a component, as ({!r}, 1)", sensor, values.shape[1:], sensor)
            curves.append(values)
            labels.append(text if label is None else label)
        return plot_curve(curves[0], curves[1], ax, xlabel=labels[0], ylabel=labels[1], title=title,
                          filename=filename, dpi=dpi, **line)

    animate = animate
    report = report_of_history
    to_xarray = to_xarray

    def save(self, filename: StrPath, progress: bool | None = None, *,
             subdivide: tuple[int, int] = (8, 4), lagrange: bool = False,
             undeformed: bool = False, recover: bool = True, fields: Any = None,
             precision: str = "double") -> Path:
        """Write a time series for ParaView; returns its path.

        Parameters
        ----------
        filename
            Ends with .pvd: a list, with a .vtu file per instant.
        progress
            Show a progress bar: True, False, or None for long runs only.
        subdivide, lagrange, undeformed, recover, fields, precision
            As for :func:`skfem_ancf.io.save_vtu`.
        """
        writer = PvdWriter(filename, subdivide, lagrange, undeformed, recover, fields, precision)
        with writer, progress_bar(progress, total=len(self), desc="files") as bar:
            for state in self:
                writer.add(state, state.t)
                bar.update(1)
        return writer.path
