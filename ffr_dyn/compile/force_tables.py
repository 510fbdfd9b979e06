"""Applied loads of a scene -> the tables of the kernels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np

from ffr_dyn.functions.breaks import declared_breaks, switches
from ffr_dyn.functions.curves import Curve, pieces
from ffr_dyn.functions.time_functions import OPERATION, USER, TimeFunction, as_time_function, is_zero
from ffr_dyn.kernels.tables import WAYS, Functions, Loads
from ffr_dyn.scene.force_kinds import forces_of, kernels_of
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError


@dataclass(frozen=True)
class Callback:
    """A Python function of the user and where its numbers go.

    sizes : how many numbers it may return;  with_state : it is called with (t, state), else with t alone
    """

    function: Callable[..., Any]
    slot: int
    sizes: tuple[int, ...]
    what: str
    with_state: bool

    @property
    def size(self) -> int:
        """Room for what it returns."""
        return max(self.sizes)


class FunctionTable:
    """Collects time functions while a scene is compiled, the callbacks of the user with their slots, and the scene's inputs.

    purposes : what each function is for
    signals  : by name, the initial value and the numbers of the functions that hold it
    """

    def __init__(self) -> None:
        self.functions: list[TimeFunction] = []
        self.purposes: list[str] = []
        self.callbacks: list[Callback] = []
        self.slots = 0
        self.signals: dict[str, tuple[float, list[int]]] = {}

    def add(self, function: TimeFunction, what: str = "function", *, derivatives: int = 0) -> int:
        """The number of a function, of which a Python function must tell so many derivatives."""
        if function.callback is not None:
            sizes = tuple(range(1 + derivatives, 4))
            slot = self.callback(function.callback, sizes, what, with_state=False)
            function = TimeFunction(USER, (float(slot), *function.data[1:]))
        elif function.kind == OPERATION:
            rows = [float(self.add(operand, what, derivatives=derivatives)) for operand in function.operands]
            function = TimeFunction(OPERATION, (*function.data, rows[0], rows[-1]))
        self.functions.append(function)
        self.purposes.append(what)
        if function.name:
            self._remember(function)
        return len(self.functions) - 1

    def _remember(self, signal: TimeFunction) -> None:
        value, numbers = self.signals.setdefault(signal.name, (signal.data[4], []))
        if value != signal.data[4]:
            raise InputError(
                f"input {signal.name!r} starts with {value:g} in one place and {signal.data[4]:g} in another"
            )
        numbers.append(len(self.functions) - 1)

    def callback(self, function: Callable[..., Any], sizes: tuple[int, ...], what: str, *, with_state: bool) -> int:
        slot = self.slots
        self.callbacks.append(Callback(function, slot, sizes, what, with_state))
        self.slots += max(sizes)
        return slot

    def inputs(self) -> dict[str, tuple[int, ...]]:
        """By name, where the numbers of a signal begin in the tables."""
        begin = self._starts()
        return {name: tuple(begin[k] for k in numbers) for name, (_, numbers) in self.signals.items()}

    def _starts(self) -> list[int]:
        """Where the numbers of each function begin, and the end."""
        return list(accumulate((len(f.data) for f in self.functions), initial=0))

    def tables(self) -> Functions:
        return Functions(
            kind=np.array([f.kind for f in self.functions], dtype=np.int64),
            start=np.array(self._starts(), dtype=np.int64),
            data=np.array([number for f in self.functions for number in f.data], dtype=float),
            breaks=declared_breaks(self.functions),
            switches=switches(self.functions),
        )


def base_functions(scene: Scene, functions: FunctionTable) -> Array:
    """(3,) time functions of the base's acceleration, -1 for a component that is zero."""
    return np.array(
        [-1 if is_zero(f) else functions.add(f, "base_acceleration") for f in scene.base_acceleration], dtype=np.int64
    )


class LoadNumbers:
    """Collects the numbers of forces while a scene is compiled (a `ffr_dyn.scene.forces.force.LoadTable`).

    who : the force whose numbers are collected
    """

    def __init__(self, scene: Scene, functions: FunctionTable) -> None:
        self.scene, self.who = scene, ""
        self._functions = functions
        self.data: list[float] = []

    def add(self, numbers: Any) -> int:
        """Where these numbers begin."""
        start = len(self.data)
        self.data += np.ravel(numbers).tolist()
        return start

    def function(self, value: Any, *, derivatives: int = 0) -> int:
        return self._functions.add(as_time_function(value, self.who), self.who, derivatives=derivatives)

    def callback(self, function: Callable[..., Any] | None, *sizes: int) -> int:
        return -1 if function is None else self._functions.callback(function, sizes, self.who, with_state=True)

    def curve(self, value: Any) -> int:
        """A curve that is used twice is kept twice."""
        return self.add(pieces(value)) if isinstance(value, Curve) else -1


def load_tables(scene: Scene, functions: FunctionTable) -> Loads:
    """All applied loads of a scene but gravity."""
    numbers, kernels = LoadNumbers(scene, functions), kernels_of(scene)
    rows: list[tuple[int, ...]] = []
    initial: list[float] = []
    for force in forces_of(scene):
        rows.append((kernels.index(force.kernel), *_row(scene, force, numbers, len(initial))))
        initial += force.place.initial
    kinks = [(k, kink) for k, force in enumerate(forces_of(scene)) for kink in force.kinks]
    return Loads(
        row=np.array(rows, dtype=np.int64).reshape(-1, 11),
        data=np.array(numbers.data, dtype=float),
        initial=np.array(initial, dtype=float),
        kinked=np.array([(k, kink.number) for k, kink in kinks], dtype=np.int64).reshape(-1, 2),
        kinks=np.array([kink[:4] for _, kink in kinks], dtype=float).reshape(-1, 4),
    )


def _row(scene: Scene, force: Force, numbers: LoadNumbers, measured: int) -> tuple[int, ...]:
    """`Loads.row` from its second column on."""
    place = force.place
    numbers.who = f"{'load' if force.table == 'loads' else 'force'} {force.name!r}"
    law = force.compiled(numbers)
    starts = numbers.add(place.numbers(scene)), numbers.add(law.numbers)
    return (*starts, measured, *place.ends(scene), WAYS[place.way], law.function, law.user, -1, -1)
