"""Equilibrium paths."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core import Array, require_index
from ..equations.system import System
from ..visuals.matplotlib import plot_path
from .output import picture, words
from .state import MaterialPoints, State


@dataclass(repr=False)
class CriticalPoint:
    """A limit or bifurcation point of a path.

    Attributes
    ----------
    kind : str
        "limit" (extremum of the load) or "bifurcation".
    load, arc
        Load factor, and arc length along the path.
    state : State
        The equilibrium.
    mode
        The null vector of the tangent stiffness, shape (N,); at a limit point the direction of
        the path.
    change
        Change of the number of negative eigenvalues; None if it is not known.
    critical
        The solver's data for ``scene.continuation(branch=...)``.
    """

    kind: str
    load: float
    arc: float
    state: State
    mode: np.ndarray
    change: int
    critical: object

    def __repr__(self):
        return f"<{self.kind} point at load {self.load:.8g}, arc length {self.arc:.6g}>"


class Path(MaterialPoints):
    """The equilibria of a continuation.

    Parameters
    ----------
    system
        The :class:`~skfem_ancf.equations.system.System`.
    points, critical
        Results of :func:`skfem_ancf.solvers.continuation.continuation`.

    Attributes
    ----------
    load, u
        Load factors (n,), and displacements of the degrees of freedom (n, N).
    arc
        Arc length along the path, shape (n,).
    stable, negative
        Whether each equilibrium is stable, and the number of negative eigenvalues of its tangent;
        None where the loads have no potential.
    error
        Error that the iteration leaves in each point, in the energy norm, relative to the work
        done, shape (n,).
    critical_points : list of CriticalPoint
        Limit and bifurcation points in the order of the path, converged as points of it.
    """

    def __init__(self, system: System, points: Sequence[Any],
                 critical: Sequence[Any] = ()) -> None:
        self.system, self.points = system, points
        self.load = np.array([p.load for p in points])
        self.u = np.array([p.u for p in points])
        self.arc = np.array([p.arc for p in points])
        self.error = np.array([p.error for p in points])
        self.negative = [p.negative for p in points]
        self.stable = [p.stable for p in points]
        self.iterations = sum(p.iterations for p in points)
        self.critical_points = list(critical)

    def __len__(self):
        return len(self.points)

    def __repr__(self):
        return (f"<Path of {len(self)} points, load {self.load.min():.6g} to "
                f"{self.load.max():.6g}, {len(self.limit_points())} limit and "
                f"{len(self.bifurcation_points())} bifurcation points, {self.iterations} "
                f"iterations, relative error {self.error.max():.1g}>")

    def _repr_html_(self):
        """The text, and the load against the largest nodal displacement."""
        def draw():
            state = self.state(len(self) - 1)
            beam = max(state.beams, key=lambda b: np.max(np.abs(state.u_of(b))))
            moved = state.u_of(beam).reshape(-1, beam.nd)[:, :2]
            node, component = np.unravel_index(np.argmax(np.abs(moved)), moved.shape)
            return self.plot(beam.mesh.p[:, node], int(component), beam)

        return words(repr(self)[1:-1]) + picture(draw)

    def state(self, k: int) -> State:
        """Point ``k`` as a State."""
        return self.points[require_index("k", k, len(self.points))].state.replace(
            message=f"point {k}")

    @property
    def v(self) -> Array:  # type: ignore[override]
        """Velocity of the degrees of freedom, shape (n, N): zero."""
        return np.zeros_like(self.u)

    def limit_points(self) -> Array:
        """Load factors at limit points, in the order of the path."""
        return np.array([c.load for c in self.critical_points if c.kind == "limit"])

    def bifurcation_points(self) -> Array:
        """Load factors at bifurcations, in the order of the path. :attr:`critical_points` has their
        states and modes; ``scene.continuation(branch=...)`` with one of them follows the branch."""
        return np.array([c.load for c in self.critical_points if c.kind == "bifurcation"])

    plot = plot_path
