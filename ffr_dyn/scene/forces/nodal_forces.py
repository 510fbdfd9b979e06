"""Forces at points of a body's surface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from ffr_dyn.scene.fields import In, OfTime, Three
from ffr_dyn.scene.force_kinds import register_force
from ffr_dyn.scene.forces.checks import check_array, check_function
from ffr_dyn.scene.forces.distributed import (
    Affine,
    Spread,
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
from ffr_prep.common.errors import InputError


@register_force
@dataclass(frozen=True)
class NodalForces(Force):
    """Forces (N, 3) [N] at points of a body's surface, times a function of time.

    body : name of a flexible body
    forces : (N, 3) components on each point [N]
    points   : (N,) numbers of the points in the body's surface
    function : a number, a time function or a Python function of time
    axes     : "global", or "body" for forces that turn with the body's frame

    Raises InputError for other axes, and for forces that are not as many as points.

    >>> field = fd.NodalForces("field", "rod", points=[0, 1], forces=[[0, 0, 1.0], [0, 0, 1.0]])
    """

    word = "nodal-forces"
    kernel = "ffr_dyn.kernels.forces.distributed:distributed"
    check, law, compiled = check_integrals, law_of_integrals, compiled_integrals
    acts = "forces [N] at points of a body's surface, global or body axes"
    positive = "along the axes"

    name: str
    body: str
    points: Annotated[Any, list[int]]
    forces: Annotated[Any, list[Three(In("N"))]]
    function: Annotated[Any, OfTime("1")] = 1.0
    axes: str = "global"

    def __post_init__(self) -> None:
        who = f"force {self.name!r}"
        if self.axes not in ("global", "body"):
            raise InputError(f"{who}: axes must be 'global' or 'body', not {self.axes!r}")
        check_function(self.function, f"{who}: function")
        points = indices(self.points, f"{who}: points")
        forces = check_array(self.forces, (points.size, 3), f"{who}: forces")
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "forces", forces)

    @cached_property
    def place(self) -> OnBody:
        return OnBody(f"force {self.name!r}", self.body, self.axes, measured_factor(self))

    def doubts(self, scene: Scene) -> tuple[str, ...]:
        turned = unfollowed(self, scene, self.points, self.forces) if self.axes == "body" else ()
        return (*unstiffened(self, scene), *turned)

    def drawn(self, scene: Scene) -> dict[str, Any]:
        """Forces at few of the points, each with those of the points that are nearest to it (`arrows_on_surface`)."""
        surface = surface_of(self.place.of(scene).model, self.name)
        places = surface.points[self.points]
        chosen = far_apart(places)
        nearest = np.linalg.norm(places[:, None] - places[chosen], axis=2).argmin(axis=1)
        sums = np.zeros((len(chosen), 3))
        np.add.at(sums, nearest, self.forces)
        return arrows_on_surface(self, "N", self.points[chosen, None], sums, np.zeros(len(chosen), int))

    def on_parts(self, whole: FlexibleBody, parts: Mapping[str, FlexibleBody]) -> tuple[Force, ...]:
        """The forces, each on the first part that has its point.

        Raises InputError when a point is on none.
        """
        surface = surface_of(whole, self.name)
        _check_points(self, whole, surface)
        places, free, found = surface.points[self.points], np.ones(self.points.size, bool), []
        for k, (name, part) in enumerate(parts.items(), 1):
            at = numbers_at(places, surface_of(part, self.name).points)
            here = free & (at >= 0)
            free &= ~here
            if here.any():
                found.append(
                    replace(self, name=f"{self.name}_{k}", body=name, points=at[here], forces=self.forces[here])
                )
        if free.any():
            raise InputError(
                f"force {self.name!r}: {free.sum()} points of {whole.name!r} are on none of its parts; load these"
            )
        return tuple(found)

    def integrals(self, body: FlexibleBody) -> Affine | Spread:
        """For a factor of one. Raises InputError when the body has no surface, or not the points."""
        surface = surface_of(body, self.name)
        _check_points(self, body, surface)
        u, Phi, f = surface.points[self.points], surface.Phi[self.points], self.forces
        second = second_order(surface, self.points, f)
        if self.axes == "body":
            return replace(affine(u, Phi, f, np.zeros((*f.shape, body.n))), second=second)
        return Spread(f.sum(0), u.T @ f, np.einsum("pkj,pl->klj", Phi, f), second)


def _check_points(force: NodalForces, body: FlexibleBody, surface: Surface) -> None:
    if force.points.max(initial=-1) >= len(surface.points):
        raise InputError(
            f"force {force.name!r}: there is no point {force.points.max()}; the surface of {body.name!r} has "
            f"{len(surface.points)} points, counted from 0"
        )
