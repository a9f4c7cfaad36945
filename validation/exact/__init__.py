"""Reference solutions: what a beam must give, computed without finite elements.

Every function evaluates a closed form, finds the root of a characteristic equation, or solves
the ordinary differential equations of a rod by shooting; no result is stored. Displacements are
``(u_x, u_y)`` of a beam that starts along +x, a load downwards is a positive number and gives a
negative ``u_y``. Units are free but consistent (m, N, Pa, kg, s throughout the docstrings).
"""

from .buckling import euler_buckling_load, greenhill_load
from .frames import (
                     clamped_hinged_arch,
                     clamped_hinged_arch_limit,
                     lee_frame,
                     lee_frame_limits,
                     williams_toggle,
)
from .pendulums import double_pendulum, rigid_pendulum, rigid_pendulum_period
from .reissner import Reissner
from .rods import (
                     elastica_extensible_tip,
                     elastica_tip_load,
                     gravity_cantilever,
                     rollup_curvature,
                     rollup_end_angle,
                     rollup_tip,
)
from .sections import euler_bernoulli_tip, inertia, root_transverse_strain, shear_factor
from .vibration import euler_bernoulli_frequencies, timoshenko_frequencies

__all__ = ["Reissner", "clamped_hinged_arch", "clamped_hinged_arch_limit", "double_pendulum",
           "elastica_extensible_tip", "elastica_tip_load", "euler_bernoulli_frequencies",
           "euler_bernoulli_tip", "euler_buckling_load", "gravity_cantilever", "greenhill_load",
           "inertia", "lee_frame", "lee_frame_limits", "rigid_pendulum", "rigid_pendulum_period",
           "rollup_curvature", "rollup_end_angle", "rollup_tip", "root_transverse_strain",
           "shear_factor", "timoshenko_frequencies", "williams_toggle"]
