"""How far the comparisons of the tests are from their bounds: ``pytest --margins FILE``.

Another processor, or another library of linear algebra, changes results by round-off. A test whose
bound is near round-off and hardly larger than what is compared with it fails there. While the tests
run, this measures ``pytest.approx``, ``numpy.testing.assert_allclose``, ``np.allclose`` and
``np.isclose``. The file lists places, the narrowest first, with the margin, which is the bound over
what is compared with it, and the bound, relative to the size of what is expected.
"""

import functools
import sys
from pathlib import Path

import numpy as np
import pytest

#: Relative bounds below which a comparison is one with round-off, and the margin that it must have.
ROUND_OFF, MARGIN = 1e-9, 10.0
HERE = Path(__file__).parent

#: From a place to the narrowest margin, its bound, and what was compared with it.
found: dict[str, tuple[float, float, float]] = {}


def place_of(frame):
    """File and line of the test that compares; None for comparisons of the package."""
    while frame is not None:
        path = Path(frame.f_code.co_filename)
        if path.is_relative_to(HERE.parent / "skfem_ancf"):
            return None
        if path.parent == HERE and path.name != "margins.py":
            return f"{path.name}:{frame.f_lineno}"
        frame = frame.f_back
    return None


def note(place, actual, desired, rtol, atol):
    """Take the margin of arrays that are compared; one below 1 says no, as in ``not allclose``."""
    try:
        actual, desired = np.broadcast_arrays(np.asarray(actual), np.asarray(desired))
        gap, size = np.abs(actual - desired).astype(float), np.abs(desired).astype(float)
    except (TypeError, ValueError):
        return
    bound = np.broadcast_to(atol + rtol * size, gap.shape)
    with np.errstate(all="ignore"):
        margins = np.where(gap > 0.0, bound / gap, np.inf)
    if not margins.size or not np.isfinite(margins).any():
        return
    k = np.unravel_index(np.nanargmin(margins), margins.shape)
    scale = np.max(size[np.isfinite(size)], initial=0.0) or 1.0
    if 1.0 <= margins[k] < found.get(place, (np.inf,))[0]:
        found[place] = float(margins[k]), float(bound[k] / scale), float(gap[k])


def measured(function, rtol, atol):
    """A function of NumPy that notes what it compares."""
    @functools.wraps(function)
    def compare(actual, desired, *args, **options):
        place = place_of(sys._getframe(1))
        if place is not None:
            given = dict(zip(("rtol", "atol"), args)) | options
            note(place, actual, desired, given.get("rtol", rtol), given.get("atol", atol))
        return function(actual, desired, *args, **options)

    return compare


def install():
    """Measure from now on; before tests are imported."""
    scalar = type(pytest.approx(1.0))
    equal = scalar.__eq__

    def approx_equal(self, actual):
        place = place_of(sys._getframe(1))
        if place is not None:
            note(place, actual, self.expected, 0.0, self.tolerance)
        return equal(self, actual)

    scalar.__eq__ = approx_equal
    np.testing.assert_allclose = measured(np.testing.assert_allclose, 1e-7, 0.0)
    np.allclose = measured(np.allclose, 1e-5, 1e-8)
    np.isclose = measured(np.isclose, 1e-5, 1e-8)


def narrow():
    """Places, narrowest first, of comparisons near round-off that have less than the margin."""
    return sorted((margin, relative, gap, place) for place, (margin, relative, gap)
                  in found.items() if relative < ROUND_OFF and margin < MARGIN)


def pytest_sessionfinish(session):
    path = session.config.getoption("margins")
    if not path:
        return
    rows = ["{:10.3g} {:10.3g} {:10.3g}  {}".format(*row) for row in narrow()]
    Path(path).write_text("\n".join([
        f"# comparisons near round-off whose bound is less than {MARGIN:g} times what is there, of "
        f"{len(found)}", "#   margin      bound      value  place", *rows, ""]), encoding="utf-8")
    if rows:
        session.exitstatus = session.exitstatus or pytest.ExitCode.TESTS_FAILED
