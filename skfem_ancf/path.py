"""An equilibrium path as a result."""

import numpy as np

from .errors import require_index, teaching
from .results import State


@teaching
class Path:
    """The equilibria that a continuation found.

    Attributes
    ----------
    load
        Load factors, shape (n,).
    u
        Displacements of the coordinates, shape (n, N).
    arc
        Arc length along the path, shape (n,).
    stable
        Whether each equilibrium is stable, None where it was not computed (scenes with
        multipliers).
    """

    def __init__(self, system, points):
        self.system, self.points = system, points
        self.load = np.array([p.load for p in points])
        self.u = np.array([p.u for p in points])
        self.arc = np.array([p.arc for p in points])
        self.stable = [p.stable for p in points]
        self.iterations = sum(p.iterations for p in points)

    def __len__(self):
        return len(self.points)

    def __repr__(self):
        return (f"<Path of {len(self)} points, load {self.load.min():.6g} to "
                f"{self.load.max():.6g}, {self.iterations} iterations>")

    def state(self, k):
        """Point ``k`` as a State."""
        p = self.points[require_index("k", k, len(self.points))]
        return State(self.system, p.u, p.load, p.force, True, p.iterations, f"point {k}", (),
                     p.multipliers)

    def displacement(self, point, beam=None):
        """Displacement of a material point along the path, shape (n, 2)."""
        beam, e, X = self.state(0)._find(point, beam)
        return beam.point_displacement(self.u[:, self.system.of(beam)], e, X)

    def limit_points(self):
        """Load factors at the turning points of the load.

        Between two points the load is a cubic polynomial of the arc length, by its values and its
        rates at both.

        Returns
        -------
        ndarray
            In the order of the path.
        """
        out = []
        for p, q in zip(self.points[:-1], self.points[1:]):
            h = q.arc - p.arc
            if not p.rate * q.rate < 0:
                continue
            # coefficients in x = (arc - p.arc) / h
            a, b = p.load, h * p.rate
            c = 3 * (q.load - a) - 2 * b - h * q.rate
            d = -2 * (q.load - a) + b + h * q.rate
            roots = np.roots([3 * d, 2 * c, b]) if d else np.array([-b / (2 * c)])
            x = [r.real for r in roots if abs(r.imag) < 1e-12 and 0 <= r.real <= 1]
            if x:
                out.append(a + x[0] * (b + x[0] * (c + x[0] * d)))
        return np.array(out)

    def plot(self, point, component=1, beam=None, **options):
        """Draw load against a displacement; see :func:`skfem_ancf.visuals.matplotlib.plot_path`."""
        from .visuals.matplotlib import plot_path

        return plot_path(self, point, component, beam, **options)
