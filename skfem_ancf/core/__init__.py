"""Foundations: errors, checks of arguments, quadrature, band matrices, progress."""
