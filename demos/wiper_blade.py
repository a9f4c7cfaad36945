r"""How evenly a wiper blade presses
================================

The contact pressure along two wiper blades with different curvatures, compared with the pressure
that they are made for.

A wiper blade is a strip of spring steel that is curved in its reference configuration. Pressed on
the glass by a force in its middle it lies flat, and its initial curvature determines the pressure.
One blade presses evenly. The other is curved more in the middle and less at its tips.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamCable, Line, MeshBeam, Scene, StVenantKirchhoff

# %%
# A force per length :math:`p = F / L` bends one half, clamped in the middle, by the moment
# :math:`p (L / 2 - s)^2 / 2`. A blade whose initial curvature is this moment over :math:`E I` lies
# flat under it. A blade that presses less at its tips, :math:`p = (2 F / L) (1 - 2 s / L)`, has a
# cubic moment.

length, height, width, force, E = 0.6, 1e-3, 8e-3, 10.0, 2e11
EI, half = E * width * height**3 / 12, length / 2
s = np.linspace(0, half, 2001)
even = force / (2 * length * EI) * (half - s)**2
middle = force / (6 * half**2 * EI) * (half - s)**3


def integral(f):
    return np.append(0.0, np.cumsum(0.5 * (f[1:] + f[:-1]) * np.diff(s)))


def pressed(curvature):
    """The blade on the glass, and how it was before."""
    turn = integral(curvature)
    x, y = integral(np.cos(turn)), integral(np.sin(turn))
    mesh = MeshBeam.init_curve(lambda at: np.array([np.sign(at) * np.interp(abs(at), s, x),
                                                    -np.interp(abs(at), s, y)]),
                               np.linspace(-half, half, 25), height)
    blade = Beam(mesh, ElementBeamCable(3), StVenantKirchhoff(E, nu=0.0), width=width)
    scene = Scene(blade).obstacle(Line((0, -y[-1] - height)))
    scene.fix(lambda x: abs(x[0]) < 1e-9, "r^1").point_force((0, -force), at=(0, 0))
    return scene.solve_static()


# %%
# **Check**: both have the pressure that they are made for, to 1 %. Excluded are the tips, and the
# kink of the pressure in the middle, where the node has the mean of both sides.

fig, (left, right) = plt.subplots(1, 2, figsize=(9.8, 3.8), layout="constrained")
for name, curvature, wanted in (
        ("even", even, lambda x: force / length + 0 * x),
        ("more in the middle", middle, lambda x: force / half * (1 - abs(x) / half))):
    state = pressed(curvature)
    contact = state.contact()
    x, per_length = contact.points[0], contact.pressure * width
    beside = (abs(x) > 0.1 * length) & (abs(x) < 0.4 * length)
    error = (per_length - wanted(x))[beside] / (force / length)
    print(f"{name}: {state.iterations} iterations, pressure within {100 * abs(error).max():.2f} %")
    assert np.isclose(contact.total[1], force, rtol=1e-6)
    assert abs(error).max() < 0.01
    order = np.argsort(x)
    left.plot(*state.system.beams[0].mesh.p, label=name)
    right.plot(x[order], wanted(x[order]), lw=5, alpha=0.3)
    right.plot(x[order], per_length[order], "k", lw=1)

# %%
# The shapes before, and the pressure on the glass (black) over that which was asked for.

left.set(xlabel="x (m)", ylabel="y (m)", title="stress-free")
left.legend(frameon=False)
right.set(xlabel="x (m)", ylabel="force per length (N/m)", title="pressed on the glass")
right.set_ylim(bottom=0)
plt.show()
