"""The kind of surface of a face that is given by points alone: faces of meshes, and free-form faces of geometries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.mesh.geometry.face import Face
from ffr_prep.mesh.geometry.faces import measures, normals_of, oriented_axis, with_side

_STEPS = 8  # of the fit of a cylinder
_FLAT = 0.5  # of the area of a face, what its normals add up to at least where it is a plane
_RADIAL = 0.7  # of the normals of a cylinder, on average, that points away from its axis
_FEWEST = 7  # nodes that make a cylinder of a face, which takes five numbers, or a sphere
_SLACK = 4.0  # times the tolerance, of the size of a face, that nodes may lie off a curved surface


def recognised(face: Face, points: Array, triangles: Array, tolerance: float) -> Face:
    """The face as a plane, a cylinder or a sphere, if all its points lie on one, to a tolerance that is relative to its size.

    points (P, 3) [m]; triangles (T, 3) of the face, which point outside
    """
    centre, area, normal = measures(points, triangles)
    nodes = points[np.unique(triangles)]
    size = float(np.linalg.norm(np.ptp(nodes, axis=0)))
    areas = normals_of(points, triangles)
    closed = np.linalg.norm(areas.sum(axis=0)) < _FLAT * area  # as around a bore, whose normals add up to nothing
    if not closed and np.abs((nodes - centre) @ normal).max() < tolerance * size:
        return replace(face, kind="plane", point=centre, axis=normal)
    if len(nodes) < _FEWEST:
        return face
    near = _SLACK * tolerance * size
    made = _cylinder(face, nodes, points[triangles].mean(axis=1), areas, near) or _sphere(face, nodes, near)
    return face if made is None else with_side(made, points, triangles)


def _cylinder(face: Face, nodes: Array, middles: Array, areas: Array, near: float) -> Face | None:
    """The cylinder on which all nodes lie, to a length [m]; middles, areas (T, 3) of triangles, these along normals.

    Normals of chords lean towards the axis where triangles are coarse, so each axis of their moments is a start for the fit.
    """
    moments, axes = np.linalg.eigh(areas.T @ areas / (areas**2).sum())
    if moments[1] < 1e-3:
        return None
    fits = [_fitted_axis(nodes - face.centre, axis) for axis in axes.T]
    axis, middle, radius, _ = min(fits, key=lambda fit: fit[3])
    arms = middles - face.centre - middle
    arms -= np.outer(arms @ axis, axis)
    radial = np.abs((areas * arms).sum(axis=1) / np.maximum(np.linalg.norm(arms, axis=1), np.finfo(float).tiny)).sum()
    off = min(fit[3] for fit in fits)
    if (
        off > near
        or radius > 100 * np.ptp(nodes, axis=0).max()
        or radial < _RADIAL * np.linalg.norm(areas, axis=1).sum()
    ):
        return None
    return replace(face, kind="cylinder", point=face.centre + middle, axis=oriented_axis(axis), radius=radius)


def _fitted_axis(places: Array, axis: Array) -> tuple[Array, Array, float, float]:
    """Axis, middle, radius of the cylinder nearest to places (m, 3), from a first axis, and how far the worst is off.

    Gauss and Newton's method: the axis is turned by what the distances from it grow along it.
    """
    middle, radius, off = _about(axis, places)
    best = axis, middle, radius, off
    for _ in range(_STEPS):
        if off <= 1e-9 * radius:
            break
        arms = places - middle
        arms -= np.outer(arms @ axis, axis)
        out = arms / np.maximum(np.linalg.norm(arms, axis=1), np.finfo(float).tiny)[:, None]
        across = np.linalg.svd(axis[None])[2][1:]
        J = np.hstack([-(places @ axis)[:, None] * (out @ across.T), -out @ across.T, -np.ones((len(places), 1))])
        step = np.linalg.lstsq(J, radius - np.linalg.norm(arms, axis=1), rcond=None)[0]
        axis = axis + step[:2] @ across
        axis = axis / np.linalg.norm(axis)
        middle, radius, off = _about(axis, places)
        if off < best[3]:
            best = axis, middle, radius, off
    return best


def _about(axis: Array, places: Array) -> tuple[Array, float, float]:
    """`_circle` seen along an axis; its centre (3,)."""
    across = np.linalg.svd(axis[None])[2][1:]
    middle, radius, off = _circle(places @ across.T)
    return middle @ across, radius, off


def _sphere(face: Face, nodes: Array, near: float) -> Face | None:
    middle, radius, off = _circle(nodes - face.centre)
    if not 0 < radius < 100 * np.ptp(nodes, axis=0).max() or off > near:
        return None
    return replace(face, kind="sphere", point=face.centre + middle, radius=radius)


def _circle(places: Array) -> tuple[Array, float, float]:
    """Centre and radius of the circle or sphere that fits places (m, d) best, and the largest distance from it."""
    A = np.hstack([2 * places, np.ones((len(places), 1))])
    solved = np.linalg.lstsq(A, (places**2).sum(axis=1), rcond=None)[0]
    radius = float(np.sqrt(max(solved[-1] + solved[:-1] @ solved[:-1], 0.0)))
    off = np.abs(np.linalg.norm(places - solved[:-1], axis=1) - radius).max()
    return solved[:-1], radius, float(off)
