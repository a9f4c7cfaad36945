r"""A clip: will it break?
======================

A snap hook of POM is pushed over an edge, and its utilisation tells whether it breaks and how thin
it must be.

The hook is a cantilever with a sloping nose. Inserted, its tip bends by the height of the nose. The
stress depends on the thickness, which a table of designs shows.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import (Beam, Circle, ElementBeamCable, MeshBeam, Scene, StVenantKirchhoff, Steps)

# %%
# Units are newtons and millimetres. The values of POM are typical, and say so.

length, width, undercut, edge = 18.0, 6.0, 2.4, 1.0
pom = StVenantKirchhoff.named("POM", ("N", "mm"))
print(pom.title, f"E = {pom.E:.0f} MPa, yield stress {pom.strength:.0f} MPa")


def inserted(thickness):
    """A run in which a round edge slides along the hook and lifts its tip by the undercut."""
    mesh = MeshBeam.init_line(np.linspace(0, length, 25), thickness)
    scene = Scene(Beam(mesh, ElementBeamCable(5), pom, width)).units("N", "mm").clamp("left")
    steps = Steps(insert=1.0)
    lift = steps.ramp(insert=undercut)
    tip = Circle((length - 2.0, -0.5 * thickness - edge), edge)
    scene.obstacle(tip, position=lambda t: (0.0, lift(t)))
    return scene.run(steps, 8)


# %%
# **Check**: a cantilever bent by w at a distance a from its root has the stress
# :math:`3 E h w / (2 a^2)` at the root, for small rotations.

at = length - 2.0
for thickness in (2.0, 1.5, 1.2):
    state = inserted(thickness).state(-1)
    worst = state.extremes(count=1)[0]
    formula = 1.5 * pom.E * thickness * undercut / at**2 / pom.strength
    force = state.contact().total[1]
    print(f"{thickness} mm: utilisation {worst.value:.2f} at x = {worst.point[0]:.1f}, formula "
          f"{formula:.2f}, force {force:.1f} N{', yields' if worst.value > 1 else ''}")
    assert np.isclose(worst.value, formula, rtol=0.06)
    assert worst.point[0] < 0.5

# %%
# The thickest hook that does not yield, from the stress being proportional to the thickness. What
# ``print`` says of the first design is its finding.

thick, thin = inserted(2.0), inserted(1.2)
print(thick.state(-1).checks)
assert "times the strength" in thick.state(-1).checks.findings[-1]
assert thin.state(-1).checks.findings == ()
thin.report("out/clip.html", title="Snap hook of POM, 1.2 mm")

# %%
# Utilisation of both designs, and the force on the edge as it is inserted.

fig, axes = plt.subplots(3, 1, figsize=(6.4, 7), layout="constrained")
for ax, run, name in zip(axes, (thick, thin), ("2.0 mm", "1.2 mm")):
    run.state(-1).plot("utilisation", ax=ax, title=f"{name}: utilisation", limits=(0.0, 1.5))
for run, name in ((thick, "2.0 mm"), (thin, "1.2 mm")):
    lift = undercut * run.t
    axes[2].plot(lift, [one.contact().total[1] for one in run], label=name)
axes[2].set(xlabel="lift (mm)", ylabel="force on the edge (N)")
axes[2].legend()
plt.show()
