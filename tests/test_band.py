"""Band matrices: products, factors and solutions against dense ones, in NumPy and compiled."""

from functools import partial

import numpy as np
import pytest

from skfem_ancf.core import band
from skfem_ancf.core.code_cache import compiled_off

SIZES = [(1, 0), (2, 1), (3, 2), (4, 1), (5, 3), (7, 6), (9, 8), (30, 2), (31, 5), (102, 11)]


def matrix(n, width, storage, sign):
    """A dense matrix with dominant diagonal, of one or both signs, and its Band."""
    rng, near = np.random.default_rng(n), np.abs(np.subtract.outer(range(n), range(n))) <= width
    D = rng.standard_normal((n, n)) * near
    if storage == "symmetric":
        D = D + D.T
    D += np.diag((3 * width + 4) * np.where(rng.random(n) < 0.3, sign, 1))
    i, j = np.nonzero(np.tril(D) if storage == "symmetric" else D)
    found = band.BandMatrix.zeros(n, width, symmetric=storage == "symmetric")
    found.add(i, j, D[i, j])
    return D, found


def check(storage, sign, multiply, factorize, solve):
    for n, width in SIZES:
        D, A = matrix(n, width, storage, sign)
        x, y = np.random.default_rng(1).standard_normal(n), np.empty(n)
        multiply(A, x, y)
        assert np.allclose(y, D @ x, rtol=0.0, atol=1e-12 * np.abs(D).max())
        assert factorize(A)
        z = x.copy()
        solve(A, z)
        assert np.allclose(z, np.linalg.solve(D, x), rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("storage", ["symmetric", "both"])
def test_bands_are_the_dense_matrices(storage, sign):
    check(storage, sign, band.multiply, band.factorize, band.solve)


@pytest.mark.skipif(compiled_off() is not None, reason="without Numba")
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("storage", ["symmetric", "both"])
def test_compiled_bands_are_the_dense_matrices(storage, sign, compiled):
    check(storage, sign, *compiled)


@pytest.fixture(scope="module")
def compiled():
    from skfem_ancf.core.jit import entry
    from skfem_ancf.core.source import Packed

    x, A = np.zeros(2), matrix(2, 1, "symmetric", 1)[1]
    found = [entry(f, (A, *args)) for f, *args in (
        (band_product, x, x), (band_factors,), (band_solution, x))]

    def called(run, A, *args):
        words = Packed(A)  # lives as long as the call: the kernel gets an address only
        return run(words.address, *args)

    return [partial(called, run) for run in found]


def band_product(A, x, y):
    band.multiply(A, x, y)


def band_factors(A):
    return band.factorize(A)


def band_solution(A, x):
    band.solve(A, x)


def test_a_singular_matrix_has_no_factors():
    _, A = matrix(5, 2, "symmetric", 1)
    A.flat[:] = 0.0
    assert not band.factorize(A)
