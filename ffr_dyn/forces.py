"""Applied loads: forces and moments at markers, spring-dampers. Gravity belongs to the scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ffr_dyn.errors import InputError


@dataclass(frozen=True)
class Load:
    """A force [N] and a moment [N m] on a marker.

    marker : "body.interface"
    force, moment : three components each; a component is a number, a `TimeFunction` (constant, harmonic, table, ...)
        or a Python function of time
    function : instead of these, a Python function (t, state) -> (3,) force or (6,) force and moment; `state` is a
        `ffr_dyn.state.StateView`
    axes : "global", or "body" for a follower load
    """

    name: str
    marker: str
    force: Any = (0.0, 0.0, 0.0)
    moment: Any = (0.0, 0.0, 0.0)
    function: Callable[..., Any] | None = None
    axes: str = "global"

    def __post_init__(self) -> None:
        if self.axes not in ("global", "body"):
            raise InputError(f"load {self.name!r}: axes must be 'global' or 'body', not {self.axes!r}")
        for what, value in (("force", self.force), ("moment", self.moment)):
            if len(value) != 3:
                raise InputError(f"load {self.name!r}: {what} needs three components, not {len(value)}")


@dataclass(frozen=True)
class SpringDamper:
    """Force along the line i - j, positive in tension: stiffness (l - free_length) + damping dl/dt + preload.

    stiffness [N/m], damping [N s/m], free_length [m], preload [N]
    """

    name: str
    i: str
    j: str
    stiffness: float
    damping: float = 0.0
    free_length: float = 0.0
    preload: float = 0.0
