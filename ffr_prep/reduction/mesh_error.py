"""The error of the frequencies of a reduced body that comes from the size of the elements."""

from __future__ import annotations

from typing import Any

import numpy as np

from ffr_prep.body import MESH_ERROR
from ffr_prep.model.model import Model
from ffr_prep.reduction.basis import Basis

_ALL = 0.99  # of the strain energy: an estimate beyond has no meaning


def mesh_error(model: Model, basis: Basis) -> dict[str, Any]:
    """How much too high the frequencies of modes 1, 2, 4, 8 and so on are by the mesh, as JSON values; empty where the
    elements are not known.

    Each is that of a = omega^2 / (1 - e), where e is the share of strain energy that the mesh adds to the shape.
    """
    modes = [2**k for k in range(basis.omega2.size.bit_length())]
    chosen = np.array(modes) - 1
    added = model.mesh_energy(basis.Z[:, chosen]) if modes else None
    if added is None:
        return {}
    share = np.minimum(added / basis.omega2[chosen], _ALL)
    return {MESH_ERROR: {"modes": modes, "too_high": np.round(1 / np.sqrt(1 - share) - 1, 12).tolist()}}
