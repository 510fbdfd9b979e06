"""Models of which only stiffness and mass matrices of another program are known."""
