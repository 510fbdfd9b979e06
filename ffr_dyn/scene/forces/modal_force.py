"""Forces on elastic coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from ffr_dyn.scene.fields import In, OfTime, PerMode
from ffr_dyn.scene.force_kinds import register_force
from ffr_dyn.scene.forces.checks import check_array, check_function
from ffr_dyn.scene.forces.distributed import (
    Affine,
    check_integrals,
    compiled_integrals,
    law_of_integrals,
    measured_factor,
)
from ffr_dyn.scene.forces.force import Force
from ffr_dyn.scene.forces.places import OnBody
from ffr_prep.body import FlexibleBody
from ffr_prep.common.errors import InputError


@register_force
@dataclass(frozen=True)
class ModalForce(Force):
    """Forces on the elastic coordinates themselves, times a function of time: no resultant, no moment.

    body : name of a flexible body
    values : (n,) [1/sqrt(kg) N];  function : a number, a time function or a Python function of time

    Raises InputError for values that are not finite, or of another shape than (n,).

    >>> shaker = fd.ModalForce("shaker", "rod", values=[1.0, 0, 0, 0], function=fd.harmonic(amplitude=1.0, frequency=50.0))
    """

    word = "modal-force"
    kernel = "ffr_dyn.kernels.forces.distributed:distributed"
    check, law, compiled = check_integrals, law_of_integrals, compiled_integrals
    acts = "forces on elastic coordinates"
    positive = "increases q"

    name: str
    body: str
    values: Annotated[Any, list[In("1")], PerMode()]
    function: Annotated[Any, OfTime("1")] = 1.0

    def __post_init__(self) -> None:
        who = f"force {self.name!r}"
        check_function(self.function, f"{who}: function")
        shape = np.shape(self.values)
        object.__setattr__(self, "values", check_array(self.values, shape[:1], f"{who}: values"))

    @cached_property
    def place(self) -> OnBody:
        return OnBody(f"force {self.name!r}", self.body, measured=measured_factor(self))

    def integrals(self, body: FlexibleBody) -> Affine:
        """For a factor of one. Raises InputError when the body has another number of modes."""
        if self.values.size != body.n:
            raise InputError(f"force {self.name!r}: {self.values.size} values for the {body.n} modes of {body.name!r}")
        return Affine(np.concatenate([np.zeros(6), self.values]), np.zeros((6 + body.n, body.n)))
