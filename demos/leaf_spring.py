r"""A leaf spring with a shackle
============================

The stiffness of a leaf spring with a shackle, compared with Castigliano's theorem, and its
force-displacement curve.

The leaf connects a fixed eye and a shackle, a short link that lets the leaf become longer when it
is pressed flat. The axle presses from below. The leaf is thick in the middle and thin at its ends.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import quad

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, RigidBody, Scene, StVenantKirchhoff
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# A parabola of spring steel, 1 m between the eyes and 120 mm deep.

span, depth, width, thick, thin = 1.0, 0.12, 0.06, 12e-3, 6e-3
steel = StVenantKirchhoff(E=2.06e11, nu=0.3)


def leaf(x):
    return np.array([x, -4 * depth * x * (span - x) / span**2])


def height(x):
    return thin + (thick - thin) * (1 - np.abs(2 * x / span - 1))


mesh = MeshBeam.init_curve(leaf, np.linspace(0, span, 33), height)
beam = Beam(mesh, ElementBeamANCFCubic(2), steel, width, name="leaf")
left, right, middle = leaf(0.0), leaf(span), leaf(span / 2)


# %%
# The shackle is 80 mm long, hangs from the chassis and carries the right eye.

link = 0.08
top = right + [0, link]


def loaded(force, start=None):
    shackle = RigidBody(mass=0.5, inertia=1e-3, position=(right + top) / 2, name="shackle",
                        outline=[(-0.008, -link / 2), (0.008, -link / 2), (0.008, link / 2),
                                 (-0.008, link / 2)])
    scene = Scene(beam, shackle).pin("left", "leaf").pin(top, shackle)
    scene.hinge((beam, "right"), (shackle, right))
    scene.point_force((0, force), at=middle, beam="leaf")
    return scene.solve_static(start=start)


# %%
# **Check**: at first the shackle is vertical and acts as a roller. Castigliano's theorem gives the
# flexibility in the middle, an integral of the moment of a unit force along the leaf.


def flexibility(x):
    slope = -4 * depth * (span - 2 * x) / span**2
    ds, h = np.hypot(1, slope), height(x)
    moment, normal, shear = x / 2, slope / ds / 2, 1 / ds / 2
    EA = steel.E * width * h
    GA = EA / (2 * (1 + steel.nu)) * 5 / 6
    return (moment**2 / (EA * h**2 / 12) + normal**2 / EA + shear**2 / GA) * ds


expected = 1 / (2 * quad(flexibility, 0, span / 2)[0])
found = 1.0 / loaded(1.0).displacement(middle)[1]
print(f"stiffness at rest: {1e-3 * found:.3f} N/mm, Castigliano {1e-3 * expected:.3f} N/mm")
assert np.isclose(found, expected, rtol=3e-3)

# %%
# The load increases until the leaf is flat. Its eyes move apart, the shackle swings out, and the
# spring becomes softer.

forces = np.linspace(500, 5000, 10)
states = []
for force in forces:
    states.append(loaded(force, states[-1] if states else None))
travel = np.array([state.displacement(middle)[1] for state in states])
angles = np.degrees([state.angle("shackle") for state in states])
print(f"at {forces[-1]:g} N: {1e3 * travel[-1]:.1f} mm, secant "
      f"{1e-3 * forces[-1] / travel[-1]:.3f} N/mm; shackle leans by {angles.max():.1f} degrees")

fig, (above, below) = plt.subplots(2, 1, figsize=(8, 6.4), height_ratios=(1.1, 1),
                                   layout="constrained")
plot_state([states[0], states[-1]], "S_xx", ax=above, thickness=1, unit="Pa",
           title="stress along the leaf $S_{xx}$, at 0.5 and 5 kN")
above.set(xlabel="x (m)", ylabel="y (m)")
below.plot(1e3 * travel, 1e-3 * forces, "o-", label="force (kN)")
below.plot(1e3 * travel, 1e-3 * found * travel, "k:", label="stiffness at rest")
below.set(xlabel="travel of the axle (mm)", ylabel="force (kN)")
below.legend(frameon=False)
plt.show()
