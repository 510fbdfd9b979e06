"""A gallery of instability: each exhibit shows a method failing where theory says it does, and a remedy holding.

`exhibits` lists them; `ffr-dyn stability` computes them.
"""
