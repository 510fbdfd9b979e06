"""Time integration: one file per method, one protocol.

A method is a frozen dataclass with its settings; its compiled unit does one step of a machine's state (see
`ffr_dyn.kernels.units`).
"""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

from ffr_dyn.integrators.generalised_alpha import HHT, GeneralisedAlpha
from ffr_dyn.integrators.rk4 import RK4
from ffr_dyn.integrators.ros2 import ROS2
from ffr_dyn.integrators.ros3 import ROS3
from ffr_dyn.kernels.units import Unit

__all__ = ["HHT", "METHODS", "RK4", "ROS2", "ROS3", "GeneralisedAlpha", "Integrator"]


class Integrator(Protocol):
    """What `forward` needs of a method."""

    @property
    def step(self) -> float:
        """Time step [s]."""

    @property
    def numbers(self) -> tuple[float, ...]:
        """What the unit finds in `stages.numbers` at the start: settings, and room for what it keeps."""

    order: ClassVar[int]
    implicit: ClassVar[bool]  # whether it treats the elastic forces implicitly
    stage_count: ClassVar[int]  # states (x, v) of memory that it needs
    row_stages: ClassVar[int]  # the same for constraint rows
    unit: ClassVar[Unit]


METHODS: dict[str, type[Any]] = {
    "rk4": RK4,
    "ros2": ROS2,
    "ros3": ROS3,
    "generalised-alpha": GeneralisedAlpha,
    "hht": HHT,
}
