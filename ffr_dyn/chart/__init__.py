"""Work-precision diagrams: what a scene costs with which method, step and model, and how right the result is.

variants   the variants of a scene: methods x steps or tolerances x models
measures   what is compared: positions, deflections, reactions, stresses, energy, constraints
runner     running variants, in this process or as Dask tasks, with honest times
reference  the converged run that errors are measured from, with an estimate of its own
pareto     the variants that no other beats
diagram    all of it put together: `work_precision`
draw, page, table   PNG and SVG, an interactive page, CSV
"""
