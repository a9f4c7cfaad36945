"""Packs out of a :class:`~skfem_ancf.body.FlatBody`: views of its arrays."""

from typing import get_type_hints

import numpy as np

from ..body import CablePack, SectionPack
from .twin import jit
from .views import view


@jit
def view1(data, where, k, j):
    return view(data, where[k, j, 0], where[k, j, 1])


@jit
def view2(data, where, k, j):
    return view(data, where[k, j, 0], (where[k, j, 1], where[k, j, 2]))


@jit
def view3(data, where, k, j):
    return view(data, where[k, j, 0], (where[k, j, 1], where[k, j, 2], where[k, j, 3]))


#: Where the letters of an annotation are found.
_DATA = {"f": "floats", "i": "ints"}


def _reader(kind):
    """A function of a body and a number that makes a pack: one view for each field, in order."""
    # a literal would be compiled for each
    names = {"view1": view1, "view2": view2, "view3": view3, "int64": np.int64}

    def expression(kind, first):
        names[kind.__name__], parts = kind, []
        for hint in get_type_hints(kind, include_extras=True).values():
            if hasattr(hint, "_fields"):
                part, first = expression(hint, first)
            elif hint is int:
                part, first = f"body.where[k, {first}, 0]", first + 1
            else:
                letter, axes = hint.__metadata__[0]
                part = f"view{axes}(body.{_DATA[letter]}, body.where, k, int64({first}))"
                first += 1
            parts.append(part)
        return f"{kind.__name__}({', '.join(parts)})", first

    exec(f"def reader(body, k):\n    return {expression(kind, 0)[0]}", names)  # noqa: S102
    return jit(names["reader"])


section_pack, cable_pack = _reader(SectionPack), _reader(CablePack)
