"""Ctrl-C in motions, and pickles of scikit-fem's own objects."""

import copy
import os
import pickle
import signal
import subprocess
import sys
import time
from functools import partial
from threading import Thread

import numpy as np
import pytest
from skfem import BilinearForm, LinearForm
from skfem.generic_utils import OrientedBoundary

from skfem_ancf import (Beam, Circle, ElementBeamCable, Interrupted, MeshBeam, Scene,
                        StVenantKirchhoff)


@pytest.fixture(autouse=True)
def pythons_own_handler():
    """A process that a shell has started in the background ignores Ctrl-C."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def swinging():
    beam = Beam(MeshBeam.init_line([0.0, 0.5, 1.0], height=0.02), ElementBeamCable(3),
                StVenantKirchhoff(2e8, 0.3, 7800.0), width=0.02)
    return Scene(beam).pin("left").gravity((0, -9.81))


@pytest.mark.parametrize("scheme", ["energy-momentum", "gauss", "generalized-alpha"])
@pytest.mark.parametrize("stop", [KeyboardInterrupt, partial(signal.raise_signal, signal.SIGINT)])
def test_ctrl_c_in_a_users_function_keeps_the_steps_before(scheme, stop):
    """Raised by the function, or by a signal while it runs; with the instants of a whole motion."""
    asked, after = [], [10**9]

    def tension(stretch):
        asked.append(stretch)
        if len(asked) > after[0]:
            if isinstance(stop, type):
                raise stop
            stop()
        return 1e2 * stretch

    scene = swinging().spring(tension, ((1.0, 0.0), (1.0, -1.0)))
    whole = scene.integrate(0.1, 2e-3, scheme=scheme)
    after[0] = len(asked) + 4 * len(asked) // 5
    with pytest.raises(Interrupted, match="stopped at t = ") as caught:
        scene.integrate(0.1, 2e-3, scheme=scheme)
    kept = caught.value.state
    assert 20 < len(kept) < len(whole)
    assert np.array_equal(kept.u, whole.u[:len(kept)])
    assert np.array_equal(kept.t, whole.t[:len(kept)])
    after[0] = 10**9
    rest = scene.integrate(0.1, 2e-3, scheme=scheme, start=kept.state(-1))
    assert np.allclose(rest.u[-1], whole.u[-1], rtol=0.0, atol=1e-7)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize("part", [0.3, 0.55, 0.8])
@pytest.mark.parametrize("acts", ["spring", "obstacle"])
def test_no_step_is_kept_after_the_function_stopped(acts, part):
    """Wherever in a step that is: iterations go on without what the function gives, and fail."""
    asked, last = [0], [10**9]

    def given(x):
        asked[0] += 1
        if asked[0] > last[0]:
            raise KeyboardInterrupt
        return 1e2 * x if acts == "spring" else (0.9, -0.113 + 0.05 * x)

    scene = swinging()
    if acts == "spring":
        scene.spring(given, ((1.0, 0.0), (1.0, -1.0)))
    else:
        scene.obstacle(Circle((0.0, 0.0), 0.1), position=given)
    whole = scene.integrate(0.1, 2e-3, scheme="energy-momentum")
    number, asked[0] = asked[0], 0
    for k in range(5):
        last[0], asked[0] = int(part * number) + k, 0
        with pytest.raises(Interrupted) as caught:
            scene.integrate(0.1, 2e-3, scheme="energy-momentum")
        kept = caught.value.state
        assert len(kept) < len(whole)
        assert np.array_equal(kept.u, whole.u[:len(kept)])


@pytest.mark.parametrize("handled", [signal.default_int_handler, "own"])
@pytest.mark.parametrize("scheme", ["energy-momentum", "gauss"])
def test_signals_at_any_instant_keep_the_steps_before(scheme, handled):
    """Also with a handler of the user, and between the calls of his function."""
    asked, after, seen = [0], [10**9], []

    def late():
        time.sleep(1e-4 * len(seen))
        signal.raise_signal(signal.SIGINT)

    def stop(*args):
        seen.append(args[0])
        raise KeyboardInterrupt

    def tension(stretch):
        asked[0] += 1
        if asked[0] == after[0]:
            threads.append(Thread(target=late))
            threads[-1].start()
        return 1e2 * stretch

    threads = []
    scene = swinging().spring(tension, ((1.0, 0.0), (1.0, -1.0)))
    whole = scene.integrate(0.5, 2e-3, scheme=scheme)
    number, before = asked[0], signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, stop if handled == "own" else handled)
    try:
        for k in range(12):
            asked[0], after[0] = 0, number // 20 + k
            with pytest.raises(Interrupted, match="stopped at t = ") as caught:
                scene.integrate(0.5, 2e-3, scheme=scheme)
            kept = caught.value.state
            assert 5 < len(kept) < len(whole)
            assert np.array_equal(kept.u, whole.u[:len(kept)])
        assert signal.getsignal(signal.SIGINT) is (stop if handled == "own" else handled)
    finally:
        signal.signal(signal.SIGINT, before)
    for thread in threads:
        thread.join()
    assert len(threads) == 12 and (len(seen) == 12 or handled != "own")


@LinearForm
def named(v, w):
    return v[0]


def scaled(k, v, w):
    return k * v[0]


class Callable:
    def __call__(self, u, v, w):
        return u * v


def test_stock_forms_are_pickled_and_copied_as_without_the_package():
    for form in (LinearForm(partial(scaled, 2.0)), BilinearForm(Callable()), LinearForm(scaled)):
        for other in (pickle.loads(pickle.dumps(form)), copy.copy(form), copy.deepcopy(form)):
            assert type(other) is type(form) and type(other.form) is type(form.form)
    code = ("import copyreg; before = dict(copyreg.dispatch_table); import skfem, skfem_ancf; "
            "print([k for k in copyreg.dispatch_table if k.__module__.startswith('skfem')])")
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                           env=dict(os.environ), check=True).stdout
    assert found.strip() == "[]"


def test_scenes_with_decorated_forms_and_oriented_boundaries_are_pickled():
    scene = swinging().clamp("right").load(named)
    for other in (pickle.loads(pickle.dumps(scene)), copy.copy(scene), copy.deepcopy(scene)):
        assert np.array_equal(other.solve_linear().u, scene.solve_linear().u)
    mesh = scene.beams[0].mesh.with_boundaries({"upper": OrientedBoundary([3, 4], [0, 1])})
    for other in (pickle.loads(pickle.dumps(mesh)), copy.copy(mesh)):
        assert other.boundaries["upper"].ori.tolist() == [0, 1]
        assert np.asarray(other.boundaries["upper"]).tolist() == [3, 4]
