"""Where texts run: in plain NumPy, or compiled where that pays."""

from __future__ import annotations

import logging
import time
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import wraps
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import compiled
from .compiled.words import Kept
from .equations import Tables
from .kept import cached_property, twin_of
from .kernels.law import with_text
from .kernels.section import SectionPack
from .materials.followed import NotFollowed
from .progress import progress_bar
from .switch import compiled_off, wanted

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

logger = logging.getLogger(__name__)

#: Seconds that compiling takes, about: what texts have in common, what kernels have, the kernels,
#: each if a scene has it, and each text; and loading what lies on disk.
COMPILING = {"common": 3.0, "kernels": 0.8, "SectionPack": 2.3, "CablePack": 1.2,
             "elements": 1.4, "contacts": 2.9, "equilibrium": 2.4, "steps": 5.9, "evaluate": 0.3}
#: The same for texts that are compiled where they are used, not beforehand.
WHERE_USED = {"collocate": 5.6}
LOADING = 0.7
SECONDS = {**COMPILING, **WHERE_USED}


def compiling(name: str, parts: Sequence[str]) -> float:
    """Seconds that compiling a text takes, about, with the kernels that are not there yet.

    Parameters
    ----------
    name, parts
        Keys of :data:`COMPILING`: the text, and the kernels of a scene.
    """
    return SECONDS[name] + sum(COMPILING[part] for part in parts
                                 if part not in compiled.KNOWN and not compiled.on_disk(part))


class Choice(NamedTuple):
    """Which way a text runs, "plain", "loaded" or "compiled", and why."""

    way: str
    reason: str


class _Clock:
    """Seconds that plain texts have taken in this process."""

    def __init__(self):
        self.spent = 0.0

    def timed(self, text):
        """The text, its time added up."""
        @wraps(text)

        def run(*args):
            begun = time.perf_counter()
            try:
                with np.errstate(all="ignore"):  # what overflows is seen in the residual
                    return text(*args)
            finally:
                self.spent += time.perf_counter() - begun

        return run


_IS_LOADED = Choice("loaded", "compiled code is loaded")
#: Of the process: what it has spent on one scene says that others will follow.
CLOCK = _Clock()


class Machine:
    """Runs the texts of a system.

    A scene begins in NumPy. What is compiled already in this process is used at once; what lies on
    disk, once NumPy has taken as long as loading it would take; what has to be compiled, once it
    has taken as long as that: so no run takes more than twice the time of the better choice.

    Parameters
    ----------
    system
        A :class:`~skfem_ancf.system.System`.

    Attributes
    ----------
    tables : Tables
        The equations.
    """

    def __init__(self, system: Any) -> None:
        self.tables = Tables(system)
        self._plain: str | None = None
        self._followed = False
        self._rooms: dict[str, Any] = {}
        self._kept = Kept()
        if not all(beam.compiled for beam in system.beams):
            self._plain = "compiled=False"
        elif system.forces.contacts.own:
            self._plain = "a distance of your own: SignedDistance"

    @property
    def _off(self):
        if self._plain is not None:
            return self._plain
        return compiled.PROBLEMS[0] if compiled.PROBLEMS else compiled_off()

    @cached_property
    def linearised(self) -> Machine | None:
        """What runs the texts for :attr:`Tables.linearised`; None if the laws are linear."""
        tables = self.tables.linearised
        if tables is None:
            return None
        return self.with_tables(tables)

    def with_tables(self, tables: Tables) -> Machine:
        """The same for other tables of the system, with its work arrays.

        Parameters
        ----------
        tables
            In place of its own.
        """
        machine = twin_of(self)
        machine.tables, machine._kept = tables, self._kept.of(self._rooms.values())
        vars(machine).pop("linearised", None)
        return machine

    @property
    def shareable(self) -> bool:
        """True if nothing of the choice between the ways depends on the laws."""
        return self._plain is None

    def choose(self, name: str) -> Choice:
        """The way of a text for the next call.

        Parameters
        ----------
        name
            A key of :data:`COMPILING`.
        """
        choice = self._chosen(name)
        if choice.way != "plain" and not self._followed:
            self._follow()
        return choice if self._plain is None else Choice("plain", self._plain)

    def _follow(self):
        """Make texts of laws in Python."""
        self._followed = True
        try:
            for pack in self.tables.plain.body.packs:
                if isinstance(pack, SectionPack):
                    with_text(pack.law)
        except NotFollowed as error:
            self._plain = (f"a law of your own cannot be compiled: {error}; see "
                           "skfem_ancf.materials.TextMaterial")

    def _chosen(self, name):
        loaded = name in compiled.LOADED and not compiled.PROBLEMS
        if loaded and self._plain is None and wanted() != "0":
            return _IS_LOADED
        if self._off is not None:
            return Choice("plain", self._off)
        parts = self.tables.parts
        seconds = compiling(name, parts)
        if wanted() == "1":
            return Choice("compiled", "SKFEM_ANCF_COMPILED=1")
        if compiled.on_disk(name, *parts):
            if CLOCK.spent >= LOADING:
                return Choice("compiled", "compiled code lies on disk")
            return Choice("plain", f"NumPy has taken {CLOCK.spent:.2g} s so far, loading the "
                          f"compiled code from disk takes about {LOADING:g} s")
        if CLOCK.spent >= seconds:
            return Choice("compiled", f"NumPy has taken {CLOCK.spent:.3g} s, compiling takes "
                          f"about {seconds:g} s")
        return Choice("plain", f"NumPy has taken {CLOCK.spent:.2g} s so far, compiling would take "
                      f"about {seconds:g} s; python -m skfem_ancf.compiled does it beforehand")

    def room(self, make: Callable, *sizes: int) -> Any:
        """Work arrays of a text, made once.

        Parameters
        ----------
        make
            A function of :class:`~skfem_ancf.equations.Equations` and the sizes.
        *sizes
            Numbers that the arrays depend on.
        """
        if make.__name__ not in self._rooms:
            self._rooms[make.__name__] = make(self.tables.plain, *sizes)
        return self._rooms[make.__name__]

    def of(self, text: Callable) -> tuple[Callable, Any]:
        """The function of a text, plain or compiled, and the equations that it takes."""
        name = text.__name__
        if _too_early(name) or self.choose(name).way == "plain":
            return CLOCK.timed(text), self.tables.plain
        try:
            equations = vars(self.tables).get("flat") or self._flattened()
        except compiled.TextProblem as error:
            self._plain = str(error)
            logger.info(self._plain)
            return CLOCK.timed(text), self.tables.plain
        except Exception as error:  # of a Numba that is not as those that are known
            return _given_up(text, error), self.tables.plain

        def run(*args):
            try:
                function = _load(text, args)
            except Exception as error:
                return _given_up(text, error)(self.tables.plain, *args[1:])
            return function(*map(self._kept, args))

        return run, equations

    def _flattened(self):
        """The equations that compiled texts take, made for the first time."""
        new = [part for part in self.tables.parts if part not in compiled.KNOWN]
        with _announced(new) if new else _SILENT:
            return self.tables.flat


def _too_early(name):
    """True if NumPy has taken less time than anything else: what lies on disk is not looked for."""
    return (name not in compiled.LOADED and CLOCK.spent < min(LOADING, SECONDS[name])
            and wanted() != "1")


def _given_up(text, error):
    """The plain text, in place of one that cannot be compiled; nor is any other from now on."""
    compiled.PROBLEMS.append(
        f"Numba cannot be used: {error}" if isinstance(error, ImportError) else
        f"{text.__name__} cannot be compiled: {error!r}")
    logger.warning("%s; it runs in NumPy", compiled.PROBLEMS[-1])
    return CLOCK.timed(text)


def _load(text, args):
    """The compiled function; says so where that takes long."""
    name = text.__name__
    if name not in compiled.LOADED:
        with _announced([name]):
            compiled.load(text, args)
    return compiled.LOADED[name]


#: Nothing is said.
_SILENT: AbstractContextManager[None] = nullcontext()


def _announced(names: Sequence[str]) -> AbstractContextManager[None]:
    """Say what is compiled, if it is not there."""
    names = [name for name in names if not compiled.on_disk(name)]
    return _saying(names) if names else _SILENT


@contextmanager
def _saying(names: Sequence[str]) -> Iterator[None]:
    said = f"compiling once, about {sum(SECONDS[name] for name in names):g} s, kept on disk"
    logger.info("%s: %s", ", ".join(names), said)
    with progress_bar(None, 1.0, said) as bar:
        yield
        bar.update(1.0)
