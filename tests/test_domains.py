"""Domains: stock bases of scikit-fem with their forms in one scene with beams."""

import pickle

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh
from skfem import (Basis, BilinearForm, ElementQuad1, ElementQuad2, ElementQuadP, ElementTetP1,
                   ElementTriP2, ElementVector, LinearForm, MeshQuad, MeshQuad2, MeshTet, MeshTri,
                   condense, solve)
from skfem.helpers import (ddot, det, dot, eye, grad, identity, inv, mul, sym_grad, trace,
                           transpose)

from skfem_ancf import (Beam, CallbackError, Domain, ElasticPlastic, ElementBeamANCF,
                        ElementBeamCable, InputError, MeshBeam, MeshError, NameUnknown, NeoHookean,
                        RigidBody, Scene, StVenantKirchhoff, SupportError)

E, NU, RHO, WIDTH, H = 1e6, 0.3, 780.0, 0.1, 0.1


def forms(E=E, nu=NU, width=WIDTH, soft=None):
    """St. Venant-Kirchhoff in plane stress with the Green-Lagrange strain.

    The modulus is ``soft`` times E above the beam.
    """
    lam, mu = E * nu / (1 - nu**2), E / (2 * (1 + nu))

    def stress(strain, w):
        part = 1.0 if soft is None else np.where(w.x[1] > H / 2, soft, 1.0)
        return part * (lam * eye(trace(strain), 2) + 2 * mu * strain)

    def parts(w):
        F = grad(w["u"]) + identity(grad(w["u"]))
        return F, stress(0.5 * (mul(transpose(F), F) - identity(F)), w)

    @LinearForm
    def residual(v, w):
        F, S = parts(w)
        return width * ddot(mul(F, S), grad(v))

    @BilinearForm
    def tangent(u, v, w):
        F, S = parts(w)
        dE = mul(transpose(F), grad(u))
        return width * (ddot(mul(grad(u), S), grad(v))
                        + ddot(mul(F, stress(0.5 * (dE + transpose(dE)), w)), grad(v)))

    return residual, tangent


@BilinearForm
def mass(u, v, w):
    return RHO * WIDTH * dot(u, v)


@LinearForm
def pull(v, w):
    """A unit force downwards on a face as high as a beam."""
    return -v[1] / H


def strip(x0, x1, nx, ny=4, height=H, y0=0.0):
    return MeshQuad.init_tensor(np.linspace(x0, x1, nx + 1),
                                y0 + np.linspace(-height / 2, height / 2, ny + 1)).with_defaults()


def domain_of(mesh, element=None, name="solid", **options):
    basis = Basis(mesh, ElementVector(element or ElementQuad2()))
    return Domain(basis, *forms(**options), mass, name=name)


def beam_of(x0, x1, n=16, element=None, **options):
    mesh = MeshBeam.init_line(np.linspace(0, x1 - x0, n + 1), H, origin=(x0, 0))
    return Beam(mesh, element or ElementBeamANCF(2), StVenantKirchhoff(E, NU, RHO), WIDTH,
                **options)


def plain_newton(mesh, load, clamped, at, steps=4, **options):
    """The displacement of a point by scikit-fem alone, all of Q2."""
    basis = Basis(mesh, ElementVector(ElementQuad2()))
    residual, tangent = forms(**options)
    b, fixed, x = load(basis), basis.get_dofs(clamped), basis.zeros()
    for k in range(1, steps + 1):
        for _ in range(20):
            u = basis.interpolate(x)
            r = k / steps * b - residual.assemble(basis, u=u)
            dx = solve(*condense(tangent.assemble(basis, u=u), r, D=fixed))
            x = x + dx
            if np.abs(dx).max() < 1e-11:
                break
    return basis.probes(np.array(at)[:, None] * (1 - 1e-12)) @ x


def pulled_down(basis):
    return pull.assemble(basis.boundary("right"))


def cantilever(n=32):
    """The tip of a cantilever of the length 2 that is pulled down."""
    return plain_newton(strip(0, 2, n), pulled_down, "left", (2.0, 0.0))


# statics


def test_a_domain_alone_is_what_scikit_fem_finds():
    mesh = strip(0, 2, 16)
    solid = domain_of(mesh)
    scene = Scene(solid).clamp("left").load(pull, "right")
    state = scene.solve_static()
    assert_allclose(state.displacement((2, 0)), cantilever(16), rtol=1e-8)
    assert state.stability == "stable"
    reaction = state.reactions("left")
    assert_allclose(reaction.force, (0.0, 1.0), atol=1e-9)
    moved = state.displacement((2, 0))
    assert_allclose(reaction.moment, 2.0 + moved[0], rtol=1e-3)
    # the user's own way to fields: the basis and its degrees of freedom
    x = solid.of_basis(state.u_of(solid))
    assert_allclose(solid.basis.probes(np.array([[2.0], [0.0]])) @ x, moved, rtol=1e-12)


@pytest.mark.parametrize("element, tol", [(None, 2e-4), (ElementBeamCable(5), 1e-3)])
def test_a_cantilever_half_of_quads_and_half_beam(element, tol):
    tip = cantilever()
    solid, beam = domain_of(strip(0, 1, 16)), beam_of(1, 2, element=element)
    scene = Scene(beam, solid).clamp("left", solid).point_force((0, -1), at=(2, 0), beam=beam)
    weld = scene.weld((solid, "right"), (beam, "left"))
    state = scene.solve_static()
    assert state.stability == "stable"
    assert np.hypot(*(state.displacement((2, 0), beam) - tip)) < tol * np.hypot(*tip)
    assert_allclose(state.displacement((1, 0), beam), state.displacement((1, 0), solid), atol=1e-4)
    forces = state.joint_force(weld)
    assert_allclose(sum(f for f, name in zip(forces, weld.equations) if name.endswith("y")), -1.0,
                    rtol=1e-6)


def test_a_beam_carries_a_domain_of_triangles():
    tip = cantilever()
    mesh = MeshTri.init_tensor(np.linspace(1, 2, 17), np.linspace(-H / 2, H / 2, 4)).with_defaults()
    solid, beam = domain_of(mesh, ElementTriP2()), beam_of(0, 1)
    scene = Scene(beam, solid).clamp("left", beam).load(pull, "right", solid)
    scene.weld((solid, "left"), (beam, "right"))
    found = scene.solve_static().displacement((2, 0), solid)
    assert np.hypot(*(found - tip)) < 2e-3 * np.hypot(*tip)  # as the beam's clamp lets it


def test_gravity_and_prescribed_displacements_of_a_domain():
    solid, beam = domain_of(strip(0, 1, 16)), beam_of(0, 1)
    tips = [Scene(one).clamp("left").gravity((0, -9.81)).solve_static().displacement((1, 0))
            for one in (solid, beam)]
    assert_allclose(*tips, rtol=1e-3)
    scene = Scene(solid).fix("left", "u^1").fix("bottom", "u^2").fix("right", "u^1", 0.01)
    state = scene.solve_static()
    assert_allclose(state.displacement((0.3, 0.02))[0], 0.003, rtol=1e-9)
    strain = 0.01 + 0.5 * 0.01**2
    assert_allclose(state.strain_energy, 0.5 * E * strain**2 * H * WIDTH, rtol=1e-6)
    assert_allclose(state.reactions("right").force[0], E * strain * 1.01 * H * WIDTH, rtol=1e-6)


@pytest.mark.parametrize("curved", [False, True])
def test_elements_without_nodes_and_curved_cells(curved):
    """A hierarchical element, and a quarter of a ring of quadratic quads."""
    mesh = strip(0, 1, 8, 2)
    if curved:
        flat = MeshQuad2.from_mesh(MeshQuad.init_tensor(np.linspace(0, np.pi / 2, 9),
                                                        np.linspace(0.95, 1.05, 3)))
        angle, radius = flat.doflocs
        mesh = MeshQuad2(np.array([radius * np.sin(angle), radius * np.cos(angle)]), flat.t)
        mesh = mesh.with_boundaries({"left": lambda x: x[0] < 1e-6, "end": lambda x: x[1] < 1e-6})
    states = []
    for element in (ElementQuad2(), ElementQuadP(3)):
        solid = domain_of(mesh, element)
        states.append(Scene(solid).clamp("left").gravity((0, -0.5)).solve_static())
        weight = 0.5 * RHO * WIDTH * H * (0.5 * np.pi if curved else 1.0)
        assert_allclose(states[-1].reactions("left").force, (0, weight), rtol=1e-3, atol=1e-9)
    at = (1.0, 0.0)
    assert_allclose(*(state.displacement(at) for state in states), rtol=0.02)
    if curved:
        beam = Beam(MeshBeam.init_line([0, 0.5, 1], H, origin=at, angle=-np.pi / 2),
                    ElementBeamANCF(2), StVenantKirchhoff(E, NU, RHO), WIDTH)
        scene = Scene(beam, solid).clamp("left", solid).point_force((0, -0.1), (1, -1), beam)
        scene.weld((solid, "end"), (beam, "left"))
        hangs = scene.solve_static()
        assert_allclose(hangs.reactions("left", solid).moment,
                        0.1 * (1 + hangs.displacement((1, -1))[0]), rtol=1e-3)


def test_a_domain_buckles_where_it_has_to():
    """Compressed beyond the critical load the straight strip is unstable."""
    solid = domain_of(strip(0, 1, 24, 2))
    critical = np.pi**2 * E * H**3 * WIDTH / 12 / 4
    push = LinearForm(lambda v, w: -v[0] / H)
    for part, stability in ((0.9, "stable"), (1.1, "unstable")):
        scene = Scene(solid).clamp("left").load(
            LinearForm(lambda v, w, f=part * critical: f * push.form(v, w)), "right")
        state = scene.solve_static(stable=False)
        assert state.stability == stability


def test_domains_are_glued_to_rigid_bodies_and_to_each_other():
    whole = cantilever(16)
    left, right = domain_of(strip(0, 1, 8), name="a"), domain_of(strip(1, 2, 8, 3), name="b")
    scene = Scene(left, right).clamp("left", left).load(pull, "right", right)
    scene.weld((left, "right"), (right, "left"))
    assert_allclose(scene.solve_static().displacement((2, 0), right), whole, rtol=2e-3)
    block = RigidBody(1.0, 1.0, position=(2.5, 0))
    scene = Scene(domain_of(strip(0, 2, 16)), block).clamp("left", "solid")
    scene.weld(("solid", "right"), block).equations
    state = scene.point_force((0, -1), (2, 0), block).solve_static()
    assert_allclose(state.displacement((2, 0), "solid"), whole, rtol=2e-3)


def test_a_bracket_with_three_beams():
    """A solid T with arms that are beams, against all of Q2."""
    arm, inner = np.linspace(0.2, 1, 9), np.linspace(0.05, 0.2, 4)
    core = np.linspace(-0.05, 0.05, 5)
    x = np.unique(np.concatenate([-arm, -inner, core, inner, arm]))
    y = np.unique(np.concatenate([core, inner, arm]))

    def tee(reach):
        mesh = MeshQuad.init_tensor(x[np.abs(x) <= reach], y[y <= reach])
        middle = mesh.p[:, mesh.t].mean(axis=1)
        kept = np.flatnonzero((np.abs(middle[0]) < 0.05) | (middle[1] < 0.05))
        return mesh.restrict(kept).with_boundaries({
            "left": lambda x: np.isclose(x[0], -reach), "right": lambda x: np.isclose(x[0], reach),
            "top": lambda x: np.isclose(x[1], reach)})

    force = LinearForm(lambda v, w: 2.0 * v[0] / H)
    whole = plain_newton(tee(1.0), lambda basis: force.assemble(basis.boundary("top")),
                         ["left", "right"], (0.0, 1.0))
    solid = domain_of(tee(0.2))
    arms = [Beam(MeshBeam.init_line(np.linspace(0, 0.8, 9), H, origin=origin, angle=angle),
                 ElementBeamANCF(2), StVenantKirchhoff(E, NU, RHO), WIDTH)
            for origin, angle in (((-1, 0), 0), ((0.2, 0), 0), ((0, 0.2), np.pi / 2))]
    scene = Scene(*arms, solid).clamp("left", arms[0]).clamp("right", arms[1])
    scene.point_force((2.0, 0), at=(0, 1), beam=arms[2])
    for side, beam, end in zip(("left", "right", "top"), arms, ("right", "left", "left")):
        scene.weld((solid, side), (beam, end))
    state = scene.solve_static()
    found = state.displacement((0, 1), arms[2])
    assert found[0] > 0.1 and state.stability == "stable"
    assert np.hypot(*(found - whole)) < 5e-3 * np.hypot(*whole)  # of the clamps of beams


def test_a_block_on_the_side_of_a_beam():
    """A softer block is glued to the top of a cantilever, against all of Q2."""
    x, y = np.linspace(0, 1, 41), np.append(np.linspace(-H / 2, H / 2, 5), [0.1, 0.15])
    mesh = MeshQuad.init_tensor(x, y)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    kept = np.flatnonzero((middle[1] < H / 2) | (np.abs(middle[0] - 0.65) < 0.15))
    both = mesh.restrict(kept).with_boundaries({
        "left": lambda x: np.isclose(x[0], 0), "right": lambda x: np.isclose(x[0], 1)})
    whole = plain_newton(both, pulled_down, "left", (1.0, 0.0), soft=0.2)
    bare = plain_newton(strip(0, 1, 40), pulled_down, "left", (1.0, 0.0))
    block = domain_of(strip(0.5, 0.8, 12, 2, y0=0.1), E=0.2 * E)
    beam = beam_of(0, 1, 20, ElementBeamANCF(3))
    scene = Scene(beam, block).clamp("left", beam).point_force((0, -1), at=(1, 0), beam=beam)
    scene.weld((block, "bottom"), (beam, "top"))
    found = scene.solve_static().displacement((1, 0), beam)
    alone = Scene(beam).clamp("left").point_force((0, -1), at=(1, 0)).solve_static()
    stiffer = found[1] - alone.displacement((1, 0))[1]
    assert_allclose(stiffer, whole[1] - bare[1], rtol=0.03)


def test_springs_and_hinges_hold_points_of_a_domain():
    solid = domain_of(strip(0, 1, 8))
    held = Scene(solid).pin((0.5, 0), solid).gravity((0, -9.81))
    with pytest.raises(SupportError, match="rotation about .0.5, 0. of the domain solid"):
        held.solve_linear()
    scene = Scene(solid).pin((0, 0), solid)
    state = scene.spring(50.0, (("solid", (1, 0)), ("ground", (1, 1)))).gravity(
        (0, -9.81)).solve_static()
    assert state.stability == "stable"
    assert state.displacement((1, 0))[1] < -0.1


def test_a_hinge_between_a_domain_and_a_beam():
    """A light load: the hinge carries half of a beam's weight, and no moment."""
    solid, beam = domain_of(strip(0, 1, 8)), beam_of(1, 2, 8)
    scene = Scene(beam, solid).clamp("left", solid).fix("right", "r^2", beam=beam)
    hinge = scene.hinge((solid, (1, 0)), (beam, "left"))
    state = scene.gravity((0, -1e-3), beam=beam).solve_static()
    half = 0.5e-3 * RHO * H * WIDTH
    assert_allclose(state.joint_force(hinge), (0, -half), rtol=1e-3, atol=1e-3 * half)
    tip = half / (3 * E * H**3 * WIDTH / 12)
    assert_allclose(state.displacement((1, 0), solid)[1], -tip, rtol=0.02)


# vibrations, buckling, motion


def test_frequencies_of_quads_and_beam():
    basis = Basis(strip(0, 2, 32), ElementVector(ElementQuad2()))
    K = forms()[1].assemble(basis, u=basis.interpolate(basis.zeros()))
    free = basis.complement_dofs(basis.get_dofs("left"))
    known = np.sqrt(eigsh(K[free][:, free], 4, mass.assemble(basis)[free][:, free], sigma=0)[0])
    whole = Scene(domain_of(strip(0, 2, 32))).clamp("left")
    assert_allclose(whole.modes(4).frequencies, known, rtol=1e-9)
    solid, beam = domain_of(strip(0, 1, 16)), beam_of(1, 2)
    scene = Scene(beam, solid).clamp("left", solid)
    scene.weld((solid, "right"), (beam, "left"))
    assert_allclose(scene.modes(4).frequencies, known, rtol=1e-3)
    free_modes = Scene(domain_of(strip(0, 1, 8, 2))).modes(4)
    assert np.all(np.abs(free_modes.frequencies[:3]) < 1e-4 * free_modes.frequencies[3])


def test_buckling_of_a_column_half_of_quads():
    """Euler's load, less what shear takes of it."""
    critical = np.pi**2 * E * H**3 * WIDTH / 12 / (4 * 2.0**2)
    solid, beam = domain_of(strip(0, 1, 16)), beam_of(1, 2)
    scene = Scene(beam, solid).clamp("left", solid).point_force((-critical, 0), (2, 0), beam)
    scene.weld((solid, "right"), (beam, "left"))
    shear = 1.2 * critical / (E / (2 * (1 + NU)) * H * WIDTH)
    assert_allclose(scene.buckling(1).factors[0], 1 / (1 + shear), rtol=1e-3)


def test_a_motion_is_that_of_a_plain_newmark():
    """The trapezoidal rule in a loop of scikit-fem's own."""
    mesh, dt, steps = strip(0, 1, 6, 2), 0.02, 10
    basis = Basis(mesh, ElementVector(ElementQuad2()))
    residual, tangent = forms()
    M, fixed = mass.assemble(basis), basis.get_dofs("left")
    b = M @ basis.project(lambda x: np.array([0.0 * x[0], -9.81 + 0.0 * x[0]]))
    x, v = basis.zeros(), basis.zeros()
    a = solve(*condense(M, b, D=fixed))
    for _ in range(steps):
        new = x + dt * v + 0.25 * dt**2 * a
        for _ in range(20):
            u = basis.interpolate(new)
            acceleration = 4 / dt**2 * (new - x - dt * v) - a
            r = b - residual.assemble(basis, u=u) - M @ acceleration
            dx = solve(*condense(tangent.assemble(basis, u=u) + 4 / dt**2 * M, r, D=fixed))
            new = new + dx
            if np.abs(dx).max() < 1e-13:
                break
        acceleration = 4 / dt**2 * (new - x - dt * v) - a
        x, v, a = new, v + 0.5 * dt * (a + acceleration), acceleration
    solid = Domain(basis, residual, tangent, mass)
    history = Scene(solid).clamp("left").gravity((0, -9.81)).integrate(
        dt * steps, dt, scheme="newmark")
    assert_allclose(solid.of_basis(history.u[-1]), x, atol=1e-7 * np.abs(x).max())


def test_a_motion_of_quads_and_beam_keeps_its_energy():
    ends, energies = [], {}
    for scheme in ("generalized-alpha", "energy-momentum"):
        solid, beam = domain_of(strip(0, 1, 6, 2)), beam_of(1, 2, 4)
        scene = Scene(beam, solid).clamp("left", solid).gravity((0, -9.81))
        scene.weld((solid, "right"), (beam, "left"))
        history = scene.integrate(0.4, 0.02, scheme=scheme)
        ends.append(history.displacement((2, 0), beam)[-1])
        energies[scheme] = np.ptp(history.total_energy)
        top = history.strain_energy.max()
    alone = Scene(beam_of(0, 2, 8)).clamp("left").gravity((0, -9.81))
    ends.append(alone.integrate(0.4, 0.02, scheme="energy-momentum").displacement((2, 0))[-1])
    assert_allclose(ends[0], ends[1], atol=0.01 * np.hypot(*ends[1]))
    assert_allclose(ends[1], ends[2], atol=0.01 * np.hypot(*ends[2]))
    assert energies["energy-momentum"] < 1e-10 * top < energies["generalized-alpha"]


def test_a_domain_that_flies_keeps_energy_and_momentum():
    solid = domain_of(strip(-0.5, 0.5, 6, 2))
    scene = Scene(solid).initial_velocity(
        lambda x: np.array([1.0 - 8.0 * x[1], 2.0 + 8.0 * x[0]]))
    lost = []
    for dt in (0.02, 0.01):
        history = scene.integrate(0.2, dt, scheme="energy-momentum")
        assert np.ptp(history.total_energy) < 1e-11 * history.total_energy[0]
        assert np.max(np.ptp(history.momentum, axis=0)) < 1e-10 * np.abs(history.momentum).max()
        lost.append(np.ptp(history.angular_momentum) / history.angular_momentum[0])
    assert lost[1] < 2e-3 and lost[0] > 3 * lost[1]
    assert_allclose(history.momentum[0], RHO * WIDTH * H * np.array([1.0, 2.0]), rtol=1e-9)


def test_what_motions_refuse():
    solid = domain_of(strip(0, 1, 4, 1))
    with pytest.raises(InputError, match="KelvinVoigt"):
        Scene(solid).clamp("left").damping(stiffness=0.1).integrate(0.1, 0.05)
    twisted = Domain(solid.basis, LinearForm(lambda v, w: 1e3 * ddot(w["u"].grad, grad(v))
                                             + 50 * w["u"][0] * v[1]),
                     BilinearForm(lambda u, v, w: 1e3 * ddot(grad(u), grad(v)) + 50 * u[0] * v[1]),
                     mass)
    scene = Scene(twisted).clamp("left").gravity((0, -9.81))
    with pytest.raises(InputError, match="not symmetric"):
        scene.integrate(0.1, 0.05, scheme="energy-momentum")
    assert scene.integrate(0.1, 0.05, scheme="generalized-alpha").u.any()
    assert "no potential" in str(scene.solve_static().verdict)


# files and pictures


def test_files_and_pictures_show_both(tmp_path):
    solid, beam = domain_of(strip(0, 1, 8)), beam_of(1, 2, 8)
    scene = Scene(beam, solid).clamp("left", solid).point_force((2.0, 0), at=(2, 0), beam=beam)
    scene.weld((solid, "right"), (beam, "left"))
    state = scene.solve_static()
    mesh = meshio.read(state.save(tmp_path / "both.vtu"))
    kinds = np.concatenate(mesh.cell_data["beam"])
    assert [np.sum(kinds == k) for k in (0, 1)] == [8 * 8 * 4, 4 * 8 * 4]
    right = mesh.points[:, 0] - mesh.point_data["displacement"][:, 0] > 0.3
    strain = mesh.point_data["strain"][right, 0]
    assert_allclose(strain, 2.0 / (E * H * WIDTH), rtol=2e-2)
    of_solid = np.isnan(mesh.point_data["stress"][:, 0])
    assert 0 < of_solid.sum() < len(of_solid)
    ax = state.plot("eps_xx", filename=tmp_path / "strain.png")
    coloured = [c.get_array() for c in ax.collections if c.get_array() is not None]
    assert len(coloured) == 1 and np.isfinite(coloured[0]).all()
    assert len(coloured[0]) > 32 * 9
    shown = state.plot("S_xx").collections  # grey where the stress is not known
    assert any(len(c.get_paths()) == 4 * 32 for c in shown)


def test_rubber_on_a_graded_mesh():
    """A neo-Hookean law in plane strain, stretched between rigid ends, against its formula."""
    mu, lam = 1.0, 9.0

    def parts(w):
        F = identity(grad(w["u"])) + grad(w["u"])
        return transpose(inv(F)), np.log(det(F))

    @LinearForm
    def residual(v, w):
        G, volume = parts(w)
        return ddot(mu * (identity(G) + grad(w["u"]) - G) + lam * volume * G, grad(v))

    @BilinearForm
    def tangent(u, v, w):
        G, volume = parts(w)
        return ddot(mu * grad(u) + (mu - lam * volume) * mul(mul(G, transpose(grad(u))), G)
                    + lam * trace(mul(transpose(G), grad(u))) * G, grad(v))

    mesh = MeshQuad.init_tensor(np.append(0, np.geomspace(1e-7, 1, 9)), [0, 0.5, 1])
    mesh = mesh.with_boundaries({"left": lambda x: x[0] == 0, "right": lambda x: x[0] == 1,
                                 "bottom": lambda x: x[1] == 0})
    solid = Domain(Basis(mesh, ElementVector(ElementQuad1())), residual, tangent)
    scene = Scene(solid).fix("left", "u^1").fix("bottom", "u^2").fix("right", "u^1", 0.5)
    state = scene.solve_static()
    across = brentq(lambda s: mu * (s - 1 / s) + lam * np.log(1.5 * s) / s, 0.5, 1.0)
    force = mu * (1.5 - 1 / 1.5) + lam * np.log(1.5 * across) / 1.5
    assert_allclose(state.displacement((0.7, 1.0)), (0.35, across - 1), rtol=1e-8)
    assert_allclose(state.reactions("right").force[0], force, rtol=1e-8)
    energy = 0.5 * mu * (1.5**2 + across**2 - 2 - 2 * np.log(1.5 * across))
    assert_allclose(state.strain_energy, energy + 0.5 * lam * np.log(1.5 * across)**2, rtol=1e-8)


# domains of materials


LAWS = {"stress": StVenantKirchhoff(E, 0.3, RHO), "strain": StVenantKirchhoff(
    E, 0.3, RHO, plane="strain"), "rubber": NeoHookean(E, 0.4, RHO), "rubber strain": NeoHookean(
        E, 0.4, RHO, plane="strain")}


def solid_of(mesh, law, element=None, **options):
    return Domain.solid(Basis(mesh, ElementVector(element or ElementQuad2())), law, WIDTH,
                        **options)


def laterals(name, s):
    """Stretches across the pull and out of the plane, with no stress across, in closed form."""
    law = LAWS[name]
    lam, mu = law.lame, law.G
    if name == "stress":
        return 2 * [np.sqrt(1 - law.nu * (s**2 - 1))]
    if name == "strain":
        return np.sqrt(1 - law.nu / (1 - law.nu) * (s**2 - 1)), 1.0
    power = 2 if name == "rubber" else 1  # mu (a^2 - 1) + lam ln J = 0
    a = brentq(lambda a: mu * (a * a - 1) + lam * np.log(s * a**power), 0.3, 1.0)
    return a, a if power == 2 else 1.0


@pytest.mark.parametrize("name", LAWS)
def test_a_strip_of_a_material_in_uniaxial_stress(name, tmp_path):
    """Force, energy, stress at points, in files and in pictures, all in closed form."""
    law, s = LAWS[name], 1.3
    strip_ = solid_of(strip(0, 2, 4, y0=H / 2), law, ElementQuad1(), name="strip")
    scene = Scene(strip_).fix("left", "u^1").fix("bottom", "u^2").fix("right", "u^1", 2 * (s - 1))
    state = scene.solve_static()
    a, t = laterals(name, s)
    lam, mu, J = law.lame, law.G, s * a * t
    if "rubber" in name:
        S, S_zz = mu * (1 - 1 / s**2) + lam * np.log(J) / s**2, lam * np.log(J) * (t == 1.0)
        energy = 0.5 * mu * (s**2 + a**2 + t**2 - 3) - mu * np.log(J) + 0.5 * lam * np.log(J)**2
    else:
        modulus = E if name == "stress" else E / (1 - law.nu**2)
        S = modulus * 0.5 * (s**2 - 1)
        S_zz, energy = law.nu * S * (name == "strain"), 0.25 * S * (s**2 - 1)
    sigma, sigma_zz = s**2 * S / J, t**2 * S_zz / J
    mises = np.sqrt(sigma**2 - sigma * sigma_zz + sigma_zz**2)
    assert_allclose(state.reactions("right").force, (s * S * H * WIDTH, 0.0),
                    rtol=1e-9, atol=1e-6)
    assert_allclose(state.strain_energy, energy * 2 * H * WIDTH, rtol=1e-9)
    assert_allclose(state.displacement((2, H))[1], H * (a - 1), rtol=1e-9)
    for at in ((0.7, 0.03), [(0.7, 0.03), (1.9, 0.08)]):
        one = np.ones(np.shape(at)[:-1])
        assert_allclose(state.stress(at, strip_), [S * one, 0 * one, 0 * one], atol=1e-8 * S)
        assert_allclose(state.field("von_mises", at, strip_), mises * one, rtol=1e-9)
        assert_allclose(state.field("energy", at, "strip"), energy * one, rtol=1e-9)
        assert_allclose(state.strain(at, strip_)[1], 0.5 * (a**2 - 1) * one, rtol=1e-9)
    mesh = meshio.read(state.save(tmp_path / "strip.vtu"))
    assert_allclose(mesh.point_data["stress"], np.outer(
        np.ones(len(mesh.points)), [S, 0, S_zz, 0, 0, 0]), atol=1e-8 * S)
    assert_allclose(mesh.point_data["cauchy_stress"][:, [0, 2]], np.outer(
        np.ones(len(mesh.points)), [sigma, sigma_zz]), rtol=1e-8, atol=1e-8 * S)
    assert_allclose(mesh.point_data["von_mises"], mises, rtol=1e-8)
    drawn = [c.get_array() for c in state.plot("von_mises").collections
             if c.get_array() is not None]
    assert_allclose(drawn[0], mises, rtol=1e-8)


def test_rubber_in_simple_shear():
    """sigma = mu (gamma^2, gamma), without a volume change; the principal axes of the strain."""
    law, g = LAWS["rubber strain"], 0.7
    block = solid_of(strip(0, 1, 3, height=1.0), law)
    u = block.velocity_of(lambda x: np.array([g * x[1], 0 * x[1]]))  # a field of the element
    state = Scene(block).state(u)
    inside = np.setdiff1d(np.arange(block.N), block.numbers(block.basis.get_dofs().all()))
    assert_allclose(block.force(u)[inside], 0.0, atol=1e-9 * E)
    found = state.field("cauchy_stress", (0.4, 0.1), block)
    assert_allclose(found, law.G * np.array([g * g, 0.0, g]), atol=1e-9 * E)
    C = np.array([[1, g], [g, 1 + g * g]])
    assert_allclose([state.field(f"eps_{k}", (0.4, 0.1), block) for k in (2, 1)],
                    0.5 * (np.linalg.eigvalsh(C) - 1), atol=1e-10)


def test_a_material_gives_what_its_forms_give():
    mesh = strip(0, 2, 16)
    solid = solid_of(mesh, LAWS["stress"])
    state = Scene(solid).clamp("left").load(pull, "right").solve_static()
    assert_allclose(state.displacement((2, 0)), cantilever(16), rtol=1e-8)
    u, other = state.u_of(solid), domain_of(mesh)
    assert_allclose(solid.energy(u), other.energy(u), rtol=1e-10)
    assert_allclose(solid.total_mass, 2 * H * WIDTH * RHO, rtol=1e-12)
    assert_allclose(solid.matrix(u).toarray(), other.matrix(u).toarray(), atol=1e-9 * E)
    copy = pickle.loads(pickle.dumps(solid))
    assert np.array_equal(copy.force(u), solid.force(u)) and copy.material.E == E


def test_a_modulus_and_a_density_that_vary():
    """A bar with E = E0 / (1 + x): elongation F L (1 + L / 2) / (E0 A); and its mass."""
    law = StVenantKirchhoff(lambda x, y: E / (1 + x), 0.0, density=lambda x, y: RHO * (1 + y))
    bar = solid_of(strip(0, 1, 16, y0=H / 2), law)
    scene = Scene(bar).fix("left", "u^1").fix("bottom", "u^2")
    state = scene.load(LinearForm(lambda v, w: v[0] / H), "right").solve_linear()
    assert_allclose(state.displacement((1, 0.05))[0], 1.5 / (E * H * WIDTH), rtol=1e-4)
    assert_allclose(state.stress((0.75, 0.02), bar)[0], 1.0 / (H * WIDTH), rtol=1e-3)
    assert_allclose(bar.total_mass, RHO * WIDTH * H * (1 + H / 2), rtol=1e-12)


def test_stress_goes_on_from_a_domain_to_a_beam(tmp_path):
    solid, beam = solid_of(strip(0, 1, 16), LAWS["stress"], name="root"), beam_of(1, 2)
    scene = Scene(beam, solid).clamp("left", solid).point_force((0, -1), at=(2, 0), beam=beam)
    scene.weld((solid, "right"), (beam, "left"))
    state = scene.solve_static()
    for x, member in ((0.5, solid), (1.5, beam)):
        M = 2.0 - x  # of a force of 1, small deflections
        assert_allclose(state.stress((x, H / 2), member)[0], 6 * M / (WIDTH * H**2), rtol=2e-2)
    mesh = meshio.read(state.save(tmp_path / "both.vtu"))
    assert np.isfinite(mesh.point_data["von_mises"]).all()
    drawn = [c for c in state.plot("S_xx").collections if c.get_array() is not None]
    assert sum(len(c.get_array()) for c in drawn) > 32 * 9 + 16 * 9


def test_domains_whose_stress_is_not_known():
    with pytest.raises(InputError, match="history"):
        solid_of(strip(0, 1, 2), ElasticPlastic(E, 0.3, yield_stress=1e3))
    with pytest.raises(InputError, match="E\\(x, y\\).*positive.*-"):
        solid_of(strip(0, 1, 2), StVenantKirchhoff(lambda x, y: x - 0.5, 0.3))
    with pytest.raises(InputError, match="material"):
        solid_of(strip(0, 1, 2), 2e11)
    light = solid_of(strip(0, 1, 2), StVenantKirchhoff(E, 0.3))
    with pytest.raises(InputError, match="density"):
        Scene(light).clamp("left").gravity((0, -9.81))
    stiff = BilinearForm(lambda u, v, w: ddot(grad(u), grad(v)))
    with pytest.raises(InputError, match=r"a\.form\(w\['u'\], v, w\)"):
        Domain(light.basis, stiff, stiff)
    linear = Domain(light.basis, LinearForm(lambda v, w: stiff.form(w["u"], v, w)), stiff)
    u = np.cos(np.arange(linear.N))
    assert_allclose(linear.force(u), linear.matrix() @ u, rtol=0, atol=1e-12)
    state = Scene(domain_of(strip(0, 1, 2))).clamp("left").state()
    assert_allclose(state.strain((0.5, 0.0), 0), np.zeros(3))
    with pytest.raises(InputError, match="Domain.solid"):
        state.stress((0.5, 0.0), 0)


# what is refused


def test_bases_that_are_no_domain():
    quads = MeshQuad().refined(1)
    with pytest.raises(InputError, match="use an ElementVector"):
        Domain(Basis(quads, ElementQuad2()), *forms())
    with pytest.raises(InputError, match="plane"):
        Domain(Basis(MeshTet(), ElementVector(ElementTetP1())), *forms())
    with pytest.raises(InputError, match="Basis of scikit-fem"):
        Domain(quads, *forms())
    with pytest.raises(InputError, match="LinearForm"):
        Domain(Basis(quads, ElementVector(ElementQuad1())), *forms()[::-1])
    with pytest.raises(InputError, match="tangent.*residual"):
        Domain(Basis(quads, ElementVector(ElementQuad1())), forms()[0],
               BilinearForm(lambda u, v, w: ddot(sym_grad(u), sym_grad(v))))
    with pytest.raises(CallbackError, match="w.'u'."):
        Domain(Basis(quads, ElementVector(ElementQuad1())),
               LinearForm(lambda v, w: ddot(w["prev"].grad, grad(v))), forms()[1])
    with pytest.raises(InputError, match="whole mesh"):
        Domain(Basis(quads, ElementVector(ElementQuad1()), elements=[0]), *forms())


def test_places_and_loads_that_are_not_of_a_domain():
    solid, beam = domain_of(strip(0, 1, 4)), beam_of(1, 2, 4)
    scene = Scene(beam, solid)
    with pytest.raises(NameUnknown, match="rihgt.*right"):
        scene.clamp("rihgt", solid)
    with pytest.raises(MeshError, match="no facet"):
        scene.clamp(lambda x: x[0] > 7, solid)
    with pytest.raises(NameUnknown, match="r\\^3"):
        scene.fix("left", "r^3", beam=solid)
    with pytest.raises(InputError, match="scene.load"):
        scene.pressure("right", 1.0, solid)
    with pytest.raises(MeshError, match="outside"):
        scene.state().displacement((1.5, 0), solid)
    with pytest.raises(InputError, match="depends on its forms"):
        scene.state().stress((0.5, 0), solid)
    with pytest.raises(InputError, match="has no mass"):
        Scene(Domain(solid.basis, *forms())).clamp("left").gravity((0, -9.81))


def test_interfaces_that_do_not_meet():
    solid = domain_of(strip(0, 1, 4))
    for beam, place in ((beam_of(1.1, 2, 4), "left"), (beam_of(1, 2, 4), "right")):
        with pytest.raises(InputError, match="does not meet"):
            Scene(beam, solid).weld((solid, "right"), (beam, place))
    thin = Beam(MeshBeam.init_line([1, 1.5, 2], 0.5 * H), ElementBeamANCF(2),
                StVenantKirchhoff(E, NU), WIDTH)
    with pytest.raises(InputError, match="as high as the boundary"):
        Scene(thin, solid).weld((solid, "right"), (thin, "left"))
    cable = beam_of(1, 2, 4, ElementBeamCable(5))
    with pytest.raises(InputError, match="not straight"):
        Scene(cable, solid).weld((solid, ["right", "top"]), (cable, "left"))
    with pytest.raises(InputError, match="apart"):
        Scene(cable, solid).weld((solid, "left"), (cable, "left"))
    with pytest.raises(InputError, match="boundary"):
        Scene(beam_of(1, 2, 4, name="b"), solid).weld((solid, (1, 0)), ("b", "left"))
