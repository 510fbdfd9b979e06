"""Formulas of the moving system: forces such as "-k * rod.tip.position.y - c * rod.tip.velocity.y"."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property

import numpy as np

from ffr_dyn.equations.kinematics import marker_axis, marker_point
from ffr_dyn.equations.layout import Layout
from ffr_dyn.equations.state_view import StateView
from ffr_dyn.functions.formula import Expression, names_in, value_of
from ffr_dyn.functions.time_functions import TimeFunction, is_zero
from ffr_dyn.scene.joints import COORDINATES, Joint, frames
from ffr_dyn.scene.scene import GROUND, Scene, marker_names, marker_number
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

LOOKS = 9  # of a turn, for the size of a force
SAME = 1e-9  # of it: rounding


@dataclass(frozen=True)
class StateFormula:
    """A function (t, state) of measured quantities, one number for each expression, that Python evaluates at every step.

    Names: "rod.tip.position.x", ".velocity.x"; "rod.omega_bar.x"; "rod.q.1", "rod.q_dot.1"; "hinge.angle" (within half a
    turn), "hinge.angle_rate", "guide.stroke", "guide.stroke_rate".
    """

    expressions: tuple[Expression, ...]

    @cached_property
    def zero(self) -> tuple[int, ...]:
        """Numbers of the expressions that are zero whatever moves, which tell a plane that nothing acts across it."""
        return tuple(k for k, one in enumerate(self.expressions) if isinstance(one, TimeFunction) and is_zero(one))

    @cached_property
    def angles(self) -> frozenset[str]:
        """Names of the joints whose angles it reads, each within half a turn."""
        names = {name for expression in self.expressions for name in names_in(expression)}
        return frozenset(name.removesuffix(".angle") for name in names if name.endswith(".angle"))

    def torn(self, joint: str, t: float, state: StateView) -> bool:
        """Whether it jumps where the angle of a joint goes over from half a turn to minus half a turn."""
        measured, angles = self._measured(state), np.linspace(-np.pi, np.pi, LOOKS)
        of = [[value_of(one, t, measured | {f"{joint}.angle": float(a)}) for a in angles] for one in self.expressions]
        values = np.nan_to_num(of)
        return bool((np.abs(values[:, -1] - values[:, 0]) > SAME * np.abs(values).max(axis=1)).any())

    def __call__(self, t: float, state: StateView) -> Array | float:
        measured = self._measured(state)
        values = np.array([value_of(expression, t, measured) for expression in self.expressions])
        return values if values.size > 1 else values[0]

    def _measured(self, state: StateView) -> dict[str, float]:
        return {name: _read(state, name) for expression in self.expressions for name in names_in(expression)}


def check_names(scene: Scene, formula: StateFormula, what: str) -> None:
    """Raises InputError that names `what` for a quantity that the scene does not have."""
    known = list(quantities_of(scene))
    for expression in formula.expressions:
        for name in names_in(expression):
            if name not in known:
                close = get_close_matches(name, known, 1)
                hint = f"did you mean {close[0]!r}?" if close else f"there are: {', '.join(known)}"
                raise InputError(f"{what}: there is no quantity {name!r}; {hint}")


def quantities_of(scene: Scene) -> Iterator[str]:
    """Every quantity that a formula can name."""
    moving = [marker for marker in marker_names(scene) if not marker.startswith(f"{GROUND}.")]
    yield from (f"{marker}.{what}.{k}" for marker in moving for what in ("position", "velocity") for k in "xyz")
    for body in scene.bodies:
        yield from (f"{body.name}.omega_bar.{k}" for k in "xyz")
        yield from (f"{body.name}.{what}.{k + 1}" for what in ("q", "q_dot") for k in range(body.model.n))
    for joint in scene.joints:
        yield from (f"{joint.name}.{c}{rate}" for c in COORDINATES[joint.kind] for rate in ("", "_rate"))


def _read(state: StateView, name: str) -> float:
    """The value of one of `quantities_of`."""
    head, _, last = name.rpartition(".")
    if last in ("angle", "angle_rate", "stroke", "stroke_rate"):
        joint = next(joint for joint in state.scene.joints if joint.name == head)
        measure = _angle if last.startswith("angle") else _stroke
        return measure(state, joint)[int(last.endswith("_rate"))]
    owner, _, what = head.rpartition(".")
    number = "xyz".index(last) if last in ("x", "y", "z") else int(last) - 1
    return float(getattr(state, what)(owner)[number])


def _angle(state: StateView, joint: Joint) -> tuple[float, float]:
    """(angle, rate) of a joint, from the dot products of its axes."""
    on_i, on_j = frames(joint)
    f, g = (marker_axis(*_at(state), marker_number(state.scene, joint.i), on_i[:, k]) for k in (0, 1))
    f_j = marker_axis(*_at(state), marker_number(state.scene, joint.j), on_j[:, 0])
    c, s = f.r @ f_j.r, g.r @ f_j.r
    c_dot, s_dot = (a.r_dot @ f_j.r + a.r @ f_j.r_dot for a in (f, g))
    return float(np.arctan2(s, c)), float((c * s_dot - s * c_dot) / (c * c + s * s))


def _stroke(state: StateView, joint: Joint) -> tuple[float, float]:
    """(stroke, rate) of a joint."""
    i, j = (marker_point(*_at(state), marker_number(state.scene, name)) for name in (joint.i, joint.j))
    h = marker_axis(*_at(state), marker_number(state.scene, joint.i), frames(joint)[0][:, 2])
    apart, rate = j.r - i.r, j.r_dot - i.r_dot
    return float(h.r @ apart), float(h.r @ rate + h.r_dot @ apart)


def _at(state: StateView) -> tuple[Scene, Layout, Array, Array]:
    return state.scene, state.layout, state.x, state.v
