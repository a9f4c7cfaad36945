"""The figures, each drawn from the sheets of an example."""

import numpy as np
from matplotlib.figure import Figure

from .examples import BODY_2D, LIKE_2D
from .models import CASES, MODELS, THICK, THICK_ABAQUS

#: Colour (Okabe and Ito's, safe for the colour-blind), marker and dashes.
STYLE = {
    "N=1": ("#D55E00", "o", (0, ())),
    "N=2": ("#E69F00", "s", (0, (6, 2))),
    "N=3": ("#009E73", "^", (0, (4, 1, 1, 1))),
    "N=4": ("#0072B2", "D", (0, ())),
    "Patel-Shabana": ("#CC79A7", "x", (0, (2, 2))),
    "ECM": ("#56B4E9", "v", (0, (6, 1, 1, 1))),
    "strain split": ("#444444", "+", (0, (1, 2))),
    LIKE_2D: ("#0072B2", "*", (0, (1, 1))),
    BODY_2D: ("black", "", (0, ())),
}
BASE = "N=4"  # drawn wide and pale, and what the others are compared with
NAMES = [model.name for model in MODELS]


def style(name, wide=False):
    """Line style of a model; ``wide`` is for what lies under the others."""
    colour, marker, dashes = STYLE[name]
    if wide:
        return dict(color=colour, alpha=0.3, lw=6, ls="-", solid_capstyle="round")
    return dict(color=colour, marker=marker, ls=dashes, lw=1.4, ms=6, mew=1.4, mfc="none")


def subplots(columns=1, size=(6.4, 4.4), rows=1, heights=None, **options):
    """A figure that needs no display, and its axes as a list."""
    figure = Figure(figsize=(size[0] * columns, size[1]), dpi=150, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, height_ratios=heights, **options)
    for ax in axes.flat:
        ax.grid(alpha=0.25)
        ax.spines[["top", "right"]].set_visible(False)
    return figure, list(axes.flat)


def elements_axis(ax, counts, label="number of elements"):
    """A logarithmic axis with the numbers themselves."""
    ax.set_xscale("log", base=2)
    ax.set_xticks(counts, [str(n) for n in counts])
    ax.minorticks_off()
    ax.set_xlabel(label)


def convergence(sheet, limit, limit_name, ylabel, title, models=NAMES, marks=()):
    """Values against the number of elements, and their distance from a limit."""
    figure, (left, right) = subplots(2, (5.6, 4.6))
    counts = sheet.of(models[0], "elements")[0]
    left.axhline(limit, color="black", lw=1.0, label=limit_name)
    for y, dashes, name in marks:
        left.axhline(y, color="0.45", lw=1.0, ls=dashes, label=name)
    for name in models:
        n, value = sheet.of(name, "elements", "value")
        left.plot(n, value, label=name, **style(name))
        right.plot(n, np.abs(value - limit), **style(name))
    left.set_ylabel(ylabel)
    right.set_ylabel(f"distance from {limit_name} (m)")
    right.set_yscale("log")
    for ax in (left, right):
        elements_axis(ax, counts)
    left.legend(fontsize=8.5)
    figure.suptitle(title)
    return figure


def shapes(sheet, times, title):
    """Deformed axes; every model marks other nodes, so that none hides another."""
    span = [np.ptp([row[sheet.columns.index(c)] for row in sheet.rows]) for c in ("x", "y")]
    scale = min(6.2 / span[0], 5.4 / span[1])  # inches per metre
    figure, (ax,) = subplots(size=(scale * span[0] + 3.0, max(scale * span[1] + 1.4, 3.4)))
    column = sheet.columns.index("t") if times is not None else None
    for k, t in enumerate(times if times is not None else [None]):
        rows = [r for r in sheet.rows if column is None or abs(r[column] - t) < 1e-9]
        part = type(sheet)(sheet.columns, rows)
        x, y = part.of(BASE, "x", "y")
        ax.plot(x, y, **style(BASE, wide=True))
        for j, name in enumerate(NAMES):
            x, y = part.of(name, "x", "y")
            ax.plot(x, y, label=name if k == 0 else None,
                    markevery=(4 * j, 4 * len(NAMES)), **style(name))
        if t is not None:
            end = np.array([x[-1] - x[-5], y[-1] - y[-5]])
            offset = 20 * end / np.linalg.norm(end)
            ax.annotate(f"{t:g} s", (x[-1], y[-1]), offset, textcoords="offset points",
                        ha="center", va="center", fontsize=9)
    ax.set_aspect("equal")
    ax.margins(0.09)
    ax.set_xlabel("x (m)")
    ax.set_ylabel("y (m)")
    figure.suptitle(title)
    ax.legend(loc="center left", bbox_to_anchor=(1.02, 0.5), fontsize=8.5)
    return figure


def against_time(sheet, column, ylabel, title, marks=()):
    """A quantity of all models against time, and their distance from N=4."""
    figure, (top, bottom) = subplots(rows=2, size=(7.6, 6.2), heights=(5, 3), sharex=True)
    base = sheet.of(BASE, column)[0]
    for y, name, label in marks:
        top.axhline(y, color=STYLE[name][0], lw=1.0, ls=":", label=label)
    for j, name in enumerate(NAMES):
        t, value = sheet.of(name, "t", column)
        step = max(1, len(t) // 8)
        every = (j * step // len(NAMES), step)
        if name == BASE:
            top.plot(t, value, **style(name, wide=True))
        top.plot(t, value, label=name, markevery=every, **style(name))
        if name != BASE:
            bottom.plot(t[1:], np.abs(value - base)[1:], markevery=every,
                        **style(name) | dict(lw=1.0))
    unit = ylabel.split("(")[-1]
    top.set_ylabel(ylabel)
    bottom.set_yscale("log")
    peak = max(float(np.max(np.abs(sheet.of(name, column)[0] - base))) for name in NAMES)
    bottom.set_ylim(1e-6 * peak, 2 * peak)
    bottom.set_ylabel(f"distance from {BASE} ({unit}", fontsize=9)
    bottom.set_xlabel("t (s)")
    top.legend(fontsize=8.5, ncols=2)
    figure.suptitle(title)
    return figure


def section_strain(sheet, title):
    """eps_y across the section at the root."""
    figure, (ax,) = subplots()
    Y, theory = sheet.of(BASE, "Y", "theory")
    ax.plot(1e6 * theory, 1e3 * Y, color="0.75", lw=6, label="beam theory")
    for j, name in enumerate(NAMES):
        Y, strain = sheet.of(name, "Y", "eps_yy")
        ax.plot(1e6 * strain, 1e3 * Y, label=name, markevery=(j % 4, 4), **style(name))
    ax.set_xlabel(r"$\varepsilon_y$ at the root ($10^{-6}$)")
    ax.set_ylabel("Y (mm)")
    ax.set_title(title)
    ax.legend(fontsize=8.5)
    return figure


# one function an example: figures by the name of their file


def draw_5_1(result):
    finest = result.facts["finest"]
    return {
        "fig06": convergence(result.sheets["fig06"], result.facts["limit"], "elastica",
                             "tip displacement $u_y$ (m)",
                             "5.1, Fig. 6: slender cantilever, small displacement"),
        "fig07": section_strain(result.sheets["fig07"],
                                f"5.1, Fig. 7: transverse strain, {finest} elements")}


def draw_5_2(result):
    title = "slender cantilever under its weight"
    u_x, u_y = result.facts["limit"]
    return {
        "table3": convergence(result.sheets["table3"], u_x, "Reissner beam",
                              "tip displacement $u_x$ (m)", f"5.2, Table 3: {title}"),
        "table4": convergence(result.sheets["table4"], u_y, "Reissner beam",
                              "tip displacement $u_y$ (m)", f"5.2, Table 4: {title}"),
        "fig09": shapes(result.sheets["fig09"], None,
                        "5.2, Fig. 9: equilibrium under its weight")}


def draw_5_3(result):
    figure = convergence(
        result.sheets["fig11"], result.facts["limit"], "2D continuum",
        "tip displacement $u_y$ (m)", "5.3, Fig. 11: thick cantilever", NAMES + [LIKE_2D],
        [(THICK["N=2"], "--", "paper, N >= 2"), (THICK["N=1"], ":", "paper, N = 1 (about)"),
         (THICK_ABAQUS, "-.", "paper, ABAQUS")])
    return {"fig11": figure}


def draw_motion(result, number, title, files, instants, marks=()):
    """Shapes, tip x, tip y and, where there is a fourth file, the strain energy."""
    columns = [("tip_x", "tip x (m)"), ("tip_y", "tip y (m)"),
               ("strain_energy", "strain energy (J)")]
    figures = {files[0]: shapes(result.sheets[files[0]], instants,
                                f"{number}, Fig. {files[0][3:]}: {title}")}
    for name, (column, label) in zip(files[1:], columns):
        figures[name] = against_time(result.sheets[name], column, label,
                                     f"{number}, Fig. {name[3:]}: {title}",
                                     marks if column == "tip_y" else ())
    return figures


def draw_5_4(result):
    return draw_motion(result, "5.4", "stiff pendulum", ["fig13", "fig14", "fig15"],
                       (0.0, 0.25, 0.5, 0.75, 1.0))


def draw_5_5(result):
    return draw_motion(result, "5.5", "soft pendulum", ["fig17", "fig18", "fig19", "fig20"],
                       (0.0, 0.25, 0.5, 0.75, 1.0))


def draw_5_6(result):
    at_rest = [(float(result.facts["static"][name][1]), name, f"{name} at rest")
               for name in ("N=1", BASE)]
    return draw_motion(result, "5.6",
                       f"cantilever released under gravity, L = {CASES['5.6'].L:g} m",
                       ["fig22", "fig23", "fig24"], (0.0, 0.1, 0.2, 0.3), at_rest)


DRAW = {"5.1": draw_5_1, "5.2": draw_5_2, "5.3": draw_5_3, "5.4": draw_5_4, "5.5": draw_5_5,
        "5.6": draw_5_6}
