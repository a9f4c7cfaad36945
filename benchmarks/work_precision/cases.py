"""The runs of each case: every code over meshes, steps and settings, its best among them."""

import os

from skfem_ancf.core.code_cache import VARIABLE

from . import exudyn_beams, ours, stock
from .problems import PROBLEMS

#: Element numbers of slender statics.
FINE = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64)
CABLES = (4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128)


def gravity_52(p):
    """Every element, formulation and code."""
    yield from slender(p, tolerances=(1e-8, 1e-4, 1e-2))
    for order in (1, 2, 3, 4):
        for n in CABLES:
            for formulation in ("assumed", "continuum", "ecm", "strain-split"):
                yield ours.run(p, "ancf", order, n, formulation)
    for order in (1, 2, 3):
        for n in FINE:
            yield ours.run(p, "cubic", order, n)
    yield from textbook(p)
    for nx in (16, 32, 64, 128):
        for steps in (1, 5):
            yield stock.q2(p, nx, 2, steps)


def textbook(p):
    for n, steps in ((4, 5), (8, 5), (8, 10), (16, 10)):
        yield stock.textbook(p, 3, n, steps)


def slender(p, tolerances=(1e-8, 1e-4), degrees=(3, 5, 7)):
    """Cables, and the beams of Exudyn."""
    for degree in degrees:
        for n in CABLES if degree == 3 else FINE[:-2]:
            for tol in tolerances:
                yield ours.run(p, "cable", degree, n, tol=tol)
    for degree in (9, 11, 13, 15):
        for n in (1, 2, 3, 4):
            for tol in tolerances[:2]:
                yield ours.run(p, "cable", degree, n, tol=tol)
    if exudyn_beams.exudyn is None:
        return
    for n in (4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192):
        for rtol in (1e-2, 1e-4, 1e-8, 1e-11):
            yield exudyn_beams.run(p, "ANCFCable2D", n, 1, rtol)
        yield exudyn_beams.run(p, "ANCFCable2D", n, 2)
        if n <= 16:
            yield exudyn_beams.run(p, "ANCFCable2D", n, 1, dense=True)
            yield exudyn_beams.run(p, "ANCFCable2D", n, 1, modified=True)
    for n in (4, 8, 16, 32, 64, 128):
        for steps in (1, 2, 10):
            yield exudyn_beams.run(p, "GE2D linear", n, steps)
            yield exudyn_beams.run(p, "GE2D quadratic", n, steps)


def slender_fewer(p):
    """As 5.2 with fewer entries."""
    yield from slender(p)
    for n in (8, 16, 32, 64):
        yield ours.run(p, "ancf", 2, n)
        yield ours.run(p, "ancf", 2, n, "continuum")
        yield ours.run(p, "cubic", 2, n)


def small(p):
    """Small deflections: hardly more than one linear solve."""
    yield from slender_fewer(p)
    yield from textbook(p)


def thick(p):
    """The body against its one reference; meshes uniform and graded towards the clamp."""
    for order in (2, 3, 4, 6, 8):
        for n in (2, 3, 4, 6, 8, 12, 16, 32):
            yield ours.run(p, "ancf", order, n)
            for formulation in ("assumed", "continuum"):
                for grade in (1.0, 2.0):
                    yield ours.run(p, "cubic", order, n, formulation, grade=grade)
    for n in (2, 4, 8, 16):
        yield stock.textbook(p, 3, n, 1)
    for nx, ny in ((4, 2), (8, 2), (12, 4), (16, 4), (32, 8), (64, 16), (96, 24)):
        yield stock.q2(p, nx, ny)
        if nx <= 32:  # beyond, the corners of the clamp collapse in compression
            yield stock.q2(p, nx, ny, grade=2.0)


def roll_up(p):
    """An end moment; it takes several load steps."""
    for degree in (3, 5, 7):
        for n in (4, 6, 8, 12, 16, 24, 32, 48, 64):
            for first in (1.0, 0.5):
                yield ours.run(p, "cable", degree, n, first_step=first)
    for n in (8, 16, 32, 64):
        yield ours.run(p, "ancf", 2, n)
        yield ours.run(p, "cubic", 2, n)
        yield ours.run(p, "cubic", 3, n)
    if exudyn_beams.exudyn is not None:
        for n in (8, 16, 32, 64, 128):
            for steps in (2, 5, 10, 20):
                yield exudyn_beams.run(p, "ANCFCable2D", n, steps)
                yield exudyn_beams.run(p, "GE2D quadratic", n, steps)


def motion(p, scale=1, adaptive=True):
    """Meshes times step sizes; ``scale`` divides the numbers of steps."""
    def counts(least, most):
        return _counts(scale, least, most)

    for degree, meshes in ((3, ((6, 4), (8, 8), (16, 16), (32, 32))),
                           (5, ((3, 4), (4, 8), (8, 16), (12, 32))),
                           (7, ((2, 4), (3, 8), (5, 24), (8, 32)))):
        for n, most in meshes:
            for steps in counts(1, most):
                for scheme in ("generalized-alpha", "energy-momentum"):
                    yield ours.run(p, "cable", degree, n, steps=steps, scheme=scheme, tol=1e-6)
            for steps in counts(0.5, min(2, most)):
                yield ours.run(p, "cable", degree, n, steps=steps, tol=1e-4)
            for steps in counts(16, most):
                yield ours.run(p, "cable", degree, n, steps=steps, tol=1e-8)
    for degree, n, most in ((5, 3, 50), (5, 4, 100), (5, 8, 400), (7, 5, 400)):
        for steps in (50, 100, 200, 400):
            if steps <= most:
                for scheme in ("radau", "gauss"):
                    yield ours.run(p, "cable", degree, n, steps=steps, scheme=scheme, tol=1e-7)
    for degree, n, steps, tol in ((5, 5, 60, 1e-5), (5, 5, 60, 1e-6), (7, 4, 70, 1e-6),
                                  (7, 5, 150, 1e-6), (9, 4, 150, 1e-6), (9, 5, 150, 1e-6),
                                  (9, 6, 150, 1e-6), (9, 6, 300, 1e-6), (9, 6, 400, 1e-6),
                                  (9, 6, 600, 1e-7), (9, 8, 1500, 1e-7), (7, 12, 2000, 1e-7)):
        yield ours.run(p, "cable", degree, n, steps=steps, scheme="gauss", points=4, tol=tol)
    for degree, n, tol in ((7, 4, 1e-4), (7, 5, 1e-5)):
        yield ours.run(p, "cable", degree, n, steps=400, scheme="radau", tol=tol)
    yield ours.run(p, "cable", 5, 4, steps=100, scheme="gauss", points=2, tol=2e-3)
    for degree, n in ((5, 1), (5, 2), (5, 3), (5, 4), (7, 2), (9, 1)):  # each step turns it far
        for steps in (13, 14, 16, 18, 20, 22, 40):
            for tol in (8e-3, 5e-3, 3e-3, 1e-3, 3e-4, 1e-5):
                yield ours.run(p, "cable", degree, n, steps=steps, scheme="radau", tol=tol)
    for degree, n in ((5, 2), (5, 3), (7, 2)):
        for steps in (28, 30, 35, 36, 38):
            for tol in (5e-3, 1e-3, 3e-4, 1e-5, 3e-6):
                yield ours.run(p, "cable", degree, n, steps=steps, scheme="radau", tol=tol)
    for degree, steps, tol in ((5, 13, 2.5e-3), (5, 14, 1.5e-3), (11, 20, 1e-4)):
        yield ours.run(p, "cable", degree, 1, steps=steps, scheme="radau", tol=tol)
    for n in (4, 5, 6):
        for steps in (80, 100):
            yield ours.run(p, "cable", 3, n, steps=steps // scale, tol=1e-3)
    for degree, n, steps in ((7, 1, 96), (7, 1, 100), (5, 3, 180)):
        yield ours.run(p, "cable", degree, n, steps=steps // scale, scheme="energy-momentum",
                       tol=1e-3)
    for degree, steps, tol in ((7, 35, 3e-3), (9, 35, 3e-3)):
        yield ours.run(p, "cable", degree, 2, steps=steps, scheme="radau", tol=tol)
    if adaptive:
        for n, rtol in ((4, 1e-4), (4, 1e-5), (6, 1e-6), (8, 1e-7)):
            yield ours.run(p, "cable", 5, n, rtol=rtol, tol=1e-6)
    for n in (4, 8, 16):
        for steps in (250, 1000, 4000):
            yield ours.run(p, "cubic", 2, n, steps=steps // scale, tol=1e-6)
    for n in (8, 16, 32):
        yield ours.run(p, "ancf", 2, n, steps=1000 // scale, tol=1e-6)
    if exudyn_beams.exudyn is not None:
        yield from peer_motion(p, scale)


def _counts(scale, least, most):
    return [int(250 * f) // scale for f in (0.5, 1, 2, 4, 8, 16, 24, 32) if least <= f <= most]


def peer_motion(p, scale):
    """The same of Exudyn."""
    for n, least, most in ((4, 0.5, 2), (6, 0.5, 2), (8, 0.5, 4), (12, 1, 8), (16, 1, 16),
                           (24, 2, 32), (32, 2, 32), (48, 4, 32), (64, 8, 32)):
        for rtol, low, high in ((1e-2, 0.5, 4), (1e-4, 0.5, 24), (1e-6, 4, 32)):
            for steps in _counts(scale, max(least, low), min(most, high)):
                yield exudyn_beams.run(p, "ANCFCable2D", n, steps, rtol)
    for n in (8, 16, 32):
        for steps in _counts(scale, 1, n):
            yield exudyn_beams.run(p, "GE2D quadratic", n, steps, 1e-4)
    for n in (5, 6, 7, 8):  # small: dense factors, kept or new ones in each iteration
        for steps in (125, 150, 200, 250, 300, 400, 500):
            for rtol, modified in ((1e-2, None), (1e-3, None), (1e-2, False)):
                yield exudyn_beams.run(p, "ANCFCable2D", n, steps // scale, rtol, True, modified)
    for n in (8, 9, 10, 12):
        for steps in (400, 500, 600, 800, 1000):
            yield exudyn_beams.run(p, "ANCFCable2D", n, steps // scale, 1e-3)
    for n in (10, 12, 16, 24):
        for steps in (500, 1000):
            yield exudyn_beams.run(p, "ANCFCable2D", n, steps // scale, 1e-2, modified=False)


def spin_up(p):
    """A driven support: the joint of this package is held by a multiplier."""
    for degree, meshes in ((3, (4, 8)), (5, (2, 4)), (7, (2,))):
        for n in meshes:
            for steps, tol in ((50, 1e-4), (50, 1e-6), (100, 1e-6), (250, 1e-4), (250, 1e-6),
                               (500, 1e-6), (1000, 1e-6), (2000, 1e-6), (4000, 1e-6),
                               (4000, 1e-8), (8000, 1e-8)):
                yield ours.run(p, "cable", degree, n, steps=steps, tol=tol)
            for steps in (250, 500, 1000, 2000):
                yield ours.run(p, "cable", degree, n, steps=steps, scheme="energy-momentum",
                               tol=1e-6)
    for degree, n in ((5, 2), (5, 4), (7, 4)):
        for steps in (15, 25, 50, 100):
            yield ours.run(p, "cable", degree, n, steps=steps, scheme="radau", tol=1e-7)
    for steps in (10, 12, 15, 20, 25):
        for n in (2, 3):
            yield ours.run(p, "cable", 3, n, steps=steps, tol=1e-3)
            yield ours.run(p, "cable", 3, n, steps=steps, scheme="energy-momentum", tol=1e-3)
        for degree in (5, 7):
            for tol in (1e-2, 1e-3, 1e-4):
                yield ours.run(p, "cable", degree, 1, steps=steps, scheme="radau", tol=tol)
    for steps in (14, 16, 18, 19):
        yield ours.run(p, "cable", 3, 2, steps=steps, tol=3e-3)
    for steps in (100, 500, 2000):
        yield ours.run(p, "cubic", 2, 4, steps=steps, tol=1e-6)
    if exudyn_beams.exudyn is None:
        return
    for n in (4, 8, 16):
        for steps in (50, 100, 250, 500, 1000, 2000, 4000, 8000):
            for rtol in (1e-4, 1e-6) if steps > 250 else (1e-2, 1e-4):
                yield exudyn_beams.run(p, "ANCFCable2D", n, steps, rtol)
                yield exudyn_beams.run(p, "GE2D quadratic", n, steps, rtol)
    for kind in ("ANCFCable2D", "GE2D quadratic"):  # dense factors, kept or new in each iteration
        for n in (1, 2, 3, 4):
            for steps in (15, 20, 25, 35, 50, 75, 100, 150, 250, 500):
                if steps <= 50:
                    yield exudyn_beams.run(p, kind, n, steps, 1e-3, True, False)
                for modified in (False, None):
                    yield exudyn_beams.run(p, kind, n, steps, 1e-4, True, modified)


def quick(p):
    """A few cheap runs of each kind that a problem has."""
    if p.t_end is not None:
        steps = 100
        yield ours.run(p, "cable", 5, 2, steps=steps, tol=1e-6)
        yield ours.run(p, "cubic", 2, 2, steps=steps, tol=1e-6)
        if exudyn_beams.exudyn is not None:
            yield exudyn_beams.run(p, "ANCFCable2D", 8, steps, 1e-4)
        return
    if p.load == "traction":
        yield ours.run(p, "cubic", 3, 2)
        yield stock.q2(p, 4, 2)
        yield stock.textbook(p, 1, 1, 1)
        return
    yield ours.run(p, "cable", 5, 8)
    yield ours.run(p, "cubic", 2, 8)
    if exudyn_beams.exudyn is not None:
        yield exudyn_beams.run(p, "ANCFCable2D", 16, 10 if p.load == "moment" else 1)


CASES = {"5.2": gravity_52, "5.2-1e3": slender_fewer, "5.2-1e4": slender_fewer, "5.1": small,
         "thick": thick, "roll-up": roll_up, "pendulum": motion, "spin-up": spin_up,
         "free-rod": lambda p: motion(p, 2, adaptive=False)}


def runs_of(case, is_quick=False):
    """The list of the runs of a case, always in the same order."""
    return list((quick if is_quick else CASES[case])(PROBLEMS[case]))


def in_numpy(run):
    """The same run of this package without compiled code."""
    _, args, options = run.recipe
    return ours.run(run.problem, *args, **{**options, "compiled": False})


def warm_up():
    """Load what is loaded once a process: lazy imports, and all compiled code, made if need be."""
    runs = [stock.q2(PROBLEMS["thick"], 2, 2), ours.run(PROBLEMS["5.2"], "ancf", 1, 16)]
    for p in PROBLEMS.values():
        for kind in ("cubic",) if p.name == "thick" else ("cable", "cubic"):
            if p.t_end is None:
                runs.append(ours.run(p, kind, 3, 16))
            else:
                runs += [ours.run(p, kind, 3, 4, steps=200, scheme=scheme, tol=1e-6)
                         for scheme in ("generalized-alpha", "energy-momentum")]
    runs.append(ours.run(PROBLEMS["pendulum"], "cable", 5, 3, steps=100, scheme="radau", tol=1e-7))
    if exudyn_beams.exudyn is not None:
        runs += [exudyn_beams.run(PROBLEMS["5.2"], "ANCFCable2D", 3),
                 exudyn_beams.run(PROBLEMS["pendulum"], "ANCFCable2D", 8, 200, 1e-4)]
    before = os.environ.get(VARIABLE)
    os.environ[VARIABLE] = "1"
    try:
        for run in runs:
            solver = run.build()
            solver.read(solver.solve())
    finally:
        del os.environ[VARIABLE]
        if before is not None:
            os.environ[VARIABLE] = before
