"""The table of docs/verification.md: every case meets its reference."""

import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def verification():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "benchmarks")
        yield importlib.import_module("verification")


#: Largest error of the quintic cable, or of cubic sections where a cable knows no answer. The
#: body welded at L/h = 4 is off by its boundary layer on eight elements.
BOUNDS = {"Thick cantilever, L/h = 4, large deflection": 4e-3,
          "Cantilever, L/h = 10": 1e-4, "Arch of 215 degrees, clamped and hinged": 2e-4,
          "Strain across a slender cantilever, L/h = 100": 1e-3}


def test_every_case_meets_its_reference(verification):
    rows = []
    for case in verification.CASES:
        best = "cubic sections, N = 2" if case.without else "cable, degree 5"
        row, = verification.compute([case], {best: verification.ELEMENTS[best]})
        assert 95 <= row.coordinates[best] <= 125, case.name
        assert abs(row.errors[best]) < BOUNDS.get(case.name, 2e-5), case.name
        rows.append(row)
    assert set(BOUNDS) <= {case.name for case in verification.CASES}
    text = verification.table(rows)
    assert all(f"| {row.case.name} | " in text for row in rows)


def test_errors_fall_with_the_mesh(verification):
    """Of all three elements, on a case that takes no time."""
    case, = (c for c in verification.CASES if c.name == "Cantilever, tip force 10 EI/L^2")
    for name, (element, n) in verification.ELEMENTS.items():
        coarse, fine = (verification.compute([case], {name: (element, m)})[0].errors[name]
                        for m in (n // 2, n))
        assert abs(fine) < 0.4 * abs(coarse), name
