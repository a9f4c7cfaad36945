"""The order of the gallery: first beams, statics, stability, motion, machines, what is added."""

from pathlib import Path

ORDER = [
    "first_beam", "rollup", "plain_scikit_fem", "cantilever", "choose_element",
    "poisson_locking", "thick_beam",
    "tapered_blade", "catenary", "spring", "leaf_spring", "leaves_with_friction", "soft_gripper",
    "measured_clip", "rubber_block",
    "bimetal", "springback", "wire_forming", "polymer_clip", "thermostat", "snap_fit",
    "clip_strength", "bow", "soft_finger", "compliant_gripper", "live_view",
    "frame", "portal",
    "cylinder", "pipe_laying", "capstan", "wiper_blade", "ring",
    "column", "beam_on_bedding", "magnetic_rod", "shallow_arch", "bistable_switch",
    "pendulum", "spaghetti", "driven_arm", "four_bar", "moving_load", "bridge_train",
    "hanging_bridge", "tuning_fork", "damping", "balanced_rod", "environment",
    "own_law", "own_element", "fit_modulus", "uniform_stress", "designed_gripper", "uncertainty",
]


class Order:
    """What sphinx-gallery sorts the files of a folder by; those without a place come last."""

    def __init__(self, folder):
        self.folder = folder

    def __call__(self, filename):
        name = Path(filename).stem
        return ORDER.index(name) if name in ORDER else len(ORDER)
