"""The faces of parts: what they are, and how they are found by what they are."""
