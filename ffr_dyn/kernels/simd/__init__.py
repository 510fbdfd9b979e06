"""Code written for vector registers through private modules of numba."""
