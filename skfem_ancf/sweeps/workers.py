"""Where members of a sweep are computed: here, in other processes, on a cluster."""

from __future__ import annotations

import os
import pickle
import signal
import sys
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from functools import partial
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import AncfError, CallbackError, InputError, PickleError, require_like, shown
from ..core.switch import expecting

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable
    from concurrent.futures import Future

    from ..core.types import Array

    #: Values by name, or the text of an error.
    Found = dict[str, Array] | str
    Chunks = Generator[tuple[list[int], list[Found]], None, None]

_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


class Task:
    """A member, from its parameters to what is measured.

    Parameters
    ----------
    build
        From the parameters to a scene.
    measure
        From the scene to a number, an array or a dict of them.

    Attributes
    ----------
    share
        Members that a process computes, about.
    """

    def __init__(self, build: Callable[..., Any], measure: Callable[[Any], Any]) -> None:
        self.build, self.measure, self.share = build, measure, 1.0

    def __call__(self, member: dict[str, Any]) -> Found:
        """What is measured of a member, by name, or the text of the error."""
        return self.begun(member)()

    def begun(self, member: dict[str, Any]) -> Callable[[], Found]:
        """A function that measures the scene of a member, which is built now."""
        try:
            return partial(self._measured, self.build(**member), member)
        except Exception as error:  # of the caller's functions, which may raise anything
            text = f"{type(error).__name__}: {error}"
            return lambda: text

    def _measured(self, scene, member):
        try:
            return _named(self.measure(scene), member)
        except Exception as error:
            return f"{type(error).__name__}: {error}"

    def elsewhere(self, member: dict[str, Any]) -> Found:
        """The same in another process."""
        with expecting(self.share):
            return self(member)


def _named(value, member):
    values = value if isinstance(value, dict) else {"value": value}
    found = {}
    for name, one in values.items():
        array = np.asarray(one)
        if not isinstance(name, str) or array.dtype.kind not in "biufc":
            raise CallbackError("measure must return a number, an array of numbers, or a dict of "
                                f"them by name, got {shown(value)}")
        if name in member:
            raise CallbackError(f"measure calls a value {name!r}, which is a parameter of build: "
                                "give it another name")
        found[name] = np.array(array, dtype=complex if array.dtype.kind == "c" else float)
    return found


def here(task: Task, members: list[dict[str, Any]], places: Iterable[int]) -> Chunks:
    """Compute members in this process; yields their places and what was found.

    Parameters
    ----------
    task
        What is done with each.
    members
        Parameters of all.
    places
        Which of them are computed.
    """
    for k in places:
        yield [k], [task(members[k])]


def in_threads(task: Task, members: list[dict[str, Any]], places: Iterable[int]) -> Chunks:
    """As :func:`here`, measured in as many threads as there are processors, built one by one.

    Parameters
    ----------
    task, members, places
        As there.
    """
    threads = processors()
    flying: deque[tuple[int, Future[Found]]] = deque()
    with ThreadPoolExecutor(threads) as pool:
        try:
            for k in places:
                flying.append((k, pool.submit(copy_context().run, task.begun(members[k]))))
                if len(flying) > 2 * threads:
                    first, future = flying.popleft()
                    yield [first], [future.result()]
            for k, future in flying:
                yield [k], [future.result()]
        finally:
            pool.shutdown(cancel_futures=True)


def processors() -> int:
    """How many processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


def in_processes(task: Task, members: list[dict[str, Any]], places: Iterable[int], workers: int
                 ) -> Chunks:
    """As :func:`here`, in processes of this computer, started anew ("spawn").

    Parameters
    ----------
    task, members, places
        As there.
    workers
        How many.

    Raises
    ------
    PickleError
        If the functions cannot be sent to another process.
    """
    _require_sendable(task)
    with _Pool(workers) as pool:
        yield from _spread(pool.submit, workers, task, members, places)


def on_cluster(task: Task, members: list[dict[str, Any]], places: Iterable[int], client: Any
               ) -> Chunks:
    """As :func:`here`, by the workers of a Dask client.

    Parameters
    ----------
    task, members, places
        As there.
    client
        A ``dask.distributed.Client``.

    Raises
    ------
    InputError
        If it is no client, or has no workers.
    """
    require_like("client", client, "dask.distributed.Client", "submit", "nthreads")
    lanes = sum(client.nthreads().values())
    if lanes < 1:
        raise InputError("client has no workers: start some, or client.wait_for_workers(n)")
    yield from _spread(partial(client.submit, pure=False), lanes, task, members, places)


def _require_sendable(task):
    named = [("build", task.build), ("measure", task.measure)]
    for what, function in named:
        try:
            pickle.dumps(function)
        except Exception as error:  # what a function holds may raise anything
            raise PickleError(
                f"{what}, {shown(function)}, cannot be sent to another process: {error}. Define "
                "it by def at the top of a module") from error
        main = sys.modules["__main__"]
        if getattr(function, "__module__", None) == "__main__" and not hasattr(main, "__file__"):
            raise PickleError(f"{what}, {shown(function)}, was typed where other processes cannot "
                              "find it: write it to a module and import it, leave workers out, or "
                              "hand a client of dask.distributed, which sends any function")


class _Pool:
    """Processes that are started again where one has died."""

    def __init__(self, workers):
        self.workers = workers

    def __enter__(self):
        from multiprocessing import active_children

        self.others = set(active_children())
        self.start()
        try:
            self.submit(os.getpid).result()
        except RuntimeError as error:  # BrokenProcessPool
            raise AncfError(
                "processes cannot be started: in a script, call sweep under "
                "if __name__ == '__main__':, since each of them imports the script") from error
        return self

    def start(self):
        from concurrent.futures import ProcessPoolExecutor
        from multiprocessing import get_context

        self.pool = ProcessPoolExecutor(self.workers, get_context("spawn"), _quiet)

    def submit(self, *call):
        """A future, of other processes if one of these has died."""
        from concurrent.futures import BrokenExecutor

        with _single_threads():
            try:
                return self.pool.submit(*call)
            except BrokenExecutor:
                self.pool.shutdown()
                self.start()
                return self.pool.submit(*call)

    def __exit__(self, kind, error, trace):
        from multiprocessing import active_children

        if kind is not None:  # no one waits for what they are doing
            for process in set(active_children()) - self.others:
                process.terminate()
        self.pool.shutdown(cancel_futures=True)


def _quiet():
    """Ctrl-C ends a worker without a word."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def _single_threads():
    """Processes that are started inside have one thread for linear algebra."""
    names = [name for name in _THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name in names:
            del os.environ[name]


def _spread(submit, lanes, task, members, places):
    """Members in flight, two for each lane; what came back, as it comes.

    Members that were in flight when a worker died are computed again, one at a time, so that the
    one which kills is known.
    """
    places, again, flying, back = deque(places), deque(), {}, SimpleQueue()
    task.share = len(places) / lanes
    try:
        while places or again or flying:
            alone = bool(again)
            source, most = (again, 1) if alone else (places, 2 * lanes)
            while source and len(flying) < most:
                k = source.popleft()
                future = submit(task.elsewhere, members[k])
                flying[future] = k, alone
                future.add_done_callback(back.put)
            future = back.get()
            k, was_alone = flying.pop(future)
            try:
                found = future.result()
            except Exception as error:
                if not was_alone:
                    again.append(k)
                    continue
                found = f"{type(error).__name__}: {error}"
            yield [k], [found]
    finally:
        for future in flying:
            future.cancel()
