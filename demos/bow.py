r"""A bow is strung and drawn
=========================

The draw force, the stored energy and the stress of a bow that is bent, strung and drawn, compared
with the elastica.

The limb is of wood between glass. The archer bends it, puts the string on, and draws. Each of the
three phases starts from the equilibrium of the one before.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import solve_bvp, trapezoid

from skfem_ancf import (Beam, ElementBeamANCFCubic, MeshBeam, Scene, Section, Steps,
                        StVenantKirchhoff)

# %%
# One half: the limb on the grip, and the string, a bar that does not stretch.

length, string, pull, inch = 0.8, 0.77, 200.0, 0.0254                       # m, N
wood, glass = StVenantKirchhoff(E=1.2e10, nu=0.3), StVenantKirchhoff(E=4e10, nu=0.25)
bar = MeshBeam.init_line([0, string], 2e-3, origin=(0.16, 0), angle=np.pi / 2)
cord = Beam(bar, ElementBeamANCFCubic(1), StVenantKirchhoff(1e13, 0.0), 2e-3, name="cord")
tip, end = (0.0, length), (0.16, string)
steps = Steps(bend=1.0, draw=1.0)


def draw(height, **section):
    """The run of a bow that is drawn; its first instant is the bow at rest, strung."""
    mesh = MeshBeam.init_line(np.linspace(0, length, 13), height, angle=np.pi / 2)
    limb = Beam(mesh, ElementBeamANCFCubic(2), name="limb", **section)
    bending = Scene(limb, cord).clamp("left", "limb", thickness="free").clamp("left", "cord")
    bending.joint("position", at=tip, beam="limb", r=steps.ramp(tip, bend=end))
    bent = bending.run(1.0, increments=8)

    strung = Scene(limb, cord).clamp("left", "limb", thickness="free")
    strung.fix("left", "r^2", beam="cord").hinge(("limb", tip), ("cord", end))
    strung.point_force((pull / 2, 0), at="left", beam="cord", amplitude=steps.ramp(draw=1.0))
    strung.sensor("nock", "position", at=(0.16, 0), beam="cord")
    strung.sensor("force", lambda state: pull * (state.t - 1.0))
    return strung.run(steps, increments=16, start=bent.state(-1))


# %%
# **The check**: of a limb of one height, bent as an elastica, the string is at an angle
# :math:`\beta` and pulls by T: :math:`EI \theta'' = -T \sin(\theta + \beta)`, solved by SciPy.


def elastica(nock):
    """The draw force over EI / length^2 where the nock is there."""
    s, ratio = np.linspace(0, 1, 41), string / length
    guess = np.array([0.4 * np.sin(np.pi * s / 2), 0.6 * np.cos(np.pi * s / 2), s**2 / 4, s])
    T, beta = solve_bvp(
        lambda s, y, p: [y[1], -p[0] * np.sin(y[0] + p[1]), np.sin(y[0]), np.cos(y[0])],
        lambda a, b, p: np.array([a[0], a[2], a[3], b[1], b[2] + ratio * np.sin(p[1]) - nock,
                                  b[3] - ratio * np.cos(p[1])]),
        s, guess, [2.6, 0.2], tol=1e-6).p
    return 2 * T * np.sin(beta)


even = draw(12e-3, material=wood, width=0.06)
nock, force = even.sensors["nock"][:, 0], even.sensors["force"]
expected = wood.E * 0.06 * 12e-3**3 / 12 / length**2 * np.array([
    elastica(x) for x in nock / length])
print(f"a limb of wood: the draw curve within {max(abs(force - expected)) / pull:.1e} of the pull")
assert np.allclose(force, expected, atol=1e-3 * pull)

# %%
# The laminated limb has glass of 1 mm on both faces, and is thinner and narrower towards its tip.

history = draw(lambda s: 11e-3 - 4e-3 * s / length, section=Section.layers(
    (1e-3, glass), (None, wood), (1e-3, glass), width=lambda x, y: 0.045 - 0.025 * x / length))
nock, force = history.sensors["nock"][:, 0], history.sensors["force"]
stored = 2 * np.ptp(history.strain_energy)
print(f"brace height {100 * nock[0]:.1f} cm; {pull:g} N at {nock[-1] / inch:.1f} in, and "
      f"{stored:.1f} J, {stored / pull / np.ptp(nock):.2f} of the pull times the way")
assert np.isclose(stored, trapezoid(force, nock), rtol=5e-3)

# %%
# The draw curve, and the stress on the back of the limb, the face away from the archer.

fig, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 4.4), layout="constrained")
history.plot(lambda v: 1e-6 * v["S_xx"], times=[1.0, 1.5, 2.0], ax=left, unit="MPa",
             title="stress along the limb", undeformed=True)
left.set(xlabel="x (m)", ylabel="y (m)")
history.plot_curve(("nock", 0), "force", ax=middle, label="laminated")
even.plot_curve(("nock", 0), "force", ax=middle, label="wood")
middle.plot(even.sensors["nock"][:, 0], expected, lw=5, alpha=0.3, label="elastica")
middle.set(xlabel="place of the nock (m)", ylabel="draw force (N)")
middle.legend(frameon=False)
s = np.linspace(0.0, length, 101)[1:-1]
for k, name in ((0, "strung"), (-1, "drawn")):
    back = history.state(k).stress(np.array([-0.4999 * (11e-3 - 4e-3 * s / length), s]), "limb")
    right.plot(s, 1e-6 * back[0], label=name)
right.set(xlabel="along the limb (m)", ylabel="$S_{xx}$ on the back (MPa)")
right.legend(frameon=False)
plt.show()
