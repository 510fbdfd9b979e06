"""Labelled histories: quantities, files, stress, power."""
