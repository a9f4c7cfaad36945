"""A meander spring, pulled until it is straight
=============================================

A flat meander spring is pulled until it is straight, and its initial stiffness is compared with
Castigliano's theorem.

Such springs are cut from sheet. At small forces the bending of the arms makes the spring soft. At
large forces the arms align with the force, and the spring becomes stiff. The wave is the reference
configuration of the beam, a curve given by a function.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import quad

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, NeoHookean, Scene

# %%
# Three periods of y = 16 mm sin(x / 10 mm), of rubber, 1 mm thick and 10 mm wide.

unit, amplitude, periods = 0.01, 1.6, 3
height, width = 0.1 * unit, unit
rubber = NeoHookean(E=5e6, nu=0.45, plane="stress")


def wave(s):
    return unit * np.array([s, amplitude * np.sin(s)])


mesh = MeshBeam.init_curve(wave, np.linspace(0, 2 * np.pi * periods, 73), height)
beam = Beam(mesh, ElementBeamANCFCubic(2), rubber, width)
end, length = mesh.p[:, -1], mesh.lengths.sum()
print(f"end to end {1e3 * end[0]:.1f} mm, along the wave {1e3 * length:.1f} mm")


def pull(force, start=None):
    scene = Scene(beam).clamp("left", thickness="free").point_force((force, 0), at=end)
    return scene.solve_static(start=start)


# %%
# **Check**: for small forces Castigliano's theorem gives the displacement of the end as an integral
# along the wave, of M^2 / EI with the lever y and of N^2 / EA.

EI, EA = rubber.E * width * height**3 / 12, rubber.E * width * height


def flexibility(s):
    ds = unit * np.hypot(1, amplitude * np.cos(s))
    return (wave(s)[1] ** 2 / EI + (unit / ds) ** 2 / EA) * ds


stiffness = 1 / quad(flexibility, 0, 2 * np.pi * periods, limit=200)[0]
small = 1e-3 * stiffness * end[0]
found = small / pull(small).displacement(end)[0]
print(f"stiffness at rest {found:.4f} N/m, Castigliano {stiffness:.4f} N/m")
assert np.isclose(found, stiffness, rtol=0.01)

# %%
# Increasing forces. Each solution starts from the one before.

forces = np.array([0.125, 0.5, 2, 8]) * stiffness * end[0]
states = [pull(forces[0])]
for force in forces[1:]:
    states.append(pull(force, states[-1]))
travel = np.array([state.displacement(end)[0] for state in states])
tangent = np.diff(forces) / np.diff(travel)
print("stiffness between them:", tangent.round(2), "N/m")
assert np.all(np.diff(tangent) > 0) and tangent[0] > stiffness

fig, axes = plt.subplots(len(states), 1, sharex=True, figsize=(8, 8), layout="constrained")
for force, state, ax in zip(forces, states, axes):
    state.plot("eps_xx", ax=ax, thickness=1, limits=(-0.06, 0.06), colorbar=ax is axes[-1],
               title=rf"$\varepsilon_{{xx}}$ at {1e3 * force:.3g} mN")
    ax.set(xlabel="x (m)" if ax is axes[-1] else "", ylabel="y (m)", ylim=(-0.025, 0.025))
plt.show()
