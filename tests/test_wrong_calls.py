"""Wrong calls in practice: the error names the argument, the value and what would work."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, LinearForm, MeshQuad
from skfem.helpers import ddot, dot, sym_grad

from skfem_ancf import (Beam, Domain, ElementBeamANCF, ElementBeamCable, Frame, InputError,
                        Line, Material, MeshBeam, ModelWarning, NameUnknown, Ramp, Scene, Steps,
                        StVenantKirchhoff, Train)

MATERIAL = StVenantKirchhoff(E=2e8, nu=0.0, density=1000.0)


def beam(element=None, n=8, origin=(0, 0), name=None):
    return Beam(MeshBeam.init_line(np.linspace(0, 1, n + 1), 0.01, origin), element or
                ElementBeamANCF(2), MATERIAL, 0.02, name=name)


def clamped(element=None):
    return Scene(beam(element)).clamp("left")


def pair(gap=0.0):
    return Scene(beam(n=2, name="a"), beam(n=2, origin=(1 + gap, 0), name="b")).clamp("left", "a")


def domain(mass=None, factor=1.0):
    mesh = MeshQuad.init_tensor(np.linspace(0, 1, 5), np.linspace(-0.05, 0.05, 3)).with_defaults()
    return Domain(Basis(mesh, ElementVector(ElementQuad2())),
                  LinearForm(lambda v, w: 1e5 * ddot(sym_grad(w["u"]), sym_grad(v))),
                  BilinearForm(lambda u, v, w: 1e5 * factor * ddot(sym_grad(u), sym_grad(v))), mass)


def of_mass(form):
    return Scene(domain(BilinearForm(form))).clamp("left")


class Law(Material):
    """Linear, with any matrix."""

    def __init__(self, matrix):
        super().__init__(1e6, 0.0, 1000.0)
        self.matrix = matrix

    def energy(self, strain):
        return 0.5 * np.einsum("i...,ij,j...->...", strain, self.matrix, strain)

    def stress(self, strain):
        return np.einsum("ij,j...->i...", self.matrix, strain)

    def moduli(self, strain):
        return np.broadcast_to(self.matrix.reshape(3, 3, *[1] * (strain.ndim - 1)),
                               (3, 3, *strain.shape[1:]))


def law(matrix):
    mesh = MeshBeam.init_line([0, 1], 0.1)
    return Scene(Beam(mesh, ElementBeamANCF(2), Law(matrix), 0.1)).clamp("left").solve_static()


def density(value):
    return lambda r, F, X, t: value


WRONG = [
    # directions
    (lambda: Train([1.0], [0.0], 1.0, direction=(0, 0)), r"direction .* zero, got \(0, 0\).*as"),
    (lambda: Line((0, 0), normal=(0, 0)), r"normal must not be zero, got \(0, 0\)"),
    (lambda: clamped().joint("line", at=(1, 0), direction=[0, 0]), "direction must not be zero"),
    (lambda: pair().slider((0.5, 0), "ground", direction=(0, 0)), "direction must not be zero"),
    (lambda: clamped().gravity(-9.81), r"g must have shape \(2\), as \(0, 1\), got \(\): -9.81"),
    # times
    (lambda: clamped().run([2, 1]), r"steps must be numbers that increase.*got \[2, 1\]"),
    (lambda: clamped().run([1, 1]), r"steps must .* increase.*got \[1, 1\]"),
    (lambda: clamped().run({"load": 1}), r"Steps\(\*\*\{'load': 1\}\)"),
    (lambda: clamped().run(np.inf), "steps has a value that is NaN or infinite: inf"),
    (lambda: clamped().run(1.0, start=3), "start is a State.*got int"),
    (lambda: clamped().run(1.0, start=np.zeros(3)), "start is a State.*got ndarray"),
    (lambda: Steps({"load": 1}), r"by name, as Steps\(press=1.0.*got Steps\(\{'load': 1\},\)"),
    (lambda: Steps(a=1e308, b=1e308), "sum of the durations .* infinite"),
    (lambda: Steps(press=1.0).ramp(), r"no values.*ramp\(press=1.0\)"),
    (lambda: Ramp([0.0, np.inf], [0, 1]), "times of a Ramp has a value that is NaN or infinite"),
    (lambda: clamped().gravity((0, -1)).integrate(0.1, 0.01, t_eval=[0.1, 0.05]),
     "t_eval must be numbers that increase"),
    # names and units
    (lambda: clamped().units("mm", "N"), r"force must .* 'mm': the order is units\(force"),
    (lambda: clamped().units("N", "kN"), "length must .* 'kN'"),
    (lambda: clamped().fix("right", "uy"), r"unknown degree of freedom 'uy'.*mean 'r\^2'"),
    (lambda: Scene(domain()).fix("right", "y", beam=0), r"'y'.*did you mean 'u\^2'"),
    (lambda: clamped().energy(density(1.0), over="cell"), "'cells', 'axis', 'left'.*'cells'"),
    # numbers and matrices of a user
    (lambda: of_mass(lambda u, v, w: -dot(u, v)).modes(1), "mass of .* not negative.*diagonal"),
    (lambda: of_mass(lambda u, v, w: -dot(u, v)).gravity((0, -1)), "not negative"),
    (lambda: of_mass(lambda u, v, w: np.nan * dot(u, v)).modes(1), "mass of .* NaN"),
    (lambda: of_mass(lambda u, v, w: dot(u, v) + u[0] * v[1]).modes(1), "symmetric.*interchanged"),
    (lambda: domain().of_basis(np.zeros(3)), r"u must hold the 90 DOFs.*shape \(3,\)"),
    (lambda: clamped().energy(density("text")), "psi.* must return numbers, got 'text'"),
    (lambda: clamped().energy(density(None)), "psi.* must return numbers, got None"),
    (lambda: clamped().energy(lambda r, F, X, t: r[1]**2, density("text")), "gradient.*got 'text'"),
    (lambda: clamped().energy(lambda r, F, X, t: r[1]**2, hessian=density("text")),
     "hessian.* numbers, got 'text'"),
    (lambda: clamped().energy(density(1.0), over=np.array([np.nan, np.nan])), "point.*NaN"),
    (lambda: clamped().energy(density(1.0), over=[np.nan, np.nan]), "point.*NaN"),
    (lambda: law(np.full((3, 3), np.nan)), "moduli.* of Law is not the derivative.*nan"),
    (lambda: law(1e6 * np.eye(3) + 5e5 * np.eye(3, k=1)), "moduli.*not the"),
    (lambda: law(-1e6 * np.eye(3)), "moduli.* of Law .* negative, got the eigenvalue -1e.06"),
    (lambda: domain(factor=np.nan), "tangent of .* is not the derivative.*nan"),
    (lambda: domain(factor=2.0), "tangent of .* is not the derivative"),
    (lambda: clamped().load(LinearForm(lambda v, w: np.nan * v[0])), "force of .*FormLoad.* NaN"),
    (lambda: clamped().load(LinearForm(lambda v, w: np.nan * w.r[0] * v[0])), "FormLoad.* NaN"),
    (lambda: clamped().sensor("grows", lambda s: np.zeros(round(1 + 1e3 * s.t))).integrate(
        0.003, 0.001), r"sensor .grows. must .* the same shape.*got \([12],\), then \([23]"),
    (lambda: clamped().run(1.0, min_step=2), "min_step must be at most 1.*got 2"),
    (lambda: Beam(MeshBeam.init_line([0, 1], 0.1), ElementBeamCable(5), MATERIAL),
     "give width=, that of a rectangle, or section="),
    # missing arguments
    (lambda: clamped().point_force((0, -1)), r"PointForce\(force, at, ...\): missing .*'at'"),
    (lambda: clamped().drag(), r"Drag\(density, normal, ...\): missing .*'density'"),
    # the order of arguments
    (lambda: clamped().load(LinearForm(lambda v, w: v[1]), BilinearForm(lambda u, v, w: 0.0)),
     "second argument of a load is the boundary.*tangent="),
    (lambda: MeshBeam.init_line(10, 0.01), r"as np.linspace\(0, length.*got .*: 10"),
    (lambda: pair(0.1).weld((1, 0)), r"another beam, 'b', is at \(1.1, 0\), 0.1 away"),
    # sizes
    (lambda: MeshBeam.init_line([0, 1e200], 0.01), r"nodes must .* 1e\+100, got 1e\+200"),
    (lambda: Frame.from_lines([(0, 0), (0, 1e-150)], [(0, 1)], material=MATERIAL, height=1,
                              width=1),
     "points must have coordinates between 1e-100 and"),
]


@pytest.mark.parametrize("call, says", WRONG)
def test_a_wrong_call_is_explained(call, says):
    with pytest.raises(InputError, match=says):
        call()


def test_a_motion_that_ends_before_it_starts_is_said():
    scene = clamped().gravity((0, -1))
    state = scene.run(2.0, increments=1).state(-1)
    with pytest.raises(InputError, match=r"no duration; got t_end = 0.1, t_start = 2"):
        scene.integrate(0.1, 0.01, start=state)


def test_a_step_longer_than_the_motion_is_said():
    with pytest.warns(ModelWarning, match="dt = 1 is longer than the motion.*t_end"):
        clamped().gravity((0, -1)).integrate(0.001, 1.0)


def test_a_train_has_the_size_of_its_forces_in_any_direction():
    scene = Scene(beam(ElementBeamCable(5))).pin("left").fix("right", "r^2")
    scene.add(Train([2e-4], [0.0], speed=0.5, direction=(3, -4)))
    force = scene.run(1.0, increments=1).reactions("left").force[-1]  # at midspan
    assert_allclose(force, [-1.2e-4, 0.8e-4], rtol=1e-4)


def test_places_of_an_energy_as_arrays():
    """A point as an array is the point; the force of the density r_y on an end is its area."""
    for place in ("right", (1.0, 0.0), np.array([1.0, 0.0]), np.array([8])):
        scene = clamped().energy(lambda r, F, X, t: r[1], over=place)
        reaction = scene.solve_linear().reactions("left").force
        assert_allclose(reaction, [0, 0.01 * 0.02], rtol=0, atol=1e-12)


def test_one_beam_as_a_data_set():
    pytest.importorskip("xarray")
    scene = pair()
    scene.weld((1, 0))
    state = scene.gravity((0, -1e-3)).solve_linear()
    data, whole = state.to_xarray(["u_y"], beam="b"), state.to_xarray(["u_y"])
    assert set(data.member.values.tolist()) == {"b"} and data.x.min() == 1.0
    assert np.array_equal(data.u_y, whole.u_y[whole.member == "b"])
    for wrong, says in (({"beam": "zz"}, "unknown beam 'zz'; known: 'a', 'b'"),
                        ({"line": 0}, "line=0 is for points")):
        with pytest.raises(InputError, match=says):
            state.to_xarray(**wrong)


def test_a_path_ends_at_a_displacement():
    scene = clamped(ElementBeamCable(5)).point_force((0, -0.05), at=(1, 0))
    path = scene.continuation(until=lambda p: p.displacement("right")[1] < -0.3)
    tips = path.displacement("right")[:, 1]
    assert tips[-1] < -0.3 and np.all(tips[:-1] >= -0.3)
    other = scene.continuation(until=lambda p: p.state.reactions("left").force[1] > 0.1)
    assert other.load[-1] > 2.0 >= other.load[-2]


def test_the_largest_displacement_of_a_mode():
    modes = clamped(ElementBeamCable(5)).modes(2)
    for k in (0, 1):  # the tip of a cantilever moves most
        given = modes.mode(k, displacement=0.02).displacement("right")
        assert abs(given[1]) == pytest.approx(0.02, rel=1e-9)
        assert abs(modes.mode(k).displacement("right")[1]) == pytest.approx(0.1, rel=1e-9)
    with pytest.raises(InputError, match="not both"):
        modes.mode(0, 1.0, displacement=1.0)


@pytest.mark.parametrize("scaled", [True, False])
def test_the_energy_of_a_conservative_form_is_in_the_balance(scaled):
    """A bedding as a form and as an energy: the same energies, and a constant sum."""
    k = 2e5
    form = LinearForm(lambda v, w: -0.02 * k * (w.r[1] - w.x[1])**3 * v[1])
    stiffness = BilinearForm(lambda u, v, w: -0.06 * k * (w.r[1] - w.x[1])**2 * u[1] * v[1])
    runs = []
    for tangent in (None, stiffness):
        scene = clamped().gravity((0, -9.81)).load(form, tangent=tangent, scaled=scaled)
        runs.append(scene.integrate(0.2, 0.005))
    scene = clamped().gravity((0, -9.81))
    scene.energy(lambda r, F, X, t: 0.25 * k * (r[1] - X[1])**4, scaled=scaled)
    right = scene.integrate(0.2, 0.005)
    assert np.ptp(right.strain_energy) > 0.01
    for run in runs:
        assert np.ptp(run.total_energy) < 1e-11
        for name in ("strain_energy", "potential_energy"):
            assert_allclose(getattr(run, name), getattr(right, name), rtol=0, atol=2e-5)


def test_forms_without_a_potential_are_found():
    turning = LinearForm(lambda v, w: w.r[1] * v[0] - w.r[0] * v[1])
    swelling = LinearForm(lambda v, w: w.t * (w.r[1] * v[0] - w.r[0] * v[1]))
    spring = LinearForm(lambda v, w: -(1.0 + w.t) * dot(w.r - w.x, v))
    assert [clamped().load(form).loads[0].symmetric for form in (turning, swelling, spring)] == [
        False, False, True]


@pytest.mark.parametrize("stated, unit, length", [(4, "m", 4.0), (6, "mm", 4e6), (1, "m", 101.6),
                                                  (4, None, 4000.0), (0, None, 4000.0)])
def test_units_of_a_drawing(tmp_path, stated, unit, length):
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new()
    drawing.header["$INSUNITS"] = stated
    drawing.modelspace().add_line((0, 0), (4000, 0))
    drawing.saveas(tmp_path / "line.dxf")
    frame = Frame.from_meshio(tmp_path / "line.dxf", material=MATERIAL, height=0.1, width=0.1,
                              unit=unit)
    assert frame.beams[0].mesh.p[0].max() == pytest.approx(length, rel=1e-10)


def test_units_that_a_drawing_does_not_state(tmp_path):
    ezdxf, meshio = (pytest.importorskip(name) for name in ("ezdxf", "meshio"))
    drawing = ezdxf.new()
    drawing.header["$INSUNITS"] = 0
    drawing.modelspace().add_line((0, 0), (4e200, 0))
    drawing.saveas(tmp_path / "line.dxf")
    mesh = meshio.Mesh([[0, 0], [1, 0]], [("line", [[0, 1]])])
    for source, options, error, says in (
            (tmp_path / "line.dxf", {"unit": "m"}, InputError, r"\$INSUNITS is 0"),
            (tmp_path / "line.dxf", {"unit": "metre"}, NameUnknown, "unit of length 'metre'"),
            (tmp_path / "line.dxf", {}, InputError, r"at most|between.*got 4e\+200"),
            (mesh, {"unit": "m"}, InputError, "unit='m' is for drawings")):
        with pytest.raises(error, match=says):
            Frame.from_meshio(source, material=MATERIAL, height=0.1, width=0.1, **options)
