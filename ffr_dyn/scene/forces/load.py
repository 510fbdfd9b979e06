"""A force and a moment on a marker."""

from __future__ import annotations

from collections.abc import Callable, Sized
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from ffr_dyn.functions.operations import MULTIPLY
from ffr_dyn.functions.time_functions import TimeFunction, as_time_function, is_zero, operation
from ffr_dyn.scene.fields import OfMotion, Three
from ffr_dyn.scene.force_kinds import register_force
from ffr_dyn.scene.forces.force import Force, LawNumbers, LoadTable, Moment
from ffr_dyn.scene.forces.given import given_numbers, is_number
from ffr_dyn.scene.forces.places import FORCE_AND_MOMENT, AtMarker
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError


@register_force
@dataclass(frozen=True)
class Load(Force):
    """A force [N] and a moment [N m] on a marker.

    marker : "body.interface"
    force, moment : three components each; a component is a number, a `TimeFunction` (constant, harmonic, table, ...)
        or a Python function of time
    function : added to these, a Python function (t, state) -> (3,) force or (6,) force and moment; `state` is a
        `ffr_dyn.equations.state_view.StateView`
    axes : "global", or "body" for a follower load

    Raises InputError for other axes, and for a force or moment that has not three components.

    >>> gas = fd.Load("gas", "piston.crown", force=(fd.harmonic(amplitude=-500.0, frequency=25.0), 0, 0))
    """

    table = "loads"
    word = ""
    kernel = "ffr_dyn.kernels.forces.load:load"
    acts = (
        "force [N] and moment [N m] on a marker, global or body axes; "
        "numbers, time functions, Python functions of (t, state)"
    )
    positive = "along the axes"
    given = 6

    name: str
    marker: str
    force: Annotated[Any, Three(OfMotion("N"))] = (0.0, 0.0, 0.0)
    moment: Annotated[Any, Three(OfMotion("N m"))] = (0.0, 0.0, 0.0)
    function: Callable[..., Any] | None = None
    axes: str = "global"

    def __post_init__(self) -> None:
        if self.axes not in ("global", "body"):
            raise InputError(f"load {self.name!r}: axes must be 'global' or 'body', not {self.axes!r}")
        for what, value in (("force", self.force), ("moment", self.moment)):
            if not isinstance(value, Sized) or len(value) != 3:
                found = len(value) if isinstance(value, Sized) else value
                whole = "a function (t, state) that gives all of them goes to `function`"
                raise InputError(f"load {self.name!r}: {what} needs three components, not {found}; {whole}")

    @cached_property
    def place(self) -> AtMarker:
        acting = (
            self.function is not None or any(not is_number(c) or c for c in of) for of in (self.force, self.moment)
        )
        measured = tuple(one for one, acts in zip(FORCE_AND_MOMENT, acting, strict=True) if acts)
        return AtMarker(self.marker, self.axes, measured)

    def law(self, now: Moment, c: Any, rate: Any) -> Array:
        values = np.array([now.value(component)[0] for component in (*self.force, *self.moment)])
        if self.function is not None:
            given = np.ravel(self.function(now.t, now.state))
            values[: given.size] += given
        return values

    def varied(self, share: TimeFunction) -> Load:
        """Force and moment times a function of time."""
        if self.function is not None:
            super().varied(share)
        given = [as_time_function(component, self.name) for component in (*self.force, *self.moment)]
        if all(is_zero(component) for component in given):
            raise InputError(
                f"input {self.name!r}: the load is zero, and so is every share of it; give it a force or a moment"
            )
        varied = [operation(MULTIPLY, component, share) for component in given]
        return replace(self, force=varied[:3], moment=varied[3:])

    def compiled(self, table: LoadTable) -> LawNumbers:
        numbers = given_numbers((*self.force, *self.moment), f"load {self.name!r}", table)
        return LawNumbers(numbers, user=table.callback(self.function, 3, 6))

    def stays_in_plane(self, scene: Scene, normal: int) -> bool:
        k = self.place.axis_along(scene, normal)
        across = [k, *(3 + c for c in range(3) if c != k)]
        timed = [(*self.force, *self.moment)[c] for c in across]
        zero = across if self.function is None else getattr(self.function, "zero", ())  # what a formula knows of itself
        return all(is_number(one) and one == 0 for one in timed) and set(across) <= set(zero)
