"""Kernels: every kind, law and mesh, plain and compiled, against derivatives of the energy."""

from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        NeoHookean, Scene, Section, StVenantKirchhoff)
from skfem_ancf.beam import strain_energy as body
from skfem_ancf.beam.kernels import CableKernel, SectionKernel, arrays, law, loops, strain
from skfem_ancf.beam.kernels import kernel as kernels
from skfem_ancf.core.band import add_halves, fix
from skfem_ancf.core.linalg import BandMatrix, halves
from skfem_ancf.core.switch import compiled_off
from skfem_ancf.dynamics import stages
from skfem_ancf.equations.backend import LOADED
from skfem_ancf.equations.evaluation import CARRY, FORCE, MEAN, STRESS, TANGENT, evaluate
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
    if kind.startswith("cable"):
        h = 1e-4
        slope = (k.energy(u - 2 * h * d) - 8 * k.energy(u - h * d) + 8 * k.energy(u + h * d)
                 - k.energy(u + 2 * h * d)) / (12 * h)
        change = (k.force(u - 2 * h * d) - 8 * k.force(u - h * d) + 8 * k.force(u + h * d)
                  - k.force(u + 2 * h * d)) / (12 * h)
        tol = 1e-9
    else:
        slope = np.imag(k.energy(u + 1j * STEP * d)) / STEP
        change = np.imag(k.force(u + 1j * STEP * d)) / STEP
        tol = 1e-11
    assert abs(k.force(u) @ d - slope) < tol * np.abs(k.force(u)) @ np.abs(d)
    close(dense(k, k.tangents(u)) @ d, change, tol)
    close(k.scatter(k.forces(u)), k.force(u))


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
def test_parts_of_the_tangent(kind, mesh):
    k = kernel(kind, mesh)
    u, v = states(k)
    B, HB, stress = k.gradients(u)
    close(np.einsum("emi,em->ei", B, stress), k.forces(u).reshape(len(B), -1))
    close(np.einsum("emi,emj->eij", B, HB) + k.geometric(u, stress), k.tangents(u), 1e-12)
    h, d = 1e-4, v - u  # the mean of both steps has no second-order part
    change = k.gradients(u + h * d)[2] - k.gradients(u - h * d)[2]
    rate = 2.0 * h * np.einsum("emi,ei->em", HB, k.gather(d).reshape(len(HB), -1))
    assert np.max(np.abs(rate - change)) <= 1e-5 * np.max(np.abs(rate))


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
@every
def test_gradients_carry_stresses_and_give_forces(kind, mesh):
    """As the kernels do from the displacement, of three copies."""
    system = system_of(kind, mesh)
    tables, N, rng = system.machine.tables, system.N, np.random.default_rng(4)
    plain, copies = tables.plain.body, tables.copied(3).plain.copies
    u, _ = states(system)
    du, S = rng.standard_normal(3 * N), rng.standard_normal(body.stress_size(copies))
    gradients, carried, expected = np.zeros(body.gradients_size(plain)), S.copy(), S.copy()
    f, g = np.zeros((2, 3 * N))
    body.body_gradients(plain, u, gradients)
    body.carry_by(plain, copies, gradients, du, S, carried)
    body.body_carry(copies, np.tile(u, 3), du, S, expected)
    close(carried, expected)
    body.add_force_by(plain, copies, gradients, S, f)
    body.add_force_of(copies, np.tile(u, 3), S, g)
    close(f, g)
    A, B, again, none = system.new_band().band, system.new_band().band, gradients + 1.0, S[:0]
    body.body_tangent_by(plain, u, S[:S.size // 3], again, A)
    body.body_tangent(plain, u, f[:N], S[:S.size // 3], True, none, B)
    close(again, gradients)
    close(A.flat, B.flat)


def from_halves(U):
    """A matrix in two halves as a dense one."""
    n = U.flat.size // U.ld
    k = np.arange(U.width + 1)
    i, j = np.arange(n)[:, None] + k, np.broadcast_to(np.arange(n)[:, None], (n, len(k)))
    dense, columns, inside = np.zeros((n, n)), U.flat.reshape(n, 2, -1)[:, :, k], i < n
    dense[j[inside], i[inside]] = columns[:, 1][inside]
    dense[i[inside], j[inside]] = columns[:, 0][inside]
    return dense


@kinds
@every
def test_what_a_second_state_changes_of_the_derivative_of_forces(kind, mesh):
    """``B(u)^T D (B(v) - B(u))``, as gradients give it, with the moduli at u."""
    system = system_of(kind, mesh)
    plain, N, (u, v) = system.machine.tables.plain.body, system.N, states(system)
    U, expected = halves(N, system.bandwidth), np.zeros((N, N))
    body.add_turned(plain, u, v, U)
    first, last = np.zeros((2, body.gradients_size(plain)))
    body.body_gradients(plain, u, first)
    body.body_gradients(plain, v, last)
    for k, t in enumerate(plain.packs):
        (B, DB), (C, _) = body._halves(plain, k, first), body._halves(plain, k, last)
        for e, start in enumerate(t.start):
            own = slice(start, start + B.shape[2])
            expected[own, own] += DB[e].T @ (C[e] - B[e])
    close(from_halves(U), expected)


@pytest.mark.skipif(compiled_off() is not None, reason="without Numba")
@pytest.mark.parametrize("nodes", [[0, 0.2, 0.6, 1], np.linspace(0, 1, 35)])  # in several blocks
@pytest.mark.parametrize("kind", [kind for kind in KINDS if KINDS[kind][3] != "own"])
def test_collocation_with_carried_stresses_is_the_same_compiled(kind, nodes, monkeypatch):
    """Of a stiff pendulum that turns far in each step."""
    _, element, formulation, name = KINDS[kind]
    monkeypatch.setenv("SKFEM_ANCF_COMPILED", "1")
    found, calls = [], []

    def tangent(*args):
        calls.append(args)
        body.body_tangent_by(*args)

    for compiled in (True, False):
        mesh = MeshBeam.init_line(nodes, height=0.05)
        s = Scene(Beam(mesh, element(), LAWS[name](1e8, 0.3, 1000.0), 0.02, formulation,
                       compiled=compiled)).pin("left").gravity((0.0, -9.81))
        found.append(s.integrate(0.3, 0.1, scheme="radau", tol=1e-8, progress=False))
        monkeypatch.setattr(stages, "body_tangent_by", tangent)  # of the plain text
    b, a = found
    assert "collocate" in LOADED
    assert a.iterations == b.iterations and a.factorizations == b.factorizations and calls
    close(b.u[-1], a.u[-1], 1e-9)


def test_a_law_of_ones_own_goes_with_its_kernel():
    before = len(law._LAWS)
    k = kernel("section-own", "one")
    assert len(law._LAWS) == before + 1
    del k
    assert len(law._LAWS) == before


def test_what_a_law_of_ones_own_raises_is_seen():
    class Broken(Soft):
        def stress(self, strain):
            if np.max(np.abs(strain)) > 0.01:
                raise ZeroDivisionError("no stress")
            return super().stress(strain)

    across = Across(MESHES["one"](), ElementBeamANCF(2), Rectangle(0.02), Broken(2e5, 0.3))
    k = SectionKernel(across, get_formulation("continuum"))
    with pytest.raises(ZeroDivisionError, match="no stress"):
        k.force(np.ones(k.N))


@kinds
@pytest.mark.parametrize("mesh", ["one", "graded", "curved"])
def test_loops_are_arrays(kind, mesh, monkeypatch):
    """The steps for Numba, run by Python, beside those for NumPy."""
    k, found, none, ld = kernel(kind, mesh), [], np.zeros(0), 2 * kernel(kind, mesh).nd + 3
    u, v = states(k)
    for steps in (arrays, loops):
        for name in vars(loops):
            if hasattr(strain, name) and hasattr(arrays, name):
                monkeypatch.setattr(strain, name, getattr(steps, name))
        for what in range(12):
            f, flat, written = np.zeros(k.N), np.zeros(2 * k.N * ld), []
            for t in k.tables:
                ns = len(t.start) * t.rows.shape[1]
                given = np.sin(np.arange(1.0, ns + 1.0))
                if what >= strain.PUSH and t.law.kind != law.LINEAR:
                    given = 1e-3 * np.cos(np.arange(3.0 * t.weights.shape[1] * len(t.start)))
                elif what < strain.PUSH and what not in (strain.CARRY, strain.GIVEN):
                    given = none
                gradients = what == strain.GRADIENTS
                written.append(np.zeros(4 * ns * k.nd if gradients else ns))
                strain.evaluate(t, np.int64(what), u, v, f, given, written[-1],
                                none if gradients else flat, 2 * ld)
            found.append((f, flat, np.concatenate(written)))
    sizes = [np.max(np.abs(x)) for x in found[strain.TANGENT]]  # others are what cancels
    for one, other in zip(found[:12], found[12:]):
        for a, b, size in zip(one, other, sizes):
            assert np.max(np.abs(a - b)) <= 1e-13 * max(size, np.max(np.abs(a)))


@pytest.mark.skipif(compiled_off() is not None, reason="without Numba")
@pytest.mark.parametrize("kind", [kind for kind in KINDS if KINDS[kind][3] != "own"])  # in NumPy
@every
def test_compiled_is_plain(kind, mesh):
    """All that is asked of kernels, through the function that is compiled for scenes anyway."""
    system = system_of(kind, mesh)
    tables, n = system.machine.tables, len(system.machine.tables.stresses)
    u, v = states(system)
    before, rng = np.zeros((2, n)), np.random.default_rng(2)
    for what in (FORCE, TANGENT, CARRY, STRESS, MEAN):
        for use_carried in (False, True):
            stresses, carried = before + rng.standard_normal((2, n))
            found = []
            for run in (partial(evaluate, tables.plain), system.machine.of(evaluate)):
                tables.plain.K.flat[:] = 0.0
                f, S, C = np.zeros(system.N), stresses.copy(), carried.copy()
                args = (what, u, v, tables.static_factors(1.0), np.nan, 1.0, use_carried, S, C,
                        f)
                run(*args)
                found.append((f, S, C, tables.plain.K.flat.copy()))
            assert any(np.any(x) for x in found[0])
            for a, b in zip(*found):
                assert np.max(np.abs(a - b)) <= 2e-13 * np.max(np.abs(a))


@pytest.mark.parametrize(("n", "bandwidth"), [(1, 0), (3, 4), (9, 2)])
def test_skew_size_of_a_band_matrix_is_that_of_the_dense_one(n, bandwidth):
    for symmetric in (True, False):
        A = BandMatrix(n, bandwidth, symmetric)
        i, j = np.nonzero(abs(np.arange(n)[:, None] - np.arange(n)) <= bandwidth)
        A.add(i, j, np.sin(1.0 + np.minimum(i, j) + 7.0 * np.maximum(i, j) + (0.0 if symmetric
                                                                             else (i > j))))
        sizes = 1.0 + np.arange(n)
        dense = sizes[:, None] * A.tocsc().toarray() * sizes
        expected = np.max(abs(dense - dense.T)), np.max(abs(dense))
        assert_allclose(A.skew_size(sizes), expected, atol=1e-12)


@pytest.mark.parametrize(("n", "bandwidth"), [(1, 0), (3, 4), (9, 2)])
def test_fixed_rows_and_columns_of_a_band_matrix_are_those_of_the_identity(n, bandwidth):
    i, j = np.nonzero(abs(np.arange(n)[:, None] - np.arange(n)) <= bandwidth)
    for symmetric in (True, False):
        for fixed in (0,), (n - 1,), (n // 2, n // 2 - 1), ():
            A, free, fixed = (BandMatrix(n, bandwidth, symmetric), np.ones(n),
                              np.array(fixed, np.int64))
            inside = (i >= j) | (not symmetric)
            A.add(i[inside], j[inside], 2.0 + np.sin(i + 7.0 * j)[inside])
            free[fixed] = 0.0
            wanted = A.tocsc().toarray() * np.outer(free, free) + np.diag(1.0 - free)
            U = halves(n, bandwidth)
            U.flat[:] = 1.0
            add_halves(A.band, 0.0, U)
            fix(A.band, fixed)
            fix(U, fixed)
            assert_allclose(A.tocsc().toarray(), wanted, atol=0.0)
            assert_allclose(from_halves(U), wanted, atol=0.0)


def _energetic(kind):
    """A beam whose energy takes tables of its elements, of its law, of layers or of widths."""
    law = StVenantKirchhoff(2e5, 0.3, 1.0)
    taper = MeshBeam.init_line([0.0, 0.3, 0.7, 1.0], lambda x: 0.1 - 0.05 * x)
    if kind == "rubber on a curve":
        return Beam(MESHES["curved"](), ElementBeamANCF(2), NeoHookean(2e5, 0.3, 1.0), 0.1)
    if kind == "graded":
        return Beam(taper, ElementBeamANCF(2), StVenantKirchhoff(
            lambda x, y: 2e5 * (1.0 + x) * np.exp(10.0 * y), 0.3, 1.0), 0.1)
    if kind == "layers":
        return Beam(taper, ElementBeamANCF(3), section=Section.layers(
            (0.02, law), (None, NeoHookean(1e4, 0.3, 1.0)), width=0.1))
    if kind == "tapered T of a cable":
        return Beam(taper, ElementBeamCable(5), law, section=Section.profile(
            "T", width=0.05, web=0.005, flange=0.008))
    return Beam(taper, ElementBeamANCF(2), law, lambda x, y: 0.1 + 0.1 * x, "strain-split")


@pytest.mark.parametrize("kind", ["rubber on a curve", "graded", "layers", "tapered T of a cable",
                                  "widths"])
def test_energies_of_many_displacements_at_once(kind, monkeypatch):
    monkeypatch.setattr(kernels, "TOGETHER", 20)  # in groups
    kernel = _energetic(kind).kernel
    u = 1e-4 * np.random.default_rng(1).standard_normal((17, kernel.N))
    assert_allclose(kernel.energy(u), [kernel.energy(x) for x in u], rtol=1e-12)


def test_tables_of_one_beam_with_equal_samples_stay_apart():
    """Two of the three parts of "strain-split" have the same samples, beside another beam."""
    law = StVenantKirchhoff(1000.0, 0.3, 1.0)
    a, b = (Beam(MeshBeam.init_line([x, x + 0.5], 0.1), element, law, 0.1, formulation)
            for x, element, formulation in ((0.0, ElementBeamANCF(1), "strain-split"),
                                            (0.5, ElementBeamCable(3), "assumed")))
    system = Scene(a, b).system
    u, d = 0.01 * np.random.default_rng(0).standard_normal((2, system.N))
    system.assemble(u)
    change = [np.imag(beam.kernel.force(u[s] + 1e-30j * d[s])) / 1e-30
              for beam, s in zip(system.beams, system.slices)]
    change = np.concatenate(change)
    assert np.allclose(system.K.tocsc() @ d, change, rtol=0, atol=1e-12 * np.abs(change).max())
