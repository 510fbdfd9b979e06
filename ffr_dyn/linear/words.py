"""What moves in a mode, in words: "rod: first bending, y", "main_bearing.angle"."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ffr_dyn.consistency.mobility import named_motion
from ffr_dyn.equations.layout import Layout
from ffr_dyn.scene.parts import owner
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.common.arrays import Array

ELASTIC = 0.2  # of a mode's energy is strain from where it is named by the shape of a body
SLENDER = 2.5  # longest extent over the next, from where a body bends like a beam
ALONG = 0.9  # of what moves, from where it has a direction
ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")


def in_words(
    scene: Scene, place: Layout, x: Array, M: Array, modes: Array, seen: Array, whirling: Sequence[str]
) -> tuple[str, ...]:
    """A name for each mode (V, m).

    Elastic ones have the body that is strained most, what it does, and where; they are counted, by their frequencies, among
    those that do the same.

    seen     : (m,) [rad/s] frequencies, of a whirl that from the ground
    whirling : "forward" or "backward" of each mode; "" where it is no whirl
    """
    whats = []
    for mode, rate, way in zip(modes.T, seen, whirling, strict=True):
        what = _elastic(scene, place, M, rate, mode)
        whats.append(what and (what[0], what[1], f", {way}" if way and what[1] == "bending" else what[2]))
    found, counts, last = [""] * len(whats), Counter[tuple[str, ...]](), dict[tuple[str, ...], float]()
    for k in np.argsort(seen, kind="stable"):
        what, mode = whats[k], modes[:, k]
        if what is None:
            at = mode[int(np.argmax(np.abs(mode)))]
            found[k] = named_motion(scene, place, x, (mode * np.conj(at)).real)
            continue
        counts[what] += not np.isclose(last.get(what, -1.0), seen[k], rtol=1e-6, atol=0.0)
        last[what] = seen[k]
        found[k] = f"{what[0]}: {_ordinal(counts[what])} {what[1]}{what[2]}"
    return tuple(found)


def _ordinal(count: int) -> str:
    return ORDINALS[count - 1] if count <= len(ORDINALS) else f"{count}th"


def _elastic(scene: Scene, place: Layout, M: Array, rate: float, mode: Array) -> tuple[str, str, str] | None:
    """(body, what it does, ", " and the direction) of a mode that strains a body; None of one that moves bodies."""
    strain = [b.model.omega2 @ np.abs(mode[place.q_dot(k)]) ** 2 for k, b in enumerate(scene.bodies)]
    moving = rate**2 * float((mode.conj() @ M @ mode).real)
    if not sum(strain) > ELASTIC * moving or moving == 0:
        return None
    k = int(np.argmax(strain))
    q = mode[place.q_dot(k)]
    return (owner(scene.bodies[k]), *_shape(scene.bodies[k], q * np.conj(q[int(np.argmax(np.abs(q)))])))


def _shape(body: Body, q: Array) -> tuple[str, str]:
    """What a body does in the deflections q (n,), complex."""
    points, u = _field(body, q)
    centred = points - points.mean(axis=0)
    sizes, axes = np.linalg.eigh(centred.T @ centred)
    if not sizes[2] > SLENDER**2 * max(sizes[1], 0.0) or len(points) < 2:
        return "elastic mode", ""
    e = axes[:, 2]
    s, across = centred @ e, centred - np.outer(centred @ e, e)
    turning, lateral, axial = 0.0, np.zeros((3, 3)), 0.0
    for part in _slices(s):
        mean, r = u[part].mean(axis=0), across[part] - across[part].mean(axis=0)
        inertia = float((r**2).sum())
        twist = np.cross(r, u[part] - mean).sum(axis=0) @ e / inertia if inertia > 1e-12 * sizes[2] else 0.0
        turning += abs(twist) ** 2 * float(sizes[0] + sizes[1]) / len(points)
        flat = mean - e * (mean @ e)
        lateral += np.outer(flat, flat.conj()).real
        axial += abs(mean @ e) ** 2
    bending = float(np.trace(lateral))
    if bending < max(axial, turning):
        return ("torsion", "") if turning > axial else ("stretching", "")
    return "bending", _direction(lateral)


def _field(body: Body, q: Array) -> tuple[Array, Array]:
    """Points (P, 3) of a body and their displacements, complex; where nothing is drawn, its interfaces'."""
    surface = body.model.surface
    if surface is not None and surface.Phi.shape[2] == q.size:
        return surface.points, surface.Phi @ q
    interfaces = body.model.interfaces
    return np.array([i.position for i in interfaces]), np.array([i.phi_t @ q for i in interfaces])


def _slices(s: Array) -> Sequence[Array]:
    """Numbers of points that lie together along a body."""
    edges = np.linspace(s.min(), s.max(), 13)
    where = np.clip(np.searchsorted(edges, s, side="right") - 1, 0, 11)
    return [found for k in range(12) if (found := np.flatnonzero(where == k)).size]


def _direction(lateral: Array) -> str:
    """The axis of the body along which most of a lateral motion goes; none of a whirl, which has no single one."""
    sizes, axes = np.linalg.eigh(lateral)
    if sizes[2] < ALONG * sizes.sum():
        return ""
    k = int(np.argmax(np.abs(axes[:, 2])))
    return f", {'xyz'[k]}" if abs(axes[k, 2]) > 0.94 else ", oblique"
