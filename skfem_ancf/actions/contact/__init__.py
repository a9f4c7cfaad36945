"""Contact of the surface of beams with obstacles: gap, laws, active set, equations."""
