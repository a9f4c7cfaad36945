"""End faces that a support moves at one point: said, and right with a plane face."""

import contextlib

import numpy as np
import pytest

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamCable, MeshBeam, ModelWarning, Scene,
                        StVenantKirchhoff)


@pytest.mark.parametrize("displacement", [1e-4, lambda t: 1e-4 * t])
@pytest.mark.parametrize("element, angle, warns", [
    (ElementBeamANCF(2), 0.0, True), (ElementBeamANCF(4), np.pi / 2, True),
    (ElementBeamANCF(1), 0.0, False), (ElementBeamCable(5), 0.0, False)], ids=repr)
def test_a_face_that_is_pushed_at_one_point(element, angle, warns, displacement):
    """The force E A d / L of a bar: too small if sections deform at the point, and it is said."""
    E, h, L, nu = 2e9, 0.1, 0.3, 0.3

    def bar(plane):
        mesh = MeshBeam.init_line(np.linspace(0, L, 9), h, angle=angle)
        scene = Scene(Beam(mesh, element, StVenantKirchhoff(E, nu), width=h))
        scene.clamp("left", thickness="free")
        scene.fix("right", "r^2" if angle else "r^1", displacement=displacement)
        if plane:
            scene.joint("plane", at="right")
        return scene

    exact = E * h * h * 1e-4 / L
    states = []
    for solve in ("solve_linear", "solve_static"):
        with pytest.warns(ModelWarning, match='scene.joint."plane", at="right"') if warns else (
                contextlib.nullcontext()):
            states.append(getattr(bar(False), solve)())
        assert any("one point of an end face" in x for x in states[-1].checks.findings) == warns
        right = getattr(bar(True), solve)()
        assert not right.checks.findings
        force = np.abs(right.reactions("right").force).max()
        assert force == pytest.approx(exact, rel=1e-9 if solve == "solve_linear" else 1e-3)
    force = np.abs(states[0].reactions("right").force).max()
    assert (force < 0.95 * exact) if warns else force == pytest.approx(exact, rel=1e-9)
