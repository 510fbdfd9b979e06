"""Analyses: each a function of a scene."""
