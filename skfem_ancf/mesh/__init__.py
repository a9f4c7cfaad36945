"""Meshes of planar beams."""

from .mesh_beam import MeshBeam, reach

__all__ = [
    "MeshBeam",
    "reach",
]
