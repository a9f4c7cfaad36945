"""Callbacks from kernels to Python objects: user-defined items and linear solvers. An object is
known by a handle, a positive integer that compiled code can store."""

import logging
import signal
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ctypes import c_double, c_int64
from itertools import count
from threading import current_thread, get_ident, main_thread
from typing import Any

import numpy as np

from .code_cache import compiled_setting
from .errors import NO_FACTORS
from .source import PYTHON, apart, primitive

logger = logging.getLogger(__name__)

# signals such as Ctrl-C while compiled code runs

#: Signals whose handlers often raise.
_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGALRM")
            if hasattr(signal, name)]
#: Handlers that wait, and their signals.
_handlers: dict[int, Any] = {}
_pending: list[int] = []


def _call(handlers):
    waiting = set(_pending)
    _pending.clear()
    for number in waiting:
        handlers[number](number, None)


@contextmanager
def deferred() -> Iterator[None]:
    """Let signals wait for the next callback, :func:`owner`, at the latest until the end."""
    if current_thread() is not main_thread() or _handlers:
        yield
        return
    for number in _SIGNALS:
        handler = signal.getsignal(number)
        if callable(handler):
            _handlers[number] = handler
            signal.signal(number, lambda number, frame: _pending.append(number))
    try:
        yield
    finally:
        waiting = dict(_handlers)
        for number, handler in waiting.items():
            signal.signal(number, handler)
        _handlers.clear()
        _call(waiting)


_numbers = count(1)
_objects: weakref.WeakValueDictionary[int, Any] = weakref.WeakValueDictionary()


def handle_of(thing: Any) -> int:
    """A handle for an object, valid as long as it lives."""
    number = next(_numbers)
    _objects[number] = thing
    return number


def owner(handle: int) -> Any:
    """The object of a handle; raises the exception of an earlier callback of this kernel again."""
    if _pending and current_thread() is main_thread():
        _call(_handlers)  # that of Ctrl-C raises KeyboardInterrupt
    if _raised and get_ident() in _raised:
        raise _raised[get_ident()]
    return _objects[handle]


#: What :func:`call_custom` asks for.
FORCE, MEAN_FORCE, STIFFNESS, JOINTS, ELEMENTS, POSES, SEARCHES = range(7)


@primitive("skfem_ancf.core.loops")
def call_custom(callback, handle, what, t, x, a, b, out):
    """Call the object of user-defined items, with a selector, a time, a factor and three arrays."""
    # The time of forces is nan in statics.
    called = owner(handle)
    if callback == FORCE:
        called.add_custom_force(t, x, a, out)
    elif callback == MEAN_FORCE:
        called.add_custom_mean_force(t, a, b, out)
    elif callback == STIFFNESS:
        called.subtract_custom_stiffness(t, x, a, out)
    elif callback == JOINTS:
        called.add_custom_joints(what, t, a, b, out)
    elif callback == ELEMENTS:
        called.forces.add_custom(what, t, x, a, b, out)
    elif callback == POSES:
        called.put(t, x, out)
    else:
        called.search(a.view(complex))


@primitive("skfem_ancf.core.loops")
def custom_distance(handle, obstacle, t, x, out):
    """Distance, gradient and Hessian of a user-defined shape."""
    owner(handle).ask(obstacle, t, x, out)


@primitive("skfem_ancf.core.loops")
def call_solver(handle, t, u, multipliers, R, phi, du, dm):
    """Solve the linear system with the multipliers; False on failure."""
    solver = owner(handle)
    try:
        solver.solve_into(t, u, multipliers, R, phi, du, dm)
    except NO_FACTORS as error:
        logger.debug("no factors: %s", error)
        return False
    return True


#: Exceptions of callbacks by thread, which compiled code cannot raise.
_raised: dict[int, BaseException] = {}


def kept(function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that keeps its first exception for :func:`raise_kept` and returns zero."""
    # The kernel goes on until it returns: what it asks for after an exception has to fail again, so
    # that it accepts no step or solution.
    def run(*args):
        try:
            return function(*args)
        except BaseException as error:
            _raised.setdefault(get_ident(), error)
            return 0

    return run


def raise_kept() -> None:
    """Raise the exception of a callback in this thread, if any."""
    if _raised:
        error = _raised.pop(get_ident(), None)
        if error is not None:
            raise error


#: How Python calls functions of loaded parts of compiled code.
FROM_PYTHON: dict[Any, Callable[..., Any]] = {}


def call_loaded(function: Callable[..., Any], allowed: bool, *args: Any) -> Any:
    """Call a function marked by :func:`apart`: in compiled code if that is allowed and loaded, or
    in NumPy."""
    allowed = allowed and compiled_setting() != "0"
    return (FROM_PYTHON.get(function, function) if allowed else function)(*args)


def _views(places, n):
    """The n arrays whose addresses and sizes are at an address."""
    words = iter((c_int64 * (2 * n)).from_address(places))
    return [np.frombuffer((c_double * size).from_address(address)) if size else np.zeros(0)
            for address, size in zip(words, words)]


@apart(PYTHON, int, int, int, float, float, int)
def ask(callback, handle, what, t, x, places):
    """Answer a callback of compiled code with three arrays."""
    a, b, answer = _views(places, 3)
    try:
        call_custom(callback, handle, what, t, x, a, b, answer)
    except BaseException:
        answer[:] = np.nan  # ends the iteration
        raise


@apart(PYTHON, int, float, int, returns=int)
def solved(handle, t, places):
    """:func:`call_solver` for compiled code."""
    return call_solver(handle, t, *_views(places, 6))
