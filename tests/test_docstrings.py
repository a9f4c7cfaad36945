"""What the reference names describes its arguments, in words and with shapes; all have types."""

import importlib
import inspect
import pkgutil
import re
from dataclasses import is_dataclass
from functools import cached_property
from importlib.util import find_spec
from typing import get_origin

import pytest
import test_reference as reference

import skfem_ancf
from skfem_ancf.core.source import MARKED

#: Not looked at: loops that are compiled in place of functions of their names; and where arrays of
#: equations are packed for them. Without Numba, what compiles them cannot be imported.
OTHERS = ("core.loops", "equations.loops", "beam.kernels.loops",
          *(() if find_spec("numba") else ("core.jit",)))

#: Annotations of arrays, whose shapes are to be said.
ARRAYS = ("Array", "ArrayLike")


def looked_at(name):
    """Whether a module is not among the others."""
    short = name.partition(".")[2]
    return not any(f"{short}.".startswith(f"{other}.") for other in OTHERS)


def modules():
    names = [m.name for m in pkgutil.walk_packages(skfem_ancf.__path__, "skfem_ancf.")]
    return filter(looked_at, ["skfem_ancf", *names])


def functions(module):
    """Public functions and methods of a module: name, function, class it belongs to or None.

    Not the texts of :mod:`skfem_ancf.core.source`: their arguments are named tuples and work
    arrays, which the attributes of the tuples and the head of the module describe, and Numba types
    them.
    """
    for name, thing in vars(importlib.import_module(module)).items():
        if name.startswith("_") or getattr(thing, "__module__", None) != module:
            continue
        if not inspect.isclass(thing):
            if callable(thing) and get_origin(thing) is None and thing not in MARKED:
                yield name, inspect.unwrap(thing), None
            continue
        if getattr(thing, "_is_protocol", False):  # the classes that have it describe it
            continue
        for key, value in vars(thing).items():
            private = key.startswith("_") and key != "__init__"
            if private or (key == "__init__" and getattr(thing, "_is_protocol", False)):
                continue
            if isinstance(value, (staticmethod, classmethod)):
                value = value.__func__
            elif isinstance(value, property):
                value = value.fget
            elif isinstance(value, cached_property):
                value = value.func
            # other names of a private function are no methods of their own
            if not inspect.isfunction(value) or value in MARKED:
                continue
            if value.__name__.startswith("_") == (key == "__init__"):
                yield f"{name}.{key}", inspect.unwrap(value), thing


def section(text, *names):
    """The lines of sections of a docstring."""
    found = re.findall(r"^(\w[\w ]*)\n-{3,}\n((?:.*\n?)*?)(?=^\w[\w ]*\n-{3,}\n|\Z)", text or "",
                       re.MULTILINE)
    return "\n".join(body for name, body in found if name in names)


def described(text):
    """From the name of an argument to what sections with arguments say of it."""
    out, names = {}, []
    for line in section(text, "Parameters", "Other Parameters", "Attributes").splitlines():
        if line and not line.startswith(" "):
            names = [n.strip().lstrip("*") for n in line.split(" : ")[0].split(",")]
            out.update(dict.fromkeys(names, ""))
        else:
            for name in names:
                out[name] += line.strip() + " "
    return out


def documents(function, owner):
    """Docstrings that may describe the arguments: its own, those it overrides, its class's, and
    that of the item which a method of a scene adds.

    A class says under Other Parameters what many of its methods take.
    """
    texts = [function.__doc__]
    for base in owner.__mro__ if owner else ():
        method = vars(base).get(function.__name__)
        texts += [getattr(thing, "__doc__", None)
                  for thing in (method, getattr(method, "item", None), base)]
    return [inspect.cleandoc(text) for text in texts if text]


def arguments(function, owner):
    """Its parameters, without the object or class that it belongs to, and private ones.

    Fields that a dataclass has from a class of scikit-fem are described there.
    """
    parameters = list(inspect.signature(function).parameters.values())
    if owner and parameters and parameters[0].name in ("self", "cls"):
        parameters = parameters[1:]
    others = {name for base in owner.__mro__[1:] if is_dataclass(base)
              and not base.__module__.startswith("skfem_ancf")
              for name in inspect.signature(base).parameters} if owner else set()
    return [p for p in parameters if not p.name.startswith("_") and p.name not in others]


#: What docs/reference.md names.
LISTED = [*map(reference.thing, reference.entries()), *(getattr(skfem_ancf.forms, name)
                                    for name in skfem_ancf.forms.__all__)]


def public(function, owner):
    """Whether the reference names a function, or the class it belongs to."""
    return any((owner or function) is other for other in LISTED)


CASES = [pytest.param(function, owner, id=f"{module.partition('.')[2]}.{name}")
         for module in modules() for name, function, owner in functions(module)]
PUBLIC = [case for case in CASES if public(*case.values)]


def test_the_walk_finds_the_public_api():
    names = {case.id for case in CASES}
    assert len(names) > 400 < 2 * len(PUBLIC)
    assert {"scene.model.Model.clamp", "beam.beam.Beam.__init__", "forms.tangent",
            "mesh.places.facets_of", "mesh.mapping.MappingBeam.F"} <= names


@pytest.mark.parametrize("function, owner", PUBLIC)
def test_arguments_are_described(function, owner):
    """Of functions with two or more; NumPy's docstring standard, under the class for __init__."""
    wanted = arguments(function, owner)
    if len(wanted) < 2:
        return
    found = {}
    for text in reversed(documents(function, owner)):
        found.update(described(text))
    missing = [p.name for p in wanted if not found.get(p.name)]
    assert not missing, f"not in the Parameters of {function.__qualname__}: {missing}"


@pytest.mark.parametrize("function, owner", PUBLIC)
def test_shapes_of_arrays_are_said(function, owner):
    if is_dataclass(owner) and function.__name__ == "__init__":
        return
    found = {}
    for text in reversed(documents(function, owner)):
        found.update(described(text))
    for p in arguments(function, owner):
        if str(p.annotation).split(" |")[0] in ARRAYS and found.get(p.name):
            text = f"{function.__doc__} {found[p.name]}"
            assert re.search(r"\([^()]*(,|\.\.\.)[^()]*\)", text), (
                f"{function.__qualname__} does not say the shape of {p.name!r}")


@pytest.mark.parametrize("function, owner", CASES)
def test_arguments_and_what_is_returned_have_types(function, owner):
    bare = [p.name for p in arguments(function, owner) if p.annotation is p.empty]
    if inspect.signature(function).return_annotation is inspect.Signature.empty:
        bare.append("return")
    assert not bare, f"no types in {function.__qualname__}: {bare}"


def test_help_of_a_scene_begins_with_a_table_of_its_methods():
    about, items = inspect.getdoc(skfem_ancf.Scene), inspect.getmembers(skfem_ancf.Scene)
    table = about[:about.index("Parameters\n")]
    assert [name for name, _ in items if not name.startswith("_") and f"``{name}``" not in table
            ] == []
    for name, method in items:  # methods that add an item leave its arguments to its class
        if hasattr(method, "item"):
            assert f"skfem_ancf.{method.item.__name__}`" in inspect.getdoc(method), name
