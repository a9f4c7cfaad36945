"""Strain, stress and section forces recovered from a solution."""

from .recovered import Recovery, actions, distributed, recover, strain_of_stress

__all__ = [
    "Recovery",
    "actions",
    "distributed",
    "recover",
    "strain_of_stress",
]
