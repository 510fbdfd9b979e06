"""Planar scenes: found or declared, and reduced to what moves in the plane.

A scene is planar about a global axis when its joints hold every body in the plane across that axis and nothing pushes
against them: every body has a body axis along the normal and is symmetric about the plane through its origin, markers
that are used lie in that plane, axes of joints are in the plane or along the normal, and so are forces. Then the in-plane
motion and all reactions are those of the spatial scene, while a body has three rigid coordinates, no out-of-plane modes,
and a revolute joint two rows.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, replace

import numpy as np

from ffr_dyn.functions.time_functions import is_zero
from ffr_dyn.scene.drivers import PointDriver
from ffr_dyn.scene.force_kinds import forces_of, in_bases
from ffr_dyn.scene.own_frame import OwnFrame
from ffr_dyn.scene.scene import Body, Scene, body_normal, marker_number, undeformed
from ffr_dyn.variants.variant import used_interfaces, with_modes
from ffr_prep.body import FlexibleBody, FrameMarker, Interface, axial
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

AXES = "xyz"
_ZERO = 1e-9
_MIXED = 1e-12  # of a mode of norm one
# What the search for a plane understands; a scene with anything else is planar only when it is declared so.
_KNOWN = {"bodies", "joints", "drivers", "couplings", "loads", "springs", "forces", "ground"}
_KNOWN |= {"gravity", "base_acceleration", "measurements", "name", "plane"}


def planar_forms(scene: Scene) -> Iterator[Scene]:
    """The scene with in-plane modes only, for every plane that its declarations allow; `plane` is the normal.

    Whether the joints too keep to the plane is for their rows to tell. Raises InputError for a scene that is declared
    planar and has something across the plane.
    """
    if scene.plane in AXES:
        normal = AXES.index(scene.plane)
        for obstacle in _across(scene, normal):
            raise InputError(f"the scene is declared planar with the normal {scene.plane}, but {obstacle}")
        yield _in_plane(scene, normal, strict=False)
    if scene.plane == "auto":
        for normal in range(3):
            if not any(True for _ in _obstacles(scene, normal)):
                yield _in_plane(scene, normal, strict=True)


def _in_plane(scene: Scene, normal: int, *, strict: bool) -> Scene:
    bodies, kept = [], {}
    for body in scene.bodies:
        k = body_normal(body, normal)
        used = used_interfaces(scene, body)
        keep = np.flatnonzero(_stays(body.model, k, used) if strict else _mostly(body.model, k, used))
        reduced = with_modes(body, keep.tolist())
        model = _without_rounding(reduced.model, k, used)
        frame = reduced.frame and _frame_in_plane(reduced.frame, reduced.model, k, used)
        bodies.append(replace(reduced, model=model, frame=frame, kept=(tuple(keep.tolist()), body.model.n)))
        kept[body.name] = np.eye(body.model.n)[:, keep]
    return replace(scene, bodies=tuple(bodies), forces=in_bases(scene.forces, kept), plane=AXES[normal])


# ---- what stands in the way ---------------------------------------------------------------------------------------


def _across(scene: Scene, normal: int) -> Iterator[str]:
    """What makes a planar motion impossible, in words."""
    if abs(scene.gravity[normal]) > _ZERO * np.linalg.norm(scene.gravity):
        yield f"gravity has the component {scene.gravity[normal]:g} m/s^2 along it"
    if not is_zero(scene.base_acceleration[normal]):
        yield "base_acceleration has a component along it"
    for body in scene.bodies:
        k = body_normal(body, normal)
        if k < 0:
            yield f"no axis of body {body.name!r} is along it"
        elif abs(body.velocity[normal]) > _ZERO * np.linalg.norm(body.velocity):
            yield f"body {body.name!r} starts with a velocity along it"
        elif np.abs(np.delete(body.omega_bar, k)).max() > _ZERO * np.linalg.norm(body.omega_bar):
            yield f"body {body.name!r} starts with an angular velocity across it"
    for driver in scene.drivers:
        if isinstance(driver, PointDriver) and (driver.x, driver.y, driver.z)[normal] is not None:
            yield f"driver {driver.name!r} prescribes a motion along it"


def _obstacles(scene: Scene, normal: int) -> Iterator[str]:
    """What may take the motion out of the plane, or makes reactions that a planar scene does not have."""
    yield from _across(scene, normal)
    if any(f.name not in _KNOWN and getattr(scene, f.name) for f in fields(scene)):
        yield "there are forces of other kinds"
    for body in scene.bodies:
        k = body_normal(body, normal)
        if not _symmetric(body, k, used_interfaces(scene, body)):
            yield f"body {body.name!r} is not symmetric"
    for force in forces_of(scene):
        if not force.stays_in_plane(scene, normal):
            yield f"force {force.name!r} may act across"
    for joint in scene.joints:
        i, j = (undeformed(scene, marker_number(scene, name))[normal] for name in (joint.i, joint.j))
        if round(abs(i - j), 9) > 0:
            yield f"joint {joint.name!r} runs aslant"


# ---- symmetry of a body -------------------------------------------------------------------------------------------


def _symmetric(part: Body, k: int, used: Sequence[str]) -> bool:
    """Whether in-plane motion excites nothing across body axis k, neither rigid nor elastic."""
    if k < 0:
        return False
    body = part.model
    a, b = (c for c in range(3) if c != k)
    length = _length(body)
    offsets = [body.r_dm[k] / body.mass, *(body.interface(name).position[k] for name in used)]
    products = [body.rr_dm[a, k], body.rr_dm[b, k]]
    if np.abs(offsets).max() > _ZERO * length or np.abs(products).max() > _ZERO * body.mass * length**2:
        return False
    stays, leaves = _stays(body, k, used), _leaves(body, k, used)
    if (stays == leaves).any():
        return False
    if part.stiffening and body.stiffening is not None and not _splits(body, stays, k, used):
        return False
    PP, turning = body.PP_dm, axial(body.PP_dm)
    mixed = np.array([PP[a, a] + PP[b, b], turning[k]])[:, stays][:, :, leaves]
    out = np.array([PP[a, k], PP[b, k], turning[a], turning[b]])[:, stays][:, :, stays]
    return bool(max(np.abs(mixed).max(initial=0.0), np.abs(out).max(initial=0.0)) < _ZERO)


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


def _stays(body: FlexibleBody, k: int, used: Sequence[str]) -> Array:
    """(n,) which modes have no momentum, and move no marker that is used, across the plane."""
    return _motion_across(body, k, used) < _ZERO * _sizes(body, used)


def _leaves(body: FlexibleBody, k: int, used: Sequence[str]) -> Array:
    """(n,) which modes have no momentum, and move no marker that is used, in the plane."""
    return _motion_along(body, k, used) < _ZERO * _sizes(body, used)


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
    shape, length = np.sqrt(body.mass), _length(body)
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
    shape, length = np.sqrt(body.mass), _length(body)
    ends = [body.interface(name) for name in used]
    motions = [np.ones((1, body.n)), *(i.phi_t * shape for i in ends), *(i.phi_r * shape * length for i in ends)]
    return np.abs(np.vstack(motions)).max(axis=0)


def _length(body: FlexibleBody) -> float:
    return float(np.sqrt(np.trace(body.rr_dm) / body.mass))


def _without_rounding(body: FlexibleBody, k: int, used: Sequence[str]) -> FlexibleBody:
    """The body with zeros where the symmetry of in-plane modes asks for them and only rounding is left.

    Rows of joints across the plane then vanish exactly, however large the modes are.
    """
    if not body.n:
        return body
    a, b = (c for c in range(3) if c != k)
    size, length, shape = _sizes(body, used), _length(body), np.sqrt(body.mass)
    pairs = np.sqrt(np.outer(size, size))
    P_dm, rP_dm, PP_dm = body.P_dm.copy(), body.rP_dm.copy(), body.PP_dm.copy()
    _drop(P_dm[k], size * shape)
    for c in (a, b):
        for one, other in ((c, k), (k, c)):
            _drop(rP_dm[one, other], size * shape * length)
            _drop(PP_dm[one, other], pairs)
    interfaces = tuple(
        replace(i, phi_t=phi_t, phi_r=phi_r) if i.name in used else i
        for i, (phi_t, phi_r) in ((i, _shapes_in_plane(i, body, k, size)) for i in body.interfaces)
    )
    stiffening = None if body.stiffening is None else _matrices_in_plane(body.stiffening, _first_loads(body, used), k)
    return replace(body, P_dm=P_dm, rP_dm=rP_dm, PP_dm=PP_dm, interfaces=interfaces, stiffening=stiffening)


def _shapes_in_plane(marker: Interface | FrameMarker, body: FlexibleBody, k: int, size: Array) -> tuple[Array, Array]:
    """phi_t and phi_r of an interface, or of the frame, without the rounding across the plane."""
    phi_t, phi_r, shape = marker.phi_t.copy(), marker.phi_r.copy(), np.sqrt(body.mass)
    _drop(phi_t[k], size / shape)
    for c in range(3):
        if c != k:
            _drop(phi_r[c], size / (shape * _length(body)))
    return phi_t, phi_r


def _frame_in_plane(frame: OwnFrame, body: FlexibleBody, k: int, used: Sequence[str]) -> OwnFrame:
    """The own frame of a body, without the rounding that moves it, or modes, across the plane."""
    old = frame.marker
    phi_t, phi_r = _shapes_in_plane(old, body, k, _sizes(body, used))
    marker = replace(old, phi_t=phi_t, phi_r=phi_r, K=_matrices_in_plane(old.K, [0], k))
    return replace(frame, marker=marker, C=np.where(np.abs(frame.C) < _MIXED, 0.0, frame.C))


def _matrices_in_plane(matrices: Array, firsts: Sequence[int], k: int) -> Array:
    """Load matrices without what moves places across the plane to second order; firsts : the first of the six loads at each
    place."""
    K = np.array(matrices)
    for first in firsts:
        K[[first + k, *(first + 3 + c for c in range(3) if c != k)]] = 0.0
    return K


def _drop(part: Array, size: Array) -> None:
    part[np.abs(part) < _ZERO * size] = 0.0


def _mostly(body: FlexibleBody, k: int, used: Sequence[str]) -> Array:
    """(n,) which modes move the body and its markers more in the plane than across.

    Of a mode that does neither, such as a twist with both ends held, the larger part of its motion decides.
    """
    along, across = _motion_along(body, k, used), _motion_across(body, k, used)
    neither = np.maximum(along, across) < _ZERO * _sizes(body, used)
    return np.where(neither, np.einsum("jj->j", body.PP_dm[k, k]) < 0.5, along >= across)
