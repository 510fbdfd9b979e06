"""Meshes of solids: read, made by gmsh, checked, seen from outside."""
