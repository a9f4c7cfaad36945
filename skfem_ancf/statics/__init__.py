"""Static solvers: one file each."""

from .newton import LoadStep, StaticResult, solve_static

__all__ = ["LoadStep", "StaticResult", "solve_static"]
