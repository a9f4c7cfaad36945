"""The table of fields: against three-dimensional tensors, and wherever a name is taken."""

import numpy as np
import pytest
from conftest import quarter_arc
from numpy.testing import assert_allclose
from test_io import affine, bent, turn

from skfem_ancf import (Beam, ElementBeamANCF, InputError, MeshBeam, NameUnknown, NeoHookean, Scene,
                        StVenantKirchhoff)
from skfem_ancf.core.errors import CallbackError
from skfem_ancf.io import body_fields
from skfem_ancf.recovery.fields import FIELDS, Field, Values, find_fields

MESH = MeshBeam.init_line([0, 1, 3], height=0.5, angle=0.4)
E, NU = 3e6, 0.25
MU, LAME = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
POINT = (0.9, 0.45)
GRADIENTS = [turn(0.7) @ turn(0.4) @ np.diag([1.2, 0.9]) @ turn(-0.4),
             np.array([[1.1, 0.3], [-0.2, 0.85]])]


def cauchy(law, F):
    """The Cauchy stress (3, 3) in plane strain, by the laws in three dimensions."""
    F = np.block([[F, np.zeros((2, 1))], [np.zeros((1, 2)), 1.0]])
    J = np.linalg.det(F)
    if law is StVenantKirchhoff:
        strain = 0.5 * (F.T @ F - np.eye(3))
        S = LAME * np.trace(strain) * np.eye(3) + 2 * MU * strain
        return F @ S @ F.T / J
    return (MU * (F @ F.T - np.eye(3)) + LAME * np.log(J) * np.eye(3)) / J


@pytest.mark.parametrize("F", GRADIENTS)
@pytest.mark.parametrize("law", [StVenantKirchhoff, NeoHookean])
def test_plane_strain_in_three_dimensions(law, F):
    state = affine(Beam(MESH, ElementBeamANCF(3), law(E, NU, plane="strain"), 0.3), F)
    sigma = cauchy(law, F)
    deviator = sigma - np.trace(sigma) / 3 * np.eye(3)
    values, vectors = np.linalg.eigh(sigma[:2, :2])
    wanted = {"von_mises": np.sqrt(1.5 * np.sum(deviator**2)), "sigma_xx": sigma[0, 0],
              "tresca": np.ptp(np.linalg.eigvalsh(sigma)), "sigma_1": values[1],
              "sigma_2": values[0]}
    for name, value in wanted.items():
        assert state.field(name, POINT) == pytest.approx(value, rel=1e-9)
    direction = state.field("sigma_1_direction", POINT)
    assert abs(direction @ vectors[:, 1]) == pytest.approx(1.0)


@pytest.mark.parametrize("F", GRADIENTS)
def test_principal_strains_are_those_of_the_body(F):
    state = affine(Beam(MESH, ElementBeamANCF(3), StVenantKirchhoff(E, NU), 0.3, "continuum"), F)
    values, vectors = np.linalg.eigh(0.5 * (F.T @ F - np.eye(2)))  # global axes
    assert state.field("eps_1", POINT) == pytest.approx(values[1])
    assert state.field("eps_2", POINT) == pytest.approx(values[0])
    assert abs(state.field("eps_1_direction", POINT) @ vectors[:, 1]) == pytest.approx(1.0)
    along = turn(0.4)[:, 0]
    assert state.field("stretch", POINT) == pytest.approx(np.linalg.norm(F @ along))
    assert_allclose(state.field("displacement", POINT), F @ POINT - POINT)
    assert state.field("energy", POINT) * MESH.lengths.sum() * 0.5 * 0.3 == pytest.approx(
        state.strain_energy)


def test_plane_stress_of_a_bar():
    """Pulled along its axis: von Mises and Tresca are the one stress that there is."""
    beam = Beam(MeshBeam.init_line(np.linspace(0, 1, 9), height=0.1), ElementBeamANCF(2),
                StVenantKirchhoff(E, NU), 0.1)
    state = Scene(beam).clamp("left", thickness="free").point_force((300, 0), (1, 0)).solve_static()
    sigma = state.field("sigma_1", (0.5, 0.02))
    assert sigma == pytest.approx(30000, rel=0.03)
    for name in ("von_mises", "tresca", "sigma_xx"):
        assert state.field(name, (0.5, 0.02)) == pytest.approx(sigma, rel=1e-6)


def test_every_field_at_points_in_files_and_over_time():
    state = bent(mesh=quarter_arc(4, 0.1))
    body = body_fields(state, (2, 2), undeformed=True, fields=list(FIELDS), share=False)
    x = body.points[:, :2].T
    middle = np.arange(len(x.T)) // 3 % 3 == 1  # not on a node, where two elements meet
    for name, field in FIELDS.items():
        found = state.field(name, x[:, middle])
        data = body.point_data[name][middle]
        if field.components > 1:
            data = data[:, [0, 1] if field.components == 2 else [0, 1, 3]].T
        assert found.shape == data.shape
        scale = np.abs(data).max() + 1e-30
        if "direction" in name:  # either way round
            found, data = np.abs(found), np.abs(data)
            scale = 1e4
        assert_allclose(found, data, atol=1e-6 * scale)
    scene = Scene(Beam(MESH, ElementBeamANCF(2), StVenantKirchhoff(E, NU, 10.0), 0.1))
    history = scene.pin("left").gravity((0, -9.81)).integrate(0.02, 0.01)
    assert history.field("von_mises", [POINT, POINT]).shape == (3, 2)
    assert history.field("stretch", POINT)[0] == pytest.approx(1.0, abs=1e-3)


def test_fields_of_the_users_own():
    def utilisation(v):
        assert isinstance(v, Values) and set(v) == set(FIELDS) and len(v) == len(FIELDS)
        return v["von_mises"] / 2.0

    state = bent()
    at = [(0.2, 0.0), (0.5, 0.03)]
    assert_allclose(state.field(utilisation, at), state.field("von_mises", at) / 2)
    data = body_fields(state, fields=("eps_yy", utilisation)).point_data
    assert list(data) == ["eps_yy", "utilisation"]
    ax = state.plot(utilisation)
    assert ax.get_title(loc="left") == "utilisation"
    own = Field("own", lambda v: v.x, "mine", components=2, frame="global")
    assert_allclose(state.field(own, at), np.array(at).T)
    assert body_fields(state, fields=own).point_data["own"].shape[1] == 3
    assert state.field(lambda v: 3.0, at).tolist() == [3.0, 3.0]


def test_wrong_fields():
    state = bent()
    with pytest.raises(NameUnknown, match="did you mean 'von_mises'"):
        state.field("von_mieses", (0.5, 0))
    for call in (lambda f: state.plot(f), lambda f: state.field(f, (0.5, 0)),
                 lambda f: body_fields(state, fields=[f])):
        with pytest.raises(NameUnknown, match="did you mean 'eps_yy'"):
            call("eps_y")
        with pytest.raises(NameUnknown, match="unknown field 3"):
            call(3)
        with pytest.raises(CallbackError, match="shape"):
            call(lambda v: np.zeros(v.n + 1))
        with pytest.raises(CallbackError, match="array of numbers"):
            call(lambda v: "text")
        with pytest.raises(CallbackError, match="raised KeyError"):
            call(lambda v: {}["no"])
    with pytest.raises(InputError, match="a plot shows a field of one component, as"):
        state.plot("stress")
    with pytest.raises(InputError, match="different names"):
        find_fields(["eps_xx", "eps_xx"])
    with pytest.raises(InputError, match="a list of names"):
        find_fields(7)
    for bad in (dict(name=""), dict(name=3), dict(function=3), dict(components=4)):
        with pytest.raises(InputError):
            Field(**{"name": "a", "function": len, **bad})


@pytest.mark.parametrize("law", [StVenantKirchhoff, NeoHookean])
def test_energy_density_of_a_modulus_that_varies(law):
    """Its integral is the strain energy."""
    beam = Beam(MESH, ElementBeamANCF(3), law(lambda x, y: E * (1 + x), NU), 0.3, "continuum")
    state = affine(beam, GRADIENTS[1])
    uniform = affine(beam.replace(material=law(E, NU)), GRADIENTS[1])
    for at in ((0.4 * 0.92106, 0.4 * 0.38942), (2.0 * 0.92106, 2.0 * 0.38942)):
        x = np.hypot(*at)
        assert state.field("energy", at) == pytest.approx(
            (1 + x) * uniform.field("energy", at), rel=1e-4)
