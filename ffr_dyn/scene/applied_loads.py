"""The applied loads of a scene, in the order of the tables and of what is recorded of them."""

from __future__ import annotations

import numpy as np

from ffr_dyn.scene.forces import (
    Bushing,
    Load,
    SpringDamper,
)
from ffr_dyn.scene.joint_forces import JointForce
from ffr_dyn.scene.joints import Joint, frames
from ffr_dyn.scene.scene import Scene, joint_under, marker_number
from ffr_dyn.scene.surface_loads import SurfaceLoad

Array = np.ndarray


Action = SpringDamper | JointForce


AppliedLoad = Load | Action | Bushing | SurfaceLoad


def markers_under(scene: Scene, load: AppliedLoad) -> tuple[int, ...]:
    """The markers on which an applied load acts: one, two, or none where it is spread over a surface."""
    if isinstance(load, Load):
        return (marker_number(scene, load.marker),)
    if isinstance(load, SurfaceLoad):
        return ()
    of: SpringDamper | Bushing | Joint = joint_under(scene, load) if isinstance(load, JointForce) else load
    return marker_number(scene, of.i), marker_number(scene, of.j)


def marker_numbers(scene: Scene) -> list[int]:
    """The markers on which applied loads act, in any order."""
    return [number for load in loads_of(scene) for number in markers_under(scene, load)]


def actions_of(scene: Scene) -> list[Action]:
    """All forces on coordinates in the order of the tables: spring-dampers, then those on joints."""
    return [*scene.springs, *(force for force in scene.forces if isinstance(force, JointForce))]


def bushings_of(scene: Scene) -> list[Bushing]:
    """All bushings in the order of the tables."""
    return [force for force in scene.forces if isinstance(force, Bushing)]


def spread_of(scene: Scene) -> list[SurfaceLoad]:
    """All surface loads in the order of the tables."""
    return [force for force in scene.forces if isinstance(force, SurfaceLoad)]


def loads_of(scene: Scene) -> list[AppliedLoad]:
    """All applied loads in the order in which their powers are recorded."""
    return [*scene.loads, *actions_of(scene), *bushings_of(scene), *spread_of(scene)]


def coordinate_ends(scene: Scene, action: Action) -> tuple[int, int]:
    """Numbers of the markers i and j between which the coordinate of a force is."""
    i, j = markers_under(scene, action)
    return i, j


def coordinate_axes(scene: Scene, action: Action) -> Array:
    """(3, 3) f_i, g_i, f_j of an angle, or h_i of a stroke, in body axes."""
    axes = np.zeros((3, 3))
    if not isinstance(action, SpringDamper):
        i, j = frames(joint_under(scene, action))
        if action.coordinate == "angle":
            axes[:] = i[:, 0], i[:, 1], j[:, 0]
        else:
            axes[0] = i[:, 2]
    return axes
