r"""A suspension footbridge in gusts
================================

Gusts excite a suspension bridge at its lowest frequency, which is compared with the formula for a
cable with a stiff deck.

A footbridge hangs from two cables. Gusts act on one half of it. At the lowest frequency of the
bridge even a weak wind makes the deck heave, since the vibration grows with each gust.
"""

import matplotlib.pyplot as plt
import numpy as np

from skfem_ancf import Frame, StVenantKirchhoff

# %%
# The span is 60 m in ten panels. The cables sag by 6 m and hang from towers of 7 m. Cables and
# hangers are of steel, the deck is of timber, 2 m wide and 150 mm thick. The hangers are hinged.

span, sag, panels, g = 60.0, 6.0, 10, 9.81
steel = StVenantKirchhoff(E=2.1e11, nu=0.3, density=7850)
timber = StVenantKirchhoff(E=1e10, nu=0.3, density=500)
x = np.linspace(0, span, panels + 1)
cable = np.column_stack([x, 1 + 4 * sag * (x / span - 0.5)**2])
deck = np.column_stack([x, 0 * x])
k, m, n = np.arange(panels), panels, panels + 1
lines = np.vstack([np.column_stack([k, k + 1]), np.column_stack([n + k, n + k + 1]),
                   np.column_stack([k[1:], n + k[1:]])])
hinges = [(2 * m + i - 1, node) for i in k[1:] for node in (i, n + i)]


def bridge(wind=None):
    planks = {"height": 0.15, "width": 2.0, "material": timber}
    frame = Frame.from_lines(
        np.vstack([cable, deck]), lines, hinges=hinges, material=steel, height=0.02, width=0.02,
        groups={"cables": k, "windward": m + k[:m // 2], "lee": m + k[m // 2:],
                "hangers": np.arange(2 * m, 3 * m - 1)},
        sections={"cables": {"height": 0.06, "width": 0.12},
                  "windward": planks, "lee": planks},
        nodes={"towers": [0, m], "abutments": [n, n + m]})
    frame.pin("towers").pin(n).hold(n + m, "y").gravity((0, -g))
    if wind is not None:
        frame.line_load((0, 40.0), beam="windward", amplitude=wind)
    return frame


# %%
# **At rest** the cables pull at their towers like a parabola under the weight, :math:`w L^2 / 8 f`.

rest = bridge().solve_static()
mass = 0.06 * 0.12 * steel.density + 0.15 * 2.0 * timber.density
pull, H = -rest.reactions(0).force[0], mass * g * span**2 / (8 * sag)
print(f"pull of the cables {1e-3 * pull:.1f} kN, parabola {1e-3 * H:.1f} kN")
assert np.isclose(pull, H, rtol=0.03)

# %%
# **The lowest mode** moves one half up and the other down. The cables do not stretch, so its
# frequency is that of a string and a beam with one full wave [1]_.

slowest = bridge().modes(1, rest).frequencies[0]
EI, wave = timber.E * 2.0 * 0.15**3 / 12, 2 * np.pi / span
string = np.sqrt((H * wave**2 + EI * wave**4) / mass)
print(f"swing {slowest:.3f} rad/s, string and beam {string:.3f} rad/s")
assert np.isclose(slowest, string, rtol=0.05)

# %%
# **The wind** lifts one half by 40 N/m in gusts, a fiftieth of the weight, at the lowest frequency
# and at half of it.

quarter, runs = (0.25 * span, 0.0), {}
for name, pace in ("the pace of the swing", slowest), ("half that pace", 0.5 * slowest):
    scene = bridge(wind=lambda t, pace=pace: np.sin(pace * t))
    runs[name] = scene.integrate(9.0, 0.09, "energy-momentum", start=rest)
heave = {name: run.position(quarter, "windward")[:, 1] for name, run in runs.items()}
largest = {name: np.max(abs(y - y[0])) for name, y in heave.items()}
print({name: f"{100 * y:.1f} cm" for name, y in largest.items()})
fast, slow = largest.values()
assert fast > 4 * slow  # and it would go on growing

fig, (upper, lower) = plt.subplots(2, figsize=(7.4, 4.8), layout="constrained",
                                   height_ratios=[3, 2])
run = runs["the pace of the swing"]
worst = int(np.argmin(heave["the pace of the swing"]))
run.state(worst).plot("S_xx", ax=upper, thickness=3, scale=10, unit="Pa",
                      title="stress along cables and deck in the largest swing")
upper.set(xlabel="x (m)", ylabel="y (m)")
for name, y in heave.items():
    lower.plot(runs[name].t, 100 * (y - y[0]), label=f"gusts at {name}")
lower.set(xlabel="time (s)", ylabel="heave at a quarter (cm)")
lower.legend(frameon=False, loc="upper left")
plt.show()

# %%
# .. [1] H. M. Irvine, Cable Structures, MIT Press (1981), chapter 3.
