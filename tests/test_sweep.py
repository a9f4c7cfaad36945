"""Sweeps: every member against its closed form, wherever it is computed."""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from skfem_ancf import (Beam, CallbackError, CallError, ElementBeamCable, InputError, MeshBeam,
                        MissingExtra, Scene, StVenantKirchhoff, sweep)
from skfem_ancf.core.errors import Interrupted, PickleError, SweepWarning

MESH = MeshBeam.init_line([0.0, 0.5, 1.0], 0.01)
FORCE = 1e-4


def cantilever(E, width=0.01):
    beam = Beam(MESH, ElementBeamCable(5), StVenantKirchhoff(E=E, nu=0.3), width)
    return Scene(beam).clamp("left").point_force((0, -FORCE), at=(1, 0))


def deflection(scene):
    return -scene.solve_static().displacement((1, 0))[1]


def formula(E, width=0.01):
    """Of the tip, for small deflections."""
    return 4.0 * FORCE / (np.asarray(E) * np.asarray(width) * 0.01**3)


def just(x):
    return x


def root(x):
    if x < 0.0:
        raise ValueError(f"no root of {x:g}")
    return x**0.5


def lethal(scene):
    if scene.beams[0].width == 3.0:
        os._exit(1)
    return deflection(scene)


E = [1e9, 2e9, 4e9, 8e9, 1.6e10]


def test_each_member_has_its_closed_form():
    result = sweep(cantilever, {"E": E, "width": [0.01, 0.02, 0.03, 0.04, 0.05]}, deflection)
    assert_allclose(result["value"], formula(E, result["width"]), rtol=1e-5)
    assert result.failures == []


def test_processes_give_the_same_and_lose_only_the_one_that_dies():
    table = {"E": E, "width": [0.01, 0.02, 3.0, 0.03, 0.04]}
    with pytest.warns(SweepWarning, match="BrokenProcessPool"):
        there = sweep(cantilever, table, lethal, workers=2)
    assert [failure.member for failure in there.failures] == [2]
    here = sweep(cantilever, table, deflection)["value"]
    assert_allclose(np.delete(there["value"], 2), np.delete(here, 2), rtol=1e-14)


def test_a_cluster_gives_the_same():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None
                                  ) as cluster, distributed.Client(cluster) as client:
        there = sweep(cantilever, {"E": E}, deflection, client=client)
        with pytest.warns(SweepWarning, match="no root of -1"):
            roots = sweep(just, {"x": [4.0, -1.0]}, root, client=client)
    here = sweep(cantilever, {"E": E}, deflection)
    assert_allclose(there["value"], here["value"], rtol=1e-14)
    assert_array_equal(roots["value"], [2.0, np.nan])


def test_what_fails_is_listed_and_the_others_go_on():
    with pytest.warns(SweepWarning, match=r"1 of 3 members failed.*-4.*no root of -4"):
        result = sweep(just, {"x": [1.0, -4.0, 9.0]}, root)
    assert_array_equal(result["value"], [1.0, np.nan, 3.0])
    (failure,) = result.failures
    assert failure == (1, {"x": -4.0}, "ValueError: no root of -4")


def test_an_interrupted_sweep_has_what_is_done():
    def measure(x):
        if x == 2.0:
            raise KeyboardInterrupt
        return root(x - 0.5)

    with pytest.raises(Interrupted, match="interrupted with 2 of 5 members done") as caught:
        sweep(just, {"x": np.arange(5.0)}, measure)
    assert_array_equal(caught.value.state["value"], [np.nan, 0.5**0.5, *3 * [np.nan]])
    assert [failure.member for failure in caught.value.state.failures] == [0]


def test_a_table_of_pandas():
    pandas = pytest.importorskip("pandas")
    result = sweep(just, pandas.DataFrame({"x": [1.0, 4.0]}), lambda x: x**0.5)
    assert_array_equal(result["value"], [1.0, 2.0])


@pytest.mark.parametrize("table, error, text", [
    ({"E": [1e9], "width": [0.01, 0.02]}, InputError, "equal lengths, got .*itertools.product"),
    ({"E": [1e9], "wdith": [0.1]}, CallError, "'E', 'wdith': got an unexpected .*'wdith'"),
    ({"width": [0.01]}, CallError, "build does not fit the parameters 'width': missing.*'E'"),
    ({"E": 1e9}, InputError, "'E' must have one value for each member.*belongs into build"),
    ({}, InputError, "no members"), ({"E": []}, InputError, "no members"),
    ([{"E": 1.0}, {"width": 2.0}], InputError, "equal names.*number 1 is"),
    (7, InputError, "dict of arrays or a list of dicts, got 7"),
])
def test_a_wrong_table_is_refused(table, error, text):
    with pytest.raises(error, match=text):
        sweep(cantilever, table, deflection)


def test_functions_that_cannot_be_sent_are_refused():
    with pytest.raises(PickleError, match="measure, .*lambda.*by def at the top of a module"):
        sweep(just, {"x": [1.0]}, lambda x: x, workers=2)


@pytest.mark.parametrize("options, text", [
    (dict(workers=0), "workers must be an integer >= 1"), (dict(client=3), "distributed.Client"),
    (dict(workers=1, client=3), "give one of them"),
])
def test_wrong_options_are_refused(options, text):
    with pytest.raises(InputError, match=text):
        sweep(just, {"x": [1.0]}, abs, **options)


def test_what_is_measured_has_one_shape_and_new_names():
    with pytest.warns(SweepWarning, match=r"\(2,\), of the first member 'value' of shape \(1,\)"):
        result = sweep(just, {"x": [1, 2, 1]}, np.ones)
    assert_array_equal(result["value"][:, 0], [1.0, np.nan, 1.0])
    for measure, text in ((str, "must return a number"), (lambda x: {"x": 1}, "another name"),
                          (lambda x: None, "got None")):
        with pytest.raises(CallbackError, match=f"3 of 3 members failed.*{text}"):
            sweep(just, {"x": [1, 2, 1]}, measure)


def test_xarray_has_the_parameters_as_coordinates(monkeypatch):
    result = sweep(just, {"x": [1.0, 2.0]}, lambda x: {"square": x**2, "pair": [x, -x]})
    with monkeypatch.context() as patch, pytest.raises(MissingExtra, match=r"\[arrays\]"):
        patch.setitem(__import__("sys").modules, "xarray", None)
        result.to_xarray()
    pytest.importorskip("xarray")
    data = result.to_xarray()
    assert data["square"].swap_dims(member="x").sel(x=2.0) == 4.0
    assert data["pair"].dims == ("member", "pair_0")


def test_an_executor_gives_the_same():
    with ThreadPoolExecutor(2) as client:
        there = sweep(cantilever, {"E": E}, deflection, client=client)
    assert_allclose(there["value"], formula(E), rtol=1e-4)
