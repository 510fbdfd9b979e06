"""A finite-element model of any kind, as far as a reduction needs it."""
