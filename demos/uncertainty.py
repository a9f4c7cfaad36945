r"""A sweep with uncertainty
========================

The scatter of the deflection of a plastic snap hook with uncertain modulus, thickness and force, by
a sweep.

How often is the deflection larger than allowed? A hundred samples, by SciPy's quasi-Monte Carlo,
take seconds. The result is compared with that of the formula for small deflections.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import norm, qmc, spearmanr

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff, sweep

# %%
# Median and logarithmic standard deviation of modulus (Pa), thickness (m) and force (N).

length, width = 0.04, 6e-3
names = ("modulus", "thickness", "force")
median = np.array([2.2e9, 1.5e-3, 3.0])
deviation = np.array([0.08, 0.03, 0.10])
allowed = 0.0175


def hook(modulus, thickness, force):
    mesh = MeshBeam.init_line(np.linspace(0, length, 7), thickness)
    beam = Beam(mesh, ElementBeamANCFCubic(2), StVenantKirchhoff(E=modulus, nu=0.38), width)
    return Scene(beam).clamp("left", thickness="free").point_force((0, -force), at=(length, 0))


def deflection(scene):
    return -scene.solve_static().displacement((length, 0))[1]


# %%
# Sobol points in the unit cube become normal deviates, then samples. A sweep solves them all. In a
# script, ``workers=8`` uses eight processes, ``client=`` a cluster.

deviates = norm.ppf(qmc.Sobol(len(names), seed=0).random_base2(7))
samples = median * np.exp(deviation * deviates)
tips = sweep(hook, dict(zip(names, samples.T)), deflection)["value"]

# %%
# **Check**: small deflections are :math:`4 F L^3 / E b t^3`, a product of powers. So their
# logarithm is normal, with a known deviation. A hundredth of the force must reproduce this.

formula = 4 * median[2] * length**3 / (median[0] * width * median[1]**3)
sigma = np.hypot(np.hypot(deviation[0], 3 * deviation[1]), deviation[2])
gentle = samples[:64] / np.array([1, 1, 100])
small = np.log(100 * sweep(hook, dict(zip(names, gentle.T)), deflection)["value"])
print(f"small: median {1e3 * np.exp(small.mean()):.2f} mm, formula {1e3 * formula:.2f} mm; "
      f"deviation {small.std():.4f}, formula {sigma:.4f}")
assert np.isclose(np.exp(small.mean()), formula, rtol=0.01)
assert np.isclose(small.std(), sigma, rtol=0.05)

# %%
# At large deflections the hook becomes stiffer: median and scatter are smaller. The rank
# correlations show which input matters most.

large = np.log(tips)
print(f"large: median {1e3 * np.exp(large.mean()):.2f} mm, deviation {large.std():.4f}")
print(f"beyond {1e3 * allowed:.1f} mm: {100 * np.mean(tips > allowed):.1f} % of the samples, "
      f"formula {100 * norm.sf(np.log(allowed / formula) / sigma):.1f} %")
ranks = {name: float(spearmanr(x, tips).statistic) for name, x in zip(names, samples.T)}
print({name: round(rank, 2) for name, rank in ranks.items()})
assert large.std() < 0.9 * sigma and max(ranks, key=lambda name: abs(ranks[name])) != "modulus"

fig, (left, right) = plt.subplots(1, 2, figsize=(9.6, 4.2), layout="constrained")
grid = np.linspace(8, 32, 300)
left.plot(grid, norm.cdf(np.log(1e-3 * grid / formula) / sigma), "k:", label="small deflections")
left.step(np.sort(1e3 * tips), (np.arange(len(tips)) + 0.5) / len(tips), label="computed")
left.axvline(1e3 * allowed, color="C3", lw=1, label="allowed")
left.set(xlabel="deflection of the tip (mm)", ylabel="part of the hooks below")
left.legend(frameon=False)
image = right.scatter(1e3 * samples[:, 1], samples[:, 2], c=1e3 * tips, cmap="viridis", s=22)
right.set(xlabel="thickness (mm)", ylabel="force (N)")
fig.colorbar(image, ax=right, label="deflection (mm)")
plt.show()
