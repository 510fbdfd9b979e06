"""From a coupled model to a few elastic coordinates, and how good they are."""
