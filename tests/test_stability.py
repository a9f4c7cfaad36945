"""Inertia of the tangent, the verdict of a state, and stable equilibria."""

import numpy as np
import pytest
import scipy.linalg

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        Scene, StVenantKirchhoff)
from skfem_ancf import system as system_module
from skfem_ancf.linalg import BandMatrix, Inertia

ELEMENTS = (ElementBeamANCF(2), ElementBeamCable(3), ElementBeamCable(5), ElementBeamANCFCubic(2))
SUPPORTS = ("clamped", "pinned", "weld", "hinge", "slider")


def line(n=4, h=0.01, element=ELEMENTS[0], origin=(0, 0), angle=0.0, name=None):
    mesh = MeshBeam.init_line(np.linspace(0, 1, n + 1), h, origin=origin, angle=angle)
    return Beam(mesh, element, StVenantKirchhoff(2e8, 0.3, 7800), width=h, name=name)


def scene_of(kind, n, h, element):
    a = line(n, h, element, name="a")
    if kind == "clamped":
        return Scene(a).clamp("left")
    if kind == "pinned":
        return Scene(a).pin("left").pin("right")
    b = line(n, h, element, (1, 0), 1.0, "b")
    scene = Scene(a, b).clamp("left", beam="a")
    if kind == "weld":
        scene.joint("weld", beams=("a", "b"), at=("right", "left"))
        return scene
    scene.joint("hinge", beams=("a", "b"), at=(1, 0))
    if kind == "hinge":
        return scene.pin("right", beam="b")
    scene.joint("circle", at=(1, 0), center=(0.4, 0.3), beam="a")
    scene.joint("line", at=(1 + np.cos(1), np.sin(1)), direction=(1, 1), beam="b")
    return scene


def dense_eigenvalues(system, u, multipliers=None):
    """Of the tangent at free coordinates and J x = 0, scaled to a unit diagonal."""
    multipliers = np.zeros(system.m) if multipliers is None else multipliers
    system.assemble(u)
    K = (system.K.tocsc() + system.curvature(u, 0.0, multipliers)).toarray()
    free = np.nonzero(system.free)[0]
    A, J = K[np.ix_(free, free)], system.jacobian(u, 0.0)[:, free]
    if len(J):
        Z = scipy.linalg.null_space(J / np.linalg.norm(J, axis=1)[:, None])
        A = Z.T @ A @ Z
    size = np.sqrt(np.abs(np.diag(A)))
    return np.linalg.eigvalsh(0.5 * (A + A.T) / (size[:, None] * size))


def factorized(system, u, multipliers=None):
    multipliers = np.zeros(system.m) if multipliers is None else multipliers
    system.assemble(u)
    system.factorize(u, 0.0, multipliers)
    return system.inertia()


@pytest.mark.parametrize("border", [0, 96], ids=["sparse", "bordered"])
@pytest.mark.parametrize("kind", SUPPORTS)
def test_inertia_is_that_of_the_dense_matrix_on_the_tangent_space(kind, border, monkeypatch):
    monkeypatch.setattr(system_module, "WIDE_BORDER", border)
    rng = np.random.default_rng(SUPPORTS.index(kind))
    seen = set()
    for k in range(12):
        element = ELEMENTS[k % len(ELEMENTS)]
        scene = scene_of(kind, int(rng.integers(1, 6)), 10 ** rng.uniform(-2.5, -1), element)
        system = scene.system
        u = rng.standard_normal(system.N) * 10 ** rng.uniform(-4, -0.5)
        multipliers = rng.standard_normal(system.m) * 10 ** rng.uniform(0, 6)
        values = dense_eigenvalues(system, u, multipliers)
        if np.min(np.abs(values)) < 1e-10:  # on which side of zero is for round-off to say
            continue
        negative = int(np.sum(values < 0))
        assert factorized(system, u, multipliers) == Inertia(negative, False)
        seen.add(negative)
    assert len(seen) > 3


@pytest.mark.parametrize("slenderness", [1e2, 1e4])
@pytest.mark.parametrize("element", ELEMENTS, ids=lambda e: f"{type(e).__name__}")
@pytest.mark.parametrize("n", [4, 20])
def test_mechanisms_are_singular_and_supported_beams_are_not(element, slenderness, n):
    h = 1.0 / slenderness
    for kind in ("clamped", "weld"):
        system = scene_of(kind, n, h, element).system
        assert factorized(system, np.zeros(system.N)) == Inertia(0, False)
    system = Scene(line(n, h, element, angle=0.3)).pin("left").system
    assert factorized(system, np.zeros(system.N)) == Inertia(0, True)
    a, b = line(n, h, element, name="a"), line(n, h, element, (1, 0), 1.0, "b")
    loose = Scene(a, b).clamp("left", beam="a")
    loose.joint("hinge", beams=("a", "b"), at=(1, 0))
    assert factorized(loose.system, np.zeros(loose.N)) == Inertia(0, True)


def test_inertia_of_band_matrices_that_have_no_factors_without_pivoting():
    # leading parts that are singular, and rows with a zero diagonal
    A = np.array([[0.0, 2.0, 0.0], [2.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    A = np.block([[A, np.zeros((3, 2))], [np.zeros((2, 3)), np.diag([-3.0, 5.0])]])
    A[3, 2] = A[2, 3] = 0.5
    K = BandMatrix(5, 1)
    i, j = np.nonzero(A)
    K.add(i, j, A[i, j])
    values = np.linalg.eigvalsh(A)
    assert K.factorize().inertia() == Inertia(int(np.sum(values < 0)), False)
    assert K.determinant_sign() == np.sign(np.linalg.det(A))


@pytest.mark.parametrize("kind", SUPPORTS)
def test_sign_of_the_determinant_counts_the_negative_eigenvalues_by_twos(kind):
    rng = np.random.default_rng(7)
    seen = set()
    for k in range(8):
        system = scene_of(kind, 3, 0.02, ELEMENTS[k % 4]).system
        multipliers = np.zeros(system.m)
        system.assemble(0.02 * rng.standard_normal(system.N))
        system.factorize(np.zeros(system.N), 0.0, multipliers)
        matrix = system.K if not system.joints else system._factors
        sign = matrix.determinant_sign()
        assert sign == (-1) ** system.inertia().negative
        seen.add(sign)
    assert seen == {1, -1}
