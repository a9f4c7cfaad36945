r"""A clip from measured points
===========================

A spring clip whose axis is measured point by point is spread open, and its stiffness is compared
with Castigliano's theorem.

The clip has the shape of a U. There is no drawing, only points along its axis with an error of a
twentieth of a millimetre. A smoothing spline through them is the axis of the beam. The results are
written to a file for ParaView and to tables.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Beam, ElementBeamANCFCubic, MeshBeam, Scene, StVenantKirchhoff

# %%
# The file has rows x, y in mm: two legs of 30 mm and half a circle of 8 mm, with errors.

R, L, noise = 8.0, 30.0, 0.05
s = np.linspace(-L - np.pi / 2 * R, L + np.pi / 2 * R, 160)
angle, leg = np.clip(s / R, -np.pi / 2, np.pi / 2), np.maximum(np.abs(s) - np.pi / 2 * R, 0.0)
points = np.column_stack([R * np.cos(angle) - leg, R * np.sin(angle)])
points += noise * np.random.default_rng(4).standard_normal(points.shape) / np.sqrt(2)
out = Path("out")
out.mkdir(exist_ok=True)
np.savetxt(out / "clip.csv", points, delimiter=",", header="x, y", comments="")

# %%
# The root mean square distance of the axis from the points is their error. A curve through all
# points would have kinks of ten degrees.

mesh = MeshBeam.from_points(out / "clip.csv", height=1.0, elements=48, noise=noise)
steel = StVenantKirchhoff(E=2.1e5, nu=0.3)  # in MPa
clip = Beam(mesh, ElementBeamANCFCubic(2), steel, width=5.0, name="clip")
lower, upper = mesh.p[:, 0], mesh.p[:, -1]
print(f"length {mesh.lengths.sum():.2f} mm, of the U {2 * L + np.pi * R:.2f} mm")

# %%
# Forces of 10 N at the ends spread the clip. The ``units`` appear at the colour bar, in files and
# in tables.

scene = Scene(clip).units("N", "mm").pin("left").fix("right", "r^1")
state = scene.point_force((0, 10.0), at="right").solve_static()

# %%
# **Castigliano's theorem** for small displacements, with the moments :math:`F x` in the legs and
# :math:`F (L + R \sin\varphi)` in the half circle:
#
# .. math:: w = \frac{F}{EI} \left(\frac{2 L^3}{3} + R \left(\pi L^2 + 4 L R
#           + \frac{\pi R^2}{2}\right)\right)

EI = steel.E * 5.0 / 12
handbook = 10.0 / EI * (2 * L**3 / 3 + R * (np.pi * L**2 + 4 * L * R + np.pi * R**2 / 2))
linear = scene.solve_linear().displacement(upper)[1]
print(f"opens by {linear:.3f} mm, by Castigliano {handbook:.3f} mm; "
      f"in large displacements by {state.displacement(upper)[1]:.3f} mm")
assert np.isclose(linear, handbook, rtol=0.02)

# %%
# Section forces as a table, and stress as a labelled array, need the extra ``arrays``. The largest
# moment is at the vertex, :math:`F (L + R)`. The file for ParaView has names and units.

table = state.resultants().to_dataframe()
largest = table.loc[table.M.abs().idxmax()]
print(largest[["x", "y", "N", "M"]].round(2).to_string())
data = state.to_xarray(["displacement", "S_xx"])
print(f"S_xx up to {float(data.S_xx.max()):.0f} {data.S_xx.units}")
state.save(out / "clip.vtu")
assert np.isclose(abs(largest.M), 10.0 * (L + R), rtol=0.02)
assert np.isclose(abs(largest.M) / (5.0 / 6), float(data.S_xx.max()), rtol=0.1)

fig, ax = plt.subplots(figsize=(7.5, 4.6), layout="constrained")
state.plot("S_xx", ax=ax, thickness=1, title="a clip through measured points, spread by 10 N")
ax.plot(*points.T, "k.", ms=2, label="measured")
ax.legend(frameon=False, loc="center")
plt.show()
