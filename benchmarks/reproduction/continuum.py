"""A cantilever as a 2D body, by stock scikit-fem: nothing of skfem_ancf is used here."""

import numpy as np
from skfem import (Basis, BilinearForm, ElementQuad2, ElementVector, FacetBasis, LinearForm,
                   MeshQuad, condense, solve)
from skfem.helpers import ddot, dot, grad, transpose


def strain(H, G=None):
    """Green-Lagrange strain of the displacement gradient H; with G its change along G."""
    if G is None:
        return 0.5 * (H + transpose(H) + product(H, H))
    A = G + product(H, G)
    return 0.5 * (A + transpose(A))


def product(H, G):
    """H^T G."""
    return np.einsum("ki...,kj...->ij...", H, G)


def stress(eps, lam, mu):
    """Second Piola-Kirchhoff stress."""
    out = 2.0 * mu * eps
    out[0, 0] += lam * (eps[0, 0] + eps[1, 1])
    out[1, 1] += lam * (eps[0, 0] + eps[1, 1])
    return out


def constants(E, nu):
    """Lame's constants of plane stress."""
    return E * nu / (1.0 - nu**2), E / (2.0 * (1.0 + nu))


@BilinearForm
def tangent(u, v, w):
    """Second variation of the strain energy, per width."""
    H = w["state"].grad
    S = stress(strain(H), w.lam, w.mu)
    dS = stress(strain(H, grad(u)), w.lam, w.mu)
    return ddot(dS, strain(H, grad(v))) + ddot(S, product(grad(u), grad(v)))


@LinearForm
def internal(v, w):
    """First variation of the strain energy, per width."""
    H = w["state"].grad
    return ddot(stress(strain(H), w.lam, w.mu), strain(H, grad(v)))


def cantilever_tip(case, meshes, tol=1e-10, max_iterations=30):
    """Tip displacement of a thick cantilever under a uniform end traction, mesh after mesh.

    The left face is held, ``case.force`` acts as a dead traction spread evenly over the right
    face: a point load in 2D would sink in without bound as the mesh is refined. Newton's method
    from the unloaded body.

    Parameters
    ----------
    case
        A Case with a force.
    meshes
        Pairs (elements along the axis, elements across the section); the latter even.

    Returns
    -------
    list of (elements along the axis, coordinates, u_x, u_y)
    """
    lam, mu = constants(case.E, case.nu)
    force = LinearForm(lambda v, w: dot(np.array(case.force)[:, None, None]
                                        / (case.b * case.h), v))
    rows = []
    for nx, ny in meshes:
        mesh = MeshQuad.init_tensor(np.linspace(0, case.L, nx + 1),
                                    np.linspace(-case.h / 2, case.h / 2, ny + 1))
        basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=6)
        end = mesh.facets_satisfying(lambda x: np.isclose(x[0], case.L))
        load = force.assemble(FacetBasis(mesh, basis.elem, facets=end))
        held = basis.get_dofs(lambda x: np.isclose(x[0], 0.0))
        u = basis.zeros()
        for _ in range(max_iterations):
            data = dict(state=basis.interpolate(u), lam=lam, mu=mu)
            residual = load - internal.assemble(basis, **data)
            du = solve(*condense(tangent.assemble(basis, **data), residual, D=held))
            u += du
            if np.max(np.abs(du)) < tol * case.L:
                break
        else:
            raise RuntimeError(f"no equilibrium of the 2D body on {nx} x {ny} elements")
        tip = basis.probes(np.array([[case.L], [0.0]])) @ u
        rows.append((nx, int(basis.N), float(tip[0]), float(tip[1])))
    return rows
