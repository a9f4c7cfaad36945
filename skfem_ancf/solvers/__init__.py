"""Static solvers: one file each."""

from .continuation import continuation
from .newton import LoadStep, StaticResult, solve_static

__all__ = ["LoadStep", "StaticResult", "continuation", "solve_static"]
