"""Forces at points of a body's surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ffr_dyn.scene.fields import OfTime, Three
from ffr_dyn.scene.force_kinds import register_force
from ffr_dyn.scene.forces.checks import check_array, check_function
from ffr_dyn.scene.forces.distributed import (
    Affine,
    Spread,
    affine,
    check_integrals,
    compiled_integrals,
    indices,
    law_of_integrals,
    surface_of,
)
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.forces.places import OnBody
from ffr_prep.body import FlexibleBody
from ffr_prep.common.errors import InputError


@register_force
@dataclass(frozen=True)
class NodalForces(Force):
    """Forces (N, 3) [N] at points of a body's surface, times a function of time.

    points   : (N,) numbers of the points in the body's surface
    function : a number, a time function or a Python function of time
    axes     : "global", or "body" for forces that turn with the body's frame
    """

    word = "nodal-forces"
    kernel = "ffr_dyn.kernels.forces.distributed:distributed"
    check, law, compiled = check_integrals, law_of_integrals, compiled_integrals
    acts = "forces [N] at points of a body's surface, global or body axes"
    positive = "along the axes"

    name: str
    body: str
    points: Annotated[Any, list[int]]
    forces: Annotated[Any, list[Three(float)]]
    function: Annotated[Any, OfTime()] = 1.0
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

    @property
    def place(self) -> OnBody:
        return OnBody(f"force {self.name!r}", self.body, self.axes)

    def integrals(self, body: FlexibleBody) -> Affine | Spread:
        """For a factor of one. Raises InputError when the body has no surface, or not the points."""
        surface = surface_of(body, self.name)
        if self.points.max(initial=-1) >= len(surface.points):
            raise InputError(
                f"force {self.name!r}: there is no point {self.points.max()}; the surface of {body.name!r} has "
                f"{len(surface.points)} points, counted from 0"
            )
        u, Phi, f = surface.points[self.points], surface.Phi[self.points], self.forces
        if self.axes == "body":
            return affine(u, Phi, f, np.zeros((*f.shape, body.n)))
        return Spread(f.sum(0), u.T @ f, np.einsum("pkj,pl->klj", Phi, f))
