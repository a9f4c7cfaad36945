"""How texts are compiled."""

from numba.core import compiler
from numba.core.registry import cpu_target


class Known(compiler.Flags):
    """Flags that stay as they are: Numba asks for their hash at each call that it types."""

    __slots__ = ()
    _HASH = hash(compiler.Flags())

    def __hash__(self):
        return self._HASH

    def __eq__(self, other):
        return self is other

    def copy(self):
        return compiler.Flags(self)


class KnownOfOthers(Known):
    """Those of texts of others, in which -1 may be the last number of an array."""

    __slots__ = ()


class TextFlags(compiler.Flags):
    """Numba's flags for texts: each is compiled with the same copy of them.

    Parameters
    ----------
    options
        Those of ``numba.njit``.
    counts
        Whether owners of arrays are counted.
    kind
        Known, or KnownOfOthers.
    """

    __slots__ = "counts", "known"

    def __init__(self, options, counts, kind):
        super().__init__()
        cpu_target.options.parse_as_flags(self, {"nopython": True, **options})
        self.nrt, self.counts = True, counts
        self.no_compile = self.no_cpython_wrapper = self.no_cfunc_wrapper = True
        self.known = kind(self)

    def copy(self):
        return self.known
