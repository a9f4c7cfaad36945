"""Strain, stress and section forces recovered from a solution."""
