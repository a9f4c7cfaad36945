r"""A thermostat that snaps
=======================

A shallow bimetal strip snaps through when it is heated and back when it is cooled, at temperatures
compared with arch theory.

The strip is pinned at both ends. It snaps back at a lower temperature: the thermostat switches off
at one temperature and on at another. Two cycles of heating and cooling show both temperatures.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import (Beam, ElementBeamANCFCubic, MeshBeam, Scene, Section, Steps,
                        StVenantKirchhoff)

# %%
# A strip 30 mm long and 0.2 mm high with a rise of 0.25 mm, a sine. Without bond, one layer would
# become longer by 9e-6 per kelvin, the other shorter by as much. Units are millimetres, newtons and
# kelvin.

span, height, rise, alpha, modulus = 30.0, 0.2, 0.25, 9e-6, 1.4e5
below, above = (StVenantKirchhoff(E=modulus, nu=0.3, thermal_expansion=x) for x in (alpha, -alpha))
mesh = MeshBeam.init_curve(lambda s: (span * s, rise * np.sin(np.pi * s)), np.linspace(0, 1, 9),
                           height)
strip = Beam(mesh, ElementBeamANCFCubic(2), section=Section.layers(
    (height / 2, below), (height / 2, above), width=4.0))

steps = Steps(heat=1.0, cool=1.0, heat_again=1.0, cool_again=1.0)
heat = steps.ramp(heat=45.0, cool=-15.0, heat_again=45.0, cool_again=-15.0)
scene = Scene(strip).pin("left").pin("right").temperature(1.0, amplitude=heat)
scene.sensor("middle", "position", at=(span / 2, rise))
history = scene.run(steps, increments=12, min_step=1e-3)
switched = heat(history.jumps)
print("it snaps at", switched.round(2), "K")

# %%
# **The check**: a shallow arch of sine modes. With the thrust N over the modulus and the area, mode
# k has :math:`w_k = (a k^4 w_{0k} - T q_k) / (a k^4 + N k^2)`, and
# :math:`4 N = \sum k^2 (w_k^2 - w_{0k}^2)` is a quadratic equation of the temperature T.

k, a = np.arange(1, 40, 2.0), height**2 / 12
start = np.where(k == 1, rise, 0.0)
curling = a * 4 / np.pi * (span / np.pi)**2 * 1.5 * 2 * alpha / height * k   # Timoshenko (1925)


def temperatures(N):
    stiffness = a * k**4 + N * k**2
    A, B = a * k**4 * start / stiffness, -curling / stiffness
    return np.roots([np.sum(k**2 * B * B) / 4, np.sum(k**2 * A * B) / 2,
                     np.sum(k**2 * (A * A - start**2)) / 4 - N])


# it gives way where the temperature is at its largest or smallest, or the second mode buckles
T = np.sort(np.real_if_close([temperatures(N) for N in a * np.linspace(-3.9999, -1.01, 4000)]))
there, back = T[:, 1].max(), T[:, 0].min()
print(f"the arch snaps at {there:.2f} K, and back at {back:.2f} K")
assert np.allclose(switched, (there, back, there, back), atol=0.3)

# %%
# Both cycles follow the same path. On the right, the strip before and after it snaps.

fig, (left, right) = plt.subplots(1, 2, figsize=(9.8, 4.2), layout="constrained")
history.plot_curve(heat(history.sensors.t), ("middle", 1), ax=left, marker=".",
                   xlabel="temperature (K)", ylabel="height of the middle (mm)")
for at in (there, back):
    left.axvline(at, color="0.7", lw=0.8)
first = np.flatnonzero(history.t == history.jumps[0])[0]
history.plot("S_xx", times=[0.0, history.t[first - 1], history.t[first]], ax=right, unit="MPa",
             thickness=1, title="stress $S_{xx}$ at 0 K, before and after the snap")
right.set(xlabel="x (mm)", ylabel="y (mm)", aspect=20)
plt.show()
