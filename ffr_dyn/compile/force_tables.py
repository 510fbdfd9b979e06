"""Applied loads of a scene -> the tables of the kernels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.functions.curves import Curve, pieces
from ffr_dyn.functions.time_functions import OPERATION, USER, TimeFunction, as_time_function, is_zero
from ffr_dyn.kernels.tables import (
    ACTUATOR,
    AFFINE,
    ANGLE,
    FRICTION,
    GLOBAL,
    LENGTH,
    SERVO,
    SPRING,
    STOP,
    STROKE,
    Functions,
    Loads,
)
from ffr_dyn.scene.applied_loads import Action, actions_of, bushings_of, coordinate_axes, coordinate_ends, spread_of
from ffr_dyn.scene.forces import (
    Bushing,
    Load,
    SpringDamper,
    bushing_curves,
    bushing_frames,
    damping_matrix,
    stiffness_matrix,
)
from ffr_dyn.scene.joint_forces import Actuator, JointFriction, JointSpring, JointStop, Servo, turns_of
from ffr_dyn.scene.scene import Scene, body_number, marker_number
from ffr_dyn.scene.surface_loads import Affine, SurfaceLoad, distributed
from ffr_prep.common.errors import InputError

Array = np.ndarray


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

    signals : by name, the initial value and the numbers of the functions that hold it
    """

    def __init__(self) -> None:
        self.functions: list[TimeFunction] = []
        self.callbacks: list[Callback] = []
        self.slots = 0
        self.signals: dict[str, tuple[float, list[int]]] = {}

    def add(self, function: TimeFunction, what: str = "function") -> int:
        if function.callback is not None:
            slot = self.callback(function.callback, (1, 2, 3), what, with_state=False)
            function = TimeFunction(USER, (float(slot),))
        elif function.kind == OPERATION:
            rows = [float(self.add(operand, what)) for operand in function.operands]
            function = TimeFunction(OPERATION, (*function.data, rows[0], rows[-1]))
        self.functions.append(function)
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
        starts = np.cumsum([0, *(len(f.data) for f in self.functions)])
        return {name: tuple(int(starts[k]) for k in numbers) for name, (_, numbers) in self.signals.items()}

    def tables(self) -> Functions:
        sizes = [len(f.data) for f in self.functions]
        return Functions(
            kind=np.array([f.kind for f in self.functions], dtype=np.int64),
            start=np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)]).astype(np.int64),
            data=np.array([number for f in self.functions for number in f.data], dtype=float),
        )


class NumberPool:
    """Collects numbers; a curve that is used twice is kept twice."""

    def __init__(self) -> None:
        self.numbers: list[float] = []

    def add(self, numbers: Any) -> int:
        """Where these numbers begin."""
        start = len(self.numbers)
        self.numbers += np.ravel(numbers).tolist()
        return start

    def curve(self, value: Any) -> int:
        """Where a curve begins, or -1 for what is none."""
        return self.add(pieces(value)) if isinstance(value, Curve) else -1


def base_functions(scene: Scene, functions: FunctionTable) -> Array:
    """(3,) time functions of the base's acceleration, -1 for a component that is zero."""
    return np.array(
        [-1 if is_zero(f) else functions.add(f, "base_acceleration") for f in scene.base_acceleration], dtype=np.int64
    )


def load_tables(scene: Scene, functions: FunctionTable) -> Loads:
    """All applied loads of a scene but gravity."""
    pool = NumberPool()
    wrench, value, number = _wrenches(scene, functions)
    actions = actions_of(scene)
    bushings = bushings_of(scene)
    return Loads(
        wrench=np.array(wrench, dtype=np.int64).reshape(-1, 3),
        value=np.array(value, dtype=float).reshape(-1, 6),
        function=np.array(number, dtype=np.int64).reshape(-1, 6),
        action=np.array([_action(scene, a, functions, pool) for a in actions], dtype=np.int64).reshape(-1, 6),
        action_axes=np.array([coordinate_axes(scene, a) for a in actions]).reshape(-1, 3, 3),
        turn=np.array([0 if isinstance(a, SpringDamper) else 2 * np.pi * turns_of(a) for a in actions], dtype=float),
        bushing=np.array([_bushing(scene, b, pool) for b in bushings], dtype=np.int64).reshape(-1, 3),
        frames=np.array([[f.T for f in bushing_frames(b)] for b in bushings]).reshape(-1, 2, 3, 3),
        spread=np.array([_spread(scene, s, functions, pool) for s in spread_of(scene)], dtype=np.int64).reshape(-1, 4),
        data=np.array(pool.numbers, dtype=float),
    )


# ---- wrenches -----------------------------------------------------------------------------------------------------


def _wrenches(
    scene: Scene, functions: FunctionTable
) -> tuple[list[tuple[int, int, int]], list[list[float]], list[list[int]]]:
    wrench, value, number = [], [], []
    for load in scene.loads:
        constants, indices = _components(load, functions)
        value.append(constants)
        number.append(indices)
        slot = -1
        if load.function is not None:
            slot = functions.callback(load.function, (3, 6), f"load {load.name!r}", with_state=True)
        wrench.append((marker_number(scene, load.marker), int(load.axes == "body"), slot))
    return wrench, value, number


def _components(load: Load, functions: FunctionTable) -> tuple[list[float], list[int]]:
    constants, indices = [], []
    for component in (*load.force, *load.moment):
        if isinstance(component, (int, float, np.floating, np.integer)):
            if not np.isfinite(component):
                raise InputError(f"load {load.name!r}: a component is {component}; all must be finite")
            constants.append(float(component))
            indices.append(-1)
        else:
            what = f"load {load.name!r}"
            constants.append(1.0)
            indices.append(functions.add(as_time_function(component, what), what))
    return constants, indices


# ---- forces on coordinates ----------------------------------------------------------------------------------------


def _action(scene: Scene, action: Action, functions: FunctionTable, pool: NumberPool) -> tuple[int, ...]:
    law, numbers, function = _law(action, functions, pool)
    return (_coordinate_kind(action), *coordinate_ends(scene, action), law, pool.add(numbers), function)


def _coordinate_kind(action: Action) -> int:
    if isinstance(action, SpringDamper):
        return LENGTH
    return ANGLE if action.coordinate == "angle" else STROKE


def _law(action: Action, functions: FunctionTable, pool: NumberPool) -> tuple[int, list[float], int]:
    """Law, its numbers, its time function or -1."""
    who = f"force {action.name!r}"

    def timed(value: Any) -> int:
        return functions.add(as_time_function(value, who), who)

    match action:
        case SpringDamper():
            return SPRING, _spring(action.stiffness, action.damping, action.free_length, action.preload, pool), -1
        case JointSpring():
            return SPRING, _spring(action.stiffness, action.damping, action.free, action.preload, pool), -1
        case JointFriction():
            more = 0.0 if action.static is None else action.static - action.coulomb
            fall = 1.0 if action.stribeck is None else action.stribeck
            return FRICTION, [action.coulomb, more, fall, action.creep, action.viscous], timed(action.normal)
        case JointStop():
            lower = -np.inf if action.lower is None else action.lower
            upper = np.inf if action.upper is None else action.upper
            return STOP, [lower, upper, action.stiffness, action.damping, action.entry], -1
        case Servo():
            return SERVO, [action.kp, action.kd, action.limit], timed(action.target)
        case Actuator():
            slot = -1
            if action.function is not None:
                slot = functions.callback(action.function, (1,), who, with_state=True)
            return ACTUATOR, [slot], timed(action.force)


def _spring(stiffness: Any, damping: Any, free: float, preload: float, pool: NumberPool) -> list[float]:
    k = 0.0 if isinstance(stiffness, Curve) else stiffness
    d = 0.0 if isinstance(damping, Curve) else damping
    return [k, d, free, preload, pool.curve(stiffness), pool.curve(damping)]


# ---- bushings and spread loads ------------------------------------------------------------------------------------


def _bushing(scene: Scene, bushing: Bushing, pool: NumberPool) -> tuple[int, int, int]:
    curves = [pool.curve(curve) for curve in bushing_curves(bushing)]
    numbers = [stiffness_matrix(bushing), damping_matrix(bushing), np.array(bushing.preload, float), np.array(curves)]
    start = pool.add(np.concatenate([np.ravel(part) for part in numbers]))
    return marker_number(scene, bushing.i), marker_number(scene, bushing.j), start


def _spread(scene: Scene, load: SurfaceLoad, functions: FunctionTable, pool: NumberPool) -> tuple[int, int, int, int]:
    b = body_number(scene, load)
    made = distributed(load, scene.bodies[b].model)
    if isinstance(made, Affine):
        kind, start = AFFINE, pool.add(np.concatenate([made.constant, made.slope.ravel()]))
    else:
        kind = GLOBAL
        start = pool.add(np.concatenate([made.force, made.u_f.ravel(), made.phi_f.ravel()]))
    who = f"force {load.name!r}"
    return b, kind, start, functions.add(as_time_function(load.function, who), who)
