"""Packs out of a :class:`~skfem_ancf.body.FlatBody`: views of its arrays."""

from typing import get_type_hints

import numpy as np

from ..body import CablePack, SectionPack
from .twin import jit


@jit
def f1(body, k, j):
    a, n = body.where[k, j, 0], body.where[k, j, 1]
    return body.floats[a:a + n]


@jit
def f2(body, k, j):
    a, n, m = body.where[k, j, 0], body.where[k, j, 1], body.where[k, j, 2]
    return body.floats[a:a + n * m].reshape(n, m)


@jit
def f3(body, k, j):
    a, n, m, l = (body.where[k, j, 0], body.where[k, j, 1], body.where[k, j, 2],
                  body.where[k, j, 3])
    return body.floats[a:a + n * m * l].reshape(n, m, l)


@jit
def i1(body, k, j):
    a, n = body.where[k, j, 0], body.where[k, j, 1]
    return body.ints[a:a + n]


@jit
def i2(body, k, j):
    a, n, m = body.where[k, j, 0], body.where[k, j, 1], body.where[k, j, 2]
    return body.ints[a:a + n * m].reshape(n, m)


@jit
def number(body, k, j):
    return body.where[k, j, 0]


_VIEWS = {"f1": f1, "f2": f2, "f3": f3, "i1": i1, "i2": i2, "int": number}


def _reader(kind):
    """A function of a body and a number that makes a pack: one view for each field, in order."""
    names = dict(_VIEWS)

    def expression(kind, first):
        names[kind.__name__], parts = kind, []
        for hint in get_type_hints(kind, include_extras=True).values():
            if hasattr(hint, "_fields"):
                part, first = expression(hint, first)
            else:
                view = "int" if hint is int else hint.__metadata__[0]
                name = "number" if view == "int" else view
                part, first = f"{name}(body, k, int64({first}))", first + 1
            parts.append(part)
        return f"{kind.__name__}({', '.join(parts)})", first

    names.update(number=number, int64=np.int64)  # a literal would be compiled for each
    exec(f"def reader(body, k):\n    return {expression(kind, 0)[0]}", names)  # noqa: S102
    return jit(names["reader"])


section_pack, cable_pack = _reader(SectionPack), _reader(CablePack)
