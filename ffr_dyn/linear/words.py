"""Names of modes by the parts that move: "rod: first bending, y", "main_bearing.angle"."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ffr_dyn.consistency.mobility import named_motions
from ffr_dyn.equations.layout import Layout
from ffr_dyn.scene.parts import owner
from ffr_dyn.scene.scene import Scene
from ffr_prep.body import FlexibleBody, remembered
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
    whats, energies = [], seen**2 * np.sum(modes.conj() * (M @ modes), axis=0).real
    for mode, energy, way in zip(modes.T, energies, whirling, strict=True):
        what = _elastic(scene, place, energy, mode)
        whats.append(what and (what[0], what[1], f", {way}" if way and what[1] == "bending" else what[2]))
    found, counts, last = [""] * len(whats), Counter[tuple[str, ...]](), dict[tuple[str, ...], float]()
    moving = [k for k, what in enumerate(whats) if what is None]
    for k, name in zip(moving, named_motions(scene, place, x, _turned_real(modes[:, moving])), strict=True):
        found[k] = f"{name}, {whirling[k]}" if whirling[k] else name
    for k in np.argsort(seen, kind="stable"):
        what = whats[k]
        if what is None:
            continue
        counts[what] += not np.isclose(last.get(what, -1.0), seen[k], rtol=1e-6, atol=0.0)
        last[what] = seen[k]
        found[k] = f"{what[0]}: {_ordinal(counts[what])} {what[1]}{what[2]}"
    return tuple(found)


def _turned_real(modes: Array) -> Array:
    """(V, m) modes at the moment at which their largest component is largest."""
    largest = np.take_along_axis(modes, np.argmax(np.abs(modes), axis=0)[None], axis=0)
    return np.asarray((modes * np.conj(largest)).real)


def _ordinal(count: int) -> str:
    return ORDINALS[count - 1] if count <= len(ORDINALS) else f"{count}th"


def _elastic(scene: Scene, place: Layout, energy: float, mode: Array) -> tuple[str, str, str] | None:
    """(body, what it does, ", " and the direction) of a mode that strains a body; None of one that moves bodies.

    energy : [J] twice that of its motion
    """
    strain = [b.model.omega2 @ np.abs(mode[place.q_dot(k)]) ** 2 for k, b in enumerate(scene.bodies)]
    if not sum(strain) > ELASTIC * energy or energy == 0:
        return None
    k = int(np.argmax(strain))
    model = scene.bodies[k].model
    along = remembered(model, "sections", lambda: _sections(model))
    return (owner(scene.bodies[k]), *(_shape(along, mode[place.q_dot(k)]) if along else ("elastic mode", "")))


@dataclass(frozen=True)
class _Sections:
    """Sections along a slender body: its direction e (3,); by elastic coordinates their displacements (s, 3, n), and
    their turning about e (s, n), at the radius that counts as displacement."""

    e: Array
    displacements: Array
    turnings: Array


def _sections(model: FlexibleBody) -> _Sections | None:
    """None of a body that is not slender."""
    points, Phi = _field(model)
    if len(points) < 2:
        return None
    centred = points - points.mean(axis=0)
    sizes, axes = np.linalg.eigh(centred.T @ centred)
    if not sizes[2] > SLENDER**2 * max(sizes[1], 0.0):
        return None
    e, radius = axes[:, 2], np.sqrt(float(sizes[0] + sizes[1]) / len(points))
    s, across = centred @ e, centred - np.outer(centred @ e, e)
    means, turnings = [], []
    for part in _slices(s):
        r = across[part] - across[part].mean(axis=0)
        inertia = float((r**2).sum())
        share = radius / inertia if inertia > 1e-12 * sizes[2] else 0.0
        means.append(Phi[part].mean(axis=0))
        turnings.append(share * np.tensordot(np.cross(e, r), Phi[part], 2))
    return _Sections(e, np.array(means), np.array(turnings))


def _shape(of: _Sections, q: Array) -> tuple[str, str]:
    """The kind of deformation of a slender body in the deflections q (n,), complex."""
    u = of.displacements @ q
    flat = u - np.outer(u @ of.e, of.e)
    lateral = (flat.T @ flat.conj()).real
    bending, axial, turning = np.trace(lateral), (np.abs(u @ of.e) ** 2).sum(), (np.abs(of.turnings @ q) ** 2).sum()
    if bending < max(axial, turning):
        return ("torsion", "") if turning > axial else ("stretching", "")
    return "bending", _direction(lateral)


def _field(model: FlexibleBody) -> tuple[Array, Array]:
    """Points (P, 3) of a body and their displacements (P, 3, n); where nothing is drawn, its interfaces'."""
    surface = model.surface
    if surface is not None and surface.Phi.shape[2] == model.n:
        return surface.points, surface.Phi
    found = model.interfaces
    points, shapes = [i.position for i in found], [i.phi_t for i in found]
    return np.reshape(points, (-1, 3)), np.reshape(shapes, (-1, 3, model.n))


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
