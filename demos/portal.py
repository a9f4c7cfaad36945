r"""A portal with a crane girder: which profile?
============================================

Load cases are combined with factors, and the lightest columns and girder whose strength and sway
suffice are found.

Columns are H sections, the girder is an I section, both by their standard names. A crane stands at
a quarter of the span. The page of the chosen portal is written by ``report``.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Frame, LoadCases, Section, StVenantKirchhoff

# %%
# Units are newtons and metres. Columns have hinged feet.

height, span, steel = 5.0, 12.0, StVenantKirchhoff.named("S355")


def portal(column, girder):
    frame = Frame.from_lines(
        [(0, 0), (0, height), (span, height), (span, 0)], [(0, 1), (1, 2), (2, 3)], material=steel,
        groups={"columns": [0, 2], "girder": [1]},
        sections={"columns": {"section": Section.profile(column)},
                  "girder": {"section": Section.profile(girder)}})
    return frame.units("N", "m").pin([0, 3])


# %%
# Four load cases. The weight follows from the profiles; a function adds the loads of each case.

cases = {
    "weight": lambda frame: frame.gravity((0, -9.81)),
    "roof": lambda frame: frame.line_load((0, -6e3), beam="girder"),
    "crane": lambda frame: frame.point_force((0, -40e3), at=(span / 4, height)),
    "wind": lambda frame: frame.line_load((1.8e3, 0), beam="columns")}
combinations = {
    "crane leads": {"weight": 1.35, "roof": 1.35, "crane": 1.5, "wind": 0.9},
    "wind leads": {"weight": 1.35, "roof": 1.35, "crane": 1.05, "wind": 1.5},
    "uplift": {"weight": 1.0, "wind": 1.5},
    "service": {"weight": 1.0, "roof": 1.0, "crane": 1.0, "wind": 0.6}}


def checked(column, girder):
    """Load cases, largest utilisation, sway and mass: equilibria for large displacements."""
    found = LoadCases(portal(column, girder), cases, combinations, linear=False)
    most = max(found[name].extremes(count=1)[0].value for name in found if name != "service")
    sway = abs(found["service"].displacement((0, height), line=0)[0])
    return found, most, sway, sum(beam.total_mass for beam in found.scene.beams)


# %%
# Of a few pairs the lightest one is taken with a utilisation below one, and a sway below
# :math:`h / 150`.

suits = {}
for column, girder in (("HEA 180", "IPE 330"), ("HEA 200", "IPE 360"), ("HEA 220", "IPE 400"),
                       ("HEB 220", "IPE 400"), ("HEA 260", "IPE 360"), ("HEB 260", "IPE 450")):
    found, most, sway, mass = checked(column, girder)
    good = bool(most < 1.0 and sway < height / 150)
    print(f"{column}, {girder}: utilisation {most:.2f}, sway h / {height / sway:.0f}, "
          f"{mass:.0f} kg{', suits' if good else ''}")
    if good:
        suits[mass] = column, girder
best = suits[min(suits)]
chosen = checked(*best)[0]
print("chosen:", *best)
print(chosen)

# %%
# **Check**: of a portal with hinged feet under a uniform load, the moment at the corners is
# :math:`q L^2 / (4 (2 k + 3))`, with k = :math:`I_g h / (I_c L)`.

alone = LoadCases(portal(*best), {"roof": cases["roof"]})["roof"]
EI = {b.name: b.across.bending[0] for b in alone.beams}
k = EI["girder"] * height / (EI["columns"] * span)
corner = alone.resultants(line=1).M[0]
print(f"corner: {corner:.0f} N m, formula {-6e3 * span**2 / (4 * (2 * k + 3)):.0f} N m")
assert np.isclose(corner, -6e3 * span**2 / (4 * (2 * k + 3)), rtol=2e-3)

# %%
# Moments of the combination that governs, and the envelope of the girder. The page has all the
# rest.

worst = max(combinations, key=lambda name: chosen[name].extremes(count=1)[0].value)
chosen[worst].report("out/portal.html", title=f"Portal of {best[0]} and {best[1]}: {worst}")

fig, axes = plt.subplots(2, 2, figsize=(9, 6.6), layout="constrained")
*three, ax = axes.ravel()
chosen[worst].plot_resultants(axes=three)
envelope = chosen.envelope("girder")
ax.fill_between(envelope.x[0], 1e-3 * envelope.least["M"], 1e-3 * envelope.greatest["M"], alpha=0.3)
ax.set(xlabel="x (m)", ylabel="M of the girder (kN m)", title="envelope of all combinations")
ax.invert_yaxis()
plt.show()
assert 0 < len(suits) < 6
