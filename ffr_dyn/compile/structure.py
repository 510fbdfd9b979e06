"""What scenes of one structure have in common, and how it is remembered.

A structure is all of a scene that is a word or an integer: names, kinds, markers, how many coordinates bodies have and which
of them keep to a plane, how many numbers forces and functions of time have; and the flexible bodies themselves. Scenes of one
structure differ in numbers alone: places, motions, masses, axes, loads, functions. What follows from the structure is made
for the first of its scenes and kept with it by `ffr_prep.body.remembered`, as what follows from a body is kept with that.
"""

from __future__ import annotations

import weakref
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from ffr_dyn.equations.constraint_rows import Block
from ffr_dyn.equations.layout import Layout
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.forces.places import OnJoint
from ffr_dyn.scene.scene import Scene, markers
from ffr_prep.body import FlexibleBody

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Structure:
    """One structure, to which `remembered` attaches what follows from it.

    shared : whether other scenes are to find it; a large scene has one for itself alone, which keeps no copies of its memory
    """

    shared: bool = True


class Recent(Generic[T]):
    """The last things that were found of scenes, each known by a key and the flexible bodies, by identity while they live."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.known: dict[Hashable, tuple[list[weakref.ref[FlexibleBody]], T]] = {}

    def find(self, key: Hashable, scene: Scene) -> T | None:
        """What was kept by this key, which holds the id of these bodies; None where nothing was, or one of them is gone."""
        models, found = self.known.get(key, ([], None))
        alive = all(ref() is model for ref, model in zip(models, _flexible(scene), strict=bool(models)))
        return found if alive else None

    def keep(self, key: Hashable, scene: Scene, found: T) -> None:
        """Where there are too many things, all are forgotten."""
        if len(self.known) >= self.most:
            self.known.clear()
        self.known[key] = [weakref.ref(model) for model in _flexible(scene)], found


def _flexible(scene: Scene) -> list[FlexibleBody]:
    return [body.model for body in scene.bodies if body.model.n]


def structure_key(scene: Scene, place: Layout, blocks: Sequence[Block]) -> Hashable:
    """All that tells the structure of a scene from others, with the rows of these blocks, but for the sizes of tables."""
    return (
        place,
        markers(scene),
        _bodies(scene),
        tuple((block.name, block.markers, block.driver, *(word.kind for word in block.words)) for block in blocks),
        tuple((joint.name, joint.kind) for joint in scene.joints),
        tuple((coupling.name, coupling.first, coupling.second) for coupling in scene.couplings),
        tuple((one.name, isinstance(one, Driver) and (one.joint, one.coordinate)) for one in scene.drivers),
        tuple(_of_force(scene, force) for force in forces_of(scene)),
    )


def _of_force(scene: Scene, force: Force) -> Hashable:
    at = force.place
    on = isinstance(at, OnJoint) and at.joint
    return force.name, force.kernel, at.way, on, *at.markers(scene), at.measured, force.stores_energy


def _bodies(scene: Scene) -> Hashable:
    """Which bodies and points are the same ones, since these share tables; flexible ones by identity, with what they leave
    out."""
    numbers: dict[int, int] = {}

    def number(thing: Any) -> int:
        return numbers.setdefault(id(thing), len(numbers))

    return tuple(
        (
            body.name,
            number(body.model),
            *map(number, body.model.interfaces),
            *((id(body.model), body.damping.tobytes()) if body.model.n else ()),
            body.dropped,
            body.stiffening,
            body.kept,
            body.frame and body.frame.model.n,
        )
        for body in scene.bodies
    )
