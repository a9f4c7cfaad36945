"""Work-precision diagrams."""

import numpy as np
from matplotlib.figure import Figure

#: Colour (Okabe and Ito's, safe for the colour-blind) and marker of a code.
STYLE = {"skfem-ancf": ("#0072B2", "o"), "Exudyn": ("#D55E00", "s"),
         "scikit-fem Q2": ("#009E73", "^"), "scikit-fem forms": ("#CC79A7", "D")}


def usable(rows):
    """Rows with a finite error and time."""
    return [r for r in rows if isinstance(r["error"], float) and np.isfinite(r["error"])
            and np.isfinite(r["seconds"])]


def front(rows, key="seconds"):
    """Rows that no other beats in both error and time, fastest first."""
    best, out = np.inf, []
    for r in sorted(rows, key=lambda r: (r[key], r["error"])):
        if r["error"] < best:
            best = r["error"]
            out.append(r)
    return out


def subplots(title, columns=1):
    """A figure that needs no display, and its axes."""
    figure = Figure(figsize=(7.2 * columns, 4.8), dpi=150, layout="constrained")
    axes = figure.subplots(1, columns, squeeze=False)[0]
    for ax in axes:
        ax.set_xscale("log")
        ax.set_yscale("log")
        ax.grid(alpha=0.25)
        ax.spines[["top", "right"]].set_visible(False)
    figure.suptitle(title)
    return figure, list(axes)


def work_precision(rows, title, floor=1e-11):
    """Time against error: every run a point, the Pareto front of each code a line."""
    figure, (ax,) = subplots(title)
    rows = usable(rows)
    for code in dict.fromkeys(r["code"] for r in rows):
        colour, marker = STYLE[code]
        mine = [dict(r, error=max(r["error"], floor)) for r in rows if r["code"] == code]
        ax.plot([r["error"] for r in mine], [1e3 * r["seconds"] for r in mine], ls="",
                marker=marker, ms=4, mfc="none", color=colour, alpha=0.35)
        best = front(mine)
        ax.step([r["error"] for r in best], [1e3 * r["seconds"] for r in best], where="pre",
                color=colour, marker=marker, ms=5, label=code)
    ax.invert_xaxis()
    ax.set_xlabel(f"error of the tip / length (below {floor:g} drawn there)")
    ax.set_ylabel("time (ms)")
    ax.legend()
    return figure


def scaling(rows):
    """Time and memory against the number of elements."""
    figure, (left, right) = subplots("one linear system of many elements", 2)
    rows = [r for r in rows if np.isfinite(r["seconds"])]
    for variant in dict.fromkeys(r["variant"] for r in rows):
        mine = [r for r in rows if r["variant"] == variant]
        n = np.array([r["elements"] for r in mine])
        left.plot(n, [1e6 * r["seconds"] / k for r, k in zip(mine, n)], marker="o", label=variant)
        mine = [r for r in mine if r["peak_mb"] != ""]
        right.plot([r["elements"] for r in mine], [r["peak_mb"] for r in mine], marker="o",
                   label=variant)
    left.set_ylabel("time per element (microseconds)")
    right.set_ylabel("peak memory of the process (MB)")
    for ax in (left, right):
        ax.set_xlabel("number of elements")
        ax.legend()
    return figure
