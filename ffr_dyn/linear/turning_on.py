"""What turns on by itself: bodies that move in their screws and that no driver holds.

To move such bodies further along their screws changes nothing, wherever forces are those of bodies that turn together or do
not depend on the angle. So that motion has no stiffness; its forces only speed it up or slow it down, and a steady motion
has none.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import connected_components

from ffr_dyn.compile.scene_tables import System
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.scene import Scene, markers
from ffr_prep.common.arrays import Array

FREE = 1e-7  # of rows, relative to the motion
STILL = 1e-9  # of velocities, relative to the largest


def turning_on(system: System, jacobian: Array, V: Array, sizes: Array, together: bool) -> Array:
    """(V, g) of g groups of connected bodies their velocities, of the largest size one, where the rows leave them free.

    jacobian : (C, V);  V : (V,) velocities of all bodies, body axes;  sizes : (V,) that count as one
    together : whether forces depend on the angles, so that only all bodies at once turn on without a change
    """
    place, largest = system.layout, float(np.abs(V / sizes).max(initial=0.0))
    slices = [slice(place.iv[b], place.iv[b] + 6 + place.n[b]) for b in range(len(place.n))]
    rows, found = np.array([np.abs(jacobian[:, one]).any(axis=1) for one in slices]), []
    groups = np.zeros(len(slices)) if together else _groups(system.scene, rows)
    for group in np.unique(groups):
        motion = np.zeros_like(V)
        for b in np.flatnonzero(groups == group):
            motion[slices[b]] = V[slices[b]]
        size = float(np.abs(motion / sizes).max())
        if size > STILL * largest and np.abs(jacobian @ motion).max(initial=0.0) <= FREE * size:
            found.append(motion / size)
    return np.array(found).reshape(-1, V.size).T


def _groups(scene: Scene, rows: Array) -> Array:
    """(B,) numbers of what joints, drivers and forces connect; `rows` (B, C) are those of each body. The ground connects
    nothing."""
    graph = (rows[:, None] & rows[None]).any(axis=2)
    for force in forces_of(scene):
        ends = force.place.ends(scene)
        i, j = (markers(scene)[number][0] for number in ends) if min(ends) >= 0 else (-1, -1)
        if min(i, j) >= 0 and max(i, j) < len(graph):
            graph[i, j] = True
    found: Array = connected_components(graph, directed=False)[1]
    return found
