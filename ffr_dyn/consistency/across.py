"""Which rows of a planar scene act across its plane alone, and whether these hold every body in it.

Scenes of a study, and the runs of one scene, ask that again and again of the same joints and the same shapes. So what was
found is kept by all that it was found from: places, motions and shapes of the bodies, what joints and drivers say, and the
values that drivers prescribe. How fast these change is not in it: a row that a function of time drives across the plane is
refused however fast, and no other row knows of it.
"""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np
from scipy.sparse import csr_array, lil_array

from ffr_dyn.closing.constraints import Constraints, constraints_of, rows_at
from ffr_dyn.closing.row_space import Matrix, independent
from ffr_dyn.compile.structure import Recent
from ffr_dyn.equations.constraint_rows import Block, drive_at
from ffr_dyn.equations.layout import Layout, initial_state, moved, to_global_axes, velocity_sizes
from ffr_dyn.functions.time_functions import POLYNOMIAL, TimeFunction
from ffr_dyn.scene.joints import Word
from ffr_dyn.scene.scene import Body, Scene, body_normal, used_interfaces
from ffr_dyn.variants.aligned import height_of
from ffr_dyn.variants.plane import AXES
from ffr_prep.common.arrays import Array

ASKED = 1e-6  # of a row across the plane at random speeds of about one; modes carry rounding of 1e-9
ACROSS = 1e-8  # of the largest entry of a row, what counts as zero
MOST = 256  # scenes that are remembered; then all are forgotten

Found = tuple[Array, str]

_KNOWN = Recent[Found](MOST)


def rows_across(scene: Scene, blocks: list[Block], time: float) -> Found:
    """(C,) which rows of a planar scene act across the plane only; and, in words, what of them does not hold every body in it
    or asks for motion, now or later, or which others do not act in the plane only; "" where there is nothing.

    Looked at in the position and with the motion that the scene declares, and at random in the plane around it.
    """
    key = _heights(scene), _key(scene, blocks, time)
    found = _KNOWN.find(key, scene)
    if found is None:
        found = _looked_at(constraints_of(scene, blocks, time))
        found[0].setflags(write=False)
        _KNOWN.keep(key, scene, found)
    return found


def _key(scene: Scene, blocks: list[Block], time: float) -> Hashable:
    """All that `_looked_at` looks at; flexible models by identity, which only holds while they live."""
    bodies = tuple(_said_of(body) for body in scene.bodies)
    rows = tuple(
        (block.name, block.markers, block.driver, *(_said_by(block, word, time) for word in block.words))
        for block in blocks
    )
    return scene.plane, bodies, b"".join(point.tobytes() for point in scene.ground.values()), rows


def _said_of(body: Body) -> Hashable:
    """Shapes and state of a body; of a rigid one its points are all of its shape."""
    model = body.model
    shape = id(model) if model.n else b"".join(point.position.tobytes() for point in model.interfaces)
    state = body.position, body.rotation, body.velocity, body.omega_bar, body.q, body.q_dot
    return shape, len(model.interfaces), model.n, body.stiffening, b"".join(part.tobytes() for part in state)


def _said_by(block: Block, word: Word, time: float) -> Hashable:
    value, changes = (
        (0.0, False) if word.function is None else (drive_at(block, word, time)[0], _changes(word.function))
    )
    return word.kind, word.axes.tobytes(), word.relation, word.spacing, value, changes


def _heights(scene: Scene) -> tuple[float, ...]:
    """[m] along the normal, in its own axes, of the plane in which each body moves above the origin of its frame."""
    normal = AXES.index(scene.plane)
    return tuple(
        height_of(body.model, body_normal(body, normal), used_interfaces(scene, body)) for body in scene.bodies
    )


def _turned_about(place: Layout, heights: tuple[float, ...]) -> csr_array:
    """(V, V) velocities from those that turn every body about axes in its own plane, in place of axes through its origin."""
    T = lil_array((place.v_size, place.v_size))
    T.setdiag(1.0)
    for first, k, height in zip(place.iv, place.normals, heights, strict=True):
        for c in (c for c in range(3) if height and c != k):
            T[first : first + 3, first + 3 + c] = height * np.cross(np.eye(3)[k], np.eye(3)[c])
    return T.tocsr()


def _looked_at(constraints: Constraints) -> Found:
    scene, place, rng = constraints.scene, constraints.place, np.random.default_rng(0)
    start, v = initial_state(scene, place)
    active, sizes = np.zeros(place.v_size, bool), velocity_sizes(scene, place)
    for b, n in enumerate(place.n):
        active[[place.iv[b] + c for c in (*place.active(b), *range(6, 6 + n))]] = True
    inside, outside, left, jacobians = [], [], [], []
    turned = _turned_about(place, _heights(scene))
    for scale in (0.0, 1e-2, 1e-2):
        step = np.where(active, scale * sizes * rng.normal(size=place.v_size), 0.0)
        x, speeds = moved(place, start, step), v + to_global_axes(place, start, 100 * step)
        rows = rows_at(constraints, x, speeds)
        jacobians.append((rows.J @ turned)[:, ~active])
        inside.append(_largest(rows.J[:, active]))
        outside.append(_largest(jacobians[-1]))
        left.append(np.abs([rows.Phi, rows.nu, rows.gamma]).max(axis=0))
    most_inside, most_outside, most_left = (np.array(part).max(axis=0) for part in (inside, outside, left))
    across = most_inside <= ACROSS * most_outside
    mixed = ~across & (most_outside > ACROSS * most_inside)
    blocks = constraints.blocks
    moving = np.array([_changes(word.function) for block in blocks for word in block.words], bool)
    asked = across & ((most_left >= ASKED) | moving)
    names = [block.name for block in blocks for _ in block.words]
    for wrong, what in ((mixed, "acts both in the plane and across it"), (asked, "asks for motion across it")):
        if wrong.any():
            return across, f"{names[int(np.argmax(wrong))]!r} {what}"
    if lost := _driver_lost(blocks, across):
        return across, f"driver {lost!r} acts across it alone"
    if not all(_columns_independent(J[across]) for J in jacobians):
        return across, "its joints leave a body free to move across it"
    return across, ""


def _driver_lost(blocks: tuple[Block, ...], across: Array) -> str:
    """A driver all rows of which act across the plane: in the plane it would have no effort; empty where there is none."""
    numbers = iter(across.tolist())
    acts = [[next(numbers) for _ in block.words] for block in blocks]
    return next((block.name for block, rows in zip(blocks, acts, strict=True) if block.driver and all(rows)), "")


def _largest(J: Matrix) -> Array:
    """(C,) the largest entry of each row."""
    if isinstance(J, np.ndarray):
        return np.abs(J).max(axis=1, initial=0.0)
    return abs(J).max(axis=1).toarray().ravel() if J.shape[1] else np.zeros(J.shape[0])


def _columns_independent(A: Matrix) -> bool:
    """Whether no combination of the columns vanishes. Rows have more of their own than columns, which a chain adds up."""
    if independent(A):
        return A.shape[0] == A.shape[1]
    if isinstance(A, np.ndarray):
        return int(np.linalg.matrix_rank(A)) == A.shape[1]
    return independent(csr_array(A.T)) or int(np.linalg.matrix_rank(A.toarray())) == A.shape[1]


def _changes(function: TimeFunction | None) -> bool:
    """Whether a function of time is more than a constant."""
    return function is not None and (function.kind != POLYNOMIAL or any(function.data[1:]))
