"""Positions and velocities that meet the constraints, and which constraint rows follow from the others."""
