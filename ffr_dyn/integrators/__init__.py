"""Time integration: one file per method, one protocol.

A method is a frozen dataclass with its settings; its compiled function does one step of an engine's state (see
`ffr_dyn.kernels.integrator_api`, which tells how to write one).

Twin: none, declarations.
"""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any, ClassVar, Protocol, runtime_checkable

from ffr_dyn.integrators.dopri5 import DormandPrince as DormandPrince
from ffr_dyn.integrators.generalised_alpha import HHT as HHT
from ffr_dyn.integrators.generalised_alpha import GeneralisedAlpha as GeneralisedAlpha
from ffr_dyn.integrators.half_explicit import HalfExplicit as HalfExplicit
from ffr_dyn.integrators.rk4 import RK4 as RK4
from ffr_dyn.integrators.ros2 import ROS2 as ROS2
from ffr_dyn.integrators.ros3 import ROS3 as ROS3
from ffr_dyn.integrators.ros3 import AdaptiveROS3 as AdaptiveROS3
from ffr_dyn.integrators.tolerances import Tolerances as Tolerances
from ffr_dyn.integrators.tolerances import tolerances as tolerances
from ffr_dyn.integrators.variational import Variational as Variational
from ffr_dyn.integrators.within import Within as Within
from ffr_dyn.kernels.integrator_api import CompiledFunction
from ffr_prep.common.errors import InputError


@runtime_checkable
class Integrator(Protocol):
    """The protocol of a method of `forward`.

    >>> isinstance(fd.ROS2(1e-3), fd.Integrator)
    """

    @property
    def step(self) -> float:
        """Time step [s]; zero where the method chooses it."""

    @property
    def numbers(self) -> tuple[float, ...]:
        """The numbers that the step finds in `stages.numbers` at the start: settings, and room for what it keeps."""

    order: ClassVar[int]
    implicit: ClassVar[bool]  # whether it treats the elastic forces implicitly
    takes_forces: ClassVar[bool]  # whether it treats stiff forces implicitly (see `ffr_dyn.kernels.forces.implicit`)
    reach: ClassVar[float]  # h omega up to which an undamped elastic oscillation does not grow
    controlled: ClassVar[bool]  # whether it chooses its steps (see `Controlled`)
    repeatable: ClassVar[bool]  # whether steps of a given length may be done again from an earlier state
    stage_count: ClassVar[int]  # states (x, v) of memory that it needs
    row_stages: ClassVar[int]  # the same for constraint rows; zero where it works on accelerations alone
    keeps_terms: ClassVar[bool]  # whether it needs the quadratic terms of all bodies after an evaluation
    do_step: ClassVar[CompiledFunction]  # one step of the engine's state


class Controlled(Integrator, Protocol):
    """A method that chooses its steps; its step leaves the error of the step in stages.x[0], stages.v[0]."""

    @property
    def tolerances(self) -> Tolerances:
        """The tolerances of the error of a step."""

    estimate_order: ClassVar[int]  # the error of a step goes as h to this power


# By the names in scene files and commands: methods of fixed steps, and those that choose theirs.
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


def methods() -> dict[str, type[Any]]:
    """All methods by name."""
    return {**METHODS, **CONTROLLED}


def stepped(within: Within, step: float) -> Integrator:
    """The method of an accuracy with a step [s]. Raises InputError for one that chooses its steps."""
    kind = method_named(within.method)
    if kind.controlled:
        raise InputError(f"{within.method} chooses its steps by its tolerances; give these, or a method of fixed steps")
    made: Integrator = kind(step, **dict(within.settings))
    return made


def register_integrator(name: str, method: type[Any]) -> None:
    """Make a method of one's own known to scene files, commands and charts.

    Raises InputError for a name that is taken, and for a class without what `Integrator` asks for.

    >>> fd.register_integrator("euler", Euler)
    """
    asked = [
        *Integrator.__annotations__,
        "step" if not getattr(method, "controlled", False) else "tolerances",
        "numbers",
    ]
    declared = {*dir(method), *getattr(method, "__dataclass_fields__", ())}
    if missing := [key for key in asked if key not in declared]:
        raise InputError(f"method {name!r}: the class {method.__name__} lacks {', '.join(missing)}")
    if name in methods() and methods()[name].__qualname__ != method.__qualname__:
        raise InputError(f"there is a method {name!r} already; give the class {method.__name__} another name")
    (CONTROLLED if method.controlled else METHODS)[name] = method


def method_named(name: str) -> type[Any]:
    """The class of a method. Raises InputError for a name that is none, with the nearest."""
    if name not in methods():
        close = get_close_matches(name, methods(), 1)
        hint = f"did you mean {close[0]!r}? " if close else ""
        raise InputError(f"there is no method {name!r}; {hint}there are: {', '.join(methods())}")
    return methods()[name]
