"""Whether the modes of a body vibrate as its joints let it: its lowest frequency with the joints held, and what it should be;
and up to where they are enough of them, by the error that the reduction has found of its frequencies.

Both are of the body alone, all others at rest, undeformed. What it should be comes from the small body that a reduction keeps
beside a basis that does not hold the static shapes of its interfaces (`ffr_prep.reduction.held_body`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from scipy.linalg import eigh, null_space

from ffr_dyn.equations.constraint_rows import Block, blocks_of, rows_at
from ffr_dyn.equations.inertia import mass_matrix
from ffr_dyn.equations.layout import initial_state, layout
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.scene import Body, Scene, joints_of
from ffr_prep.body import CONVERTED_FROM, MESH_ERROR, TRUNCATION_ERROR, FlexibleBody, Interface, errors_of_modes
from ffr_prep.common.arrays import Array
from ffr_prep.common.in_words import percent_in_words, settings_in_words

HELD = "held_body"  # of the provenance
APART = 0.03  # relative difference of frequencies, beyond which it is told
STILL = 1e-6  # of a squared frequency, relative to the lowest of the body, below which a motion is rigid
MOST = 3  # bodies that are named
CAUSES = {MESH_ERROR: "by its mesh", TRUNCATION_ERROR: "for want of shapes"}
REMEDIES = {MESH_ERROR: "take smaller elements", TRUNCATION_ERROR: "keep more modes"}
AXES = "xyz"


def held_frequencies(scene: Scene, poses: Iterable[tuple[Array, Array]], plane: str, time: float) -> list[str]:
    """Notes on bodies whose modes do not fit the joints of a scene.

    poses : assembled positions and Euler parameters of the bodies;  plane : normal of a scene that is planar, or "none"
    """
    if not any(HELD in body.model.provenance and body.model.n for body in scene.bodies):
        return []
    placed = [
        replace(body, position=R, rotation=p, q=None, q_dot=None)
        for body, (R, p) in zip(scene.bodies, poses, strict=True)
    ]
    scene, notes = replace(scene, bodies=tuple(placed), plane="none"), []
    for b, body in enumerate(scene.bodies):
        if not body.model.n:  # one that is taken as undeformed
            continue
        blocks = [block for block in blocks_of(scene) if _touches(scene, block, body)]
        reference = _reference(scene, body, blocks)
        if reference is not None:
            has, should = (_lowest(scene, b, model, blocks, plane, time) for model in (body.model, reference))
            if abs(has - should) > APART * should:
                notes.append(_told(body, [block.name for block in blocks], has, should))
    return notes


def beyond_modes(scene: Scene, highest: float) -> list[str]:
    """A note on bodies whose vibrations are too fast by more than APART somewhere up to a frequency [Hz], by the shapes that
    their reduction has left out or by the size of their elements."""
    found = sorted(one for body in scene.bodies if body.model.n for one in _too_fast(body) if one[0] <= highest)
    if not found:
        return []
    more = f", and modes of {len(found) - MOST} other bodies" if len(found) > MOST else ""
    remedies = " and ".join(dict.fromkeys(REMEDIES[cause] for _, cause, _ in found))
    return [
        f"from about {found[0][0]:.4g} Hz on vibrations are too fast: under their reference conditions "
        f"{', '.join(text for *_, text in found[:MOST])}{more}; {remedies}"
    ]


def _too_fast(body: Body) -> list[tuple[float, str, str]]:
    """Of the first mode that is known to be: the frequency that it should have [Hz], what it is by, and both in words."""
    provenance = body.model.provenance
    of_mesh, of_shapes = (errors_of_modes(provenance, kind) for kind in (MESH_ERROR, TRUNCATION_ERROR))
    for k in sorted({*of_mesh, *of_shapes}) if CONVERTED_FROM not in provenance else ():
        mesh, shapes = of_mesh.get(k, 0.0), of_shapes.get(k, 0.0)
        error, has = (1 + mesh) * (1 + shapes) - 1, float(body.model.frequencies[k - 1])
        if error > APART:
            cause = MESH_ERROR if mesh > shapes else TRUNCATION_ERROR
            words = f"mode {k} of {body.name!r}, of {has:.4g} Hz, by {percent_in_words(error)} {CAUSES[cause]}"
            return [(has / (1 + error), cause, words)]
    return []


def in_a_band(scene: Scene, highest: float) -> list[str]:
    """As `beyond_modes`, and a note on bodies that have no vibrations at all as fast as a band goes [Hz]."""
    few = sorted((float(b.model.frequencies.max()), b.name) for b in scene.bodies if b.model.n)
    few = [one for one in few if one[0] < highest]
    found = beyond_modes(scene, highest)
    if found or not few:
        return found
    named = ", ".join(f"those of {name!r} above {top:.4g} Hz" for top, name in few[:MOST])
    more = f", and those of {len(few) - MOST} other bodies" if len(few) > MOST else ""
    return [f"vibrations that no mode has are missing, {named}{more}; keep more modes"]


def _told(body: Body, joints: list[str], has: float, should: float) -> str:
    conditions = settings_in_words(body.model.provenance.get("reference", "its own"))
    found = f"vibrates at {has:.4g} Hz" if has < np.inf else "cannot vibrate"
    return (
        f"body {body.name!r}: held by {', '.join(joints)} it {found}, and should at {should:.4g} Hz: its modes "
        f"belong to other conditions ({conditions}); reduce it with craig-bampton, or with reference conditions that its "
        "joints keep (simply-supported for two hinges)"
    )


def _touches(scene: Scene, block: Block, body: Body) -> bool:
    return any(name.partition(".")[0] == body.name for name in _markers(scene, block))


def _markers(scene: Scene, block: Block) -> list[str]:
    """Names of the markers of a joint, a driver or a coupling."""
    owners: dict[str, tuple[str, ...]] = {joint.name: (joint.i, joint.j) for joint in scene.joints}
    owners |= {
        c.name: tuple(end for joint in joints_of(scene, c) for end in (joint.i, joint.j)) for c in scene.couplings
    }
    owners |= {d.name: owners[d.joint] if isinstance(d, Driver) else (d.i, d.j) for d in scene.drivers}
    return list(owners[block.name])


def _reference(scene: Scene, body: Body, blocks: list[Block]) -> FlexibleBody | None:
    """The small body; None where none was kept, nothing holds it, or something does at a point that it does not know."""
    kept = body.model.provenance.get(HELD)
    if kept is None or not blocks:
        return None
    known = {f"{body.name}.{name}" for name in kept["interfaces"]}
    own = {name for block in blocks for name in _markers(scene, block) if name.partition(".")[0] == body.name}
    positions = {interface.name: interface.position for interface in body.model.interfaces}
    if not own <= known:
        return None
    omega2, shapes, inertia = (np.array(kept[key], float) for key in ("omega2", "shapes", "inertia"))
    pairs = np.zeros((3, *inertia.shape))
    pairs[range(3), range(3)] = inertia
    return replace(
        body.model,
        P_dm=np.zeros((3, omega2.size)), rP_dm=np.zeros((3, 3, omega2.size)), PP_dm=pairs, omega2=omega2,
        interfaces=tuple(
            Interface(name, positions[name], six[:3], six[3:])
            for name, six in zip(kept["interfaces"], shapes, strict=True)
            if name in positions
        ),
        surface=None, stiffening=None, damping=None, provenance={},
    )  # fmt: skip


def _lowest(scene: Scene, b: int, model: FlexibleBody, blocks: list[Block], plane: str, time: float) -> float:
    """The lowest frequency [Hz] of body b with a model, all others at rest; of motions in the plane, if there is one."""
    body = replace(scene.bodies[b], model=model, q=None, q_dot=None, damping=0.0, dropped=(), kept=None)
    bodies = (*scene.bodies[:b], body, *scene.bodies[b + 1 :])
    scene = replace(scene, bodies=bodies, forces=(), loads=(), springs=(), measurements=())
    place = layout(scene)
    own = slice(place.iv[b], place.iv[b] + 6 + model.n)
    rows = np.array([row.jacobian[own] for row in rows_at(scene, place, blocks, *initial_state(scene, place), time)])
    free = null_space(rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300), rcond=1e-9)
    M, elastic = mass_matrix(model, np.zeros(model.n)), free[6:]
    squares, shapes = eigh(elastic.T @ (model.omega2[:, None] * elastic), free.T @ M @ free)
    moved = elastic @ shapes
    kept = squares > STILL * model.omega2.min()
    if plane != "none":
        k = AXES.index(plane)
        across = np.einsum("im,ij,jm->m", moved, model.PP_dm[k, k], moved)
        kept &= across < 0.5 * np.einsum("im,im->m", moved, moved)
    return float(np.sqrt(squares[kept].min(initial=np.inf)) / (2 * np.pi))
