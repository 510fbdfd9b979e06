"""Forces and torques on a joint coordinate: springs, friction, end stops, actuators, position control.

The coordinate is the `angle` [rad] or `stroke` [m] of a joint, measured as its drivers do: the angle turns f_j from f_i
towards g_i about h_i, the stroke is the distance of j from i along h_i. A positive force or torque increases it; the
reaction acts on the body of i. Wherever units depend on the coordinate, [N] stands for N of a stroke and N m of an angle.

An angle counts whole turns, from `turns` at the start (0: the start is taken between minus half and half a turn). The count
is carried from step to step, as the whole turn nearest to the last accepted state; a step must therefore turn a joint by
less than half a turn. Evaluating a state never changes the count.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.functions.curves import Curve
from ffr_dyn.scene.forces import check_damping, check_function, check_number, check_number_or_curve, check_positive
from ffr_prep.common.errors import InputError


@dataclass(frozen=True)
class JointSpring:
    """-(stiffness (c - free) + damping dc/dt + preload) on a joint coordinate c: a torsion spring, or one along a guide.

    stiffness : [N/m], or a `Curve` of the force over c - free;  damping : [N s/m], not negative, or a `Curve` over dc/dt
    free      : coordinate without force [m];  preload : [N], positive pulls back;  turns : whole turns at the start
    """

    name: str
    joint: str
    stiffness: float | Curve = 0.0
    damping: float | Curve = 0.0
    free: float = 0.0
    preload: float = 0.0
    coordinate: str = "angle"
    turns: int = 0

    def __post_init__(self) -> None:
        who = _checked(self)
        check_number_or_curve(self.stiffness, f"{who}: stiffness")
        check_damping(self.damping, f"{who}: damping")
        check_number(self.free, f"{who}: free")
        check_number(self.preload, f"{who}: preload")


@dataclass(frozen=True)
class JointFriction:
    """Dry friction against the rate c_dot of a joint coordinate, made smooth over the velocity `creep`:

        -normal (coulomb + (static - coulomb) exp(-(c_dot / stribeck)^2)) tanh(c_dot / creep) - viscous c_dot

    coulomb : friction force [N] with normal = 1, or coefficient of friction with `normal` [N] (times radius for an angle)
    normal  : a number not below zero, a time function or a Python function of time, below zero while the surfaces are
              apart. It is given: the joint's reaction does not enter
    creep   : [m/s]; a load below friction is not held but creeps, at creep atanh(load / coulomb)
    static, stribeck : friction at rest, not below coulomb, and the velocity [m/s] over which it falls (Stribeck 1902);
              both or neither
    viscous : [N s/m]
    """

    name: str
    joint: str
    coulomb: float
    creep: float
    normal: Any = 1.0
    static: float | None = None
    stribeck: float | None = None
    viscous: float = 0.0
    coordinate: str = "angle"

    def __post_init__(self) -> None:
        who = _checked(self)
        check_number(self.coulomb, f"{who}: coulomb", least=0.0)
        check_positive(self.creep, f"{who}: creep")
        check_number(self.viscous, f"{who}: viscous", least=0.0)
        check_function(self.normal, f"{who}: normal", least=0.0)
        if (self.static is None) != (self.stribeck is None):
            raise InputError(f"{who}: static and stribeck belong together; give both or neither")
        if self.static is not None:
            check_number(self.static, f"{who}: static", least=self.coulomb)
            check_positive(self.stribeck, f"{who}: stribeck")


@dataclass(frozen=True)
class JointStop:
    """End stops: one-sided spring-dampers beyond `lower` and `upper` [m] of a joint coordinate. They never pull.

    stiffness : [N/m];  damping : [N s/m], grows from zero over the depth `entry`
    entry     : [m] depth over which the stiffness grows from zero: the force is stiffness depth^2 / (2 entry) down to it,
                stiffness (depth - entry / 2) below
    turns     : whole turns of an angle at the start
    """

    name: str
    joint: str
    stiffness: float
    entry: float
    lower: float | None = None
    upper: float | None = None
    damping: float = 0.0
    coordinate: str = "angle"
    turns: int = 0

    def __post_init__(self) -> None:
        who = _checked(self)
        check_positive(self.stiffness, f"{who}: stiffness")
        check_positive(self.entry, f"{who}: entry")
        check_number(self.damping, f"{who}: damping", least=0.0)
        if self.lower is None and self.upper is None:
            raise InputError(f"{who} stops nothing: give lower, upper or both")
        for key in ("lower", "upper"):
            if getattr(self, key) is not None:
                check_number(getattr(self, key), f"{who}: {key}")
        if self.lower is not None and self.upper is not None and not self.lower < self.upper:
            raise InputError(f"{who}: lower is {self.lower:g} and upper {self.upper:g}; lower must be below upper")


@dataclass(frozen=True)
class Actuator:
    """A force [N] or torque [N m] on a joint coordinate.

    force    : a number, a time function (constant, harmonic, table, ...) or a Python function of time
    function : added to it, a Python function (t, state) -> number; `state` is a `ffr_dyn.equations.state_view.StateView`
    """

    name: str
    joint: str
    force: Any = 0.0
    function: Callable[..., Any] | None = None
    coordinate: str = "angle"

    def __post_init__(self) -> None:
        who = _checked(self)
        check_function(self.force, f"{who}: force")


@dataclass(frozen=True)
class Servo:
    """Position control of a joint coordinate c: kp (target - c) + kd (target_dot - dc/dt), held within +-limit.

    target : a number, a time function, or a Python function t -> value or (value, rate, second derivative)
    kp [N/m], kd [N s/m]: not negative;  limit [N]: largest force, by default none;  turns : whole turns at the start
    """

    name: str
    joint: str
    target: Any
    kp: float
    kd: float = 0.0
    limit: float = np.inf
    coordinate: str = "angle"
    turns: int = 0

    def __post_init__(self) -> None:
        who = _checked(self)
        check_function(self.target, f"{who}: target")
        check_number(self.kp, f"{who}: kp", least=0.0)
        check_number(self.kd, f"{who}: kd", least=0.0)
        if not self.limit > 0:
            raise InputError(f"{who}: limit is {self.limit}; it must be positive")


JointForce = JointSpring | JointFriction | JointStop | Actuator | Servo


def turns_of(force: JointForce) -> int:
    """Whole turns that the force counts at the start."""
    return 0 if isinstance(force, (JointFriction, Actuator)) else force.turns


def _checked(force: JointForce) -> str:
    """What messages call the force, after a check of what all have in common."""
    who = f"force {force.name!r}"
    if force.coordinate not in ("angle", "stroke"):
        raise InputError(f"{who}: coordinate must be 'angle' or 'stroke', not {force.coordinate!r}")
    turns = turns_of(force)
    if turns != int(turns) or (turns and force.coordinate == "stroke"):
        raise InputError(f"{who}: turns is {turns}; it must be a whole number, and zero for a stroke")
    return who
