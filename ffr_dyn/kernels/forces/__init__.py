"""Applied forces, compiled.

Twin: `ffr_dyn.equations.forces.applied`.
"""
