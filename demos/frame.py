r"""A frame from a mesh of lines
============================

A portal and a building, made from a mesh of lines, are compared with handbook formulas for moment
and buckling.

The lines come from a drawing or a mesh program. A ``Frame`` makes each line a beam and joins them
rigidly. The building is then pushed sideways far beyond its design load.
"""

import matplotlib.pyplot as plt
import meshio
import numpy as np

from skfem_ancf import Frame, StVenantKirchhoff

# %%
# The mesh is made by a few lines of NumPy. In practice, ``meshio.read("building.msh")`` reads it.

storey, bay = 3.0, 5.0


def lines(storeys, bays):
    number = np.arange((storeys + 1) * (bays + 1)).reshape(storeys + 1, bays + 1)
    points = [(bay * x, storey * y, 0) for y in range(storeys + 1) for x in range(bays + 1)]
    columns = np.array([number[:-1].ravel(), number[1:].ravel()]).T
    girders = np.array([number[1:, :-1].ravel(), number[1:, 1:].ravel()]).T
    n = len(columns)
    cells = [("line", columns), ("line", girders), ("vertex", number[0, :, None]),
             ("vertex", number[1:, 0, None])]
    return meshio.Mesh(points, cells,
                       cell_sets={"columns": [np.arange(n), [], [], []],
                                  "girders": [[], np.arange(len(girders)), [], []],
                                  "ground": [[], [], np.arange(bays + 1), []],
                                  "side": [[], [], [], np.arange(storeys)]})


steel = StVenantKirchhoff(E=2.1e11, nu=0.3, density=7850)


def building(storeys, bays):
    frame = Frame.from_meshio(lines(storeys, bays), material=steel, height=0.12, width=0.12,
                              sections={"girders": {"height": 0.16}})
    return frame.clamp("ground")


# %%
# **Check**: a portal with clamped feet and a horizontal force H at its eaves. With the ratio k of
# the stiffnesses of girder and column, the moment at the feet is
# :math:`H h\, (3 k + 1) / (12 k + 2)`.

push = 100.0
portal = building(1, 1).point_force((push, 0), at="side")
feet = portal.solve_static().resultants(beam="columns").M
k = (0.16 / 0.12)**3 * storey / bay
expected = push * storey * (3 * k + 1) / (12 * k + 2)
print(f"moment at the feet: {np.max(abs(feet)):.3f} N m, handbook {expected:.3f} N m")
assert np.isclose(np.max(abs(feet)), expected, rtol=0.01)

# %%
# **The building**: four storeys, three bays, 20 kN per metre of girder. Its weight makes it softer
# against horizontal forces, by 1 / (1 - 1 / c), where c is the buckling factor of the weight.

top = (0, 4 * storey)


def pushed(push, weight=20e3, start=None):
    tower = building(4, 3).line_load((0, -weight), beam="girders")
    return tower.point_force((push, 0), at="side").solve_static(start=start)


critical = building(4, 3).line_load((0, -20e3), beam="girders").buckling(1).factors[0]
softer = pushed(1e3).displacement(top)[0] / pushed(1e3, weight=1.0).displacement(top)[0]
print(f"buckles at {critical:.2f} times its weight; pushed, it is {softer:.4f} times as soft, rule "
      f"{1 / (1 - 1 / critical):.4f}")
assert np.isclose(softer, 1 / (1 - 1 / critical), rtol=0.02)

# %%
# Increasing horizontal forces at each floor. Each solution starts from the one before.

states = [None]
for push in 1e3 * np.array([50, 100, 200, 300]):
    states.append(pushed(push, start=states[-1]))
    print(f"{1e-3 * push:g} kN: the top moves by {states[-1].displacement(top)[0]:.2f} m")
reaction = states[-1].reactions("ground").force
assert np.allclose(reaction, [-4 * push, 4 * 3 * bay * 20e3], rtol=1e-6)

fig, ax = plt.subplots(figsize=(7.4, 5), layout="constrained")
states[-1].plot("eps_xx", ax=ax, thickness=2, title=r"strain along the lines "
                r"$\varepsilon_{xx}$, 300 kN at each floor")
ax.set(xlabel="x (m)", ylabel="y (m)")
plt.show()
