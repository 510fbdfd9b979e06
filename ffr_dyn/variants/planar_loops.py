"""Loops of joints whose bodies move in a plane, wherever it lies and goes, brought into it where they are a hair off.

A loop of hinges with parallel axes fixes the heights of its bodies along these once more than is needed, and their tilts
twice. It moves if all of them are right to the last digit; if they are right to six, as places are that a mesh leaves, rigid
bodies do not close it, and others are strained. So the joints are followed from body to body, each with the normal of the
plane in its own axes: axes are set along it or across it, and the joint that closes a loop is put at its height.
"""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ffr_dyn.functions.rotation import cross, skew
from ffr_dyn.scene.joints import H, Joint
from ffr_dyn.scene.scene import Scene, marker_number, markers
from ffr_dyn.variants.aligned import BESIDE
from ffr_dyn.variants.in_line import HAIR, ROUNDING, TOLD, Place, Places, places_of, with_places
from ffr_dyn.variants.twin_links import with_equal_twins
from ffr_prep.common.arrays import Array

KINDS = ("revolute", "planar", "cylindrical", "translational", "fixed", "spherical")
HINGE, RAIL, LOOSE = "hinge", "rail", "loose"


@dataclass(frozen=True)
class Held:
    """A joint in a plane, with its places, and what it is there.

    role : HINGE about the normal; RAIL, which takes the normal from one body to the other; LOOSE, which leaves the tilt of
           bodies to others
    """

    joint: Joint
    places: Places
    role: str

    @property
    def level(self) -> bool:
        """Whether it keeps the heights of its places equal."""
        return not (self.joint.kind == "cylindrical" and self.role == HINGE)


@dataclass(frozen=True)
class Plane:
    """What moves in one plane: by number of the body the normal (3,) in its axes, and by name the joints that hold them."""

    normals: dict[int, Array]
    joints: dict[str, Held]


def loops_in_plane(scene: Scene) -> tuple[Scene, list[str]]:
    """The scene with loops in their planes, itself where none was off; and joints that were moved by so much that it is told.

    Where bodies can deform, only what a mesh leaves is taken for a hair: the rest strains them.
    """
    notes, ground = list[str](), len(scene.bodies)
    rigid = {b for b, body in enumerate(scene.bodies) if not body.model.n}
    for among, hair in ((rigid, HAIR), (set(range(ground)), BESIDE)):
        for plane in _planes(scene, among | {ground}, hair):
            scene, told = _put(scene, plane, hair)
            notes += told
    return scene, notes


def _planes(scene: Scene, among: set[int], hair: float) -> Iterator[Plane]:
    """The planes in which joints of some bodies make loops."""
    table = markers(scene)
    known = {joint.name: joint for joint in scene.joints if joint.kind in KINDS}
    bodies = {
        name: {table[marker_number(scene, end)][0] for end in (joint.i, joint.j)} for name, joint in known.items()
    }
    looped = _in_loops({name: pair for name, pair in bodies.items() if len(pair) == 2 and pair <= among})
    left = {name: (known[name], places_of(scene, known[name])) for name in looped}
    while first := next((name for name, (joint, _) in left.items() if joint.kind in KINDS[:2]), None):
        plane = _grown(left, first, hair)
        left = {name: one for name, one in left.items() if name not in plane.joints}
        in_plane = _in_loops({name: set(held.places) for name, held in plane.joints.items()})
        if in_plane:
            yield Plane(plane.normals, {name: plane.joints[name] for name in in_plane})


def _in_loops(pairs: dict[str, set[int]]) -> list[str]:
    """Names of the joints, given with the numbers of their two bodies, that are left when all are taken away that end in a
    body without another."""
    left, at = dict(pairs), _at_bodies(pairs)
    counts = {b: len(names) for b, names in at.items()}
    ends = deque(b for b, count in counts.items() if count == 1)
    while ends:
        for name in at[ends.popleft()]:
            for b in left.pop(name, ()):
                counts[b] -= 1
                if counts[b] == 1:
                    ends.append(b)
    return list(left)


def _at_bodies(pairs: Mapping[str, Iterable[int]]) -> dict[int, list[str]]:
    """By number of the body, the joints at it."""
    at = defaultdict[int, list[str]](list)
    for name, pair in pairs.items():
        for b in pair:
            at[b].append(name)
    return at


def _grown(joints: dict[str, tuple[Joint, Places]], first: str, hair: float) -> Plane:
    """From one hinge on, all bodies that joints hold in its plane."""
    at = _at_bodies({name: places for name, (_, places) in joints.items()})
    hinge, ends = joints[first]
    plane = Plane({b: place.frame[:, H] for b, place in ends.items()}, {first: Held(hinge, ends, HINGE)})
    bodies = deque(plane.normals)
    while bodies:
        b = bodies.popleft()
        for name in at[b]:
            if name not in plane.joints and (c := _joined(plane, *joints[name], b, hair)) is not None:
                bodies.append(c)
    return plane


def _joined(plane: Plane, joint: Joint, places: Places, b: int, hair: float) -> int | None:
    """The body that is new in the plane by a joint on body b, which the plane has from now on if it holds both in it."""
    (c,) = set(places) - {b}
    seen, known = places[b].frame.T @ plane.normals[b], c in plane.normals
    role = _role(joint.kind, seen, hair)
    if not role or (role == LOOSE and not known):
        return None
    if not known:
        plane.normals[c] = places[c].frame @ _straight(joint.kind, role, seen)
    if _holds(joint.kind, role, seen, places[c].frame.T @ plane.normals[c], hair):
        plane.joints[joint.name] = Held(joint, places, role)
    return None if known else c


def _role(kind: str, seen: Array, hair: float) -> str:
    """What a joint is in a plane with the normal `seen` (3,) in its frame; "" where it leads out of it."""
    along, across = np.abs(seen[:H]).max() <= hair, abs(seen[H]) <= hair
    if kind == "cylindrical":
        return HINGE if along else LOOSE if across else ""
    if kind == "translational":
        return RAIL if across else ""
    return {"fixed": RAIL, "spherical": LOOSE}.get(kind, HINGE if along else "")


def _holds(kind: str, role: str, on_b: Array, on_c: Array, hair: float) -> bool:
    """Whether a joint is the same in the plane on both sides, from which the normal is seen in its frame."""
    if role == LOOSE:
        return _role(kind, on_c, hair) == LOOSE
    return bool(np.abs(_straight(kind, role, on_b) - on_c).max() <= hair)


def _straight(kind: str, role: str, seen: Array) -> Array:
    """(3,) of length one: the normal in the frame of a joint, exactly along its hinge, or across its rail."""
    if role == HINGE:
        return np.array([0.0, 0.0, np.copysign(1.0, seen[H])])
    if kind in ("translational", "cylindrical"):
        seen = np.array([seen[0], seen[1], 0.0])
    return seen / np.linalg.norm(seen)


def _put(scene: Scene, plane: Plane, hair: float) -> tuple[Scene, list[str]]:
    """The scene with the joints of a plane in it, and which were moved by so much that it is told."""
    size = max(_span(plane, b) for b in plane.normals)
    off = {name: (c, up) for name, (c, up) in _too_low(plane).items() if abs(up) > ROUNDING * size}
    wanted = _wanted(scene, plane, off, hair * size)
    if wanted is None:
        return scene, []
    for name, held in plane.joints.items():
        scene = with_places(scene, held.joint, wanted[name])
    told = {name: abs(up) for name, (_, up) in off.items() if abs(up) > TOLD}
    notes = [
        f"joint {name!r} is put into the plane of its loop, which it was {up:.2g} m off" for name, up in told.items()
    ]
    hinges = [joint for joint in scene.joints if joint.name in plane.joints and plane.joints[joint.name].role == HINGE]
    scene, more = with_equal_twins(scene, hinges, plane.normals, BESIDE * size)
    return scene, notes + more


def _wanted(scene: Scene, plane: Plane, off: dict[str, tuple[int, float]], near: float) -> dict[str, Places] | None:
    """Where joints are in their plane; None where one is off it by more than a hair [m], and strains bodies or does not
    close, or where others have its place."""
    wanted = {name: _aligned(held, plane.normals) for name, held in plane.joints.items()}
    for name, (c, up) in off.items():
        b = _own_place(scene, plane.joints[name].joint, c)
        if b is None or abs(up) > near:
            return None
        place, higher = wanted[name][b], up if b == c else -up
        wanted[name][b] = Place(place.point + higher * plane.normals[b], place.frame)
    return wanted


def _span(plane: Plane, b: int) -> float:
    """[m] the largest distance along an axis of a body between its joints in the plane."""
    points = np.array([held.places[b].point for held in plane.joints.values() if b in held.places])
    return float(np.ptp(points, axis=0).max()) if len(points) else 0.0


def _aligned(held: Held, normals: dict[int, Array]) -> Places:
    """The places of a joint with its frames exactly along the plane or across it."""
    if held.joint.kind == "spherical":
        return dict(held.places)
    seen = {b: place.frame.T @ normals[b] for b, place in held.places.items()}
    if held.role != LOOSE:
        seen = dict.fromkeys(seen, seen[next(iter(seen))])  # as on the first body
    return {
        b: Place(place.point, _turned(place.frame, _straight(held.joint.kind, held.role, seen[b]), normals[b]))
        for b, place in held.places.items()
    }


def _turned(frame: Array, seen: Array, normal: Array) -> Array:
    """(3, 3) the frame, turned by as little as makes its axis `seen` (3,) the normal (3,)."""
    axis = frame @ seen
    turn = skew(cross(axis, normal))
    if np.abs(turn).max() <= ROUNDING:
        return frame
    found: Array = frame + turn @ frame + turn @ turn @ frame / (1.0 + axis @ normal)
    return found


def _too_low(plane: Plane) -> dict[str, tuple[int, float]]:
    """Of every joint that closes a loop of joints that keep heights equal: the body that it closes it with, and by how much
    [m] its place there is too low."""
    level = {name: held for name, held in plane.joints.items() if held.level}
    at = _at_bodies({name: held.places for name, held in level.items()})
    heights, found = dict[int, float](), dict[str, tuple[int, float]]()
    for root in at:
        heights.setdefault(root, 0.0)
        bodies = deque([root])
        while bodies:
            b = bodies.popleft()
            for held in (level.pop(name) for name in at[b] if name in level):
                (c,) = set(held.places) - {b}
                on_b, on_c = (float(plane.normals[k] @ held.places[k].point) for k in (b, c))
                if c in heights:
                    found[held.joint.name] = c, heights[b] + on_b - heights[c] - on_c
                else:
                    heights[c] = heights[b] + on_b - on_c
                    bodies.append(c)
    return found


def _own_place(scene: Scene, joint: Joint, c: int) -> int | None:
    """The body, c if it can be, on which no other joint has the place of a joint; None where others have both."""
    table = markers(scene)
    used = Counter(end for other in scene.joints for end in (other.i, other.j))
    ends = {table[marker_number(scene, end)][0]: end for end in (joint.i, joint.j)}
    return next((b for b in sorted(ends, key=lambda b: b != c) if used[ends[b]] == 1), None)
