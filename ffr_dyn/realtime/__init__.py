"""Steps under the control of another program, and against a deadline."""
