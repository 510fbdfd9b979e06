"""The deformation that the shapes of a body leave out under the loads that a run brings to its interfaces.

Normal modes alone have not the static shapes of loads there, and converge to them slowly: the tension of a pulled bar is off
by a tenth with thirty of them. Beside such a basis a reduction keeps the compliance G of the whole model
(`ffr_prep.reduction.held_body`). With the wrenches w of all joints, drivers, loads and springs at the interfaces, which the
inertia of the free body balances, the strain energy is w^T G w / 2, and that of the shapes, Phi less their part of the rigid
motions, w^T Phi Omega^-2 Phi^T w / 2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ffr_dyn.consistency.held_frequencies import HELD
from ffr_dyn.equations.forces import At, acting
from ffr_dyn.results.power import measured_values
from ffr_dyn.results.recorded_motion import View, cross, to_axes
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces.places import FORCE, SIX, AtMarker, BetweenAxes, OnBody, Place
from ffr_dyn.scene.parts import owner
from ffr_dyn.scene.scene import Scene, marker_number, markers
from ffr_prep.body import FlexibleBody, interface_motions, mass_of_motions, remembered
from ffr_prep.common.arrays import Array
from ffr_prep.common.in_words import percent_in_words

TOLD, OF_STRESS = (
    0.05,
    0.01,
)  # of the strain energy, from which on it is told; of bodies with stress, which is off by its root


@dataclass(frozen=True)
class Compliance:
    """Of a body by the names of its interfaces: of the whole model, and of its shapes (6 I, 6 I)."""

    interfaces: tuple[str, ...]
    whole: Array
    shown: Array


def energies(view: View) -> Array:
    """(3, B) strain energy [J] that the loads at the interfaces of each body cause, or that it has if that is more, what its
    shapes leave out of it, and the time [s]: of the row in which they deform it most. Zeros where it is not known: of
    bodies without compliance, with loads at other points than its interfaces, or that are tied by couplings."""
    scene = view.system.scene
    found = np.zeros((3, len(scene.bodies)))
    for b, body in enumerate(scene.bodies):
        known = compliance(body.model)
        if known is None or _elsewhere(view, b, known):
            continue
        loads = _reactions(view, b, known)
        for row in _rows(view, b, known, loads):
            load = loads[row] + _applied(view, b, known, row)
            whole, shown = (0.5 * float(load @ G @ load) for G in (known.whole, known.shown))
            most = max(whole, 0.5 * float(view.q(b)[row] ** 2 @ body.model.omega2))
            if most > found[0, b]:
                found[:, b] = most, whole - shown, view.record.time[row]
    return found


def _rows(view: View, b: int, known: Compliance, reactions: Array) -> set[int]:
    """Rows that are looked at, where reactions, or a force that acts on body b, or what its shapes have of both is largest:
    a body that nothing holds has no reactions."""
    scene, at = view.system.scene, markers(view.system.scene)
    sizes = [
        np.einsum("ti,ij,tj->t", reactions, known.whole, reactions),
        view.q(b) ** 2 @ scene.bodies[b].model.omega2,
    ]
    for number, one in enumerate(forces_of(scene)):
        if any(at[end][0] == b for end in _ends(scene, one.place)):
            values = measured_values(view, number, _columns(one.place))
            sizes.append(np.linalg.norm(values.reshape(view.rows, -1), axis=1))
    return {int(np.argmax(size)) for size in sizes}


def _elsewhere(view: View, b: int, known: Compliance) -> bool:
    """Whether something acts on body b that is no load at an interface, or on two of them at once."""
    scene, at = view.system.scene, markers(view.system.scene)
    if any(isinstance(force.place, OnBody) and force.place.ends(scene)[0] == b for force in forces_of(scene)):
        return True
    blocks = [block.markers for block in view.system.blocks]
    tied = any(len(ends) > 2 and any(at[k][0] == b for k in ends) for ends in blocks)
    ends = [
        tuple(k for k in ends if at[k][0] == b)
        for ends in (*blocks, *(_ends(scene, f.place) for f in forces_of(scene)))
    ]
    return tied or any(len(own) > 1 or any(at[k][2] not in known.interfaces for k in own) for own in ends)


def _ends(scene: Scene, place: Place) -> tuple[int, ...]:
    """Numbers of the markers on which something acts."""
    return tuple(marker_number(scene, name) for name in place.markers(scene))


def _reactions(view: View, b: int, known: Compliance) -> Array:
    """(T, 6 I) forces and moments that joints and drivers exert at the interfaces, axes of the body."""
    record, at, A = view.record, markers(view.system.scene), view.axes(b)
    loads = np.zeros((view.rows, len(known.interfaces), 2, 3))
    for number, block in enumerate(view.system.blocks):
        i, j = block.markers[:2]
        force, moment = record.reaction[:, number, :3], record.reaction[:, number, 3:]
        if at[j][0] == b:
            loads[:, known.interfaces.index(at[j][2])] += np.stack([to_axes(A, force), to_axes(A, moment)], axis=1)
        if at[i][0] == b:  # told at the marker of the second body, and opposite
            there = moment + cross(record.r[:, j] - record.r[:, i], force)
            loads[:, known.interfaces.index(at[i][2])] -= np.stack([to_axes(A, force), to_axes(A, there)], axis=1)
    return loads.reshape(view.rows, -1)


def _applied(view: View, b: int, known: Compliance, row: int) -> Array:
    """(6 I,) what recorded forces exert there, axes of the body: rigid motion tells a force and its moment about a point."""
    scene, place, record, at = view.system.scene, view.system.layout, view.record, markers(view.system.scene)
    now = At(scene, place, float(record.time[row]), record.x[row], record.v[row])
    loads = np.zeros((len(known.interfaces), 2, 3))
    for number, one in enumerate(forces_of(scene)):
        for end in _ends(scene, one.place):
            if at[end][0] == b:
                Q = acting(now, one.place, measured_values(view, number, _columns(one.place))[row])
                arm = view.axes(b)[row].T @ (record.r[row, end] - record.x[row, place.R(b)])
                force, moment = Q[place.R_dot(b)], Q[place.omega(b)]
                loads[known.interfaces.index(at[end][2])] += [force, moment - np.cross(arm, force)]
    return loads.ravel()


def _columns(place: Place) -> slice:
    """Of what is recorded of a force there, the force itself."""
    if isinstance(place, AtMarker):
        return slice(0, 6)
    return SIX if isinstance(place, BetweenAxes) else slice(FORCE, FORCE + 1)


def left_out(scene: Scene, found: Array) -> Iterator[str]:
    """Notes on bodies with these energies (3, B)."""
    for body, (whole, missing, time) in zip(scene.bodies, found.T, strict=True):
        if missing > (OF_STRESS if _stressed(body.model) else TOLD) * whole:
            yield (
                f"body {owner(body)!r}: its shapes leave out {percent_in_words(missing / whole)} of the strain energy that "
                f"the loads at its interfaces cause, as at t = {time:.4g} s: it deflects by less, and its stress is off; "
                "reduce it with craig-bampton or rubin, or add attachment modes"
            )


def _stressed(model: FlexibleBody) -> bool:
    surface = model.surface
    return surface is not None and (surface.stress is not None or surface.beams is not None)


def compliance(model: FlexibleBody) -> Compliance | None:
    """None where the reduction kept none."""
    return remembered(model, "compliance", lambda: _compliance(model))


def _compliance(model: FlexibleBody) -> Compliance | None:
    kept = model.provenance.get(HELD)
    if not model.n or kept is None or "compliance" not in kept:
        return None
    motions, M = interface_motions(model), mass_of_motions(model)
    balanced = motions[:, 6:] - motions[:, :6] @ np.linalg.solve(M[:6, :6], M[:6, 6:])
    own = [interface.name for interface in model.interfaces]
    names = tuple(name for name in kept["interfaces"] if name in own)
    rows, columns = (
        np.concatenate([6 * among.index(name) + np.arange(6) for name in names] or [np.zeros(0, int)])
        for among in (own, kept["interfaces"])
    )
    flexible = balanced[rows] / np.sqrt(model.omega2)
    return Compliance(names, np.array(kept["compliance"])[np.ix_(columns, columns)], flexible @ flexible.T)
