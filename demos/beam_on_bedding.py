r"""A wire in gel
=============

An axially loaded wire in an elastic medium buckles into many short waves, at a load that is
compared with Hetenyi's theory.

Without the medium, here a gel, it buckles into one arc. The gel is an energy density of three
lines, which hardens or softens.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# A polymer wire. The stiffness k of the gel, per length and deflection, makes the wire buckle into
# eight half waves, by the theory of a long beam on Winkler's foundation.

length, side, waves = 0.2, 1e-3, 8
polymer = StVenantKirchhoff(E=2e9, nu=0.3)
EI = polymer.E * side**4 / 12
k = EI * (waves * np.pi / length) ** 4
beam = Beam(MeshBeam.init_line(np.linspace(0, length, 41), side), ElementBeamANCFCubic(2),
            polymer, side)

# %%
# The energy per length is a function of the deflection r - X. With ``scaled=False`` it does not
# scale with the load, so that load factors are those of the forces alone.


def gel(hardening, size=2 * side):
    def psi(r, F, X, t):
        w2 = (r[1] - X[1]) ** 2
        return 0.5 * k * w2 * (1 + w2 / (2 * size**2) if hardening else 1 / (1 + w2 / size**2))

    return Scene(beam).energy(psi, over="axis", scaled=False)


# %%
# **A transverse force in the middle**, small enough for linear theory, against Hetenyi ("Beams on
# Elastic Foundation", 1946): the deflection decays in waves.

force, decay = 1e-3, (k / (4 * EI)) ** 0.25
state = gel(True).fix("left", "r^1").point_force((0, -force), at=(length / 2, 0)).solve_static()
x = np.linspace(0.03, 0.17, 141)
far = decay * abs(x - length / 2)
exact = -force * decay / (2 * k) * np.exp(-far) * (np.cos(far) + np.sin(far))
found = state.displacement(np.array([x, 0 * x]))[1]
print(f"deflection at most {np.max(abs(found - exact)) / np.max(abs(exact)):.1e} from the beam's")
assert np.allclose(found, exact, rtol=0, atol=0.02 * np.max(abs(exact)))

# %%
# **The critical load** is :math:`2 \sqrt{k EI}` for any length of the wire. Without the gel it is
# 128 times smaller.

critical = 2 * np.sqrt(k * EI)


def pushed(hardening):
    scene = gel(hardening).pin("left").fix("right", "r^2")
    return scene.point_force((-critical, 0), at=(length, 0))


factor = pushed(True).buckling(1).factors[0]
print(f"it buckles at {factor * critical:.4f} N, Hetenyi {critical:.4f} N")
assert np.isclose(factor, 1, rtol=5e-3)

# %%
# **Beyond the critical load** waves branch off the straight wire. The load grows with them in a gel
# that hardens, and decreases in one that softens: the wire snaps.
#
# **Check**: for waves of one harmonic with amplitude a, in units of ``size``, the mean energy
# multiplies the stiffness k by :math:`1 + 3 a^2 / 4` or :math:`(1 + a^2)^{-3/2}`.

factors = {"hardening": lambda a: 1 + 0.75 * a**2, "yielding": lambda a: (1 + a**2) ** -1.5}
fig, (upper, lower) = plt.subplots(2, 1, figsize=(7, 5), height_ratios=(2, 1),
                                   layout="constrained")
for name, factor in factors.items():
    scene = pushed(name == "hardening")
    point = scene.continuation(ds=1e-3 * length, max_load=1.005).critical_points[0]
    path = scene.continuation(branch=point, ds=4e-3 * length, max_load=1.5, steps=14, locate=None)
    height = abs(path.displacement((length / (2 * waves), 0))[:, 1]) / side
    exact = 0.5 + 0.5 * factor(height / 2)
    print(f"{name}: {path.load[-1]:.3f} at a height of {height[-1]:.2f}, harmonic {exact[-1]:.3f}")
    assert np.allclose(path.load, exact, rtol=0.04) and len(path) > 8
    line, = upper.plot(height, exact, lw=5, alpha=0.3)
    upper.plot(height, path.load, ".-", color=line.get_color(), label=name)
    if name == "hardening":
        plot_state(path.state(-1), "S_xx", ax=lower, unit="Pa",
                   title=f"stress $S_{{xx}}$ in the gel that hardens, at {path.load[-1]:.2f}")

# %%
# The load against the amplitude of the waves (broad line: one harmonic), and the wire.

upper.set(xlabel="height of the waves / side of the wire", ylabel=r"force / $2\sqrt{k EI}$")
upper.legend(frameon=False)
lower.set(xlabel="x (m)", ylabel="y (m)")
plt.show()
