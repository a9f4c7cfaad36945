"""The choice between NumPy and compiled kernels."""

import logging
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from copy import copy
from functools import partial
from threading import RLock
from typing import Any, NamedTuple

from ..beam.kernels.tables import points_of
from ..core import announced_bar, cached_property, code_cache, deferred, raise_kept
from .tables import Tables

logger = logging.getLogger(__name__)

#: Compiled functions and parts of this process by name.
LOADED: dict[str, Any] = {}
#: Parts that are called by address and that most scenes use, and those of some functions.
PARTS = ("StrainTables", "cables", "own", "elements", "contacts", "moments", "joints", "band",
         "bands", "unsymmetric", "statics", "motion", "damping", "rows", "history")
NEEDED = {"equilibrium": ["band", "statics"], "steps": ["band", "motion"],
          "collocate": ["band", "bands", "gradients"]}
#: Why Numba cannot be used although it is installed.
PROBLEMS: list[str] = []
#: Approximate seconds for compiling: parts (if a scene uses them) and functions; and for loading.
COMPILING = {"StrainTables": 8.0, "cables": 1.0, "own": 1.0, "elements": 7.0, "contacts": 16.0,
             "moments": 1.5, "joints": 4.0, "unsymmetric": 2.5, "band": 3.0, "bands": 3.5,
             "statics": 3.0, "motion": 9.0, "damping": 1.0, "rows": 1.0, "history": 1.0,
             "equilibrium": 1.5, "tangent": 0.5, "force": 0.2, "linearised": 0.2, "steps": 1.5}
#: The same for functions that are compiled on first use only.
WHERE_USED = {"laws": 3.0, "histories": 4.0, "pairs": 8.0, "eigenstrains": 5.0,
              "gradients": 2.0, "motion_is_clear": 0.5, "collocate": 25.0, "mean_force": 1.0,
              "viscous_force": 1.0}
LOADING = 0.5
SECONDS = {**COMPILING, **WHERE_USED}
#: Seconds of compiling that need no reason once the parts are loaded.
SHORT = 2.0
#: Approximate seconds of an iteration in NumPy, and of each element and point of contact in it.
ITERATION, ELEMENT, POINT = 3e-4, 6e-6, 4e-6
#: Compiling costs so many times the work in NumPy after which it begins: a later process works on.
SERVES = 5
#: Approximate seconds that this process has worked in NumPy since it last compiled.
_worked = 0.0


class Choice(NamedTuple):
    """"plain", "loaded" or "compiled", and the reason."""

    mode: str
    reason: str


class Backend:
    """Runs the kernels of a system. The process counts its work in NumPy: iterations times elements
    and points of contact. As soon as what is done and the next call reach the price, compiled code
    is taken, so the choice costs at most twice the better one, however a user divides his work. The
    price of functions that are loaded is 0, of cached ones :data:`LOADING`, of others a part of the
    time for compiling."""

    def __init__(self, system: Any) -> None:
        self.tables = Tables(system)
        self._plain: str | None = None
        self._flat: Any = None  # Equations for compiled code, their words, and all to keep alive
        self._base: Backend | None = None  # the same with another history
        self._copied: dict[int, Backend] = {}
        if not all(beam.compiled for beam in system.beams):
            self._plain = "compiled=False"
        elif system.forces.contacts.custom:
            self._plain = "a user-defined distance (SignedDistance)"
        elif any(None in points_of(pack) for pack in self.tables.plain.body.packs):
            self._plain = ("a user-defined law in Python; a PointwiseMaterial, or a "
                           "HistoryMaterial with a method point, is compiled")

    @cached_property
    def linearised(self) -> "Backend | None":
        """The backend for :attr:`Tables.linearised`, or None."""
        if self._base is not None:
            base = self._base.linearised
            return None if base is None else base.after(base.tables.after(self.tables.system))
        tables = self.tables.linearised
        return None if tables is None else self.with_tables(tables)

    def with_tables(self, tables: Tables) -> "Backend":
        """A copy for other tables."""
        backend = copy(self)
        backend.tables, backend._flat, backend._base, backend._copied = tables, None, None, {}
        vars(backend).pop("linearised", None)
        return backend

    def copied(self, n: int) -> "Backend":
        """That of the tables for n displacements at once, see :meth:`Tables.copied`."""
        if n not in self._copied:
            self._copied[n] = self.with_tables(self.tables.copied(n))
        return self._copied[n]

    def after(self, tables: Tables) -> "Backend":
        """A copy for tables that differ in the history alone, see :meth:`Tables.after`."""
        backend = self.with_tables(tables)
        backend._base = self
        return backend

    def choose(self, name: str, iterations: float = 1.0) -> Choice:
        """The choice for the next call of a kernel, by its name and expected iterations."""
        missing = self._missing(name)
        if not (missing or self._plain or PROBLEMS) and code_cache.compiled_setting() != "0":
            return Choice("loaded", "compiled code is loaded")
        off = self._plain or (PROBLEMS[0] if PROBLEMS else code_cache.compiled_off())
        if off is not None:
            return Choice("plain", off)
        if code_cache.compiled_setting() == "1":
            return Choice("compiled", "SKFEM_ANCF_COMPILED=1")
        if missing == [name] and SECONDS[name] <= SHORT:
            return Choice("compiled", "its parts are loaded")
        work = _worked + self.seconds(iterations)
        so_far = f"in this process NumPy takes about {work:.2g} s so far"
        if work < LOADING:
            return Choice("plain", f"{so_far}, loading compiled code at least {LOADING:g} s")
        missing = [part for part in missing if not code_cache.on_disk(part)]
        if not missing:
            return Choice("compiled", f"compiled code is on disk, {so_far}")
        seconds, times = compiling(missing), SERVES if code_cache.can_keep() else 1
        if times * work >= seconds:
            return Choice("compiled", f"compiling takes about {seconds:.2g} s once, {so_far}")
        return Choice("plain", f"{so_far}, compiling would take about {seconds:.2g} s; python -m "
                      "skfem_ancf compile does it beforehand")

    def _missing(self, name):
        """Names of a kernel and its parts that are not loaded."""
        if self._flat is not None and name in LOADED:
            return []
        missing = [part for part in self._parts(name) if part not in LOADED]
        return missing if name in LOADED else [*missing, name]

    def _parts(self, name):
        """Names of the parts that a kernel needs."""
        return [*self.tables.parts, *NEEDED.get(name, ())]

    def seconds(self, iterations: float) -> float:
        """Approximate seconds of NumPy for a number of iterations."""
        return iterations * self._iteration

    @cached_property
    def _iteration(self):
        """Approximate seconds of an iteration in NumPy."""
        system = self.tables.system
        return (ITERATION + ELEMENT * sum(beam.mesh.nelements for beam in system.beams)
                + POINT * sum(len(group.first) for _, group in system.forces.contacts.groups))

    def of(self, kernel: Callable, iterations: float = 1.0, calls: bool = False) -> Callable:
        """A kernel bound to the equations, its first argument, in NumPy or compiled."""
        # ``iterations`` are those of the work that is done with it. With ``calls`` it calls Python.
        # NumPy may warn of overflow.
        global _worked
        mode, name = self.choose(kernel.__name__, iterations).mode, kernel.__name__
        if mode == "plain":
            _worked += self.seconds(iterations)
            return self._in_numpy(kernel)
        calls = calls or self.tables.calls_back
        if mode == "loaded":
            return self._bound(name, calls)
        loaded: list[Any] = []

        def run(*args):
            if not loaded:
                loaded.append(self._loaded(kernel, args, calls))
            return loaded[0](*args)

        return run

    def _in_numpy(self, kernel):
        return partial(kernel, self.tables.plain)

    def _bound(self, name, calls):
        """A loaded kernel bound to the equations; if it calls Python, with exceptions of that."""
        function = partial(LOADED[name], self._flatten()[1].address)
        if not calls:
            return function

        def checked(*args):
            with deferred():
                found = function(*args)
            raise_kept()
            return found

        return checked

    def _loaded(self, kernel, args, calls):
        """A kernel as the first call needs it: compiled, or in NumPy if that is impossible."""
        # It announces long compilations.
        global _worked
        name = kernel.__name__
        if PROBLEMS or self._plain is not None:  # found since it was chosen
            return self._in_numpy(kernel)
        missing = self._missing(name)
        try:
            if missing:
                from ..core.jit import entry

                if not code_cache.on_disk(*missing):
                    _worked = 0.0
                with _LOCK, announced(missing) as update:
                    for part in self._parts(name):
                        load_part(part, update)
                    equations, *_ = self._flatten()
                    if name not in LOADED:
                        LOADED[name] = entry(kernel, (equations, *args))
                        code_cache.note(name)
                        update(name)
            return self._bound(name, calls)
        except code_cache.NotCompiled as error:  # a user's function
            self._plain = (self._base or self)._plain = str(error)
            logger.info(self._plain)
            return self._in_numpy(kernel)
        except Exception as error:  # an incompatible Numba
            PROBLEMS.append(
                f"Numba cannot be used: {error}" if isinstance(error, ImportError) else
                f"{name} cannot be compiled: {error!r}")
            logger.warning("%s; it runs in NumPy", PROBLEMS[-1])
            return self._in_numpy(kernel)

    def keep_factors(self) -> None:
        """Let the tangent have the factors of the last compiled iteration."""
        self.tables.system.K.factors = self._flat[0].factors

    def _flatten(self):
        """Make the equations for compiled code; returns them."""
        if self._flat is None:
            from . import loops

            plain = self.tables.plain
            self._flat = loops.flat(plain) if self._base is None else loops.flat_after(
                self._base._flatten(), plain)
        return self._flat


def load_part(name: str, update: Callable[[str], None]) -> None:
    """Compile a part or load it; calls ``update(name)``."""
    if name not in LOADED:
        from ..core import jit

        jit.load_part(name)
        LOADED[name] = True
        code_cache.note(name)
        update(name)


def compiling(names: Iterable[str]) -> float:
    """Approximate seconds for compiling names of :data:`SECONDS`."""
    return sum(SECONDS[name] for name in names)


#: One thread at a time compiles.
_LOCK = RLock()
#: True while a compilation is announced.
_announced = False


@contextmanager
def announced(names: Iterable[str]) -> Iterator[Callable[[str], None]]:
    """Announce on stderr what is compiled and for how long, with progress; not for cached names."""
    # Yields a function that takes the name of a finished part.
    global _announced
    names = {name for name in names if not code_cache.on_disk(name)}
    if not names or _announced:
        yield lambda name: None
        return
    said = (f"compiling once, about {compiling(names):.2g} s, cached in {code_cache.folder()}"
            if code_cache.can_keep() else f"compiling, about {compiling(names):.2g} s")
    logger.info("%s: %s", ", ".join(sorted(names)), said)
    _announced = True
    try:
        with announced_bar(compiling(names), f"skfem_ancf: {said}") as bar:
            def update(name):
                if name in names:
                    names.discard(name)
                    bar.update(SECONDS[name])

            yield update
    finally:
        _announced = False
