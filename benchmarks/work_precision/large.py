"""Large frames: time and memory against the number of coordinates; modes and time steps.

The square frames of :mod:`.frames`: a solution from parameters to the corner, ten modes about the
stress-free state, and a step of a motion after the forces are put on at once, of a hundredth of
the first period.
"""

import numpy as np

from . import exudyn_beams, ours
from .exudyn_beams import exudyn
from .frames import EA, MOST, exudyn_system, frame
from .micro import row
from .runs import clock

#: Cells up to which modes and motions are computed, modes, and steps of a motion.
SHAKEN, MOVED, MODES, STEPS = 100, 65, 10, 10
#: Part of the forces that is put on at once.
PART = 0.1
SCHEMES = "energy-momentum", "generalized-alpha"


def fitted(rows, name):
    """Exponent of the coordinates in a column of rows, by least squares."""
    pairs = [(r["dofs"], r[name]) for r in rows if r[name] != ""]
    return float(np.polyfit(*np.log(np.transpose(pairs)), 1)[0]) if len(pairs) > 1 else np.nan


def _timed(function):
    start = clock()
    found = function()
    return found, clock() - start


def _static(cells):
    """What is measured of statics: from parameters to the corner."""
    made = frame(cells)
    state = made.solve_static()
    state.displacement((0.0, float(cells)))
    return made, state


def _motion(cells, scheme, period):
    """A History of some steps after a step load; the first step is not timed."""
    made = frame(cells, part=PART)
    dt = period / 100.0
    made.integrate(dt, dt, scheme=scheme)
    return _timed(lambda: made.integrate(STEPS * dt, dt, scheme=scheme))


class _Swing:
    """What the settings of Exudyn ask of a problem."""

    load = "force"

    def __init__(self, t_end):
        self.t_end, self.EA = t_end, EA


def _exudyn_motion(cells, elements, period):
    """Seconds of the same steps by generalized-alpha and quadratic GE2D beams."""
    _container, mbs, _ = exudyn_system(cells, elements, 3, PART)  # which has to live
    settings = exudyn_beams.settings(_Swing(0.01 * STEPS * period), STEPS, 1e-8)
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    good, seconds = _timed(lambda: mbs.SolveDynamic(settings))
    if not good:
        raise RuntimeError("not solved")
    return seconds, mbs.sys["dynamicSolver"].it.newtonStepsCount


def measure(sizes, about, watch, memory):
    """Rows of all sizes."""
    rows = []
    _static(min(sizes))
    for cells in watch(sizes, "large"):
        def add(code, variant, seconds, note="", made=None, **more):
            rows.append(row("large", code, variant, made.N // 12 if made else "",
                            made.N if made else "", seconds, about, note=note, **more))
            rows[-1]["cells"] = cells

        (made, state), first = _timed(lambda: _static(cells))
        add(ours.CODE, "statics", first, made=made, iterations=state.iterations,
            peak_mb=memory.peak("large", cells))
        if cells > SHAKEN:
            continue
        _, again = _timed(made.solve_static)
        modes, seconds = _timed(lambda: made.modes(MODES))
        add(ours.CODE, f"{MODES} modes", seconds, f"{seconds / again:.2g} static solutions",
            made)
        period = float(2.0 * np.pi / modes.frequencies[0])
        for scheme in SCHEMES if cells <= MOVED else ():
            history, seconds = _motion(cells, scheme, period)
            energy = history.total_energy[1:]
            add(ours.CODE, f"a step of {scheme}", seconds / STEPS,
                f"energy changes by {np.ptp(energy) / history.kinetic_energy.max():.1e}, "
                f"{seconds / STEPS / again * state.iterations:.2g} static iterations", made,
                iterations=history.iterations / STEPS)
        if exudyn is not None and cells <= MOST:
            for n in (1, 4):
                seconds, iterations = _exudyn_motion(cells, n, period)
                add(exudyn_beams.CODE, f"a step of generalized-alpha, GE2D quadratic, {n} a line",
                    seconds / STEPS, iterations=iterations / STEPS)
    return rows
