"""Ctrl-C while compiled code runs: Numba's wrappers of callbacks into Python lose the exception."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import current_thread, main_thread

_pending: list[int] = []


def _note(number, frame):
    _pending.append(number)


def raise_pending() -> None:
    """Raise KeyboardInterrupt if Ctrl-C waits, which the main thread receives."""
    if _pending and current_thread() is main_thread():
        _pending.clear()
        raise KeyboardInterrupt


@contextmanager
def deferred() -> Iterator[None]:
    """Let Ctrl-C wait for :func:`raise_pending`, at the latest until the end.

    Handlers of users stay.
    """
    if (current_thread() is not main_thread()
            or signal.getsignal(signal.SIGINT) is not signal.default_int_handler):
        yield
        return
    signal.signal(signal.SIGINT, _note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        raise_pending()
