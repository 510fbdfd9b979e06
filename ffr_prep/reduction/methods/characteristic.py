"""Characteristic constraint modes: Craig-Bampton with fewer static shapes.

Source: M. P. Castanier, Y.-C. Tan, C. Pierre, AIAA Journal 39 (2001) 1182-1187.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from ffr_prep.body import cut_pair
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.reduction.basis import Basis, check_interfaces
from ffr_prep.reduction.methods.craig_bampton import with_fixed_interfaces
from ffr_prep.reduction.modes import constraint_modes
from ffr_prep.reduction.selection import Selection, UpTo, check_selection
from ffr_prep.solvers.factor import FreeBody, supported


@dataclass(frozen=True)
class CharacteristicModes:
    """Craig-Bampton with fewer static shapes: only the lowest vibration modes of the body as condensed to its interfaces.

    modes           : with the interfaces fixed: a number, `UpTo` a frequency or to an `Accuracy`
    interface_modes : elastic modes of the condensed stiffness and mass: a number, or `UpTo` a frequency

    For many interfaces. Forces at the interfaces then bend the body less than they should, the more the fewer are kept.

    Raises InputError for modes that are neither a whole number nor one of these.

    >>> reduction = fp.CharacteristicModes(modes=8, interface_modes=6)
    """

    modes: Selection
    interface_modes: int | UpTo

    def __post_init__(self) -> None:
        check_selection("modes", self.modes)
        check_selection("interface_modes", self.interface_modes, (UpTo,))

    def basis(self, model: CoupledModel, body: FreeBody, L: Array) -> Basis:
        """Raises InputError without interfaces and for more modes than there are."""
        check_interfaces(model, "a reduction of the interfaces")
        fixed = supported(body, model.C)
        shapes, stiffness = constraint_modes(model, fixed)
        omega2, kept = _condensed_modes(stiffness, shapes.T @ (model.M @ shapes), self.interface_modes)
        condensed = shapes @ kept, kept.T @ stiffness @ kept
        found = with_fixed_interfaces(model, body, L, fixed, self.modes, lambda: condensed)
        return replace(found, warnings=(*found.warnings, *cut_pair(omega2, kept.shape[1] - 6, "interface modes")))


def _condensed_modes(K: Array, M: Array, selection: int | UpTo) -> tuple[Array, Array]:
    """omega2 (6I - 6,) of the condensed body's elastic modes; (6I, 6 + count) its rigid motions and the lowest of them."""
    scale = 1 / np.sqrt(np.diag(M))
    omega2, V = scipy.linalg.eigh(K * np.outer(scale, scale), M * np.outer(scale, scale))
    elastic = len(omega2) - 6
    if isinstance(selection, UpTo):
        count = int(np.searchsorted(omega2[6:], (2 * np.pi * selection.frequency) ** 2, side="right"))
    else:
        count = selection
    if not 0 <= count <= elastic:
        raise InputError(f"asked for {count} interface modes; the interfaces have {elastic}: ask for 0 to {elastic}")
    return omega2[6:], scale[:, None] * V[:, : 6 + count]
