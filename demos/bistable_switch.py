r"""A bistable switch
=================

A pinned arch is designed that snaps at a prescribed force, and stays where it has snapped to.

Below its snap force the arch carries a key; beyond, it goes through and holds without force. The
snap is the first critical point of the equilibrium path, a bifurcation to a lopsided shape. Its
load is a reading of a :class:`~skfem_ancf.Design`, whose derivatives come from the critical point.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import least_squares

from skfem_ancf import (Beam, CriticalLoad, Design, ElementBeamCable, Frequency, MeshBeam, Scene,
                        StabilityWarning, StVenantKirchhoff)
from skfem_ancf.visuals.matplotlib import plot_state

force, wanted = 0.2, 8.5
rubber = StVenantKirchhoff(E=2e6, nu=0.3, density=1000)


def switch(p, share=1.0):
    """The arch; the parameters are its height and its rise in centimetres."""
    height, rise = 1e-2 * np.asarray(p)
    axis = MeshBeam.init_curve(lambda s: np.array([s, rise * np.sin(np.pi * s)]),
                               np.linspace(0, 1, 7), height)
    scene = Scene(Beam(axis, ElementBeamCable(5), rubber, width=0.02))
    return scene.pin("left").pin("right").point_force((0, -share * force), at=(0.5, rise))


# %%
# **The design**: the arch shall snap at the load factor 1, at 0.2 N, and its lowest frequency shall
# be 8.5 rad/s. Two parameters, two readings, and their derivatives.

snap = CriticalLoad(ds=0.03, steps=40, until=lambda point: point.negative > 0)
design = Design(switch, [snap, Frequency()])
found = least_squares(lambda p: design.values(p) / [1.0, wanted] - 1.0, [1.6, 7.0],
                      lambda p: design.jacobian(p) / [[1.0], [wanted]],
                      bounds=([1.2, 5.0], [2.0, 10.0]), xtol=1e-12)
height, rise = 1e-2 * found.x
print(f"height {1e3 * height:.2f} mm, rise {1e3 * rise:.1f} mm: snaps at "
      f"{force * design.values(found.x)[0]:.6f} N, {found.nfev} solutions")
assert np.allclose(found.fun, 0.0, atol=1e-6)

# %%
# **Check**: at 97 % of the force the arch stands, at 103 % it has gone through.

crown = (0.5, rise)
below = switch(found.x, 0.97).solve_static()
with warnings.catch_warnings():  # of the snap
    warnings.simplefilter("ignore", StabilityWarning)
    above = switch(found.x, 1.03).solve_static()
assert below.displacement(crown)[1] > -rise > above.displacement(crown)[1]

# %%
# **It holds**: without the force it rests upside down, in a stable equilibrium.

rest = switch(found.x, 0.0).solve_static(start=above)
print(f"the crown rests at {1e3 * rest.position(crown)[1]:.1f} mm, and is {rest.stability}")
assert rest.position(crown)[1] < -0.5 * rise and rest.stability == "stable"

fig, ax = plt.subplots(figsize=(6.4, 3.6), layout="constrained")
plot_state([below, rest], "S_xx", ax=ax, thickness=1, undeformed=True, unit="kPa",
           title="stress before the snap, and at rest after it")
ax.set(xlabel="x (m)", ylabel="y (m)")
plt.show()
