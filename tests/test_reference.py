"""The reference names everything public, once, and nothing that is not there."""

import importlib
import inspect
import pkgutil
import re
from pathlib import Path

import skfem_ancf

PAGE = Path(__file__).resolve().parent.parent / "docs" / "reference.md"
#: Folders whose names are public; the others are machinery.
FOLDERS = ["actions.forces", "actions.joints", "actions.obstacles", "beam", "dynamics", "elements",
           "formulations", "io", "materials", "mesh", "results", "scene", "sections", "solvers",
           "sweeps"]
#: Returned by public methods, and machinery all the same.
MACHINERY = {"BandMatrix", "Finder", "Inertia", "Masses", "Points", "Recovery", "System",
             "Distribution", "Interpolation", "BeamLayer", "LayerPoints",
             "Law", "Amplitude", "BodyFields", "Link", "KernelElement",
             "StabilisedMode", "Sampling", "Rule", "Point", "Vector"}


def entries():
    """Names of the page, without the package."""
    blocks = re.findall(r"```\{eval-rst\}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    return [line.strip() for block in blocks for line in block.splitlines()
            if re.fullmatch(r"   skfem_ancf\.[\w.]+", line)]


def thing(name):
    """What a name of a module means."""
    parent, _, last = name.rpartition(".")
    return getattr(importlib.import_module(parent), last)


def test_everything_public_is_in_the_reference():
    listed = entries()
    assert len(listed) == len(set(listed)) > 100
    things = [thing(name) for name in listed]
    for folder in ("", *FOLDERS):
        module = importlib.import_module(f"skfem_ancf.{folder}".rstrip("."))
        missing = [name for name in module.__all__
                   if not any(getattr(module, name) is other for other in things)]
        assert not missing, f"{module.__name__}: {missing}"


def test_folders_with_names_are_public_or_machinery():
    named = {m.name.split(".")[1] for m in pkgutil.iter_modules(
        skfem_ancf.__path__, "skfem_ancf.") if m.name != "skfem_ancf.__main__"
        and hasattr(importlib.import_module(m.name), "__all__")}
    assert named == {name for name in FOLDERS if "." not in name} | {"forms"}


def test_what_public_methods_return_is_in_the_reference():
    """Classes of the package in the annotations of what is returned."""
    classes = {}
    for module in pkgutil.walk_packages(skfem_ancf.__path__, "skfem_ancf."):
        if ".compiled" not in module.name:
            for name, found in vars(importlib.import_module(module.name)).items():
                if inspect.isclass(found) and found.__module__ == module.name:
                    classes.setdefault(name, found)
    listed = [thing(name) for name in entries()]
    missing = set()
    for owner in filter(inspect.isclass, listed):
        for name, value in vars(owner).items():
            value = getattr(value, "fget", getattr(value, "func", value))
            value = inspect.unwrap(getattr(value, "__func__", value))
            if name.startswith("_") or not inspect.isfunction(value):
                continue
            returned = re.findall(r"\w+", str(value.__annotations__.get("return", "")))
            missing |= {f"{word}, of {value.__qualname__}" for word in returned
                        if word in classes and not word.startswith("_") and word not in MACHINERY
                        and not any(classes[word] is other for other in listed)}
    assert not missing


def test_each_name_of_a_scene_is_on_one_page():
    """Its methods are on pages by task, not on one that is longer than thirty screens."""
    pages = [re.findall(r"auto(?:method|property):: skfem_ancf\.Scene\.(\w+)",
                        page.read_text(encoding="utf-8"))
             for page in sorted(PAGE.parent.glob("scene_*.md"))]
    names = sorted(name for page in pages for name in page)
    assert names == sorted(name for name in dir(skfem_ancf.Scene) if not name.startswith("_"))
    assert max(map(len, pages)) < 20
