r"""Your own element
================

The elements of this package are polynomials along the beam and across its section, and a new one is
a list of what its nodes know. Here is one with second derivatives at its nodes, so that axis and
sections are of degree five along the beam: a class of four lines. Where its strain has to be
sampled so that it does not lock, the default formulation finds by counting.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import (Beam, ElementBeamANCF, ElementBeamANCFCubic, ElementBeamCable, MeshBeam,
                        Scene, StVenantKirchhoff)
from skfem_ancf.elements import ElementBeam
from skfem_ancf.elements.base import SectionFunctions

# %%
# The section is 1 and one polynomial whose derivative is 1: :math:`r + Y r_Y`. The coordinates
# beside r and r_X are named, and each is said by its place across the section and its derivatives
# along and across; the last list has what a weld holds.


class Quintic(ElementBeam):
    """r and r_Y with their first two derivatives along X at the nodes."""

    def __init__(self):
        super().__init__(SectionFunctions([[1.0]]), ["r_XX", "r_Y", "r_XY", "r_XXY"],
                         [(0.0, 2, 0), (0.0, 0, 1), (0.0, 1, 1), (0.0, 2, 1)], ["r_Y"])


own = Quintic()
print(own)

# %%
# A slender cantilever under its own weight, whose tip hangs at 0.9 of its length; L/h = 10 000. Its
# Poisson ratio is zero, for sections of order 1 know no other.

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
