"""The types of arrays: those that are, and what NumPy makes one of."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike as ArrayLike

Array = np.ndarray
