"""Assembly: positions and velocities that meet the joints, from a rough guess; and which constraint rows are redundant.

Corrections are the smallest in the norm of the mass matrix, so heavy bodies move least. Elastic coordinates are left
alone wherever rigid motion suffices. (Haug 1989, ch. 4; Nikravesh 1988, ch. 5 for redundant rows by factorisation.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import qr
from scipy.sparse import block_diag, csr_array

from ffr_dyn.compile.scene_tables import System, compile_scene
from ffr_dyn.consistency.dropped_terms import check_dropped
from ffr_dyn.consistency.held_frequencies import held_frequencies
from ffr_dyn.consistency.row_space import independent, smallest_solution
from ffr_dyn.consistency.sliding import sliding_notes
from ffr_dyn.consistency.validity import deflections
from ffr_dyn.equations.constraint_rows import Block, blocks_of, rows_at
from ffr_dyn.equations.constraints import Row
from ffr_dyn.equations.inertia import kept_integrals, mass_matrix
from ffr_dyn.equations.layout import Layout, initial_state, layout
from ffr_dyn.functions.rotation import G_bar, rotation_matrix
from ffr_dyn.functions.time_functions import POLYNOMIAL, TimeFunction
from ffr_dyn.scene.joints import DISTANCE
from ffr_dyn.scene.scene import Scene, require_scene
from ffr_dyn.variants.mean_axis import in_mean_axis_frames
from ffr_dyn.variants.plane import obstacles, planar_forms
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import InputError

TOLERANCE = 1e-11  # of Phi [m, -] and of its rate
ASKED = 1e-6  # of a row across the plane at random speeds of about one; modes carry rounding of 1e-9
RANK_TOLERANCE = 1e-8  # of a row's independent part, relative to the row
ITERATIONS = 100
RELAXATION = 1e-8  # of dependent rows, relative
LARGEST_TURN = 0.5  # rad per iteration
TORN = 0.5  # elastic displacement of an interface over the size of its body that no joint may ask for


@dataclass(frozen=True, repr=False)
class Assembled(Brief):
    """A consistent state and the compiled scene.

    system   : with independent constraint rows, for the motion
    all_rows : with all of them and a relaxed multiplier matrix, for the reactions; None where no row is redundant

    x, v : positions and velocities (see `Layout`);  notes : what was changed and what is redundant, in words
    degrees_of_freedom : velocities left free by the constraints, elastic ones included
    redundant : (joint, row) pairs that follow from the other rows
    computed : in the plane or in space, and why, in words
    """

    system: System
    all_rows: System | None
    x: Array
    v: Array
    degrees_of_freedom: int
    notes: tuple[str, ...]
    redundant: tuple[tuple[str, str], ...] = ()
    computed: str = ""


def assemble(scene: Scene, *, time: float = 0.0) -> Assembled:
    """Consistent positions and velocities at `time` [s].

    Raises InputError when the joints cannot be closed, naming the joint that stays open furthest, or when a driver
    contradicts the joints.
    """
    require_scene(scene)
    declared = scene
    scene, blocks, computed = _flattened(scene, time)
    place = layout(scene)
    left_out = [note for b, body in enumerate(scene.bodies) for note in check_dropped(body, place.active(b))]
    guess, v = initial_state(scene, place)
    x = close_positions(scene, place, blocks, guess, v, time)
    _require_shape(scene, place, guess, x)
    kept, redundant = independent_blocks(scene, place, blocks, x, v, time)
    v = close_velocities(scene, place, blocks, x, v, time)
    rows = sum(len(block.words) for block in kept)
    notes = [
        f"{block}: the row '{text}' is redundant; of the reactions that are possible the smallest are given"
        for block, text in redundant
    ] + left_out
    shift = max(np.linalg.norm(x[place.R(b)] - guess[place.R(b)]) for b in range(len(scene.bodies)))
    if shift > 1e-6:
        notes.insert(0, f"assembly moved a body by {shift:.3g} m from where the scene puts it")
    if scene.plane != "none":
        notes.append(
            f"the scene is planar (normal {scene.plane}): computed in the plane, with in-plane modes without their rounding "
            "across it"
        )
    notes += sliding_notes(scene)
    notes += held_frequencies(
        declared, [(x[place.R(b)], x[place.p(b)]) for b in range(len(place.n))], scene.plane, time
    )
    all_rows = compile_scene(scene, blocks, RELAXATION) if redundant else None
    free = _movable(place) - rows
    return Assembled(compile_scene(scene, kept), all_rows, x, v, free, tuple(notes), tuple(redundant), computed)


def _require_shape(scene: Scene, place: Layout, guess: Array, x: Array) -> None:
    """InputError where positions are met only by a body deformed beyond all sense."""
    for b, body in enumerate(scene.bodies):
        _, share = deflections(body.model, (x - guess)[None, place.q(b)])
        if share > TORN:
            raise InputError(
                f"the mechanism cannot be assembled without deforming body {body.name!r} by {share:.3g} times its size; "
                "check the positions of the interfaces, the lengths of the bodies and the axes of the joints, or start closer"
            )


def _movable(place: Layout) -> int:
    """How many velocities the scene has without its constraints."""
    return sum(len(place.active(b)) + n for b, n in enumerate(place.n))


def flattened(scene: Scene, time: float) -> tuple[Scene, list[Block]]:
    """The scene as it is computed: second-order bodies in their mean-axis form, its plane decided, `plane` "x", "y", "z" or
    "none"; and its rows, those of a planar scene without the ones that no motion in the plane can change."""
    return _flattened(scene, time)[:2]


def plane_in_words(scene: Scene, time: float) -> str:
    """Whether a scene is computed in the plane or in space, and why."""
    return _flattened(scene, time)[2]


def _flattened(scene: Scene, time: float) -> tuple[Scene, list[Block], str]:
    """As `flattened` and `plane_in_words`."""
    scene, found = in_mean_axis_frames(scene), dict[str, str]()
    for flat in planar_forms(scene):
        blocks = blocks_of(flat)
        across, found[flat.plane] = _across(flat, blocks, time)
        if not found[flat.plane] or scene.plane == flat.plane:
            numbers, said = iter(across), ", as the scene says" * (scene.plane == flat.plane)
            left = [replace(b, words=tuple(word for word in b.words if not next(numbers))) for b in blocks]
            return flat, left, f"in the plane, normal {flat.plane}{said}"
    return replace(scene, plane="none"), blocks_of(scene), _in_space(scene, found)


def _in_space(scene: Scene, found: dict[str, str]) -> str:
    """Why no plane was found, in words; found : what keeps the joints from one, by its normal."""
    if scene.plane == "none":
        return "in space, as the scene says"
    normal, said = next(((key, (what,)) for key, what in found.items()), None) or obstacles(scene)
    more = f" (and {len(said) - 1} more)" if len(said) > 1 else ""
    return f"in space: not in the plane with the normal {normal}, as {said[0]}{more}"


def _across(scene: Scene, blocks: list[Block], time: float) -> tuple[list[bool], str]:
    """Which rows of a planar scene act across the plane only; and, in words, what of them does not hold every body in it or
    asks for motion, now or later, or which others do not act in the plane only; "" where there is nothing.

    Looked at in the position and with the motion that the scene declares, and at random in the plane around it.
    """
    place, rng = layout(scene), np.random.default_rng(0)
    start, v = initial_state(scene, place)
    active = np.zeros(place.v_size, bool)
    for b, n in enumerate(place.n):
        active[[place.iv[b] + c for c in (*place.active(b), *range(6, 6 + n))]] = True
    inside, outside, left = [], [], []
    for scale in (0.0, 1e-2, 1e-2):
        step = np.where(active, scale * rng.normal(size=place.v_size), 0.0)
        x, speeds = _moved(place, start, step), v + _to_global(place, start, 100 * step)
        rows = rows_at(scene, place, blocks, x, speeds, time)
        inside.append([_largest(row, active) for row in rows])
        outside.append([_largest(row, ~active) for row in rows])
        left.append([max(abs(row.Phi), abs(row.nu), abs(row.gamma)) for row in rows])
    most_inside, most_outside, most_left = (np.array(part).max(axis=0) for part in (inside, outside, left))
    across = most_inside <= RANK_TOLERANCE * most_outside
    mixed = ~across & (most_outside > RANK_TOLERANCE * most_inside)
    moving = np.array([_changes(word.function) for block in blocks for word in block.words], bool)
    asked = across & ((most_left >= ASKED) | moving)
    names = [block.name for block in blocks for _ in block.words]
    for wrong, what in ((mixed, "acts both in the plane and across it"), (asked, "asks for motion across it")):
        if wrong.any():
            return across.tolist(), f"{names[int(np.argmax(wrong))]!r} {what}"
    if lost := _driver_lost(blocks, across):
        return across.tolist(), f"driver {lost!r} acts across it alone"
    held = [row for row, k in zip(rows, across, strict=True) if k]
    if not _columns_independent(stacked(held, place)[:, ~active]):
        return across.tolist(), "its joints leave a body free to move across it"
    return across.tolist(), ""


def _driver_lost(blocks: list[Block], across: Array) -> str:
    """A driver all rows of which act across the plane: in the plane it would have no effort; empty where there is none."""
    numbers = iter(across.tolist())
    acts = [[next(numbers) for _ in block.words] for block in blocks]
    return next((block.name for block, rows in zip(blocks, acts, strict=True) if block.driver and all(rows)), "")


def _largest(row: Row, chosen: Array) -> float:
    """The largest entry of the Jacobian row at chosen (V,) velocities."""
    return max(
        (float(np.abs(part[chosen[k : k + part.size]]).max(initial=0.0)) for k, part in row.parts.items()), default=0.0
    )


def _columns_independent(A: csr_array) -> bool:
    """Whether no combination of the columns vanishes. Rows have more of their own than columns, which a chain adds up."""
    if independent(A):
        return A.shape[0] == A.shape[1]
    return independent(csr_array(A.T)) or int(np.linalg.matrix_rank(A.toarray())) == A.shape[1]


def _changes(function: TimeFunction | None) -> bool:
    """Whether a function of time is more than a constant."""
    return function is not None and (function.kind != POLYNOMIAL or any(function.data[1:]))


def in_space(scene: Scene) -> Scene:
    """The scene without a search for a plane: what could leave it counts, even where nothing pushes it out."""
    return replace(scene, plane="none") if scene.plane == "auto" else scene


def close_positions(scene: Scene, place: Layout, blocks: list[Block], x: Array, v: Array, time: float) -> Array:
    """Newton's method on Phi(x) = 0 with least-mass-norm steps; rigid motion first, elastic coordinates if they must."""
    worst = 0.0
    for elastic in (False, True):
        moved = x.copy()
        for _ in range(ITERATIONS):
            rows = rows_at(scene, place, blocks, moved, v, time)
            Phi = np.array([row.Phi for row in rows])
            worst = np.abs(Phi).max(initial=0.0)
            if worst < TOLERANCE:
                return moved
            moved = _moved(place, moved, _limited(place, _step(scene, place, moved, rows, -Phi, elastic)))
    said = [(block.name, word) for block in blocks for word in block.words]
    at = int(np.argmax(np.abs(Phi)))
    name, word = said[at]
    if word.kind == DISTANCE and not rows[at].jacobian.any():
        raise InputError(
            f"the mechanism cannot be assembled: the points of joint {name!r} coincide, and the line between them, of no "
            "length, has no direction; place its bodies apart"
        )
    raise InputError(
        f"the mechanism cannot be assembled: joint {name!r} stays open by {worst:.3g} after {ITERATIONS} iterations; "
        "check the positions of the interfaces, the lengths of the bodies and the axes of the joints, or start closer"
    )


def close_velocities(scene: Scene, place: Layout, blocks: list[Block], x: Array, v: Array, time: float) -> Array:
    """Velocities with Phi_q v + Phi_t = 0, nearest to v; rigid motion first."""
    for elastic in (False, True):
        rows = rows_at(scene, place, blocks, x, v, time)
        nu = np.array([row.nu for row in rows])
        step = _step(scene, place, x, rows, -nu, elastic)
        moved = v + _to_global(place, x, step)
        left = np.abs([row.nu for row in rows_at(scene, place, blocks, x, moved, time)])
        if left.size == 0 or left.max() < 1e-9 * max(1.0, float(np.abs(nu).max())):
            return moved
    names = [block.name for block in blocks for _ in block.words]
    raise InputError(
        f"no velocities meet the joints and drivers: {names[int(np.argmax(left))]!r} is left at a rate of "
        f"{left.max():.3g}; the mechanism may be locked or in a singular position at the start"
    )


def independent_blocks(
    scene: Scene, place: Layout, blocks: list[Block], x: Array, v: Array, time: float
) -> tuple[list[Block], list[tuple[str, str]]]:
    """Blocks without their redundant words, and the (block, word) pairs that were dropped.

    Rows are redundant when they depend on others here *and* at a neighbouring position, so that a mechanism that
    starts in a singular position keeps its rows. Raises InputError when a driver's row is redundant.
    """
    rows = rows_at(scene, place, blocks, x, v, time)
    if not rows:
        return blocks, []
    keep = _independent(scene, place, x, rows)
    if keep.size < len(rows):
        nearby = _neighbour(scene, place, blocks, x, v, time, rows)
        others = _independent(scene, place, nearby, rows_at(scene, place, blocks, nearby, v, time))
        keep = others if others.size > keep.size else keep
    said, chosen = [(block, word) for block in blocks for word in block.words], set(keep.tolist())
    dropped = [said[k] for k in range(len(said)) if k not in chosen]
    for block, _ in dropped:
        if block.driver:
            raise InputError(f"driver {block.name!r} prescribes a motion that the joints and other drivers already fix")
    kept = iter(range(len(said)))
    left = [replace(block, words=tuple(word for word in block.words if next(kept) in chosen)) for block in blocks]
    return left, [(block.name, word.text) for block, word in dropped]


# ---- linear algebra -----------------------------------------------------------------------------------------------


def stacked(rows: list[Row], place: Layout) -> csr_array:
    """(C, V) the Jacobian of the rows."""
    starts = np.cumsum([0, *(sum(part.size for part in row.parts.values()) for row in rows)])
    columns = [np.arange(k, k + part.size) for row in rows for k, part in row.parts.items()]
    values = [part for row in rows for part in row.parts.values()]
    nothing = np.zeros(0)
    return csr_array(
        (np.concatenate([nothing, *values]), np.concatenate([nothing.astype(int), *columns]), starts),
        shape=(len(rows), place.v_size),
    )


def _weights(scene: Scene, place: Layout, x: Array, elastic: bool) -> csr_array:
    """W^(1/2) (V, V) with W the inverse mass matrix; zero for coordinates that may not move."""
    blocks, known = [], dict[tuple[int, bytes, tuple[int, ...]], Array]()
    for b, body in enumerate(scene.bodies):
        q, n = x[place.q(b)], place.n[b]
        active = (*place.active(b), *range(6, 6 + n if elastic else 6))
        key = id(body.model), q.tobytes(), active
        if key not in known:
            at = np.ix_(active, active)
            values, vectors = np.linalg.eigh(mass_matrix(kept_integrals(body), q)[at])
            known[key] = np.zeros((6 + n, 6 + n))
            known[key][at] = vectors / np.sqrt(np.maximum(values, 1e-12 * values.max()))
        blocks.append(known[key])
    return csr_array(block_diag(blocks, format="csr"))


def _step(scene: Scene, place: Layout, x: Array, rows: list[Row], target: Array, elastic: bool) -> Array:
    """Smallest step (body axes) with J step = target, in the norm of the mass matrix."""
    if not rows:
        return np.zeros(place.v_size)
    W = _weights(scene, place, x, elastic)
    J = csr_array(stacked(rows, place) @ W)
    return W @ smallest_solution(J, target)


def _independent(scene: Scene, place: Layout, x: Array, rows: list[Row]) -> Array:
    """Numbers of a largest set of independent rows: pivoted QR of the weighted Jacobian, rows scaled to length one."""
    A = csr_array(stacked(rows, place) @ _weights(scene, place, x, elastic=True))
    if independent(A):
        return np.arange(len(rows))
    J = A.toarray()
    length = np.linalg.norm(J, axis=1)
    J = J / np.where(length > 0, length, 1.0)[:, None]
    _, R, pivots = qr(J.T, mode="economic", pivoting=True)
    rank = int((np.abs(np.diag(R)) > RANK_TOLERANCE).sum())
    return np.sort(pivots[:rank])


def _neighbour(
    scene: Scene, place: Layout, blocks: list[Block], x: Array, v: Array, time: float, rows: list[Row]
) -> Array:
    """An assembled position a small free motion away from x (x itself where nothing can move)."""
    W = _weights(scene, place, x, elastic=False)
    _, values, basis = np.linalg.svd((stacked(rows, place) @ W).toarray())
    rank = int((values > 1e-9 * values.max(initial=1.0)).sum())
    direction = W @ (basis[rank:].T @ np.random.default_rng(0).normal(size=basis.shape[0] - rank))
    if not direction.any():
        return x
    try:
        return close_positions(
            scene, place, blocks, _moved(place, x, 1e-3 * direction / np.abs(direction).max()), v, time
        )
    except InputError:
        return x


# ---- small motions ------------------------------------------------------------------------------------------------


def _limited(place: Layout, step: Array) -> Array:
    turn = max(np.linalg.norm(step[place.omega(b)]) for b in range(len(place.n)))
    return step * min(1.0, LARGEST_TURN / turn) if turn > 0 else step


def _to_global(place: Layout, x: Array, step: Array) -> Array:
    out = step.copy()
    for b in range(len(place.n)):
        out[place.R_dot(b)] = rotation_matrix(x[place.p(b)]) @ step[place.R_dot(b)]
    return out


def _moved(place: Layout, x: Array, step: Array) -> Array:
    out, shift = x.copy(), _to_global(place, x, step)
    for b in range(len(place.n)):
        p = x[place.p(b)] + 0.5 * G_bar(x[place.p(b)]).T @ step[place.omega(b)]
        out[place.R(b)] += shift[place.R_dot(b)]
        out[place.p(b)] = p / np.linalg.norm(p)
        out[place.q(b)] += step[place.q_dot(b)]
    return out
