"""Time integration: one file per method, one protocol.

A method is a frozen dataclass with its settings; its compiled unit does one step of a machine's state (see
`ffr_dyn.kernels.entry_points`).
"""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

from ffr_dyn.integrators.dopri5 import DormandPrince
from ffr_dyn.integrators.generalised_alpha import HHT, GeneralisedAlpha
from ffr_dyn.integrators.half_explicit import HalfExplicit
from ffr_dyn.integrators.rk4 import RK4
from ffr_dyn.integrators.ros2 import ROS2
from ffr_dyn.integrators.ros3 import ROS3, AdaptiveROS3
from ffr_dyn.integrators.tolerances import Tolerances, tolerances
from ffr_dyn.integrators.variational import Variational
from ffr_dyn.kernels.unit import Unit

__all__ = [
    "CONTROLLED",
    "HHT",
    "METHODS",
    "RK4",
    "ROS2",
    "ROS3",
    "AdaptiveROS3",
    "Controlled",
    "DormandPrince",
    "GeneralisedAlpha",
    "HalfExplicit",
    "Integrator",
    "Tolerances",
    "Variational",
    "tolerances",
]


class Integrator(Protocol):
    """What `forward` needs of a method."""

    @property
    def step(self) -> float:
        """Time step [s]; zero where the method chooses it."""

    @property
    def numbers(self) -> tuple[float, ...]:
        """What the unit finds in `stages.numbers` at the start: settings, and room for what it keeps."""

    order: ClassVar[int]
    implicit: ClassVar[bool]  # whether it treats the elastic forces implicitly
    reach: ClassVar[float]  # h omega up to which an undamped elastic oscillation does not grow
    controlled: ClassVar[bool]  # whether it chooses its steps (see `Controlled`)
    repeatable: ClassVar[bool]  # whether steps of a given length may be done again from an earlier state
    stage_count: ClassVar[int]  # states (x, v) of memory that it needs
    row_stages: ClassVar[int]  # the same for constraint rows
    keeps_terms: ClassVar[bool]  # whether it needs the quadratic terms of all bodies after an evaluation
    looks_ahead: ClassVar[int]  # order to which it takes geometric stiffening as a function of time, or 0: not
    calls: ClassVar[tuple[str, ...]]  # what its unit calls beside what all methods do, of `units.EXTRA_UNITS`
    unit: ClassVar[Unit]


class Controlled(Integrator, Protocol):
    """A method that chooses its steps; its unit leaves the error of the step in stages.x[0], stages.v[0]."""

    @property
    def tolerances(self) -> Tolerances:
        """What the error may be."""

    estimate_order: ClassVar[int]  # the error of a step goes as h to this power


METHODS: dict[str, type[Any]] = {
    "rk4": RK4,
    "ros2": ROS2,
    "ros3": ROS3,
    "half-explicit": HalfExplicit,
    "generalised-alpha": GeneralisedAlpha,
    "hht": HHT,
    "variational": Variational,
}
CONTROLLED: dict[str, type[Any]] = {"ros3-adaptive": AdaptiveROS3, "dopri5": DormandPrince}
