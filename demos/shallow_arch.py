r"""A shallow arch: snap-through and stability
==========================================

The equilibrium path of a shallow arch, with its bifurcation and its limit load, compared with the
closed form for a sine load.

Load control jumps at the limit load and does not see the states beyond. Continuation follows the
path: two limit points with unstable states between them, and an unsymmetric branch that starts
before the first limit point.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# A plastic strip with a span of 1 m and a thickness of 20 mm. Its axis is half a sine wave with a
# rise of 31 mm, hinged at both ends. The load per length is q sin(pi x / span), downwards.

span, height, width, rise = 1.0, 20e-3, 0.05, 31e-3
plastic = StVenantKirchhoff(E=2e9, nu=0.3)
EA, EI = plastic.E * width * height, plastic.E * width * height**3 / 12
crown, wave = (span / 2, rise), np.pi / span

mesh = MeshBeam.init_curve(lambda x: np.array([x, rise * np.sin(wave * x)]),
                           np.linspace(0, span, 25), height)
beam = Beam(mesh, ElementBeamANCFCubic(2), plastic, width)

# %%
# **Closed form** (Fung and Kaplan [1]_): if the amplitude is b instead of the rise a, the thrust is
# :math:`N = \pi^2 EA (a^2 - b^2) / 4 l^2` and the load
# :math:`q = \pi^4 EI (a - b) / l^4 + \pi^2 N b / l^2`. At the thrust :math:`4 \pi^2 EI / l^2` the
# arch can buckle to a full wave.


def load_of(b):
    thrust = wave**2 * EA * (rise**2 - b**2) / 4
    return wave**4 * EI * (rise - b) + wave**2 * thrust * b


b = np.linspace(rise, -1.3 * rise, 400)
limit = load_of(np.sqrt((rise**2 - 4 * EI / EA) / 3))
lopsided = load_of(np.sqrt(rise**2 - 16 * EI / EA)) / limit

# %%
# The path, with loads relative to this limit load.

scene = Scene(beam).pin("left").pin("right")
scene.line_load(lambda x: (0 * x[0], -limit * np.sin(wave * x[0])))
path = scene.continuation(ds=1e-3, max_load=1.5)
for point in path.critical_points:
    print(point)

# %%
# The first loss of stability is a bifurcation; the limit point comes later. Both are within 2 % of
# the closed form, which assumes small slopes.

first = path.critical_points[0]
print(f"bifurcation: closed form {lopsided:.4f}; limit point: closed form 1")
assert first.kind == "bifurcation" and np.isclose(first.load, lopsided, rtol=0.02)
assert np.isclose(path.limit_points()[0], 1, rtol=0.02)
assert path.stable[0] and path.stable[-1] and not all(path.stable)

# %%
# The unsymmetric branch starts there and returns to the first path at a lower load. All its states
# are unstable under dead load, so the arch snaps through.

branch = scene.continuation(branch=first, ds=1e-3, max_load=1.5, steps=40)
assert not any(branch.stable[1:10])

fig, (above, below) = plt.subplots(2, 1, figsize=(7, 6.4), height_ratios=(2.4, 1),
                                   layout="constrained")
above.plot(b - rise, load_of(b) / limit, lw=6, alpha=0.3, label="closed form")
path.plot(crown, ax=above)
branch.plot(crown, ax=above)
above.annotate("lopsided", (-0.032, 0.31), (-0.028, 0.2), color="C2")
above.plot([p.state.displacement(crown)[1] for p in path.critical_points],
          [p.load for p in path.critical_points], "ks", ms=4, label="critical points")
above.set(xlabel="displacement of the crown (m)", ylabel="load / limit load", ylim=(-0.6, 1.5),
         title="load paths; unstable parts dashed")
above.legend(frameon=False)
middle = len(branch) // 3
plot_state([path.state(0), branch.state(middle), path.state(-1)], "eps_xx", ax=below, thickness=1,
           undeformed=False, title=r"$\varepsilon_{xx}$: at rest, lopsided, snapped through")
below.set(xlabel="x (m)", ylabel="y (m)")
plt.show()

# %%
# .. [1] Y. C. Fung, A. Kaplan, Buckling of low arches or curved beams of small curvature, NACA
#    Technical Note 2840 (1952).
