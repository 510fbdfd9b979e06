"""Forward runs with what the length of their steps costs every output: the runs, their errors, notes, the search of it."""
