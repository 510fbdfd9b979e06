"""A body with fewer of its elastic coordinates, and with what is known of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ffr_prep.body.constructors import recombined
from ffr_prep.body.mesh_error import CONVERTED_FROM, MESH_ERROR, TRUNCATION_ERROR, errors_of_modes
from ffr_prep.body.reduced import BodyError, FlexibleBody
from ffr_prep.body.steady_stress import of_fewer_shapes
from ffr_prep.common.arrays import Array

CUT_PAIR = "cut_pair"  # of the provenance: what is to say of a number of modes that cuts one
KEPT = "modes that are kept"
_SAME = 1e-3  # relative difference of frequencies that a symmetric body has twice: that of its mesh


def truncated(body: FlexibleBody, modes: int | Array) -> FlexibleBody:
    """The body with only its first ``modes`` elastic coordinates, or those of the indices (k,) in `modes`; so are its parts.

    A number that cuts a pair of equal frequency is told by the runs of a scene that moves in space.

    Raises BodyError for a mode that does not exist or is listed twice.

    >>> small = fd.truncated(body, 4)
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
        damping=None if body.damping is None else body.damping[np.ix_(keep, keep)],
        provenance=_with_cut_pair(_of_modes(of_fewer_shapes(body, np.eye(body.n)[:, keep]), keep), body, modes),
        parts=tuple(truncated(part, modes if np.ndim(modes) else min(int(modes), part.n)) for part in body.parts),
    )


def _of_modes(provenance: Mapping[str, Any], keep: Array) -> Mapping[str, Any]:
    """With what is known of single modes under the numbers that these have among those that are kept."""
    if CONVERTED_FROM in provenance:  # whose modes are others than those that are told of
        return provenance
    for kind in (MESH_ERROR, TRUNCATION_ERROR):
        if known := errors_of_modes(provenance, kind):
            found = {new + 1: known[int(old) + 1] for new, old in enumerate(keep) if int(old) + 1 in known}
            provenance = {**provenance, kind: {"modes": list(found), "too_high": list(found.values())}}
    return provenance


def _with_cut_pair(provenance: Mapping[str, Any], body: FlexibleBody, modes: int | Array) -> Mapping[str, Any]:
    """With what is to say of a number of modes; single ones are chosen by who knows them."""
    return with_cut(provenance, cut_pair(body.omega2, int(modes), KEPT) if np.ndim(modes) == 0 else ())


def with_cut(provenance: Mapping[str, Any], told: tuple[str, ...]) -> Mapping[str, Any]:
    """With what is told of a pair that is cut, instead of what was told of another number."""
    others = {key: value for key, value in provenance.items() if key != CUT_PAIR}
    return {**others, CUT_PAIR: told[0]} if told else others


def cut_pair(omega2: Array, count: int, what: str) -> tuple[str, ...]:
    """Says so when the first mode that is left out, of those of ascending omega2, has the frequency of the last one kept."""
    if not 0 < count < omega2.size:
        return ()
    return cut_twins(paired(omega2), count, what, f"frequency ({np.sqrt(omega2[count]) / (2 * np.pi):.4g} Hz)")


def cut_twins(twins: Array, count: int, what: str, equal: str) -> tuple[str, ...]:
    """Says so when `count` shapes leave out the twin of the last one; twins (p - 1,): whether a shape is that of the next."""
    if not 0 < count <= twins.size or not twins[count - 1]:
        return ()
    alone = np.flatnonzero(~twins[: count - 1])
    fewer = f", or for {alone[-1] + 1}" if alone.size else ""
    return (
        f"the number of {what}, {count}, cuts a pair of equal {equal}, as round and square bars have them: one plane is left "
        f"stiffer than the other; ask for {count + 1}{fewer}",
    )


def paired(omega2: Array) -> Array:
    """(p - 1,) whether a mode and the next one have the same frequency, but for what a mesh makes of it."""
    return np.abs(np.diff(omega2)) <= 2 * _SAME * omega2[1:]
