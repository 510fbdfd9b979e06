"""Scenes as text files."""
