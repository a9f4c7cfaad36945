"""Materials with a history: plasticity and relaxation, against closed forms."""

import copy
import pickle
import sys
import warnings

import numpy as np
import pytest
from numpy.testing import assert_allclose

from skfem_ancf import (Beam, Circle, ConvergenceError, ElasticPlastic, ElementBeamANCF,
                        ElementBeamANCFCubic, ElementBeamCable, Frame, InputError, KelvinVoigt,
                        MeshBeam, ModelWarning, Prony, Scene, Section, StVenantKirchhoff, Voce)
from skfem_ancf.materials import HistoryMaterial

E, NU, YIELD, H, B, L = 2e11, 0.3, 2.5e8, 0.01, 0.01, 0.1
KAPPA = 2.0 * YIELD / (E * H)  # first yielding
M_Y = E * B * H**3 / 12.0 * KAPPA
#: Perfect plasticity bends evenly in these: their clamps let the sections contract.
EVEN = [ElementBeamCable(3), ElementBeamCable(5), ElementBeamANCF(2), ElementBeamANCF(3),
        ElementBeamANCFCubic(2)]


def name(element):
    return f"{type(element).__name__[11:]}({element.order or element.axis_degree})"


def bent(element, material, angles, times=(0.0, 1.0), increments=12, ne=8, width=B):
    """A cantilever whose end turns; its position is free. Scene, and the run."""
    beam = Beam(MeshBeam.init_line(np.linspace(0.0, L, ne + 1), height=H), element, material,
                width=width)
    scene = Scene(beam).clamp("left")
    scene.joint("angle", at="right", angle=lambda t: np.interp(t, times, angles))
    return scene, scene.run(list(times[1:]), increments=increments)


def moment(k):
    """Of an ideally plastic rectangle, over that of first yielding, at a curvature over KAPPA."""
    k = np.abs(k)
    return np.where(k < 1.0, k, 1.5 - 0.5 / np.maximum(k, 1.0) ** 2)


def states(history, point=(L / 2, 0.0)):
    """Moment over M_Y, and curvature over KAPPA, at all instants."""
    found = history.resultants(point, recover=False)
    return found.M / M_Y, found.curvature / KAPPA


# laws

HARDENING = [0.0, 3e9, Voce(1e8, 20.0, 1e8), [[0.0, YIELD], [1e-3, 2.7e8], [5e-3, 2.8e8]]]


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("kinematic", [0.0, 5e9])
@pytest.mark.parametrize("hardening", HARDENING, ids=["perfect", "linear", "Voce", "table"])
def test_the_consistent_tangent_and_the_yield_surface(plane, kinematic, hardening):
    law, rng = ElasticPlastic(E, NU, YIELD, hardening, kinematic, plane=plane), (
        np.random.default_rng(1))
    before = law.stress(6e-3 * rng.standard_normal((3, 40)), np.zeros((7, 40)), 0.0)[1]
    strain, d = 6e-3 * rng.standard_normal((3, 40)), 1e-8 * rng.standard_normal((3, 40))
    S, D, after = law.evaluate(strain, before, 0.0)
    high, low = (law.stress(strain + s * d, before, 0.0)[0] for s in (1.0, -1.0))
    change = 2.0 * np.einsum("ij...,j...->i...", D, d)
    assert np.max(np.abs(high - low - change)) < 1e-6 * np.max(np.abs(change))
    ratio = law.outputs(strain, after, S)["yield_ratio"]
    assert np.all(ratio < 1.0 + 1e-10) and np.sum(ratio > 1.0 - 1e-10) > 20
    # von Mises of the stress less the back stress, from all components
    x = S - after[3:6]
    z = law.out_of_plane(strain, after, S)[1] + (plane == "strain") * (after[3] + after[4])
    xi = np.array([[x[0], x[2], 0 * z], [x[2], x[1], 0 * z], [0 * z, 0 * z, z]])
    xi = xi - np.trace(xi) / 3.0 * np.eye(3)[..., None]
    assert_allclose(np.sqrt(1.5 * np.sum(xi**2, axis=(0, 1))) / law.yield_at(after[6]), ratio,
                    rtol=1e-10)
    # a state is the start of the next increment
    assert_allclose(law.stress(strain, after, 0.0)[0], S, atol=1e-9 * YIELD)


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("hardening", HARDENING, ids=["perfect", "linear", "Voce", "table"])
def test_a_strain_far_beyond_yield_costs_what_a_small_one_does(plane, hardening):
    """Corrections of iterates strain slender beams far; their returns end at round-off."""
    law, rng = ElasticPlastic(E, NU, YIELD, hardening, plane=plane), np.random.default_rng(2)
    strain, calls = rng.standard_normal((3, 200)), []

    def count(size):
        calls.clear()
        sys.setprofile(lambda frame, event, arg: event == "call" and calls.append(frame))
        try:
            S, _, after = law.evaluate(size * KAPPA * H * strain, np.zeros((7, 200)), 0.0)
        finally:
            sys.setprofile(None)
        ratio = law.outputs(size * KAPPA * H * strain, after, S)["yield_ratio"]
        assert_allclose(ratio[ratio > 0.99], 1.0, rtol=1e-12 * max(10.0, size))
        return len(calls)

    assert count(1e4) <= 2 * count(3.0)


@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_a_bar_hardens_as_its_table_says(plane):
    """Axial stress of monotone loading; a plane strain bar yields at 2 / sqrt(3) of the stress."""
    table = np.array([[0.0, YIELD], [2e-3, 3e8], [8e-3, 3.3e8]])
    law = ElasticPlastic(E, 0.4999 if plane == "strain" else NU, YIELD, table, plane=plane)
    history = np.zeros((7, 1))
    for strain in np.linspace(0.0, 9e-3, 200)[1:]:
        S, _, history = law.axial(np.array([strain]), history, 0.0)
    c = 2.0 / np.sqrt(3.0) if plane == "strain" else 1.0
    assert_allclose(history[6], c * (strain - S[0] / law.axial_modulus), rtol=1e-3)
    assert_allclose(S[0], c * np.interp(history[6, 0], *table.T), rtol=1e-3)


@pytest.mark.parametrize("hardening", HARDENING, ids=["perfect", "linear", "Voce", "table"])
def test_a_fibre_in_plane_strain_is_a_point_without_lateral_stress(hardening):
    """Through cycles, with back stress: stress, modulus, all history variables, stored energy."""
    law, rng = ElasticPlastic(E, NU, YIELD, hardening, 5e9, plane="strain"), (
        np.random.default_rng(3))
    history = np.zeros((7, 20))
    for _ in range(4):
        strain = 5e-3 * rng.standard_normal(20)
        S, D, after = law.axial(strain, history, 0.0)
        full = np.array([strain, 0.0 * strain, 0.0 * strain])
        for _ in range(40):
            stress, moduli, found = law.evaluate(full, history, 0.0)
            full[1] -= stress[1] / moduli[1, 1]
        assert_allclose(stress[1:], 0.0, atol=1e-12 * YIELD)
        assert_allclose(S, stress[0], atol=1e-11 * YIELD)
        assert_allclose(D, moduli[0, 0] - moduli[0, 1] * moduli[1, 0] / moduli[1, 1], rtol=1e-9)
        for rows, size in ((slice(0, 3), KAPPA * H), (slice(3, 6), YIELD), (6, KAPPA * H)):
            assert_allclose(after[rows], found[rows], atol=1e-11 * size)
        assert_allclose(law.axial_energy(strain, after), law.energy(full, found), rtol=1e-11)
        history = after


def test_dissipated_work_is_not_negative_and_what_is_stored_comes_back():
    law, rng = ElasticPlastic(E, NU, YIELD, Voce(1e8, 50.0), 4e9), np.random.default_rng(2)
    way, n, history = 8e-3 * rng.standard_normal((3, 30)), 1000, np.zeros((7, 30))
    work, S0 = 0.0, np.zeros((3, 30))
    for k in range(n):
        S, history = law.stress(way * (k + 1) / n, history, 0.0)
        work, S0 = work + 0.5 * np.sum((S + S0) * way / n, axis=0), S
    lost = work - law.energy(way, history)
    # plastic work is yield stress times accumulated strain, without what hardening stores
    assert_allclose(lost, YIELD * history[6], rtol=2e-3)


# sections

@pytest.mark.parametrize("element", EVEN, ids=name)
def test_moment_and_curvature_of_an_ideally_plastic_section(element):
    """M / M_y = 1.5 - 0.5 (k_y / k)^2, up to six times the curvature of first yielding."""
    _, run = bent(element, ElasticPlastic(E, NU, YIELD, points=20), [0.0, 6.0 * KAPPA * L])
    found = np.abs(np.array([state.multipliers[0] for state in run])) / M_Y
    M, k = states(run)
    assert_allclose(found[1:], moment(k)[1:], rtol=5e-3)  # no locking, in sections either
    assert_allclose(M[1:], moment(k)[1:], rtol=2e-2)  # of the stress, linear between points
    assert np.all(run.iterations_at[1:] < 3 * 6)


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCFCubic(2)], ids=name)
def test_plane_strain_yields_at_a_higher_moment(element):
    """At nu = 0.499 first yielding is at 2 / sqrt(3) of the yield stress, and so is the limit."""
    c, nu, k = 2.0 / np.sqrt(3.0), 0.499, 5.0
    first = c * KAPPA * (1.0 - nu**2)
    _, run = bent(element, ElasticPlastic(E, nu, YIELD, 1e-3 * E, plane="strain", points=20),
                      [0.0, k * first * L], increments=20)
    found = abs(run.state(-1).multipliers[0]) / (c * M_Y)
    assert_allclose(found, moment(k), rtol=2e-2)


def test_points_across_are_as_many_as_asked():
    """The default is right to 1 %, 5 points to 6 %."""
    worst, hard = [], 1e-3 * E
    part = hard / (E + hard)
    for points in (None, 5, 24):
        law = ElasticPlastic(E, NU, YIELD, hard, **({} if points is None else {"points": points}))
        _, run = bent(ElementBeamCable(3), law, [0.0, 4.0 * KAPPA * L], increments=60, ne=1)
        M, k = states(run)
        exact = (1.0 - part) * moment(k) + part * k
        worst.append(np.max(np.abs(M[5:] / exact[5:] - 1.0)))
    assert 5e-3 < worst[0] < 1e-2 and 2e-2 < worst[1] < 6e-2 and worst[2] < 4e-3


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(3)], ids=name)
def test_a_slender_strip_below_yield_is_solved_as_an_elastic_one(element):
    """The first correction strains it far beyond yield; the equilibrium does not yield."""
    def tip(material):
        beam = Beam(MeshBeam.init_line(np.linspace(0.0, 1.0, 17), height=H), element, material,
                    width=B)
        scene = Scene(beam).clamp("left", thickness="free")
        return scene.point_force((0.0, -0.7 * M_Y), at="right").solve_static()

    law = ElasticPlastic(E, NU, YIELD, 1e9)
    yields, elastic = tip(law), tip(StVenantKirchhoff(E, NU))
    assert "given up" not in yields.message
    assert np.all(yields.field("plastic_strain", np.array([[0.0, 0.5], [0.004, 0.0]])) == 0.0)
    assert_allclose(yields.displacement("right"), elastic.displacement("right"), rtol=1e-8)


@pytest.mark.parametrize("element", EVEN[1:], ids=name)
def test_springback_and_residual_stress(element):
    """Bent to 3 k_y, the end is let go: elastic in all points, from M(k) to zero."""
    law = ElasticPlastic(E, NU, YIELD, 1e-4 * E, points=20)
    scene, run = bent(element, law, [0.0, 3.0 * KAPPA * L])
    held, beam = run.state(-1), scene.system.beams[0]
    k = states(run)[1][-1]
    free = Scene(beam).clamp("left").run(2.0, increments=2, start=held)
    _, after = states(free)
    assert_allclose(after[-1], k - moment(k), rtol=5e-3)
    assert free.dissipated[-1] == pytest.approx(free.dissipated[0], rel=1e-6)
    eta = np.array([-1.0, -0.8, -0.5, 0.5, 0.8, 1.0])
    S = free.state(-1).stress(np.array([0.0 * eta + L / 2, eta * H / 2]))[0] / YIELD
    assert_allclose(S, np.clip(-eta * k, -1.0, 1.0) + eta * moment(k), atol=2.5e-2)
    resultants = free.state(-1).resultants((L / 2, 0.0), recover=False)
    assert abs(resultants.M) < 3e-3 * M_Y


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCFCubic(2)], ids=name)
def test_fields_of_a_bent_strip_at_points_and_in_files(element, tmp_path):
    """At k = 3 k_y with kinematic hardening: plastic strain, back stress, and their integrals."""
    hard, b = E / 20.0, E / 20.0
    _, run = bent(element, ElasticPlastic(E, NU, YIELD, kinematic=hard, points=20),
                  [0.0, 3.0 * KAPPA * L])
    state, eta = run.state(-1), np.array([-0.95, -0.6, -0.2, 0.4, 0.9])
    points = np.array([0.0 * eta + L / 2, eta * H / 2])
    plastic = np.maximum(np.abs(3.0 * eta) - 1.0, 0.0) * YIELD / (E + b)
    assert_allclose(state.field("plastic_strain", points), plastic, atol=3e-2 * plastic.max())
    back = state.field("back_stress", points)
    assert_allclose(back[0], -np.sign(eta) * hard * plastic, atol=5e-2 * hard * plastic.max())
    assert_allclose(state.field("dissipated", points), YIELD * plastic,
                    atol=3e-2 * YIELD * plastic.max())
    # its integral over the strip is what the run has lost
    Y = np.linspace(-0.5, 0.5, 201) * H
    lost = state.field("dissipated", np.array([0.0 * Y + L / 2, Y]))
    mean = np.sum(0.5 * (lost[1:] + lost[:-1])) / 200.0
    assert_allclose(mean * B * H * L, run.dissipated[-1], rtol=5e-2)
    meshio = pytest.importorskip("meshio")
    everything = meshio.read(state.save(tmp_path / "all.vtu")).point_data
    assert {"plastic_strain", "yield_ratio", "dissipated", "back_stress"} <= set(everything)
    file = state.save(tmp_path / "strip.vtu", fields=("stress", "plastic_strain", "back_stress"))
    read = meshio.read(file)
    largest = read.point_data["plastic_strain"].max()  # at the clamp, in sections
    slack = 0.2 if state.beams[0].has_sections else 0.05
    assert_allclose(largest, 2.0 * YIELD / (E + b), rtol=slack)
    state.plot("yield_ratio")


def test_a_cycle_closes_and_is_the_masing_curve():
    """Bilinear fibres with kinematic hardening: the branch is the first one, magnified by 2."""
    hard, top = E / 20.0, 4.0 * KAPPA * L
    law = ElasticPlastic(E, NU, YIELD, kinematic=hard, points=20)
    _, run = bent(ElementBeamCable(5), law, [0.0, top, -top, top], (0.0, 1.0, 3.0, 5.0), 20, 2)
    M, k = states(run)
    first, back, again = (np.argmin(np.abs(run.t - t)) for t in (1.0, 3.0, 5.0))
    assert_allclose(M[again], M[first], rtol=1e-10)
    part = hard / (E + hard)  # of the tangent in the stiffness
    virgin = (1.0 - part) * moment(k[:first + 1]) + part * k[:first + 1]
    assert_allclose(M[1:first + 1], virgin[1:], rtol=5e-3)
    branch = slice(first + 1, back + 1)
    half = 0.5 * (k[first] - k[branch])
    masing = M[first] - 2.0 * ((1.0 - part) * moment(half) + part * half)
    assert_allclose(M[branch], masing, atol=8e-3 * M[first])
    # isotropic hardening instead grows from cycle to cycle
    _, run = bent(ElementBeamCable(5), ElasticPlastic(E, NU, YIELD, hard, points=20),
                  [0.0, top, -top, top], (0.0, 1.0, 3.0, 5.0), 20, 2)
    M, _ = states(run)
    assert M[again] > 1.02 * M[first]


def test_layers_yield_each_on_its_own():
    """A soft elastic core between plastic faces: the faces' moment, b t y (h - t) at full yield."""
    t, core = 0.1 * H, StVenantKirchhoff(1e-3 * E, NU)
    face = ElasticPlastic(E, NU, YIELD, points=8)
    section = Section.layers((t, face), (H - 2 * t, core), (t, face), width=B)
    for element in (ElementBeamCable(3), ElementBeamANCF(2)):
        beam = Beam(MeshBeam.init_line(np.linspace(0, L, 5), height=H), element, section=section)
        scene = Scene(beam).clamp("left")
        scene.joint("angle", at="right", angle=lambda t: 10.0 * KAPPA * L * t)
        state = scene.run(1.0, increments=10).state(-1)
        elastic = 1e-3 * E * B * (0.8 * H) ** 3 / 12.0 * 10.0 * KAPPA
        assert_allclose(abs(state.multipliers[0]), B * t * YIELD * (H - t) + elastic, rtol=6e-3)
        ratio = state.field("yield_ratio", np.array([[L / 2, L / 2], [0.0, 0.49 * H]]))
        assert np.isnan(ratio[0]) and ratio[1] == pytest.approx(1.0, abs=1e-2)


@pytest.mark.parametrize("profile, sizes, width", [
    ("circle", {}, lambda Y: 2.0 * np.sqrt(np.maximum(H * H / 4 - Y * Y, 0.0))),
    ("I", {"width": H, "web": 0.1 * H, "flange": 0.15 * H},
     lambda Y: np.where(np.abs(Y) > 0.35 * H, H, 0.1 * H))])
def test_moments_of_profiles(profile, sizes, width):
    """Against the integral of the stress over many fibres, in elastic, partly and fully plastic."""
    Y = np.linspace(-0.5, 0.5, 20001) * H
    beam = Beam(MeshBeam.init_line(np.linspace(0, L, 3), height=H), ElementBeamCable(3),
                ElasticPlastic(E, NU, YIELD, 1e-4 * E), section=Section.profile(profile, **sizes))
    scene = Scene(beam).clamp("left")
    scene.joint("angle", at="right", angle=lambda t: 4.0 * KAPPA * L * t)
    for state in list(scene.run(1.0, increments=8))[1:]:
        stress = np.clip(4.0 * state.t * KAPPA * E * Y, -YIELD, YIELD)
        exact = np.sum(width(Y) * stress * Y) * (Y[1] - Y[0])
        assert_allclose(abs(state.multipliers[0]), exact, rtol=1e-2)


@pytest.mark.parametrize("element", EVEN[:2], ids=name)
def test_a_strip_whose_width_varies(element):
    """Under one moment the narrow end of a cable bends most; the angle is the integral."""
    hard, part = E / 50.0, 1.0 / 51.0
    law = ElasticPlastic(E, NU, YIELD, hard, points=20)

    def width(x):
        return B * (1.0 + 10.0 * x)

    angle, k = 2.5 * KAPPA * L, np.linspace(0.0, 40.0, 40001)
    _, run = bent(element, law, [0.0, angle], width=lambda x, y: width(x))
    M = abs(run.state(-1).multipliers[0])
    x, moments = (np.arange(1000) + 0.5) * L / 1000.0, np.linspace(1.0, 4.0, 301) * M_Y
    curvature = np.interp(moments[:, None] / (M_Y / B * width(x)),
                          (1.0 - part) * moment(k) + part * k, k)
    exact = np.interp(angle, KAPPA * L * curvature.mean(axis=1), moments)
    assert_allclose(M, exact, rtol=1e-2)
    # the elastic law, as a law with a history
    elastic, same = (bent(element, one, [0.0, 1e-2 * angle], increments=1,
                          width=lambda x, y: width(x))[1] for one in (
        StVenantKirchhoff(E, NU), ElasticPlastic(E, NU, 1e30)))
    assert_allclose(same.u[-1], elastic.u[-1], rtol=0, atol=1e-10)


# structures

def test_collapse_load_of_a_fixed_beam_with_plastic_hinges():
    """Clamped at both ends, pushed in the middle: P = 8 M_p / L, with M_p = b h^2 y / 4."""
    length, h, b = 1.0, 0.02, 0.02
    law = ElasticPlastic(E, NU, YIELD, points=20)
    fine = 0.25 * (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, 15)))  # small ones at the hinges
    beam = Beam(MeshBeam.init_line(np.append(fine, 0.5 + fine[1:]), height=h),
                ElementBeamCable(3), law, width=b)
    scene = Scene(beam).clamp("left").fix("right", ["r^2", "r_X^2"])  # it may slide: no catenary
    scene.fix((length / 2, 0.0), "r^2", displacement=lambda t: -0.025 * t)
    run = scene.run(1.0, increments=30)
    P = -run.reactions((length / 2, 0.0)).force[:, 1]
    M_p = 0.25 * b * h**2 * YIELD
    assert_allclose(P[-5:], 8.0 * M_p / length, rtol=1e-2)
    assert abs(run.state(-1).resultants((0.0, 0.0)).M) / M_p == pytest.approx(1.0, abs=0.02)
    # balance: the work of the load is stored and dissipated
    v = 0.025 * run.t
    work = np.concatenate([[0.0], np.cumsum(0.5 * (P[1:] + P[:-1]) * np.diff(v))])
    balance = run.strain_energy + run.dissipated
    assert_allclose(balance[-1], work[-1], rtol=1e-3)
    assert run.dissipated[-1] > 0.5 * work[-1]


def test_collapse_load_of_a_portal():
    """Fixed feet, a push at the corner: four hinges, P = 4 M_p / height."""
    h, b = 0.02, 0.02
    frame = Frame.from_lines(
        [(0, 0), (0, 1), (1, 1), (1, 0)], [(0, 1), (1, 2), (2, 3)], height=h, width=b, elements=40,
        material=ElasticPlastic(E, NU, YIELD, points=20))
    frame.hold(0, ["x", "y", "angle"]).hold(3, ["x", "y", "angle"])
    run = frame.settle(1, x=lambda t: 0.09 * t).run(1.0, increments=20)
    left, right = (run.resultants(foot) for foot in ((0.0, 0.0), (1.0, 0.0)))
    M_p = 0.25 * b * h**2 * YIELD
    assert_allclose(np.abs([left.M[-1], right.M[-1]]), M_p, rtol=1e-2)
    assert_allclose(left.force[-1, 0] - right.force[-1, 0], 4.0 * M_p, rtol=1e-2)


def test_collapse_loads_by_continuation():
    """Of the fixed beam and of the portal above, under loads that are not prescribed."""
    h, b = 0.02, 0.02
    M_p, law = 0.25 * b * h**2 * YIELD, ElasticPlastic(E, NU, YIELD, points=20)
    fine = 0.25 * (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, 15)))
    beam = Beam(MeshBeam.init_line(np.append(fine, 0.5 + fine[1:]), height=h),
                ElementBeamCable(3), law, width=b)
    scene = Scene(beam).clamp("left").fix("right", ["r^2", "r_X^2"])
    scene.point_force((0.0, -8.0 * M_p), at=(0.5, 0.0))
    path = scene.continuation(ds=2e-3, until=lambda p: p.displacement((0.5, 0.0))[1] < -0.025)
    assert_allclose(path.load[-5:], 1.0, rtol=1e-2)
    # the state between yielding and collapse is that of a run with the same displacements
    k = int(np.argmin(np.abs(path.load - 0.9)))
    assert path.state(k).field("plastic_strain", (1e-3, 0.0099)) > 0.0
    w = path.displacement((0.5, 0.0))[:, 1]
    held = Scene(beam).clamp("left").fix("right", ["r^2", "r_X^2"])
    held.fix((0.5, 0.0), "r^2", displacement=lambda t: w[k] * t)
    run = held.run(1.0, increments=30)
    P = -run.reactions((0.5, 0.0)).force[-1, 1] / (8.0 * M_p)
    assert_allclose(path.load[k], P, rtol=2e-3)
    portal = Frame.from_lines(
        [(0, 0), (0, 1), (1, 1), (1, 0)], [(0, 1), (1, 2), (2, 3)], height=h, width=b, elements=40,
        material=law).hold(0, ["x", "y", "angle"]).hold(3, ["x", "y", "angle"])
    path = portal.point_force((4.0 * M_p, 0.0), at=1).continuation(
        ds=5e-3, until=lambda p: p.displacement((0.0, 1.0))[0] > 0.09)
    assert_allclose(path.load[-1], 1.0, rtol=1e-2)


def test_a_column_buckles_at_its_tangent_modulus_load():
    """Shanley: it branches off there, and the load rises, to less than the reduced modulus load."""
    h, length = 0.02, 0.1
    tangent = 0.2 / 1.2  # of the modulus
    beam = Beam(MeshBeam.init_line(np.linspace(0.0, length, 9), height=h), ElementBeamCable(5),
                ElasticPlastic(E, NU, YIELD, 0.2 * E), width=h)
    euler = np.pi**2 * E * h**4 / 12.0 / (4.0 * length**2)
    scene = Scene(beam).clamp("left").point_force((-euler, 0.0), at="right")
    path = scene.continuation(ds=1e-5, ds_max=1e-4, max_load=1.5 * tangent)
    first, = path.critical_points
    assert first.kind == "bifurcation" and not path.stable[-1]
    assert_allclose(first.load, tangent, rtol=5e-3)
    branch = scene.continuation(branch=first, ds=2e-4, steps=80,
                                until=lambda p: abs(p.displacement("right")[1]) > 0.1 * length)
    reduced = 4.0 * tangent / (1.0 + np.sqrt(tangent)) ** 2
    assert 1.2 * tangent < branch.load.max() < reduced
    # one side unloads elastically: its plastic strain is that of the bifurcation
    faces = np.array([[0.001, 0.001], [0.0099, -0.0099]])
    before = first.state.field("plastic_strain", faces[:, 0])
    early = branch.state(int(np.argmax(branch.load > 1.1 * first.load)))
    sides = early.field("plastic_strain", faces)
    assert sides.max() > 2.0 * before and sides.min() < 1.2 * before


@pytest.mark.parametrize("element, plane", [
    (ElementBeamCable(5), "stress"), (ElementBeamCable(5), "strain"),
    (ElementBeamANCF(2), "stress")], ids=str)
def test_work_is_stored_or_dissipated(element, plane):
    """Of the moment on a bent strip, to 1e-6: bent, bent back, and through."""
    top = 3.0 * KAPPA * L
    law = ElasticPlastic(E, NU, YIELD, 1e-2 * E, 1e-2 * E, plane=plane)
    _, run = bent(element, law, [0.0, top, -top], (0.0, 1.0, 2.0), 60)
    M, angle = (np.array(x) for x in zip(*((
        state.multipliers[0], np.interp(t, [0.0, 1.0, 2.0], [0.0, top, -top]))
        for t, state in zip(run.t, run))))
    work = np.sum(0.5 * (M[1:] + M[:-1]) * np.diff(angle))
    stored = run.strain_energy[-1] + run.dissipated[-1]
    assert abs(abs(work) - stored) < 1e-6 * stored


# relaxation and creep

SHARES, TIMES = [0.3, 0.2], [1.0, 10.0]


def polymer(**more):
    return Prony(StVenantKirchhoff(1e9, 0.0, **more), SHARES, TIMES)


def relaxation(t):
    return 1.0 - sum(g * (1.0 - np.exp(-t / tau)) for g, tau in zip(SHARES, TIMES))


def creep(t):
    """Inverse of the relaxation: J* = 1 / (s^2 R*), by partial fractions."""
    a, b = (1.0 / tau for tau in TIMES)
    slow = np.polymul([1.0, a], [1.0, b])
    R = (1.0 - sum(SHARES)) * slow + np.polyadd(
        SHARES[0] * np.polymul([1.0, 0.0], [1.0, b]), SHARES[1] * np.polymul([1.0, 0.0], [1.0, a]))
    poles = np.roots(np.polymul([1.0, 0.0], R))
    slopes = np.polyder(np.polymul([1.0, 0.0], R))
    return sum((np.polyval(slow, p) / np.polyval(slopes, p) * np.exp(p * t)).real for p in poles)


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(2)], ids=name)
def test_creep_of_a_cantilever(element):
    """A load that stays: the deflection grows as the creep compliance, to 1e-4."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 0.5, 5), height=H), element, polymer(), width=B)
    scene = Scene(beam).clamp("left").point_force((0.0, -1e-6), at=(0.5, 0.0))
    at_once = scene.solve_static().displacement((0.5, 0.0))[1]
    run = scene.run([1e-9, 5.0, 25.0], increments=100)
    w = run.displacement((0.5, 0.0))[:, 1]
    assert_allclose(w / at_once, creep(run.t), rtol=1e-4)
    assert creep(25.0) > 1.8
    # balance of energy: the load acts from the start, then it stays
    work = 0.5e-6 * abs(at_once) + 1e-6 * np.abs(w - at_once)
    assert_allclose(run.strain_energy + run.dissipated, work, rtol=1e-6)


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(2)], ids=name)
def test_relaxation_of_a_cantilever(element):
    """A deflection that stays, reached at a constant rate: exact in increments of any size."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 0.5, 5), height=H), element, polymer(), width=B)
    scene = Scene(beam).clamp("left")
    scene.fix("right", "r^2", displacement=lambda t: -1e-6 * np.minimum(t, 1.0))
    run = scene.run([1.0, 4.0, 30.0], increments=2)
    force = run.reactions("right").force[:, 1]
    ramp = 1.0 - sum(g * (1.0 - tau * -np.expm1(-1.0 / tau)) for g, tau in zip(SHARES, TIMES))
    elastic = force[2] / ramp  # at the end of the ramp
    later = run.t > 1.0
    # the ramp is a superposition of steps
    s, w = np.polynomial.legendre.leggauss(40)
    exact = [np.sum(0.5 * w * relaxation(t - 0.5 * (s + 1.0))) for t in run.t[later]]
    assert_allclose(force[later] / elastic, exact, rtol=1e-6)
    at_once = Scene(beam).clamp("left").fix("right", "r^2", 1e-6).solve_static()
    assert abs(elastic) == pytest.approx(3.0 * 1e9 * B * H**3 / 12.0 / 0.5**3 * 1e-6, rel=2e-2)
    assert at_once.load == 1.0


@pytest.mark.parametrize("scheme", ["generalized-alpha", "energy-momentum", "newmark", "gauss",
                                    "radau"])
def test_logarithmic_decrement_with_one_prony_term(scheme):
    """Of s^2 (1 + s tau) + omega^2 (1 + s tau - g) = 0, to 1e-3."""
    rho, length, g = 1000.0, 0.5, 0.1
    omega = 1.8751040687**2 * np.sqrt(1e9 * H**2 / (12.0 * rho * length**4))
    tau = 1.0 / omega
    roots = np.roots([tau, 1.0, omega**2 * tau, omega**2 * (1.0 - g)])
    s = roots[np.argmax(roots.imag)]
    period = 2.0 * np.pi / s.imag
    beam = Beam(MeshBeam.init_line(np.linspace(0, length, 3), height=H), ElementBeamCable(5),
                Prony(StVenantKirchhoff(1e9, 0.0, rho), [g], [tau]), width=B)
    scene = Scene(beam).clamp("left")
    mode = scene.modes(1).mode(0, displacement=1e-5)
    history = scene.integrate(2.2 * period, period / 200, scheme=scheme, start=mode)
    w = history.displacement((length, 0.0))[:, 1]
    w = w * np.sign(w[0])
    k, = np.nonzero((w[1:-1] > w[:-2]) & (w[1:-1] > w[2:]))
    low, peak, high = w[k], w[k + 1], w[k + 2]
    tops = peak - 0.125 * (high - low) ** 2 / (high - 2.0 * peak + low)
    assert np.log(tops[0] / tops[1]) == pytest.approx(-s.real * period, rel=1e-3)
    total = history.total_energy + history.dissipated
    limit = {"generalized-alpha": 1e-5, "energy-momentum": 1e-10, "newmark": 1e-7}.get(scheme, 5e-4)
    assert np.ptp(total) < limit * total[0]


# motion, and what remembers

def thrown(material, **more):
    beam = Beam(MeshBeam.init_line(np.linspace(0, 0.2, 7), height=H), ElementBeamCable(3), material,
                width=B, **more)
    return Scene(beam).clamp("left").initial_velocity((0.0, 20.0))


@pytest.mark.parametrize("scheme", ["generalized-alpha", "energy-momentum"])
def test_a_bar_hit_hard_stays_bent(scheme):
    steel = ElasticPlastic(E, NU, YIELD, 1e-2 * E, 1e-2 * E, density=7800.0)
    scene = thrown(steel)
    history = scene.integrate(3e-3, 2e-5, scheme=scheme)
    total = history.total_energy + history.dissipated
    assert np.all(np.diff(history.dissipated) > -1e-9 * total[0])
    assert history.dissipated[-1] > 0.5 * total[0]
    assert np.ptp(total) < (1e-8 if scheme == "energy-momentum" else 2e-2) * total[0]
    w = history.displacement((0.2, 0.0))[:, 1]
    elastic = thrown(StVenantKirchhoff(E, NU, 7800.0)).integrate(3e-3, 2e-5, scheme=scheme)
    v = elastic.displacement((0.2, 0.0))[:, 1]
    assert w[-50:].min() > 0.5 * w.max() and v[-50:].min() < 0.1 * v.max()


@pytest.mark.parametrize("scheme", ["gauss", "radau"])
def test_collocation_says_where_yielding_brings_energy_in(scheme):
    """In steps that do not resolve the waves of stress; others agree with "energy-momentum"."""
    steel = ElasticPlastic(E, NU, YIELD, 1e-2 * E, density=7800.0)
    with pytest.warns(ModelWarning, match="brought in .* of the energy.*'energy-momentum'"):
        thrown(steel).integrate(2e-4, 1e-5, scheme=scheme)
    fine = thrown(steel).integrate(2e-5, 1e-6, scheme=scheme)
    right = thrown(steel).integrate(2e-5, 1e-6)
    tip = (0.2, 0.0)
    assert_allclose(fine.displacement(tip)[-1], right.displacement(tip)[-1], rtol=1e-3, atol=1e-9)


def test_a_named_material_yields_at_its_strength():
    steel = ElasticPlastic.named("S235", ("N", "mm"), hardening=1000.0)
    assert (steel.yield_stress, steel.hardening, steel.title) == (235.0, 1000.0, "S235")
    assert ElasticPlastic.named("S355", yield_stress=3.4e8).yield_stress == 3.4e8
    with pytest.raises(InputError, match="S235"):
        ElasticPlastic.named("S234")


@pytest.mark.parametrize("element", [ElementBeamCable(5), ElementBeamANCF(2)], ids=name)
def test_an_iteration_evaluates_the_law_once(element):
    """The mixed iteration linearises where the last tangent was."""
    calls = []

    class Counted(ElasticPlastic):
        def evaluate(self, strain, history, dt):
            calls.append(strain.shape)
            return super().evaluate(strain, history, dt)

        def axial(self, strain, history, dt):
            calls.append(strain.shape)
            return super().axial(strain, history, dt)

    law = Counted(E, NU, YIELD, 1e-2 * E)
    scene, _ = bent(element, law, [0.0, 1e-3 * KAPPA * L], increments=1)
    calls.clear()
    run = scene.run(1.0, increments=4)
    # and at the start of the first increment, at both ends of each, and for the verdict
    assert len(calls) <= run.iterations + 7 * len(run)


def test_an_elastic_law_with_a_history_is_that_law():
    """Below the yield stress, to round-off: force, tangent, modes, motion."""
    plain, same = StVenantKirchhoff(E, NU, 7800.0), ElasticPlastic(E, NU, 1e30, density=7800.0)
    for element in EVEN:
        mesh, found, stress = MeshBeam.init_line(np.linspace(0, 1, 5), height=0.1), [], []
        for law in (plain, same):
            beam = Beam(mesh, element, law, width=B)
            scene = Scene(beam).clamp("left").point_force((0.0, -2e5), at=(1.0, 0.0))
            state = scene.solve_static()
            motion = scene.integrate(2e-3, 2e-4)
            column = Scene(beam).clamp("left").point_force((-1e5, 0.0), at=(1.0, 0.0))
            pressed = column.solve_static()
            more = Scene(beam).clamp("left").point_force((-1.0, 0.0), at=(1.0, 0.0))
            found.append((state.u, scene.modes(3, state).frequencies, motion.u[-1],
                          state.strain_energy, column.buckling(1).factors,
                          more.buckling(1, pressed).factors))
            stress.append(state.stress((0.5 + 0.25 * 0.211325, 0.02), recover=False)[0])
        assert_allclose(*stress, rtol=1e-2)  # linear between points
        for a, b in zip(*found):
            assert_allclose(b, a, rtol=1e-8, atol=1e-8 * np.max(np.abs(a)))


def test_schemes_of_any_choice_and_step_agree():
    """By "auto", with damping of the material besides, and at instants within the steps."""
    steel, point = ElasticPlastic(E, NU, YIELD, 1e-2 * E, density=7800.0), (0.2, 0.0)
    fine = thrown(steel).integrate(4e-4, 2.5e-6, scheme="newmark")
    for scene, options in ((thrown(steel), {"scheme": "auto", "dt": 5e-6}),
                           (thrown(steel), {"scheme": "hht", "dt": 5e-6}),
                           (thrown(steel, damping=KelvinVoigt(1e-9)), {"dt": 5e-6})):
        history = scene.integrate(4e-4, t_eval=[0.0, 1.03e-4, 4e-4], **options)
        assert_allclose(history.displacement(point)[-1], fine.displacement(point)[-1], rtol=1e-2)
        assert_allclose(history.dissipated[-1], fine.dissipated[-1], rtol=3e-2)
        if str(history.scheme) == "<EnergyMomentum>":
            total = history.total_energy + history.dissipated
            assert np.ptp(total) < 1e-9 * total[0]
        assert len(history) == 3


def test_a_motion_and_a_run_go_on_from_states_copies_files(tmp_path):
    steel = ElasticPlastic(E, NU, YIELD, 1e-2 * E, density=7800.0)
    scene = thrown(steel)
    whole = scene.integrate(8e-4, 1e-5, scheme="generalized-alpha")
    half = scene.integrate(4e-4, 1e-5, scheme="generalized-alpha")
    for state in (half.state(-1), copy.copy(half.state(-1))):
        rest = scene.integrate(8e-4, 1e-5, scheme="generalized-alpha", start=state)
        assert_allclose(rest.u[-1], whole.u[-1], rtol=0.0, atol=1e-12)
    again = pickle.loads(pickle.dumps(half.state(-1)))
    point = (0.01, 0.004)
    assert again.field("plastic_strain", point) == half.state(-1).field("plastic_strain", point) > 0
    file = tmp_path / "run.npz"
    stored = scene.integrate(8e-4, 1e-5, scheme="generalized-alpha", checkpoint=file, every=20)
    assert_allclose(stored.u[-1], whole.u[-1], rtol=0.0, atol=1e-13)
    assert_allclose(scene.resume(file).state(-1).memory, whole.state(-1).memory)
    # nothing depends on what was asked in between
    assert_allclose(whole.state(40).strain_energy, whole.strain_energy[40], rtol=1e-12)
    assert scene.integrate(1e-4, 1e-5).dissipated[0] == 0.0


def test_plasticity_and_contact_together():
    """A wire is pressed around a drum and let go: both histories are in the same states."""
    wire = ElasticPlastic(E, NU, YIELD, 1e-3 * E)
    beam = Beam(MeshBeam.init_line(np.linspace(0, 0.2, 17), height=0.002), ElementBeamCable(3),
                wire, width=0.002)
    scene = Scene(beam).clamp("left").obstacle(Circle((0.03, -0.051), 0.05), friction=0.2)
    scene.fix("right", "r^2", displacement=lambda t: -0.1 * np.interp(t, [0, 1, 2], [0, 1, 0]))
    run = scene.run([1.0, 2.0], increments=20)
    k = run.resultants((0.03, 0.0), recover=False).curvature
    top = np.argmin(np.abs(run.t - 1.0))
    assert abs(k[top]) > 2.0 * 2.0 * YIELD / (E * 0.002)
    end = run.state(-1)
    assert abs(end.displacement((0.1, 0.0))[1]) > 1e-4 and run.dissipated[-1] > 0.0
    assert end.field("plastic_strain", (0.03, 0.0009)) > 1e-4


def test_an_obstacle_that_touches_the_beam_at_rest():
    """By round-off, at the start of a run, where nothing has moved yet."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 0.1, 9), height=0.002), ElementBeamCable(5),
                ElasticPlastic(E, NU, YIELD, 2e8), width=0.01)
    scene = Scene(beam).clamp("left").obstacle(Circle((0.0, -0.051), 0.05))
    scene.fix("right", "r^2", displacement=lambda t: -0.01 * t)
    run = scene.run(1.0, increments=3)
    assert run.displacement("right")[-1, 1] == pytest.approx(-0.01)


# one's own

class Damage(HistoryMaterial):
    """Modulus lost in proportion to the largest axial strain so far."""

    variables = {"largest": 1}  # noqa: RUF012

    def stress(self, strain, history, dt):
        largest = np.maximum(history, np.abs(strain[:1].real))
        kept = 1.0 - 20.0 * np.maximum(history, np.where(strain[:1].real < 0, -1, 1) * strain[:1])
        kept = np.where(largest > history, kept, 1.0 - 20.0 * history)
        return kept * np.tensordot(self.elastic, strain, 1), largest


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(2)], ids=name)
def test_a_law_of_ones_own_in_one_class(element):
    """A bar: (1 - 20 e) E e, then back along the secant; its derivative is by complex steps."""
    law = Damage(E, 0.0)
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 3), height=H), element, law, width=B)
    scene = Scene(beam).clamp("left", thickness="free")
    scene.fix("right", "r^1", displacement=lambda t: np.interp(t, [0, 1, 2], [0, 0.01, 0.004]))
    run = scene.run([1.0, 2.0], increments=4)
    N = np.array([state.resultants((0.5, 0.0), recover=False).N for state in run])
    stretch = 1.0 + np.interp(run.t, [0, 1, 2], [0, 0.01, 0.004])
    green = 0.5 * (stretch**2 - 1.0) if beam.has_sections else stretch - 1.0
    worst = np.maximum.accumulate(green)
    S = E * B * H * (1.0 - 20.0 * worst) * green
    assert_allclose(N, S * (stretch if beam.has_sections else 1.0), rtol=1e-4, atol=1e-3)
    found = run.state(-1).field(lambda v: v.output("largest"), (0.5, 0.0))
    assert found == pytest.approx(worst[-1], rel=1e-4)
    assert np.all(run.iterations_at[1:] < 18)


class Limited(HistoryMaterial):
    """Its lateral stress is at most 5e-3 E: from 0.3 eps_xx = 5e-3 on no lateral strain fits."""

    variables = {"largest": 1}  # noqa: RUF012

    def stress(self, strain, history, dt):
        S = self.E * np.array([strain[0], 0.3 * strain[0] + 5e-3 * np.tanh(200.0 * strain[1]),
                               0.4 * strain[2]])
        return S, np.maximum(history, np.abs(strain[:1].real))


def test_a_fibre_without_a_lateral_strain_is_said():
    """Increments are cut up to there; the error names the law."""
    beam = Beam(MeshBeam.init_line([0.0, 0.5, 1.0], height=H), ElementBeamCable(3),
                Limited(E, 0.0, 7800.0), width=B)
    scene = Scene(beam).clamp("left").fix("right", "r^1", displacement=lambda t: 0.03 * t)
    with pytest.raises(ConvergenceError, match=r"lateral strain of a fibre of .*Limited") as error:
        scene.run(1.0, increments=4)
    assert error.value.state.displacement("right")[-1, 0] == pytest.approx(5e-3 / 0.3, rel=0.02)
    free = Scene(beam).clamp("left").point_force((1.0, 0.0), at="right")
    with pytest.raises(ConvergenceError, match="lateral strain of a fibre"):
        free.point_force((0.1 * E * B * H, 0.0), at="right").integrate(1.0, 1e-3)


# what it refuses

def test_what_cannot_be_is_said():
    line = MeshBeam.init_line(np.linspace(0, 1, 3), height=0.1)
    steel = ElasticPlastic(E, NU, YIELD, density=7800.0, thermal_expansion=1e-5)
    with pytest.raises(InputError, match=r"order 1.*12 to 17 %"):
        _ = Beam(line, ElementBeamANCF(1), steel, width=B).kernel
    with pytest.raises(InputError, match=r"order 1.*12 to 17 %"):
        _ = Beam(line, ElementBeamANCF(1), steel, width=B, formulation="continuum").kernel
    for formulation in ("ecm", "strain-split"):
        with pytest.raises(InputError, match="constant moduli"):
            _ = Beam(line, ElementBeamANCF(2), steel, width=B, formulation=formulation).kernel
    nearly = ElasticPlastic(E, 0.49, YIELD, plane="strain")
    with pytest.raises(InputError, match=r"lock in plane strain.*Cubic"):
        _ = Beam(line, ElementBeamANCF(2), nearly, width=B).kernel
    beam = Beam(line, ElementBeamANCF(2), steel, width=B)
    scene = Scene(beam).clamp("left").point_force((0.0, -1.0), at=(1.0, 0.0))
    with pytest.raises(InputError, match="back in time"):
        scene.integrate(1e-3, 1e-4, scheme="energy-momentum-4")
    graded = StVenantKirchhoff(lambda x, y: E * (1.0 + x), NU)
    with pytest.raises(InputError, match="constant E in its other layers"):
        _ = Beam(line, ElementBeamCable(3), section=Section.layers(
            (0.05, graded), (0.05, steel), width=B)).kernel
    for wrong, text in ((dict(yield_stress=-1.0), "positive"), (dict(hardening=-1.0), "zero or"),
                        (dict(hardening=[[0.0, 1e8], [1.0, 2e8]]), "yield_stress = "),
                        (dict(kinematic=-1.0), "kinematic"), (dict(points=1), "points")):
        with pytest.raises(InputError, match=text):
            ElasticPlastic(**{"E": E, "nu": NU, "yield_stress": YIELD, **wrong})
    for shares, times, text in (([0.6, 0.5], [1.0, 2.0], "below 1"), ([0.5], [-1.0], "times")):
        with pytest.raises(InputError, match=text):
            Prony(StVenantKirchhoff(E, NU), shares, times)
    for call, text in ((lambda: ElasticPlastic(E, NU), r"\(E, nu, yield_stress, ...\): .*'yield_s"),
                       (lambda: Voce(1e8), r"Voce\(saturation, rate, ...\): missing .*'rate'"),
                       (lambda: Voce(1e8, -20.0), "rate must be zero or positive, got -20"),
                       (lambda: Prony(steel, [0.5], [1.0], 2, 3), "too many positional")):
        with pytest.raises(InputError, match=text):
            call()
    with pytest.raises(InputError, match=r"table \(n, 2\) or Voce\(saturation, rate\), got 'voce'"):
        ElasticPlastic(E, NU, YIELD, hardening="voce")
    with pytest.raises(InputError, match="must be elastic"):
        Prony(steel, [0.5], [1.0])
    with pytest.raises(InputError, match="number for E"):
        ElasticPlastic(lambda x, y: E, NU, YIELD)


def test_wrong_derivatives_and_shapes_of_a_law_are_said():
    line = MeshBeam.init_line(np.linspace(0, 1, 3), height=0.1)

    class Wrong(HistoryMaterial):
        def stress(self, strain, history, dt):
            return np.tensordot(self.elastic, strain, 1), history

        def moduli(self, strain, history, dt):
            return 2.0 * self.elastic[..., None] + 0.0 * strain[0]

    class Short(Wrong):
        moduli = HistoryMaterial.moduli

        def stress(self, strain, history, dt):
            return strain[:2], history

    class Alone(Short):
        def stress(self, strain, history, dt):
            return np.tensordot(self.elastic, strain, 1)

    class Fewer(Short):
        def stress(self, strain):
            return strain, ()

    class Listed(Short):
        variables = ["flow"]  # noqa: RUF012

    class InPlace(Short):
        variables = {"flow": 3}  # noqa: RUF012

        def stress(self, strain, history, dt):
            history[:] = 0.5 * strain
            return np.tensordot(self.elastic, strain - history, 1), history

    class Moves(InPlace):
        def stress(self, strain, history, dt):
            return np.tensordot(self.elastic, strain - history, 1), 0.5 * (strain + history)

    class Infinite(InPlace):
        def stress(self, strain, history, dt):
            return strain / (strain[0] - strain[0]).real, history

    for law, text in ((Wrong, "is not the derivative"), (Short, "shapes"), (Alone, "return a pair"),
                      (Fewer, "raised TypeError"), (Listed, r"as {.damage.: 1}, got \['flow'\]"),
                      (InPlace, "changes the history that it is given: return a new array"),
                      (Moves, "the same stress again, in a further increment of dt = 0"),
                      (Infinite, "finite numbers")):
        with pytest.raises(InputError, match=text), np.errstate(all="ignore"):
            _ = Beam(line, ElementBeamANCF(2), law(E, NU), width=B).kernel


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(2)], ids=name)
def test_a_column_that_yields_before_it_buckles_is_said(element):
    """Euler's load of a stocky column is beyond yield, that of a slender one is not."""
    law = ElasticPlastic(E, 0.0, YIELD, 0.1 * E)
    for length, yields in ((10 * H, True), (100 * H, False)):
        mesh = MeshBeam.init_line(np.linspace(0, length, 9), height=H)
        column = Scene(Beam(mesh, element, law, width=B)).pin("left").fix("right", "r^2")
        column = column.point_force((-B * H * YIELD, 0), at="right")
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            factor = column.buckling(1).factors[0]
        assert (factor > 1.0) == yields
        assert ["yields before the buckling load" in str(one.message) for one in said] == (
            [True] * yields)


def test_fields_that_a_law_does_not_give_are_not_zero():
    state = stretched_by(Damage(E, 0.0))
    assert state.field(lambda v: v.output("largest"), (0.5, 0.0)) > 0.0
    for name in ("plastic_strain", "dissipated", "back_stress"):
        with pytest.raises(InputError, match=rf"{name}.*no value.*outputs\(strain, history"):
            state.field(name, (0.5, 0.0))
    assert np.isnan(state.field(lambda v: v.output("larger"), (0.5, 0.0)))
    assert np.isnan(state.field(lambda v: v.variable("larger"), (0.5, 0.0)))
    relaxed = stretched_by(Prony(StVenantKirchhoff(E, 0.0), [0.5], [1.0]))
    assert relaxed.field("plastic_strain", (0.5, 0.0)) == 0.0
    with pytest.raises(InputError, match="dissipated.*no value"):
        relaxed.field("dissipated", (0.5, 0.0))


def stretched_by(law):
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 3), height=H), ElementBeamCable(3), law,
                width=B)
    return Scene(beam).clamp("left").point_force((E * B * H * 1e-4, 0), at="right").solve_static()


# temperature, eigenstrains, tapers

#: Thermal expansion, and the cooling of a clamped bar that strains it to 1.6 times first yielding.
ALPHA = 1.2e-5
COOLED = -1.6 * YIELD / (E * ALPHA)


def restrained(element, law, amplitude, ne=2):
    """A bar between walls, which are too far apart for it when it cools."""
    beam = Beam(MeshBeam.init_line(np.linspace(0.0, L, ne + 1), height=H), element, law, width=B)
    scene = Scene(beam).clamp("left").clamp("right")
    if not beam.has_sections:
        return scene.temperature(COOLED, amplitude=amplitude)
    return scene.eigenstrain(xx=ALPHA * COOLED, amplitude=amplitude)  # across it does not contract


def there_and_back(t):
    return np.interp(t, [0.0, 1.0, 2.0], [0.0, 1.0, 0.0])


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(2), ElementBeamANCF(3),
                                     ElementBeamANCFCubic(2)], ids=name)
def test_a_bar_that_cools_between_walls_yields_and_keeps_a_stress(element):
    """Tension beyond yield, compression when it is warm again, and the plastic work."""
    hard = 4e9
    run = restrained(element, ElasticPlastic(E, 0.0, YIELD, hard, thermal_expansion=ALPHA),
                     there_and_back).run([1.0, 2.0], increments=16)
    flow = 0.6 * YIELD / (E + hard)  # plastic strain
    top = YIELD + hard * flow
    for k, stress in ((5, 0.5 * YIELD), (16, top), (32, top - 1.6 * YIELD)):
        state = run.state(k)
        assert run.t[k] in (0.3125, 1.0, 2.0)
        # walls hold sections, which plastic flow cannot thin there
        cable = isinstance(element, ElementBeamCable)
        near = 2e-3 if cable else 1e-2
        assert state.field("S_xx", (0.03, 0.002)) == pytest.approx(stress, rel=near)
        assert state.resultants((0.03, 0.0)).N == pytest.approx(stress * B * H, rel=near)
        assert state.reactions("right").force[0] == pytest.approx(stress * B * H, rel=near)
        assert state.field("plastic_strain", (0.03, 0.0)) == pytest.approx(
            flow if k > 5 else 0.0, rel=5e-3 if cable else 0.2, abs=1e-12)
        assert state.strain_energy == pytest.approx(
            (0.5 * stress**2 / E + (k > 5) * 0.5 * hard * flow**2) * B * H * L, rel=2 * near)
        assert state.field("energy", (0.03, 0.002)) * B * H * L == pytest.approx(
            state.strain_energy, rel=2e-3 if cable else 3e-2)
    assert run.dissipated[-1] == pytest.approx(YIELD * flow * B * H * L, rel=1e-2)


@pytest.mark.parametrize("scheme", ["energy-momentum", "generalized-alpha", "radau"])
def test_a_bar_that_cools_in_a_motion_has_the_stress_of_statics(scheme):
    law = ElasticPlastic(E, NU, YIELD, 4e9, density=7800.0, thermal_expansion=ALPHA)
    smooth = lambda t: np.sin(0.5 * np.pi * np.clip(t / 0.01, 0.0, 2.0)) ** 2
    run = restrained(ElementBeamCable(3), law, smooth).integrate(0.02, 5e-4, scheme=scheme)
    top = YIELD + 4e9 * 0.6 * YIELD / (E + 4e9)
    stress = [run.state(k).field("S_xx", (0.03, 0.002)) for k in (len(run) // 2, -1)]
    assert_allclose(stress, [top, top - 1.6 * YIELD], rtol=2e-3)


def test_relaxing_stress_of_a_bar_that_cools():
    """At once E alpha dT, then as the relaxation function."""
    law = Prony(StVenantKirchhoff(1e9, 0.3, thermal_expansion=ALPHA), SHARES, TIMES)
    scene = restrained(ElementBeamCable(3), law, lambda t: np.minimum(t / 1e-6, 1.0))
    run = scene.run([1e-6, 5.0], increments=20)
    after = run.t > 1e-6
    force = run.reactions("right").force[after, 0]
    assert_allclose(force, 1e9 * ALPHA * -COOLED * B * H * relaxation(run.t[after]), rtol=1e-4)


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(2)], ids=name)
@pytest.mark.parametrize("second", ["elastic", "plastic"])
def test_a_bimetal_bends_beyond_yield(element, second):
    """Its curvature, hot and cold again, against the balance of a section of many fibres."""
    def law(yields, alpha, modulus=E):
        if yields is None:
            return StVenantKirchhoff(modulus, 0.0, thermal_expansion=alpha)
        return ElasticPlastic(modulus, 0.0, yields, 2e9, points=40, thermal_expansion=alpha)

    low = 0.2 * YIELD
    given = [(low, 2.0 * ALPHA, E), (None if second == "elastic" else 2.0 * low, 0.0, 0.6 * E)]
    change = 8.0 * low / (E * ALPHA)
    section = Section.layers(*((0.5 * H, law(*one)) for one in given), width=B)
    beam = Beam(MeshBeam.init_line(np.linspace(0.0, L, 5), height=H), element, section=section)
    scene = Scene(beam).clamp("left")
    if beam.has_sections:  # no expansion across, of which this balance knows nothing
        scene = scene.eigenstrain(xx=lambda x, y: np.where(y < 0.0, 2.0 * ALPHA * change, 0.0),
                                  amplitude=there_and_back)
    else:
        scene = scene.temperature(change, amplitude=there_and_back)
    run = scene.run([1.0, 2.0], increments=20)
    found = run.resultants((0.5 * L, 0.0), recover=False).curvature[[20, 40]].ravel()

    y = (np.arange(4000) + 0.5) / 4000 * H - 0.5 * H
    modulus = np.where(y < 0.0, E, 0.6 * E)
    limit = np.where(y < 0.0, low, np.inf if second == "elastic" else 2.0 * low)
    alpha, flow, hardened = np.where(y < 0.0, 2.0 * ALPHA, 0.0), 0.0 * y, 0.0 * y
    e, k, expected = 0.0, 0.0, []
    for T in [*np.linspace(0.0, change, 81)[1:], *np.linspace(change, 0.0, 81)[1:]]:
        for _ in range(50):
            trial = modulus * (e - y * k - alpha * T - flow)
            excess = np.maximum(np.abs(trial) - limit - 2e9 * hardened, 0.0)
            more = excess / (modulus + 2e9)
            stress = trial - modulus * more * np.sign(trial)
            D = np.where(excess > 0.0, modulus * 2e9 / (modulus + 2e9), modulus)
            A = np.array([[D.sum(), -(D * y).sum()], [-(D * y).sum(), (D * y * y).sum()]])
            de, dk = np.linalg.solve(A, [-stress.sum(), (stress * y).sum()])
            e, k = e + de, k + dk
        flow, hardened = flow + more * np.sign(trial), hardened + more
        expected.append(k)
    hot, cold = expected[79], expected[159]
    assert_allclose(found, [hot, cold], atol=(1e-2 if beam.has_sections else 5e-4) * hot)
    assert cold < -0.035 * hot  # it stays bent, to the other side


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamCable(5), ElementBeamANCF(2)],
                         ids=name)
def test_a_tapered_strip_yields_where_it_is_thin(element):
    """Deflections under an end moment and after it, from M / M_Y of each section."""
    def height(x):
        return H * (1.0 - 0.5 * x / L)

    thin = B * (0.5 * H) ** 2 / 6.0 * YIELD
    law = ElasticPlastic(E, 0.0, YIELD, points=30)
    beam = Beam(MeshBeam.init_line(np.linspace(0.0, L, 9), height=height), element, law, width=B)
    run = Scene(beam).clamp("left").moment("right", 1.44 * thin, amplitude=there_and_back).run(
        [1.0, 2.0], increments=10)
    x = np.linspace(0.0, L, 40001)
    ratio, first = 1.44 * thin / (B * height(x) ** 2 / 6.0 * YIELD), 2.0 * YIELD / (E * height(x))
    k = first * np.where(ratio < 1.0, ratio, 1.0 / np.sqrt(3.0 - 2.0 * np.maximum(ratio, 1.0)))
    turn = np.concatenate([[0.0], np.cumsum(0.5 * (k[1:] + k[:-1]))]) * (x[1] - x[0])
    w = run.displacement((L, 0.0))[[10, 20], 1]
    assert w[0] == pytest.approx(np.mean(np.sin(turn)) * L, rel=5e-3)
    assert w[1] == pytest.approx(np.mean((k - first * ratio) * (L - x)) * L,
                                 rel=5e-2 if element.axis_degree > 3 else 0.15)
    if element.axis_degree > 3:
        found = run.state(10).resultants((0.9 * L, 0.0), recover=False)
        assert found.M == pytest.approx(1.44 * thin, rel=2e-3)


@pytest.mark.parametrize("element", [ElementBeamCable(3), ElementBeamANCF(2)], ids=name)
def test_perfect_plasticity_keeps_the_balance_of_energy(element):
    """The work of the support that bends a strip beyond yield and back is stored or dissipated."""
    beam = Beam(MeshBeam.init_line([0.0, 0.5 * L, L], height=H), element,
                ElasticPlastic(E, NU, YIELD), width=B)
    scene = Scene(beam).clamp("left").fix("right", "r^2",
                                          displacement=lambda t: 2.5e-3 * there_and_back(t))
    run = scene.run([1.0, 2.0], increments=20)
    force, w = run.reactions("right").force[:, 1], run.displacement((L, 0.0))[:, 1]
    work = np.append(0.0, np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(w)))
    assert_allclose(run.strain_energy + run.dissipated, work, rtol=0, atol=1e-6 * work.max())
    assert run.dissipated[-1] > 0.4 * work.max()


def test_the_energy_of_an_elastic_layer_beside_one_that_yields():
    section = Section.layers((0.5 * H, ElasticPlastic(E, NU, YIELD)),
                             (0.5 * H, StVenantKirchhoff(E, NU)), width=B)
    beam = Beam(MeshBeam.init_line([0.0, L], height=H), ElementBeamCable(3), section=section)
    state = Scene(beam).clamp("left").fix("right", "r^1", 0.5 * YIELD / E * L).solve_static()
    for y in (-0.2 * H, 0.2 * H):
        assert state.field("energy", (0.5 * L, y)) == pytest.approx(0.125 * YIELD**2 / E, rel=1e-6)
