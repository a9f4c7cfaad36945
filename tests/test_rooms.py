"""Functions of a size to be read at once."""

import ast
from pathlib import Path

import pytest

import skfem_ancf

PACKAGE = Path(skfem_ancf.__file__).parent
#: Lines of a function without docstrings, and names of its arguments.
MOST_LINES, MOST_ARGUMENTS = 80, 10
#: Functions that are larger, and why.
LARGER = {
    "beam.py::Beam.__init__": "options of a user, each with a default, by keyword",
    "evaluation.py::evaluate": "one function for all that is asked, so that it is compiled once",
    "compiled/blocks.py::block": "a function of C: arrays are addresses and sizes",
    "compiled/contacts.py::contacts": "a function of C: arrays are addresses and sizes",
    "compiled/elements.py::elements": "a function of C: arrays are addresses and sizes",
    "dynamics/integrate.py::integrate": "options of a user, each with a default, by keyword",
    "results.py::State.__init__": "a record: what a solution is, and where it has it from",
    "statics/continuation.py::continuation": "options of a user, each with a default, by keyword",
    "visuals/animation.py::animate": "options of a user, each with a default, by keyword",
    "visuals/matplotlib.py::plot_state": "options of a user, each with a default, by keyword",
    "visuals/pyvista.py::view": "options of a user, each with a default, by keyword",
}


def functions():
    """File, qualified name and syntax of every function of the package."""
    def walk(name, node):
        for child in ast.iter_child_nodes(node):
            inner = f"{name}.{child.name}" if hasattr(child, "name") else name
            if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef)):
                yield inner.lstrip("."), child
            yield from walk(inner, child)

    for path in sorted(PACKAGE.rglob("*.py")):
        file = path.relative_to(PACKAGE).as_posix()
        for name, node in walk("", ast.parse(path.read_text(encoding="utf-8"))):
            yield f"{file}::{name}", node


def lines(function):
    """Lines from the first to the last, without docstrings."""
    docs = sum(node.body[0].end_lineno - node.body[0].lineno + 1 for node in ast.walk(function)
               if isinstance(node, ast.FunctionDef) and ast.get_docstring(node) is not None)
    return function.end_lineno - function.lineno + 1 - docs


def arguments(function):
    a = function.args
    names = [x.arg for x in (*a.posonlyargs, *a.args, *a.kwonlyargs, a.vararg, a.kwarg) if x]
    return len(names) - (names[:1] in (["self"], ["cls"]))


def too_large(function):
    return lines(function) > MOST_LINES or arguments(function) > MOST_ARGUMENTS


def test_functions_are_of_a_size_to_be_read():
    found = {name: (lines(node), arguments(node)) for name, node in functions() if too_large(node)}
    assert {name: size for name, size in found.items() if name not in LARGER} == {}


def test_reasons_are_given_for_functions_that_are_larger():
    large = {name for name, node in functions() if too_large(node)}
    assert set(LARGER) <= large, "a reason is no longer needed"
    assert all(len(reason.split()) > 3 for reason in LARGER.values())


@pytest.mark.parametrize("source, size", [
    ("def f(a, b):\n    return a + b\n", (2, 2)),
    ('def f(self, *a, k=1, **o):\n    """Doc.\n\n    More.\n    """\n    return a\n', (2, 3)),
    ('def f():\n    def g():\n        """Doc."""\n        return 1\n    return g\n', (4, 0)),
])
def test_sizes_are_counted_as_said(source, size):
    function = ast.parse(source).body[0]
    assert (lines(function), arguments(function)) == size
