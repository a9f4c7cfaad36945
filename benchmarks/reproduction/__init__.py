"""The six examples of "A series of locking-free beam element models in absolute nodal
coordinate formulation" (Archive of Applied Mechanics, 2024), with all its models."""
