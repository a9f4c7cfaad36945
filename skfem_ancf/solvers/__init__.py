"""Static solvers."""

from .continuation import continuation
from .newton import solve_static
from .iteration import LoadStep, StaticResult

__all__ = ["LoadStep", "StaticResult", "continuation", "solve_static"]
