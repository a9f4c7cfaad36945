"""The discrete equations of a scene and their linear solvers."""
