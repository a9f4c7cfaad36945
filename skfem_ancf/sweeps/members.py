"""Results of a sweep: arrays over its members, and their file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..core.archive import Unreadable, read, write
from ..core.errors import FileError, InputError, MissingExtra, NameUnknown, require_path, shown
from ..core.types import Array, StrPath

_FORMAT = 2


class Failure(NamedTuple):
    """A member of a sweep that could not be built, solved or measured.

    ``member`` is its index, ``parameters`` are by name, ``error`` is the class and message.
    """

    member: int
    parameters: dict[str, Any]
    error: str


class Sweep:
    """Results of :func:`skfem_ancf.sweep`, in the order of the parameters.

    ``sweep[name]`` is the array of a measured quantity or a parameter.

    Parameters
    ----------
    parameters
        By name, arrays of shape (n, ...), one row for each member.
    found
        For each member a dict of arrays, the text of an error, or None where it is not done.

    Attributes
    ----------
    parameters : dict
        As above.
    values : dict
        By name, arrays (n, ...) of measured values, nan where a member failed or is not done. A
        value without a name is called "value".
    status : ndarray
        Shape (n,): "done", "failed" or "open".
    failures : list of Failure
        The members that failed, among them those whose values differ in names or shapes from those
        of the first.

    Examples
    --------
    >>> from skfem_ancf import sweep
    >>> result = sweep(lambda x: x, {"x": [1.0, 2.0]}, lambda x: {"square": x**2})
    >>> result["square"], result["x"]
    (array([1., 4.]), array([1., 2.]))
    >>> len(result), result.failures
    (2, [])
    """

    def __init__(self, parameters: dict[str, Array],
                 found: Sequence[dict[str, Array] | str | None]) -> None:
        self.parameters = parameters
        self.status = np.full(len(found), "open", dtype="<U6")
        found = _consistent(found)
        self._errors = {k: one for k, one in enumerate(found) if isinstance(one, str)}
        done = [k for k, one in enumerate(found) if isinstance(one, dict)]
        self.status[list(self._errors)], self.status[done] = "failed", "done"
        self.values = _arrays(found, done)

    @property
    def failures(self) -> list[Failure]:
        """The failed members, with parameters and errors."""
        return [Failure(k, {name: _plain(column[k]) for name, column in self.parameters.items()},
                        error) for k, error in self._errors.items()]

    def __len__(self) -> int:
        return len(self.status)

    def __getitem__(self, name: str) -> Array:
        known = {**self.parameters, **self.values}
        if not isinstance(name, str) or name not in known:
            raise NameUnknown("array", name, known)
        return known[name]

    def __repr__(self) -> str:
        counts = [f"{np.sum(self.status == word)} {word}" for word in ("done", "failed", "open")]
        return (f"<Sweep of {', '.join(self.parameters)}: {', '.join(counts)}; "
                f"values: {', '.join(self.values) or 'none'}>")

    def to_xarray(self) -> Any:
        """An ``xarray.Dataset``: values along "member", with the parameters as coordinates.

        The coordinate "status" is :attr:`status`, unless a parameter or a value has that name.
        MissingExtra is raised if xarray is not installed.
        """
        try:
            import xarray
        except ImportError:
            raise MissingExtra("xarray", "arrays") from None
        status = {} if "status" in self.values else {"status": self.status}
        return xarray.Dataset(
            {name: _labelled(name, values) for name, values in self.values.items()},
            {name: _labelled(name, values)
             for name, values in {**status, **self.parameters}.items()})

    def save(self, path: StrPath) -> None:
        """Write a ``.npz`` file, which replaces an existing one atomically.

        Its arrays ``parameters/NAME``, ``values/NAME``, ``status`` and ``errors`` have one row for
        each member; ``numpy.load`` reads them.

        Parameters
        ----------
        path
            Name of the file, which ends with .npz.
        """
        path = require_path("path", path, (".npz",))
        require_plain(self.parameters)
        arrays = {"format": np.array(_FORMAT), "status": self.status,
                  "errors": np.array([self._errors.get(k, "") for k in range(len(self))])}
        for folder, columns in (("parameters", self.parameters), ("values", self.values)):
            arrays.update((f"{folder}/{name}", column) for name, column in columns.items())
        try:
            write(path, arrays)
        except OSError as error:
            raise FileError(f"{path} cannot be written: {error}") from error

    @classmethod
    def load(cls, path: StrPath) -> Sweep:
        """Load a sweep from a file; FileError if it is not one.

        Parameters
        ----------
        path
            Name of the file.
        """
        path = require_path("path", path, (".npz",))
        try:
            parameters, values, status, errors = _read(path)
        except (OSError, Unreadable) as error:
            raise FileError(f"{path} cannot be read as a sweep: {error}") from error
        return cls(parameters, [
            {name: column[k] for name, column in values.items()} if word == "done"
            else str(errors[k]) if word == "failed" else None for k, word in enumerate(status)])


def _read(path):
    """Parameters, values, status and errors of a file; Unreadable if it is damaged."""
    arrays = read(path)
    form = arrays.pop("format", None)
    if form is None or form.shape or form.dtype.kind not in "iu" or form != _FORMAT:
        raise Unreadable("it is of another version, or of something else")
    status, errors = (arrays.pop(name, np.zeros(0)) for name in ("status", "errors"))
    columns = {"parameters": {}, "values": {}}
    for key, x in arrays.items():
        folder, _, name = key.partition("/")
        if folder not in columns or x.dtype.kind == "S" or folder == "values" and (
                x.dtype.kind not in "fc"):
            raise Unreadable(f"the array {key!r} belongs to none")
        columns[folder][name] = x
    if not set(status.tolist()) <= {"done", "failed", "open"} or errors.dtype.kind != "U" or any(
            x.shape[:1] != status.shape for x in (errors, *arrays.values())):
        raise Unreadable("its arrays do not fit together")
    if not columns["parameters"] or "done" in status and not columns["values"]:
        raise Unreadable("arrays are missing")
    return *columns.values(), status, errors


def _plain(x):
    return x.item() if isinstance(x, np.generic) else x


def column_of(values: Sequence[Any]) -> Array:
    """An array (n, ...) of n values: numbers, texts, truth values, or objects."""
    try:
        column = np.array(values)
        types = {type(x) for x in values}
        counts = (sum(issubclass(x, kinds) for x in types) for kinds in (str, (bool, np.bool_)))
        if column.dtype.kind in "biufcU" and all(n in (0, len(types)) for n in counts):
            return column
    except (TypeError, ValueError):  # rows of different lengths, for one
        pass
    column = np.empty(len(values), dtype=object)
    column[:] = list(values)
    return column


def require_plain(columns: dict[str, Array]) -> None:
    """Raise InputError if a parameter (n, ...) contains neither numbers nor texts."""
    for name, column in columns.items():
        if column.dtype.kind == "O":
            raise InputError(f"a file takes parameters that are numbers or texts; {name!r} has "
                             f"{shown(column[0])}: give names or numbers, and let build look up "
                             "what they mean")


def _consistent(found):
    """Replace members whose names or shapes differ from the first one by errors."""
    def listed(values):
        return ", ".join(f"{name!r} of shape {value.shape}" for name, value in values.items())

    def shapes(values):
        return {name: value.shape for name, value in values.items()}

    first = next((one for one in found if isinstance(one, dict)), {})
    return [one if not isinstance(one, dict) or shapes(one) == shapes(first) else
            f"CallbackError: measure returned {listed(one)}, of the first member {listed(first)}: "
            "names and shapes must be those of all members" for one in found]


def _arrays(found, done):
    arrays = {}
    for name in found[done[0]] if done else ():
        rows = np.array([found[k][name] for k in done])
        arrays[name] = np.full((len(found), *rows.shape[1:]), np.nan, dtype=rows.dtype)
        arrays[name][done] = rows
    return arrays


def _labelled(name, values):
    return ("member", *(f"{name}_{axis}" for axis in range(values.ndim - 1))), values
