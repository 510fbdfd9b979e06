"""Steady and periodic motions and what is linear about them: spin fields, matrices, modes, transfer functions."""
