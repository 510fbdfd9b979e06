"""Shared by both packages: errors, units, progress."""
