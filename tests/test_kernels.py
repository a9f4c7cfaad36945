"""Kernels: every kind, law and mesh, plain and compiled, against derivatives of the energy."""


import numpy as np
import pytest

from skfem_ancf import (ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        NeoHookean, StVenantKirchhoff)
from skfem_ancf.beam.kernels import CableKernel, SectionKernel
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
