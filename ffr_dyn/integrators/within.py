"""An accuracy in place of a step.

Twin: none, data.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ffr_prep.common.errors import InputError


@dataclass(frozen=True)
class Within:
    """The step is found with which positions and angles err by no more than the accuracy, relative to their ranges, and
    forces and deflections too unless they ring (`ffr_dyn.analyses.forward`).

    accuracy : from 1e-8 to 1;  method : of fixed steps, by its name
    settings : (name, value) of what the method takes beside its step

    Raises InputError for an accuracy outside [1e-8, 1].

    >>> result = fd.forward(scene, end=1.0, output_step=0.01, method=fd.Within(1e-5, "ros3"))
    """

    accuracy: float = 1e-3
    method: str = "ros2"
    settings: tuple[tuple[str, Any], ...] = ()

    def __post_init__(self) -> None:
        if not 1e-8 <= self.accuracy <= 1:
            raise InputError(f"the accuracy is {self.accuracy:g}; give one from 1e-8 to 1, such as 1e-3 of the range")
