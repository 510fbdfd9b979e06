"""The kind of surface of a face that is given by points alone: faces of meshes, and free-form faces of geometries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.mesh.geometry.face import Face
from ffr_prep.mesh.geometry.faces import measures, normals_of, oriented_axis, with_side

_TILT, _STEPS = 0.05, 8  # of normals of chords towards the axis of a cylinder, squared; of the fit


def recognised(face: Face, points: Array, triangles: Array, tolerance: float) -> Face:
    """The face as a plane, a cylinder or a sphere, if all its points lie on one, to a tolerance that is relative to its size.

    points (P, 3) [m]; triangles (T, 3) of the face, which point outside
    """
    centre, _, normal = measures(points, triangles)
    nodes = points[np.unique(triangles)]
    size = float(np.linalg.norm(np.ptp(nodes, axis=0)))
    if np.abs((nodes - centre) @ normal).max() < tolerance * size:
        return replace(face, kind="plane", point=centre, axis=normal)
    areas = normals_of(points, triangles)
    unit = areas / np.maximum(np.linalg.norm(areas, axis=1), np.finfo(float).tiny)[:, None]
    made = _cylinder(face, nodes, unit, tolerance) or _sphere(face, nodes, tolerance)
    return face if made is None else with_side(made, points, triangles)


def _cylinder(face: Face, nodes: Array, unit: Array, tolerance: float) -> Face | None:
    """The cylinder whose axis the normals are nearly perpendicular to and on which all nodes lie."""
    moments, axes = np.linalg.eigh(unit.T @ unit / len(unit))
    if moments[0] > _TILT or moments[1] < 1e-3:
        return None
    axis, places = axes[:, 0], nodes - face.centre
    middle, radius, off = _about(axis, places)
    for _ in range(_STEPS):  # of Gauss and Newton: the axis is turned by what the distances from it grow along it
        if off <= 1e-9 * radius:
            break
        arms = places - middle
        arms -= np.outer(arms @ axis, axis)
        out = arms / np.linalg.norm(arms, axis=1)[:, None]
        across = np.linalg.svd(axis[None])[2][1:]
        J = np.hstack([-(places @ axis)[:, None] * (out @ across.T), -out @ across.T, -np.ones((len(places), 1))])
        step = np.linalg.lstsq(J, radius - np.linalg.norm(arms, axis=1), rcond=None)[0]
        axis = axis + step[:2] @ across
        axis /= np.linalg.norm(axis)
        middle, radius, off = _about(axis, places)
    if off > 10 * tolerance * radius or radius > 100 * np.ptp(places, axis=0).max():
        return None
    return replace(face, kind="cylinder", point=face.centre + middle, axis=oriented_axis(axis), radius=radius)


def _about(axis: Array, places: Array) -> tuple[Array, float, float]:
    """`_circle` seen along an axis; its centre (3,)."""
    across = np.linalg.svd(axis[None])[2][1:]
    middle, radius, off = _circle(places @ across.T)
    return middle @ across, radius, off


def _sphere(face: Face, nodes: Array, tolerance: float) -> Face | None:
    middle, radius, off = _circle(nodes - face.centre)
    if not 0 < radius < 100 * np.ptp(nodes, axis=0).max() or off > 10 * tolerance * radius:
        return None
    return replace(face, kind="sphere", point=face.centre + middle, radius=radius)


def _circle(places: Array) -> tuple[Array, float, float]:
    """Centre and radius of the circle or sphere that fits places (m, d) best, and the largest distance from it."""
    A = np.hstack([2 * places, np.ones((len(places), 1))])
    solved = np.linalg.lstsq(A, (places**2).sum(axis=1), rcond=None)[0]
    radius = float(np.sqrt(max(solved[-1] + solved[:-1] @ solved[:-1], 0.0)))
    off = np.abs(np.linalg.norm(places - solved[:-1], axis=1) - radius).max()
    return solved[:-1], radius, float(off)
