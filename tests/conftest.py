"""Fixtures: every element of the registry, and meshes of every kind."""

import doctest
import os
from importlib.util import find_spec

# compiled from the first call on: what a test does must not depend on the time that others took
os.environ.setdefault("SKFEM_ANCF_COMPILED", "1")

import numpy as np
import pytest

import margins
import noise

from skfem_ancf import MeshBeam
from skfem_ancf.elements import ELEMENTS
from skfem_ancf.core.code_cache import compiled_off


def pytest_addoption(parser):
    parser.addoption("--margins", metavar="FILE",
                     help="list comparisons near round-off that are close to their bound")
    parser.addoption("--noise", metavar="SEED", type=int,
                     help="change what processors round differently by a few ulp; no doctests")


def pytest_configure(config):
    if config.getoption("noise") is not None:
        noise.install(config.getoption("noise"))
        config.addinivalue_line("filterwarnings", "ignore:overflow encountered in scalar multiply")
    if config.getoption("margins"):
        margins.install()
        config.pluginmanager.register(margins)


def pytest_collection_modifyitems(config, items):
    """Pages and docstrings print digits: they run without noise."""
    if config.getoption("noise") is not None:
        some = [x for x in items if isinstance(x, pytest.DoctestItem)]
        config.hook.pytest_deselected(items=some)
        items[:] = [x for x in items if x not in some]


def _skip_without_extra(error):
    """Skip the test if an error says that an extra is missing, and it is."""
    if isinstance(error, doctest.UnexpectedException):
        error = error.exc_info[1]
    if isinstance(error, ImportError):
        missing = getattr(error, "module", error.name)
        if missing and find_spec(_IMPORTED.get(missing, missing.partition(".")[0])) is None:
            pytest.skip(f"{missing} is not installed")


#: Names of modules, where they are not those of the packages.
_IMPORTED = {"pillow": "PIL"}


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item):
    try:
        return (yield)
    except Exception as error:
        _skip_without_extra(error)
        raise


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item):
    try:
        return (yield)
    except Exception as error:
        _skip_without_extra(error)
        raise


def quarter_arc(n=3, height=0.3, radius=1.0):
    """A quarter of a circle about the origin, n elements, parameter = angle."""
    return MeshBeam.init_curve(lambda s: radius * np.array([np.cos(s), np.sin(s)]),
                               np.linspace(0.0, np.pi / 2, n + 1), height)


def s_curve(height=0.2):
    """A curve that bends both ways, with unequal elements and a parameter that is no length."""
    return MeshBeam.init_curve(lambda s: np.array([2 * s + 0.2 * s ** 2, 0.4 * np.sin(2.5 * s)]),
                               [-1.0, -0.2, 0.1, 0.8, 1.3], height)


MESHES = {
    "straight": lambda: MeshBeam.init_line([0.0, 0.5, 1.0, 1.5], 0.2),
    "unequal": lambda: MeshBeam.init_line([-1.0, -0.9, 0.3, 1.7], 0.37),
    "inclined": lambda: MeshBeam.init_line([0.0, 0.4, 1.1], 0.25, origin=(3.0, -2.0), angle=2.3),
    "one element": lambda: MeshBeam.init_line([0.0, 1.3], 0.8, angle=-0.4),
    "arc": quarter_arc,
    "s-curve": s_curve,
    "s-curve, cubic sections": lambda: s_curve().with_sections("cubic"),
}
STRAIGHT = ("straight", "unequal", "inclined", "one element")


@pytest.fixture(params=ELEMENTS)
def element(request):
    """Each element of the registry, a new one for each test."""
    return ELEMENTS[request.param]()


@pytest.fixture(params=MESHES)
def mesh(request):
    """Straight, unequal, inclined, single-element and curved meshes."""
    return MESHES[request.param]()


@pytest.fixture
def needs_compiled():
    """Skips a test where Numba is missing or left out."""
    if compiled_off() is not None:
        pytest.skip(compiled_off())


@pytest.fixture
def interrupted(monkeypatch):
    """Calls what integrates with a checkpoint, up to an interrupt; returns the exception."""
    from skfem_ancf.dynamics.integrate import Checkpoint

    def run(integrate, steps=14):
        update = Checkpoint.update

        def stop(self):
            update(self)
            if self.run.steps >= steps:
                raise KeyboardInterrupt

        with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt) as caught:
            patch.setattr(Checkpoint, "update", stop)
            integrate()
        return caught.value

    return run


@pytest.fixture
def arc():
    return quarter_arc()
