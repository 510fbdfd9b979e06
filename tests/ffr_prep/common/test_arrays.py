"""Integers each once, and which are among others: beside NumPy's own."""

from __future__ import annotations

import numpy as np
import pytest

from ffr_prep.common.arrays import among, distinct


@pytest.mark.parametrize("size", [0, 1, 200])
def test_distinct_and_among_are_those_of_numpy(size):
    random = np.random.default_rng(size)
    one, other = random.integers(-20, 20, (size, 2)), random.integers(-40, 40, size)
    np.testing.assert_array_equal(distinct(one), np.unique(one))
    np.testing.assert_array_equal(among(one, distinct(other)), np.isin(one, other))
