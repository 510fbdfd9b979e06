"""Other reference conditions for a reduced body, without its finite-element model.

Reference conditions decide how the motion of the body is shared between its frame and its elastic field. The field of
another frame is that of the old one plus rigid motion, so with the rigid motions T about the origin of the body frame

    phi'_j = sum_i phi_i X_ij + T A_j,    L phi'_j = 0,

and every integral of the body follows from the old ones by the same combination Z = [A; X], exactly. Six conditions keep
all motion, and the body is the one that a reduction under them would have made, as long as that takes its basis from the
interfaces: Craig-Bampton, Rubin, static shapes. Plain eigenmodes belong to their conditions; converted, they stay the
deformations that they were.

The load matrices follow as well (`ffr_prep.reduction.turned_stiffening`), and the second order of the surface
(`ffr_prep.body.turned_surface`).

Source: A. A. Shabana, Dynamics of Multibody Systems (2013), section 6.7; O. P. Agrawal, A. A. Shabana, Computers &
Structures 21 (1985) 1303-1312.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from ffr_prep.body import CONVERTED_FROM, FlexibleBody, mesh_doubt
from ffr_prep.body.frame_change import in_motions, interface_motions, mass_of_motions
from ffr_prep.body.interface_freedom import interface_freedom
from ffr_prep.body.provenance import described
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import CoupledModel
from ffr_prep.model.reference import (
    ReferenceConditions,
    UserConditions,
    at_interfaces,
    conditions_of_part,
    functionals,
)
from ffr_prep.reduction.basis import diagonalised, in_frame
from ffr_prep.reduction.turned_stiffening import turned_stiffening


def with_reference(body: FlexibleBody, conditions: ReferenceConditions) -> FlexibleBody:
    """The body in the frame of other reference conditions: fixed to or supported at interfaces, or mean axis. An interface
    may be said by where it is, such as "nearest 0,0,0" [m].

    Modes are those under the new conditions, diagonal again; with more than six conditions there are fewer. What the old
    body could not represent, the new one cannot either; its provenance says so in "warnings".

    Raises InputError for conditions on the nodes of a mesh, for conditions that name an
    unknown interface or leave a rigid motion, and for load matrices that do not determine those in the new frame
    (`ffr_prep.reduction.turned_stiffening`).

    >>> moved = fp.with_reference(body, fp.FixedTo("tip"))
    """
    if isinstance(conditions, UserConditions):
        raise InputError("conditions on the nodes of the mesh need the mesh: reduce it again, or use interfaces")
    if not hasattr(conditions, "rows"):
        raise InputError(f"the other reference is {conditions!r}; give one such as FixedTo('root') or MeanAxis()")
    model = motion_model(body)
    conditions = at_interfaces(conditions, model.names, model.positions)
    L = functionals(conditions, model)
    elastic = in_frame(model, L, np.eye(6 + body.n)[:, 6:])
    basis = diagonalised(model, elastic, elastic.T @ (model.K @ elastic))
    stiffening = None if body.stiffening is None else turned_stiffening(body, model, conditions, basis.Z)
    converted = in_motions(body, basis.Z, basis.omega2, stiffening)
    parts = [with_reference(p, conditions_of_part(conditions, [i.name for i in p.interfaces])) for p in body.parts]
    return replace(converted, provenance=_provenance(body, conditions), parts=tuple(parts))


# ---- the body as a model of its own motions -----------------------------------------------------------------------


def motion_model(body: FlexibleBody) -> CoupledModel:
    """The body in the coordinates of six rigid motions about its origin and its n elastic ones, as reference conditions
    and reductions see a model."""
    n = body.n
    length = np.sqrt(np.trace(body.rr_dm) / body.mass)
    points = np.vstack([body.centre_of_mass + length * np.eye(3), *(i.position[None] for i in body.interfaces)])
    return CoupledModel(
        points=points,
        B=sp.csr_array((points.size, 6 + n)),
        K=sp.csr_array(np.diag(np.concatenate([np.zeros(6), body.omega2]))),
        M=sp.csr_array(mass_of_motions(body)),
        T=np.eye(6 + n)[:, :6],
        centre=np.zeros(3),
        places=np.full((6 + n, 3), np.nan),
        names=tuple(interface.name for interface in body.interfaces),
        kinds=tuple(interface.kind for interface in body.interfaces),
        positions=np.array([interface.position for interface in body.interfaces]).reshape(-1, 3),
        C=sp.csr_array(interface_motions(body)),
    )


# ---- what is said -------------------------------------------------------------------------------------------------


def _provenance(body: FlexibleBody, conditions: ReferenceConditions) -> dict[str, Any]:
    kept = {key: value for key, value in body.provenance.items() if key not in ("quality", "command")}
    before = body.provenance.get("reference", {})
    found = kept | {"reference": described(conditions), CONVERTED_FROM: before}
    of_mesh = mesh_doubt(body.provenance)
    said = [mesh_doubt(found) if one == of_mesh else one for one in body.provenance.get("warnings", [])]
    return found | {"warnings": list(dict.fromkeys([*said, *_losses(body, before)]))}


def _condition_count(reference: Mapping[str, Any]) -> int:
    """How many reference conditions a body was reduced under, by its provenance; six where it does not say."""
    nodal = reference.get("on_nodes")
    if isinstance(nodal, Mapping):
        return int(nodal["shape"][0])
    return len(reference["supports"]) if "supports" in reference else 6


def _losses(body: FlexibleBody, before: Mapping[str, Any]) -> list[str]:
    """The losses that the conversion cannot bring back, in words."""
    lost = []
    count = _condition_count(before)
    if count > 6:
        lost.append(
            f"the body was reduced under {count} conditions, more than the six that fix a frame: the deformations that they "
            "prevented are lost; reduce the mesh again where they matter"
        )
    possible, wanted = interface_freedom(body) if body.interfaces else (0, 0)
    if possible < wanted:
        lost.append(
            f"the body has only {possible} independent motions of its {wanted} interface coordinates: under other reference "
            "conditions its modes are not those of a direct reduction; use craig-bampton before converting"
        )
    return lost
