"""Python calls of small tasks: they are the same on every machine, and do not grow unseen."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
calls = pytest.importorskip("calls")

#: Calls around the kernels, measured; a tenth more may be due to versions of NumPy and SciPy.
AROUND = {
    "whole, ANCF(3)": 1350, "whole, cable(5)": 1180, "solve again": 194,
    "displacement again": 94, "replace E, solve": 1115, "strain, first": 3080,
    "strain, again": 200, "100 steps": 648, "run, 10 steps": 1782, "frame 14 x 14": 5000,
}


@pytest.mark.parametrize("name", calls.TASKS)
def test_calls_around_the_kernels(name, monkeypatch):
    monkeypatch.setenv("SKFEM_ANCF_COMPILED", "0")
    assert calls.calls(name, kernels=False) <= 1.1 * AROUND[name]
