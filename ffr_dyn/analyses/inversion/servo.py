"""Servo constraints: motions that are known while forces elsewhere realise them, reduced to their internal dynamics.

    M acc + Phi_q^T lam = f + B u,    Phi_q acc = gamma,    S acc = sigma    (S the Jacobian of the known motions)

No constraint force acts along S; the efforts u do. With P = S M_Phi^-1 B regular (M_Phi^-1: the inverse mass projected on the
joints) the known motions have relative degree two and u follows at every state. What they leave free are the internal
coordinates y: joint and elastic coordinates that, with the joints and the known motions, fix every position. Values of y are
in units of the machine, so that steps and tolerances are the same for a small and a large one.
(Blajer & Kolodziejczyk, Multibody System Dynamics 11 (2004) 343-364; Seifried, Dynamics of Underactuated Multibody Systems,
Springer 2014, ch. 3.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import qr

from ffr_dyn.analyses.efforts import Effort, sized, with_work, without, work_of
from ffr_dyn.analyses.inversion.turns import Angle, angles_of, count_turns
from ffr_dyn.compile.engine import with_model
from ffr_dyn.compile.scene_tables import compile_scene
from ffr_dyn.consistency.assemble import Assembled
from ffr_dyn.consistency.evaluation import (
    Evaluation,
    Evaluator,
    evaluate,
    evaluated_mass_matrix,
    evaluator,
    free_motions,
    locked,
    of_mass,
    row_sizes,
    total_mass_matrix,
    unit_rows,
)
from ffr_dyn.consistency.mobility import coordinate_gradients, coordinate_word
from ffr_dyn.equations.constraint_rows import Block
from ffr_dyn.equations.constraints import evaluate_word
from ffr_dyn.equations.forces import At
from ffr_dyn.equations.layout import Layout, meets, moved, to_body_axes, to_global_axes, velocity_sizes
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.scene.drivers import Driver, driver_word
from ffr_dyn.scene.joints import COORDINATES, DRIVEN_ANGLE, Word
from ffr_dyn.scene.scene import Scene, length_of, marker_number
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError

ITERATIONS = 20
TOLERANCE = 1e-12  # of a step of the positions, relative to sizes, and of open rows
SINGULAR = 1e13  # condition of the equations for accelerations, reactions and efforts
DIFFERENCE = 1e-6


@dataclass(frozen=True)
class Units:
    """What counts as one in a machine.

    length  : [m];  sizes, light : (V,) velocities of bodies, as in `velocity_sizes`, and those of about one energy
    y, known, efforts : of coordinates y (D,), known motions (K,) [m, rad] and efforts (U,) [N, N m]
    """

    length: float
    sizes: Array
    light: Array
    y: Array
    known: Array
    efforts: Array


@dataclass(frozen=True)
class ServoMotion:
    """A scene with known motions and the efforts that shall realise them, in coordinates y that fix every position.

    at       : evaluator with all rows: joints, known motions, joint coordinates of y. It owns its functions' numbers
    plant, known, inner : row numbers of the joints (and true drivers), of the known motions, of the joint coordinates
    held     : rows that fix positions with y: all of a motion that is known, without the known ones of a free scene
    elastic  : numbers in v of elastic coordinates of y, which come after the joint coordinates
    data     : where the functions of the joint coordinates keep their two numbers
    span     : known motions are held at their values outside of it [s]
    angles   : on which forces act
    units    : of y, known motions and efforts
    """

    at: Evaluator
    unknown: tuple[Effort, ...]
    plant: Array
    known: Array
    inner: Array
    held: Array
    elastic: Array
    data: Array
    span: tuple[float, float]
    names: tuple[str, ...]
    units: Units
    angles: tuple[Angle, ...] = ()

    @property
    def size(self) -> int:
        """Number of coordinates y."""
        return self.inner.size + self.elastic.size

    @property
    def lasts(self) -> float:
        """[s] of the known motions."""
        return self.span[1] - self.span[0]

    def steps(self, y: Array, rate: Array) -> tuple[Array, Array]:
        """(D,) of differences by y and by y_dot."""
        return DIFFERENCE * np.maximum(1.0, np.abs(y)), DIFFERENCE * np.maximum(1.0 / self.lasts, np.abs(rate))


@dataclass(frozen=True)
class Moment:
    """The scene at one time: x, v (global), efforts u, y_ddot, and what forces have measured (O,), with its turns."""

    x: Array
    v: Array
    u: Array
    y_ddot: Array
    measured: Array


def servo(
    assembled: Assembled, known: tuple[str, ...], unknown: tuple[Effort, ...], span: tuple[float, float]
) -> ServoMotion:
    """The motions that the known ones leave free, in internal coordinates chosen at the assembled state, by rank.

    Raises InputError where joint and elastic coordinates do not describe it.
    """
    return _in_coordinates(assembled, known, known, unknown, span)


def unguided(
    assembled: Assembled, known: tuple[str, ...], unknown: tuple[Effort, ...], span: tuple[float, float]
) -> ServoMotion:
    """The scene that the efforts move, in coordinates that leave the known motions free. Errors as of `servo`."""
    return _in_coordinates(assembled, known, (), unknown, span)


def left_free(assembled: Assembled, time: float) -> tuple[str, ...]:
    """Names of coordinates that describe what joints and known motions leave free."""
    now = evaluate(evaluator(assembled.system), time, assembled.x, assembled.v)
    return _internal(assembled.system.scene, assembled, now.jacobian)[2]


def _in_coordinates(
    assembled: Assembled,
    known: tuple[str, ...],
    kept: tuple[str, ...],
    unknown: tuple[Effort, ...],
    span: tuple[float, float],
) -> ServoMotion:
    """Coordinates of what the joints and the known motions that are `kept` leave free."""
    scene, blocks = assembled.system.scene, list(assembled.system.blocks)
    now = evaluate(evaluator(assembled.system), span[0], assembled.x, assembled.v)
    free = rows_of(blocks, tuple(name for name in known if name not in kept))
    words, elastic, names = _internal(scene, assembled, np.delete(now.jacobian, free, axis=0))
    inner = [Block(f"internal {k}", ends, (word,), driver=True) for k, (ends, word) in enumerate(words)]
    system = compile_scene(scene, blocks + inner)
    ordered, rows = list(system.blocks), system.model.rows
    inner_rows, known_rows = rows_of(ordered, tuple(block.name for block in inner)), rows_of(ordered, known)
    every = np.arange(rows.kind.size + locked(system.layout).size)
    held = np.setdiff1d(every, rows_of(ordered, tuple(name for name in known if name not in kept)))
    plant_rows = np.setdiff1d(every, np.concatenate([inner_rows, known_rows]))
    data = system.model.functions.start[rows.function[inner_rows]]
    at = _owning(sized(evaluator(system), unknown, np.zeros(len(unknown))))
    guides = [word for name in known for block in ordered if block.name == name for word in block.words]
    start = At(without(scene, unknown), assembled.system.layout, span[0], assembled.x, assembled.v)
    units = _units(start, unknown, guides, names, np.array(elastic, int), span[1] - span[0])
    own = ServoMotion(
        at, unknown, plant_rows, known_rows, inner_rows, held, np.array(elastic, int), data, span, names, units
    )
    y = internal_values(own, assembled.x, assembled.v)
    evaluate(at, span[0], assembled.x, assembled.v)
    return replace(own, angles=angles_of(at, names[: own.inner.size], span[0], y))


def _owning(at: Evaluator) -> Evaluator:
    """The evaluator with numbers of functions that no other has, so that they may change from call to call."""
    model = at.system.model
    numbers = model.functions._replace(data=model.functions.data.copy())
    return replace(at, engine=with_model(at.engine, model._replace(functions=numbers)))


def rows_of(blocks: list[Block], names: tuple[str, ...]) -> Array:
    """Row numbers of the named blocks, in the order of the names."""
    starts = np.concatenate([[0], np.cumsum([len(block.words) for block in blocks])])
    at = {block.name: np.arange(starts[k], starts[k + 1]) for k, block in enumerate(blocks)}
    return np.concatenate([at[name] for name in names] or [np.zeros(0)]).astype(int)


def effort_columns(own: ServoMotion, at: Evaluator, state: tuple[float, Array, Array], alone: Array) -> Array:
    """(V, U) generalised forces of efforts of one of their units at a state (time, x, v), by the forces (V,) alone:
    exact, since efforts enter linearly."""
    forces = [evaluate(sized(at, own.unknown, one), *state).force - alone for one in np.diag(own.units.efforts)]
    return np.array(forces).reshape(len(own.unknown), alone.size).T


def _units(
    start: At,
    unknown: tuple[Effort, ...],
    known: list[Word],
    names: tuple[str, ...],
    elastic: Array,
    lasts: float,
) -> Units:
    """Of joint coordinates by their names, and elastic ones by their numbers in v. An effort of one does the work of the
    forces at the start, or moves the machine by its size in the time that the known motions last [s]."""
    scene, place, length = start.scene, start.place, length_of(start.scene)
    sizes = velocity_sizes(scene, place)
    work = (length / lasts) ** 2 * sum(body.model.mass for body in scene.bodies) + work_of(start, 0 * start.v)
    joints = [1.0 if name.endswith(".angle") else length for name in names[: len(names) - elastic.size]]
    return Units(
        length,
        sizes,
        _of_one_energy(scene, place, sizes),
        np.concatenate([joints, sizes[elastic]]),
        np.array([1.0 if row.kind == DRIVEN_ANGLE else length for row in known]),
        with_work(scene, unknown, work),
    )


def _of_one_energy(scene: Scene, place: Layout, sizes: Array) -> Array:
    """(V,) velocities at which coordinates of bodies carry about one energy, whatever the size and the mass of a body."""
    found = sizes.copy()
    for b, body in enumerate(scene.bodies):
        found[place.iv[b] : place.iv[b] + 6 + place.n[b]] /= np.sqrt(body.model.mass) * sizes[place.iv[b]]
    return found


# ---- internal coordinates --------------------------------------------------------------------------------------------


def _internal(
    scene: Scene, assembled: Assembled, jacobian: Array
) -> tuple[list[tuple[tuple[int, int], Word]], list[int], tuple[str, ...]]:
    """Words (with markers) of joint coordinates, numbers of elastic ones, that fix what rows (C, V) leave free; all names."""
    place = assembled.system.layout
    M = total_mass_matrix(scene, place, assembled.x)
    Z = free_motions(jacobian, M)
    names, gradients = coordinate_gradients(scene, place, assembled.x, assembled.v)
    joints = [(joint, c) for joint in scene.joints for c in COORDINATES[joint.kind]]
    elastic = [int(k) for b in range(len(place.n)) for k in np.arange(place.v_size)[place.q_dot(b)]]
    labels = [f"{scene.bodies[b].name}.q.{k + 1}" for b in range(len(place.n)) for k in range(place.n[b])]
    candidates = np.concatenate([gradients, unit_rows(np.array(elastic, int), place.v_size)])
    length = np.linalg.norm(of_mass(M, candidates.T), axis=0)
    _, R, order = qr((candidates @ Z / length[:, None]).T, pivoting=True, mode="economic")
    d = Z.shape[1]
    if d and (R.shape[1] < d or np.abs(np.diag(R)).min() < 1e-6):
        raise InputError(
            "the motion that the known motions leave free is not described by joint and elastic coordinates: a body moves "
            "on joints without coordinates; know its motion too, or use joints with an angle or a stroke"
        )
    chosen = np.sort(order[:d])
    words = []
    for k in chosen[chosen < len(joints)]:
        joint, coordinate = joints[k]
        ends = marker_number(scene, joint.i), marker_number(scene, joint.j)
        words.append(
            (ends, driver_word(Driver("internal", joint.name, polynomial(0.0, 0.0), coordinate=coordinate), joint))
        )
    rest = [int(k) - len(joints) for k in chosen[chosen >= len(joints)]]
    said = tuple([names[k] for k in chosen[chosen < len(joints)]] + [labels[k] for k in rest])
    return words, [elastic[k] for k in rest], said


def internal_values(own: ServoMotion, x: Array, v: Array) -> Array:
    """(2 d,) y and y_dot of a state."""
    scene, place = own.at.system.scene, own.at.system.layout
    names, gradients = coordinate_gradients(scene, place, x, v)
    V = to_body_axes(place, x, v)
    values = _joint_values(scene, own, x, v)
    numbers = [names.index(name) for name in own.names[: own.inner.size]]
    position = np.concatenate([[values[k] for k in numbers], x[_positions(own)]])
    return np.concatenate([position / own.units.y, np.append(gradients[numbers] @ V, V[own.elastic]) / own.units.y])


def _joint_values(scene: Scene, own: ServoMotion, x: Array, v: Array) -> list[float]:
    place, values = own.at.system.layout, []
    for joint in scene.joints:
        ends = (marker_number(scene, joint.i), marker_number(scene, joint.j)) * 2
        words = [coordinate_word(joint, coordinate) for coordinate in COORDINATES[joint.kind]]
        values += [evaluate_word(scene, place, x, v, word, ends, (0.0, 0.0, 0.0)).Phi for word in words]
    return values


def _positions(own: ServoMotion) -> Array:
    """Numbers in x of the internal elastic coordinates: a body has one more position than velocities."""
    place = own.at.system.layout
    body = np.searchsorted(np.array(place.iv), own.elastic, side="right") - 1
    return own.elastic + body + 1


# ---- the reduced equations -------------------------------------------------------------------------------------------


def guided(own: ServoMotion, time: float, w: Array) -> Evaluator:
    """The evaluator whose joint coordinates go through y with the rate y_dot."""
    d, data = own.size, own.at.system.model.functions.data
    y, rate = (w[k : k + own.inner.size] * own.units.y[: own.inner.size] for k in (0, d))
    data[own.data], data[own.data + 1] = y - rate * time, rate
    return own.at


def at_moment(own: ServoMotion, time: float, w: Array, near: Array) -> Moment:
    """Everything at a time, from w = (y, y_dot) and a state x nearby.

    Raises ComputationError when the internal coordinates no longer describe the motion or the efforts are not determined.
    """
    clock = float(np.clip(time, *own.span))
    at = guided(own, clock, w)
    x, now = placed(own, at, clock, w, near)
    v = to_global_axes(own.at.system.layout, x, rates_of(own, now, w[own.size :]))
    count_turns(own.angles, at, clock, w)
    now = evaluate(at, clock, x, v)
    return _accelerated(own, at, now, (clock, x, v), now.gamma)


def placed(own: ServoMotion, at: Evaluator, time: float, w: Array, x: Array) -> tuple[Array, Evaluation]:
    """The position by Newton's method from x, and the equations there at rest."""
    place, slots, bending = own.at.system.layout, _positions(own), own.units.y[own.inner.size :]
    still, wanted = np.zeros(place.v_size), w[own.inner.size : own.size] * bending
    for _ in range(ITERATIONS):
        now = evaluate(at, time, x, still)
        Phi, off = now.Phi[own.held], wanted - x[slots]
        allowed = TOLERANCE * row_sizes(now.jacobian[own.held], own.units.sizes)
        held = bool(np.abs(off / bending).max(initial=0.0) < TOLERANCE)
        if held and (np.abs(Phi) <= allowed).all():
            return x, now
        if not (np.isfinite(Phi).all() and np.isfinite(off).all()):
            break
        step = np.linalg.solve(square(own, now), np.concatenate([-Phi, off]))
        rounded = held and meets(own.at.system.scene, x, Phi, 0.0)
        x = moved(place, x, step)
        if rounded or np.abs(step / own.units.sizes).max() < TOLERANCE:
            return x, evaluate(at, time, x, still)
    raise ComputationError(
        f"at t = {time:.6g} s no position belongs to the known motions: they are out of reach, or "
        f"{', '.join(own.names)} no longer describe what is free"
    )


def square(own: ServoMotion, now: Evaluation) -> Array:
    return np.concatenate([now.jacobian[own.held], unit_rows(own.elastic, now.jacobian.shape[1])])


def rates_of(own: ServoMotion, now: Evaluation, rate: Array) -> Array:
    """(V,) velocities in body axes of y_dot (D,), at the equations of a position at rest."""
    bending = (rate * own.units.y)[own.inner.size :]
    found: Array = np.linalg.solve(square(own, now), np.concatenate([-now.nu[own.held], bending]))
    return found


def _accelerated(
    own: ServoMotion, at: Evaluator, now: Evaluation, state: tuple[float, Array, Array], gamma: Array
) -> Moment:
    """Accelerations and efforts at an evaluated state, of equations whose rows and columns are brought to one size, as they
    have different units."""
    V, C, U = now.jacobian.shape[1], own.plant.size, own.known.size
    B, J, S = effort_columns(own, at, state, now.force), now.jacobian[own.plant], now.jacobian[own.known]
    matrix = np.zeros((V + C + U, V + C + U))
    matrix[:V, :V] = evaluated_mass_matrix(at)
    matrix[:V, V : V + C], matrix[V : V + C, :V] = J.T, J
    matrix[:V, V + C :], matrix[V + C :, :V] = -B, S
    light = own.units.light
    across = np.concatenate([light, 1 / _lengths(J * light), 1 / _lengths(B.T * light)])
    along = np.concatenate([light, 1 / _lengths(J * light), 1 / _lengths(S * light)])
    matrix = matrix * np.outer(along, across)
    _check_determined(matrix, state[0])
    found = across * np.linalg.solve(matrix, along * np.concatenate([now.force, gamma[own.plant], gamma[own.known]]))
    acceleration = found[:V]
    joints = now.jacobian[own.inner] @ acceleration - gamma[own.inner]
    y_ddot = np.concatenate([joints, acceleration[own.elastic]]) / own.units.y
    efforts = found[V + C :] * own.units.efforts
    return Moment(state[1], state[2], efforts, y_ddot, at.work.loads.measured.copy())


def _lengths(rows: Array) -> Array:
    """(K,) of rows, one of those that vanish."""
    length = np.linalg.norm(rows, axis=1)
    return np.where(length > 0, length, 1.0)


def _check_determined(scaled: Array, time: float) -> None:
    if not np.linalg.cond(scaled) < SINGULAR:
        raise ComputationError(
            f"at t = {time:.6g} s the unknown forces no longer determine the known motions: the mechanism passes a position "
            "in which they do not move them; let another force be unknown, or keep away from it"
        )


def slope(own: ServoMotion, time: float, w: Array, near: Array) -> tuple[Array, Array]:
    """dw/dt (2 d,) and the state x."""
    moment = at_moment(own, time, w, near)
    return np.concatenate([w[own.size :], moment.y_ddot]), moment.x


def slope_matrix(own: ServoMotion, time: float, w: Array, near: Array) -> Array:
    """(2 d, 2 d) central differences of the slope."""
    scale = np.concatenate(own.steps(w[: own.size], w[own.size :]))
    sides = [
        [slope(own, time, w + sign * h * one, near)[0] for sign in (1, -1)]
        for h, one in zip(scale, np.eye(w.size), strict=True)
    ]
    return np.array([(plus - minus) / (2 * h) for (plus, minus), h in zip(sides, scale, strict=True)]).T
