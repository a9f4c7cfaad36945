"""Recovery of strain, stress and section forces from a solution."""
