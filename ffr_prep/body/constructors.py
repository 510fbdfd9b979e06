"""Bodies from numbers and from other bodies: rigid ones, fewer modes, other coordinates, one more point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ffr_prep.body.reduced import BodyError, FlexibleBody, Interface, Surface, axial
from ffr_prep.common.arrays import Array, ArrayLike


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
    """
    if not 0 < mass < np.inf:
        raise BodyError(f"body {name!r}: mass is {mass} kg; it must be positive")
    tensor = np.asarray(inertia, float)
    tensor = np.diag(tensor) if tensor.ndim == 1 else tensor
    if tensor.shape != (3, 3):
        raise BodyError(f"body {name!r}: inertia must be (3,) or (3, 3), not {np.shape(inertia)}")
    c = np.asarray(centre_of_mass, float)
    about_origin = tensor + mass * (c @ c * np.eye(3) - np.outer(c, c))
    nothing = np.zeros((3, 0))
    return FlexibleBody(
        name=name,
        mass=mass,
        r_dm=mass * c,
        rr_dm=0.5 * np.trace(about_origin) * np.eye(3) - about_origin,
        P_dm=nothing,
        rP_dm=np.zeros((3, 3, 0)),
        PP_dm=np.zeros((3, 3, 0, 0)),
        omega2=np.zeros(0),
        interfaces=tuple(Interface(key, np.asarray(at, float), nothing, nothing) for key, at in (points or {}).items()),
        surface=surface,
        provenance={"kind": "rigid"},
    )


def truncated(body: FlexibleBody, modes: int | Array) -> FlexibleBody:
    """The body with only its first ``modes`` elastic coordinates, or those whose indices are listed; so are its parts.

    Raises BodyError for a mode that does not exist or is listed twice.
    """
    if np.ndim(modes) == 0 and not 0 <= int(modes) <= body.n:
        raise BodyError(f"body {body.name!r} has {body.n} modes; asked to keep the first {int(modes)}")
    keep = np.arange(int(modes)) if np.ndim(modes) == 0 else np.asarray(modes, int)
    unknown = keep[(keep < 0) | (keep >= body.n)]
    if unknown.size or np.unique(keep).size < keep.size:
        raise BodyError(
            f"body {body.name!r} has {body.n} modes, counted from 0; asked to keep {keep.tolist()}: each must exist "
            "and be named once"
        )
    return replace(
        body,
        P_dm=body.P_dm[:, keep],
        rP_dm=body.rP_dm[:, :, keep],
        PP_dm=body.PP_dm[:, :, keep][:, :, :, keep],
        omega2=body.omega2[keep],
        interfaces=tuple(replace(i, phi_t=i.phi_t[:, keep], phi_r=i.phi_r[:, keep]) for i in body.interfaces),
        surface=body.surface and recombined(body.surface, np.eye(body.n)[:, keep], body.surface.Phi[:, :, keep]),
        stiffening=None if body.stiffening is None else body.stiffening[:, keep][:, :, keep],
        parts=tuple(truncated(part, modes if np.ndim(modes) else min(int(modes), part.n)) for part in body.parts),
    )


def recombined(surface: Surface, V: Array, Phi: Array) -> Surface:
    """The surface for other elastic coordinates p, with q = V p for V (n, m) and the basis Phi (P, 3, m).

    Phi may differ from the old basis times V by rigid motions, which cause no stress.
    """
    stress = None if surface.stress is None else surface.stress @ V
    beams = surface.beams and replace(surface.beams, modes=surface.beams.modes @ V)
    return replace(surface, Phi=Phi, stress=stress, beams=beams)


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

    Joints, forces and sensors can then attach there. Its rotation is the least-squares rotation of the node's
    neighbours on the surface. Nothing is added to the basis: what the node does under load is what the basis can show;
    loads there do not stiffen the body.

    Raises BodyError when the body has no surface, or the position is farther from it than half the size of the body.
    """
    if body.surface is None:
        raise BodyError(f"body {body.name!r} has no surface to put the point {name!r} on")
    points, Phi = body.surface.points, body.surface.Phi
    node = _nearest(body, name, points, np.asarray(position, float))
    here = np.flatnonzero((points == points[node]).all(1))  # points are there twice where materials meet
    around = body.surface.triangles[np.isin(body.surface.triangles, here).any(1)]
    ring = np.setdiff1d(around, here)
    ring = ring[np.sort(np.unique(points[ring], axis=0, return_index=True)[1])]
    arms, moved = points[ring] - points[node], Phi[ring] - Phi[node]
    # omega minimises sum |omega x arm - moved|^2, so (sum arm^2 I - arm arm^T) omega = sum arm x moved
    normal = (arms**2).sum() * np.eye(3) - arms.T @ arms
    phi_r = np.linalg.lstsq(normal, axial(np.einsum("pk,plj->klj", arms, moved)), rcond=None)[0]
    stiffening = body.stiffening
    if stiffening is not None:
        stiffening = np.concatenate([stiffening, np.zeros((6, body.n, body.n))])
    point = Interface(name, points[node], Phi[node], phi_r)
    interfaces = (*body.interfaces, point)
    return replace(
        body, interfaces=interfaces, stiffening=stiffening, parts=_parts_with_point(body, name, points[node])
    )


def _parts_with_point(body: FlexibleBody, name: str, position: Array) -> tuple[FlexibleBody, ...]:
    """The parts of a body with one more point, on the part that is nearest to it."""
    if not body.parts:
        return ()
    surfaces = [part.surface.points if part.surface else np.full((1, 3), np.inf) for part in body.parts]
    nearest = int(np.argmin([np.linalg.norm(points - position, axis=1).min() for points in surfaces]))
    return tuple(with_point(p, name, position) if k == nearest else p for k, p in enumerate(body.parts))
