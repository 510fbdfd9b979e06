"""Cheaper forms of a scene: fewer modes and terms, rigid bodies, the plane."""
