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
from ffr_dyn.scene.scene import Body, Scene, body_normal, marker_number, undeformed
from ffr_dyn.variants.variant import used_interfaces, with_modes
from ffr_prep.body import FlexibleBody, axial
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

AXES = "xyz"
_ZERO = 1e-9
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
        bodies.append(replace(reduced, model=model, kept=(tuple(keep.tolist()), body.model.n)))
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
    if part.stiffening and body.stiffening is not None and not _splits(body.stiffening, stays, k):
        return False
    PP, turning = body.PP_dm, axial(body.PP_dm)
    mixed = np.array([PP[a, a] + PP[b, b], turning[k]])[:, stays][:, :, leaves]
    out = np.array([PP[a, k], PP[b, k], turning[a], turning[b]])[:, stays][:, :, stays]
    return bool(max(np.abs(mixed).max(initial=0.0), np.abs(out).max(initial=0.0)) < _ZERO)


def _splits(stiffening: Array, stays: Array, k: int) -> bool:
    """Whether no load in the plane across body axis k couples modes that stay in the plane with modes that leave it."""
    in_plane = [c for c in range(3) if c != k] + [3 + k]
    acting = [*in_plane, 6 + k, *(c + first for first in range(12, len(stiffening), 6) for c in in_plane)]
    stiffening = stiffening[np.intersect1d(acting, stiffening_loads(stiffening))]
    scale = np.abs(stiffening).max(axis=(1, 2), initial=0.0)
    mixed = np.abs(stiffening[:, stays][:, :, ~stays]).max(axis=(1, 2), initial=0.0)
    return bool((mixed <= 1e-6 * scale).all())


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
    interfaces = []
    for interface in body.interfaces:
        phi_t, phi_r = interface.phi_t.copy(), interface.phi_r.copy()
        if interface.name in used:
            _drop(phi_t[k], size / shape)
            _drop(phi_r[a], size / (shape * length))
            _drop(phi_r[b], size / (shape * length))
        interfaces.append(replace(interface, phi_t=phi_t, phi_r=phi_r))
    return replace(body, P_dm=P_dm, rP_dm=rP_dm, PP_dm=PP_dm, interfaces=tuple(interfaces))


def _drop(part: Array, size: Array) -> None:
    part[np.abs(part) < _ZERO * size] = 0.0


def _mostly(body: FlexibleBody, k: int, used: Sequence[str]) -> Array:
    """(n,) which modes move the body and its markers more in the plane than across.

    Of a mode that does neither, such as a twist with both ends held, the larger part of its motion decides.
    """
    along, across = _motion_along(body, k, used), _motion_across(body, k, used)
    neither = np.maximum(along, across) < _ZERO * _sizes(body, used)
    return np.where(neither, np.einsum("jj->j", body.PP_dm[k, k]) < 0.5, along >= across)


_NOTHING = 1e-16  # of the stiffness by a load, relative to that by the others


def stiffening_loads(stiffening: Array) -> Array:
    """Numbers of the loads that do anything, but for rounding, to the stiffness (loads, n, n).

    Forces at an interface that the reference conditions hold do nothing.
    """
    size = np.abs(stiffening).max(axis=(1, 2), initial=0.0)
    return np.flatnonzero(size > _NOTHING * size.max(initial=0.0))
