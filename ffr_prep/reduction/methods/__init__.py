"""The reductions, a file for each; `ffr_prep.reduction.registry` lists them."""
