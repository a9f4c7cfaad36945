"""Functions of ``@apart``: compiled once, called by address, compiled anew with their source."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from skfem_ancf.core import callbacks
from skfem_ancf.core.source import APART, F1, PYTHON, apart, indices, source
from skfem_ancf.core.code_cache import compiled_off

needs_numba = pytest.mark.skipif(compiled_off() is not None, reason="without Numba")


@apart("test of apart", F1, float, returns=float)
def weighted(x, factor):
    total = 0.0
    for i in range(x.size):
        total += factor * x[i] ** 2
    return total


@apart("test of apart", F1, float)
def scale(x, factor):
    for i in indices(x.size):
        x[i] *= factor


@apart(PYTHON, int, returns=int)
def asked(number):
    if number < 0:
        raise ValueError(f"{number} is negative")
    return 2 * number


@source
def one(x):
    scale(x, 3.0)
    return weighted(x, 0.5)


@source
def other(x):
    return weighted(x, 1.0)


@source
def both(x, number):
    found = asked(number)
    return found + asked(number + 1), x.size


def test_marked_functions_are_plain_python():
    """As without Numba."""
    x = np.array([1.0, 2.0])
    assert one(x) == 22.5 and x.tolist() == [3.0, 6.0] and other(x) == 45.0
    assert both(x, 4) == (18, 2)
    with pytest.raises(ValueError, match="-1 is negative"):
        both(x, -1)


@pytest.fixture
def jit():
    from skfem_ancf.core import jit

    return jit


@needs_numba
def test_a_function_is_compiled_once_and_called_by_its_address(jit, monkeypatch):
    made = []
    address = jit.address
    monkeypatch.setattr(jit, "address", lambda function, *args, **more: made.append(
        function.__name__) or address(function, *args, **more))
    x = np.array([1.0, 2.0])
    first, second = jit.entry(one, (x,)), jit.entry(other, (x,))
    assert first(x) == 22.5 and second(x) == 45.0 and x.tolist() == [3.0, 6.0]
    first(x)
    # at their first call, each once for all callers
    assert made == ["scale", "weighted"]


@needs_numba
def test_the_exception_of_a_part_in_python_is_raised_after_the_call(jit):
    run = jit.entry(both, (np.zeros(2), 1))
    assert run(np.zeros(2), 4) == (18, 2)
    assert run(np.zeros(2), -5) == (0, 2)  # of both calls
    with pytest.raises(ValueError, match="-5 is negative"):
        callbacks.raise_kept()
    assert run(np.zeros(2), 1) == (6, 2)
    callbacks.raise_kept()


@needs_numba
def test_a_part_that_cannot_be_compiled_ends_the_call(jit):
    @apart("test of apart, wrong", F1)
    def wrong(x):
        x.no_such_method()

    @source
    def caller(x):
        wrong(x)
        return x.size

    try:
        run = jit.entry(caller, (np.zeros(3),))
        assert run(np.zeros(3)) == 3
        with pytest.raises(Exception, match="no_such_method"):
            callbacks.raise_kept()
        run(np.zeros(3))
        with pytest.raises(RuntimeError, match="could not be compiled"):
            callbacks.raise_kept()
    finally:
        del APART[wrong]


CALLER = """
from callee import part
from skfem_ancf.core.source import source

@source
def caller(x):
    return 10.0 * part(x)
"""
CALLEE = """
from skfem_ancf.core.source import F1, apart

@apart("test", F1, returns=float)
def part(x):
    return x[0] + {}
"""
RUN = """
import numpy as np
from skfem_ancf.core import code_cache
import caller, callee
files = code_cache.compiled_files()
more = [code_cache.Path(m.__file__) for m in (caller, callee)]
files.update((p, p.read_bytes()) for p in more)
from skfem_ancf.core import jit
made = []
kept = jit._kept
jit._kept = lambda function, make: made.append(function.__name__) or kept(function, make)
run = jit.entry(caller.caller, (np.ones(1),))
cached = code_cache.Path(jit.njit(cache=True)(caller.caller).stats.cache_path)
print(run(np.ones(1)), made, len(list(cached.glob("*.nbc"))))
"""


@needs_numba
def test_a_changed_source_is_compiled_anew_and_an_unchanged_one_is_not(tmp_path):
    """Although Numba checks the file of the caller only."""
    def run():
        paths = os.pathsep.join([str(tmp_path), str(Path(__file__).parents[1])])
        environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"),
                                    "PYTHONPATH": paths}
        return subprocess.run([sys.executable, "-c", RUN], env=environment, check=True,
                              capture_output=True, text=True).stdout.strip()

    (tmp_path / "caller.py").write_text(CALLER)
    found = []
    for number in (1.0, 1.0, 4.0):
        (tmp_path / "callee.py").write_text(CALLEE.format(number))
        found.append(run())
    # result, what is compiled or loaded, files on disk
    assert found[0] == found[1] == "20.0 ['caller', 'part'] 2"
    assert found[2] == "50.0 ['caller', 'part'] 4"
