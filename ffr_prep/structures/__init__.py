"""Beams, plates and flat shells with six coordinates a node."""
