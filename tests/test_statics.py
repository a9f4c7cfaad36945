"""Static solutions against the paper, closed forms, independent continuum codes, and balance."""

import exact
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root

from skfem_ancf import (Beam, ConvergenceError, ElementBeamANCF, ElementBeamPatelShabana,
                        InputError, MeshBeam, MeshError, NameUnknown, Scene, StVenantKirchhoff,
                        SupportError)
from skfem_ancf.formulations import FORMULATIONS
from skfem_ancf.materials import LinearLaw, Material
from skfem_ancf.solvers.increment import Increment

TIP = (1.0, 0.0)
GRAVITY = (0.0, -9.81)


def element(order):
    return ElementBeamPatelShabana() if order == "ps" else ElementBeamANCF(order)


def cantilever(order=3, n=16, L=1.0, h=0.01, b=0.01, E=2e8, nu=0.3, k="auto", plane="stress",
               grade=0, formulation="continuum", density=7800.0):
    """The beam of the paper's example 5.2; the element at the root is halved ``grade`` times."""
    x = np.linspace(0.0, L, n + 1)
    for _ in range(grade):
        x = np.insert(x, 1, x[1] / 2)
    material = StVenantKirchhoff(E, nu, density, plane, shear_correction=k)
    return Scene(Beam(MeshBeam.init_line(x, h), element(order), material, b, formulation))


def solved(scene, **options):
    state = scene.solve_static(**options)
    assert state.converged and state.load == 1.0
    return state


# the paper

ROOTS = {1: None, 2: ["r", "r_X", "r_Y0^1", "r_Y1^1"], 3: ["r", "r_X", "r_Y1", "r_Y0^1", "r_Y2^1"],
         4: ["r", "r_X", "r_Y0^1", "r_Y1^1", "r_Y2^1", "r_Y3^1"],
         "ps": ["r", "r_X", "r_Y", "r_YY^1"]}
TABLE_4 = {  # N = 4: ours, the paper's row cannot be right
    1: (-0.275739, -0.588096, -0.804809, -0.878510, -0.895754, -0.897565, -0.897727),
    2: (-0.329152, -0.636383, -0.826052, -0.888423, -0.901827, -0.903283, -0.903457),
    3: (-0.298501, -0.610744, -0.816100, -0.885455, -0.901573, -0.903302, -0.903478),
    4: (-0.329152, -0.636383, -0.826054, -0.888431, -0.901845, -0.903305, -0.903479),
    "ps": (-0.276487, -0.591087, -0.808041, -0.882732, -0.901202, -0.903271, -0.903456),
}


@pytest.mark.parametrize("order", TABLE_4)
def test_table_4(order):
    tips = []
    for k in range(7):
        scene = cantilever(order, 2 ** (k + 1), k="paper").fix("left", ROOTS[order])
        state = solved(scene.gravity(GRAVITY))
        assert len(state.steps) == 1 and state.iterations <= 30
        tips.append(state.displacement(TIP)[1])
    assert_allclose(tips, TABLE_4[order], rtol=0, atol=1.5e-6)


# roll-up at nu = 0

class RigidNormals(Material):
    """nu = 0 and a thickness that hardly changes: sections stay rigid and normal."""

    def law(self, k_s=1.0):
        return LinearLaw(np.diag([self.E, 1e3 * self.E, self.G]))


def pure_bending(order, M, h):
    """End angle of a body of unit length with EI = 1, its radius a polynomial of degree N in Y.

    ``r = R(Y)`` at the angle ``kappa X`` minimises the energy of the section; independent of any
    beam element. For N >= 3 it gives M / (EI kappa) = 1 - 0.5 (h kappa)^2 + O(h kappa)^4 and
    0.3 + 1/6 for N = 1, 2: radial stress makes the section thinner than rigid normals (0.3) do.
    """
    y, w = (a / 2 for a in np.polynomial.legendre.leggauss(20))
    V = y ** np.arange(order + 1)[:, None]
    dV = np.arange(order + 1)[:, None] * y ** np.maximum(np.arange(order + 1) - 1, 0)[:, None]

    def moment(x):  # x = h kappa, lengths by h
        def balance(c):
            s, t = x * c @ V, c @ dV
            return V @ (w * (s**2 - 1) * x * s) + dV @ (w * (t**2 - 1) * t)

        c = root(balance, np.eye(order + 1)[1] + np.eye(order + 1)[0] / x, tol=1e-14).x
        s = x * c @ V
        return 6 * w @ ((s**2 - 1) * s * (c @ V))  # of EI / h

    return brentq(lambda x: moment(x) - M * h, 0.8 * M * h, 1.3 * M * h, xtol=1e-13) / h


def roll_up(material, order, n, formulation, h=0.01, **options):
    mesh = MeshBeam.init_line(np.linspace(0, 1, n + 1), h)
    scene = Scene(Beam(mesh, ElementBeamANCF(order), material, 1.0, formulation))
    state = solved(scene.clamp("left").moment("right", 2 * np.pi), **options)
    return scene.loads[0].angle(state.u), state


@pytest.mark.parametrize("order", [1, 2, 3])
def test_roll_up_of_rigid_sections(order):
    """Closed form M / (EI kappa) = 1 - 0.3 (h kappa)^2: the end turns by 1.0011885806 x 2 pi."""
    material = RigidNormals(12e6, 0.0)
    runs = [roll_up(material, order, n, "assumed", first_step=0.1) for n in (64, 128)]
    angle = exact.rollup_end_angle(2 * np.pi, 12e6, 1.0, 0.01, 1.0)
    assert abs(angle / (2 * np.pi) - 1.0011885806) < 1e-9
    error = np.array([a for a, _ in runs]) - angle
    assert error[1] < 4e-3 and error[0] / error[1] > 3.9
    assert abs(error[1] - (error[0] - error[1]) / 3) < 5e-5  # extrapolated: 8e-6 of a turn
    kappa, stretch = exact.rollup_curvature(2 * np.pi, 12e6, 1.0, 0.01)
    x = 0.5 + (1 - 3**-0.5) / 2 / 128  # where the formulation samples eps_xx
    eps = [runs[1][1].strain((x, y))[0] for y in (-0.005, 0.0, 0.005)]
    assert_allclose(eps, [((stretch - kappa * y) ** 2 - 1) / 2 for y in (-0.005, 0, 0.005)],
                    atol=3e-5)


@pytest.mark.parametrize("order, coefficient", [(1, 0.3 + 1 / 6), (2, 0.3 + 1 / 6), (3, 0.5)])
def test_roll_up_of_the_body(order, coefficient):
    """A St. Venant-Kirchhoff body, whose sections get thinner as it bends."""
    material = StVenantKirchhoff(12e6, 0.0, shear_correction=1.0)
    angle = pure_bending(order, 2 * np.pi, 0.01)
    assert abs(angle / (2 * np.pi) - 1 - coefficient * (0.01 * angle) ** 2) < 1e-5
    error = np.array([roll_up(material, order, n, "assumed", method="newton")[0]
                      for n in (64, 128)]) - angle
    assert error[1] < 4e-3 and error[0] / error[1] > 3.9
    assert abs(error[1] - (error[0] - error[1]) / 3) < 5e-5
    error = np.abs(np.array([roll_up(material, order, n, "continuum", method="newton")[0]
                             for n in (32, 64, 128)]) - angle)
    assert error[2] < 1.7e-3 and error[0] / error[1] > 8 and error[1] / error[2] > 5


# large bending against the elastica and continuum codes

@pytest.mark.parametrize("order", [2, 3])
def test_elastica_under_a_tip_load(order):
    """P L^2 / EI = 10; the beam is thin, so that extension and shear (2e-6) hardly matter."""
    exact_tip = np.array([-0.55499559775, -0.8106090248803])
    error = []
    for n in (128, 256, 512):
        scene = cantilever(order, n, h=1e-3, b=1.0, E=12e9, nu=0.0, k=1.0).clamp("left")
        state = solved(scene.point_force((0, -10), at=TIP))
        error.append(np.abs(state.displacement(TIP) - exact_tip).max())
        assert len(state.steps) == 1 and state.iterations <= 30
    assert error[2] < 1.5e-6
    assert error[0] / error[1] > 14 and error[1] / error[2] > 14  # fourth order


GRAVITY_TIP = {"stress": (-0.741168, -0.903426), "strain": (-0.724577, -0.897657)}


@pytest.mark.parametrize("plane", GRAVITY_TIP)
def test_gravity_cantilever_as_continuum(plane):
    """Plane stress and plane strain to 2.5e-5 on 256 elements, finer at the welded root."""
    error = []
    for n in (64, 128, 256):
        scene = cantilever(5, n, k=1.0, plane=plane, grade=4).clamp("left").gravity(GRAVITY)
        error.append(solved(scene).displacement(TIP) - GRAVITY_TIP[plane])
    error = np.array(error)
    assert np.all(error > 0) and np.all(error[-1] < 2.5e-5)  # stiffer than the body
    assert np.all(error[0] / error[1] > 3.5) and np.all(error[1] / error[2] > 2)
    other = GRAVITY_TIP["strain" if plane == "stress" else "stress"]
    assert np.abs(np.array(other) - GRAVITY_TIP[plane]).max() > 200 * error[-1].max()


THICK = {  # nu, plane: tip of the continuum, and bounds on 128 elements of order 5
    (0.3, "stress"): ((-0.15792, -0.71438), 3.5e-4),
    (0.3, "strain"): ((-0.1346, -0.6625), 6.5e-4),
    (0.0, "stress"): ((-0.1578655, -0.7108136), 3.5e-5),
}


def thick(order, n, nu, plane, F=62.5e6, **options):
    scene = cantilever(order, n, L=2.0, h=0.5, b=0.1, E=2.07e11, nu=nu, k=1.0, plane=plane,
                       **options)
    return scene.clamp("left").traction("right", (0, -F / 0.05))


@pytest.mark.parametrize("nu, plane", THICK)
def test_thick_cantilever_as_continuum(nu, plane):
    tip, bound = THICK[nu, plane]
    error = []
    for n in (16, 32, 64, 128):
        state = solved(thick(5, n, nu, plane))
        assert len(state.steps) == 1 and state.iterations <= 18
        error.append(state.displacement((2, 0)) - tip)
    error = np.array(error)
    assert np.all(error > 0) and np.all(np.diff(error, axis=0) < 0)
    assert np.all(error[-1] < bound)
    assert np.all(error[0] / error[1] > 2.3)


# balance

@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("order", [1, 2, 3, "ps"])
def test_reactions_balance_the_loads(order, formulation):
    scene = cantilever(order, 8, h=0.05, b=0.02, formulation=formulation)
    beam, F, t, M = scene.beams[0], np.array([6.0, 4.0]), np.array([300.0, -900.0]), 2.0
    scene.clamp("left").gravity((2.0, -9.81)).point_force(F, at=(0.7, 0.01)).traction("top", t)
    scene.moment("right", M)
    state = solved(scene)
    R = state.reactions("left")
    weight = beam.total_mass * np.array([2.0, -9.81])
    size = np.abs(weight).max()
    assert_allclose(R.force, -(weight + F + t * 0.02), atol=1e-8 * size)
    # moments about the root, with deformed arms; the mass matrix knows the centre of mass
    T, q = beam.rigid_motions()[:, :2], beam.q0 + state.u
    centre = T.T @ beam.mass() @ q / beam.total_mass
    loads = [(centre, weight), (state.position((0.7, 0.01)), F)]
    xi = np.polynomial.legendre.leggauss(30)
    loads += [(state.position(((1 + x) / 2, 0.025)), w / 2 * 0.02 * t) for x, w in zip(*xi)]
    about = M + sum(x[0] * f[1] - x[1] * f[0] for x, f in loads)
    assert abs(R.moment + about) < 2e-4 * abs(about)  # the Gauss points above see C^1 joints
    assert set(R.coordinates) == {n for n in beam.dofnames if not n.startswith("r_X")}
    # the rest of the body is in balance as well
    free = state.internal_force - state.system.external_force(state.u)
    free = free[state.system.constraints.free]
    assert np.abs(free).max() < 1e-7 * size
    assert np.abs(state.displacement(TIP)).max() > 0.05


@pytest.mark.parametrize("method", ["mixed", "newton"])
def test_prescribed_displacement(method):
    """A displacement and its reaction give the same state, however the displacement is reached."""
    def scene():
        return cantilever(3, 8).clamp("left").fix("right", "r^2", displacement=-0.5)

    moved = solved(scene(), method=method)
    assert abs(moved.displacement(TIP)[1] + 0.5) < 1e-15
    force = moved.reactions("right").force
    assert force[0] == 0.0 and force[1] < 0
    pushed = solved(cantilever(3, 8).clamp("left").point_force(force, at=TIP), method=method)
    assert_allclose(pushed.u, moved.u, atol=2e-7)
    steps = solved(scene(), method=method, first_step=0.13)
    assert len(steps.steps) > 1
    assert_allclose(steps.u, moved.u, atol=1e-7)
    # the work of the support is the strain energy; the force grows with the displacement
    assert 0 < moved.strain_energy < 0.5 * abs(force[1])


# dead and follower loads

def test_follower_pressure():
    """A thin beam under a pressure on its top: from its tip an initial value problem."""
    EI, q = 1.0, 8.0
    h, b = 0.01, 1.0

    def rate(s, z):  # x, y, theta, n, m backwards from the tip
        _x, _y, a, n0, n1, m = z
        c, s = np.cos(a), np.sin(a)
        return -np.array([c, s, m / EI, -q * s, q * c, -(c * n1 - s * n0)])

    z = solve_ivp(rate, (0, 1), np.zeros(6), rtol=1e-10, atol=1e-12).y[:, -1]
    turn = np.array([[np.cos(z[2]), np.sin(z[2])], [-np.sin(z[2]), np.cos(z[2])]])
    tip = turn @ -z[:2] - [1, 0]
    states = {}
    for name in ("pressure", "traction"):
        scene = cantilever(3, 64, h=h, b=b, E=12 * EI / h**3, nu=0.0).clamp("left")
        states[name] = solved(getattr(scene, name)("top", q if name == "pressure" else (0, -q)))
    assert_allclose(states["pressure"].displacement(TIP), tip, atol=5e-3)
    assert tip[1] < -0.5
    dead = states["traction"].displacement(TIP)
    assert np.abs(dead - tip).max() > 0.1
    # both the same at first order: the difference of small loads falls with their square
    gap = []
    for p in (0.02, 0.01):
        a, b_ = (cantilever(3, 16, h=h, b=1.0, E=12e6, nu=0.0).clamp("left") for _ in range(2))
        a, b_ = a.pressure("top", p), b_.traction("top", (0, -p))
        gap.append(np.abs(solved(a).displacement(TIP) - solved(b_).displacement(TIP)).max())
    assert gap[0] < 1e-4 and gap[0] / gap[1] > 3.7


# the iteration


def test_no_convergence_keeps_the_last_state():
    scene = cantilever(3, 16).clamp("left").gravity(GRAVITY)
    with pytest.raises(ConvergenceError, match=r"load level 0:.*no convergence in 2 iterations"):
        scene.solve_static(max_iterations=2, min_step=0.01, method="mixed")
    with pytest.raises(ConvergenceError) as error:
        scene.solve_static(max_iterations=8, method="newton", first_step=0.02, min_step=0.015)
    state = error.value.state
    assert 0 < state.load < 1 and not state.converged
    assert f"load level {state.load:.6g}" in str(error.value) and state.steps[-1].load == state.load
    # the state is one of balance at its load
    free = (state.internal_force - state.load * state.system.external_force(state.u))
    assert np.abs(free[state.system.constraints.free]).max() < 1e-7
    assert solved(scene, start=state).converged


COMPRESSION = 1 / (3 * np.sqrt(3))  # largest -E stretch (stretch^2 - 1) / 2, at 1 / sqrt(3)


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("method", ["mixed", "newton"])
def test_compression_up_to_collapse(order, method):
    """St. Venant-Kirchhoff, nu = 0: a known limit, and none but inverted states beyond it.

    That of the straight column, which has buckled long before.
    """
    def column(p):
        scene = cantilever(order, 4, L=2.0, h=0.5, b=0.1, E=1e6, nu=0.0)
        return scene.clamp("left").traction("right", (-p * 1e6, 0))

    state = solved(column(0.19), method=method, stable=False)
    stretch = brentq(lambda x: x * (x * x - 1) / 2 + 0.19, 3**-0.5, 1.0, xtol=1e-14)
    assert_allclose(state.displacement((2, 0.1)), [2 * (stretch - 1), 0.0], atol=1e-8)
    with pytest.raises(ConvergenceError, match="beyond the load level 0.76") as error:
        column(0.25).solve_static(method=method, stable=False)
    limit = COMPRESSION / 0.25
    assert limit - 2e-4 < error.value.state.load <= limit


# supports and bad input

@pytest.mark.parametrize("support, free", [
    (lambda s: s, [r"translation along \(1, 0\)", r"translation along \(0, 1\)", "rotation about"]),
    (lambda s: s.pin("left"), [r"free: rotation about \(2, 0\)\."]),
    (lambda s: s.pin("right"), [r"free: rotation about \(3, 0\)\."]),
    (lambda s: s.fix("left", "r^2").fix("right", "r^2"), [r"free: translation along \(1, 0\)\."]),
    (lambda s: s.fix("left", "r^1").fix("right", "r^2"), [r"free: rotation about \(3, 0\)\."]),
    (lambda s: s.fix("left", "r_Y0"), [r"translation along .*translation along"]),
    (lambda s: s.fix("left", "r_X^1").pin("left"), [r"free: rotation about \(2, 0\)\."]),
])
def test_free_rigid_motions_are_named(support, free):
    mesh = MeshBeam.init_line([2.0, 2.4, 3.0], 0.1)
    scene = Scene(Beam(mesh, ElementBeamANCF(2), StVenantKirchhoff(2e8, 0.3, 7800), 0.1))
    support(scene)
    for words in free:
        with pytest.raises(SupportError, match=words):
            scene.solve_static()
    with pytest.raises(SupportError, match=free[0]):
        scene.gravity(GRAVITY).solve_linear()


def _scene():
    return cantilever(2, 4).clamp("left").gravity(GRAVITY)


@pytest.mark.parametrize("call, error, message", [
    (lambda s: s.clamp("lefft"), NameUnknown, "boundary 'lefft'; known: .*'left', 'right'"),
    (lambda s: s.moment("end", 1.0), NameUnknown, "boundary 'end'; known"),
    (lambda s: s.fix("left", "r_Z"), NameUnknown, r"of freedom 'r_Z'; known: 'r\^1', .*'r_Y1\^2'"),
    (lambda s: s.fix("left", ["r", "r_Y2"]), NameUnknown, "degree of freedom 'r_Y2'; known"),
    (lambda s: s.gravity(GRAVITY, beam="arm"), NameUnknown, "beam 'arm'; known: 0"),
    (lambda s: s.solve_static(method="arc"), NameUnknown, "method 'arc'; known: 'mixed', 'newton'"),
    (lambda s: s.fix("left", "r^1", displacement=1.0), SupportError, "node 0 is fixed twice"),
    (lambda s: s.fix("left", "r", displacement=np.nan), InputError, "displacement must be finite"),
    (lambda s: s.gravity((0, np.nan)), InputError, "g has a value that is NaN"),
    (lambda s: s.gravity(9.81), InputError, r"g must have shape"),
    (lambda s: s.point_force((0, np.inf), at=TIP), InputError, "force has a value that is NaN"),
    (lambda s: s.point_force((0, 1, 2), at=TIP), InputError, "force must have shape"),
    (lambda s: s.point_force((0, 1), at=(np.nan, 0)), InputError, "point has a value that is NaN"),
    (lambda s: s.point_force((0, 1), at=(1.01, 0)), MeshError, r"\(1.01, 0\) is outside the body"),
    (lambda s: s.point_force((0, 1), at=(0.5, 0.006)), MeshError, "outside the body"),
    (lambda s: s.traction("top", (0, np.nan)), InputError, "t has a value that is NaN"),
    (lambda s: s.traction("top", lambda x: np.nan * x), InputError, "has a value that is NaN"),
    (lambda s: s.pressure("top", np.nan), InputError, "p must be finite"),
    (lambda s: s.moment("right", np.nan), InputError, "M must be finite"),
    (lambda s: s.moment("top", 1.0), MeshError, "'top' is not one section"),
    (lambda s: s.load("gravity"), InputError, "a load is a scikit-fem LinearForm"),
    (lambda s: s.solve_static().strain((0, 0.1)), MeshError, "outside the body"),
])
def test_bad_input(call, error, message):
    with pytest.raises(error, match=message):
        call(_scene())


def test_an_interrupt_keeps_what_has_converged(monkeypatch):
    """Ctrl-C in the third step: the state of the second, an equilibrium of its own load."""
    from importlib import import_module

    from skfem_ancf.core.errors import Interrupted

    continuation = import_module("skfem_ancf.solvers.continuation")
    scene = Scene(Beam(MeshBeam.init_line(np.linspace(0, 1, 9), 0.01), ElementBeamANCF(2),
                       StVenantKirchhoff(2e8, 0.3, 7800), 0.01)).clamp("left").gravity((0, -1))
    whole = scene.solve_static(first_step=0.25)
    for module, name, solve in (
            (Increment, "solve", lambda: scene.solve_static(first_step=0.25)),
            (continuation.Tracer, "advance", lambda: scene.continuation(max_load=1.0, ds=0.05))):
        calls, step = [], getattr(module, name)

        def interrupted(*args, calls=calls, step=step):
            calls.append(args)
            if len(calls) == 3:
                raise KeyboardInterrupt
            return step(*args)

        with monkeypatch.context() as patch:
            patch.setattr(module, name, interrupted)
            with pytest.raises(Interrupted, match="stopped at the load") as info:
                solve()
        kept = info.value.state
        if module is Increment:
            assert 0.0 < kept.load < 1.0 and len(kept.steps) == 2 and not kept.converged
            again = scene.solve_static(start=kept)
            assert np.allclose(again.u, whole.u, rtol=0, atol=1e-9)
        else:
            assert len(kept.load) == 3 and kept.load[-1] < 1.0
