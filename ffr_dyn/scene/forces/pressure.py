"""Pressure on a body's surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from ffr_dyn.scene.fields import In, OfTime, OneOrMore
from ffr_dyn.scene.force_kinds import register_force
from ffr_dyn.scene.forces.checks import check_array, check_function
from ffr_dyn.scene.forces.distributed import (
    Affine,
    affine,
    arrows_on_surface,
    check_integrals,
    compiled_integrals,
    far_apart,
    indices,
    law_of_integrals,
    measured_factor,
    numbers_at,
    second_order,
    surface_of,
    unfollowed,
    unstiffened,
)
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.forces.places import OnBody
from ffr_dyn.scene.scene import Scene
from ffr_prep.body import FlexibleBody, Surface
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import choice

_NOTHING = 1e-3  # of what it does on one side: what is left of it where both sides are pressed


@register_force
@dataclass(frozen=True)
class Pressure(Force):
    """Pressure [Pa] on triangles of a body's surface; positive pushes against their outward normals.

    body : name of a flexible body
    pressure  : a number or one for each point of the surface (P,), linear over each triangle
    triangles : None for all, numbers of triangles, the name of a region that the body keeps (`ffr-prep reduce --region`),
                or a Python function of their centres (T, 3) [m], undeformed in the body frame, that returns which (T,) are
                loaded
    function  : factor over time: a number, a time function or a Python function
    follower  : True: area and normal follow the elastic deformation, to first order in q; False: they stay those of
                the undeformed body, fixed to its frame

    Raises InputError for values that are not finite, or of another shape than (P,).

    >>> wind = fd.Pressure("wind", "blade", pressure=2e3, follower=True)
    """

    word = "pressure"
    kernel = "ffr_dyn.kernels.forces.distributed:distributed"
    check, law, compiled = check_integrals, law_of_integrals, compiled_integrals
    acts = "pressure [Pa] on surface triangles, fixed to the frame or following the deformation to first order"
    positive = "against the outward normal"

    name: str
    body: str
    pressure: Annotated[Any, OneOrMore(In("Pa"))]
    triangles: Annotated[Any, list[int] | str] = None
    function: Annotated[Any, OfTime("1")] = 1.0
    follower: bool = False

    def __post_init__(self) -> None:
        who = f"pressure {self.name!r}"
        check_function(self.function, f"{who}: function")
        shape = np.shape(self.pressure)
        object.__setattr__(self, "pressure", check_array(self.pressure, shape[:1], f"{who}: pressure"))
        if self.triangles is not None and not (isinstance(self.triangles, str) or callable(self.triangles)):
            object.__setattr__(self, "triangles", indices(self.triangles, f"{who}: triangles"))

    @cached_property
    def place(self) -> OnBody:
        return OnBody(f"force {self.name!r}", self.body, measured=measured_factor(self))

    def doubts(self, scene: Scene) -> tuple[str, ...]:
        body = self.place.of(scene).model
        if not self._cancels(body):
            return (*unstiffened(self, scene), *unfollowed(self, scene, *self._nodal(body)))
        return (
            f"force {self.name!r} does next to nothing: over all of the surface that it acts on it cancels, as on both faces "
            f"of a plate, and the modes of {self.body!r} show none of it; give the triangles of the side that it acts on",
        )

    def _cancels(self, body: FlexibleBody) -> bool:
        """Whether next to nothing is left of what it does on the triangles that face as the first one does."""
        surface = surface_of(body, self.name)
        chosen = self._chosen(body, surface)
        a, b, c = np.moveaxis(surface.points[surface.triangles[chosen]], 1, 0)
        normal = np.cross(b - a, c - a)
        one_side = replace(self, triangles=chosen[normal @ normal[0] > 0])
        whole, part = (_sizes(load.integrals(body).constant, body) for load in (self, one_side))
        return bool((whole <= _NOTHING * part).all())

    def drawn(self, scene: Scene) -> dict[str, Any]:
        """The pressure at few of the triangles (`arrows_on_surface`)."""
        body = self.place.of(scene).model
        surface = surface_of(body, self.name)
        corners = surface.triangles[self._chosen(body, surface)]
        corners = corners[far_apart(surface.points[corners].mean(axis=1))]
        a, b, c = np.moveaxis(surface.points[corners], 1, 0)
        normal = np.cross(b - a, c - a)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
        pressure = self._at_points(body, surface)[corners].mean(axis=1)
        return arrows_on_surface(self, "Pa", corners, -pressure[:, None] * normal, np.sign(pressure).astype(int))

    def on_parts(self, whole: FlexibleBody, parts: Mapping[str, FlexibleBody]) -> tuple[Force, ...]:
        """The same pressure on the triangles of each part that are those of the whole: not on its cuts.

        Raises InputError when the surfaces of the parts have other triangles.
        """
        surface = surface_of(whole, self.name)
        chosen, pressure = surface.triangles[self._chosen(whole, surface)], self._at_points(whole, surface)
        centres, found, left = surface.points[chosen].mean(axis=1), [], len(chosen)
        for k, (name, part) in enumerate(parts.items(), 1):
            own = surface_of(part, self.name)
            loaded = np.flatnonzero(numbers_at(own.points[own.triangles].mean(axis=1), centres) >= 0)
            at = numbers_at(own.points, surface.points)
            values = np.where(at >= 0, pressure[at], 0.0) if self.pressure.ndim else self.pressure
            left -= len(loaded)
            if len(loaded):
                found.append(replace(self, name=f"{self.name}_{k}", body=name, triangles=loaded, pressure=values))
        if left:
            raise InputError(
                f"pressure {self.name!r}: {left} triangles of {whole.name!r} are on none of its parts; load these"
            )
        return tuple(found)

    def integrals(self, body: FlexibleBody) -> Affine:
        """The work of linear pressure one on linear triangles: nodal forces -A/12 (1 + delta_ab) p_b n.

        Raises InputError when the body has no surface, or not the triangles.
        """
        surface = surface_of(body, self.name)
        corners, share, area = self._loaded(body, surface)
        u, Phi = surface.points[corners], surface.Phi[corners]  # (T, 3, 3), (T, 3, 3, n)
        edge, other = u[:, 1] - u[:, 0], u[:, 2] - u[:, 0]
        edge_q, other_q = Phi[:, 1] - Phi[:, 0], Phi[:, 2] - Phi[:, 0]
        area_q = (np.cross(edge_q, other[:, :, None], axis=1) + np.cross(edge[:, :, None], other_q, axis=1)) / 2
        f = share[:, :, None] * area[:, None]
        slope = share[:, :, None, None] * area_q[:, None] * (1.0 if self.follower else 0.0)
        count, n = 3 * len(corners), body.n
        made = affine(u.reshape(count, 3), Phi.reshape(count, 3, n), f.reshape(count, 3), slope.reshape(count, 3, n))
        second = second_order(surface, corners.ravel(), f.reshape(count, 3))
        if self.follower and second is not None:
            # Area and normal are of first order: so is the moment. The symmetric part has the work, and no moment.
            second = 0.5 * (second + second.swapaxes(0, 1))
        return replace(made, second=second)

    def _loaded(self, body: FlexibleBody, surface: Surface) -> tuple[Array, Array, Array]:
        """(T, 3) corners of the loaded triangles, the pressure that each takes, and (T, 3) area times outward normal."""
        corners = surface.triangles[self._chosen(body, surface)]
        a, b, c = np.moveaxis(surface.points[corners], 1, 0)
        p = self._at_points(body, surface)[corners]
        return corners, -(p + p.sum(1, keepdims=True)) / 12, np.cross(b - a, c - a) / 2

    def _nodal(self, body: FlexibleBody) -> tuple[Array, Array]:
        """(3T,) points and (3T, 3) the forces at them."""
        corners, share, area = self._loaded(body, surface_of(body, self.name))
        return corners.ravel(), (share[:, :, None] * area[:, None]).reshape(-1, 3)

    def _at_points(self, body: FlexibleBody, surface: Surface) -> Array:
        size = len(surface.points)
        if self.pressure.ndim and self.pressure.size != size:
            raise InputError(
                f"pressure {self.name!r}: {self.pressure.size} values for the {size} points of the surface of {body.name!r}"
            )
        return np.broadcast_to(self.pressure, size)

    def _chosen(self, body: FlexibleBody, surface: Surface) -> Array:
        """Numbers of the loaded triangles."""
        count = len(surface.triangles)
        if callable(self.triangles):
            centres = surface.points[surface.triangles].mean(axis=1)
            chosen = np.flatnonzero(np.broadcast_to(self.triangles(centres), count))
        elif isinstance(self.triangles, str):
            chosen = self._of_region(body, self.triangles)
        else:
            chosen = np.arange(count) if self.triangles is None else self.triangles
        if chosen.size == 0 or chosen.max() >= count:
            what = "no triangle" if chosen.size == 0 else f"triangle {chosen.max()}"
            raise InputError(f"pressure {self.name!r} acts on {what}; the surface of {body.name!r} has {count}")
        return chosen

    def _of_region(self, body: FlexibleBody, region: str) -> Array:
        known: Mapping[str, list[int]] = body.provenance.get("regions", {})
        if region not in known:
            raise InputError(
                f"pressure {self.name!r}: body {body.name!r} keeps no region {region!r}; {choice(region, known)}. "
                f'`ffr-prep reduce --region "{region}=plane z=0"` keeps one'
            )
        return np.array(known[region], np.int64)


def _sizes(loads: Array, body: FlexibleBody) -> Array:
    """(3,) force, moment and the root of twice the strain energy of modal forces, of loads (6 + n,)."""
    return np.array([np.linalg.norm(part) for part in (loads[:3], loads[3:6], loads[6:] / np.sqrt(body.omega2))])
