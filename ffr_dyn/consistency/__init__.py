"""States that meet the joints, what can move at them, and small deviations from them."""
