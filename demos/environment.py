r"""An environment for learning
===========================

A soft arm turns to a target without swinging, as an environment with reset and step for learning.

The class has the shape of an environment of Gymnasium, and does not need that package: ``reset``
returns an observation, ``step`` an observation, a reward, whether the episode is over or truncated,
and further data. Here a simplex search learns the three gains of a policy. An algorithm of a
library would take the same class.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import minimize

from skfem_ancf import (Beam, ElementBeamCable, KelvinVoigt, MeshBeam, Motor, Scene,
                        StVenantKirchhoff)

mesh = MeshBeam.init_line(np.linspace(0, 0.5, 3), height=4e-3)
arm = Beam(mesh, ElementBeamCable(5), StVenantKirchhoff(5e8, 0.4, 1200), width=0.02,
           damping=KelvinVoigt(2e-3))


class Reach:
    """Turn the arm by a torque until its tip is at the target, an angle."""

    dt, steps = 0.03, 30

    def __init__(self, target=0.8):
        scene = Scene(arm).pin("left").sensor("tip", "position", (0.5, 0))
        scene.sensor("tip speed", "velocity", (0.5, 0)).sensor("hub", "position", (0.02, 0))
        self.stepper = scene.stepper(self.dt, [Motor((0, "left"), torque=0.05)])
        self.target = target

    def reset(self, seed=None):
        self.stepper.reset()
        return self.observation(), {}

    def observation(self):
        """Angles of tip and hub that are left, and the angular velocity of the tip."""
        now = self.stepper.readings
        (x, y), (u, v) = now["tip"], now["tip speed"]
        hub = np.arctan2(*now["hub"][::-1])
        return np.array([self.target - np.arctan2(y, x), self.target - hub,
                         (x * v - y * u) / (x * x + y * y)])

    def step(self, action):
        self.stepper.step(np.clip(action, -1.0, 1.0))
        seen = self.observation()
        reward = -self.dt * (abs(seen[0]) + 0.02 * abs(seen[2]))
        return seen, reward, False, self.stepper.t > self.dt * (self.steps - 0.5), {}


def episode(gains, environment):
    """The reward of a linear policy, and the angle of the tip that is left at each step."""
    (seen, _), total, left, over = environment.reset(), 0.0, [], False
    while not over:
        seen, reward, _, over, _ = environment.step([seen @ gains])
        total += reward
        left.append(seen[0])
    return total, np.array(left)


# %%
# **Learn** from a first guess, in 24 episodes.

environment, first = Reach(), np.array([1.0, 1.0, 0.0])
simplex = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, -0.8]])
learned = minimize(lambda gains: -episode(gains, environment)[0], first, method="Nelder-Mead",
                   options={"maxfev": 24, "initial_simplex": first + simplex}).x
before, after = (episode(gains, environment) for gains in (first, learned))
print(f"reward {before[0]:.4f} with the first guess, {after[0]:.4f} learned: gains {learned}")
assert after[0] > 0.75 * before[0] and abs(after[1][-1]) < 0.3

# %%
# **What it has learned**: the tip comes to the target, also to one that it was not trained for.

other = Reach(target=-0.5)
fig, ax = plt.subplots(figsize=(6.4, 3.4), layout="constrained")
t = Reach.dt * np.arange(1, Reach.steps + 1)
ax.plot(t, before[1], ":", label="first guess")
ax.plot(t, after[1], label="learned")
ax.plot(t, episode(learned, other)[1], "--", label="another target")
ax.axhline(0.0, color="0.6", lw=0.6)
ax.set(xlabel="t (s)", ylabel="angle that is left (rad)")
ax.legend(frameon=False)
plt.show()
