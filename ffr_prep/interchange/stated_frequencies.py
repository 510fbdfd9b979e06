"""The frequencies that a file states beside its matrices, against those of the matrices."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.interchange.common_format import normal_coordinates, real

_STATED = re.compile(r":\s*([-+.0-9DdEe]+)\s*hz", re.IGNORECASE)
_DIFFERENT = 1e-3
_DIGITS = 6e-4  # Hz; three digits after the point are the custom


def other_frequencies(values: Mapping[str, tuple[str, int]], M: Array, K: Array) -> list[str]:
    """A warning where frequencies stated in the lines `ielastq(k) = Eigen Mode k : f Hz` are none of mass M and stiffness
    K (n, n)."""
    texts = [
        match[1] for key, (text, _) in values.items() if key.startswith("ielastq") and (match := _STATED.search(text))
    ]
    stated = np.sort([real(text, "a frequency of ielastq") for text in texts])
    omega2 = normal_coordinates(M, K)[1]
    if not (stated.size and omega2.size):
        return []
    computed = np.sort(np.sqrt(omega2) / (2 * np.pi))
    # As many as there are modes stand for one each; of fewer, each for the nearest.
    paired = computed if stated.size == computed.size else computed[np.abs(stated[:, None] - computed).argmin(axis=1)]
    off = np.abs(stated - paired) - _DIGITS
    different = off > _DIFFERENT * paired
    if not different.any():
        return []
    k = int(different.argmax())
    return [
        f"the file states {stated[k]:.6g} Hz, but its Ke and Me have {paired[k]:.6g} Hz: Ke was taken; is it scaled, or of "
        "another model?"
    ]
