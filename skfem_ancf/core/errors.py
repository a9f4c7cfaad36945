"""The errors of the package: what was wrong, the value, and what to change.

Every error derives from :class:`AncfError`; those about bad input are also ``ValueError``. The
functions ``require_...`` check arguments: they return what they are given, converted, or raise an
:class:`InputError`. ``name`` is what messages call the argument.
"""

from __future__ import annotations

import contextlib
import difflib
import os
import pickle
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import RLock
from typing import Any

import numpy as np

from .types import Array

#: The filters of warnings belong to all threads: one at a time sets and restores them.
_FILTERS = RLock()

#: Longest text of a value in a message.
WIDTH = 80


class AncfError(Exception):
    """Base class of every error raised by :mod:`skfem_ancf`."""


class InputError(AncfError, ValueError):
    """An argument has a value that cannot describe a beam."""


class MeshError(InputError):
    """The mesh, its geometry or a point on it is not valid."""


class NameUnknown(InputError):
    """A boundary, coordinate, formulation or scheme name is not known.

    The message lists the known ones and suggests the nearest.

    Attributes
    ----------
    kind, name, known
        What was named, the name given, and those that are known.
    """

    def __init__(self, kind: str, name: object, known: Iterable[Any]) -> None:
        self.kind, self.name, self.known = kind, name, tuple(known)
        super().__init__(f"unknown {kind} {shown(name)}; known: "
                         f"{', '.join(map(repr, self.known)) or 'none'}"
                         f"{_suggested(name, self.known)}")

    def __reduce__(self):
        return type(self), (self.kind, self.name, self.known)


class CallError(InputError, TypeError):
    """A call with unknown or missing arguments; the message lists those that there are."""


class CallbackError(InputError):
    """A function of the caller's raised an error, or returned what cannot be used."""


class FileError(InputError, OSError):
    """A file cannot be read or written, or holds something else."""


class SupportError(AncfError):
    """The supports leave a rigid motion free, or contradict each other."""


class ImmutableError(AncfError, AttributeError):
    """An attribute of an object that does not change was set."""


class PickleError(AncfError, pickle.PicklingError):
    """An object holds a function that pickle cannot take; the message says which."""


class MissingExtra(AncfError, ImportError):
    """An optional dependency is missing; the message names the extra.

    Parameters
    ----------
    module
        Name of the package that cannot be imported.
    extra
        Name of the extra of ``skfem-ancf`` that installs it.
    """

    def __init__(self, module: str, extra: str) -> None:
        self.module, self.extra = module, extra
        super().__init__(
            f"this needs the package {module!r}, which is not installed: "
            f'pip install "skfem-ancf[{extra}]", or pip install ".[{extra}]" in a clone of the '
            "repository")

    def __reduce__(self):
        return type(self), (self.module, self.extra)


class ConvergenceError(AncfError):
    """An iteration did not converge.

    Parameters
    ----------
    message
        What did not converge, where, and what to change.
    state
        What had converged until then, or None.

    Attributes
    ----------
    state
        The last converged state, or None if there is none.
    """

    def __init__(self, message: str, state: Any = None) -> None:
        super().__init__(message)
        self.state = state


class StabilityWarning(UserWarning):
    """The equilibrium path has lost its stability on the way to what was found."""


class ModelWarning(UserWarning):
    """The solution is beyond what the law or the mesh is good for."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a solution: what was found until then is kept.

    A KeyboardInterrupt, so that ``except Exception`` does not take it for an error, and a script
    does not go on as if all were done.

    Parameters
    ----------
    message
        Where it was stopped.
    state
        What was found until then.

    Attributes
    ----------
    state
        The History or the Path up to there, or the last State that converged.
    """

    def __init__(self, message: str, state: Any = None) -> None:
        super().__init__(message)
        self.state = state


class CheckpointError(AncfError):
    """A checkpoint cannot be written, is damaged, or is of another scene."""


class CheckpointWarning(UserWarning):
    """A checkpoint, or the file of a sweep, could not be written; the run goes on, the last good
    file stays.
    """


class CompilationWarning(UserWarning):
    """Compiled code cannot be kept on disk: each process compiles again."""


class SweepWarning(UserWarning):
    """Members of a sweep failed; the others are there."""


# messages

def shown(value: object) -> str:
    """A value as a message shows it: its repr on one line, shortened."""
    if isinstance(value, int) and value.bit_length() > 256:  # Python refuses to print the largest
        return f"{'-' * (value < 0)}10**{int(0.30103 * (value.bit_length() - 1))} or more"
    try:
        text = " ".join(repr(value).split())
    except Exception:  # whatever it is, it has no repr
        text = f"<{type(value).__name__}>"
    return text if len(text) <= WIDTH else text[:WIDTH - 3] + "..."


def _suggested(name, known):
    """The known name that is most like one, as the end of a message."""
    names = {k.lower(): k for k in known if isinstance(k, str)}
    found = difflib.get_close_matches(name.lower() if isinstance(name, str) else "", names, 1, 0.5)
    return f"; did you mean {names[found[0]]!r}?" if found else ""


# numbers

def require_finite_scalar(name: str, value: Any) -> float:
    """A finite real number as a float. True, False, texts and arrays of one number are none."""
    if not _is_real(value):
        raise InputError(f"{name} must be a number, got {shown(value)}")
    try:
        value = float(value)
    except OverflowError:
        raise InputError(f"{name} is too large for a float: {shown(value)}") from None
    except (TypeError, ValueError):
        raise InputError(f"{name} must be a number, got {shown(value)}") from None
    if not -np.inf < value < np.inf:
        raise InputError(f"{name} must be finite, got {value!r}")
    return value


def _is_real(value):
    dtype = getattr(value, "dtype", None)
    return (hasattr(type(value), "__float__") and not isinstance(value, bool)
            and getattr(dtype, "kind", "f") in "iuf" and getattr(value, "ndim", 0) == 0)


def require_positive(name: str, value: object, unit: str = "") -> float:
    """A positive finite number; messages name its unit, if it has one."""
    value = require_finite_scalar(name, value)
    if value <= 0.0:
        raise InputError(f"{name} must be positive{unit and f' ({unit})'}, got {value!r}")
    return value


def require_not_negative(name: str, value: Any, energy: bool = True) -> float:
    """A finite number >= 0; with ``energy`` a negative one would feed energy into the motion."""
    number = require_finite_scalar(name, value)
    if number < 0.0:
        why = ": negative damping, mass or stiffness would feed energy in" if energy else ""
        raise InputError(f"{name} must be zero or positive, got {number!r}{why}")
    return number


def require_integer(name: str, value: object, low: int, high: int | None = None,
                    why: str = "") -> int:
    """An integer from ``low`` to ``high``; messages say ``why`` these are the bounds."""
    if (isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < low
            or (high is not None and value > high)):
        wanted = f">= {low}" if high is None else f"from {low} to {high}"
        raise InputError(f"{name} must be an integer {wanted}{why and f' ({why})'}, got "
                         f"{shown(value)}")
    return int(value)


def require_index(name: str, value: object, n: int) -> int:
    """The index of one of ``n`` things, counted from the end if it is negative."""
    return require_integer(name, value, -n, n - 1) % n


def require_finite(name: str, array: Any, shape: Sequence[int | None] | None = None) -> Array:
    """An array of finite real numbers as float64; None in ``shape`` is a free extent."""
    if not (type(array) is np.ndarray and array.dtype == np.float64):
        array = _real_array(name, array)
    if shape is not None and (array.ndim != len(shape) or any(
            wanted not in (None, n) for wanted, n in zip(shape, array.shape))):
        wanted = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ")"
        raise InputError(f"{name} must have shape {wanted}, got {array.shape}")
    finite = np.isfinite(array)
    if not finite.all():
        raise InputError(f"{name} has a value that is NaN or infinite: {array[~finite][0]}")
    return array


def require_point(point: Any) -> Array:
    """A material point as an array (2,); MeshError unless it is two numbers."""
    if isinstance(point, (list, tuple, np.ndarray)) and len(point) == 2 and not any(
            isinstance(x, (list, tuple, str, bytes, bool, np.bool_)) or np.ndim(x) for x in point):
        return require_finite("a material point", point, (2,))
    raise MeshError("a material point has two coordinates (x, y), its place in the reference "
                    f"configuration, or is the name of an end, as 'right', got {shown(point)}")


def _real_array(name, value):
    require_unmasked(name, value)
    try:
        array = np.asarray(value)
        if array.dtype.kind == "c":
            raise InputError(f"{name} must be real, got complex numbers: {shown(value)}")
        # of objects: fractions, or large integers
        if array.dtype.kind in "iuf" or array.dtype.kind == "O" and all(map(_is_real, array.flat)):
            return array.astype(np.float64)
    except OverflowError:
        raise InputError(f"{name} has a value that is too large for a float: {shown(value)}"
                         ) from None
    except (TypeError, ValueError) as error:  # rows of different lengths, for one
        if isinstance(error, InputError):
            raise
    raise InputError(f"{name} must be an array of numbers, got {shown(value)}")


def is_masked(value: object) -> bool:
    """True of an array with masked values, and of a list or dict that holds one."""
    if isinstance(value, np.ma.MaskedArray):
        return bool(np.ma.is_masked(value))
    if isinstance(value, dict):
        value = tuple(value.values())
    return isinstance(value, (list, tuple)) and any(map(is_masked, value))


def require_unmasked(name: str, value: Any) -> None:
    """No array with masked values, and nothing that holds one."""
    if is_masked(value):
        raise InputError(f"{name} has masked values, whose numbers mean nothing: leave them out, "
                         "as by numpy.ma.compressed, or fill them, as by numpy.ma.filled")


#: By how much a derivative may be off, over the larger of it and the difference.
SLOPE = 0.01


def require_slope(what: str, of: str, change: Any, slope: Any, noise: float,
                  else_: str = "") -> None:
    """A derivative that is, nearly, that of a function.

    Parameters
    ----------
    what, of
        What messages call the derivative, and the function.
    change
        By how much the function changes over a small step.
    slope
        The derivative times that step, an array of the same shape.
    noise
        Round-off of the change.
    else_
        The end of the message.
    """
    change, slope = np.ravel(change), np.ravel(slope)
    off = np.abs(change - slope)
    if np.max(off, initial=0.0) > SLOPE * np.max(np.abs([change, slope])) + noise:
        k = np.argmax(off)
        raise InputError(f"{what} is not the derivative of {of}: over a small step it says "
                         f"{slope[k]:.6g} where that changes by {change[k]:.6g}{else_}")


# names and flags

def require_option(kind: str, name: object, known: Iterable[str]) -> str:
    """One of the known names of a kind, or :class:`NameUnknown`."""
    if not isinstance(name, str) or name not in known:
        raise NameUnknown(kind, name, known)
    return name


def require_names(kind: str, names: Any, known: Iterable[str]) -> tuple[str, ...]:
    """One known name or several as a tuple; ``kind`` is in the singular."""
    if isinstance(names, str):
        names = (names,)
    if not isinstance(names, (tuple, list, set, frozenset, np.ndarray)) or (
            getattr(names, "ndim", 1) != 1):
        raise InputError(f"{kind}s are named by a text or a list of texts, got {shown(names)}")
    return tuple(require_option(kind, name, known) for name in names)


def require_text(name: str, value: Any) -> Any:
    """A text that a file can hold, or None."""
    try:
        if value is not None:
            str.encode(value)
    except (TypeError, UnicodeEncodeError):  # the latter of lone surrogates
        raise InputError(f"{name} must be a text, or None for none, got {shown(value)}") from None
    return value


def require_label(name: str, value: object) -> str | None:
    """As :func:`require_text`, of texts that are not empty."""
    if isinstance(value, str) and not value:
        raise InputError(f"{name} must be a text, or None for none, got ''")
    return require_text(name, value)


def require_flag(name: str, value: object) -> bool:
    """True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} must be True or False, got {shown(value)}")
    return bool(value)


def require_like(name: str, value: Any, kind: str, *attributes: str) -> Any:
    """An object, not a class, with the attributes of a ``kind``."""
    if isinstance(value, type) or not all(hasattr(value, a) for a in attributes):
        raise InputError(f"{name} must be a {kind}, got {shown(value)}")
    return value


def require_options(what: str, options: dict[str, Any], known: Iterable[str],
                    hint: str = "") -> dict[str, Any]:
    """The keywords of a call, all of them known, or :class:`CallError` with a ``hint``."""
    for name in options:
        if name not in known:
            raise CallError(f"{what} has no option {name!r}; known: "
                            f"{', '.join(map(repr, known))}{_suggested(name, known)}{hint}")
    return options


def require_path(name: str, value: Any, suffixes: Sequence[str] = ()) -> Path:
    """A file name as a ``pathlib.Path``; its suffix, if it matters, in capitals too."""
    try:
        path = Path(value)
        if not os.fspath(value) or b"\0" in os.fsencode(path):
            raise ValueError
    except (TypeError, ValueError):  # among them UnicodeEncodeError, of lone surrogates
        raise InputError(f"{name} must be the path of a file, got {shown(value)}") from None
    if suffixes and path.suffix.lower() not in suffixes:
        raise InputError("the file name must end with "
                         f"{'one of ' if len(suffixes) > 1 else ''}{', '.join(suffixes)}, got "
                         f"{str(value)!r}")
    return path


# functions of the caller's

def require_function(name: str, value: Any, returns: str) -> Callable[..., Any]:
    """What can be called; ``returns`` as in "of time that returns a number"."""
    if not callable(value):
        raise InputError(f"{name} must be a function {returns}, got {shown(value)}")
    return value


@contextmanager
def warnings_as_errors(category: type[Warning] = Warning) -> Iterator[None]:
    """Warnings of a kind are raised inside, in this thread while no other changes the filters."""
    with _FILTERS, warnings.catch_warnings():
        warnings.simplefilter("error", category)
        yield


@contextmanager
def explained(what: str, hint: str, kind: type[AncfError], *of: Any) -> Iterator[None]:
    """What a user's code raises in the block, whatever it is, as an error with a hint.

    ``what`` is formatted with ``of`` if it is needed. Errors of the package pass.

    Examples
    --------
    >>> from skfem_ancf.core.errors import InputError, explained
    >>> with explained("{} fails", "give a number", InputError, "f(x)"):  # doctest: +ELLIPSIS
    ...     1 / 0
    Traceback (most recent call last):
    ...
    skfem_ancf.core.errors.InputError: f(x) fails: ZeroDivisionError: ...; give a number
    """
    try:
        yield
    except AncfError:
        raise
    except Exception as error:
        raise kind(f"{what.format(*of)}: {type(error).__name__}: {error}; {hint}") from error


def ask(what: str, function: Callable[..., Any], *args: Any) -> Any:
    """What a function of the caller's returns; if it raises, a :class:`CallbackError` says of what.

    ``what`` is the call, formatted with the arguments. Errors of the package pass.

    Examples
    --------
    >>> from skfem_ancf.core.errors import ask
    >>> ask("amplitude(t={:g})", lambda t: 1 / t, 0.0)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    skfem_ancf.core.errors.CallbackError: amplitude(t=0) raised ZeroDivisionError: ...
    """
    try:
        return function(*args)
    except AncfError:
        raise
    except Exception as error:
        raise CallbackError(f"{what.format(*args)} raised {type(error).__name__}: {error}"
                            ) from error


def ask_number(what: str, function: Callable[..., Any], *args: Any) -> float:
    """As :func:`ask`, for a function that returns a finite number."""
    return _returned(require_finite_scalar, what, ask(what, function, *args), args)


def ask_array(what: str, shape: Sequence[int | None] | None, function: Callable[..., Any],
              *args: Any, number: bool = False) -> Array:
    """As :func:`ask`, for finite numbers of a shape; with ``number`` one may do for all."""
    value = ask(what, function, *args)
    if number and np.ndim(value) == 0:
        value = np.broadcast_to(value, shape)  # type: ignore[arg-type]
    return _returned(require_finite, what, value, args, shape)


def ask_field(what: str, function: Callable[[Array], Any], x: Array) -> Array:
    """As :func:`ask`, for a vector field at points (2, ...): two components, which may be constant.
    """
    try:
        value = ask(what, function, x)
    except CallbackError as error:
        raise CallbackError(f"{error}, for points x of shape {x.shape}") from error.__cause__
    try:
        rows = [np.broadcast_to(_returned(require_finite, what, row, ()), x.shape[1:])
                for row in value]
    except (TypeError, ValueError) as error:
        if isinstance(error, AncfError):
            raise
        rows = []
    if len(rows) != 2:
        raise CallbackError(
            f"{what} must return two components, as np.array([0 * x[0], x[0]]), each of the shape "
            f"of x[0] or a number; for x of shape {x.shape} it returned "
            f"{np.shape(value) if isinstance(value, np.ndarray) else shown(value)}")
    return np.array(rows)


def _returned(check, what, value, args, *more):
    try:
        return check(what.format(*args), value, *more)
    except InputError as error:
        hint = "; does the function return something?" if value is None else ""
        raise CallbackError(str(error) + hint) from None


# warnings

#: Files of the package, and of the library where its own blocks pass through.
_WITHIN = str(Path(__file__).resolve().parents[1]) + os.sep, contextlib.__file__


def warn(message: str, category: type[Warning]) -> None:
    """Give a warning that names the line of the caller's that has led to it."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_WITHIN):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, category, stacklevel=level)
