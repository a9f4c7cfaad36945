r"""A train on a bridge of three spans
==================================

A train crosses a bridge of three spans, slowly and at the speed where its bogies excite resonance.

The bogies follow each other at equal distances, so they load the bridge periodically. If the period
is that of the lowest mode, the vibration grows with each bogie.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff, Train

# %%
# Three spans of 25 m with a damping ratio of 2 %, and an articulated train with a bogie every
# 18.7 m.

span, height, width, gap, bogies, load = 25.0, 1.6, 3.0, 18.7, 10, 3e5      # m, N
concrete = StVenantKirchhoff(E=3e10, nu=0.2, density=2500)
girder = Beam(MeshBeam.init_line(np.linspace(0, 3 * span, 13), height), ElementBeamCable(5),
              concrete, width=width)
inertia = 12 * concrete.density * (1 + (np.pi * height / span)**2 / 12)     # with rotary inertia
frequency = np.pi * height / (2 * span**2) * np.sqrt(concrete.E / inertia)
way = 3 * span + (bogies - 1) * gap


def bridge():
    scene = Scene(girder).pin("left").damping(mass=0.04 * 2 * np.pi * frequency)
    for k in (1, 2, 3):
        scene.fix((k * span, 0), "r^2")
    return scene


def cross(speed):
    return bridge().add(Train([load] * bogies, gap * np.arange(bogies), speed))


# %%
# **Low speed**: the moment over the second pier, by a sequence of static solutions. Forces may act
# inside elements. **Check**: Clapeyron's equation of three moments.

creeping = cross(1.0).run(way, increments=150)
over_pier = creeping.resultants((span, 0)).M


def three_moments(place):
    """The moment over the second pier under a force at a place: M_1 and M_2 of two equations."""
    right = np.zeros(2)
    if 0 < place < 3 * span:
        k = int(place / span)
        a = place - k * span
        for pier, arm in ((k - 1, span - a), (k, a)):  # those at both ends of the loaded span
            if 0 <= pier < 2:
                right[pier] -= load * arm * (span**2 - arm**2) / span
    return np.linalg.solve(span * np.array([[4, 1], [1, 4]]), right)[0]


expected = np.array([sum(three_moments(s - gap * k) for k in range(bogies)) for s in creeping.t])
print(f"largest moment over the pier {-1e-6 * over_pier.min():.4f} MN m, by Clapeyron "
      f"{-1e-6 * expected.min():.4f}")
assert np.allclose(over_pier, expected, atol=1e-3 * abs(expected).max())

# %%
# **Critical speed**: the distance of the bogies times the lowest frequency. This is the frequency
# of a single span, since neighbouring spans move in opposite directions.

lowest = bridge().modes(1).frequencies[0] / (2 * np.pi)
print(f"lowest frequency {lowest:.3f} Hz, of one span {frequency:.3f} Hz")
assert np.isclose(lowest, frequency, rtol=1e-4)

ratios, middle = np.array([0.5, 0.7, 0.85, 0.95, 1.0, 1.05, 1.15]), (0.5 * span, 0)
speeds = ratios * gap * frequency
motions = [cross(v).integrate(way / v, 8e-3, "generalized-alpha") for v in speeds]
sags = [motion.displacement(middle)[:, 1] for motion in motions]
static = creeping.displacement(middle)[:, 1]
largest = np.array([sag.min() for sag in sags]) / static.min()
print("largest sag over that of the creeping train:", largest.round(2))
assert ratios[np.argmax(largest)] == 1.0 and largest.max() > 2

# %%
# The deflection of the first span against the position of the train, and the bridge at its largest
# deflection.

fig, axes = plt.subplot_mosaic("ab;cc", figsize=(10, 6), height_ratios=(1.5, 1),
                               layout="constrained")
left, right, below = axes["a"], axes["b"], axes["c"]
left.plot(creeping.t, 1e3 * static, "k", label="creeping")
for k in (0, 4):
    left.plot(speeds[k] * motions[k].t, 1e3 * sags[k], label=f"{3.6 * speeds[k]:.0f} km/h")
left.set(xlabel="place of the first bogie (m)", ylabel="middle of the first span (mm)")
left.legend(frameon=False)
right.plot(3.6 * speeds, largest, "o-")
right.axvline(3.6 * gap * frequency, color="0.7", lw=0.8)
right.set(xlabel="speed (km/h)", ylabel="largest sag / creeping")
motions[4].state(int(np.argmin(sags[4]))).plot(
    lambda v: 1e-6 * v["S_xx"], ax=below, scale=200, loads=True, supports=True, unit="MPa",
    title=f"stress $S_{{xx}}$ at {3.6 * speeds[4]:.0f} km/h")
below.set(xlabel="x (m)", ylabel="y (m)")
plt.show()
