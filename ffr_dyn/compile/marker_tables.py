"""Markers -> the tables that the kernels read: shapes, and of second-order bodies how they change with the deformation."""

from __future__ import annotations

from collections.abc import Hashable

import numpy as np

from ffr_dyn.compile.body_tables import NO_BLOCKS, once, tables_in_blocks
from ffr_dyn.compile.symmetry_blocks import in_blocks
from ffr_dyn.equations.constraint_rows import Block
from ffr_dyn.equations.layout import Layout
from ffr_dyn.equations.second_order import is_second_order, marker_matrices
from ffr_dyn.kernels.tables import LANES, Markers
from ffr_dyn.scene.force_kinds import forces_of, loaded_markers
from ffr_dyn.scene.joints import COINCIDENCE, DISTANCE
from ffr_dyn.scene.scene import Body, Scene, marker_number, markers
from ffr_dyn.variants.families import rounding_of
from ffr_prep.body import remembered
from ffr_prep.common.arrays import Array


def points(scene: Scene) -> Array:
    """`Markers.u`."""
    places = [interface.position for body in scene.bodies for interface in body.model.interfaces]
    return np.array([*places, *scene.ground.values()]).reshape(-1, 3)


def marker_tables(scene: Scene, place: Layout, blocks: tuple[Block, ...], u: Array) -> Markers:
    """Tables of all markers of a scene at points u, with the constraint rows of `blocks`."""
    table, ground = markers(scene), len(scene.bodies)
    interfaces = [i for body in scene.bodies for i in body.model.interfaces]
    bends = [b < ground and is_second_order(scene.bodies[b]) for b, _, _ in table]
    shapes = [np.concatenate([i.phi_t, i.phi_r]) for i in interfaces] + [np.zeros((6, 0))] * len(scene.ground)
    owners: list[Hashable] = [(k if bends[k] else -1, id(i)) for k, i in enumerate(interfaces)]
    phi, start = once(shapes, [*owners, *("ground" for _ in scene.ground)])
    joint = sorted({k for block in blocks for k in block.markers})
    loaded = [marker_number(scene, name) for name in loaded_markers(scene)]
    turning = _turning(scene, blocks)
    rows = [_rows(place.normals[b] if b < ground else -1, k in turning) for k, (b, _, _) in enumerate(table)]

    def make(k: int) -> tuple[Array, Array]:
        b, _, point = table[k]
        return _bending(scene.bodies[b], point, rows[k]) if bends[k] else NO_BLOCKS

    body = [scene.bodies[b].model if b < ground else None for b, _, _ in table]
    bending = tables_in_blocks([(id(body[k]), table[k][2], rows[k]) * bends[k] for k in range(len(table))], make)
    counts = [len(row) for row in rows]
    turns = [int(k in turning) for k in range(len(table))]
    return Markers(
        body=np.array([entry[0] for entry in table], dtype=np.int64),
        u=u,
        phi=phi,
        start=start,
        second=np.array([turns, counts, bending.start, bending.first], dtype=np.int64).T.copy(),
        bending=bending.pool,
        blocks=bending.plans,
        active=np.array(sorted({*joint, *loaded}), dtype=np.int64),
        joint=np.array([k for k in joint if table[k][0] != ground], dtype=np.int64),
    )


def _bending(body: Body, point: str, rows: tuple[int, ...]) -> tuple[Array, Array]:
    """Pool and plan of some rows of a marker of a second-order body; kept with the model."""

    def make() -> tuple[Array, Array]:
        K, kept, at = marker_matrices(body, point), list(rows), body.model.interface(point)
        noise = rounding_of(K, body.model.omega2)[kept]
        pool, plan = in_blocks(-np.moveaxis(K[kept], 1, 0), len(kept), np.moveaxis(noise, 1, 0))
        straight = np.concatenate([at.phi_t, at.phi_r])[kept].ravel()
        return np.concatenate([np.pad(straight, (0, -straight.size % LANES)), pool]), plan

    return remembered(body.model, ("bending", point, rows), make)


def _rows(normal: int, turns: bool) -> tuple[int, ...]:
    """Which of the six rows of a marker are needed: displacement, rotation where it turns; in the plane what keeps to it."""
    if normal < 0:
        return tuple(range(6 if turns else 3))
    in_plane = sorted({0, 1, 2} - {normal})
    return (*in_plane, 3 + normal) if turns else (*in_plane,)


def _turning(scene: Scene, blocks: tuple[Block, ...]) -> set[int]:
    """The markers whose axes are asked for: by rows of joints, and by forces that are no lines between points."""
    points_alone = {COINCIDENCE, DISTANCE}
    found = {k for block in blocks for k in block.markers if any(word.kind not in points_alone for word in block.words)}
    for force in forces_of(scene):
        if force.place.way != "length":
            found |= {marker_number(scene, name) for name in force.place.markers(scene)}
    return found
