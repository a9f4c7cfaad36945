"""A four-bar linkage with a flexible coupler
==========================================

A four-bar linkage with a flexible coupler runs slowly and fast, and its rocker is compared with the
rigid linkage.

The coupler is a thin strip. At low speed the linkage moves like a rigid one. At high speed inertia
bends the coupler, and the rocker deviates. Crank and rocker are rigid bodies, joined by hinges; a
motor drives the crank.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import (Beam, ElementBeamCable, KelvinVoigt, MeshBeam, RigidBody, Scene,
                        StVenantKirchhoff)

# %%
# The lengths of the linkage, and its hinges in the initial position.

crank, coupler, rocker, ground = 0.10, 0.45, 0.30, 0.40


def rocker_angle(phi):
    """Of a rigid linkage, from the law of cosines."""
    x, y = crank * np.cos(phi) - ground, crank * np.sin(phi)
    d = np.hypot(x, y)
    inside = np.arccos((d**2 + rocker**2 - coupler**2) / (2 * d * rocker))
    return np.pi + np.arctan2(-y, -x) - inside


A, B, D = np.array([0.0, 0.0]), np.array([crank, 0.0]), np.array([ground, 0.0])
C = D + rocker * np.array([np.cos(rocker_angle(0)), np.sin(rocker_angle(0))])


def bar(a, b, name, mass):
    n, half = 0.008 * np.array([[0, 1], [-1, 0]]) @ (b - a) / np.hypot(*(b - a)), (b - a) / 2
    return RigidBody(mass=mass, inertia=mass * np.sum((b - a)**2) / 12, position=(a + b) / 2,
                     name=name, outline=[-half - n, half - n, half + n, n - half])


# %%
# The linkage at a given speed, which the motor reaches in the first half turn. Some material
# damping lets the initial vibration decay.


def linkage(speed, turns=2.5):
    steel = StVenantKirchhoff(E=2.1e11, nu=0.3, density=7850)
    axis = MeshBeam.init_line(np.linspace(0, coupler, 5), height=1.5e-3, origin=B,
                              angle=np.arctan2(*(C - B)[::-1]))
    strip = Beam(axis, ElementBeamCable(5), steel, width=0.02, damping=KelvinVoigt(1e-3))
    first, last = bar(A, B, "crank", 0.3), bar(D, C, "rocker", 0.4)
    scene = Scene(strip, first, last).pin(A, first).pin(D, last)
    hinge = scene.hinge((first, B), (strip, "left"))
    scene.hinge((strip, "right"), (last, C))
    ramp = np.pi / speed

    def angle(t):
        s = np.minimum(t, ramp)
        return speed * (s / 2 - ramp / (2 * np.pi) * np.sin(np.pi * s / ramp) + t - s)

    scene.motor(first, angle=angle)
    t_end = 2 * np.pi * turns / speed + ramp / 2
    history = scene.integrate(t_end, t_end / 300, scheme="generalized-alpha")
    swing = np.unwrap(history.angle("rocker"))
    return history, angle(history.t), swing, history.resultants(
        axis.p[:, 2]).M, history.joint_force(hinge)


# %%
# **Check**: at half a turn per second the rocker follows the law of cosines.

fig, axes = plt.subplot_mosaic([["body", "angle"], ["body", "moment"]], figsize=(10, 5),
                               width_ratios=(1.2, 1), layout="constrained")
for turns_per_second in (0.5, 8):
    history, phi, swing, M, _ = linkage(2 * np.pi * turns_per_second)
    rigid = rocker_angle(phi) - rocker_angle(0)
    error = np.degrees(swing - rigid)
    print(f"{turns_per_second:g} turns/s: rocker off by at most {np.max(abs(error)):.4f} degrees, "
          f"bending moment in the middle up to {np.max(abs(M)):.3f} N m")
    axes["angle"].plot(phi / (2 * np.pi), error, label=f"{turns_per_second:g} turns/s")
    axes["moment"].plot(phi / (2 * np.pi), M)
    assert turns_per_second > 1 or np.max(abs(error)) < 0.02
assert np.max(abs(error)) > 0.2
axes["angle"].set(ylabel="rocker less\nrigid one (degrees)")
axes["angle"].legend(frameon=False)
axes["moment"].set(xlabel="turns of the crank", ylabel="M half way (N m)")
history.plot("S_xx", times=np.linspace(0.62, 1.0, 4) * history.t[-1], ax=axes["body"], unit="Pa",
             undeformed=False, title="bending stress of the coupler at 8 turns/s")
axes["body"].set(xlabel="x (m)", ylabel="y (m)")
history.animate("out/four_bar.gif", "S_xx", unit="Pa", undeformed=False)
plt.show()
