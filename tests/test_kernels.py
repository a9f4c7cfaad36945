"""Kernels: every kind, law and mesh, plain and compiled, against derivatives of the energy."""

from functools import partial

import numpy as np
import pytest

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        NeoHookean, Scene, StVenantKirchhoff)
from skfem_ancf.beam.kernels import CableKernel, SectionKernel, elements, loops, tables
from skfem_ancf.beam.kernels.compiled import compiled_tables
from skfem_ancf.beam.kernels.elements import Elements
from skfem_ancf.core.code_cache import compiled_off
from skfem_ancf.equations import evaluation
from skfem_ancf.formulations import get_formulation
from skfem_ancf.materials import Material
from skfem_ancf.sections import Across, Rectangle

STEP = 1e-30


class Soft(Material):
    """A law of one's own: S = D eps + c eps^3, by component."""

    def energy(self, strain):
        return StVenantKirchhoff(self.E, self.nu).energy(strain) + 0.25e3 * self.E * np.sum(
            strain**4, axis=0)

    def stress(self, strain):
        return StVenantKirchhoff(self.E, self.nu).stress(strain) + 1e3 * self.E * strain**3


LAWS = {"linear": StVenantKirchhoff, "neo-hookean": NeoHookean, "own": Soft}
MESHES = {
    "uniform": lambda: MeshBeam.init_line(np.linspace(0, 1, 41), height=0.05),
    "one": lambda: MeshBeam.init_line([0, 1], height=0.05),
    "graded": lambda: MeshBeam.init_line(np.linspace(0, 1, 8) ** 1.5, height=0.05),
    "curved": lambda: MeshBeam.init_curve(lambda t: np.array([np.sin(t), 1 - np.cos(t)]),
                                          np.linspace(0, 1.5, 36), height=0.05)}
KINDS = {
    **{f"section-{k}": (SectionKernel, lambda: ElementBeamANCF(2), formulation, name)
       for k, (formulation, name) in {
           "linear": ("assumed", "linear"), "neo": ("assumed", "neo-hookean"),
           "own": ("continuum", "own"), "split": ("strain-split", "linear")}.items()},
    "section-cubic": (SectionKernel, lambda: ElementBeamANCFCubic(2), "assumed", "linear"),
    "section-corrected": (SectionKernel, lambda: ElementBeamANCF(1), "assumed", "neo-hookean"),
    "section-shear": (SectionKernel, lambda: ElementBeamANCF(1), "continuum", "own"),
    "cable-3": (CableKernel, lambda: ElementBeamCable(3), "assumed", "linear"),
    "cable-5": (CableKernel, lambda: ElementBeamCable(5), "assumed", "linear")}


def kernel(kind, mesh):
    cls, element, formulation, name = KINDS[kind]
    mesh, element = MESHES[mesh](), element()
    mesh = mesh if mesh.is_straight else mesh.with_sections(element.sections)
    across = Across(mesh, element, Rectangle(0.02), LAWS[name](2e5, 0.3))
    return cls(across, get_formulation(formulation))


def states(k, size=2e-3):
    rng = np.random.default_rng(1)
    u = size * rng.standard_normal(k.N)
    return u, u + size * rng.standard_normal(k.N)


def close(a, b, tol=1e-11):
    size = np.max(np.abs(b))
    assert np.max(np.abs(a - b)) <= tol * size, np.max(np.abs(a - b)) / size


every = pytest.mark.parametrize("mesh", MESHES)
kinds = pytest.mark.parametrize("kind", KINDS)


def dense(k, tangents):
    K = np.zeros((k.N, k.N))
    for start, block in zip(k.t[0] * k.nd, tangents):
        K[start:start + 2 * k.nd, start:start + 2 * k.nd] += block
    return K


def system_of(kind, mesh):
    _, element, formulation, name = KINDS[kind]
    return Scene(Beam(MESHES[mesh](), element(), LAWS[name](2e5, 0.3), 0.02, formulation)).system


@kinds
@every
def test_force_and_tangent_are_derivatives_of_the_energy(kind, mesh):
    k = kernel(kind, mesh)
    u, v = states(k)
    d = v - u
    h, tol = 1e-4, 1e-9
    slope = (k.energy(u - 2 * h * d) - 8 * k.energy(u - h * d) + 8 * k.energy(u + h * d)
             - k.energy(u + 2 * h * d)) / (12 * h)
    change = (k.force(u - 2 * h * d) - 8 * k.force(u - h * d) + 8 * k.force(u + h * d)
              - k.force(u + 2 * h * d)) / (12 * h)
    assert abs(k.force(u) @ d - slope) < tol * np.abs(k.force(u)) @ np.abs(d)
    close(dense(k, k.tangents(u)) @ d, change, tol)
    close(k.scatter(k.forces(u)), k.force(u))
    # to first order, for linear theory
    close(np.imag(k.force(u + 1j * STEP * d)) / STEP, change, tol)
    assert abs(np.imag(k.energy(u + 1j * STEP * d)) / STEP - slope) < tol * np.abs(k.force(u)) @ (
        np.abs(d))


@kinds
@every
def test_work_of_the_mean_force_is_the_change_of_the_energy(kind, mesh):
    k = kernel(kind, mesh)
    u, v = states(k)
    f = k.mean_force(u, v)
    work, change = f @ (v - u), k.energy(v) - k.energy(u)
    assert abs(work - change) < 1e-12 * (np.abs(f) @ np.abs(v - u)) + 1e-13 * k.energy(v)


@kinds
@every
def test_a_translation_has_no_force_at_all(kind, mesh):
    k = kernel(kind, mesh)
    u = np.zeros((len(k.scatter(np.zeros((k.t.shape[1], k.nd, 2)))) // k.nd, k.nd))
    u[:, 0], u[:, 1] = 1e3 / 3.0, -7e5 / 3.0
    assert not k.force(u.ravel()).any()
    f = k.force(1e-3 * np.random.default_rng(1).standard_normal(k.N)).reshape(-1, k.nd)
    assert np.max(np.abs(f[:, :2].sum(axis=0))) <= 1e-12 * np.max(np.abs(f[:, :2]))


@kinds
@pytest.mark.parametrize("mesh", ["one", "graded", "curved"])
# the hash of --noise, of whole numbers, which Python warns of and compiled code does not
@pytest.mark.filterwarnings("ignore:overflow encountered in scalar")
def test_loops_are_arrays(kind, mesh):
    """The compiled kernels, run by Python, beside those in NumPy."""
    if mesh == "curved" and kind not in ("section-cubic", "section-neo", "cable-5"):
        pytest.skip("the same code takes long in Python")
    k, none = kernel(kind, mesh), np.zeros(0)
    (u, v), ld = states(k), 4 * k.nd + 6
    stiff = np.abs(k.tangents(u)).max()
    for t in k.tables:
        x, y, ns = Elements(t), compiled_tables(t), len(t.start) * t.pattern.ns
        given = np.sin(np.arange(1.0, ns + 1.0))
        eigen, linear = given, t.law.kind == tables.LINEAR
        if not linear:
            eigen = 1e-3 * np.cos(np.arange(3.0 * t.weights.shape[1] * len(t.start)))
        f, g, A, B, S, T = (np.zeros(n) for n in (k.N, k.N, k.N * ld, k.N * ld, ns, ns))
        for one, *both in (
                ((elements.run_force, u, none, none, none), (f, g)),
                ((elements.run_force, u, none, none), (S, T)),
                ((elements.run_force, u, none, given), (S, T), (f, g)),
                ((elements.run_force, u, none, given, none), (f, g)),
                ((elements.run_force, u, v, none, none), (f, g)),
                ((elements.run_force, u, v, given), (S, T), (f, g)),
                ((elements.run_linearised, u, v, given), (S, T)),
                ((elements.run_linearised, u, v, none, none), (f, g)),
                *(((elements.run_tangent, u, x), (S, T), (f, g), (A, B)) for x in (none, given)),
                ((elements.run_unsymmetric, u, v), (A, B)),
                ((elements.run_eigen_force, u, none, eigen), (f, g)),
                ((elements.run_eigen_force, u, v, eigen), (f, g)),
                ((elements.run_eigen_tangent, u, eigen), (A, B))):
            run = one[0]
            for function, table, place in ((run, x, 0), (getattr(loops, run.__name__), y, 1)):
                for pair in both:
                    pair[place][:] = 0.0
                rest = [ld] * (both[-1][0] is A)
                if run in (elements.run_force, elements.run_linearised) and both[-1][0] is S:
                    rest = [none]  # without forces
                function(table, *one[1:], *(pair[place] for pair in both), *rest)
            for a, b in both:  # forces and tangents of one term of the energy may cancel
                least = stiff if a is A else stiff * np.abs(u).max() if a is f else 0.0
                assert a.any() and np.abs(a - b).max() <= 1e-12 * max(least, np.abs(a).max())


@pytest.mark.skipif(compiled_off() is not None, reason="without Numba")
@pytest.mark.parametrize("kind", [kind for kind in KINDS if KINDS[kind][3] != "own"])  # in NumPy
@every
def test_compiled_is_plain(kind, mesh):
    """All that is asked of kernels, through the functions that are compiled for scenes anyway."""
    system = system_of(kind, mesh)
    tables, n, N = system.backend.tables, len(system.backend.tables.stresses), system.N
    u, v = states(system)
    factors, rng = tables.static_factors(1.0), np.random.default_rng(2)
    cases = [(evaluation.force, (u, 1.0), [N]), (evaluation.mean_force, (u, v, 1.0), [N]),
             (evaluation.linearised, (u, v, rng.standard_normal(n)), [n])]
    cases += [(evaluation.tangent, (u, factors, np.nan, 1.0, 1.0, mixed), [n, n, N])
              for mixed in (False, True)]
    for kernel_, args, sizes in cases:
        start, found = [rng.standard_normal(size) for size in sizes], []
        for run in (partial(kernel_, tables.plain), system.backend.of(kernel_)):
            tables.plain.K.flat[:] = 0.0
            out = [x.copy() for x in start]
            run(*args, *out)
            found.append((*out, tables.plain.K.flat.copy()))
        assert any(np.any(x) for x in found[0])
        for a, b in zip(*found):
            assert np.max(np.abs(a - b)) <= 2e-13 * np.max(np.abs(a))
