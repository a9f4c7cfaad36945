r"""A gripper is designed
=====================

The thicknesses of 307 struts are found from a grid that does not grip, so that a push closes a jaw.

Half of a compliant gripper is a grid of struts welded to each other, clamped at a corner and guided
on its line of symmetry. At first all struts are equally thick, and a push at the left hardly moves
the jaw, and opens it. The gradient of the displacement of the jaw by all thicknesses takes one
linear solution, and a quasi-Newton method makes a mechanism of the grid.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import minimize

from skfem_ancf import Design, Frame, Parameters, StVenantKirchhoff

# %%
# **The grid**: 14 by 7 points, with all struts between neighbours but in the mouth, at the lower
# right. Crossing diagonals are not joined.

cell, plastic = 5e-3, StVenantKirchhoff(E=2e9, nu=0.4)
points = np.array([(x, y) for x in range(14) for y in range(7)])
pairs = [(a, b) for a in range(98) for b in range(98) if tuple(points[b] - points[a]) in (
    (1, 0), (0, 1), (1, 1), (1, -1))]
middles = points[pairs].mean(axis=1).T
pairs = np.array(pairs)[(middles[0] < 10.1) | (middles[1] > 1.9)]
used = np.unique(pairs)
lines, points = np.searchsorted(used, pairs), cell * points[used]
push, jaw, corner = (0.0, 0.0), (13 * cell, 2 * cell), (0.0, 6 * cell)

# %%
# Springs stand for what pushes and for what is gripped. The push is small: the design is one of
# small displacements. One element has one thickness, so it cannot vary within a strut.



def frame(heights, elements=1):
    scene = Frame.from_lines(points, lines, elements=elements, height=heights, width=5e-3,
                             material=plastic)
    scene.clamp([int(np.argmin(np.hypot(*(points - corner).T)))])
    scene.hold([k for k, (x, y) in enumerate(points) if y == 0.0], "y", "angle")
    scene.spring(1e4, (push, ("ground", (-0.05, 0.0))))
    scene.spring(2e3, (jaw, ("ground", (13 * cell, -0.05))))
    return scene.point_force((0.05, 0.0), at=push).sensor("jaw", "displacement", at=jaw)


grid = frame(0.3e-3)
beam, = grid.beams
design = Design(Parameters(grid, [(beam, "height", "elements")]), ["jaw"])
close, lengths = design.objective(lambda y: 2e7 * y[1]), beam.mesh.lengths
print(f"{len(lengths)} struts, {grid.N} degrees of freedom")

# %%
# **The design** has the logarithms of the thicknesses as unknowns, within bounds, and a penalty on
# more material than at first.


def goal(logarithms):
    heights = np.exp(logarithms)
    value, gradient = close(heights)
    excess = max(0.0, lengths @ heights / (lengths.sum() * 0.3e-3) - 1.0)
    gradient += 200.0 * excess * lengths / (lengths.sum() * 0.3e-3)
    return value + 100.0 * excess**2, heights * gradient


start = np.full(len(lengths), np.log(0.3e-3))
found = minimize(goal, start, jac=True, method="L-BFGS-B", options={"maxiter": 20},
                 bounds=[(np.log(0.03e-3), np.log(1.5e-3))] * len(lengths))
before, after = (design.values(np.exp(x))[1] for x in (start, found.x))
heights = np.exp(found.x)
print(f"the jaw moves by {1e9 * before:+.0f} nm at first, {1e9 * after:+.0f} nm in the end, with "
      f"{lengths @ heights / (lengths.sum() * 0.3e-3):.2f} of the material; {found.nfev} solutions")
assert before > 0 and after < -10 * before

# %%
# **Check** on three elements for each strut: a field that is free at each node would find zigzags
# that only the mesh can see. Here nothing changes.

again = frame(heights.tolist(), elements=3).solve_static().displacement(jaw)[1]
assert np.isclose(again, after, rtol=1e-3)

fig, ax = plt.subplots(figsize=(7.2, 3.8), layout="constrained")
for (a, b), h in zip(points[lines], heights, strict=True):
    ax.plot(*np.transpose([a, b]), "k", lw=4e3 * h, solid_capstyle="round")
ax.plot(*push, "C0>", *jaw, "C3v", ms=9)
ax.set(aspect="equal", xlabel="x (m)", ylabel="y (m)", title="struts that push the jaw down")
plt.show()
