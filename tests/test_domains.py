"""Domains: stock bases of scikit-fem with their forms in one scene with beams."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from skfem import (Basis, BilinearForm, ElementQuad1, ElementQuad2, ElementTetP1, ElementTriP2,
                   ElementVector, LinearForm, MeshQuad, MeshTet, MeshTri, condense, solve)
from skfem.helpers import ddot, dot, eye, grad, identity, mul, sym_grad, trace, transpose

from skfem_ancf import (Beam, CallbackError, Domain, ElementBeamANCF, ElementBeamCable, InputError,
                        MeshBeam, MeshError, NameUnknown, RigidBody, Scene, StVenantKirchhoff,
                        SupportError)

E, NU, RHO, WIDTH, H = 1e6, 0.3, 780.0, 0.1, 0.1


def forms(E=E, nu=NU, width=WIDTH):
    """St. Venant-Kirchhoff in plane stress with the Green-Lagrange strain."""
    lam, mu = E * nu / (1 - nu**2), E / (2 * (1 + nu))

    def stress(strain):
        return lam * eye(trace(strain), 2) + 2 * mu * strain

    def parts(u):
        F = grad(u) + identity(grad(u))
        return F, stress(0.5 * (mul(transpose(F), F) - identity(F)))

    @LinearForm
    def residual(v, w):
        F, S = parts(w["u"])
        return width * ddot(mul(F, S), grad(v))

    @BilinearForm
    def tangent(u, v, w):
        F, S = parts(w["u"])
        dE = mul(transpose(F), grad(u))
        return width * (ddot(mul(grad(u), S), grad(v))
                        + ddot(mul(F, stress(0.5 * (dE + transpose(dE)))), grad(v)))

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


def plain_newton(mesh, force, steps=8):
    """The tip of a cantilever all of Q2 by scikit-fem alone."""
    basis = Basis(mesh, ElementVector(ElementQuad2()))
    residual, tangent = forms()
    b = force * pull.assemble(basis.boundary("right"))
    fixed, x = basis.get_dofs("left"), basis.zeros()
    for k in range(1, steps + 1):
        for _ in range(20):
            u = basis.interpolate(x)
            r = k / steps * b - residual.assemble(basis, u=u)
            dx = solve(*condense(tangent.assemble(basis, u=u), r, D=fixed))
            x = x + dx
            if np.abs(dx).max() < 1e-11:
                break
    return basis.probes(np.array([[mesh.p[0].max() - 1e-12], [0.0]])) @ x


# statics


def test_a_domain_alone_is_what_scikit_fem_finds():
    mesh = strip(0, 2, 16)
    solid = domain_of(mesh)
    scene = Scene(solid).clamp("left").load(pull, "right")
    state = scene.solve_static()
    assert_allclose(state.displacement((2, 0)), plain_newton(mesh, 1.0), rtol=1e-8)
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
    tip = plain_newton(strip(0, 2, 32), 1.0)
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
    tip = plain_newton(strip(0, 2, 32), 1.0)
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
    whole = plain_newton(strip(0, 2, 16), 1.0)
    left, right = domain_of(strip(0, 1, 8), name="a"), domain_of(strip(1, 2, 8, 3), name="b")
    scene = Scene(left, right).clamp("left", left).load(pull, "right", right)
    scene.weld((left, "right"), (right, "left"))
    assert_allclose(scene.solve_static().displacement((2, 0), right), whole, rtol=2e-3)
    block = RigidBody(1.0, 1.0, position=(2.5, 0))
    scene = Scene(domain_of(strip(0, 2, 16)), block).clamp("left", "solid")
    scene.weld(("solid", "right"), block).equations
    state = scene.point_force((0, -1), (2, 0), block).solve_static()
    assert_allclose(state.displacement((2, 0), "solid"), whole, rtol=2e-3)


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


# what is refused


def test_bases_that_are_no_domain():
    quads = MeshQuad().refined(1)
    with pytest.raises(InputError, match="wrap the element"):
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
    with pytest.raises(InputError, match="no\n?.*cell"):
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
    with pytest.raises(InputError, match="its own forms"):
        scene.state().strain((0.5, 0), solid)
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
