"""Progress bars by tqdm, if installed."""

import sys
from contextlib import AbstractContextManager, nullcontext
from types import SimpleNamespace
from typing import Any

from .errors import MissingExtra, refuse

NO_BAR = nullcontext(SimpleNamespace(update=lambda amount: None))


def progress_bar(show: bool | None, total: float, desc: str) -> AbstractContextManager[Any]:
    """A bar with ``update(amount)``; ``show`` may be None for long work on a terminal."""
    refuse(not isinstance(show, (bool, type(None))), "progress must be True, False or None, got "
           "{!r}", show)
    if show is None and not (sys.stderr and sys.stderr.isatty()) or show is False:
        return NO_BAR
    try:
        from tqdm import tqdm
    except ImportError:
        if show:
            raise MissingExtra("tqdm", "progress") from None
        return NO_BAR
    return tqdm(total=total, desc=desc, delay=0.0 if show else 1.0,
                bar_format="{l_bar}{bar}| {n:.3g}/{total:.3g} [{elapsed}]")


def announced_bar(total: float, desc: str) -> AbstractContextManager[Any]:
    """A bar for work that is always announced on stderr; without tqdm or a terminal in lines."""
    if sys.stderr is None:  # a program without a console
        return NO_BAR
    print(desc, file=sys.stderr, flush=True)
    if sys.stderr.isatty():
        try:
            from tqdm import tqdm
        except ImportError:
            pass
        else:
            return tqdm(total=total, bar_format="{percentage:3.0f}%|{bar}| [{elapsed}]")
    done = 0.0

    def update(amount: float) -> None:
        nonlocal done
        done += amount
        print(f"{'#' * round(40 * done / total):-<40} {done / total:.0%}", file=sys.stderr,
              flush=True)

    return nullcontext(SimpleNamespace(update=update))
