"""Functions of time, formulas, characteristics, rotations."""
