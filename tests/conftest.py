"""One BLAS thread: as `reduce_mesh` has it, so that what a test computes beside it is equal bit by bit."""

from threadpoolctl import threadpool_limits

threadpool_limits(1)
