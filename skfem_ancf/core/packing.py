"""Pickles of scikit-fem's objects in attributes of the package's, without changing its classes."""

from __future__ import annotations

import sys
from importlib import import_module
from operator import attrgetter
from typing import Any

import numpy as np
from skfem.assembly.form.form import Form
from skfem.generic_utils import OrientedBoundary


class _Packed:
    """A value that pickle restores by a function of arguments."""

    def __init__(self, value: Any, *recipe: Any) -> None:
        self.value, self._recipe = value, recipe

    def __reduce__(self) -> Any:
        return self._recipe


def _form_of(module, name):
    return attrgetter(name)(import_module(module))


def packed(value: Any) -> Any:
    """A value for pickle: forms by the name that they share with the decorated function.

    Pickle takes an OrientedBoundary for a view of an array and loses the orientation.
    """
    if isinstance(value, Form):
        module, name = (getattr(value.form, x, None) for x in ("__module__", "__qualname__"))
        if getattr(sys.modules.get(str(module)), str(name), None) is value:
            return _Packed(value, _form_of, (module, name))
    elif isinstance(value, OrientedBoundary):
        return _Packed(value, OrientedBoundary, (np.asarray(value), value.ori))
    elif type(value) in (tuple, list):
        return type(value)(map(packed, value))
    elif type(value) is dict:
        return {name: packed(one) for name, one in value.items()}
    return value


def unpacked(value: Any) -> Any:
    """The value of :func:`packed`, in a copy without pickle."""
    if type(value) in (tuple, list):
        return type(value)(map(unpacked, value))
    if type(value) is dict:
        return {name: unpacked(one) for name, one in value.items()}
    return value.value if isinstance(value, _Packed) else value
