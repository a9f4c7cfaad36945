"""Errors, argument checks, quadrature, band matrices, compilation, progress bars."""
