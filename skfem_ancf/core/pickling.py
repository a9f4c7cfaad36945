"""What stands in the way of pickle: functions that have no name in a module."""

from __future__ import annotations

import pickle
import sys
from typing import TYPE_CHECKING, Any

from skfem.assembly import LinearForm

from .errors import PickleError, shown

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator


def functions_of(things: Iterable[Any]) -> Iterator[tuple[str, Any]]:
    """Pairs of a description and a function, for the functions that objects hold."""
    for thing in things:
        spread = getattr(thing, "_spread", None)  # of a load, which may hold a function too
        more = {} if spread is None else vars(spread)
        if hasattr(thing, "shape"):  # of an obstacle
            more = vars(thing.shape)
        for name, value in (*vars(thing).items(), *more.items()):
            name = name.lstrip("_")
            value = getattr(value, "function", value)  # an Amplitude, for one
            for one in value if isinstance(value, tuple) else (value,):
                if callable(one) and not isinstance(one, type):
                    yield f"the function {name!r} of {shown(thing)}", one


def require_picklable(items: Iterable[tuple[str, Any]]) -> None:
    """Raise PickleError for the first of pairs (description, function) that pickle cannot take.

    Where cloudpickle or dill ask, which take any function, nothing is raised.
    """
    items = list(items)
    if not items or _asked_by_value():
        return
    for what, function in items:
        try:
            pickle.dumps(picklable_form(function))
        except Exception as error:  # what a function holds may raise anything
            raise PickleError(
                f"{what}, {shown(function)}, cannot be pickled: {error}. Define it by def at the "
                "top of a module, or use cloudpickle, which takes any function") from error


def _asked_by_value():
    frame = sys._getframe(1)
    while frame is not None:
        if {"cloudpickle", "dill"} & set(frame.f_globals.get("__name__", "").split(".")):
            return True
        frame = frame.f_back
    return False


class NamedForm:
    """A LinearForm made by a decorator: pickle takes it by its name in its module."""

    def __init__(self, form: LinearForm) -> None:
        self.form = form

    def __reduce__(self):
        function = self.form.form
        module, name = function.__module__, function.__qualname__
        if getattr(sys.modules.get(module), name, None) is self.form:
            return _named, (module, name)
        return _made, (type(self.form), dict(vars(self.form)))


def _named(module, name):
    __import__(module)
    return NamedForm(getattr(sys.modules[module], name))


def _made(cls, state):
    form = object.__new__(cls)
    vars(form).update(state)
    return NamedForm(form)


def picklable_form(value: Any) -> Any:
    """What pickle takes in place of a value: a LinearForm by its name."""
    return NamedForm(value) if isinstance(value, LinearForm) else value
