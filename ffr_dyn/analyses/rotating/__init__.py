"""Analyses of machines that rotate and vibrate."""
