r"""A tuning fork
=============

The natural modes of a tuning fork, compared with a two-dimensional solution, and the force at its
foot in each mode.

A tuning fork sounds for a minute although a hand holds it. In that mode the prongs move against
each other, and the stem carries almost no force.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.sparse.linalg import eigsh
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, asm
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff

# %%
# Two prongs and half a circle, from one steel bar. The curve is a function of its arc length.

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
# **Check**: the fork without stem and support, against a plane body in stock scikit-fem, in plane
# stress. The first three modes are rigid motions.

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
# With its stem, whose foot is clamped.

foot = (0, -bend - stem)
axis = MeshBeam.init_line(np.linspace(0, stem, 7), height, origin=foot, angle=np.pi / 2)
scene = Scene(fork, Beam(axis, ElementBeamANCFCubic(2), steel, height, name="stem"))
scene.clamp("left", beam="stem", thickness="free").weld((0, -bend))
modes = scene.modes(3)
frequencies = modes.frequencies / (2 * np.pi)

# %%
# The force at the foot in each mode, for 1 mm at the end of a prong.

fig, axes = plt.subplots(1, 3, figsize=(9.6, 4.8), sharey=True, layout="constrained")
felt = []
for k, (frequency, ax) in enumerate(zip(frequencies, axes)):
    shape = modes.mode(k, displacement=1e-3)
    felt.append(np.hypot(*shape.reactions("left", beam="stem").force))
    modes.mode(k, displacement=8e-3).plot("displacement", ax=ax, colorbar=False, thickness=1,
                                          title=f"{frequency:.0f} Hz, foot {felt[-1]:.1f} N")
    ax.set(xlabel="x (m)", ylabel="y (m)" if k == 0 else "")

# %%
# The second mode sounds, at the frequency of the free fork: its force at the foot is the smallest.

singing = int(np.argmin(felt))
assert felt[singing] < 0.3 * min(f for k, f in enumerate(felt) if k != singing)
assert np.isclose(frequencies[singing], free[0], rtol=0.01)

# %%
# The motion from this shape, for one period.

start = modes.mode(singing, displacement=2e-3)
history = scene.integrate(1 / frequencies[singing], 1 / 32 / frequencies[singing], start=start)
history.animate("out/tuning_fork.gif", "eps_xx", thickness=1, undeformed=False, fps=16)
plt.show()
