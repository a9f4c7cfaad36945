"""Meshes of planar beams."""

from .mesh_beam import MeshBeam

__all__ = ["MeshBeam"]
