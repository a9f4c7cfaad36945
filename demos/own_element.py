r"""A user-defined element
======================

A new element with second derivatives at its nodes, in a class of four lines, and its order of
convergence.

Elements are polynomials along the beam and across its section. A new element is a list of the
degrees of freedom of its nodes. In this one, axis and sections have degree five along the beam. The
default formulation finds by counting where to sample the strain so that it does not lock.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        Scene, StVenantKirchhoff)
from skfem_ancf.elements import ElementBeam
from skfem_ancf.elements.base import SectionFunctions

# %%
# The section has one polynomial with derivative 1, so the position is :math:`r + Y r_Y`. The
# degrees of freedom besides r and r_X are given by a name, the point of the section, and the
# numbers of derivatives along and across. The last list has those that a clamp fixes.


class Quintic(ElementBeam):
    """r and r_Y with their first two derivatives along X at the nodes."""

    def __init__(self):
        super().__init__(SectionFunctions([[1.0]]), ["r_XX", "r_Y", "r_XY", "r_XXY"],
                         [(0.0, 2, 0), (0.0, 0, 1), (0.0, 1, 1), (0.0, 2, 1)], ["r_Y"])


own = Quintic()
print(own)

# %%
# A slender cantilever under its own weight, L/h = 10 000, whose tip moves by 0.9 of the length.
# Poisson's ratio is zero, because sections of order 1 have no Poisson strain.

length, height, weight, EI = 1.0, 1e-4, 1.0, 0.02179
soft = StVenantKirchhoff(E=12 * EI / height**4, nu=0.0, density=weight / (9.81 * height**2))


def tip(element, elements):
    mesh = MeshBeam.init_line(np.linspace(0, length, elements + 1), height)
    beam = Beam(mesh, element, soft, height)
    state = Scene(beam).clamp("left").gravity((0, -9.81)).solve_static()
    return state.displacement((length, 0)), beam.N


reference = tip(ElementBeamCable(7), 32)[0]
meshes = (8, 16, 32)
fig, ax = plt.subplots(figsize=(6.4, 4.6), layout="constrained")
rates = {}
for name, element in (("linear sections, order 1", ElementBeamANCF(1)),
                      ("cubic sections, order 1", ElementBeamANCFCubic(1)),
                      ("quintic, own", own)):
    tips, sizes = zip(*(tip(element, n) for n in meshes))
    errors = np.hypot(*(np.array(tips) - reference).T) / length
    rates[name] = np.log2(errors[0] / errors[1])
    print(f"{name:26}", "  ".join(f"{e:.1e}" for e in errors), f"  order {rates[name]:.1f}")
    ax.loglog(sizes, errors, "o-", label=name)
assert rates["quintic, own"] > 4.5 and errors[-1] < 1e-7
ax.set(xlabel="coordinates", ylabel="error of the tip / length",
       title="cantilever under its own weight, L/h = 10 000",
       xticks=(50, 100, 200, 400), xticklabels=(50, 100, 200, 400))
ax.xaxis.set_minor_formatter("")
ax.grid(alpha=0.3)
ax.legend(frameon=False)
plt.show()
