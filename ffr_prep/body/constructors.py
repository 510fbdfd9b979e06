"""Bodies from numbers and from other bodies: rigid ones, other coordinates, one more point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from numbers import Real

import numpy as np

from ffr_prep.body.reduced import BeamForces, BodyError, FlexibleBody, Interface, Surface, axial
from ffr_prep.body.second_order import pair_values, recoordinated
from ffr_prep.common.arrays import Array, ArrayLike
from ffr_prep.common.errors import require_kind

MOVED_POINTS = "moved_points"  # of the provenance: where points were asked for that have no surface near
_OFF = 0.05  # of the size of a body: how far along its surface from its place a point is put without a word
_OFF_SURFACE = 1e-3  # of the same: how far from its surface a point may be asked for
_SAG = 0.25  # of an edge beside a node, by which the triangles of a coarse mesh miss a curved surface
_MOST = 1e60  # of masses, moments and lengths in SI units, so that their products are numbers still


def rigid_body(
    name: str,
    *,
    mass: float,
    inertia: ArrayLike,
    centre_of_mass: ArrayLike = (0.0, 0.0, 0.0),
    points: Mapping[str, ArrayLike] | None = None,
    surface: Surface | None = None,
) -> FlexibleBody:
    """A body without elastic coordinates.

    mass [kg]; inertia (3, 3) or its diagonal (3,) about the centre of mass, in body axes [kg m^2]; centre_of_mass (3,)
    [m] in the body frame; points: named points (3,) [m] in the body frame at which joints and forces may attach.
    Raises BodyError for a mass that is not positive, or an inertia that no mass distribution can have.

    >>> crank = fd.rigid_body("crank", mass=1.2, inertia=[1e-3, 1e-3, 2e-3], points={"pin": (0.05, 0, 0)})
    """
    require_kind(mass, Real, f"body {name!r}: mass", "kilograms, such as 1.2")
    if not 0 < mass < np.inf:
        raise BodyError(f"body {name!r}: mass is {mass} kg; it must be positive")
    if not isinstance(points, Mapping | None):
        raise BodyError(f"body {name!r}: points is {points!r}; give them by name, such as {{'pin': (0, 0, 0)}}")
    tensor = _numbers(name, "inertia", inertia)
    tensor = np.diag(tensor) if tensor.ndim == 1 else tensor
    if tensor.shape != (3, 3):
        raise BodyError(f"body {name!r}: inertia must be (3,) or (3, 3), not {np.shape(inertia)}")
    c = _numbers(name, "centre_of_mass", centre_of_mass)
    if c.shape != (3,):
        raise BodyError(f"body {name!r}: centre_of_mass must be (3,), not {c.shape}")
    if not np.abs([mass, *tensor.ravel(), *c.ravel()]).max() < _MOST:
        raise BodyError(
            f"body {name!r}: mass {mass:g} kg, inertia and centre of mass must be finite; give them in SI units"
        )
    places = {key: _numbers(name, f"point {key!r}", at) for key, at in (points or {}).items()}
    for key, at in places.items():
        check_point(f"body {name!r}: point", key, at)
    numbers = tuple((key, at.shape, at.tobytes()) for key, at in places.items())
    made = _rigid(name, float(mass), tensor.tobytes(), c.tobytes(), numbers)
    return made if surface is None else replace(made, surface=surface)


def _numbers(name: str, what: str, given: ArrayLike) -> Array:
    try:
        return np.asarray(given, float)
    except (TypeError, ValueError):
        raise BodyError(f"body {name!r}: {what} is {given!r}; give numbers") from None


@lru_cache(256)
def _rigid(
    name: str, mass: float, inertia: bytes, centre: bytes, points: tuple[tuple[str, tuple[int, ...], bytes], ...]
) -> FlexibleBody:
    """Rigid body; the last ones are known by their numbers: runs of a study share a crank, and what follows from it."""
    tensor, c = np.frombuffer(inertia).reshape(3, 3), np.frombuffer(centre)
    about_origin, nothing = tensor + mass * (c @ c * np.eye(3) - np.outer(c, c)), np.zeros((3, 0))
    places = ((key, np.frombuffer(at).reshape(shape)) for key, shape, at in points)
    return FlexibleBody(
        name=name,
        mass=mass,
        r_dm=mass * c,
        rr_dm=0.5 * np.trace(about_origin) * np.eye(3) - about_origin,
        P_dm=nothing,
        rP_dm=np.zeros((3, 3, 0)),
        PP_dm=np.zeros((3, 3, 0, 0)),
        omega2=np.zeros(0),
        interfaces=tuple(Interface(key, at, nothing, nothing) for key, at in places),
        provenance={"kind": "rigid"},
    )


def require_name(what: str, name: str) -> None:
    """BodyError for a name of an interface or a point that no quantity could carry."""
    if not name or "." in name or not name.isprintable():
        raise BodyError(
            f"{what} {name!r} cannot be called so: a name has no dot and no line break, and a letter at least"
        )


def check_point(what: str, name: str, at: ArrayLike) -> None:
    """BodyError for a point whose name no quantity could carry, or that is so far away that products of lengths overflow."""
    require_name(what, name)
    if not np.abs(np.asarray(at, float)).max() < _MOST:
        raise BodyError(f"{what} {name!r} is at {np.asarray(at, float).tolist()} m: coordinates are below {_MOST:g} m")


def recombined(surface: Surface, V: Array, Phi: Array) -> Surface:
    """The surface for other elastic coordinates p, with q = V p for V (n, m) and the basis Phi (P, 3, m).

    Phi may differ from the old basis times V by rigid motions, which cause no stress.
    """
    return replace(
        surface,
        Phi=Phi,
        stress=None if surface.stress is None else surface.stress @ V,
        beams=surface.beams and _recombined_forces(surface.beams, V),
        second=surface.second and recoordinated(surface.second, V),
        second_stress=surface.second_stress and recoordinated(surface.second_stress, V),
    )


def _recombined_forces(beams: BeamForces, V: Array) -> BeamForces:
    return replace(beams, modes=beams.modes @ V, second=beams.second and recoordinated(beams.second, V))


def _nearest(body: FlexibleBody, name: str, points: Array, position: Array) -> int:
    """Number of the surface node nearest to a position; a place far away is most likely one in millimetres."""
    distances = np.linalg.norm(points - position, axis=1)
    node = int(np.argmin(distances))
    if not distances[node] <= np.ptp(points, axis=0).max() / 2:
        ends = (position, points.min(axis=0), points.max(axis=0))
        at, low, high = (", ".join(f"{x:.4g}" for x in end) for end in ends)
        raise BodyError(
            f"body {body.name!r}: the point {name!r} at ({at}) m is {distances[node]:.3g} m from its surface, which lies "
            f"between ({low}) and ({high}) m; give a place on the body, in metres"
        )
    return node


def with_point(body: FlexibleBody, name: str, position: ArrayLike) -> FlexibleBody:
    """The body with one more interface, at the surface node nearest to `position` (3,) [m], body frame.

    Joints, forces and sensors can then attach there. Its rotation is that of the best fit to the node's neighbours on the
    surface. Nothing is added to the basis: what the node does under load is what the basis can show. A body with load
    matrices gets those of the point from the second-order displacement of its surface.

    A node that is farther away than its neighbours, and than a twentieth of the size of the body, is told (`units_doubts`),
    and so is a place that is off the surface, as on the axis of a beam or a bore: interfaces of the reduction can be there.

    Raises BodyError when the body has no surface, when it has load matrices and its surface no second-order displacement,
    or the position is farther from it than half the size of the body.

    >>> body = fd.with_point(body, "middle", (0.08, 0, 0))
    """
    if body.surface is None:
        raise BodyError(f"body {body.name!r} has no surface to put the point {name!r} on")
    points, Phi = body.surface.points, body.surface.Phi
    node = _nearest(body, name, points, np.asarray(position, float))
    ring = _neighbours(body.surface, node)
    arms, moved = points[ring] - points[node], Phi[ring] - Phi[node]
    # omega minimises sum |omega x arm - moved|^2, so (sum arm^2 I - arm arm^T) omega = sum arm x moved
    normal = (arms**2).sum() * np.eye(3) - arms.T @ arms
    phi_r = np.linalg.lstsq(normal, axial(np.einsum("pk,plj->klj", arms, moved)), rcond=None)[0]
    stiffening = body.stiffening
    if stiffening is not None:
        second = _second_motion(body, name, node, ring, phi_r)
        stiffening = np.concatenate([stiffening, -second])
    point = Interface(name, points[node], Phi[node], phi_r)
    interfaces = (*body.interfaces, point)
    parts = _parts_with_point(body, name, points[node])
    made = replace(body, interfaces=interfaces, stiffening=stiffening, parts=parts)
    asked = np.asarray(position, float)
    away, near = np.linalg.norm(asked - points[node]), np.linalg.norm(arms, axis=1)
    far, edge = max(near.max(initial=0.0), _OFF * body.size), near.min(initial=np.inf)
    if body.provenance.get("members"):  # the lids of beams lie within them, and sides between stations may be long
        told = away > max(edge / 2, _OFF_SURFACE * body.size)
    else:
        told = away > far or _from_surface(body.surface, asked) > max(_SAG * edge, _OFF_SURFACE * body.size)
    return _moved(made, name, asked.tolist()) if told else made


def _from_surface(surface: Surface, position: Array) -> float:
    """Distance [m] of a place (3,) from the triangles of a surface."""
    corners = surface.points[surface.triangles] - position
    if not len(corners):
        return np.inf
    edges = np.roll(corners, -1, axis=1) - corners
    lengths = np.einsum("tki,tki->tk", edges, edges)
    share = np.clip(-np.einsum("tki,tki->tk", corners, edges) / np.where(lengths > 0, lengths, 1.0), 0.0, 1.0)
    from_edges = np.linalg.norm(corners + share[..., None] * edges, axis=2).min(axis=1)
    normal = np.cross(edges[:, 0], edges[:, 1])
    above = np.einsum("tki,ti->tk", np.cross(corners, np.roll(corners, -1, axis=1)), normal)
    size = np.linalg.norm(normal, axis=1)
    inside = (above > 0).all(axis=1) & (size > 0)
    from_planes = np.abs(np.einsum("ti,ti->t", corners[:, 0], normal)) / np.where(size > 0, size, 1.0)
    return float(np.where(inside, from_planes, from_edges).min())


def _moved(body: FlexibleBody, name: str, asked: list[float]) -> FlexibleBody:
    """The body that knows where its point was asked for, and so does the part that has it."""
    moved = {**body.provenance.get(MOVED_POINTS, {}), name: asked}
    having = [any(i.name == name for i in part.interfaces) for part in body.parts]
    parts = [_moved(p, name, asked) if has else p for p, has in zip(body.parts, having, strict=True)]
    return replace(body, provenance={**body.provenance, MOVED_POINTS: moved}, parts=tuple(parts))


def _parts_with_point(body: FlexibleBody, name: str, position: Array) -> tuple[FlexibleBody, ...]:
    """The parts of a body with one more point, on the part that is nearest to it."""
    if not body.parts:
        return ()
    surfaces = [part.surface.points if part.surface else np.full((1, 3), np.inf) for part in body.parts]
    nearest = int(np.argmin([np.linalg.norm(points - position, axis=1).min() for points in surfaces]))
    return tuple(with_point(p, name, position) if k == nearest else p for k, p in enumerate(body.parts))


def _neighbours(surface: Surface, node: int) -> Array:
    """The points around a surface point; points are there twice where materials meet."""
    points = surface.points
    here = np.flatnonzero((points == points[node]).all(1))
    around = surface.triangles[np.isin(surface.triangles, here).any(1)]
    ring = np.setdiff1d(around, here)
    return ring[np.sort(np.unique(points[ring], axis=0, return_index=True)[1])]


def _second_motion(body: FlexibleBody, name: str, node: int, ring: Array, phi: Array) -> Array:
    """(6, n, n) second derivatives by q of translation and rotation vector of a surface node that turns by phi (3, n).

    The rotation vector of the best fit to second order, as in `ffr_prep.model.region_rotations`:
    phi + I_J^-1 (sum of arm x moved - (J phi) x phi / 2 - ((tr E) I - E) phi), with the stretch E and J = sum of arm arm^T.
    """
    surface = body.surface
    if surface is None or surface.second is None:
        raise BodyError(
            f"body {body.name!r} has load matrices, but no second-order displacement of its surface, which the point "
            f"{name!r} needs: reduce it again, or leave the second order out (stiffening = false in a scene file, "
            "replace(body, stiffening=None) in Python)"
        )
    translation = pair_values(surface.second, np.array([node]))[0]
    arms = surface.points[ring] - surface.points[node]
    moved = pair_values(surface.second, ring) - translation
    J = arms.T @ arms
    spread = np.einsum("pki,pm->kmi", surface.Phi[ring] - surface.Phi[node], arms)
    E = spread - np.cross(phi.T[:, None], J).transpose(2, 1, 0)
    of_rotation = np.cross((J @ phi).T[:, None], phi.T).transpose(2, 0, 1)
    of_stretch = np.einsum("kki,lj->lij", E, phi) - np.einsum("kli,lj->kij", E, phi)
    products = of_rotation / 2 + of_stretch
    turned = axial(np.einsum("pk,plij->klij", arms, moved)) - products - products.transpose(0, 2, 1)
    rotation = np.linalg.lstsq(np.trace(J) * np.eye(3) - J, turned.reshape(3, -1), rcond=None)[0]
    return np.concatenate([translation, rotation.reshape(turned.shape)])
