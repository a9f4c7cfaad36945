"""The noise of ``pytest --noise SEED``: how large it is, where it is, and that it is repeatable."""

import subprocess
import sys
from pathlib import Path

import numpy as np

import noise

KEY = 0x0123456789ABCDEF
NUMBERS = np.array([0.0, -0.0, 1.0, -1.0, np.pi, 1e-300, -3e200, 5e-324, np.inf, -np.inf, np.nan])
SCENE = """
import sys, warnings
import noise
warnings.simplefilter("ignore")
if sys.argv[1] != "none":
    noise.install(int(sys.argv[1]))
from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, Scene, StVenantKirchhoff
mesh = MeshBeam.init_line([0.1 * k for k in range(11)], 0.03)
beam = Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3), width=0.01)
scene = Scene(beam).clamp("left").pin("right").point_force((3.0, -200.0), at=(0.4, 0.0))
print(" ".join(map(float.hex, scene.solve_static().u)))
"""

LOOPS = """
import sys
import noise
if sys.argv[1] != "none":
    noise.install(int(sys.argv[1]))
import numpy as np
from numba import njit
from skfem_ancf.core import band, jit
jit.register()
solve_columns = band.solve_columns
A = np.repeat([2.0, 0.0, 4.0, 0.0], [1, band.SPARE, 1, band.SPARE])
for solve in (solve_columns, njit(lambda A, ld, width, x: solve_columns(A, ld, width, x))):
    x = np.array([0.625, 3.25])
    solve(A, 1 + band.SPARE, 0, x)
    print(*map(repr, map(float, x)))
"""


def steps(a, b):
    """The distance in units in the last place, of numbers of one sign."""
    return a.view(np.int64) - b.view(np.int64)


def test_numbers_change_by_two_units_and_others_stay():
    before = np.random.default_rng(0).normal(size=10000) * 10.0 ** np.arange(10000) ** 0.4
    after = noise.for_arrays(KEY)(before.copy())
    number, times = np.unique(steps(after, before), return_counts=True)
    assert list(number) == [-2, -1, 0, 1, 2] and times.min() > 1800
    special = noise.for_arrays(KEY)(NUMBERS.copy())
    same = ~np.isfinite(NUMBERS) | (np.abs(NUMBERS) < 1e-307)
    assert np.array_equal(special[same], NUMBERS[same], equal_nan=True)


def test_the_noise_is_that_of_the_bits_in_any_layout_and_in_loops():
    x = np.random.default_rng(1).normal(size=(6, 4))
    shake = noise.for_arrays(KEY)
    expected = shake(x.copy())
    assert np.array_equal(shake(x.copy()), expected)
    assert not np.array_equal(noise.for_arrays(KEY + 1)(x.copy()), expected)
    assert np.array_equal(shake(np.asfortranarray(x)), expected)
    wide = np.repeat(x, 2, axis=1)
    shake(wide[:, ::2])  # in place
    assert np.array_equal(wide[:, ::2], expected) and np.array_equal(wide[:, 1::2], x)
    z = shake(x + 1j * x[::-1])
    assert np.array_equal(z.real, expected) and np.array_equal(z.imag, expected[::-1])
    in_loops = x.copy()
    with np.errstate(over="ignore"):
        noise.for_loops(KEY)(in_loops)
    assert np.array_equal(in_loops, expected)


def run(script, *arguments):
    """What a script prints in a process of its own."""
    done = subprocess.run([sys.executable, "-c", script, *arguments], cwd=Path(__file__).parent,
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def test_a_solution_changes_by_round_off_and_repeatably(monkeypatch):
    monkeypatch.setenv("SKFEM_ANCF_COMPILED", "0")
    found = [run(SCENE, seed) for seed in ("none", "1", "2", "1")]
    assert found[1] == found[3] and found[0] != found[1] != found[2]
    plain, *others = np.array([[float.fromhex(x) for x in one] for one in found])
    for other in others:
        np.testing.assert_allclose(other, plain, rtol=0, atol=1e-8 * np.abs(plain).max())


def test_compiled_code_has_the_same_noise(needs_compiled):
    plain, loops = np.array(run(LOOPS, "none")), np.array(run(LOOPS, "3"))
    assert list(plain) == ["0.3125", "0.8125"] * 2
    assert list(loops[:2]) == list(loops[2:]) and (loops[:2] != plain[:2]).all()
