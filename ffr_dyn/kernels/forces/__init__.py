"""Applied forces, compiled."""
