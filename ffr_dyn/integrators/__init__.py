"""Time integration: one file per method, one protocol.

A method is a frozen dataclass with its settings and class attributes: `order`, `implicit` (whether it treats the elastic
forces implicitly), `stage_count` (rows of scratch it needs) and `run`, its compiled loop

    run(model, work, stages, t0, h, first, substeps, x, v, alpha, beta, tolerance, out) -> (rows filled, status).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, Protocol

from ffr_dyn.integrators.rk4 import RK4
from ffr_dyn.integrators.ros2 import ROS2
from ffr_dyn.integrators.ros3 import ROS3

__all__ = ["METHODS", "RK4", "ROS2", "ROS3", "Integrator"]


class Integrator(Protocol):
    """What `forward` needs of a method."""

    @property
    def step(self) -> float:
        """Time step [s]."""

    order: ClassVar[int]
    implicit: ClassVar[bool]
    stage_count: ClassVar[int]
    run: ClassVar[Any]


METHODS: dict[str, Callable[[float], Integrator]] = {"rk4": RK4, "ros2": ROS2, "ros3": ROS3}
