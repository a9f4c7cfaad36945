"""Python calls of small tasks: they are the same on every machine, and do not grow unseen."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

CALLS = Path(__file__).parents[1] / "benchmarks" / "calls.py"
#: Calls around the kernels, measured; a tenth more may be due to versions of NumPy and SciPy.
AROUND = {
    "whole, ANCF(3)": 1350, "whole, cable(5)": 1180, "solve again": 194,
    "displacement again": 94, "replace E, solve": 1115, "strain, first": 3080,
    "strain, again": 200, "100 steps": 648, "run, 10 steps": 1782, "frame 14 x 14": 5000,
}


@pytest.fixture(scope="module")
def counted():
    """Calls around the kernels by task, in a process of their own: what other tests have loaded
    changes the way to a kernel."""
    run = subprocess.run([sys.executable, CALLS], check=True, stdout=subprocess.PIPE, text=True,
                         env=os.environ | {"SKFEM_ANCF_COMPILED": "0"})
    lines = [line.rsplit(None, 2) for line in run.stdout.splitlines()]
    found = {name: int(around) for name, _, around in lines}
    assert found.keys() == AROUND.keys()
    return found


@pytest.mark.parametrize("name", AROUND)
def test_calls_around_the_kernels(name, counted):
    assert counted[name] <= 1.1 * AROUND[name]
