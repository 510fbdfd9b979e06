"""Descriptions of a body: in words, numbers and pictures."""
