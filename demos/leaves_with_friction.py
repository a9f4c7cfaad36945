r"""Two leaves that rub
===================

Two leaves lie on each other, and their friction makes the force-displacement curve a loop.

Both leaves are clamped at one end, and the force acts on the upper one. Without friction they are
two springs side by side. Friction in the joint between them opposes the sliding: they are stiffer
while the load grows, and give back less while it falls.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import trapezoid

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.visuals.matplotlib import plot_state

length, height, width, mu = 0.5, 0.05, 0.02, 0.3
steel = StVenantKirchhoff(E=2e11, nu=0.0)
leaves = [Beam(MeshBeam.init_line(np.linspace(0, length, 7), height, origin=(0, -k * height)),
               ElementBeamANCFCubic(1), steel, width, name=name)
          for k, name in enumerate(("upper", "lower"))]
alone = 3 * steel.E * width * height**3 / 12 / length**3        # of one leaf
force = 2e-3 * alone                                            # 1 mm


def loop(friction):
    """Displacement of the tip and force, up to the full force and down to a fifth of it."""
    scene = Scene(*leaves).clamp("left", "upper").clamp("left", "lower")
    scene.contact("all", friction=friction)
    path = [0.0, 1.0, 1.8]
    scene.point_force((0, -force), at="right", beam="upper",
                      amplitude=lambda t: np.interp(t, path, [0.0, 1.0, 0.2]))
    run = scene.run(path[1:], increments=5)
    return -run.displacement("right", "upper")[:, 1], np.interp(run.t, path, [0, 1, 0.2]), run


# %%
# **The loop.** With friction the stiffness is :math:`1 / (1 \mp 3 \mu h / 4 L)` times that without:
# minus while the load grows, plus while it falls.

smooth, rough = loop(0.0), loop(mu)
share = 3 * mu * height / (4 * length)
slopes = []
for tip, part, _ in (smooth, rough):
    slopes.append([(part[5] - part[4]) / (tip[5] - tip[4]),
                   (part[8] - part[7]) / (tip[8] - tip[7])])
up, down = np.divide(slopes[1], slopes[0])
print(f"loading {up:.4f}, exact {1 / (1 - share):.4f}; "
      f"unloading {down:.4f}, exact {1 / (1 + share):.4f}")
assert np.isclose(up, 1 / (1 - share), atol=3e-3) and np.isclose(down, 1 / (1 + share), atol=3e-3)
assert np.isclose(slopes[0][0] * force, 2 * alone, rtol=0.02)

# %%
# **Where it slides.** Friction has taken a part of the work.

tip, part, run = rough
work = force * trapezoid(part, tip)
print(f"work {work:.4f}, lost by friction {run.dissipated[-1]:.4f}")
assert 0 < run.dissipated[-1] < work and not run.state(5).contact().sticking.all()

# %%

fig, (left, right) = plt.subplots(1, 2, figsize=(9.6, 3.8), layout="constrained")
for (tip, part, _), label in ((smooth, "no friction"), (rough, f"friction {mu}")):
    left.plot(1e3 * tip, force * part - 2 * alone * tip, ".-", label=label)
left.set(xlabel="displacement of the tip (mm)", ylabel="force less $2 k$ times displacement (N)")
left.legend(frameon=False)
plot_state(run.state(5), "S_xx", ax=right, unit="Pa", title="stress along the leaves $S_{xx}$",
           scale=20)
plt.show()
