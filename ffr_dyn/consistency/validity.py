"""Where a motion strains the theory it was computed with: linear elasticity, and no geometric stiffening.

Both are looked at along the run and told at its end; a run stops for a deformation that means nothing any more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.equations.layout import angular_speeds
from ffr_dyn.kernels.tables import Record
from ffr_dyn.results.result import Result
from ffr_dyn.scene.parts import owner
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, Interface, remembered
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

ROUNDS = 4  # analyses, each with more parts; mostly the second has enough
MEANINGLESS = np.pi  # elastic rotation [rad]: half a turn of an end against the other
STRAINED = 0.1  # elastic rotation [rad] beyond which linear elasticity in the moving frame is doubtful
# The same for a body with a second-order displacement. A cantilever under a force at its end, against the exact beam: its tip
# is off by 0.1 % of its deflection at 0.2 rad, and 16 times less in twice as many parts.
BENT = 0.2
STRETCHED = 0.1  # deflection of one interface against another over the size of the body, beyond which the same holds
NEAR = 1e-2  # of its size: interfaces closer to each other tell nothing of how far a body is stretched
TORN = (
    "two of its interfaces are {:.2g} of their distance farther apart or nearer, which in a straight body is strain, far "
    "beyond linear elasticity and in parts as well: what joints, drivers and loads ask of it does not fit its length"
)
# Share of the first frequency that a body may spin at without geometric stiffening. The frequencies of a blade are then off
# by about half its square; a pendulum and a slider-crank with 0.08 and 0.09 were off by 1 mm in 1.2 m after 0.5 s and by
# 21 % of the deflection.
SPINNING = 0.03


def extremes(system: System, record: Record) -> Array:
    """(4, B) of each body: the largest elastic rotation [rad] of one interface against another, the largest angular velocity
    [rad/s], the largest deflection of one against another over the size of the body, the largest change of their distance
    over that."""
    place, found = system.layout, np.zeros((4, len(system.scene.bodies)))
    found[1] = angular_speeds(place, record.v).max(axis=0, initial=0.0)
    for b, body in enumerate(system.scene.bodies):
        q = record.x[:, place.q(b)]
        found[::2, b], found[3, b] = deflections(body.model, q), stretch(body.model, q)
    return found


def deflections(model: FlexibleBody, q: Array) -> tuple[float, float]:
    """The largest rotation [rad] of an interface, q (T, n), and its largest deflection over the size of the body, seen from
    the first interface or the one farthest from it: the same in every body frame. A lone interface is seen from the frame.
    """
    if not model.interfaces or not model.n:
        return 0.0, 0.0
    moved = remembered(model, "deflections", lambda: _between_points(model))
    turn, shift = (math.sqrt(np.square(moved[:, :, k] @ q.T).sum(axis=2).max(initial=0.0)) for k in (0, 1))
    return turn, shift / model.size if model.size > 0 else 0.0


def stretch(model: FlexibleBody, q: Array) -> float:
    """The largest change, to first order, of the distance of an interface from those that it is seen from, over that."""
    if len(model.interfaces) < 2 or not model.n:
        return 0.0
    along = remembered(model, "stretch", lambda: _along(model))
    return float(np.abs(along @ q.T).max(initial=0.0))


def _along(model: FlexibleBody) -> Array:
    """(K, n) changes of the distances of all pairs of different places, over these."""
    moved, rows = remembered(model, "deflections", lambda: _between_points(model)), []
    for at, shifts in zip(_seen_from(model), moved[:, :, 1], strict=True):
        ways = np.array([i.position - at.position for i in model.interfaces])
        apart = np.linalg.norm(ways, axis=1)
        rows += [
            way @ shift / far**2 for way, shift, far in zip(ways, shifts, apart, strict=True) if far > NEAR * model.size
        ]
    return np.array(rows).reshape(-1, model.n)


def _seen_from(model: FlexibleBody) -> tuple[Interface, ...]:
    """The first interface and the one farthest from it; the frame of the body where there is one alone."""
    points = model.interfaces
    if len(points) == 1:
        return (Interface("frame", points[0].position, *np.zeros((2, 3, model.n))),)
    return points[0], max(points, key=lambda i: float(np.linalg.norm(i.position - points[0].position)))


def _between_points(model: FlexibleBody) -> Array:
    """(1 or 2, I, 2, 3, n) rotation and translation of all interfaces, seen from those that they are seen from."""
    return np.array([
        [
            (i.phi_r - at.phi_r, i.phi_t - at.phi_t + np.cross(i.position - at.position, at.phi_r, axisb=0).T)
            for i in model.interfaces
        ]
        for at in _seen_from(model)
    ])  # fmt: skip


def meaningless(scene: Scene, found: Array) -> str:
    """Why a run with these extremes (4, B) tells nothing any more; empty where it does."""
    b = int(np.argmax(found[0]))
    if not found[0, b] > MEANINGLESS:
        return ""
    doubt = " ".join(unstiffened(scene, found[1])[:1]) or "A load or a spring may be far too large, or negative."
    return (
        f"body {scene.bodies[b].name!r} has turned within itself by {found[0, b]:.3g} rad, which linear elasticity says "
        f"nothing about: its motion diverges. {doubt}"
    )


def strained(scene: Scene, turned: Array, deflected: Array, stretched: Array) -> list[str]:
    """Bodies that deform too much for one moving frame; turned (B,) [rad], deflected (B,) of the body's size, stretched (B,)
    of the distance of two interfaces. Of a body in parts the one that does so most.
    """
    worst: dict[str, tuple[float, str]] = {}
    for body, turn, share, longer in zip(scene.bodies, turned, deflected, stretched, strict=True):
        limit = BENT if stiffened(body) else STRAINED
        beyond = max(share / STRETCHED, turn / limit)
        if beyond > max(1.0, worst.get(owner(body), (0.0, ""))[0]):
            parts = f"{_enough(_count(body), turn / limit, share / STRETCHED)} parts would do (ffr-prep reduce --parts)"
            note = (
                f"body {body.name!r} deforms by up to {share:.2g} of its size and turns within itself by up to {turn:.2g} "
                f"rad: one moving frame is strained beyond about {STRETCHED:g} of the size or {limit:g} rad; "
                f"{parts if longer <= STRETCHED else TORN.format(longer)}"
            )
            worst[owner(body)] = beyond, note
    return [note for _, note in worst.values()]


def _count(body: Body) -> int:
    """How many parts the whole has that the body is a part of; 1 of a body alone."""
    return len(body.part_of.model.parts) if body.part_of else 1


def _enough(count: int, turn: float, share: float) -> int:
    """How many equal parts a body in so many needs, the worst of which turns and deflects by these shares of the limits.

    As many as a cantilever under a force at its end, whose curvature falls evenly from the root: that of the root makes a
    part of several turn by the mean of the worst part times 2 N / (2 N - 1), and deflect by that times 3 N / (3 N - 1).
    """
    most = int(np.ceil(count * max(turn / (1 - 1 / (2 * count)), share / (1 - 1 / (3 * count)))))
    return max(1, min(count, most) if max(turn, share) <= 1 else max(count + 1, most))


def parts_needed(scene: Scene, result: Result, angle: float = BENT) -> dict[str, int]:
    """The number of equal parts that each flexible body of a scene needs, by what it does in a result; 1 where one will do.

    With so many none of them turns within itself by more than the angle [rad], or deflects by more than a tenth of its size.

    0.2 rad within a body means errors of 0.1 % of its deflection, where it has its load matrices; half of that is much for a
    linear body. A result in parts knows better where a body bends: the number may grow once.

    Raises InputError for an angle that is not positive and a result without the elastic coordinates.

    >>> fd.parts_needed(scene, result)  # {"rod": 3}
    """
    check_angle(angle)
    needed: dict[str, int] = {}
    for body in scene.bodies:
        if body.model.n:
            turn, share = deflections(body.model, result[f"{body.name}.q"])
            parts = _enough(_count(body), turn / angle, share / STRETCHED)
            needed[owner(body)] = max(parts, needed.get(owner(body), 1))
    return needed


def check_angle(angle: float) -> None:
    """Raises InputError for an angle [rad] that no part can keep within."""
    if not angle > 0:
        raise InputError(f"the angle is {angle} rad; it must be positive")


def in_enough_parts(
    make: Callable[[Mapping[str, int]], Scene], analyse: Callable[[Scene], Result], angle: float = BENT
) -> tuple[Scene, Result]:
    """The scene with its bodies in so many parts as `parts_needed` says, and its result.

    make    : the scene with these bodies in so many equal parts; with none at first
    analyse : such as `static`, or a forward run; its result keeps `*.q`
    angle   : that an interface may turn by within its body [rad]

    Raises InputError as `parts_needed`; ComputationError where ever more parts are needed.

    >>> scene, result = fd.in_enough_parts(make, lambda scene: fd.static(scene))
    """
    scene = make({})
    for _ in range(ROUNDS):
        result = analyse(scene)
        there = {owner(body): _count(body) for body in scene.bodies}
        more = {name: count for name, count in parts_needed(scene, result, angle).items() if count > there[name]}
        if not more:
            return scene, result
        scene = make({name: count for name, count in (there | more).items() if count > 1})
    raise ComputationError(f"after {ROUNDS} analyses still more parts are needed: {more}; begin with so many")


def unstiffened(scene: Scene, spun: Array) -> list[str]:
    """Bodies without geometric stiffening that spin near their first frequency; spun (B,) [rad/s]."""
    notes = []
    for body, spin in zip(scene.bodies, spun, strict=True):
        share = spin / _first(body) if body.model.n and not stiffened(body) else 0.0
        if share > SPINNING:
            mend = "reduce it without --linear" if body.stiffening else "leave out stiffening = false"
            notes.append(
                f"body {body.name!r} spins without geometric stiffening, and its frequencies are off by up to "
                f"{50 * share**2:.2g} %: at {spin:.4g} rad/s, {share:.2g} of the first of them"
                f"{', where its computed motion may diverge' if share > 1 else ''}; {mend}"
            )
    return notes


def _first(body: Body) -> float:
    return float(np.sqrt(body.model.omega2.min())) or np.inf


def stiffened(body: Body) -> bool:
    return body.model.stiffening is not None and body.stiffening
