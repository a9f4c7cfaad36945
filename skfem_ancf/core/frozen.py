"""Objects that stay as they were made."""

from __future__ import annotations

import inspect
from copy import copy
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import ImmutableError, InputError, NameUnknown
from .kept import cached_property, twin_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .types import Array


def read_only(array: Array) -> Array:
    """The array, not writeable; a copy of it where it is."""
    if array.flags.writeable:
        array = array.copy()
        array.flags.writeable = False
    return array


class _Sealing(type):
    """Seals what its classes make, once the outermost constructor is done."""

    def __call__(cls, *args, **kwargs):
        made = super().__call__(*args, **kwargs)
        made._seal()
        return made

    @property
    def __signature__(cls) -> inspect.Signature:
        """The arguments of the constructor, for ``help``: not those of ``__call__``."""
        arguments = inspect.signature(cls.__init__)  # type: ignore[misc]
        return arguments.replace(parameters=list(arguments.parameters.values())[1:],
                                 return_annotation=inspect.Signature.empty)


class Sealable:
    """Base class of objects whose public attributes do not change once they are sealed."""

    _sealed = False

    def _seal(self):
        vars(self)["_sealed"] = True

    def __setattr__(self, name, value):
        if self._sealed:
            self._require_open(name)
        object.__setattr__(self, name, value)

    def __delattr__(self, name):
        self._require_open(name)
        super().__delattr__(name)

    def _require_open(self, name):
        if not self._sealed or name.startswith("_"):
            return
        instead = "make a new one"
        if hasattr(self, "replace"):
            instead = f"use replace({name}=...), which returns a changed copy"
        raise ImmutableError(f"a {type(self).__name__} does not change, and {name!r} cannot be "
                             f"set: {instead}")

    def _unsealed(self):
        """A copy that may be changed."""
        other = copy(self) if hasattr(self, "__slots__") else twin_of(self)
        vars(other)["_sealed"] = False
        return other


class Frozen(Sealable, metaclass=_Sealing):
    """Base class of objects whose public attributes and arrays do not change.

    A solution keeps what it has computed of them, so a change would be ignored in part. Caches,
    with names that begin with an underscore, may be set.
    """

    def _seal(self):
        attributes = vars(self)
        for name, value in attributes.items():
            if isinstance(value, np.ndarray):
                attributes[name] = read_only(value)
        super()._seal()

    def __copy__(self):
        return self

    def __deepcopy__(self, memo):
        return self

    def __getstate__(self):
        """What was given; what is computed from it is computed again."""
        return {name: value for name, value in vars(self).items()
                if not isinstance(getattr(type(self), name, None), cached_property)}

    def __setstate__(self, state):
        vars(self).update(state)
        self._seal()


class Content:
    """Arrays as the key of a cache: equal where they have the same numbers."""

    def __init__(self, *arrays: Array) -> None:
        self.arrays = arrays
        self._key = tuple((x.shape, x.dtype.char, x.tobytes()) for x in arrays)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Content) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


class ReadOnlyDict(dict):
    """A dictionary of arrays that does not change.

    Parameters
    ----------
    *args, **kwargs
        What ``dict`` takes.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        for name, value in self.items():
            if isinstance(value, np.ndarray):
                super().__setitem__(name, read_only(value))

    def _refuse(self, *args, **kwargs):
        raise ImmutableError("the names of a mesh do not change: use mesh.with_boundaries or "
                             "mesh.with_subdomains, which return a mesh with other names")

    __setitem__ = __delitem__ = pop = popitem = clear = update = setdefault = __ior__ = _refuse

    def __reduce__(self):
        # arrays of a class of their own lose their attributes: orientations are kept beside them
        plain = {name: np.asarray(value) for name, value in self.items()}
        more = {name: (type(value), vars(value)) for name, value in self.items()
                if type(value) is not np.ndarray}
        return _read_only_dict, (plain, more)

    def __copy__(self):
        return self

    def __deepcopy__(self, memo):
        return self


def _read_only_dict(plain, more):
    for name, (kind, attributes) in more.items():
        plain[name] = plain[name].view(kind)
        vars(plain[name]).update(attributes)
    return ReadOnlyDict(plain)


@lru_cache(256)
def _arguments(constructor, more):
    """Names of its arguments; those of ``more`` are taken by ``**kwargs``."""
    kinds = inspect.Parameter
    parameters = inspect.signature(constructor).parameters.values()
    names = [p.name for p in list(parameters)[1:] if p.kind not in (
        kinds.VAR_KEYWORD, kinds.VAR_POSITIONAL)]
    if any(p.kind == kinds.VAR_KEYWORD for p in parameters):
        names += [name for name in more if name not in names]
    return names


def rebuilt(thing: Any, changes: dict[str, Any], more: Sequence[str] = ()) -> Any:
    """An object made as ``thing`` was, with some arguments of its constructor changed.

    Parameters
    ----------
    thing
        Arguments that are not changed are those of its attributes that have their names.
    changes
        From the names of arguments to their values.
    more
        Names of attributes that ``**kwargs`` of the constructor take.

    Raises
    ------
    NameUnknown
        If an argument is not known.
    InputError
        If the object does not know the argument it was made with.
    """
    names = _arguments(type(thing).__init__, tuple(more))
    for name in changes:
        if name not in names:
            raise NameUnknown(f"argument of {type(thing).__name__}", name, names)
    given = dict(changes)
    for name in names:
        if name not in given:
            given[name] = getattr(thing, name, _MISSING)
            if given[name] is _MISSING:
                raise InputError(
                    f"{thing!r} does not keep the argument {name!r} it was made with: keep it as "
                    "an attribute of that name, or give it to replace")
    return type(thing)(**given)


_MISSING = object()
