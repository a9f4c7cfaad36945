"""Pickle, copies and threads: results are those of one process and one thread, bit for bit."""

import copy
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from skfem import LinearForm

from skfem_ancf import (AncfError, Beam, ElementBeamANCF, ElementBeamCable, MeshBeam, Scene,
                        StVenantKirchhoff)

MATERIAL = StVenantKirchhoff(E=2e8, nu=0.3, density=1000)


def ramp(t):
    return 10.0 * np.minimum(t, 1.0)


def circle(s):
    return np.array([np.cos(s), np.sin(s)])


def spin(x):
    return np.array([-x[1], x[0]])


def path(t):
    return (1.0 + 0.1 * t, 0.05 * t)


def pull(x):
    return np.array([0 * x[0], -10.0 * x[0]])


@LinearForm
def sideways(v, w):
    return 1e-3 * v[1] * w.x[0]


def scene():
    """Everything that a scene may have, with functions that have names."""
    a = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.02), ElementBeamANCF(2), MATERIAL, 0.02,
             name="a")
    b = Beam(MeshBeam.init_line(np.linspace(1, 2, 5), 0.02), ElementBeamANCF(2), MATERIAL, 0.02,
             name="b")
    made = Scene(a, b).clamp("left", beam="a").gravity((0, -0.5))
    made.joint("weld", beams=(a, b), at=("right", "left"), name="middle")
    made.moment("right", 1e-4, beam=b, amplitude=ramp).traction("top", pull, beam="a")
    made.load(sideways, beam="a").point_force((0, -1e-3), at=(2, 0), beam="b")
    return made.initial_velocity(spin, beam="b")


def followed():
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.02), ElementBeamCable(3), MATERIAL, 0.02)
    made = Scene(beam).pin("left").gravity((0, -0.5)).pressure("top", 1e-2)
    made.joint("position", at=(1, 0), r=path)
    return made


def solve(made):
    return made.solve_static().u


def same(a, b):
    assert_array_equal(np.asarray(a), np.asarray(b))


def round_trip(thing):
    return pickle.loads(pickle.dumps(thing))


COPIES = {"pickle": round_trip, "deepcopy": copy.deepcopy, "copy": copy.copy}


@pytest.mark.parametrize("how", COPIES)
@pytest.mark.parametrize("make", [scene, followed])
def test_scenes_and_their_results(make, how):
    original = make()
    again = COPIES[how](original)
    assert again is not original and repr(again) == repr(original)
    state, other = original.solve_static(), again.solve_static()
    same(other.u, state.u)
    same(other.multipliers, state.multipliers)
    history, repeated = original.integrate(0.02, 1e-3), again.integrate(0.02, 1e-3)
    same(repeated.u, history.u)
    same(repeated.v, history.v)
    # later changes of the copy are its own
    again.point_force((0, 1), at=(0.5, 0), beam=0)
    assert len(again.loads) == len(original.loads) + 1
    # of the results themselves
    for result in (state, history):
        copied = COPIES[how](result)
        same(copied.u, result.u)
        same(copied.strain_energy, result.strain_energy)
        for one, two in zip(original.joints, original.joints):
            same(copied.joint_force(one), result.joint_force(two))
    same(COPIES[how](history).state(-1).reactions("left", beam=0).force,
         history.state(-1).reactions("left", beam=0).force)
    # a copied state goes on
    same(original.solve_static(start=COPIES[how](state)).u, original.solve_static(start=state).u)


@pytest.mark.filterwarnings("ignore:the mesh is coarse")
@pytest.mark.parametrize("how", COPIES)
def test_paths_modes_and_adaptive_states(how):
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.02), ElementBeamANCF(2), MATERIAL, 0.02)
    made = Scene(beam).clamp("left").point_force((0, -1e-2), at=(1, 0))
    for result in (made.continuation(steps=3), made.modes(3),
                   made.modes(1, made.solve_static())):
        copied = COPIES[how](result)
        for name, value in vars(result).items():
            if isinstance(value, np.ndarray):
                same(getattr(copied, name), value)
    state = made.solve_static(adapt=1e-2)
    copied = COPIES[how](state)
    assert copied.error_estimate == state.error_estimate
    same(copied.scene.solve_static().u, state.u)


def beam():
    return Beam(MeshBeam.init_line([0, 0.5, 1], 0.05), ElementBeamANCF(1), MATERIAL, 0.02)


def test_errors_keep_their_state():
    made = Scene(beam()).clamp("left").point_force((0, -1e3), at=(1, 0))
    with pytest.raises(AncfError) as failure:
        made.solve_static(max_iterations=1, min_step=0.5)
    again = round_trip(failure.value)
    assert str(again) == str(failure.value)
    same(again.state.u, failure.value.state.u)


def test_other_processes():
    """As multiprocessing with spawn, joblib and Dask do: everything is sent by pickle."""
    scenes = [scene(), followed()]
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        found = list(pool.map(solve, scenes))
        state = pool.submit(followed().solve_static).result()
    # where the arrays lie in memory decides how some kernels of OpenBLAS add
    for a, b in zip(found, scenes):
        assert_allclose(a, solve(b), rtol=0, atol=1e-12)
    assert_allclose(state.displacement((1, 0)), followed().solve_static().displacement((1, 0)),
                    rtol=0, atol=1e-12)


def work(made):
    state = made.solve_static()
    return (state.u, made.integrate(0.01, 1e-3).u, made.modes(2, state).frequencies,
            made.solve_linear().u)


@pytest.mark.parametrize("compiled", [True, False])
def test_threads(compiled):
    """Scenes that share their beams, one scene in all threads, and both together."""
    def variants():
        shared = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.02), ElementBeamANCF(2), MATERIAL,
                      0.02, compiled=compiled)
        made = [Scene(shared).clamp("left").point_force((0, -f), at=(1, 0))
                for f in (1e-3, 1e-2, 3e-2)]
        made[1].joint("line", at=(1, 0), direction=(1, 3))
        return made

    wanted = [work(made) for made in variants()]
    made = variants()
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(work, made * 4))
    for k, results in enumerate(found):
        for a, b in zip(results, wanted[k % 3]):
            same(a, b)
    assert all(m.system is m.system for m in made)
    with ThreadPoolExecutor(4) as pool:  # a beam that is new to all of them
        fresh = Beam(MeshBeam.init_curve(circle, np.linspace(0, 2, 9), 0.02), ElementBeamANCF(2),
                     MATERIAL, 0.02, compiled=compiled)
        forces = list(pool.map(lambda k: Scene(fresh).clamp("left").gravity((0, -1e-3))
                               .solve_static().u, range(4)))
    for u in forces[1:]:
        same(u, forces[0])
