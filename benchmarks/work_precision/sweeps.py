"""Many cantilevers of example 5.2, each with a modulus of its own, from parameters to the tip.

Seconds are those of a clock on the wall, for each member: building is in them, and the start of
processes. A sweep of two members before has loaded what is compiled; what that took is in
``setup_seconds``. The error is that of the member with the modulus of the example.
"""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from skfem_ancf import sweep

from . import exudyn_beams, ours
from .exudyn_beams import exudyn
from .micro import row
from .problems import PROBLEMS
from .references import reference
from .runs import every_core

PROBLEM = PROBLEMS["5.2"]
OURS = (("ancf", 3, 16), ("cable", 5, 4))
#: How this package solves: in the threads of this process; one by one here; in two processes.
PLACES = ("threads", "one by one", "2 processes")
EXUDYN = (("ANCFCable2D", 8), ("ANCFCable2D", 32), ("GE2D quadratic", 4), ("GE2D quadratic", 16))


def scene(E, kind, order, n):
    """A member, of this package."""
    return ours.scene(replace(PROBLEM, E=E), ours.ELEMENTS[kind](order), n)


def tip(made):
    """Its tip."""
    return made.solve_static().displacement(PROBLEM.tip)


def peer(E, kind, n):
    """Tip of a member, of Exudyn."""
    solver = exudyn_beams.run(replace(PROBLEM, E=E), kind, n).build()
    return np.array(solver.read(solver.solve())[0])


def runs_of():
    """Code, variant, elements, mechanical model, and from moduli (n,) to tips (n, 2)."""
    for (kind, order, n), place in product(OURS, PLACES):
        model, build = ours.element_of(kind, order)[1], partial(scene, kind=kind, order=order, n=n)

        def run(moduli, build=build, place=place):
            with ThreadPoolExecutor() as threads:
                return sweep(build, {"E": moduli}, tip, progress=False,
                             workers=2 if place == "2 processes" else None,
                             client=threads if place == "threads" else None)["value"]

        yield ours.CODE, f"{kind} {order}, {place}", n, model, run
    for kind, n in EXUDYN if exudyn is not None else ():
        def run(moduli, kind=kind, n=n):
            return np.array([peer(E, kind, n) for E in moduli])

        yield exudyn_beams.CODE, f"{kind}, a loop", n, exudyn_beams.KINDS[kind][0], run


def measure(sizes, about, watch):
    """Rows for so many members, of this package in threads, alone, in processes, and of a peer."""
    rows = []
    for members in watch(sizes, "sweep"):
        for code, variant, n, model, run in runs_of():
            moduli = PROBLEM.E * (1.0 + 0.2 * (np.arange(members) - members // 2) / members)
            setup, _ = timed(run, moduli[:2])
            seconds, tips = timed(run, moduli)
            error = np.linalg.norm(tips[members // 2] - reference("5.2", model)) / PROBLEM.L
            rows.append(row("sweep", code, variant, n, "", seconds / members, about, error,
                            f"{members} members", setup_seconds=setup))
    return rows


def timed(run, moduli):
    """Seconds on the wall, and the result."""
    with every_core():
        begun = time.perf_counter()
        tips = run(moduli)
        return time.perf_counter() - begun, tips
