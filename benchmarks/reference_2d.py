"""Three cantilevers as two-dimensional bodies: the fields that recovered ones are measured against.

    python benchmarks/reference_2d.py

solves them with stock scikit-fem (quads of order 4, total Lagrangian, St. Venant-Kirchhoff in plane
stress or neo-Hookean in plane strain; nothing of skfem_ancf is imported) on two meshes, and writes
the strain of the finer one at some points to tests/data/reference_2d.npz, with the largest
difference of the two meshes.

* "gravity": length 1, height and width 0.01, E = 2e8, nu = 0.3, density 7800, under its own weight;
* "thick": length 2, height 0.5, width 0.1, E = 2.07e11, nu = 0.3, 62.5e6 N down, spread evenly over
  the end;
* "rubber": length 1, height and width 0.1, neo-Hookean, plane strain, E = 1e6, nu = 0.3, 15 N down,
  spread evenly over the end: the strain reaches 0.1.

The face x = 0 is welded. Points "inside" are further than the height from both ends, points "weld"
within it of the weld, but away from its corners, where the exact strain is infinite.
"""

from pathlib import Path

import numpy as np
from skfem import (Basis, BilinearForm, ElementQuad2, ElementQuadP, ElementVector, FacetBasis,
                   LinearForm, MeshQuad, condense, solve)
from skfem.helpers import ddot, eye, grad, mul, transpose

CASES = {
    "gravity": dict(length=1.0, height=0.01, E=2e8, nu=0.3, body=(0.0, -7800 * 9.81), end=(0, 0)),
    "thick": dict(length=2.0, height=0.5, E=2.07e11, nu=0.3, body=(0, 0),
                  end=(0.0, -62.5e6 / (0.5 * 0.1))),
    "rubber": dict(length=1.0, height=0.1, E=1e6, nu=0.3, body=(0, 0), end=(0.0, -15 / 0.01),
                   neo_hookean=True),
}
FILE = Path(__file__).parents[1] / "tests" / "data" / "reference_2d.npz"
WELD = np.array([0.1, 0.2, 0.35, 0.5, 0.7])  # distances from the weld, in heights
ETA = np.linspace(-0.5, 0.5, 9)


def points(case):
    """Points inside and near the weld, shapes (2, n)."""
    length, h = case["length"], case["height"]
    x = np.linspace(h, length - h, 41)
    inside = np.array(np.meshgrid(x, h * ETA, indexing="ij")).reshape(2, -1)
    weld = np.array(np.meshgrid(h * WELD, h * ETA[1:-1], indexing="ij")).reshape(2, -1)
    return inside, weld


def mesh(case, n, m, levels):
    """n x m quads, halved towards the weld and the faces there."""
    length, h = case["length"], case["height"]
    x = np.linspace(0, length, n + 1)
    while x[1] > 1.01 * h / m:
        x = np.insert(x, 1, 0.5 * x[1])
    for _ in range(levels):
        x = np.insert(x, 1, 0.5 * x[1])
    y = np.linspace(-0.5, 0.5, m + 1) * h
    for _ in range(levels):
        y = np.insert(y, [1, len(y) - 1], [0.5 * (y[0] + y[1]), 0.5 * (y[-1] + y[-2])])
    return MeshQuad.init_tensor(x, y)


def saint_venant_kirchhoff(E, nu):
    """Stress of a strain, and its change, in plane stress."""
    lame, G = E * nu / (1 - nu**2), E / (2 * (1 + nu))

    def stress(e):
        return lame * (e[0, 0] + e[1, 1]) * eye(1.0 + 0 * e[0, 0], 2) + 2 * G * e

    return stress, lambda e, de: stress(de)


def neo_hookean(E, nu):
    """S = G (I - C^-1) + lambda ln J C^-1 in plane strain, and its change."""
    lame, G = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))

    def parts(e):
        one = eye(1.0 + 0 * e[0, 0], 2)
        C = one + 2 * e
        d = C[0, 0] * C[1, 1] - C[0, 1] * C[1, 0]
        return one, np.array([[C[1, 1], -C[0, 1]], [-C[1, 0], C[0, 0]]]) / d, 0.5 * np.log(d)

    def stress(e):
        one, inverse, log_J = parts(e)
        return G * (one - inverse) + lame * log_J * inverse

    def change(e, de):
        _, inverse, log_J = parts(e)
        return (lame * ddot(inverse, de) * inverse
                + 2 * (G - lame * log_J) * mul(mul(inverse, de), inverse))

    return stress, change


def green_lagrange(H):
    return 0.5 * (H + transpose(H) + mul(transpose(H), H))


def solve_body(case, m, element, start=None, steps=1):
    """The displacement of the body by Newton's method."""
    law = neo_hookean if case.get("neo_hookean") else saint_venant_kirchhoff
    stress, change = law(case["E"], case["nu"])
    basis = Basis(m, ElementVector(element), intorder=10)
    end = FacetBasis(m, basis.elem, facets=m.facets_satisfying(
        lambda x: np.isclose(x[0], case["length"])), intorder=10)

    @BilinearForm
    def tangent(u, v, w):
        F = grad(w.u) + eye(1.0 + 0 * w.u.grad[0, 0], 2)
        du, dv = (0.5 * (mul(transpose(F), grad(f)) + mul(transpose(grad(f)), F)) for f in (u, v))
        dS = change(green_lagrange(w.u.grad), du)
        return ddot(dS, dv) + ddot(w.S, mul(transpose(grad(u)), grad(v)))

    @LinearForm
    def residual(v, w):
        F = grad(w.u) + eye(1.0 + 0 * w.u.grad[0, 0], 2)
        return ddot(mul(F, w.S), grad(v))

    @LinearForm
    def load(v, w):
        return w.fx * v[0] + w.fy * v[1]

    force = load.assemble(basis, fx=case["body"][0], fy=case["body"][1])
    force += load.assemble(end, fx=case["end"][0], fy=case["end"][1])
    D = basis.get_dofs(m.facets_satisfying(lambda x: np.isclose(x[0], 0.0))).all()
    free = basis.complement_dofs(D)
    u = basis.zeros() if start is None else start(basis)
    u[D] = 0.0
    for factor in np.arange(1, steps + 1) / steps:
        for _ in range(40):
            w = basis.interpolate(u)
            S = stress(green_lagrange(w.grad))
            r = factor * force - residual.assemble(basis, u=w, S=S)
            du = solve(*condense(tangent.assemble(basis, u=w, S=S), r, D=D))
            u = u + du
            if np.abs(du).max() < 1e-9 * np.abs(u).max():
                break
        else:
            raise RuntimeError("Newton's method did not converge")
    assert np.abs(r[free]).max() < 1e-6 * np.abs(residual.assemble(basis, u=w, S=S)).max()
    return basis, u


def strain(basis, u, x):
    """eps_xx, eps_yy, eps_xy at points (2, n)."""
    cells = basis.mesh.element_finder()(*x)
    X = basis.mapping.invF(x[:, :, None], tind=cells)
    H = sum(basis.elem.gbasis(basis.mapping, X, i, cells)[0].grad
            * u[basis.element_dofs[i, cells]][:, None] for i in range(basis.Nbfun))[..., 0]
    e = green_lagrange(H)
    return np.array([e[0, 0], e[1, 1], e[0, 1]])


def reference(name, sizes):
    """The strain inside and near the weld on the meshes, coarse first, and the tip."""
    case, out, start, steps = CASES[name], [], None, 20
    for element, (n, m, levels) in sizes:
        basis, u = solve_body(case, mesh(case, n, m, levels), element, start, steps)

        def start(fine, basis=basis, u=u):
            x = np.asarray(fine.global_coordinates())
            values = (basis.probes(x.reshape(2, -1)) @ u).reshape(x.shape)
            return fine.project(values)

        steps = 1
        tip = basis.probes(np.array([[case["length"]], [0.0]])) @ u
        out.append([strain(basis, u, x) for x in points(case)])
        print(name, n, m, levels, basis.N, "coordinates, tip", tip, flush=True)
    return out, tip


def main():
    data = {}
    for name, (n, m) in (("rubber", (24, 4)), ("thick", (16, 4)), ("gravity", (96, 2))):
        results, data[name + "_tip"] = reference(name, [
            (ElementQuad2(), (n // 2, m, 0)), (ElementQuadP(4), (n, m, 2)),
            (ElementQuadP(4), (n * 3 // 2, m * 3 // 2, 3))])
        for k, where in enumerate(("inside", "weld")):
            old, new = results[-2][k], results[-1][k]
            error = np.abs(new - old).max(axis=1) / np.abs(new).max(axis=1)
            print(name, where, "relative change of the strain", error)
            data[f"{name}_{where}_x"] = points(CASES[name])[k]
            data[f"{name}_{where}"], data[f"{name}_{where}_error"] = np.float32(new), error
    FILE.parent.mkdir(exist_ok=True)
    np.savez_compressed(FILE, **data)


if __name__ == "__main__":
    main()
