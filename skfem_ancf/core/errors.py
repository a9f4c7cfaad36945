"""Errors of the package and checks of arguments. Every error derives from :class:`AncfError`; those
about input are also ``ValueError``. The functions ``require_...`` return their argument, converted,
or raise an :class:`InputError`; ``name`` is the argument's name in the message."""

import contextlib
import difflib
import importlib
import os
import pickle
import re
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from .types import Array, ArrayLike

_T = TypeVar("_T")

#: Exceptions of factorisations and eigenvalue solvers.
NO_FACTORS = np.linalg.LinAlgError, RuntimeError
#: Warning filters are global: one thread at a time changes them.
_FILTERS = RLock()

#: Longest representation of a value in a message.
WIDTH = 80


class AncfError(Exception):
    """Base class of all errors of :mod:`skfem_ancf`."""


class InputError(AncfError, ValueError):
    """An argument is invalid."""


class MeshError(InputError):
    """A mesh, its geometry or a point on it is invalid."""


class NameUnknown(InputError):
    """An unknown name; the message lists the known ones and suggests the most similar.

    Attributes
    ----------
    kind, name, known, hint
        The kind of name, the given name, the known names, and how the message ends.
    """

    def __init__(self, kind: str, name: object, known: Iterable[Any], hint: str = "") -> None:
        self.kind, self.name, self.known, self.hint = kind, name, tuple(known), hint
        super().__init__(f"unknown {kind} {shown(name)}; known: "
                         f"{', '.join(map(repr, self.known)) or 'none'}"
                         f"{hint or _suggested(name, self.known)}")

    def __reduce__(self):
        return type(self), (self.kind, self.name, self.known, self.hint)


class CallError(InputError, TypeError):
    """A call with unknown or missing arguments; the message lists the known ones."""


class CallbackError(InputError):
    """A user's function raised an error or returned an invalid value."""


class FileError(InputError, OSError):
    """A file cannot be read or written, or has a wrong content."""


class SupportError(AncfError):
    """Supports leave a rigid motion unconstrained, or contradict each other."""


class ImmutableError(AncfError, AttributeError):
    """An attribute of an immutable object was set."""


class PickleError(AncfError, pickle.PicklingError):
    """An object has a function that cannot be pickled; the message says which."""


class MissingExtra(AncfError, ImportError):
    """An optional dependency is missing; the message names the extra.

    Parameters
    ----------
    module
        Name of the missing package.
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


def require_module(module: str, extra: str, package: str = "") -> Any:
    """An optional module, of the package of that name or another one."""
    try:
        return importlib.import_module(module)
    except ImportError:
        raise MissingExtra(package or module.partition(".")[0], extra) from None


class ConvergenceError(AncfError):
    """An iteration did not converge.

    Parameters
    ----------
    message
        What did not converge, where, and what to change.
    state
        The last converged state, or None: an attribute.
    """

    def __init__(self, message: str, state: Any = None) -> None:
        super().__init__(message)
        self.state = state


class StabilityWarning(UserWarning):
    """The equilibrium path has lost its stability."""


class ModelWarning(UserWarning):
    """The solution is outside of the range of the material law or the mesh."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C during a solution; ``state`` has the result so far.

    It is a KeyboardInterrupt, so that ``except Exception`` does not catch it.

    Parameters
    ----------
    message
        Where the solution stopped.
    state
        The History or the Path so far, or the last converged State: an attribute.
    """

    def __init__(self, message: str, state: Any = None) -> None:
        super().__init__(message)
        self.state = state


class CheckpointError(AncfError):
    """A checkpoint cannot be written, is damaged, or of another scene."""


class CheckpointWarning(UserWarning):
    """A checkpoint could not be written; the previous file remains."""


class CompilationWarning(UserWarning):
    """Compiled code cannot be cached on disk: each process compiles again."""


class SweepWarning(UserWarning):
    """Some members of a sweep failed."""


# messages

def shown(value: object) -> str:
    """A value for a message: its repr on one line, shortened."""
    if isinstance(value, int) and value.bit_length() > 256:  # Python limits the number of digits
        return f"{'-' * (value < 0)}10**{int(0.30103 * (value.bit_length() - 1))} or more"
    try:
        text = " ".join(repr(value).split())
    except Exception:  # repr failed
        text = f"<{type(value).__name__}>"
    return text if len(text) <= WIDTH else text[:WIDTH - 3] + "..."


class _Shown:
    """A value in the format of a message: ``{!r}`` is :func:`shown`, ``{:g}`` of a list a tuple."""

    def __init__(self, value):
        self.value = value

    def __repr__(self):
        return shown(self.value)

    def __getitem__(self, key):  # {[0]} takes an entry only if something is wrong
        return _Shown(self.value[key])

    def __format__(self, spec):
        if spec and isinstance(self.value, (list, tuple, np.ndarray)):
            return f"({', '.join(format(one, spec) for one in self.value)})"
        return format(self.value, spec)


def refuse(wrong: object, message: str, *values: Any, error: type[AncfError] = InputError) -> None:
    """Raise an error if something is wrong, with values in its message: ``{!r}`` shortens one."""
    if wrong:
        raise error(message.format(*map(_Shown, values)) if values else message)


def refuse_any(wrong: Any, message: str, *values: Any,
               error: type[AncfError] = InputError) -> None:
    """As :func:`refuse` for the first True of an array (n,): its number is ``{k}``; arrays among
    the values, (..., n), are taken there."""
    if np.any(wrong):
        k = int(np.argmax(wrong))
        raise error(message.format(*[_Shown(value[..., k].tolist() if isinstance(
            value, np.ndarray) else value) for value in values], k=k))


def _suggested(name, known):
    """The most similar known name as the end of a message, or ""."""
    names = {k.lower(): k for k in known if isinstance(k, str)}
    given = name.lower() if isinstance(name, str) else ""
    axis = re.fullmatch(r"[urd]?[_^]?([xy12])", given)  # of a position or displacement
    number = {"x": 1, "y": 2}.get(axis[1], axis[1]) if axis else ""
    found = ([same for same in (f"r^{number}", f"u^{number}") if same in names]
             or difflib.get_close_matches(given, names, 1, 0.5))
    return f"; did you mean {names[found[0]]!r}?" if found else ""


# numbers

def require_finite_scalar(name: str, value: Any) -> float:
    """A finite real number as a float; not bool, text or array."""
    if type(value) not in (float, int) and not _is_real(value):
        raise InputError(f"{name} must be a number, got {shown(value)}")
    try:
        value = float(value)
    except OverflowError:
        raise InputError(f"{name} is too large for a float: {shown(value)}") from None
    except (TypeError, ValueError):
        raise InputError(f"{name} must be a number, got {shown(value)}") from None
    if not -np.inf < value < np.inf:
        raise InputError(f"{name} must be finite, got {shown(value)}")
    return value


def _is_real(value):
    dtype = getattr(value, "dtype", None)
    return (hasattr(type(value), "__float__") and not isinstance(value, bool)
            and getattr(dtype, "kind", "f") in "iuf" and getattr(value, "ndim", 0) == 0)


def require_positive(name: str, value: object, unit: str = "") -> float:
    """A positive finite number; ``unit`` appears in the message."""
    value = require_finite_scalar(name, value)
    if value <= 0.0:
        raise InputError(f"{name} must be positive{unit and f' ({unit})'}, got {shown(value)}")
    return value


def require_not_negative(name: str, value: Any, energy: bool = True) -> float:
    """A finite number >= 0; ``energy`` explains why in the message."""
    number = require_finite_scalar(name, value)
    refuse(number < 0.0, "{} must be zero or positive, got {!r}{}", name, number,
           ": negative damping, mass or stiffness would feed energy in" * energy)
    return number


def require_integer(name: str, value: object, low: int, high: int | None = None,
                    why: str = "") -> int:
    """An integer from ``low`` to ``high``; ``why`` explains the bounds in the message."""
    if (isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < low
            or (high is not None and value > high)):
        wanted = f">= {low}" if high is None else f"from {low} to {high}"
        raise InputError(f"{name} must be an integer {wanted}{why and f' ({why})'}, got "
                         f"{shown(value)}")
    return int(value)


def require_index(name: str, value: object, n: int) -> int:
    """The index of one of ``n`` things; negative ones count from the end."""
    return require_integer(name, value, -n, n - 1) % n


_FLOAT, _NUMBERS = np.dtype(float), {int, float, np.float64}


def require_finite(name: str, array: Any, shape: Sequence[int | None] | None = None,
                   example: str = "") -> Array:
    """An array of finite real numbers as float64; None in ``shape`` is any extent."""
    # The message on a wrong shape ends with the value, and with an ``example`` of what works.
    given = array
    if not (type(array) is np.ndarray and array.dtype is _FLOAT):
        if type(given) is not tuple or not _NUMBERS.issuperset(map(type, given)):
            require_unmasked(name, given)
        try:
            array = np.asarray(given)
            if array.dtype.kind == "c":
                raise InputError(f"{name} must be real, got complex numbers: {shown(given)}")
            # objects: fractions, or large integers
            if not (array.dtype.kind in "iuf" or array.dtype.kind == "O" and all(
                    map(_is_real, array.flat))):
                raise TypeError
            array = array.astype(np.float64, copy=False)
        except OverflowError:
            raise InputError(f"{name} has a value that is too large for a float: {shown(given)}"
                             ) from None
        except (TypeError, ValueError) as error:  # such as rows of different lengths
            if isinstance(error, InputError):
                raise
            raise InputError(f"{name} must be an array of numbers, got {shown(given)}") from None
    if shape is not None and array.shape != shape and (array.ndim != len(shape) or any(
            wanted not in (None, n) for wanted, n in zip(shape, array.shape))):
        wanted = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ")"
        example = example or "(0, 1)" * (tuple(shape) == (2,))
        raise InputError(f"{name} must have shape {wanted}{example and f', as {example}'}, got "
                         f"{array.shape}: {shown(given)}")
    finite = np.isfinite(array)
    if not finite.all():
        raise InputError(f"{name} has a value that is NaN or infinite: {array[~finite][0]}")
    return array


#: Largest coordinate, and the inverse of the smallest: their squares must not overflow.
FARTHEST = 1e100


def require_moderate(name: str, array: Array) -> float:
    """The largest magnitude of coordinates of which squares and products do not overflow."""
    largest = float(np.abs(array).max(initial=0.0))
    refuse(largest > FARTHEST or 0.0 < largest < 1.0 / FARTHEST, "{} must have coordinates between "
           "{:g} and {:g}, got {:g}", name, 1.0 / FARTHEST, FARTHEST, largest)
    return largest


def require_direction(name: str, value: Any) -> Array:
    """A vector (2,) that is not zero."""
    vector = require_finite(name, value, (2,))
    refuse(not vector.any(), "{} must not be zero, got {!r}: give a vector, as (0, 1)", name, value)
    return vector


def require_increasing(name: str, values: Any) -> Array:
    """Finite numbers (n,), n >= 1, each larger than the one before."""
    array = require_finite(name, values, (None,))
    refuse(not len(array) or (array[1:] <= array[:-1]).any(),
           "{} must be numbers that increase, at least one, got {!r}", name, values)
    return array


def require_point(point: Any) -> Array:
    """A material point as an array (2,); else MeshError."""
    if isinstance(point, (list, tuple, np.ndarray)) and len(point) == 2 and (
            _NUMBERS.issuperset(map(type, point)) or not any(
                isinstance(x, (list, tuple, str, bytes, bool, np.bool_)) or np.ndim(x)
                for x in point)):
        return require_finite("a material point", point, (2,))
    raise MeshError("a material point has two coordinates (x, y) in the reference configuration, "
                    f"or is the name of an end, as 'right', got {shown(point)}")


_PLAIN = {*_NUMBERS, str, bool, np.int64, type(None)}


def is_masked(value: object) -> bool:
    """True for an array with masked values, or a list or dict with one."""
    if isinstance(value, np.ma.MaskedArray):
        return bool(np.ma.is_masked(value))
    if isinstance(value, dict):
        value = tuple(value.values())
    if not isinstance(value, (list, tuple)):
        return False
    kinds = set(map(type, value))
    if kinds <= {list, tuple}:  # all levels at once
        return bool(kinds) and is_masked([*chain.from_iterable(value)])
    return not kinds <= _PLAIN and any(map(is_masked, value))


def require_unmasked(name: str, value: Any) -> None:
    """Raise InputError for masked values."""
    refuse(is_masked(value), "{} has masked values: remove them with numpy.ma.compressed, or "
           "replace them with numpy.ma.filled", name)


def along(function: Callable[[float], Any]) -> list[Array]:
    """Values of a function at -1, 0 and 1, for :func:`require_slope`."""
    return [np.asarray(function(s)) for s in (-1.0, 0.0, 1.0)]


def require_slope(what: str, of: str, values: Sequence[Any] | Callable[[float], Any], slope: Any,
                  noise: float | None = None, else_: str = "") -> None:
    """Raise InputError unless ``slope`` is the derivative of a function, or of its values."""
    # ``what`` and ``of`` are names of derivative and function; ``noise`` is the round-off of a
    # difference. Values are those of :func:`along`.
    if callable(values):
        values = along(values)
    change, slope = np.ravel(values[2] - values[0]), 2.0 * np.ravel(slope)
    off = np.abs(change - slope)
    if noise is None:
        noise = 1e-12 * np.max(np.abs(values[1]), initial=0.0)
    if not np.max(off, initial=0.0) <= 0.01 * np.max(np.abs([change, slope])) + noise:  # or NaN
        k = np.argmax(off)
        raise InputError(f"{what} is not the derivative of {of}: over a small step it gives "
                         f"{slope[k]:.6g}, but the change is {change[k]:.6g}{else_}")


# names and flags

def require_option(kind: str, name: object, known: Iterable[str]) -> str:
    """A known name, or :class:`NameUnknown`."""
    if not isinstance(name, str) or name not in known:
        raise NameUnknown(kind, name, known)
    return name


def require_names(kind: str, names: Any, known: Iterable[str]) -> tuple[str, ...]:
    """One or several known names as a tuple; ``kind`` is in the singular."""
    if isinstance(names, str):
        names = (names,)
    if not isinstance(names, (tuple, list, set, frozenset, np.ndarray)) or (
            getattr(names, "ndim", 1) != 1):
        raise InputError(f"{kind}s are named by a text or a list of texts, got {shown(names)}")
    return tuple([name if type(name) is str and name in known else
                  require_option(kind, name, known) for name in names])


def require_text(name: str, value: Any) -> Any:
    """A text that can be encoded, or None."""
    try:
        if value is not None:
            str.encode(value)
    except (TypeError, UnicodeEncodeError):  # the latter for lone surrogates
        raise InputError(f"{name} must be a text, or None for none, got {shown(value)}") from None
    return value


def require_label(name: str, value: object) -> str | None:
    """As :func:`require_text`, but not empty."""
    if isinstance(value, str) and not value:
        raise InputError(f"{name} must be a text, or None for none, got ''")
    return require_text(name, value)


def require_flag(name: str, value: object) -> bool:
    """True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} must be True or False, got {shown(value)}")
    return bool(value)


def require_like(name: str, value: Any, kind: str, *attributes: str) -> Any:
    """An instance with these attributes; ``kind`` is its name in the message."""
    if isinstance(value, type) or not all(hasattr(value, a) for a in attributes):
        raise InputError(f"{name} must be a {kind}, got {shown(value)}")
    return value


def require_kind(name: str, value: Any, kind: type[_T], hint: str = "") -> _T:
    """An instance of a class; ``hint`` follows its name in the message, as ", or None"."""
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        raise InputError(f"{name} must be {article} {kind.__name__}{hint}, got {shown(value)}")
    return value


def require_options(what: str, options: dict[str, Any], known: Iterable[str],
                    hint: str = "") -> dict[str, Any]:
    """Keywords that are all known, or :class:`CallError` with a ``hint``."""
    for name in options:
        if name not in known:
            raise CallError(f"{what} has no option {name!r}; known: "
                            f"{', '.join(map(repr, known))}{_suggested(name, known)}{hint}")
    return options


def require_path(name: str, value: Any, suffixes: Sequence[str] = ()) -> Path:
    """A file name as a ``Path``, with one of the suffixes in any case."""
    try:
        path = Path(value)
        if not os.fspath(value) or b"\0" in os.fsencode(path):
            raise ValueError
    except (TypeError, ValueError):  # UnicodeEncodeError too, for lone surrogates
        raise InputError(f"{name} must be the path of a file, got {shown(value)}") from None
    refuse(suffixes and path.suffix.lower() not in suffixes, "the file name must end with {}{}, "
           "got {!r}", "one of " * (len(suffixes) > 1), ", ".join(suffixes), str(value))
    return path


# users' functions

def require_function(name: str, value: Any, returns: str) -> Callable[..., Any]:
    """A callable; ``returns`` is a phrase such as "of time that returns a number"."""
    refuse(not callable(value), "{} must be a function {}, got {!r}", name, returns, value)
    return value


@contextlib.contextmanager
def warnings_as_errors(category: type[Warning] = Warning) -> Iterator[None]:
    """Raise warnings of a category as errors, in one thread at a time."""
    with _FILTERS, warnings.catch_warnings():
        warnings.simplefilter("error", category)
        yield


@contextlib.contextmanager
def explained(what: str, hint: str, kind: type[AncfError], *of: Any) -> Iterator[None]:
    """Convert any exception of the block to the error ``kind`` with a hint."""
    # ``what`` is formatted with ``of``. Errors of the package pass unchanged.
    try:
        yield
    except AncfError:
        raise
    except Exception as error:
        raise kind(f"{what.format(*of)}: {type(error).__name__}: {error}; {hint}") from error


@contextlib.contextmanager
def retold(kinds: Any, message: str, *values: Any, error: type[AncfError] = InputError
           ) -> Iterator[None]:
    """As :func:`refuse` for errors of some kinds in the block, whose text is ``{error}``."""
    try:
        yield
    except FileError:  # an OSError that says it already
        raise
    except kinds as found:
        raise error(message.format(*map(_Shown, values), error=found)) from None


def ask(what: str, function: Callable[..., Any], *args: Any) -> Any:
    """Call a user's function; its exceptions become :class:`CallbackError`."""
    # ``what`` describes the call, as "amplitude(t={:g})", and is formatted with the arguments.
    # Errors of the package pass unchanged.
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
    """As :func:`ask`, for a finite array; with ``number`` a scalar is broadcast."""
    value = ask(what, function, *args)
    if number and np.ndim(value) == 0:
        value = np.broadcast_to(value, shape)  # type: ignore[arg-type]
    return _returned(require_finite, what, value, args, shape)


def ask_field(what: str, function: Callable[[Array], Any], x: Array) -> Array:
    """As :func:`ask`, for a vector field at points (2, ...) with constant or array components."""
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

#: Files of the package, and contextlib, which occurs between their frames.
_WITHIN = str(Path(__file__).resolve().parents[1]) + os.sep, contextlib.__file__


def warn(message: str, category: type[Warning]) -> None:
    """Give a warning that points to the user's line."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_WITHIN):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, category, stacklevel=level)


#: Attributes, each with its names in other packages. What only a state has, a scene has solved.
SYNONYMS = """
solve_static solve run_static static equilibrium analyze analyse analysis newton nonlinear;
run quasi_static quasistatic solve_steps steps; buckling buckle critical_load critical_loads;
integrate simulate simulation transient dynamic dynamics solve_dynamic time_history evolve;
modes eigenvalues eigenfrequencies eigenmodes frequencies natural_frequencies modal eig;
continuation arc_length arclength riks path equilibrium_path; refined subdivide; plot draw show;
point_force force forces add_force point_load nodal_force nodal_load concentrated_force;
line_load distributed_load distributed_force uniform_load q; moment torque end_moment point_moment;
gravity self_weight weight body_force acceleration; add add_load add_support add_joint add_spring;
clamp fixed fixed_support support encastre built_in fix_end boundary_condition bc;
pin pinned support simply_supported; fix support roller constrain constraint dirichlet bc;
hinge pin_joint revolute revolute_joint; weld connect rigid_joint fixed_joint glue join;
obstacle contact wall ground; replace(loads=...) load_case load_cases with_loads set_loads;
replace(beams=...) with_beams; sensors.to_csv to_csv csv write_csv save_csv; t time times;
to_xarray to_pandas to_dataframe dataset; animate film movie video gif; draw plot show;
frequencies omega omegas eigenfrequencies natural_frequencies; shapes eigenvectors modeshapes;
load load_factor load_factors lambdas; p nodes points coordinates vertices;
solve_static().plot plot_deformed plot_displacement plot_stress plot_strain draw_deformed;
solve_static().displacement displacement displacements deflection deflections u disp;
solve_static().stress stress stresses sigma; solve_static().strain strain strains;
solve_static().field field von_mises; solve_static().save save export write to_vtk to_vtu;
solve_static().reactions reactions reaction support_forces support_reactions forces;
solve_static().resultants resultants section_forces internal_forces bending_moment normal_force
shear_force n q m"""


class NearMisses:
    """Base class whose AttributeError suggests attributes for synonyms."""

    if not TYPE_CHECKING:  # type checkers must see the real attributes only
        def __getattr__(self, name):
            if hasattr(type(self), name):  # a property failed: raise its error
                return object.__getattribute__(self, name)
            there = [] if name.startswith("_") else [x for x in dir(self) if not x.startswith("_")]
            table = map(str.split, SYNONYMS.split(";"))
            meant = [key for key, *words in table if name.lower() in words]
            known = [x for key in meant for x in (key, key.removeprefix("solve_static()."))
                     if re.split(r"\W", x)[0] in there]
            found = [*dict.fromkeys(known)] or difflib.get_close_matches(name, there, 3, 0.6)
            # without name=, else Python adds its own suggestion
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}" + (
                f"; did you mean {' or '.join(found[:3])}?" if found else ""), name=None, obj=None)


#: Up to this number of times a function is called one by one.
FEW = 8


def sample(function: Callable[[Any], Any], times: ArrayLike, name: str = "function",
           shape: tuple[int, ...] | None = None) -> Array:
    """Evaluate a function of time at times (n,), shape (n,) + shape of its value."""
    # If the function accepts arrays, it is called once. This is checked at the first, the middle
    # and the last time. ``shape`` is the expected shape of a value, None for any.
    require_function(name, function, "of time")
    times = require_finite("times", times, (None,))

    def alone(some: Array) -> Array:
        with contextlib.suppress(Exception):  # a message for one call is made below
            found = [function(t) for t in some.tolist()]
            if {*map(type, found)} <= {float, int, np.float64, np.ndarray}:
                values = np.array(found)
                if (values.dtype.kind in "fi" and np.isfinite(values).all()
                        and shape in (None, values.shape[1:])):
                    return values.astype(float, copy=False)
        return np.array([ask_array(name + "(t={:g})", shape, function, t) for t in some.tolist()])

    n = len(times)
    some = [0, n // 2, n - 1]
    if n <= FEW:
        return alone(times)
    with contextlib.suppress(Exception):  # the function does not accept arrays
        values = np.asarray(function(times), dtype=float)
        values = values if values.ndim == 1 else np.moveaxis(values, -1, 0)
        few = alone(times[some])
        size = np.abs(few)
        if values.shape == (n,) + few.shape[1:] and np.isfinite(values).all() and (
                np.abs(values[some] - few) <= 1e-13 * size + 1e-15 * size.max(initial=0.0)).all():
            return values
    return alone(times)
