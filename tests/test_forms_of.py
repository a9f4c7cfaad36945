"""Weak forms of a beam's own formulation, by stock assembly, against what a Scene solves with."""

import numpy as np
import pytest
from skfem import (Basis, BilinearForm, ElementVector, Functional, LinearForm, asm, condense,
                   enforce, solve)
from skfem.helpers import dot
from skfem.utils import mpc

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, InputError, MeshBeam,
                        NeoHookean, Scene, Section, StVenantKirchhoff, forms, reference_coordinates)
from skfem_ancf.elements import ELEMENTS
from skfem_ancf.formulations import FORMULATIONS

SHAPES = {**{name: make for name, make in ELEMENTS.items() if name[-1] not in "789"},  # as 6, 10
          **{f"cable-{n}": (lambda n=n: ElementBeamCable(n)) for n in (3, 5, 7)}}
LAWS = {"svk": StVenantKirchhoff(2.0, 0.3, density=1.7),
        "svk-strain": StVenantKirchhoff(2.0, 0.45, plane="strain"),
        "neo": NeoHookean(2.0, 0.3, plane="strain")}
BODIES = {
    "straight": lambda: MeshBeam.init_line([0.0, 0.5, 1.2], 0.2, angle=0.4),
    "arc": lambda: MeshBeam.init_curve(lambda s: np.array([np.cos(s), np.sin(s)]),
                                       np.linspace(0.0, 1.2, 3), 0.2),
}


def beams(element, formulation, law, body):
    """The Beam, or a skip where the package says that there is none."""
    try:
        return Beam(BODIES[body](), SHAPES[element](), LAWS[law], 0.4, formulation)
    except InputError as error:
        pytest.skip(str(error))


def coordinates(beam, seed=0):
    """Coordinates a little off those of the stress-free state."""
    scale = np.tile(np.repeat([beam.mesh.lengths.min()] + [
        beam.mesh.height ** min(0, 1 - f[2]) for f in beam.element.functionals[1:]], 2),
        beam.N // beam.nd)
    return beam.q0 + 0.05 * scale * np.random.default_rng(seed).uniform(-1, 1, beam.N)


def close(a, b, tol=1e-11):
    return np.abs(a - b).max() <= tol * np.abs(b).max()


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("element", SHAPES)
def test_own_forms_are_what_a_scene_solves_with(element, formulation, law, body):
    beam = beams(element, formulation, law, body)
    try:
        system = Scene(beam).system
        beam.kernel
    except InputError as error:
        pytest.skip(str(error))
    own, basis = forms.of(beam), Basis(beam.mesh, ElementVector(beam.element))
    q = coordinates(beam)
    u = q - beam.q0
    f, K = (asm(form, basis, r=q) for form in (own.internal_force, own.tangent))
    force, _ = system.assemble(u)
    assert close(f, force)
    assert close(K.toarray(), system.K.tocsc().toarray())
    assert abs(asm(own.energy, basis, r=q) - system.strain_energy(u)) < 1e-12 * abs(
        system.strain_energy(u))
    if formulation == "continuum" and 1 <= beam.element.order <= 4:  # the pairs take long
        k_s = beam.material.shear_factor(beam.element)
        for name, value in (("internal_force", f), ("tangent", K.toarray())):
            textbook = asm(getattr(forms.textbook, name)(beam.material, beam.width, k_s),
                           beam.basis, r=q)
            assert close(textbook if name == "internal_force" else textbook.toarray(), value)


def test_own_forms_are_derivatives_of_the_energy():
    """Central differences of the Functional, which no other code of the package takes part in."""
    beam = beams("ancf-3", "assumed", "svk", "arc")
    own, basis = forms.of(beam), Basis(beam.mesh, ElementVector(beam.element))
    q, dq = coordinates(beam), coordinates(beam, 1) - beam.q0
    eps = 1e-5
    U = [asm(own.energy, basis, r=q + s * eps * dq) for s in (1, -1)]
    f = [asm(own.internal_force, basis, r=q + s * eps * dq) for s in (1, -1)]
    assert (U[0] - U[1]) / (2 * eps) == pytest.approx(
        asm(own.internal_force, basis, r=q) @ dq, rel=1e-7)
    assert close((f[0] - f[1]) / (2 * eps), asm(own.tangent, basis, r=q) @ dq, 1e-7)


def test_newton_with_the_default_formulation_in_stock_scikit_fem():
    """Own Newton, stock condense and solve: the tip of the scene, to the tolerance of both."""
    mesh, element = MeshBeam.init_line(np.linspace(0, 1, 9), 0.05), ElementBeamANCF(3)
    beam = Beam(mesh, element, StVenantKirchhoff(2e8, 0.3), 0.05)
    own, basis = forms.of(beam), Basis(mesh, ElementVector(element))
    clamped = basis.get_dofs("left").all([n for n in beam.dofnames if "r_X" not in n])
    tip = basis.probes(np.array([[1.0], [0.0]]))
    load, q = tip.T @ np.array([0.0, -50.0]), reference_coordinates(basis)
    for _ in range(30):
        residual = load - asm(own.internal_force, basis, r=q)
        dq = solve(*condense(asm(own.tangent, basis, r=q), residual, D=clamped))
        q += dq
        if np.abs(dq).max() < 1e-10:
            break
    state = Scene(beam).clamp("left").point_force((0, -50), at=(1, 0)).solve_static()
    assert np.allclose(tip @ q - [1, 0], state.displacement((1, 0)), rtol=0, atol=1e-8)


def test_a_basis_or_coordinates_of_another_kind():
    mesh, element = MeshBeam.init_line([0.0, 0.5, 1.0], 0.1), ElementBeamANCF(2)
    own = forms.of(Beam(mesh, element, LAWS["svk"], 0.4))
    basis = Basis(mesh, ElementVector(element))
    q = reference_coordinates(basis)
    others = [Basis(mesh, ElementVector(ElementBeamANCF(3))), Basis(mesh, element),
              Basis(mesh.translated((0.1, 0)), ElementVector(element)), basis.boundary("left")]
    for form in own:
        for other in others:
            with pytest.raises(InputError, match="assemble it on"):
                asm(form, other, r=q)
        for r in (dict(), dict(r=q[:-1]), dict(r=basis.interpolate(q)), dict(r=q, k=1.0)):
            with pytest.raises(InputError, match="r=q, a vector of 24 numbers"):
                asm(form, basis, **r)
    inside = LinearForm(lambda v, w: own.internal_force(v, w))
    for r in (dict(), dict(r=q)):
        with pytest.raises(InputError, match="position with its degrees of freedom"):
            asm(inside, basis, **r)
    with pytest.raises(InputError, match="another basis"):
        asm(inside, basis, r=forms.position(Basis(mesh, ElementVector(element)), q))
    with pytest.raises(InputError, match="the same basis"):
        asm(own.tangent, basis, Basis(mesh, ElementVector(element)), r=q)


# composed with what is scikit-fem's

SHORT = Beam(MeshBeam.init_line(np.linspace(0, 1, 5), 0.05), ElementBeamANCF(2),
             StVenantKirchhoff(2e8, 0.3), 0.05)


def test_forms_inside_of_forms():
    """A beam on a bedding under a wind, by one form: the sum of what each alone gives."""
    own, basis = forms.of(SHORT), Basis(SHORT.mesh, ElementVector(SHORT.element))
    q = coordinates(SHORT)
    stiff = BilinearForm(lambda u, v, w: 3e5 * dot(u, v))
    wind = LinearForm(lambda v, w: 1e4 * dot(w.r, v))
    half = Functional(lambda w: 1.5e5 * dot(w.r, w.r))

    @LinearForm
    def residual(v, w):
        return 2.0 * own.internal_force(v, w) + wind.form(v, w)

    @BilinearForm
    def tangent(u, v, w):
        return own.tangent(u, v, w) + stiff.form(u, v, w)

    @Functional
    def energy(w):
        return own.energy(w) + half.form(w)

    r = forms.position(basis, q)
    assert close(asm(residual, basis, r=r),
                 2.0 * asm(own.internal_force, basis, r=q) + asm(wind, basis, r=q), 1e-13)
    assert close(asm(tangent, basis, r=r).toarray(),
                 (asm(own.tangent, basis, r=r) + asm(stiff, basis)).toarray(), 1e-13)
    assert asm(energy, basis, r=r) == pytest.approx(
        asm(own.energy, basis, r=q) + asm(half, basis, r=q), rel=1e-13)


def test_bases_of_some_elements_add_up_to_all():
    own, element = forms.of(SHORT), ElementVector(SHORT.element)
    q, whole = coordinates(SHORT), Basis(SHORT.mesh, element)
    parts = [Basis(SHORT.mesh, element, elements=e) for e in ([0, 2], [1, 3])]
    for form in own:
        both, one = asm(form, parts, r=q), asm(form, whole, r=q)
        for a, b in ((both, one), (sum(asm(form, part, r=q) for part in parts), one)):
            assert abs(a - b).max() <= 1e-13 * abs(b).max()
    # a softer half: inside of a form, on its elements alone
    half = LinearForm(lambda v, w: 0.5 * own.internal_force(v, w))
    assert close(asm(half, parts[1], r=forms.position(parts[1], q)),
                 0.5 * asm(own.internal_force, parts[1], r=q), 1e-13)


@pytest.mark.parametrize("how", [condense, enforce, mpc])
def test_newton_with_the_utilities_of_scikit_fem(how):
    """A cantilever whose end rolls, or is held as high as its middle, which feels nothing of it."""
    own, basis = forms.of(SHORT), Basis(SHORT.mesh, ElementVector(SHORT.element))
    weight = LinearForm(lambda v, w: -2e4 * v[1])
    clamped = SHORT.dofs("left", ["r", "r_Y0", "r_Y1"])
    end, middle = basis.get_dofs("right").all(["r^2"]), SHORT.dofs((0.5, 0.0), ["r^2"])
    held, T = np.append(clamped, end), np.append(np.zeros(len(clamped)), 1.0)[:, None]
    options = dict(S=held, M=middle, T=T) if how is mpc else dict(D=held)
    load, q = asm(weight, basis), reference_coordinates(basis)
    for _ in range(20):
        residual = load - asm(own.internal_force, basis, r=q)
        dq = solve(*how(asm(own.tangent, basis, r=q), residual, **options))
        q += dq
    assert np.abs(dq).max() < 1e-9
    scene, u = Scene(SHORT).clamp("left").load(weight), q - SHORT.q0
    scene.fix("right", "r^2", u[middle[0]] if how is mpc else 0.0)
    assert set(scene.free) == set(range(basis.N)) - set(held)
    assert np.allclose(u, scene.solve_static().u, rtol=0, atol=1e-8)


def test_beside_a_nonlinear_form_that_jax_differentiates():
    pytest.importorskip("jax")
    from skfem.autodiff import NonlinearForm
    from skfem.autodiff.helpers import ddot, grad, mul, transpose

    beam = Beam(MeshBeam.init_line([0.0, 0.5, 1.0], 0.2), ElementBeamANCF(1),
                StVenantKirchhoff(2.0, 0.3, shear_correction=1.0), 0.4, "continuum")
    own, q = forms.of(beam), coordinates(beam)

    @NonlinearForm(hessian=True)
    def strain(r, w):
        F = grad(r)
        E = 0.5 * (mul(transpose(F), F) - np.eye(2)[:, :, None, None])
        lame = 2.0 * 0.3 / (1 - 0.3**2), 2.0 / (2 * 1.3)
        return 0.4 * (0.5 * lame[0] * (E[0, 0] + E[1, 1])**2 + lame[1] * ddot(E, E))

    K, f = strain.assemble(beam.basis, x=q)
    assert close(-asm(own.internal_force, beam.basis, r=q), f)  # it is a right-hand side
    assert close((asm(own.tangent, beam.basis, r=q) + K).toarray(), 2.0 * K.toarray())

# the strain energy as an Energy

SECTIONS = {
    "straight": dict(mesh=MeshBeam.init_line([0.0, 0.5, 1.2], 0.2, angle=0.4), width=0.3),
    "arc": dict(mesh=BODIES["arc"](), width=0.3),
    "taper": dict(mesh=MeshBeam.init_line([0.0, 0.5, 1.2], height=lambda s: 0.2 - 0.05 * s),
                  width=lambda x, y: 0.3 + 0.1 * x),
    "layers": dict(mesh=MeshBeam.init_line([0.0, 0.5, 1.2], 0.2), section=Section.layers(
        (0.05, LAWS["svk-strain"]), (0.15, LAWS["neo"]), width=0.3)),
}


@pytest.mark.parametrize("law", ["svk", "neo"])
@pytest.mark.parametrize("name", SECTIONS)
@pytest.mark.parametrize("element", ["ancf-2", "cubic-2"])
def test_the_strain_energy_is_an_energy(element, name, law):
    """Of kernels and forms, of a law in NumPy at the points of full integration."""
    options = dict(SECTIONS[name])
    if name != "layers":
        options["material"] = LAWS[law]
    beam = Beam(element=SHAPES[element](), formulation="continuum", **options)
    energy, u = forms.strain_energy(beam).bind(beam), coordinates(beam) - beam.q0
    own = forms.of(beam)
    assert energy.potential(u) == pytest.approx(beam.kernel.energy(u), rel=1e-12)
    assert close(-energy.force(u), asm(own.internal_force, beam.basis, r=beam.q0 + u), 1e-12)
    i, j, v = energy.stiffness(u)
    K = np.zeros((beam.N, beam.N))
    np.add.at(K, (i, j), -v)
    assert close(K, asm(own.tangent, beam.basis, r=beam.q0 + u).toarray(), 1e-12)


def test_a_beam_with_its_strain_energy_twice_is_twice_as_stiff():
    one = Beam(SHORT.mesh, SHORT.element, SHORT.material, 0.05, "continuum")
    state = Scene(one).clamp("left").add(forms.strain_energy(one)).point_force(
        (0.0, -60.0), at=(1, 0)).solve_static()
    half = Scene(one).clamp("left").point_force((0.0, -30.0), at=(1, 0)).solve_static()
    assert np.allclose(state.u, half.u, rtol=0, atol=1e-9)
    assert state.strain_energy == pytest.approx(2.0 * half.strain_energy, rel=1e-9)
