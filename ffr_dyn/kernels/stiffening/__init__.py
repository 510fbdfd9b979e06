"""Geometric stiffening by load, compiled."""
