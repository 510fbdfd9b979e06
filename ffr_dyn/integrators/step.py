"""The step of methods that do not choose it.

Twin: none, data.
"""

from __future__ import annotations

import math
from numbers import Real

from ffr_prep.common.errors import InputError


def check_step(method: object, step: object) -> None:
    """Raises InputError unless the step is a positive, finite number [s]."""
    if not isinstance(step, Real) or not 0.0 < float(step) < math.inf:
        name = type(method).__name__
        raise InputError(f"{name} needs a positive step in seconds, such as {name}(1e-3); it is {step!r}")
