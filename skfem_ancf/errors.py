"""The errors of the package: what was wrong, the value, and what to change.

Every error derives from :class:`AncfError`; those about bad input are also
``ValueError``, so existing ``except ValueError`` clauses keep working.
"""

import numpy as np


class AncfError(Exception):
    """Base class of every error raised by :mod:`skfem_ancf`."""


class InputError(AncfError, ValueError):
    """An argument has a value that cannot describe a beam."""


class MeshError(InputError):
    """The mesh, its geometry or a point on it is not valid."""


class NameUnknown(InputError):
    """A boundary, coordinate, formulation or scheme name is not known."""

    def __init__(self, kind, name, known):
        self.kind, self.name, self.known = kind, name, tuple(known)
        super().__init__(
            f"unknown {kind} {name!r}; known: " + ", ".join(map(repr, self.known))
        )


class SupportError(AncfError):
    """The supports leave a rigid motion free, or contradict each other."""


class MissingExtra(AncfError, ImportError):
    """An optional dependency is missing; the message names the extra."""

    def __init__(self, module, extra):
        super().__init__(
            f"this needs the package {module!r}, which is not installed: "
            f'pip install "skfem-ancf[{extra}]"'
        )


class ConvergenceError(AncfError):
    """An iteration did not converge.

    Attributes
    ----------
    state
        The last converged state, or None if there is none.
    """

    def __init__(self, message, state=None):
        super().__init__(message)
        self.state = state


def require_positive(name, value, unit=""):
    """Return ``value`` as a float, or raise :class:`InputError` if it is not > 0."""
    value = require_finite_scalar(name, value)
    if value <= 0.0:
        raise InputError(f"{name} must be positive{unit and f' ({unit})'}, got {value!r}")
    return value


def require_finite_scalar(name, value):
    """Return ``value`` as a float, or raise :class:`InputError` if it is not finite."""
    try:
        value = float(value)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be a number, got {value!r}") from None
    if not np.isfinite(value):
        raise InputError(f"{name} must be finite, got {value!r}")
    return value


def require_finite(name, array, shape=None):
    """Return ``array`` as float64, or raise :class:`InputError`.

    ``shape`` may hold None for a free extent.
    """
    if np.iscomplexobj(array):
        raise InputError(f"{name} must be real, got complex numbers")
    try:
        array = np.asarray(array, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} must be an array of numbers, got {array!r}") from None
    if shape is not None and (
        array.ndim != len(shape)
        or any(n is not None and n != m for n, m in zip(shape, array.shape))
    ):
        wanted = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ")"
        raise InputError(f"{name} must have shape {wanted}, got {array.shape}")
    if not np.all(np.isfinite(array)):
        bad = array[~np.isfinite(array)][0]
        raise InputError(f"{name} has a value that is NaN or infinite: {bad}")
    return array
