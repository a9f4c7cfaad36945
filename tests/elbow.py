"""Two straight beams that meet at a corner, and an example of each joint on them."""

import numpy as np

from skfem_ancf import Beam, ElementBeamANCF, MeshBeam, StVenantKirchhoff


def between(a, b, ne=2, order=2, h=0.1, E=1e6, nu=0.3, rho=1000.0, width=0.1, element=None,
            **options):
    """A straight beam from a to b."""
    a, b = np.array(a, dtype=float), np.array(b, dtype=float)
    d = b - a
    mesh = MeshBeam.init_line(np.linspace(0, np.hypot(*d), ne + 1), h, origin=a,
                              angle=np.arctan2(d[1], d[0]))
    return Beam(mesh, element or ElementBeamANCF(order), StVenantKirchhoff(E, nu, rho), width,
                **options)


def joint_examples(L=1.0, rise=0.0, drive=1.0, turn=1.0):
    """Arguments of each joint by name, on the beam "arm" from (0, 0) to (1, rise) L and "forearm"
    from there by (0.4, 0.9) L. What is driven moves as ``drive``, or turns as ``turn`` says."""
    def p(x, y):
        return L * x, L * (y + rise * min(x, 1.0))

    def driven(t):
        return turn * np.sin(3 * t)

    x, y = p(0.4, -0.03)
    return {
        "hinge": dict(beams=("arm", "forearm"), at=p(1, 0)),
        "weld": dict(beams=("arm", "forearm"), at=("right", "left")),
        "line": dict(beam="arm", at=p(0.3, 0.02), direction=(1, 2)),
        "circle": dict(beam="forearm", at=p(1.2, 0.45), center=p(0.4, 0.1)),
        "position": dict(beam="arm", at=(x, y), r=lambda t: (
            x + L * drive * np.sin(t), y + L * drive * t * t)),
        "angle": dict(beam="forearm", at="right", angle=driven),
        "turn": dict(at=("arm", "left"), other=("forearm", "right"), angle=driven),
        "plane": dict(beam="forearm", at="left"),
        "sleeve": dict(at=("ground", p(1.2, 0.45)), on="forearm", angle=True),
        "slot": dict(at=("arm", p(0.3, 0.02)), on="ground", direction=(1, 2), angle=True),
    }
