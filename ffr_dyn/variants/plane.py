"""Planar scenes: found or declared, and reduced to what moves in the plane.

A scene is planar about a global axis when its joints hold every body in the plane across that axis and nothing pushes
against them: every body has a body axis along the normal and is symmetric about a plane across it, markers
that are used lie in that plane, axes of joints are in the plane or along the normal, and so are forces. Then the in-plane
motion and all reactions are those of the spatial scene, while a body has three rigid coordinates, no out-of-plane modes,
and a revolute joint two rows. What a mesh leaves of symmetry and places counts as nothing (`ffr_dyn.variants.aligned`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import fields, replace
from functools import partial
from typing import TypeVar

import numpy as np

from ffr_dyn.functions.time_functions import is_zero
from ffr_dyn.scene.drivers import PointDriver
from ffr_dyn.scene.force_kinds import forces_of, in_bases
from ffr_dyn.scene.forces.places import LEVEL, OnJoint
from ffr_dyn.scene.own_frame import OwnFrame
from ffr_dyn.scene.scene import Body, Scene, altered, body_normal, marker_number, undeformed, used_interfaces
from ffr_dyn.variants.aligned import BESIDE, about_height, basis_in_plane, combined, height_of, levelled, size_of
from ffr_dyn.variants.variant import with_basis, with_modes
from ffr_prep.body import FlexibleBody, FrameMarker, Interface, axial, of_plane, remembered
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

Marker = TypeVar("Marker", Interface, FrameMarker)

AXES = "xyz"
_NOTHING = 1e-9  # of gravity and velocities
_ZERO = 5e-8  # of the motion of a mode: what a symmetric mesh leaves; what it does to the motion goes with the square
_LEFT_OUT = 0.05  # of the motion of a mode: what a declaration may leave out of it
_MIXED = 1e-12  # of a mode of norm one
# What the search for a plane understands; a scene with anything else is planar only when it is declared so.
_KNOWN = {"bodies", "joints", "drivers", "couplings", "loads", "springs", "forces", "ground"}
_KNOWN |= {"gravity", "base_acceleration", "measurements", "name", "plane"}
_OTHERS = [field.name for field in fields(Scene) if field.name not in _KNOWN]


def planar_forms(scene: Scene) -> Iterator[Scene]:
    """The scene with in-plane modes only, for every plane that its declarations allow; `plane` is the normal.

    Whether the joints too keep to the plane is for their rows to tell. Raises InputError for a scene that is declared
    planar and has something across the plane.
    """
    if scene.plane in AXES:
        normal = AXES.index(scene.plane)
        scene = levelled(scene, normal)
        for obstacle in _across(scene, normal):
            raise InputError(
                f"the scene is declared planar with the normal {scene.plane}, but {obstacle}; take that away, or "
                'declare plane = "none"'
            )
        _check_declared(scene, normal)
        yield _in_plane(scene, normal)
    if scene.plane == "auto":
        for normal in range(3):
            if any(True for _ in _across(scene, normal)):
                continue  # whatever its height is
            level = levelled(scene, normal)
            if not any(True for _ in _leaving(level, normal)):
                yield _in_plane(level, normal)


def _check_declared(scene: Scene, normal: int) -> None:
    """InputError where a declared plane would leave out much of what a mode does."""
    for body in scene.bodies:
        k, used = body_normal(body, normal), used_interfaces(scene, body)
        if not body.model.n:
            continue
        share, text = remembered(body.model, ("declared", k, used, _ratios(body)), partial(_left_out, body, k, used))
        if share > _LEFT_OUT:
            raise InputError(
                f"the scene is declared planar with the normal {scene.plane}, but {text}, of body {body.name!r}: reduce it "
                "with all modes of one frequency, which is one mode more or fewer, or symmetric about the plane; or declare "
                'plane = "none"'
            )


def _left_out(body: Body, k: int, used: Sequence[str]) -> tuple[float, str]:
    V = basis_in_plane(body, k)
    return _most_mixed(_judged(body.model if V is None else with_basis(body.model, V), k, used), k, used)


def obstacles(scene: Scene) -> tuple[str, tuple[str, ...]]:
    """The normal of the plane that a scene is nearest to, and what keeps it from being computed in it, in words."""
    level = [levelled(scene, normal) for normal in range(3)]
    found = [tuple(_obstacles(form, normal)) for normal, form in enumerate(level)]
    moving = [len(tuple(_across(form, normal))) for normal, form in enumerate(level)]
    # A motion across it counts more than what only may leave it.
    nearest = min((2, 1, 0), key=lambda normal: 2 * moving[normal] + len(found[normal]))
    return AXES[nearest], found[nearest]


def _in_plane(scene: Scene, normal: int) -> Scene:
    bodies, kept = [], {}
    for body in scene.bodies:
        made = altered(body, kept=body.kept or ((), 0))
        if body.model.n:
            made, kept[body.name] = _body_in_plane(body, body_normal(body, normal), used_interfaces(scene, body))
        bodies.append(made)
    return altered(scene, bodies=tuple(bodies), forces=in_bases(scene.forces, kept), plane=AXES[normal])


def _body_in_plane(body: Body, k: int, used: tuple[str, ...]) -> tuple[Body, Array]:
    """A flexible body with the modes that move it in the plane across its axis k, and these in its coordinates (n, m)."""
    (_, model, frame), V, keep = remembered(
        body.model, ("in plane", k, used, _ratios(body), id(body.frame)), lambda: _form_in_plane(body, k, used)
    )
    q, q_dot = ((values if V is None else V.T @ values)[keep] for values in (body.q, body.q_dot))
    numbers = tuple(keep.tolist()), body.model.n
    made = altered(body, model=model, frame=frame, q=q, q_dot=q_dot, damping=body.damping[keep], kept=numbers)
    return made, (np.eye(body.model.n) if V is None else V)[:, keep]


def _form_in_plane(
    body: Body, k: int, used: tuple[str, ...]
) -> tuple[tuple[OwnFrame | None, FlexibleBody, OwnFrame | None], Array | None, Array]:
    """The frame that it is the form of, the model and its frame; the basis of double modes; the modes that stay."""
    V = basis_in_plane(body, k)
    turned = body if V is None else combined(body, V)
    keep = np.flatnonzero(_mostly(_judged(turned.model, k, used), k, used))
    reduced = with_modes(turned, keep.tolist())
    frame = reduced.frame and _flat_frame(reduced.frame, k)
    return (body.frame, _flat(reduced.model, k, used), frame), V, keep


def _ratios(body: Body) -> bytes:
    """The part of the damping of a body that tells double modes apart: empty where all ratios are one."""
    return body.damping.tobytes() if len(set(body.damping.tolist())) > 1 else b""


# ---- what stands in the way ---------------------------------------------------------------------------------------


def _across(scene: Scene, normal: int) -> Iterator[str]:
    """The reasons why a planar motion is impossible, in words."""
    if _has_part(scene.gravity, normal):
        yield f"gravity has the component {scene.gravity[normal]:g} m/s^2 along it"
    if not is_zero(scene.base_acceleration[normal]):
        yield "base_acceleration has a component along it"
    for body in scene.bodies:
        k = body_normal(body, normal)
        if k < 0:
            yield f"no axis of the frame of body {body.name!r} is along it"
        elif _has_part(body.velocity, normal):
            yield f"body {body.name!r} starts with a velocity along it"
        elif not body.omega_bar.any():
            continue
        elif np.abs(np.delete(body.omega_bar, k)).max() > _NOTHING * np.linalg.norm(body.omega_bar):
            yield f"body {body.name!r} starts with an angular velocity across it"
    for driver in scene.drivers:
        if isinstance(driver, PointDriver):
            if (driver.x, driver.y, driver.z)[normal] is not None:
                yield f"driver {driver.name!r} prescribes a motion along it"
        elif not OnJoint(driver.name, driver.joint, driver.coordinate).stays_in_plane(scene, normal):
            yield f"driver {driver.name!r} prescribes a motion across it"


def _has_part(vector: Array, k: int) -> bool:
    """Whether a component of a vector is more than nothing."""
    numbers: list[float] = vector.tolist()
    return abs(numbers[k]) > _NOTHING * math.hypot(*numbers)


def _obstacles(scene: Scene, normal: int) -> Iterator[str]:
    """The reasons why a planar motion is impossible, may leave the plane, or has reactions across it."""
    yield from _across(scene, normal)
    yield from _leaving(scene, normal)


def _leaving(scene: Scene, normal: int) -> Iterator[str]:
    """The loads that may take the motion out of the plane, or make reactions that a planar scene does not have."""
    if any(getattr(scene, name) for name in _OTHERS):
        yield "there are forces of other kinds"
    for body in scene.bodies:
        k = body_normal(body, normal)
        if k >= 0 and (aslant := _asymmetry(body, k, used_interfaces(scene, body))):
            yield f"body {body.name!r} is not symmetric about it: {aslant}"
    for force in forces_of(scene):
        if not force.stays_in_plane(scene, normal):
            yield f"force {force.name!r} may act across"
    for joint in scene.joints:
        i, j = (undeformed(scene, marker_number(scene, name))[normal] for name in (joint.i, joint.j))
        if abs(i - j) > LEVEL:
            yield f"joint {joint.name!r} runs aslant: its points are {abs(i - j):.3g} m apart along the normal"


# ---- symmetry of a body -------------------------------------------------------------------------------------------


def _judged(model: FlexibleBody, k: int, used: Sequence[str]) -> FlexibleBody:
    """A body from an origin in the plane across its axis k about which it may be symmetric."""
    return about_height(model, k, height_of(model, k, tuple(used)))


def _asymmetry(part: Body, k: int, used: tuple[str, ...]) -> str:
    """The in-plane motion that excites something across body axis k, rigid or elastic, in words; "" of a symmetric body."""
    key = "asymmetry", k, used, part.stiffening, _ratios(part) if part.model.n else b""
    return remembered(part.model, key, lambda: _found_asymmetry(part, k, used))


def _found_asymmetry(part: Body, k: int, used: tuple[str, ...]) -> str:
    V = basis_in_plane(part, k)
    body, length = _judged(part.model if V is None else with_basis(part.model, V), k, used), size_of(part.model)
    places = {"its centre of mass": body.centre_of_mass[k]} | {name: body.interface(name).position[k] for name in used}
    off = max(places, key=lambda name: abs(places[name]))
    if abs(places[off]) > BESIDE * length:
        return f"{off} is {abs(places[off]):.3g} m off the plane through its centre of mass"
    products, whole = max(abs(body.rr_dm[k, c]) for c in range(3) if c != k), body.mass * length**2
    if products > BESIDE * whole:
        return f"a product of inertia is {products / whole:.2g} of its moments"
    if not body.n:
        return ""
    mixed = _mixed_modes(body, k, used, second_order=part.stiffening and body.stiffening is not None)
    return mixed or _mixed_damping(body, _mostly(body, k, used))


def _mixed_damping(body: FlexibleBody, stays: Array) -> str:
    if body.damping is None:
        return ""
    beside = np.abs(body.damping[np.ix_(stays, ~stays)]).max(initial=0.0) / np.abs(body.damping).max()
    return f"its damping couples modes in the plane and across it by {beside:.2g}" if beside >= _ZERO else ""


def _mixed_modes(body: FlexibleBody, k: int, used: Sequence[str], *, second_order: bool) -> str:
    share, text = _most_mixed(body, k, used)
    if share >= _ZERO:
        return text
    stays = _mostly(body, k, used)
    if (coupling := _coupling(body, stays, k)) >= _ZERO:
        return f"its mass couples modes in the plane and across it by {coupling:.2g}"
    if second_order and not _splits(body, stays, k, used):
        return "its second-order displacement couples modes in the plane and across it"
    return ""


def _most_mixed(body: FlexibleBody, k: int, used: Sequence[str]) -> tuple[float, str]:
    """Of the mode that is least in the plane or across it alone, how much of its motion goes the other way; in words."""
    size = _sizes(body, used)
    along, across = _motion_along(body, k, used) / size, _motion_across(body, k, used) / size
    mixed = np.minimum(along, across)
    j = int(np.argmax(mixed))
    way, hertz = "across" if along[j] > across[j] else "in", np.sqrt(body.omega2[j]) / (2 * np.pi)
    return float(mixed[j]), f"mode {j + 1} ({hertz:.4g} Hz) makes {mixed[j]:.2g} of its motion {way} the plane"


def _coupling(body: FlexibleBody, stays: Array, k: int) -> float:
    """Of the second moments, between modes that stay in the plane and others, and of those that stay across it."""
    a, b = (c for c in range(3) if c != k)
    PP, turning = body.PP_dm, axial(body.PP_dm)
    mixed = np.array([PP[a, a] + PP[b, b], turning[k]])[:, stays][:, :, ~stays]
    out = np.array([PP[a, k], PP[b, k], turning[a], turning[b]])[:, stays][:, :, stays]
    return float(max(np.abs(mixed).max(initial=0.0), np.abs(out).max(initial=0.0)))


def _splits(body: FlexibleBody, stays: Array, k: int, used: Sequence[str]) -> bool:
    """Whether what stays in the plane across body axis k is moved in it alone to second order: no load in the plane couples
    modes that stay in it with modes that leave it, and none across it modes that stay."""
    K, in_plane = np.asarray(body.stiffening), [*(c for c in range(3) if c != k), 3 + k]
    products = np.isin(np.arange(6), [0, 1, 2, 5 - k])  # squares of rates, and the product about the axes in the plane
    groups = [(K[6:12], products)]
    for first in _first_loads(body, used):
        along = np.isin(np.arange(6), in_plane)
        groups += [(K[first + at : first + at + 3], along[at : at + 3]) for at in (0, 3)]
    return all(_keeps_apart(*group, stays) for group in groups)


def _first_loads(body: FlexibleBody, used: Sequence[str]) -> list[int]:
    """Numbers of the first load at each interface that is used."""
    return [12 + 6 * m for m, interface in enumerate(body.interfaces) if interface.name in used]


def _keeps_apart(K: Array, along: Array, stays: Array) -> bool:
    """Of matrices (l, n, n) of loads in the plane and across it, in the same units."""
    inside, mixed = K[:, stays][:, :, stays], K[:, stays][:, :, ~stays]
    wrong = np.concatenate([mixed[along].ravel(), inside[~along].ravel()])
    return bool(np.abs(wrong).max(initial=0.0) <= 1e-6 * np.abs(K).max(initial=0.0))


def _motion_across(body: FlexibleBody, k: int, used: Sequence[str]) -> Array:
    a, b = (c for c in range(3) if c != k)
    turning = axial(body.rP_dm)
    return _largest(body, [body.P_dm[k]], [turning[a], turning[b]], used, [k], [a, b])


def _motion_along(body: FlexibleBody, k: int, used: Sequence[str]) -> Array:
    a, b = (c for c in range(3) if c != k)
    moments = [axial(body.rP_dm)[k], body.rP_dm[a, a] + body.rP_dm[b, b]]
    return _largest(body, [body.P_dm[a], body.P_dm[b]], moments, used, [a, b], [k])


def _largest(
    body: FlexibleBody,
    momenta: list[Array],
    moments: list[Array],
    used: Sequence[str],
    shifts: list[int],
    turns: list[int],
) -> Array:
    """(n,) the largest of these that each mode makes, in units of 1/sqrt(mass)."""
    shape, length = np.sqrt(body.mass), size_of(body)
    parts = [part / shape for part in momenta]
    parts += [part / (shape * length) for part in moments]
    for name in used:
        interface = body.interface(name)
        parts += [interface.phi_t[c] * shape for c in shifts]
        parts += [interface.phi_r[c] * shape * length for c in turns]
    return np.abs(parts).max(axis=0)


def _sizes(body: FlexibleBody, used: Sequence[str]) -> Array:
    """(n,) of each mode: its largest translation, or rotation times the length of the body, at the markers that are used,
    or its mean displacement, which is one in units of 1/sqrt(mass)."""
    shape, length = np.sqrt(body.mass), size_of(body)
    ends = [body.interface(name) for name in used]
    motions = [np.ones((1, body.n)), *(i.phi_t * shape for i in ends), *(i.phi_r * shape * length for i in ends)]
    return np.abs(np.vstack(motions)).max(axis=0)


def _flat(body: FlexibleBody, k: int, used: Sequence[str]) -> FlexibleBody:
    """The body without what in-plane modes do across its plane, which of a symmetric body is rounding.

    Rows of joints across the plane then vanish exactly, however large the modes are.
    """
    if not body.n:
        return body
    a, b = (c for c in range(3) if c != k)
    P_dm, rP_dm, PP_dm = body.P_dm.copy(), body.rP_dm.copy(), body.PP_dm.copy()
    P_dm[k] = 0.0
    for part in (rP_dm, PP_dm):
        part[[a, b, k, k], [k, k, a, b]] = 0.0
    rP_dm[k, [a, b]] = height_of(body, k, tuple(used)) * P_dm[[a, b]]
    interfaces = tuple(_flat_marker(i, k) if i.name in used else i for i in body.interfaces)
    stiffening = None if body.stiffening is None else _matrices_in_plane(body.stiffening, _first_loads(body, used), k)
    made = replace(body, P_dm=P_dm, rP_dm=rP_dm, PP_dm=PP_dm, interfaces=interfaces, stiffening=stiffening)
    return replace(made, provenance=of_plane(body.provenance, k))


def _flat_marker(marker: Marker, k: int) -> Marker:
    """An interface, or the frame, that modes move in the plane only."""
    phi_t, phi_r = marker.phi_t.copy(), marker.phi_r.copy()
    phi_t[k] = phi_r[[c for c in range(3) if c != k]] = 0.0
    return replace(marker, phi_t=phi_t, phi_r=phi_r)


def _flat_frame(frame: OwnFrame, k: int) -> OwnFrame:
    """The own frame of a body that modes move in the plane only."""
    marker = replace(_flat_marker(frame.marker, k), K=_matrices_in_plane(frame.marker.K, [0], k))
    return replace(frame, marker=marker, C=np.where(np.abs(frame.C) < _MIXED, 0.0, frame.C))


def _matrices_in_plane(matrices: Array, firsts: Sequence[int], k: int) -> Array:
    """Load matrices without what moves places across the plane to second order; firsts : the first of the six loads at each
    place."""
    K = np.array(matrices)
    for first in firsts:
        K[[first + k, *(first + 3 + c for c in range(3) if c != k)]] = 0.0
    return K


def _mostly(body: FlexibleBody, k: int, used: Sequence[str]) -> Array:
    """(n,) which modes move the body and its markers more in the plane than across.

    Of a mode that does neither, such as a twist with both ends held, the larger part of its motion decides.
    """
    along, across = _motion_along(body, k, used), _motion_across(body, k, used)
    neither = np.maximum(along, across) < _ZERO * _sizes(body, used)
    return np.where(neither, np.einsum("jj->j", body.PP_dm[k, k]) < 0.5, along >= across)
