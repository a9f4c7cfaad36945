r"""A wire in gel
=============

A thin wire that is pushed along its axis buckles into one arc. In something soft that holds it, as
gel, soil or a cell, it buckles into many short waves. The gel is an energy density of three lines:
the wire under a force across it, the force at which the waves appear, and what comes after, in a
gel that becomes stiffer and in one that yields.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff
from skfem_ancf.visuals.matplotlib import plot_state

# %%
# A polymer wire, and the stiffness k of the gel per length and deflection: such that the wire has
# eight half waves, by the theory of a long beam on Winkler's bedding.

length, side, waves = 0.2, 1e-3, 8
polymer = StVenantKirchhoff(E=2e9, nu=0.3)
EI = polymer.E * side**4 / 12
k = EI * (waves * np.pi / length) ** 4
beam = Beam(MeshBeam.init_line(np.linspace(0, length, 41), side), ElementBeamANCFCubic(2),
            polymer, side)

# %%
# The energy per length of the axis, of the deflection r - X, hardening or not. It is there before
# any load: ``scaled=False``, so that load factors are those of the forces alone.


def gel(hardening, size=2 * side):
    def psi(r, F, X, t):
        w2 = (r[1] - X[1]) ** 2
        return 0.5 * k * w2 * (1 + w2 / (2 * size**2) if hardening else 1 / (1 + w2 / size**2))

    return Scene(beam).energy(psi, over="axis", scaled=False)


# %%
# **A force across the middle**, so small that both are linear, against Hetenyi ("Beams on Elastic
# Foundation", 1946): the deflection dies away in waves.

force, decay = 1e-3, (k / (4 * EI)) ** 0.25
state = gel(True).fix("left", "r^1").point_force((0, -force), at=(length / 2, 0)).solve_static()
x = np.linspace(0.03, 0.17, 141)
far = decay * abs(x - length / 2)
exact = -force * decay / (2 * k) * np.exp(-far) * (np.cos(far) + np.sin(far))
found = state.displacement(np.array([x, 0 * x]))[1]
print(f"deflection at most {np.max(abs(found - exact)) / np.max(abs(exact)):.1e} from the beam's")
assert np.allclose(found, exact, rtol=0, atol=0.02 * np.max(abs(exact)))

# %%
# **The force at which it buckles** is :math:`2 \sqrt{k EI}`, however long the wire is. Without the
# gel 1/128 of it would do.

critical = 2 * np.sqrt(k * EI)


def pushed(hardening):
    scene = gel(hardening).pin("left").fix("right", "r^2")
    return scene.point_force((-critical, 0), at=(length, 0))


factor = pushed(True).buckling(1).factors[0]
print(f"it buckles at {factor * critical:.4f} N, Hetenyi {critical:.4f} N")
assert np.isclose(factor, 1, rtol=5e-3)

# %%
# **Beyond it** the straight wire is one solution, and the waves branch off. In a gel that hardens
# they grow with the force; in one that yields they carry less the larger they are, and snap.
#
# **The check**: waves of one harmonic of the height a, whose mean energy gives the stiffness k of
# the gel the factor :math:`1 + 3 a^2 / 4` or :math:`(1 + a^2)^{-3/2}`, a in units of ``size``.

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
# The force over the height of the waves, broad by one harmonic, and the wire.

upper.set(xlabel="height of the waves / side of the wire", ylabel=r"force / $2\sqrt{k EI}$")
upper.legend(frameon=False)
lower.set(xlabel="x (m)", ylabel="y (m)")
plt.show()
