"""One BLAS thread: as `reduce_mesh` has it, so that what a test computes beside it is equal bit by bit."""

import scipy.linalg  # noqa: F401 - a library must be loaded before it can be limited
from threadpoolctl import threadpool_limits

threadpool_limits(1)
