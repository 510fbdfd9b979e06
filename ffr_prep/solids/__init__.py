"""Solids: stiffness, consistent mass, interfaces, stress, geometric stiffness."""
