"""What editors and type checkers find: exported classes, named options, types that are returned."""

import importlib
import inspect
import pkgutil
import re

import pytest
from test_reference import MACHINERY

import skfem_ancf

OWNERS = ["Scene", "Frame", "State", "History", "StepHistory", "Path", "Modes", "Buckling", "Beam",
          "MeshBeam", "Resultants"]
#: Options by any name: changes of what is copied, arguments of a joint that is named, of
#: matplotlib's lines, what scikit-fem's own meshes take, and what is refused with any arguments.
OPEN = {"replace", "joint", "plot_curve", "draw", "save", "load", "mirrored", "morphed", "smoothed"}


def methods(owner):
    """Public methods of a class that are this package's: name and signature."""
    for name, value in inspect.getmembers(getattr(skfem_ancf, owner)):
        if not name.startswith("_") and inspect.isroutine(value) and callable(value) and (
                value.__module__.startswith("skfem_ancf")):
            yield name, inspect.signature(value)


@pytest.mark.parametrize("owner", OWNERS)
def test_options_are_named_and_types_are_said(owner):
    for name, signature in methods(owner):
        assert signature.return_annotation is not signature.empty, name
        kinds = {p.kind for p in signature.parameters.values()}
        assert inspect.Parameter.VAR_KEYWORD not in kinds or name in OPEN, name


def test_what_methods_return_is_exported():
    classes = {name: thing for module in pkgutil.walk_packages(skfem_ancf.__path__, "skfem_ancf.")
               for name, thing in vars(importlib.import_module(module.name)).items()
               if inspect.isclass(thing) and thing.__module__ == module.name}
    missing = set()
    for owner in OWNERS:
        for name, signature in methods(owner):
            for word in re.findall(r"\w+", str(signature.return_annotation)):
                if word in classes and not word.startswith("_") and not (
                        word in {*MACHINERY, "Values", "Series"} or hasattr(skfem_ancf, word)):
                    missing.add(f"{word} of {owner}.{name}")
    assert not missing


def test_items_of_scenes_are_exported():
    for name, method in inspect.getmembers(skfem_ancf.Scene, inspect.isfunction):
        item = getattr(method, "item", None)
        assert item is None or getattr(skfem_ancf, item.__name__) is item, name
