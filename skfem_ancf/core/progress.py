"""Progress bars by tqdm, if installed."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from importlib.util import find_spec
from typing import Any

from .errors import InputError, MissingExtra, shown


class _NoBar:
    def update(self, amount: float) -> None:
        """Do nothing."""


NO_BAR = nullcontext(_NoBar())


def progress_bar(show: bool | None, total: float, desc: str) -> AbstractContextManager[Any]:
    """A bar with ``update(amount)``; ``show`` may be None for long work on a terminal."""
    if show is not None and not isinstance(show, bool):
        raise InputError(f"progress must be True, False or None, got {shown(show)}")
    if show is False or (show is None and not sys.stderr.isatty()):
        return NO_BAR
    return _bar(show, total, desc)


@contextmanager
def _bar(show: bool | None, total: float, desc: str) -> Iterator[Any]:
    try:
        from tqdm import tqdm
    except ImportError:
        if show:
            raise MissingExtra("tqdm", "progress") from None
        yield _NoBar()
        return
    with tqdm(total=total, desc=desc, delay=0.0 if show else 1.0,
              bar_format="{l_bar}{bar}| {n:.3g}/{total:.3g} [{elapsed}]") as bar:
        yield bar


@contextmanager
def announced_bar(total: float, desc: str) -> Iterator[Any]:
    """A bar with ``update(amount)`` for work that is always announced on stderr.

    Without a terminal or tqdm it prints one line for each update.
    """
    if sys.stderr is None:  # a program without a console
        yield _NoBar()
        return
    print(desc, file=sys.stderr, flush=True)
    if sys.stderr.isatty() and find_spec("tqdm") is not None:
        from tqdm import tqdm

        with tqdm(total=total, bar_format="{percentage:3.0f}%|{bar}| [{elapsed}]") as bar:
            yield bar
    else:
        yield _Lines(total)


class _Lines:
    """A progress bar in lines."""

    def __init__(self, total: float) -> None:
        self.total, self.done = total, 0.0

    def update(self, amount: float) -> None:
        """Print a line."""
        self.done += amount
        part = self.done / self.total
        print(f"{'#' * round(40 * part):-<40} {part:.0%}", file=sys.stderr, flush=True)
