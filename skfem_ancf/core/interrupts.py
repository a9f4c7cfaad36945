"""Signals such as Ctrl-C while compiled code runs.

If a handler raises between the instructions of Numba's callbacks into Python, these report another
error. Handlers therefore wait until a callback asks, or compiled code returns.
"""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import current_thread, main_thread
from typing import Any

#: Signals whose handlers often raise.
_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGALRM")
            if hasattr(signal, name)]
#: Handlers that wait, and their signals.
_handlers: dict[int, Any] = {}
_pending: list[int] = []


def _note(number, frame):
    _pending.append(number)


def raise_pending() -> None:
    """Call the handlers of signals that wait; that of Ctrl-C raises KeyboardInterrupt."""
    if _pending and current_thread() is main_thread():
        _call(_handlers)


def _call(handlers):
    waiting = set(_pending)
    _pending.clear()
    for number in waiting:
        handlers[number](number, None)


@contextmanager
def deferred() -> Iterator[None]:
    """Let signals wait for :func:`raise_pending`, at the latest until the end."""
    if current_thread() is not main_thread() or _handlers:
        yield
        return
    for number in _SIGNALS:
        handler = signal.getsignal(number)
        if callable(handler):
            _handlers[number] = handler
            signal.signal(number, _note)
    try:
        yield
    finally:
        waiting = dict(_handlers)
        for number, handler in waiting.items():
            signal.signal(number, handler)
        _handlers.clear()
        _call(waiting)
