"""Mobility: degrees of freedom, redundant rows, and the free motions in words. The look before every analysis."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.closing.independence import redundant_drivers
from ffr_dyn.consistency.assemble import Assembled, assemble, flat_form, flattened, seen_in_space
from ffr_dyn.consistency.evaluation import free_motions, locked, total_mass_matrix, unit_rows
from ffr_dyn.equations.constraint_rows import Block, rows_at
from ffr_dyn.equations.constraints import evaluate_word
from ffr_dyn.equations.layout import Layout
from ffr_dyn.scene.force_kinds import in_bases
from ffr_dyn.scene.joints import COORDINATES, RELATION, Joint, Word, coordinate_axes, frames
from ffr_dyn.scene.scene import Body, Scene, marker_number, require_scene
from ffr_prep.body import truncated
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import InputError

MOVES = 1e-6  # of a body's motion, relative to the largest
ALONG = ("turn x", "turn y", "turn z", "shift x", "shift y", "shift z")


@dataclass(frozen=True, repr=False)
class FreeMotion(Brief):
    """One way in which the bodies can move as rigid ones, with the other ways at rest.

    name      : the coordinate that leads it: "joint.angle", or "body shift x" in the body's axes
    bodies    : those that move
    direction : (6 B,) [A^T R_dot, omega_bar] of all bodies, for a rate of one
    """

    name: str
    bodies: tuple[str, ...]
    direction: Array


@dataclass(frozen=True, repr=False)
class Mobility(Brief):
    """The freedom that the joints and drivers of a scene leave at its assembled start.

    degrees_of_freedom : of the bodies as they are;  elastic : number of elastic coordinates
    rigid      : degrees of freedom with all bodies undeformed. Joints that rigid bodies would hold twice deform elastic ones,
                 so that rigid and elastic together may be more than degrees_of_freedom
    plane      : normal of a planar scene, "x", "y" or "z"; otherwise "none". A scene that declares no plane is looked at in
                 space all the same: motions and redundant rows are those that it has there
    computed   : whether runs are computed in the plane or in space, and why, in words
    free       : rigid motions with all bodies undeformed; at a singular position more than the mechanism has elsewhere
    redundant  : (joint, row) pairs that follow from the other rows
    overdriven : drivers whose motion the joints and the other drivers fix already
    doubts     : bodies whose modes do not fit the joints, or that cannot do without the inertia terms they leave out

    >>> fd.mobility(scene).degrees_of_freedom
    """

    degrees_of_freedom: int
    rigid: int
    elastic: int
    plane: str
    computed: str
    free: tuple[FreeMotion, ...]
    redundant: tuple[tuple[str, str], ...]
    overdriven: tuple[str, ...]
    doubts: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """The report, a line each."""
        said = [counted(self.degrees_of_freedom, self.rigid, self.elastic, len(self.redundant))]
        said.append(f"computed     {self.computed}")
        said += [f"free         {motion.name}: moves {', '.join(motion.bodies)}" for motion in self.free]
        said += [f"redundant    {joint}: {row}" for joint, row in self.redundant]
        said += [f"overdriven   {driver} (all else is counted without drivers)" for driver in self.overdriven]
        return said + [f"doubt        {doubt}" for doubt in self.doubts]


def counted(degrees_of_freedom: int, rigid: int, elastic: int, redundant: int) -> str:
    """The counts in words: "3 rigid degrees of freedom, 2 redundant rows; 101 elastic coordinates"."""
    rows = f", {redundant} redundant row{'s' * (redundant > 1)}" * bool(redundant)
    said = f"{rigid} rigid degree{'s' * (rigid != 1)} of freedom{rows}" + f"; {elastic} elastic coordinates" * bool(
        elastic
    )
    deformed = rigid + elastic - degrees_of_freedom
    return f"{said}, which joints and drivers deform in {deformed} ways" if deformed > 0 else said


def undeformed(scene: Scene) -> Scene:
    """The scene with rigid bodies of the same inertia and interfaces."""
    require_scene(scene)
    none = {body.name: np.zeros((body.model.n, 0)) for body in scene.bodies if body.model.n}
    bodies = tuple(_rigid(body) if body.name in none else body for body in scene.bodies)
    return replace(scene, bodies=bodies, forces=in_bases(scene.forces, none))


def _rigid(body: Body) -> Body:
    """Whose elastic coordinates, for those who ask, are zero."""
    rigid = replace(body, model=truncated(body.model, 0), q=None, q_dot=None, damping=0.0, stiffening=False, frame=None)
    return replace(rigid, kept=((), body.model.n))


def rigid_freedom(scene: Scene, assembled: Assembled, time: float) -> int:
    """Degrees of freedom of a scene with all bodies undeformed at `time` [s]; where that cannot be, as it is assembled."""
    elastic = sum(assembled.system.layout.n)
    if not elastic:
        return assembled.degrees_of_freedom
    try:
        return assemble(undeformed(scene), time=time).degrees_of_freedom
    except InputError:  # as where bores are a hair off their line, about which a shaft turns all the same
        _, free = rigid_motions(*flattened(scene, time), assembled, time)
        return max(assembled.degrees_of_freedom - elastic, free.shape[1])


def mobility(scene: Scene, *, time: float = 0.0, drivers: bool = True) -> Mobility:
    """Mobility of a scene, assembled at `time` [s]; without its drivers if asked so.

    Raises InputError when the scene cannot be assembled.

    >>> print(fd.mobility(scene))
    """
    whole, scene = flat_form(scene, time), seen_in_space(scene)
    over = overdriven(scene, time) if drivers and scene.drivers else ()
    bare = scene if drivers and not over else replace(scene, drivers=())
    assembled = assemble(bare, time=time)
    flat, blocks = flattened(bare, time)
    place = assembled.system.layout
    rigid, Z = rigid_motions(flat, blocks, assembled, time)
    motions = tuple(_motions(flat, place, assembled.x, assembled.v, rigid, Z))
    doubts = tuple(note for note in assembled.notes if note.startswith(("body ", "gravity ")))
    elastic = sum(place.n)
    free, plane = assembled.degrees_of_freedom, whole.scene.plane
    left = rigid_freedom(bare, assembled, time)
    return Mobility(free, left, elastic, plane, whole.computed, motions, assembled.redundant, over, doubts)


def rigid_motions(flat: Scene, blocks: list[Block], assembled: Assembled, time: float) -> tuple[Array, Array]:
    """Numbers of the velocities of frames, and the free motions (6B, F) of bodies that keep their shape, as assembled."""
    place = assembled.system.layout
    jacobian = _jacobian(flat, place, blocks, assembled.x, assembled.v, time)
    rigid = np.concatenate([np.arange(place.iv[b], place.iv[b] + 6) for b in range(len(place.n))])
    M = total_mass_matrix(flat, place, assembled.x)
    return rigid, free_motions(jacobian[:, rigid], M[np.ix_(rigid, rigid)])


def overdriven(scene: Scene, time: float = 0.0) -> tuple[str, ...]:
    """Drivers that prescribe what the joints and the other drivers fix already, seen from the start without them."""
    flat = flat_form(seen_in_space(scene), time)
    assembled = assemble(replace(flat.scene, drivers=()), time=time)
    return redundant_drivers(flat.rows, assembled.x, assembled.v)


def require_driven(scene: Scene, time: float, analysis: str) -> None:
    """Raises InputError unless the drivers fix all rigid motion, and none of them twice."""
    found = mobility(scene, time=time)
    if found.overdriven:
        raise InputError(
            f"over-driven: {', '.join(map(repr, found.overdriven))} prescribe a motion that the joints and other drivers "
            "already fix; remove a driver"
        )
    if found.rigid:  # at a singular position there are more free motions than the mechanism has
        said = "; ".join(f"{motion.name} (moves {', '.join(motion.bodies)})" for motion in found.free)
        raise InputError(
            f"{analysis} needs every rigid motion prescribed by a driver; free: {said}; add a driver for each, or a joint "
            "that holds it, as a universal joint does at one end of a rod that turns about itself between two spherical ones"
        )


def _jacobian(scene: Scene, place: Layout, blocks: list[Block], x: Array, v: Array, time: float) -> Array:
    """Rows of the blocks, and of what a planar scene does not have."""
    rows = [row.jacobian for row in rows_at(scene, place, blocks, x, v, time)]
    return np.concatenate([np.array(rows).reshape(-1, place.v_size), unit_rows(locked(place), place.v_size)])


# ---- free motions in words ------------------------------------------------------------------------------------------


def coordinate_word(joint: Joint, coordinate: str) -> Word:
    """A joint coordinate as a row of the readable form: its value is Phi, its gradient the Jacobian."""
    axes = coordinate_axes(coordinate, *frames(joint))
    terms = (1.0, coordinate), (0.0, coordinate)
    return Word(RELATION, f"{joint.name}.{coordinate}", np.array(axes * 2), None, terms)


def coordinate_gradients(scene: Scene, place: Layout, x: Array, v: Array) -> tuple[list[str], Array]:
    """Names "joint.angle" of all joint coordinates and their gradients (K, V)."""
    names, rows = [], []
    for joint in scene.joints:
        ends = (marker_number(scene, joint.i), marker_number(scene, joint.j))
        for coordinate in COORDINATES[joint.kind]:
            word = coordinate_word(joint, coordinate)
            names.append(word.text)
            rows.append(evaluate_word(scene, place, x, v, word, ends * 2, (0.0, 0.0, 0.0)).jacobian)
    return names, np.array(rows).reshape(-1, place.v_size)


def named_motion(scene: Scene, place: Layout, x: Array, direction: Array) -> str:
    """The coordinate that leads a motion (V,): of a joint if one takes part, else of the body that moves most."""
    return named_motions(scene, place, x, direction[:, None])[0]


def named_motions(scene: Scene, place: Layout, x: Array, directions: Array) -> list[str]:
    """The coordinates that lead motions (V, m)."""
    names, gradients = coordinate_gradients(scene, place, x, np.zeros(place.v_size))
    names += [f"{body.name} {along}" for body in scene.bodies for along in ALONG]
    parts = [np.roll(directions[place.rigid(b)], 3, axis=0) for b in range(len(place.n))]
    joints, bodies = np.abs(gradients @ directions), np.abs(np.concatenate(parts))
    takes_part = joints.max(axis=0, initial=0.0) > 0.1 * bodies.max(axis=0)
    shown = np.vstack([joints * takes_part, bodies * ~takes_part])
    return [names[k] for k in np.argmax(shown, axis=0)]


def _motions(scene: Scene, place: Layout, x: Array, v: Array, rigid: Array, Z: Array) -> list[FreeMotion]:
    """The free motions Z (6 B, d) in the coordinates that lead them: joint coordinates first, then shifts and turns."""
    names, gradients = coordinate_gradients(scene, place, x, v)
    names += [f"{body.name} {along}" for body in scene.bodies for along in ALONG]
    turns_first = Z.reshape(len(scene.bodies), 2, 3, Z.shape[1])[:, ::-1].reshape(Z.shape)
    rates = np.concatenate([gradients[:, rigid] @ Z, turns_first])
    lead = _leading(rates)
    basis = Z @ np.linalg.inv(rates[lead])
    return [FreeMotion(names[k], _moving(scene, basis[:, at]), basis[:, at]) for at, k in enumerate(lead)]


def _leading(rates: Array) -> list[int]:
    """The first rows that are well independent, in order: Gram-Schmidt on rows of length one."""
    length = np.linalg.norm(rates, axis=1)
    rates = rates / np.where(length > MOVES * length.max(initial=0.0), length, np.inf)[:, None]
    lead: list[int] = []
    basis = np.zeros((0, rates.shape[1]))
    for threshold in (0.1, 1e-6):
        for k, row in enumerate(rates):
            left = row - basis.T @ (basis @ row)
            if len(lead) < rates.shape[1] and k not in lead and np.linalg.norm(left) > threshold:
                lead.append(k)
                basis = np.concatenate([basis, [left / np.linalg.norm(left)]])
    return lead


def _moving(scene: Scene, direction: Array) -> tuple[str, ...]:
    size = np.abs(direction.reshape(-1, 6)).max(axis=1)
    return tuple(body.name for body, moves in zip(scene.bodies, size, strict=True) if moves > MOVES * size.max())
