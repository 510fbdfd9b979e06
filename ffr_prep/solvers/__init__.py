"""Sparse factorisations and modes of large finite-element matrices."""
