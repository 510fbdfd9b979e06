"""From a mesh to a reduced flexible body in the floating frame of reference."""
