r"""A load that crosses a bridge
============================

A force crosses a bridge on a sliding wheel, and the deflection is compared with Krylov's series.

A slow load bends the bridge as in statics. A fast load bends it more, since the bridge vibrates,
and the deflection is largest when the load has passed the middle. Krylov [1]_ computed it in 1905
for a constant force. At a speed that no lorry reaches it is 1.7 times the static one.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamCable, MeshBeam, RigidBody, Scene, StVenantKirchhoff

# %%
# The girder is of concrete, on a pin and a roller. The wheel slides on it, and vertically on a
# carriage. The carriage moves at a given speed and carries no load.

span, height, width, load = 20.0, 0.6, 0.4, 5e4                    # m, N
concrete = StVenantKirchhoff(E=3e10, nu=0.2, density=2500)
girder = Beam(MeshBeam.init_line(np.linspace(0, span, 5), height), ElementBeamCable(5), concrete,
              width=width, name="girder")


def cross(speed, steps=60):
    """The motion while a load crosses the girder, up to just before its end."""
    carriage = RigidBody(mass=1.0, inertia=1.0, position=(0, 2), name="carriage")
    wheel = RigidBody(mass=1.0, inertia=1.0, position=(0, 0), name="wheel")
    scene = Scene(girder, carriage, wheel).pin("left", "girder").fix("right", "r^2", beam="girder")
    scene.joint("position", beam=carriage, r=lambda t: (speed * t, 2.0))
    scene.joint("angle", beam=carriage, angle=lambda t: 0.0)
    scene.slider(wheel, on=carriage, direction=(0, 1), angle=True)
    scene.slider(wheel, on=girder)
    scene.point_force((0, -load), wheel)
    end = 0.999 * span / speed
    return scene.integrate(end, end / steps, scheme="generalized-alpha")


# %%
# **Check**: Krylov's series for small deflections. Its parameter is the speed over the critical
# speed, at which the load crosses the span in half a period of the lowest mode.

EI, mass = 3e10 * width * height**3 / 12, 2500 * width * height
critical = np.pi / span * np.sqrt(EI / mass)                       # m/s
static = load * span**3 / (48 * EI)


def krylov(speed, t):
    """The sag of the middle, over the static one."""
    n = np.arange(1, 40)[:, None]
    rotary = 1 + (n * np.pi * height / span)**2 / 12               # by rotary inertia
    passing, own = n * np.pi * speed / span, (n * np.pi / span)**2 * np.sqrt(EI / mass / rotary)
    swing = (np.sin(passing * t) - passing / own * np.sin(own * t)) / (own**2 - passing**2)
    swing *= 2 * load / (mass * rotary * span) / static
    return np.sum(swing * np.sin(n * np.pi / 2), axis=0)


ratios = np.array([0.15, 0.3, 0.45, 0.6, 0.75, 0.95])
motions = [cross(r * critical) for r in ratios]
sags = [-motion.displacement((span / 2, 0), beam=girder)[:, 1] / static for motion in motions]
for r, motion, sag in zip(ratios, motions, sags):
    expected = krylov(r * critical, motion.t)
    print(f"{r:.2f} of {critical:.0f} m/s: {sag.max():.3f} times the static sag, "
          f"Krylov {expected.max():.3f}")
    assert np.max(np.abs(sag - expected)) < 0.03
    assert np.isclose(sag.max(), expected.max(), rtol=0.01)

# %%
# At 0.6 of the critical speed the deflection is largest, when the load is near the end.

fig, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
for r, motion, sag in list(zip(ratios, motions, sags))[1::2]:
    line, = left.plot(motion.t * r * critical, sag, label=f"{r:.2f} of the critical speed")
    left.plot(motion.t * r * critical, krylov(r * critical, motion.t), lw=5, alpha=0.3,
              color=line.get_color())
left.set(xlabel="place of the load (m)", ylabel="sag of the middle / static", ylim=(2.2, -0.2))
left.legend(frameon=False)
fine = np.linspace(0.02, 1.2, 200)
t = np.linspace(0, span, 400)
right.plot(fine, [krylov(r * critical, t / (r * critical)).max() for r in fine], lw=5, alpha=0.3,
           label="Krylov")
right.plot(ratios, [sag.max() for sag in sags], "ko", label="computed")
right.set(xlabel="speed / critical speed", ylabel="largest sag of the middle / static")
right.legend(frameon=False)
plt.show()

# %%
# .. [1] A. N. Krylov, Über die erzwungenen Schwingungen von gleichförmigen elastischen Stäben,
#    Mathematische Annalen 61 (1905) 211-234.
