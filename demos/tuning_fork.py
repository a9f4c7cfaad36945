r"""A tuning fork
=============

Strike a tuning fork and hold it by its stem: it sings for a minute, although a hand damps
everything that it can feel. The prongs swing against each other, so that the stem has next to
nothing to carry. The natural modes show which one that is, and how still the foot of the stem stays
in it.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.sparse.linalg import eigsh
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, asm
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff

# %%
# Two prongs, joined by half a circle, from one bar of steel; the curve is given by its arc length.

height, bend, prong, stem = 4e-3, 10e-3, 73e-3, 35e-3
steel = StVenantKirchhoff(E=2.06e11, nu=0.29, density=7850)
arc = np.pi / 2 * bend


def curve(s):
    turn = np.clip(s, -arc, arc) / bend
    beyond = s - bend * turn
    return np.array([bend * np.sin(turn), -bend * np.cos(turn) + np.abs(beyond)])


ends = np.linspace(arc, arc + prong, 7)
def tangent(s):
    turn = np.clip(s, -arc, arc) / bend
    return np.array([np.cos(turn), np.sin(turn)])


nodes = np.concatenate([-ends[::-1], np.linspace(-arc, arc, 9)[1:-1], ends])
mesh = MeshBeam.init_curve(curve, nodes, height, tangent)
fork = Beam(mesh, ElementBeamANCFCubic(2), steel, height, name="fork")

# %%
# **The check**: the fork without a stem, flying freely, against the plane body in stock scikit-fem:
# plane stress, quadratic quads. Three rigid motions come first.

quad = fork.mesh.to_meshquad(8, 6)
basis = Basis(quad, ElementVector(ElementQuad2()))
lam, mu = lame_parameters(steel.E, steel.nu)


@BilinearForm
def mass(u, v, w):
    return steel.density * dot(u, v)


K = asm(linear_elasticity(2 * lam * mu / (lam + 2 * mu), mu), basis)
values = eigsh(K, k=5, M=asm(mass, basis), sigma=-1e6, return_eigenvectors=False)
plane = np.sqrt(np.sort(values)[3:]) / (2 * np.pi)
free = Scene(fork).modes(5).frequencies[3:] / (2 * np.pi)
print("free fork:", free.round(2), "Hz; plane body:", plane.round(2), "Hz")
assert np.allclose(free, plane, rtol=3e-3)

# %%
# With its stem, whose foot is held.

foot = (0, -bend - stem)
axis = MeshBeam.init_line(np.linspace(0, stem, 7), height, origin=foot, angle=np.pi / 2)
scene = Scene(fork, Beam(axis, ElementBeamANCFCubic(2), steel, height, name="stem"))
scene.clamp("left", beam="stem", thickness="free").weld((0, -bend))
modes = scene.modes(3)
frequencies = modes.frequencies / (2 * np.pi)

# %%
# Of each mode the force in the foot, while an end of a prong moves by 1 mm.

fig, axes = plt.subplots(1, 3, figsize=(9.6, 4.8), sharey=True, layout="constrained")
end, felt = curve(arc + prong), []
for k, (frequency, ax) in enumerate(zip(frequencies, axes)):
    unit = np.hypot(*modes.mode(k, 1e-6).displacement(end, beam="fork")) / 1e-6
    felt.append(np.hypot(*modes.mode(k, 1e-6 / unit).reactions("left", beam="stem").force) * 1e3)
    modes.mode(k, 8e-3 / unit).plot("displacement", ax=ax, colorbar=False, thickness=1,
                                    title=f"{frequency:.0f} Hz, foot {felt[-1]:.1f} N")
    ax.set(xlabel="x (m)", ylabel="y (m)" if k == 0 else "")

# %%
# The mode that sings is the second one: in it the foot carries a quarter or less of what it does in
# the others. Its frequency is that of the free fork.

singing = int(np.argmin(felt))
assert felt[singing] < 0.3 * min(f for k, f in enumerate(felt) if k != singing)
assert np.isclose(frequencies[singing], free[0], rtol=0.01)

# %%
# The motion from that shape, let go: one period.

start = modes.mode(singing, 2e-3 / unit)
history = scene.integrate(1 / frequencies[singing], 1 / 32 / frequencies[singing], start=start)
history.animate("out/tuning_fork.gif", "eps_xx", thickness=1, undeformed=False, fps=16)
plt.show()
