"""Immutable objects, how they are copied and pickled, and caches of what is computed from them."""

import functools
import inspect
import sys
from collections.abc import Callable, Sequence
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from skfem.assembly.form.form import Form
from skfem.generic_utils import OrientedBoundary

from .errors import CallError, ImmutableError, refuse, require_option, require_options

# pickles of scikit-fem's objects in attributes of the package's, without changing its classes

class _Packed:
    """A value that pickle restores by a function of arguments."""

    def __init__(self, value: Any, *recipe: Any) -> None:
        self.value, self._recipe = value, recipe

    def __reduce__(self) -> Any:
        return self._recipe


def picklable(value: Any) -> Any:
    """A value for pickle: forms by the name that they share with the decorated function."""
    # Pickle takes an OrientedBoundary for a view of an array and loses the orientation.
    if isinstance(value, Form):
        module, name = (getattr(value.form, x, None) for x in ("__module__", "__qualname__"))
        if getattr(sys.modules.get(str(module)), str(name), None) is value:
            return _Packed(value, resolve_name, (f"{module}:{name}",))
    elif isinstance(value, OrientedBoundary):
        return _Packed(value, OrientedBoundary, (np.asarray(value), value.ori))
    elif type(value) in (tuple, list):
        return type(value)(map(picklable, value))
    elif type(value) is dict:
        return {name: picklable(one) for name, one in value.items()}
    return value


def unpacked(value: Any) -> Any:
    """The value of :func:`picklable`, in a copy without pickle."""
    if type(value) in (tuple, list):
        return type(value)(map(unpacked, value))
    if type(value) is dict:
        return {name: unpacked(one) for name, one in value.items()}
    return value.value if isinstance(value, _Packed) else value


# whether a class or function belongs to the package

def is_builtin(thing: Any) -> bool:
    """True if a function, or the class of an object, is defined in this package."""
    named = thing if isinstance(getattr(thing, "__qualname__", None), str) else type(thing)
    return str(named.__module__).partition(".")[0] == __package__.partition(".")[0]


T = TypeVar("T")


def read_only(value: T) -> T:
    """The value; a writable array is replaced by a read-only copy."""
    if not isinstance(value, np.ndarray) or not value.flags.writeable:
        return value
    array = value.copy()
    array.flags.writeable = False
    return array


class _Freezing(type):
    """Freezes an object after the constructor, also of a user's subclass."""

    def __init__(cls, *arguments):
        super().__init__(*arguments)
        #: names of cached properties
        cls._derived = {name for one in cls.__mro__ for name, value in vars(one).items()
                        if isinstance(value, functools.cached_property)}

    def __call__(cls, *args, **kwargs):
        try:
            made = super().__call__(*args, **kwargs)
        except TypeError:
            call = cls.__signature__
            arguments = call.parameters.values()
            known = [*kwargs] * any(a.kind == a.VAR_KEYWORD for a in arguments)
            try:  # Python's error does not name the arguments
                require_options(cls.__name__, kwargs, known + [a.name for a in arguments])
                call.bind(*args, **kwargs)
            except CallError as better:
                raise better from None
            except TypeError as why:
                needed = [a.name for a in arguments if a.default is a.empty and a.kind not in (
                    a.VAR_KEYWORD, a.VAR_POSITIONAL)]
                more = ["..."] * (len(needed) < len(arguments))
                raise CallError(f"{cls.__name__}({', '.join(needed + more)}): {why}") from None
            raise
        made._freeze()
        return made

    @property
    def __signature__(cls) -> inspect.Signature:
        """The signature of the constructor, for ``help`` and :func:`rebuilt`."""
        arguments = inspect.signature(cls.__init__).parameters.values()  # type: ignore[misc]
        return inspect.Signature(list(arguments)[1:])


class Immutable(metaclass=_Freezing):
    """Base class of descriptions, whose public attributes only constructors set. Arrays become
    read-only. Private attributes and cached properties, which are not pickled, may be set later."""

    _frozen = False

    def _freeze(self):
        attributes = self.__dict__
        for name, value in attributes.items():
            if np.ndarray in type(value).__mro__ and value.flags.writeable:
                attributes[name] = value = value.copy()
                value.flags.writeable = False
        attributes["_frozen"] = True

    def _thawed(self):
        """A copy whose attributes can be set until ``_freeze``."""
        other = object.__new__(type(self))
        vars(other).update(self._attributes(), _frozen=False)
        return other

    def _require_thawed(self, name):
        if not name.startswith("_"):
            instead = (f"use replace({name}=...), which returns a changed copy"
                       if hasattr(self, "replace") else "make a new one")
            raise ImmutableError(f"a {type(self).__name__} does not change, and {name!r} cannot be "
                                 f"set: {instead}")

    def __setattr__(self, name, value):
        if self._frozen:
            self._require_thawed(name)
        object.__setattr__(self, name, value)

    def __delattr__(self, name):
        if self._frozen:
            self._require_thawed(name)
        object.__delattr__(self, name)

    def _attributes(self):
        derived = type(self)._derived
        return {name: value for name, value in vars(self).items() if name not in derived}

    def __getstate__(self):
        return picklable(self._attributes())

    def __setstate__(self, state):
        vars(self).update(unpacked(state))
        self._freeze()

    def __deepcopy__(self, memo):
        return self


def rebuilt(thing: T, changes: dict[str, Any], more: Sequence[str] = ()) -> T:
    """A copy with changed arguments; the others are the attributes of the same names."""
    # ``more`` are names that the constructor passes on by ``**kwargs``.
    arguments = inspect.signature(type(thing)).parameters.values()
    names = [a.name for a in arguments if a.kind in (a.POSITIONAL_OR_KEYWORD, a.KEYWORD_ONLY)]
    several = [a for a in arguments if a.kind in (a.VAR_POSITIONAL, a.VAR_KEYWORD)
               and isinstance(getattr(thing, a.name, None), (tuple, dict))]
    if any(a.kind == a.VAR_KEYWORD for a in arguments):
        names += [name for name in more if name not in names]
    known = names + [a.name for a in several]
    for name in changes:
        require_option(f"argument of {type(thing).__name__}", name, known)
    if several:  # the constructor takes *parts or **sizes, and stores them
        given = {a.kind: changes.get(a.name, getattr(thing, a.name)) for a in several}
        others = {name: changes.get(name, getattr(thing, name, None)) for name in names
                  if name in changes or hasattr(thing, name)}
        return type(thing)(*given.get(inspect.Parameter.VAR_POSITIONAL, ()), **others, **given.get(
            inspect.Parameter.VAR_KEYWORD, {}))
    missing = [name for name in names if name not in changes and not hasattr(thing, name)]
    refuse(missing, "{!r} does not store its argument {[0]!r}: store it as an attribute of that "
           "name, or pass it to replace", thing, missing)
    return type(thing)(**{name: getattr(thing, name) for name in names if name not in changes},
                       **changes)


Function = TypeVar("Function", bound=Callable[..., Any])


if TYPE_CHECKING:
    from functools import cached_property
else:
    class cached_property(functools.cached_property):
        """As of Python 3.12: without the lock for all objects, at which other threads wait."""

        def __get__(self, instance, owner=None):
            if instance is None:
                return self
            value = instance.__dict__[self.attrname] = self.func(instance)
            return value


class _ArrayKey(NamedTuple):
    shape: tuple[int, ...]
    dtype: str
    values: bytes


def array_cache(maxsize: int) -> Callable[[Function], Function]:
    """``functools.lru_cache`` for functions of arrays; results must be read-only."""
    def decorate(function: Function) -> Any:
        @functools.lru_cache(maxsize)
        def of_keys(*keys: Any) -> Any:
            return function(*(np.ndarray(k.shape, k.dtype, k.values).copy()
                              if isinstance(k, _ArrayKey) else k for k in keys))

        @functools.wraps(function)
        def cached(*args: Any) -> Any:
            return of_keys(*(_ArrayKey(a.shape, a.dtype.str, a.tobytes())
                             if isinstance(a, np.ndarray) else a for a in args))

        return cached

    return decorate
