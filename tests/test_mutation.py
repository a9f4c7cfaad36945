"""The mutants of benchmarks/mutation: what they name is there."""

import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "benchmarks" / "mutation"


@pytest.fixture(scope="module")
def mutation():
    sys.path.insert(0, str(FOLDER))
    try:
        import mutation
        import named
        yield mutation, named
    finally:
        sys.path.remove(str(FOLDER))
        for name in ("mutation", "named"):
            sys.modules.pop(name, None)


def test_named_texts_occur_once(mutation):
    """A text that has changed would leave its mutant, and its test, without a use."""
    mutation, named = mutation
    assert len(named.NAMED) >= 40
    wrong = {title: count for title, file, text, *_ in named.NAMED
             if (count := (mutation.PACKAGE / file).read_text(encoding="utf-8").count(text)) != 1}
    assert not wrong


def test_files_without_a_choice(mutation):
    """Every module that computes; the mutants of a file are the same ones each time."""
    mutation, _ = mutation
    found = mutation.files([mutation.EVERY])
    assert {"beam/beam.py", "elements/ancf.py", "beam/kernels/section.py"} <= set(found)
    assert not [name for name in found
                if name.startswith(("visuals/", "io/", "core/loops", "core/jit"))]
    every = mutation.mutants("actions/point_force.py")
    assert len(every) > 10 and every == mutation.mutants("actions/point_force.py")


def test_a_name_that_is_no_file(mutation):
    mutation, _ = mutation
    with pytest.raises(SystemExit, match="no file of the package is called 'cable2'"):
        mutation.files(["cable2"])
