"""Geometric stiffening by load, compiled.

Twin: `ffr_dyn.equations.stiffening.geometric_stiffening`.
"""
