"""How far the comparisons of the tests are from their bounds: ``pytest --margins FILE``.

Another processor, or another library of linear algebra, changes results by round-off. A test whose
bound is near round-off and hardly larger than what is compared with it fails there. While the tests
run, this measures ``pytest.approx``, ``numpy.testing.assert_allclose``, ``np.allclose`` and
``np.isclose``, and ``<``, ``<=``, ``>``, ``>=`` in ``assert``. The file lists places, the narrowest
first, with the margin, which is the bound over what is compared with it, and the bound, relative to
the size of what is expected where that is known.
"""

import ast
import functools
import operator
import sys
from pathlib import Path

import numpy as np
import pytest

#: Relative bounds below which a comparison is one with round-off, and the margin that it must have.
ROUND_OFF, MARGIN = 1e-9, 10.0
#: Below this margin a comparison says no: in ``not np.allclose``, or before an ``or``.
APART = 1.0

HERE = Path(__file__).parent
COMPARED = {ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge}
NAME = "@margin"

#: From place and kind to the narrowest margin, its bound, and what was compared with it.
found: dict[tuple[str, str], tuple[float, float, float]] = {}


def note(place, kind, value, bound, relative):
    """Take the margin of one comparison."""
    if not (np.isfinite(value) and 0.0 < bound < np.inf):
        return
    margin = bound / value if value > 0.0 else np.inf
    if APART <= margin < found.get((place, kind), (np.inf,))[0]:
        found[place, kind] = float(margin), float(relative), float(value)


def place_of(frame, place=None):
    """File and line of the test that compares, and of what it calls to do so; None for others."""
    while frame is not None:
        path = Path(frame.f_code.co_filename)
        if path.is_relative_to(HERE.parent / "skfem_ancf"):
            return place
        if path.parent == HERE and path.name != "margins.py":
            here = f"{path.name}:{frame.f_lineno}"
            if place is None:
                place = here
            if frame.f_code.co_name.startswith("test_"):
                return place if place == here else f"{place} of {here}"
        frame = frame.f_back
    return place


def note_close(place, kind, actual, desired, rtol, atol):
    """Take the margin of arrays that are compared."""
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
    scale = np.max(size[np.isfinite(size)], initial=0.0)
    note(place, kind, gap[k], bound[k], bound[k] / scale if scale > 0.0 else bound[k])


def measured(function, rtol, atol):
    """A function of NumPy that notes what it compares."""
    @functools.wraps(function)
    def compare(actual, desired, *args, **options):
        place = place_of(sys._getframe(1))
        if place is not None:
            given = dict(zip(("rtol", "atol"), args)) | options
            note_close(place, function.__name__, actual, desired, given.get("rtol", rtol),
                       given.get("atol", atol))
        return function(actual, desired, *args, **options)

    return compare


def compare(values, kinds, place, small):
    """What ``a < b <= c`` of an assert is, noted; ``small`` is the least of its tiny numbers."""
    result, place = True, place_of(sys._getframe(1), place)
    for a, kind, b in zip(values, kinds, values[1:]):
        result = result and getattr(operator, kind)(a, b)
        low, high = (a, b) if kind in ("lt", "le") else (b, a)
        try:
            low, high = np.broadcast_arrays(np.abs(np.asarray(low, float)),
                                            np.abs(np.asarray(high, float)))
        except (TypeError, ValueError):
            continue
        if low.size and np.isfinite(low).all() and np.isfinite(high).all():
            with np.errstate(all="ignore"):
                k = np.unravel_index(np.argmin(np.where(low > 0.0, high / low, np.inf)), low.shape)
            note(place, "assert", low[k], high[k], min(small or np.inf, high[k]))
    return result


def tiny(node):
    """Numbers below :data:`ROUND_OFF` in an expression, none added to something, nor ``tol=``."""
    if isinstance(node, ast.Constant):
        x = node.value
        return [x] if isinstance(x, float) and 0.0 < x < ROUND_OFF else []
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == NAME:
        return []  # another comparison
    added = isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub))
    return [x for part in ast.iter_child_nodes(node) for x in tiny(part)
            if not (isinstance(part, ast.keyword) or added and isinstance(part, ast.Constant))]


class Transformer(ast.NodeTransformer):
    """Puts :func:`compare` in place of comparisons."""

    def __init__(self, name):
        self.name = name

    def visit_Compare(self, node):
        self.generic_visit(node)
        if not all(type(kind) in COMPARED for kind in node.ops):
            return node
        numbers = [x for part in [node.left, *node.comparators] for x in tiny(part)]
        small = min(numbers, default=None)
        kinds = tuple(COMPARED[type(kind)].__name__ for kind in node.ops)
        call = ast.Call(ast.Name(NAME, ast.Load()), [
            ast.List([node.left, *node.comparators], ast.Load()),
            *map(ast.Constant, (kinds, f"{self.name}:{node.lineno}", small))], [])
        return ast.fix_missing_locations(ast.copy_location(call, node))


def install():
    """Measure from now on; before tests are imported."""
    import builtins

    from _pytest.assertion import rewrite

    ApproxScalar = type(pytest.approx(1.0))
    setattr(builtins, NAME, compare)
    rewrite_asserts = rewrite.rewrite_asserts

    def rewritten(mod, source, module_path=None, config=None):
        path = Path(module_path or "")
        if path.parent == HERE:
            transformer = Transformer(path.name)
            for node in ast.walk(mod):
                if isinstance(node, ast.Assert):
                    node.test = transformer.visit(node.test)
            ast.fix_missing_locations(mod)
        rewrite_asserts(mod, source, module_path, config)

    rewrite.rewrite_asserts = rewritten
    rewrite._read_pyc = lambda *args, **options: None  # of a run without
    sys.dont_write_bytecode = True

    equal = ApproxScalar.__eq__

    def approx_equal(self, actual):
        place = place_of(sys._getframe(1))
        if place is not None:
            try:
                gap, size = abs(actual - self.expected), abs(self.expected)
                note(place, "approx", gap, self.tolerance, self.tolerance / size if size > 0.0 else
                     self.tolerance)
            except (TypeError, ValueError):
                pass
        return equal(self, actual)

    ApproxScalar.__eq__ = approx_equal
    np.testing.assert_allclose = measured(np.testing.assert_allclose, 1e-7, 0.0)
    np.allclose = measured(np.allclose, 1e-5, 1e-8)
    np.isclose = measured(np.isclose, 1e-5, 1e-8)


def narrow():
    """Places, narrowest first, of comparisons near round-off that have less than the margin."""
    rows = [(margin, relative, value, place, kind) for (place, kind), (margin, relative, value)
            in found.items() if relative < ROUND_OFF and margin < MARGIN]
    return sorted(rows)


def write(path):
    """The list as a file."""
    rows = [f"{margin:10.3g} {relative:10.3g} {value:10.3g}  {place}  {kind}"
            for margin, relative, value, place, kind in narrow()]
    Path(path).write_text("\n".join([
        f"# comparisons near round-off whose bound is less than {MARGIN:g} times what is there, of "
        f"{len(found)}", "#   margin      bound      value  place", *rows, ""]), encoding="utf-8")


def pytest_terminal_summary(terminalreporter, config):
    path = config.getoption("margins")
    if path:
        write(path)
        terminalreporter.write_line(f"{len(narrow())} of {len(found)} comparisons are close to "
                                    f"round-off and to their bound: {path}")


def pytest_sessionfinish(session):
    if session.config.getoption("margins") and narrow():
        session.exitstatus = session.exitstatus or pytest.ExitCode.TESTS_FAILED
