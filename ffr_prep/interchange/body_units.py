"""Bodies whose numbers are in other units than SI.

With the units L, M, T of length, mass and time, coordinates of unit modal mass are q = sqrt(M) L q_file, so that energies are
M L^2 / T^2 of those of the file; all else follows from what it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_prep.body import FlexibleBody
from ffr_prep.matrices.unit_systems import UnitSystem

_DOUBTFUL_LENGTH = 20.0


def in_si_units(body: FlexibleBody, units: UnitSystem) -> FlexibleBody:
    """The body of numbers in `units`; without its surface, which files of other programs do not have."""
    L, M, T = units.length, units.mass, units.time
    root = np.sqrt(M)
    # Acceleration, angular acceleration, products of rates; force and moment at each interface.
    loads = np.array([1 / L] * 3 + [1.0] * 9 + ([1 / (M * L)] * 3 + [1 / (M * L**2)] * 3) * len(body.interfaces))
    return replace(
        body,
        mass=M * body.mass,
        r_dm=M * L * body.r_dm,
        rr_dm=M * L**2 * body.rr_dm,
        P_dm=root * body.P_dm,
        rP_dm=root * L * body.rP_dm,
        omega2=body.omega2 / T**2,
        interfaces=tuple(
            replace(i, position=L * i.position, phi_t=i.phi_t / root, phi_r=i.phi_r / (root * L))
            for i in body.interfaces
        ),
        surface=None,
        stiffening=None if body.stiffening is None else loads[:, None, None] * body.stiffening,
        damping=None if body.damping is None else body.damping / T,
    )


def large_in_words(body: FlexibleBody, units: str) -> FlexibleBody:
    """The body with a warning where it is so large that its lengths may be millimetres."""
    if units != "m-kg-s" or body.size <= _DOUBTFUL_LENGTH:
        return body
    warning = (
        f"the body is {body.size:.4g} m long, and {body.mass:.4g} kg: are its lengths millimetres? Then import it with "
        "--units mm-kg-s, or mm-t-s"
    )
    facts = body.provenance
    return replace(body, provenance={**facts, "warnings": [*facts.get("warnings", ()), warning]})
