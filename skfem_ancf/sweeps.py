"""Sweeps over parameters: an ordered map over threads, processes or a cluster."""

import inspect
import os
import pickle
import signal
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from .core import (Array, ArrayLike, CallbackError, CallError, Interrupted, PickleError,
                   SweepWarning, progress_bar, refuse, require_function, require_integer,
                   require_like, require_module, require_option, shown, warn)

_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


class Failure(NamedTuple):
    """A member of a sweep that could not be built, solved or measured. ``member`` is its index,
    ``parameters`` are by name, ``error`` is the class and message."""

    member: int
    parameters: dict[str, Any]
    error: str


@dataclass(frozen=True, eq=False)
class Sweep:
    """Results of :func:`skfem_ancf.sweep`, in the order of the parameters.

    ``sweep[name]`` is the array of a measured quantity or a parameter.

    Attributes
    ----------
    parameters : dict
        By name, arrays (n, ...), one row for each member.
    values : dict
        By name, arrays (n, ...) of measured values, nan where a member failed or is not done. A
        value without a name is called "value".
    failures : list of Failure
        The members that failed, among them those whose values differ in names or shapes from those
        of the first.

    Examples
    --------
    >>> from skfem_ancf import sweep
    >>> result = sweep(lambda x: x, {"x": [1.0, 2.0]}, lambda x: {"square": x**2})
    >>> result["square"], result["x"], result.failures
    (array([1., 4.]), array([1., 2.]), [])
    """

    parameters: dict[str, Array]
    values: dict[str, Array]
    failures: list[Failure]

    def __getitem__(self, name: str) -> Array:
        known = {**self.parameters, **self.values}
        return known[require_option("array", name, known)]

    def to_xarray(self) -> Any:
        """An ``xarray.Dataset``: values along "member", with the parameters as coordinates.
        MissingExtra is raised if xarray is not installed."""
        values, parameters = (
            {name: (("member", *(f"{name}_{axis}" for axis in range(x.ndim - 1))), x)
             for name, x in arrays.items()} for arrays in (self.values, self.parameters))
        return require_module("xarray", "arrays").Dataset(values, parameters)


def sweep(build: Callable[..., Any],
          parameters: Mapping[str, ArrayLike] | Sequence[Mapping[str, Any]],
          measure: Callable[[Any], Any], workers: int | None = None, client: Any = None,
          progress: bool | None = None) -> Sweep:
    """Build, solve and measure a scene for each of many sets of parameters.

    Each member is ``measure(build(**parameters))``: ``build`` makes the scene, ``measure`` solves
    it and returns numbers. Results depend neither on where members are computed nor on their order.
    A member that fails is nan and listed in ``failures``.

    Parameters
    ----------
    build
        Function of the parameters, by keyword, that returns a :class:`Scene`, or another argument
        of ``measure``.
    parameters
        By name, arrays of shape (n, ...), one row for each member; a pandas table; or a list of n
        dicts.
    measure
        Function of the scene that returns a number, an array of numbers, or a dict of them by name,
        with equal names and shapes for all members.
    workers
        Number of processes; None for this one only. ``build`` and ``measure`` must be importable:
        defined by ``def`` at the top of a module. Scripts call sweep under
        ``if __name__ == "__main__":``. Linear algebra uses one thread in each process.
    client
        What computes the members, instead of ``workers``: a ``dask.distributed.Client``, or an
        executor of ``concurrent.futures``, as of threads, of MPI or of joblib's loky.
    progress
        Show a progress bar by tqdm: True, False, or None: on a terminal, after a second.

    Raises
    ------
    InputError
        If arguments do not fit.
    CallError
        If ``build`` takes other parameters.
    PickleError
        If functions cannot be sent to other processes.
    CallbackError
        If all members fail.
    Interrupted
        By Ctrl-C; its ``state`` is the Sweep so far.

    Examples
    --------
    A cantilever is bent by a force: four moduli.

    >>> import numpy as np
    >>> from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff, sweep
    >>> mesh = MeshBeam.init_line(np.linspace(0, 1, 3), height=0.01)
    >>> def build(E):
    ...     beam = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(E=E, nu=0.3), width=0.01)
    ...     return Scene(beam).clamp("left").point_force((0, -0.01), at=(1, 0))
    >>> def tip(scene):
    ...     return scene.solve_static().displacement((1, 0))[1]
    >>> result = sweep(build, {"E": [1e9, 2e9, 4e9, 8e9]}, tip)
    >>> EI = result["E"] * 0.01**4 / 12
    >>> bool(np.allclose(result["value"], -0.01 / (3 * EI), rtol=1e-4))
    True
    """
    require_function("build", build, "of the parameters that returns a scene")
    require_function("measure", measure, "of the scene that returns numbers")
    refuse(None not in (workers, client), "workers and client exclude each other: give one of them")
    members = _members(parameters)
    try:
        inspect.signature(build).bind(**members[0])
    except TypeError as error:
        raise CallError(f"build does not fit the parameters {', '.join(map(repr, members[0]))}: "
                        f"{error}") from None
    except ValueError:  # some functions written in C have no signature
        pass
    task, found = partial(_measured, build, measure), [None] * len(members)
    results: Iterator[tuple[int, Any]] = enumerate(map(task, members))
    if client is not None:
        require_like("client", client, "dask.distributed.Client or an executor", "submit")
        results = _in_order(client.submit, task, members, len(members))
    elif workers is not None:
        results = _in_processes(task, members, require_integer("workers", workers, 1))
    try:
        with progress_bar(progress, len(members), "members") as bar:
            for k, found[k] in results:
                bar.update(1)
    except KeyboardInterrupt:
        raise Interrupted(f"interrupted with {len(found) - found.count(None)} of {len(found)} "
                          "members done; they are in the state of this exception",
                          _arrays(members, found)) from None
    result = _arrays(members, found)
    if failures := result.failures:
        text = (f"{len(failures)} of {len(members)} members failed, the first with "
                f"{failures[0].parameters}: {failures[0].error}")
        if len(failures) == len(members):
            raise CallbackError(text)
        warn(f"{text}; all are in .failures", SweepWarning)
    return result


def _members(parameters):
    """The parameters as a list of dicts with equal names."""
    if isinstance(parameters, Mapping) or hasattr(parameters, "columns"):  # of pandas
        columns = {name: getattr(x, "values", x) for name, x in parameters.items()}
        for name, x in columns.items():  # a text has no shape
            refuse(np.shape(x) == (), "the parameter {!r} must have one value for each member, got "
                   "{!r}: what is the same for all belongs into build", name, x)
        lengths = {name: len(x) for name, x in columns.items()}
        refuse(len({*lengths.values()}) > 1, "the parameters must have equal lengths, got {}: for "
               "all combinations use itertools.product", lengths)
        parameters = [dict(zip(columns, row)) for row in zip(*columns.values())]
    refuse(isinstance(parameters, str) or not hasattr(parameters, "__iter__"), "parameters must be "
           "a dict of arrays or a list of dicts, got {!r}", parameters)
    members = list(parameters)
    refuse(not members, "there are no members in the parameters")
    for k, member in enumerate(members):
        refuse(not isinstance(member, Mapping) or set(member) != set(members[0]), "parameters must "
               "have equal names: the first has {!r}, number {} is {!r}", members[0], k, member)
    return members


def _measured(build, measure, member):
    """Arrays by name, or the text of the error: user functions may raise anything."""
    try:
        value = measure(build(**member))
        found = value if isinstance(value, dict) else {"value": value}
        for name, x in found.items():
            refuse(not isinstance(name, str) or np.asarray(x).dtype.kind not in "biufc", "measure "
                   "must return a number, an array of numbers, or a dict of them by name, got {!r}",
                   value, error=CallbackError)
            refuse(name in member, "measure calls a value {!r} as a parameter of build: give it "
                   "another name", name, error=CallbackError)
        return {name: np.array(x) * 1.0 for name, x in found.items()}
    except Exception as error:
        return f"{type(error).__name__}: {error}"


def _in_order(submit, task, members, most, lost=None):
    """Yield the index and result of each member, with so many of them in flight."""
    # The list ``lost``, if given, gets the indices of those that ended with their process.
    flying: deque[Any] = deque()
    try:
        for k in range(len(members) + most):
            if k >= most:
                try:
                    yield k - most, flying.popleft().result()
                except Exception as error:
                    if lost is not None and isinstance(error, BrokenExecutor):
                        lost.append(k - most)
                    else:
                        yield k - most, f"{type(error).__name__}: {error}"
            if k < len(members):
                flying.append(submit(task, members[k]))
    finally:
        for future in flying:
            future.cancel()


def _in_processes(task, members, workers):
    """As :func:`_in_order`, in processes started by "spawn"; where one dies, others are started."""
    # The members in flight then are repeated one by one, so that only the cause is lost.
    import multiprocessing  # takes long
    from concurrent.futures import ProcessPoolExecutor

    try:
        pickle.dumps(task)
    except Exception as error:  # pickling may raise anything
        raise PickleError(f"build, {shown(task.args[0])}, or measure, {shown(task.args[1])}, "
                          f"cannot be sent to another process: {error}. Define them by def at the "
                          "top of a module, or leave workers out") from None
    names = [name for name in _THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(names, "1"))  # for the processes that are started
    start = partial(ProcessPoolExecutor, workers, multiprocessing.get_context("spawn"),
                    signal.signal, (signal.SIGINT, signal.SIG_DFL))  # ends silently on Ctrl-C
    pool, lost = start(), []

    def submit(*call):
        nonlocal pool
        try:
            return pool.submit(*call)
        except BrokenExecutor:
            pool = start()
            return pool.submit(*call)

    try:
        submit(os.getpid).result()
        yield from _in_order(submit, task, members, 2 * workers, lost)
        for k in lost:
            yield k, next(_in_order(submit, task, members[k:k + 1], 1))[1]
    except BrokenExecutor as error:
        raise CallError("processes cannot be started: in a script, call sweep under if __name__ == "
                        "'__main__':") from error
    finally:
        pool.shutdown(cancel_futures=True)
        for name in names:
            del os.environ[name]


def _arrays(members, found):
    """The Sweep of results; those that differ from the first in names or shapes failed."""
    def listed(values):
        return ", ".join(f"{name!r} of shape {x.shape}" for name, x in values.items())

    first = next((one for one in found if isinstance(one, dict)), {})
    found = [one if not isinstance(one, dict) or listed(one) == listed(first) else
             f"CallbackError: measure returned {listed(one)}, of the first member {listed(first)}: "
             "names and shapes must be those of all members" for one in found]
    values = {name: np.array([one[name] if isinstance(one, dict) else x * np.nan for one in found])
              for name, x in first.items()}
    columns = {}
    for name in members[0]:
        column = [member[name] for member in members]
        try:
            columns[name] = np.array(column)
        except ValueError:  # rows of different lengths
            columns[name] = np.fromiter(column, object, len(column))
    return Sweep(columns, values, [Failure(k, dict(members[k]), one) for k, one in enumerate(found)
                                   if isinstance(one, str)])


__all__ = ["Failure", "Sweep", "sweep"]
