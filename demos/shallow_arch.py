r"""A shallow arch: snap-through, and what is stable
================================================

Push a bent ruler sideways and it snaps through to the other side. Load control jumps there, blind
for what lies between. Following the equilibrium path shows it: two load maxima, unstable states
between them, and a second, lopsided path that an arch of some height takes before it reaches its
own maximum. For a shallow sine arch under a sine load all of it is known in closed form.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# A plastic strip of span 1 m and 20 mm thick, whose axis is half a sine wave of rise 31 mm, hinged
# at both ends, with a load per length q sin(pi x / span) downwards.

span, height, width, rise = 1.0, 20e-3, 0.05, 31e-3
plastic = StVenantKirchhoff(E=2e9, nu=0.3)
EA, EI = plastic.E * width * height, plastic.E * width * height**3 / 12
crown, wave = (span / 2, rise), np.pi / span

mesh = MeshBeam.init_curve(lambda x: np.array([x, rise * np.sin(wave * x)]),
                           np.linspace(0, span, 25), height)
beam = Beam(mesh, ElementBeamANCFCubic(2), plastic, width)

# %%
# **Closed form** (Fung and Kaplan [1]_): when the wave has the amplitude b in place of the rise a,
# the axis carries the thrust :math:`N = \pi^2 EA (a^2 - b^2) / 4 l^2` and the arch the load
# :math:`q = \pi^4 EI (a - b) / l^4 + \pi^2 N b / l^2`. At the thrust :math:`4 \pi^2 EI / l^2` it
# can buckle to a full wave.


def load_of(b):
    thrust = wave**2 * EA * (rise**2 - b**2) / 4
    return wave**4 * EI * (rise - b) + wave**2 * thrust * b


b = np.linspace(rise, -1.3 * rise, 400)
limit = load_of(np.sqrt((rise**2 - 4 * EI / EA) / 3))
lopsided = load_of(np.sqrt(rise**2 - 16 * EI / EA)) / limit

# %%
# The path, with loads relative to that limit.

scene = Scene(beam).pin("left").pin("right")
scene.line_load(lambda x: (0 * x[0], -limit * np.sin(wave * x[0])))
path = scene.continuation(ds=1e-3, max_load=1.5)
for point in path.critical_points:
    print(point)

# %%
# The first point where stability is lost is a bifurcation; the maximum comes later. Both are within
# two per cent of the closed form, which takes slopes as small.

first = path.critical_points[0]
print(f"bifurcation: closed form {lopsided:.4f}; limit point: closed form 1")
assert first.kind == "bifurcation" and np.isclose(first.load, lopsided, rtol=0.02)
assert np.isclose(path.limit_points()[0], 1, rtol=0.02)
assert path.stable[0] and path.stable[-1] and not all(path.stable)

# %%
# The lopsided path leaves there, and comes back to the first one further down: on the way the arch
# is at no load stable. A load that is kept snaps it through.

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
