"""From a scene to the tables of the kernels, and the engine that evaluates them."""
