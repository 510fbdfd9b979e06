"""Craig-Bampton's reduction: normal modes with the interfaces fixed, and static shapes of the interfaces.

Source: R. R. Craig, M. C. C. Bampton, AIAA Journal 6 (1968) 1313-1319.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
import scipy.linalg

from ffr_prep.common.arrays import Array
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis, check_interfaces, diagonalised, restricted
from ffr_prep.reduction.modes import constraint_modes
from ffr_prep.reduction.selected_modes import selected
from ffr_prep.reduction.selection import Selection, check_selection
from ffr_prep.solvers.factor import FreeBody, SupportedBody, supported


@dataclass(frozen=True)
class CraigBampton:
    """Normal modes with all interfaces fixed, and the static shapes of every interface coordinate.

    modes : a number, `UpTo` a frequency or to an `Accuracy`

    The reference conditions are imposed on the sum, so with six of them n = modes + 6 interfaces - 6.

    Raises InputError for modes that are neither a whole number nor one of these.

    >>> request = fp.Request(name="rod", reference=fp.FixedTo("hinge"), reduction=fp.CraigBampton(modes=8))
    """

    modes: Selection

    def __post_init__(self) -> None:
        check_selection("modes", self.modes)

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError without interfaces and for more modes than the model has."""
        check_interfaces(model, "Craig-Bampton")
        fixed = supported(body, model.C)
        return with_fixed_interfaces(model, body, L, fixed, self.modes, cache(partial(constraint_modes, model, fixed)))


def with_fixed_interfaces(
    model: CoupledModel,
    body: FreeBody,
    L: Array,
    fixed: SupportedBody,
    modes: Selection,
    static: Callable[[], tuple[Array, Array]],
) -> Basis:
    """The basis of normal modes with fixed interfaces and of static shapes (Z, p), whose stiffness is (p, p).

    static : makes the shapes and the stiffness, asked for after the search for modes, which needs their memory
    """

    def with_modes(omega2: Array, vectors: Array) -> Basis:
        shapes, stiffness = static()
        K = scipy.linalg.block_diag(np.diag(omega2), stiffness)
        return diagonalised(model, *restricted(model, np.hstack([vectors, shapes]), K, L))

    return selected(model, body, fixed, modes, with_modes)
