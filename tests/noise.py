"""Noise of a few units in the last place, where processors differ: ``pytest --noise SEED``.

Another BLAS, another compiler and other vector instructions change results in the last digits. The
functions of :data:`SEAMS` are replaced, in NumPy and in compiled code, by ones whose arguments or
results are changed by -2 to 2 ulp. The bits of a number and the seed decide by how much, so that
equal calls have equal results. Zeros and numbers that are not finite stay.

``python tests/noise.py SEED`` compiles everything with noise, for all processes to load.
"""

import hashlib
import inspect
import sys
from functools import wraps
from importlib import import_module
from pathlib import Path

import numpy as np
import scipy.sparse.linalg

#: Modules of NumPy and of compiled code; function or method; what is changed before and after it.
SEAMS = [
    # rows, forces and tangents of elements
    ("beam.kernels.elements", None, "Elements.rows", [], ["out"]),
    ("beam.kernels.elements", None, "Elements.add", ["F"], []),
    ("beam.kernels.elements", None, "Elements.add_to_band", ["K"], []),
    (None, "beam.kernels.blocks", "to_rows", [], ["d"]),
    (None, "beam.kernels.blocks", "add_to_nodes", ["F"], []),
    (None, "beam.kernels.blocks", "add_to_band", ["K", "Z"], []),
    # entries of bands, and solutions
    ("core.band", "core.loops", "factorize", ["A.flat"], []),
    ("core.band", "core.loops", "solve", [], ["x"]),
    ("core.band", "core.loops", "solve_dependent", ["S"], ["b"]),
    ("core.band", "core.loops", "factorize_complex", ["A"], []),
    ("core.band", "core.loops", "solve_columns", [], ["x"]),
]
#: Functions of LAPACK whose matrix, or whose solution, is changed where this module calls them.
LAPACK = "core.band", ["dpbtrf", "dgbtrf"], ["dgbtrs"]

ODD, EXPONENT = 0x9E3779B97F4A7C15, 0x7FF


def install(seed):
    """Change the package in this process, once, before anything is compiled."""
    shake = for_arrays(_key(seed))
    for arrays, _, name, before, after in SEAMS:
        if arrays is not None:
            _replace(arrays, name, _shaken(shake, before, after))
    linalg, matrices, solutions = LAPACK
    _replace(linalg, "lapack", lambda lapack: _Lapack(lapack, shake, matrices, solutions))
    solve, splu = np.linalg.solve, scipy.sparse.linalg.splu
    np.linalg.solve = wraps(solve)(lambda a, b: shake(solve(a, b)))
    scipy.sparse.linalg.splu = wraps(splu)(lambda *args, **options: _Factors(
        splu(*args, **options), shake))
    _everywhere(splu, scipy.sparse.linalg.splu)
    from skfem_ancf.core.code_cache import compiled_off

    if compiled_off() is None:
        _install_loops(seed)


def _install_loops(seed):
    """The same for compiled code, which is cached under a key of its own."""
    from skfem_ancf.core import jit
    from skfem_ancf.core.source import source

    own = hashlib.sha256(Path(__file__).read_bytes() + str(seed).encode()).hexdigest()[:16]
    _replace("core.code_cache", "key", lambda key: lambda: f"{own[:8]}{key()[:8]}")
    shake = source(for_loops(_key(seed)))
    assert not jit._registered
    for _, loops, name, before, after in SEAMS:
        if loops is not None:
            _replace(loops, name, _shaken(shake, before, after))


def _key(seed):
    return int.from_bytes(hashlib.sha256(str(seed).encode()).digest()[:8], "big")


def for_arrays(key):
    """A function that changes an array of floats or complex numbers in place and returns it."""
    key, odd, five, two = (np.uint64(k) for k in (key, ODD, 5, 2))
    low, high, shift, last = (np.uint64(k) for k in (40, 24, 52, EXPONENT))

    def shake(x):
        x = np.asarray(x)
        flat = x.reshape(-1) if x.flags.c_contiguous else x.T.reshape(-1) if (
            x.flags.f_contiguous) else x.copy().reshape(-1)
        bits = flat.view(np.uint64)
        size = bits >> shift & last
        some = (size > 0) & (size < last)
        bits += np.where(some, (((bits ^ key) * odd >> low) * five >> high) - two, np.uint64(0))
        if not np.shares_memory(flat, x):
            x[...] = flat.reshape(x.shape)
        return x

    return shake


def for_loops(key):
    """The same for Numba."""
    key, odd, five, two = (np.uint64(k) for k in (key, ODD, 5, 2))
    low, high, shift, last = (np.uint64(k) for k in (40, 24, 52, EXPONENT))

    def shake(x):
        bits = x.reshape(x.size).view(np.uint64)
        for k in range(bits.size):
            size = bits[k] >> shift & last
            if size > 0 and size < last:
                bits[k] += (((bits[k] ^ key) * odd >> low) * five >> high) - two

    return shake


def _shaken(shake, before, after):
    """A maker of functions that change arguments before, and arguments or results after a call."""
    def of(original):
        names = ", ".join(inspect.signature(original).parameters)
        lines = [f"def {original.__name__}({names}):", *(f"shake({x})" for x in before),
                 f"out = original({names})", *(f"shake({x})" for x in after), "return out"]
        space = {"original": original, "shake": shake, "__name__": original.__module__}
        exec("\n    ".join(lines), space)  # plain text, for Numba
        return space[original.__name__]

    return of


def _replace(module, name, make):
    """Replace a name of a module of the package, wherever it has been imported, or a method."""
    from skfem_ancf.core.source import MARKED

    home = import_module(f"skfem_ancf.{module}")
    owner, _, name = name.rpartition(".")
    home = getattr(home, owner) if owner else home
    before = getattr(home, name)
    after = make(before)
    if callable(before):
        if before in MARKED or module.endswith("loops"):
            MARKED[after] = MARKED.get(before)
            MARKED[before] = MARKED.get(before)
        _everywhere(before, after)
    setattr(home, name, after)


def _everywhere(before, after):
    for key, module in list(sys.modules.items()):
        if key.partition(".")[0] == "skfem_ancf":
            for name, value in list(vars(module).items()):
                if value is before:
                    setattr(module, name, after)


class _Lapack:
    """LAPACK with other matrices and solutions."""

    def __init__(self, lapack, shake, matrices, solutions):
        self._lapack, self._shake = lapack, shake
        self._matrices, self._solutions = matrices, solutions

    def __getattr__(self, name):
        function, shake = getattr(self._lapack, name), self._shake
        if name in self._matrices:
            return lambda ab, *args, **options: function(shake(ab.copy("F")), *args, **options)
        if name in self._solutions:
            def solve(*args, **options):
                x, info = function(*args, **options)
                return shake(x), info
            return solve
        return function


class _Factors:
    """Factors of SuperLU with other solutions."""

    def __init__(self, factors, shake):
        self._factors, self._shake = factors, shake

    def __getattr__(self, name):
        return getattr(self._factors, name)

    def solve(self, *args, **options):
        return self._shake(self._factors.solve(*args, **options))


def alike(a, b):
    """True if two counts of iterations or factorisations differ by a factor of three at most."""
    return max(a, b) <= 3 * max(min(a, b), 1)


if __name__ == "__main__":
    install(int(sys.argv[1]))
    from skfem_ancf.__main__ import compile_all

    compile_all()
