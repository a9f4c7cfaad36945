"""Python calls of small tasks, counted by cProfile: ``python benchmarks/calls.py``.

Counts do not depend on the machine. The second column leaves the kernels out: it is the Python
around them, the same in NumPy and compiled. ``--top whole`` lists the functions of tasks that make
most calls. ``tests/test_calls.py`` bounds both.
"""

import cProfile
import gc
import os
import pstats
import sys

import numpy as np

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, EnergyMomentum, Frame, MeshBeam,
                        Scene, StVenantKirchhoff)
from skfem_ancf.equations.backend import Backend

TIP = (1, 0)


def scene(element, E=2e8):
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 17), height=0.01), element,
                StVenantKirchhoff(E, 0.3, 7800), width=0.01)
    return Scene(beam).clamp("left").gravity((0, -9.81))


def whole(element):
    return lambda: (lambda: scene(element).solve_static().displacement(TIP))


def solve_again():
    s = scene(ElementBeamANCF(3))
    s.solve_static()
    return s.solve_static


def displacement_again():
    state = scene(ElementBeamANCF(3)).solve_static()
    state.displacement(TIP)
    return lambda: state.displacement(TIP)


def replace_and_solve():
    s = scene(ElementBeamANCF(3))
    s.solve_static()
    material = StVenantKirchhoff(2.1e8, 0.3, 7800)
    return lambda: s.replace(material=material).solve_static()


def strain_first():
    state = scene(ElementBeamANCF(3)).solve_static()
    return lambda: state.strain((0.5, 0))


def strain_again():
    state = scene(ElementBeamANCF(3)).solve_static()
    state.strain((0.5, 0))
    return lambda: state.strain((0.5, 0))


def hundred_steps():
    s = scene(ElementBeamANCF(3))
    s.integrate(0.02, 0.01, EnergyMomentum())
    return lambda: s.integrate(1.0, 0.01, EnergyMomentum())


def ten_increments():
    s = scene(ElementBeamANCF(3))
    s.run(1.0, increments=10)
    return lambda: s.run(1.0, increments=10)


def frame(n=14):
    """A frame of n bays and n storeys with a clamp at each foot, whole."""
    points = [(5.0 * i, 3.0 * j) for i in range(n + 1) for j in range(n + 1)]
    number = np.arange(len(points)).reshape(n + 1, n + 1)
    lines = np.concatenate([np.stack([number[:, :-1].ravel(), number[:, 1:].ravel()], 1),
                            np.stack([number[:-1, 1:].ravel(), number[1:, 1:].ravel()], 1)])
    steel = StVenantKirchhoff(2.1e11, 0.3, 7850)

    def run():
        made = Frame.from_lines(points, lines, height=0.3, width=0.3, material=steel)
        for k in number[:, 0]:
            made.clamp(int(k))
        made.point_force((1e4, 0), at=int(number[0, -1]))
        return made.solve_static().displacement((5.0 * n, 3.0 * n))

    return run


#: By name a function that sets a task up and returns it.
TASKS = {
    "whole, ANCF(3)": whole(ElementBeamANCF(3)), "whole, cable(5)": whole(ElementBeamCable(5)),
    "solve again": solve_again, "displacement again": displacement_again,
    "replace E, solve": replace_and_solve, "strain, first": strain_first,
    "strain, again": strain_again, "100 steps": hundred_steps, "run, 10 steps": ten_increments,
    "frame 14 x 14": frame,
}


def profile(name, kernels=True):
    """The profile of a task that has run once before; kernels in NumPy may be left out."""
    TASKS[name]()()
    task, one, in_numpy = TASKS[name](), cProfile.Profile(), Backend._in_numpy

    def left_out(self, kernel):
        run = in_numpy(self, kernel)

        def quiet(*args):
            one.disable()
            try:
                return run(*args)
            finally:
                one.enable()

        return quiet

    Backend._in_numpy = in_numpy if kernels else left_out
    gc.disable()  # calls that it makes, as those of other libraries, are not the task's
    try:
        one.enable()
        task()
    finally:
        one.disable()
        gc.enable()
        Backend._in_numpy = in_numpy
    return one


def calls(name, kernels=True):
    """Number of Python calls of a task."""
    return pstats.Stats(profile(name, kernels)).total_calls


if __name__ == "__main__":
    os.environ.setdefault("SKFEM_ANCF_COMPILED", "0")
    if "--top" in sys.argv:
        for name in TASKS:
            if sys.argv[-1] in name:
                print(name)
                pstats.Stats(profile(name)).sort_stats("ncalls").print_stats(60)
    else:
        for name in TASKS:
            print(f"{name:20} {calls(name):8} {calls(name, False):8}", flush=True)
