"""The types of arrays: those that are, and what NumPy makes one of."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike as ArrayLike

Array = np.ndarray


def distinct(numbers: Array) -> Array:
    """The integers of an array of any shape, ascending, each once: by sorting, which takes half of the time of hashing."""
    ascending = np.sort(numbers, axis=None)
    return ascending[np.append(np.ones(min(ascending.size, 1), bool), np.diff(ascending) != 0)]


def among(numbers: Array, ascending: Array) -> Array:
    """Which of the integers are among ascending ones."""
    if not ascending.size:
        return np.zeros(numbers.shape, bool)
    at = np.searchsorted(ascending, numbers).clip(max=ascending.size - 1)
    return np.asarray(ascending[at] == numbers)
