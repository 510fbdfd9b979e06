"""A body that is cut into parts (`FlexibleBody.parts`), as the bodies of a scene that move in its place.

The parts of the body "blade" are the bodies "blade_1", "blade_2", ... Their frames coincide with that of the whole while it
is undeformed, so its pose and its motion are theirs. Fixed joints "blade_cut_1", ... hold them together. Markers keep the
name of the whole, "blade.tip", whichever part has them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ffr_dyn.scene.joints import Joint
from ffr_prep.body import cut_names
from ffr_prep.common.errors import InputError


def owner(body: Any) -> str:
    """The name under which the points of a body are known: its own, or that of the whole of which it is a part."""
    return str(body.name if body.part_of is None else body.part_of.name)


def taken_apart(scene: Any) -> dict[str, Any]:
    """Bodies, joints and forces of a scene with parts in place of bodies that have them; errors as of `in_parts`."""
    bodies = in_parts(scene.bodies)
    there = {joint.name for joint in scene.joints}
    joints = (*scene.joints, *(joint for joint in cut_joints(bodies) if joint.name not in there))
    parts = wholes(bodies)
    forces = tuple(one for force in scene.forces for one in _spread(force, parts.get(getattr(force, "body", ""), [])))
    return {"bodies": bodies, "joints": joints, "forces": forces}


def _spread(force: Any, parts: Sequence[Any]) -> Iterable[Any]:
    if not parts:
        return (force,)
    return force.on_parts(parts[0].part_of.model, {part.name: part.model for part in parts})


def in_parts(bodies: Iterable[Any]) -> tuple[Any, ...]:
    """The bodies of a scene, each that has parts replaced by these.

    Raises InputError for elastic coordinates and damping ratios of single modes of a whole, which its parts do not have.
    """
    return tuple(part for body in bodies for part in (_parts(body) if body.model.parts else (body,)))


def _parts(body: Any) -> Iterable[Any]:
    who = f"body {body.name!r} is in {len(body.model.parts)} parts"
    if np.any(body.q) or np.any(body.q_dot):
        raise InputError(f"{who}: they start undeformed; leave out q and q_dot of the whole")
    if body.model.n and np.ptp(body.damping):
        raise InputError(f"{who}, which have modes of their own: give one damping ratio for all")
    ratio = float(body.damping[0]) if body.model.n else 0.0
    for k, model in enumerate(body.model.parts, 1):
        name = f"{body.name}_{k}"
        yield replace(body, name=name, model=model, q=None, q_dot=None, damping=ratio, kept=None, part_of=body)


def wholes(bodies: Iterable[Any]) -> dict[str, list[Any]]:
    """The parts in a scene by the name of their whole, in order along it, in whichever order the scene has them."""
    found = dict[str, list[Any]]()
    for body in bodies:
        if body.part_of is not None:
            found.setdefault(owner(body), []).append(body)
    return {name: sorted(of, key=_number) for name, of in found.items()}


def _number(part: Any) -> int:
    return int(part.name.rpartition("_")[2])


def cut_joints(bodies: Iterable[Any]) -> list[Joint]:
    """The fixed joints that hold the parts of bodies together."""
    joints = []
    for name, parts in wholes(bodies).items():
        for k in range(1, len(parts)):
            a, b = cut_names(k)
            joints.append(Joint(f"{name}_cut_{k}", "fixed", f"{name}.{a}", f"{name}.{b}"))
    return joints


def as_declared(bodies: Iterable[Any]) -> tuple[Any, ...]:
    """The bodies as they were declared: wholes in place of their parts; the inverse of `in_parts`.

    Raises InputError for parts that no longer start, or are no longer treated, as those of one undeformed body.
    """
    bodies = tuple(bodies)
    whole = {name: _whole(name, parts) for name, parts in wholes(bodies).items()}
    names = dict.fromkeys(map(owner, bodies))
    alone = {body.name: body for body in bodies if body.part_of is None}
    return tuple(whole.get(name) or alone[name] for name in names)


def _whole(name: str, parts: Sequence[Any]) -> Any:
    alike = ("position", "rotation", "velocity", "omega_bar", "stiffening", "dropped")
    first, ratios = parts[0], np.concatenate([part.damping for part in parts])
    differing = [key for key in alike if any(not np.array_equal(getattr(p, key), getattr(first, key)) for p in parts)]
    if differing or any(np.any(part.q) or np.any(part.q_dot) for part in parts) or (ratios != ratios[:1]).any():
        raise InputError(
            f"the parts of body {name!r} differ in pose or treatment, or are deformed, and so are not one body; give all the "
            "pose and the treatment of the whole"
        )
    given = {key: getattr(first, key) for key in alike} | {"damping": float(ratios[0]) if ratios.size else 0.0}
    return replace(first.part_of, model=replace(first.part_of.model, parts=[part.model for part in parts]), **given)
