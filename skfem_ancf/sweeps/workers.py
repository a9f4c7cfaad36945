"""Computation of the members of a sweep: serial, in threads, in processes, on a cluster."""

from __future__ import annotations

import os
import pickle
import signal
import sys
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import BrokenExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from queue import SimpleQueue
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import AncfError, CallbackError, InputError, PickleError, require_like, shown
from ..core.types import Array

#: Values by name, or the text of an error.
Found = dict[str, Array] | str
Results = Generator[tuple[int, Found], None, None]

#: Degrees of freedom from which a scene is measured in a thread of its own.
LARGE = 4000

_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


class Task(NamedTuple):
    """Builds and measures a member."""

    build: Callable[..., Any]
    measure: Callable[[Any], Any]

    def __call__(self, member: dict[str, Any]) -> Found:
        """Measured values of a member by name, or the text of the error."""
        return self.begun(member)()

    def begun(self, member: dict[str, Any]) -> partial[Found]:
        """Build the scene of a member now; returns a function that measures it."""
        try:
            return partial(self._measured, self.build(**member), member)
        except Exception as error:  # user functions may raise anything
            return partial(str, f"{type(error).__name__}: {error}")

    def _measured(self, scene, member):
        try:
            return _named(self.measure(scene), member)
        except Exception as error:
            return f"{type(error).__name__}: {error}"


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


def here(task: Task, members: list[dict[str, Any]], places: Iterable[int]) -> Results:
    """Compute members serially; yields the index and the result of each."""
    for k in places:
        yield k, task(members[k])


def in_threads(task: Task, members: list[dict[str, Any]], places: Iterable[int]) -> Results:
    """As :func:`here`, built one by one; large scenes in one thread for each processor.

    Small ones are Python most of the time, which one thread runs at a time.
    """
    threads, flying = processors(), deque()  # type: ignore[var-annotated]
    with ThreadPoolExecutor(threads) as pool:
        try:
            for k in places:
                work = task.begun(members[k])
                if getattr(work.args[0], "N", 0) < LARGE:
                    yield k, work()
                    continue
                flying.append((k, pool.submit(work)))
                if len(flying) > 2 * threads:
                    first, future = flying.popleft()
                    yield first, future.result()
            for k, future in flying:
                yield k, future.result()
        finally:
            pool.shutdown(cancel_futures=True)


def processors() -> int:
    """Number of processors available to this process."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


def in_processes(task: Task, members: list[dict[str, Any]], places: Iterable[int], workers: int
                 ) -> Results:
    """As :func:`here`, in processes of this computer, started by "spawn"."""
    for what, function in (("build", task.build), ("measure", task.measure)):
        _require_sendable(what, function)
    with _Pool(workers) as pool:
        yield from _distribute(pool.submit, workers, task, members, places)


def on_cluster(task: Task, members: list[dict[str, Any]], places: Iterable[int], client: Any
               ) -> Results:
    """As :func:`here`, by the workers of a Dask client."""
    require_like("client", client, "dask.distributed.Client", "submit", "nthreads")
    workers = sum(client.nthreads().values())
    if workers < 1:
        raise InputError("client has no workers: start some, or client.wait_for_workers(n)")
    yield from _distribute(partial(client.submit, pure=False), workers, task, members, places)


def _require_sendable(what, function):
    try:
        pickle.dumps(function)
        found = (getattr(function, "__module__", None) != "__main__"
                 or hasattr(sys.modules["__main__"], "__file__"))
        why = "it was typed where other processes cannot find it"
    except Exception as error:  # pickling may raise anything
        found, why = False, str(error)
    if not found:
        raise PickleError(f"{what}, {shown(function)}, cannot be sent to another process: {why}. "
                          "Define it by def at the top of a module, leave workers out, or hand a "
                          "client of dask.distributed, which sends any function by cloudpickle")


class _Pool:
    """Worker processes, restarted after a crash."""

    def __init__(self, workers):
        import multiprocessing  # takes long

        self.workers, self.processes = workers, multiprocessing
        self.others = set(multiprocessing.active_children())

    def __enter__(self):
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

        self.pool = ProcessPoolExecutor(self.workers, self.processes.get_context("spawn"), _quiet)

    def submit(self, *call):
        """A future; restarts the processes if one has died."""
        with _single_threads():
            try:
                return self.pool.submit(*call)
            except BrokenExecutor:
                self.pool.shutdown()
                self.start()
                return self.pool.submit(*call)

    def __exit__(self, kind, error, trace):
        if kind is not None:  # do not wait for work in progress
            for process in set(self.processes.active_children()) - self.others:
                process.terminate()
        self.pool.shutdown(cancel_futures=True)


def _quiet():
    """Workers end silently on Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def _single_threads():
    """Processes started inside use one thread for linear algebra."""
    names = [name for name in _THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name in names:
            del os.environ[name]


def _distribute(submit, workers, task, members, places):
    """Submit two members for each worker at a time; yields results as they arrive.

    Members in flight when a worker dies are computed again one at a time, to find the cause.
    """
    places, again, flying, back = deque(places), deque(), {}, SimpleQueue()
    try:
        while places or again or flying:
            alone = bool(again)
            source, most = (again, 1) if alone else (places, 2 * workers)
            while source and len(flying) < most:
                k = source.popleft()
                future = submit(task, members[k])
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
            yield k, found
    finally:
        for future in flying:
            future.cancel()
