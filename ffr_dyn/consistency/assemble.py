"""Assembly: positions and velocities that meet the joints, from a rough guess; and which constraint rows are redundant.

Corrections are the smallest in the norm of the mass matrix, so heavy bodies move least. Elastic coordinates are left
alone wherever rigid motion suffices. (Haug 1989, ch. 4.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Real

import numpy as np

from ffr_dyn.closing.constraints import Constraints, constraints_of, rows_at, without
from ffr_dyn.closing.coupled_turns import prescribed
from ffr_dyn.closing.dependent_rows import held_by_next_to_nothing
from ffr_dyn.closing.driven_angles import driven_angles, led_to_drivers
from ffr_dyn.closing.going_on import going_on
from ffr_dyn.closing.independence import independent_blocks
from ffr_dyn.closing.inertia_left import require_inertia, with_traces
from ffr_dyn.closing.positions import close_positions, close_velocities
from ffr_dyn.compile.memory import check_memory
from ffr_dyn.compile.scene_tables import System, compile_scene
from ffr_dyn.consistency.across import rows_across
from ffr_dyn.consistency.dropped_terms import check_dropped
from ffr_dyn.consistency.held_frequencies import held_frequencies
from ffr_dyn.consistency.sliding import sliding_notes
from ffr_dyn.consistency.validity import deflections
from ffr_dyn.equations.constraint_rows import Block, blocks_of
from ffr_dyn.equations.inertia import damping_matrix
from ffr_dyn.equations.layout import Layout, initial_state
from ffr_dyn.functions.overshoots import overshoots
from ffr_dyn.scene.followed import TURN
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.parts import owner, wholes
from ffr_dyn.scene.scene import Body, Scene, altered, length_of, measured_body, require_scene
from ffr_dyn.scene.sensors import Measurement
from ffr_dyn.variants.in_line import in_line
from ffr_dyn.variants.mean_axis import in_mean_axis_frames
from ffr_dyn.variants.planar_loops import loops_in_plane
from ffr_dyn.variants.plane import obstacles, planar_forms
from ffr_prep.body import (
    CUT_PAIR,
    cut_doubt,
    cut_stress_doubt,
    damping_ratio,
    free_vibrations,
    mesh_doubt,
    ratio_doubts,
    shear_doubt,
    steady_stress_doubt,
    units_doubts,
)
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import InputError, require_kind

_AMONG = 6  # free vibrations of a whole, of which one is the slowest of its parts
_SAME_DAMPING = 0.2  # of a ratio
_MOST_GRAVITY = 1000.0  # m/s^2; in mm/s^2 that of the Earth is 9810
SHIFTED = 1e-6  # m, rad, from where it is told that assembly moved a body
SLOWED = 1e-2  # of a velocity that a scene gives, from where it is told that a body has another
ROUNDED = 1e-9  # of the fastest velocity that a scene gives, below which another is rounding
RELAXATION = 1e-6  # of dependent rows, relative: rounding over it is what their reactions are uncertain by
BRANCHES = (
    "the scene starts in a singular position, where its motion may branch: to choose, draw it a little way along the branch "
    "that is meant"
)
TORN = 0.5  # elastic displacement of an interface over the size of its body that no joint may ask for


@dataclass(frozen=True, repr=False)
class Assembled(Brief):
    """A consistent state and the compiled scene.

    system   : with independent constraint rows, for the motion
    all_rows : with all of them and a relaxed multiplier matrix, for the reactions; None where no row is redundant, or
               deformation moves some that are by next to nothing

    x, v : (X,) positions and (V,) velocities (see `Layout`);  notes : what was changed and what is redundant, in words
    degrees_of_freedom : velocities left free by the constraints, elastic ones included
    redundant : (joint, row) pairs that follow from the other rows
    computed : in the plane or in space, and why, in words
    blocks : of all rows, redundant ones among them

    >>> fd.assemble(scene).degrees_of_freedom
    """

    system: System
    all_rows: System | None
    x: Array
    v: Array
    degrees_of_freedom: int
    notes: tuple[str, ...]
    redundant: tuple[tuple[str, str], ...] = ()
    computed: str = ""
    blocks: tuple[Block, ...] = ()


def assemble(scene: Scene, *, time: float = 0.0) -> Assembled:
    """Consistent positions and velocities at `time` [s].

    Raises InputError when the joints cannot be closed, naming the joint that stays open furthest, or when a driver
    contradicts the joints.

    >>> x = fd.assemble(scene).x
    """
    require_scene(scene)
    require_kind(time, Real, "the time to assemble a scene for", "seconds, such as 0.0")
    declared, flat = scene, flat_form(scene, time)
    scene, rows, place = flat.scene, flat.rows, flat.rows.place
    left_out = [note for b, body in enumerate(scene.bodies) for note in check_dropped(body, place.active(b))]
    guess, given = initial_state(scene, place)
    x = led_to_drivers(rows, guess, lambda driven, at: close_positions(driven, at, given))
    _require_shape(scene, place, guess, x)
    here = rows_at(rows, x, given)
    found = independent_blocks(rows, x, given, here)
    kept, redundant = found.blocks, found.redundant
    v = close_velocities(rows, x, given, here)
    if found.singular:
        v = going_on(rows, x, v)
    count = sum(len(block.words) for block in kept)
    share, weak = held_by_next_to_nothing(rows, x, here.J) if redundant else (0.0, [])
    carried = "it carries nothing" if weak else "of the reactions that are possible the smallest are given"
    notes = [f"{block}: the row '{text}' is redundant; {carried}" for block, text in redundant] + left_out
    if found.singular:
        notes.insert(0, BRANCHES)
    notes = flat.notes + shifted(scene, place, guess, x) + _slowed(scene, place, given, v) + notes
    if scene.plane != "none" and any(body.model.n for body in scene.bodies):
        notes.append(
            f"the scene is planar (normal {scene.plane}): computed in the plane, with in-plane modes without their rounding "
            "across it"
        )
    notes += _weakly_held(share, weak)
    notes += [*sliding_notes(scene), *_idle(scene), *_uncounted(rows, x), *body_doubts(scene)]
    notes += held_frequencies(
        declared, [(x[place.R(b)], x[place.p(b)]) for b in range(len(place.n))], scene.plane, time
    )
    all_rows = compile_scene(scene, list(rows.blocks), RELAXATION) if redundant and not weak else None
    free = _movable(place) - count
    system = compile_scene(scene, kept) if redundant else rows.engine.system
    notes += _beyond_tables(system)
    check_memory(system.user, time, x, v)
    return Assembled(system, all_rows, x, v, free, tuple(notes), tuple(redundant), flat.computed, rows.blocks)


def _weakly_held(share: float, joints: list[str]) -> list[str]:
    """A note where joints strain bodies in a way in which these have next to no modes: reactions are those of the rows that
    the motion needs, since all rows would take next to nothing for all that gives way."""
    return [
        f"joints {', '.join(map(repr, joints))} hold one another where modes of the bodies give way by {share:.1g} of "
        "what others would: taken as rigid there, and as free of forces that balance one another; keep modes that bend that "
        "way, or declare the plane of the motion"
    ] * bool(joints)


def body_doubts(scene: Scene) -> list[str]:
    """Notes on bodies: a mesh too coarse, parts that are stiffer than the whole or damp otherwise, a measured stress or
    section force that lacks that of inertia, numbers that cannot be meant."""
    measured = {measured_body(scene, of) for of in scene.measurements if not isinstance(of, Measurement)}
    doubts = [(body.name, mesh_doubt(body.model.provenance)) for body in scene.bodies if body.part_of is None]
    for name, parts in wholes(scene.bodies).items():
        whole = parts[0].part_of
        told = (mesh_doubt(whole.model.provenance), cut_doubt(whole.model.provenance), _damped_otherwise(whole, parts))
        doubts += [(name, doubt) for doubt in told]
    stressed = [scene.bodies[b] for b in sorted(measured)]
    doubts += [(b.name, of(b.model.provenance)) for b in stressed for of in (steady_stress_doubt, shear_doubt)]
    doubts += [(owner(b), cut_stress_doubt(b.part_of.model)) for b in stressed if b.part_of]
    doubts += [
        (body.name, doubt)
        for body in scene.bodies
        for doubt in (*units_doubts(body.model), *ratio_doubts(body.damping))
    ]
    doubts += [(body.name, body.model.provenance.get(CUT_PAIR)) for body in scene.bodies if scene.plane == "none"]
    return [f"body {name!r}: {doubt}" for name, doubt in dict.fromkeys(doubts) if doubt] + _gravity_doubts(scene)


def _damped_otherwise(whole: Body, parts: Sequence[Body]) -> str | None:
    """A note on parts that damp the slowest vibration of the free body by another ratio than the whole has."""
    matrices = [damping_matrix(part.model, part.damping) for part in parts]
    if not whole.model.n or not any(matrix.any() for matrix in matrices):
        return None
    found, all_of = free_vibrations([part.model for part in parts], 1), free_vibrations([whole.model], _AMONG)
    k = int(np.argmin(np.abs(all_of.omega - found.omega[0])))  # in a plane it is not always the first
    own = np.zeros((whole.model.n,) * 2) if whole.model.damping is None else whole.model.damping
    in_parts, in_one = damping_ratio(found, 0, matrices), damping_ratio(all_of, k, [own]) + whole.damping[0]
    if abs(in_parts - in_one) <= _SAME_DAMPING * in_one:
        return None
    return (
        f"its parts damp a free vibration of {found.omega[0] / TURN:.4g} Hz by a ratio of {in_parts:.2g}, and one piece by "
        f"{in_one:.2g}: ratios and loss factors belong to the modes of each part, and alpha M damps no motion of frames; "
        "give what grows with stiffness, which parts keep (rayleigh = [0, BETA])"
    )


def _gravity_doubts(scene: Scene) -> list[str]:
    size = float(np.linalg.norm(scene.gravity))
    return [f"gravity is {size:.4g} m/s^2: is it in mm/s^2?"] if size > _MOST_GRAVITY else []


def _idle(scene: Scene) -> list[str]:
    """Notes on forces that act on the ground alone, and on what others do not do."""
    acts = ((force.name, force.place.markers(scene)) for force in forces_of(scene))
    idle = [
        f"{name!r} acts on {' and '.join(places)} alone, and the ground does not move: it does nothing; give it a marker "
        "of a body"
        for name, places in acts
        if places and all(place.startswith("ground.") for place in places)
    ]
    return idle + [doubt for force in forces_of(scene) for doubt in force.doubts(scene)]


def _beyond_tables(system: System) -> list[str]:
    """Notes on tables whose splines go far beyond their rows."""
    functions = system.model.functions
    found = overshoots(functions.kind, functions.start, functions.data)
    return [f"{system.purposes[number]}: {one.words}" for number, one in found.items()]


def _uncounted(rows: Constraints, x: Array) -> list[str]:
    """A note where drivers, or couplings of these, tell whole turns, and forces on angles are to begin within half a turn."""
    begun = {
        force.name: force.place.joint
        for force in rows.scene.forces
        if (force.place.way, getattr(force, "turns", None)) == ("angle", 0)
    }
    if not begun:
        return []
    who, turns = "a driver", max((round(angle.value / TURN) for angle in driven_angles(rows, x)), key=abs, default=0)
    if not turns:
        led = {joint: round(value / TURN) for (joint, way), value in prescribed(rows).items() if way == "angle"}
        begun = {name: joint for name, joint in begun.items() if led.get(joint)}
        who, turns = "a coupling of what is driven", max((led[joint] for joint in begun.values()), key=abs, default=0)
    return [
        f"{who} begins {turns} whole turns on, and {', '.join(map(repr, begun))} within half a turn, as `turns` says: "
        "where it has turned along, give it the whole turns of its joint"
    ] * (turns != 0)


def shifted(scene: Scene, place: Layout, guess: Array, x: Array) -> list[str]:
    """A note on the bodies that assembly has moved or turned, the one moved most and the one turned most by name."""
    if x is guess or np.array_equal(x, guess):
        return []
    shifts = [float(np.linalg.norm(x[place.R(b)] - guess[place.R(b)])) for b in range(len(place.n))]
    turns = [turned(x[place.p(b)], guess[place.p(b)]) for b in range(len(place.n))]
    count = sum(shift > SHIFTED or turn > SHIFTED for shift, turn in zip(shifts, turns, strict=True))
    said = [
        f"{word} body {scene.bodies[b].name!r} by {sizes[b]:.3g} {unit}"
        for word, sizes, unit in (("moved", shifts, "m"), ("turned", turns, "rad"))
        if sizes[b := int(np.argmax(sizes))] > SHIFTED
    ]
    more = f", the most of {count} bodies," if count > 1 else ""
    return [f"assembly {' and '.join(said)}{more} from where the scene puts it"] if said else []


def _slowed(scene: Scene, place: Layout, given: Array, v: Array) -> list[str]:
    """A note where a body does not begin with the velocity that the scene gives it, on the one that is farthest off."""
    if not given.any():
        return []
    length = length_of(scene)
    velocities = [
        (body.name, word, where, arm, float(np.linalg.norm(given[where])))
        for b, body in enumerate(scene.bodies)
        for word, where, arm in (
            ("velocity {} m/s", place.R_dot(b), 1.0),
            ("omega_bar {} rad/s", place.omega(b), length),
        )
    ]
    fastest = max(size * arm for *_, arm, size in velocities)
    parts = [
        (float(np.linalg.norm(v[where] - given[where]) / size), name, word, v[where], given[where])
        for name, word, where, arm, size in velocities
        if size * arm > ROUNDED * fastest
    ]
    off, name, word, now, before = max(parts, key=lambda part: part[0], default=(0.0, "", "", v, v))
    if off <= SLOWED:
        return []
    return [
        f"body {name!r} begins with {word.format(_in_words(now))}, not {_in_words(before)} as the scene says: joints and "
        "drivers do not allow it beside the velocities of other bodies, zero where none is given; give those of all that move"
    ]


def _in_words(vector: Array) -> str:
    rounding = np.abs(vector) <= 1e-9 * np.linalg.norm(vector)
    return "(" + ", ".join(f"{number:.4g}" for number in np.where(rounding, 0.0, vector)) + ")"


def turned(p: Array, p0: Array) -> float:
    """[rad] the angle between two attitudes, Euler parameters of length one."""
    return 2.0 * float(np.arctan2(np.linalg.norm(np.outer(p, p0) - np.outer(p0, p)) / np.sqrt(2.0), abs(p @ p0)))


def _require_shape(scene: Scene, place: Layout, guess: Array, x: Array) -> None:
    """InputError where positions are met only by a body deformed beyond all sense."""
    if x is guess or np.array_equal(x, guess):
        return
    for b, body in enumerate(scene.bodies):
        _, share = deflections(body.model, (x - guess)[None, place.q(b)])
        if share > TORN:
            raise InputError(
                f"the mechanism cannot be assembled without deforming body {body.name!r} by {share:.3g} times its size; "
                "check the positions of the interfaces, the lengths of the bodies and the axes of the joints, or start closer"
            )


def _movable(place: Layout) -> int:
    """How many velocities the scene has without its constraints."""
    return sum(len(place.active(b)) + n for b, n in enumerate(place.n))


@dataclass(frozen=True)
class Flat:
    """A scene as it is computed, its rows, whether it is computed in the plane or in space, in words, and notes on what was
    moved by a hair."""

    scene: Scene
    rows: Constraints
    computed: str
    notes: list[str]


def flattened(scene: Scene, time: float) -> tuple[Scene, list[Block]]:
    """The scene as it is computed: second-order bodies in their mean-axis form, its plane decided, `plane` "x", "y", "z" or
    "none"; and its rows, those of a planar scene without the ones that no motion in the plane can change."""
    flat = flat_form(scene, time)
    return flat.scene, list(flat.rows.blocks)


def flat_form(scene: Scene, time: float) -> Flat:
    """A scene as it is computed (`flattened`). Raises InputError for a body without the inertia to move."""
    found = _in_plane_or_space(scene, time)
    require_inertia(found.scene, found.rows.place)
    return found


def _in_plane_or_space(scene: Scene, time: float) -> Flat:
    found = dict[str, str]()
    scene = in_mean_axis_frames(scene)
    lined, notes = in_line(scene)
    blocks = blocks_of(lined)  # which know joints and markers by number, and these are the same in a plane
    for flat in planar_forms(lined):
        across, found[flat.plane] = rows_across(flat, blocks, time)
        if not found[flat.plane] or scene.plane == flat.plane:
            said = ", as the scene says" * (scene.plane == flat.plane)
            rows = constraints_of(flat, without(blocks, across), time)
            return Flat(flat, rows, f"in the plane, normal {flat.plane}{said}", notes)
    whole, more = loops_in_plane(altered(lined, plane="none"))
    return Flat(whole, constraints_of(whole, blocks_of(whole), time), _in_space(scene, found), notes + more)


def _in_space(scene: Scene, found: dict[str, str]) -> str:
    """Why no plane was found, in words; found : what keeps the joints from one, by its normal."""
    if scene.plane == "none":
        return "in space, as the scene says"
    normal, said = next(((key, (what,)) for key, what in found.items()), None) or obstacles(scene)
    more = f" (and {len(said) - 1} more)" if len(said) > 1 else ""
    return f"in space: not in the plane with the normal {normal}, as {said[0]}{more}"


def in_space(scene: Scene) -> Scene:
    """The scene without a search for a plane: what could leave it counts, even where nothing pushes it out."""
    return replace(scene, plane="none") if scene.plane == "auto" else scene


def seen_in_space(scene: Scene) -> Scene:
    """As `in_space`. Where the scene is computed in a plane, bodies that lack inertia across it have a trace of it."""
    if scene.plane != "auto" or (traced := with_traces(scene)) is scene:
        return in_space(scene)
    planar = _in_plane_or_space(scene, 0.0).scene.plane != "none"
    return in_space(traced if planar else scene)
