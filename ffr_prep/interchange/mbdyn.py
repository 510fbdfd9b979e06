"""Modal bodies of MBDyn: write and read `.fem` files.

Source: MBDyn Input File Format (P. Masarati, Politecnico di Milano), section "modal" joint, record groups of the FEM
data file. How the records follow from the integrals of FlexibleBody, and back (r: position, phi_j: mode j):

    12  mass, centre of mass, central inertia      15  I4 = axial(rP_dm)
    9   M                                          16  I8_j = -(integral of r~ phi_j~ dm): the opposite of body.I8
    10  K                                          17  I5 = axial(PP_dm)
    14  I3 = P_dm                                  18  I9 = integral of phi_j~ phi_k~ dm

    19  geometric stiffness by load, where the body has it

Record 16 holds all of rP_dm and record 18 all of PP_dm; 15 and 17 repeat their antisymmetric parts and 9 the trace of 18.
Without records 14 to 18 the integrals are sums over the lumped masses of record 11.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args
from urllib.parse import quote, unquote

import numpy as np

from ffr_prep.body import FlexibleBody, Interface, axial
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.interchange.common_format import (
    IDENTITY_TOLERANCE,
    MISFIT_LIMIT,
    Bounds,
    Content,
    bounds,
    from_crossed,
    from_parts,
    hold,
    mended_trace,
    moments,
    nodal_masses,
    nodes,
    read_body,
    relative,
    usable,
    write_lines,
)
from ffr_prep.interchange.mbdyn_records import (
    COUNTS,
    Header,
    Record,
    names,
    numbers,
    records,
    shapes,
    stiffening_matrices,
)
from ffr_prep.model.invariants import from_inertia

Kind = Literal["legacy", "full"]
LUMPING_LIMIT = 1.05  # of the trace of I9 against -2 M; where a mode is rotary inertia alone it is 1

# The loads of record 19 (products xx, yy, zz, xy, yz, zx of the angular velocity, angular acceleration, acceleration)
# among those of `FlexibleBody.stiffening`. Forces and moments at the interfaces follow in both.
_OURS = [6, 7, 8, 9, 11, 10, 3, 4, 5, 0, 1, 2]

TITLES = {
    1: "HEADER",
    2: "FINITE ELEMENT NODE LIST",
    5: "NODAL X COORDINATES",
    6: "NODAL Y COORDINATES",
    7: "NODAL Z COORDINATES",
    8: "MODE SHAPES",
    9: "MODAL MASS MATRIX",
    10: "MODAL STIFFNESS MATRIX",
    11: "DIAGONAL OF LUMPED MASS MATRIX",
    12: "GLOBAL INERTIA",
    13: "MODAL DAMPING MATRIX",
    14: "INVARIANT 3",
    15: "INVARIANT 4",
    16: "INVARIANT 8",
    17: "INVARIANT 5",
    18: "INVARIANT 9",
    19: "GEOMETRIC STIFFENING",
}


# ---- writing ------------------------------------------------------------------------------------------------------


def write_fem(body: FlexibleBody, path: str | Path, *, kind: Kind = "full", surface: bool = False) -> Path:
    """Write the body as FEM data of MBDyn's modal joint, SI units, 17 significant digits.

    kind    : "full" writes the inertia integrals (records 12, 14 to 18) and the geometric stiffness (19), which a recent
              MBDyn reads, and loses nothing of them; "legacy" leaves the stiffness out and writes masses lumped at the
              nodes (records 11, 12), which come as close to the integrals as masses at these nodes can
    surface : also write the points of the surface as nodes, after the interfaces. The format has no triangles, no
              kinds of interfaces and no provenance

    Source: MBDyn Input File Format, modal joint. Raises InputError for an unknown kind, a body without nodes, a missing
    surface, and where lumped masses miss the integrals by more than MISFIT_LIMIT.

    >>> fp.write_fem(body, "rod.fem")
    """
    if kind not in get_args(Kind):
        raise InputError(f"kind {kind!r} is not known; take legacy or full")
    at = nodes(body, surface=surface)
    inertia = _invariants(body) if kind == "full" else {11: _lumped(body, at)}
    content = {**_finite_elements(body, at), 12: _global_inertia(body), **inertia}
    return write_lines(Path(path), [*_head(body, at), *_texts(content)])


def left_out(body: FlexibleBody, *, kind: Kind = "full") -> tuple[str, ...]:
    """The losses of a file of this kind, in words."""
    lost = kind == "legacy" and body.stiffening is not None
    return ("the geometric stiffness of the body was left out",) if lost else ()


def _finite_elements(body: FlexibleBody, at: tuple[Interface, ...]) -> dict[int, Array]:
    positions = np.array([i.position for i in at])
    motions = np.array([np.vstack([i.phi_t, i.phi_r]) for i in at])
    return {
        5: positions[:, 0],
        6: positions[:, 1],
        7: positions[:, 2],
        8: motions.transpose(2, 0, 1),
        9: np.eye(body.n),
        10: np.diag(body.omega2),
        **({} if body.damping is None else {13: body.damping}),
    }


def _global_inertia(body: FlexibleBody) -> Array:
    return np.concatenate([[body.mass], body.centre_of_mass, body.central_inertia.ravel()])


def _invariants(body: FlexibleBody) -> dict[int, Array]:
    return {
        14: body.I3,
        15: body.I4,
        16: -body.I8.transpose(1, 0, 2),
        17: body.I5,
        18: body.I9.transpose(2, 0, 1, 3),
        **({} if body.stiffening is None else {19: body.stiffening}),
    }


def _lumped(body: FlexibleBody, at: tuple[Interface, ...]) -> Array:
    """(N, 6) masses of the nodes along the axes, without rotary inertia."""
    P, rP, PP = moments(np.array([i.position for i in at]), np.array([i.phi_t for i in at]))
    limit = bounds(body.mass, body.rr_dm, np.eye(body.n))
    scales = (limit.first[:, None], limit.second[:, None], limit.third[:, :, None])
    rows = np.vstack(
        [(integrand / scale).reshape(-1, len(at)) for integrand, scale in zip((P, rP, PP), scales, strict=True)]
    )
    sums = (body.P_dm, body.rP_dm, body.PP_dm)
    target = np.concatenate([(total / scale[..., 0]).ravel() for total, scale in zip(sums, scales, strict=True)])
    masses, misfit = nodal_masses(rows, target)
    if misfit > MISFIT_LIMIT:
        more = "export the surface points too (--surface), or" if len(at) == len(body.interfaces) else "take"
        raise InputError(
            f"body {body.name!r}: masses at the {len(at)} nodes miss its inertia integrals by {misfit:.1e} (at most "
            f"{MISFIT_LIMIT}): {more} the kind 'full' (--kind full)"
        )
    return np.hstack([np.repeat(masses[:, None], 3, axis=1), np.zeros((len(at), 3))])


def _head(body: FlexibleBody, at: tuple[Interface, ...]) -> Iterator[str]:
    yield "** FEM data of a modal body, written by ffr-prep, SI units"
    yield f"** body = {quote(body.name)}"
    for k, interface in enumerate(body.interfaces, start=1):
        yield f"** node {k} = {quote(interface.name)}"
    yield _title(1)
    yield "**   REVISION, NODES, NORMAL, ATTACHMENT, CONSTRAINT, REJECTED MODES"
    yield f"     REV0 {len(at)} {body.n} 0 0 0"
    yield _title(2)
    labels = [str(k) for k in range(1, len(at) + 1)]
    yield from (" ".join(labels[k : k + 6]) for k in range(0, len(at), 6))


def _texts(content: Mapping[int, Array]) -> Iterator[str]:
    for record, values in sorted(content.items()):
        yield "**"
        yield _title(record)
        if record == 19:
            yield from _stiffening_lines(values)
            continue
        if record != 8:
            yield from _six_a_line(values)
            continue
        for k, mode in enumerate(values, start=1):
            yield f"**    MODE SHAPE # {k}"
            yield from _six_a_line(mode)


def _stiffening_lines(K: Array) -> Iterator[str]:
    """The number of matrices, then each with its index."""
    yield str(len(K))
    for index, load in enumerate(_OURS[:12] + list(range(12, len(K))), start=1):
        yield str(index)
        yield from _six_a_line(K[load])


def _title(record: int) -> str:
    return f"** RECORD GROUP {record}, {TITLES[record]}"


def _six_a_line(values: Array) -> Iterator[str]:
    flat = values.ravel()
    for k in range(0, flat.size, 6):
        yield " ".join(f"{value:24.16E}" for value in flat[k : k + 6])


# ---- reading ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Nodes:
    """positions (N, 3) [m], translations and rotations (N, 3, n)."""

    positions: Array
    phi_t: Array
    phi_r: Array


def read_fem(path: str | Path) -> FlexibleBody:
    """The body of FEM data of MBDyn's modal joint; every node becomes an interface of the kind "node".

    The numbers are taken to be in SI units. Integrals come from records 14, 16 and 18 where they are there, else from
    the lumped masses of record 11. Where record 9 is not the unit matrix or record 10 not diagonal, the modes are
    combined. Record 13 is the damping of the body; initial values are left out. provenance: "notes" (what was changed),
    "warnings" (what was lost or does not agree).

    Source: MBDyn Input File Format, modal joint. Raises InputError for a file that does not exist, is damaged,
    truncated or foreign, or whose records contradict each other, naming line, record or identity, and by how much.

    >>> body = fp.read_fem("rod.fem")
    """
    return read_body(Path(path), _content)


def _content(lines: list[str], path: Path) -> Content:
    header, found = records(lines)
    warnings: list[str] = []
    given = {record: numbers(found[record], header) for record in COUNTS if record in found}
    motions = shapes(found[8], header)
    at = _Nodes(np.stack([given[k] for k in (5, 6, 7)], axis=1), motions[:, :3], motions[:, 3:])
    mass, r_dm, rr_dm = _rigid(given, at)
    if mass == 0 and header.n and given[9].diagonal().min() > 0:
        mass, r_dm, rr_dm = _stand_in(given[9], at)
        warnings = [
            f"the file has no mass: {mass:.4g} kg at the middle of its nodes stand for it; where the frame is held "
            "fixed they change nothing but the weight in reactions, elsewhere give the file its mass (record 12)"
        ]
    limit = bounds(mass, rr_dm, given[9])
    lumped = _sums(given[11], at) if 11 in given else None
    P_dm = given[14] if 14 in given else _needed(lumped, 14)[0]
    rP_dm, of_r = _first_moments(given, lumped, limit)
    PP_dm, of_phi = _second_moments(given, lumped, limit)
    damping = usable(given[13], "record 13", warnings) if 13 in given else None
    title, labels = names(lines)
    return Content(
        name=unquote(title) or path.stem,
        mass=mass,
        r_dm=r_dm,
        rr_dm=rr_dm,
        P_dm=P_dm,
        rP_dm=rP_dm,
        PP_dm=PP_dm,
        M=given[9],
        K=given[10],
        interfaces=tuple(
            Interface(unquote(labels.get(k + 1, label)), at.positions[k], at.phi_t[k], at.phi_r[k])
            for k, label in enumerate(header.labels)
        ),
        D=damping,
        facts={
            "source": {"file": path.name, "format": "MBDyn FEM"},
            "inertia": {str(r): "record" if r in given else "lumped masses" for r in (12, 14, 16, 18)},
            "notes": ["every node became an interface of the kind 'node'", "the format has no surface to draw"],
            "warnings": [*warnings, *_lost(given), *of_r, *of_phi],
        },
        stiffening=_stiffening(found[19], header) if 19 in found else None,
    )


def _stiffening(record: Record, header: Header) -> Array:
    """(12 + 6 N, n, n) from record 19; matrices that are not there are zero. InputError for one that is not symmetric."""
    matrices = stiffening_matrices(record, header)
    K = np.zeros((12 + 6 * len(header.labels), header.n, header.n))
    for index, matrix in matrices.items():
        hold(
            f"matrix {index} of record 19 is symmetric",
            matrix - matrix.T,
            np.maximum(np.abs(matrix).max(keepdims=True), 1e-300),
        )
        K[_OURS[index - 1] if index <= 12 else index - 1] = 0.5 * (matrix + matrix.T)
    return K


def _rigid(given: Mapping[int, Array], at: _Nodes) -> tuple[float, Array, Array]:
    """Mass, first and second moments, from record 12 or else from record 11."""
    if 12 in given:
        mass, centre, central = float(given[12][0]), given[12][1:4], given[12][4:].reshape(3, 3)
        off = np.abs(central - central.T).max() / max(np.abs(central).max(), 1e-300)
        if off > IDENTITY_TOLERANCE:
            raise InputError(f"record 12: the inertia tensor is not symmetric (off by {off:.1e} of its largest entry)")
        return mass, mass * centre, from_inertia(0.5 * (central + central.T)) + mass * np.outer(centre, centre)
    if 11 not in given:
        raise InputError("the mass is missing: the file has neither record 11 nor record 12")
    masses, inertia = _isotropic(given[11]), given[11][:, 3:].sum(axis=0)
    moment = np.einsum("p,pk,pl->kl", masses, at.positions, at.positions)
    return float(masses.sum()), masses @ at.positions, moment + from_inertia(np.diag(inertia))


def _stand_in(M: Array, at: _Nodes) -> tuple[float, Array, Array]:
    """Mass and moments as if all nodes had the same: the mass that the modes have where they move the nodes."""
    moved = (at.phi_t**2).sum(axis=1).mean(axis=0)
    mass = float(max((np.diag(M)[moved > 0] / moved[moved > 0]).max(initial=0.0), 1e-6 * np.trace(M)))
    mean, rr = at.positions.mean(axis=0), np.einsum("pk,pl->kl", at.positions, at.positions) / len(at.positions)
    return mass, mass * mean, mass * rr


def _isotropic(lumped: Array) -> Array:
    """(N,) masses. Raises InputError where a node has different ones along the axes."""
    masses = lumped[:, :3]
    off = np.ptp(masses, axis=1)
    worst = int(off.argmax())
    if off[worst] > IDENTITY_TOLERANCE * np.abs(masses).max():
        raise InputError(
            f"record 11: node {worst + 1} has the masses {masses[worst]}; they must not depend on the axis"
        )
    return masses[:, 0]


def _sums(lumped: Array, at: _Nodes) -> tuple[Array, Array, Array]:
    """P_dm, rP_dm and PP_dm of the lumped masses; rotary inertia is in the antisymmetric part of rP_dm (I4)."""
    masses = _isotropic(lumped)
    rP = np.einsum("p,pk,plj->klj", masses, at.positions, at.phi_t)
    rotary = np.einsum("pk,pkj->kj", lumped[:, 3:], at.phi_r)
    return (
        np.einsum("p,pkj->kj", masses, at.phi_t),
        from_parts(rP + rP.swapaxes(0, 1), axial(rP) + rotary),
        np.einsum("p,pki,plj->klij", masses, at.phi_t, at.phi_t),
    )


def _needed(lumped: tuple[Array, Array, Array] | None, record: int) -> tuple[Array, Array, Array]:
    if lumped is None:
        raise InputError(f"the inertia of the modes is missing: the file has neither record 11 nor record {record}")
    return lumped


def _first_moments(
    given: Mapping[int, Array], lumped: tuple[Array, Array, Array] | None, limit: Bounds
) -> tuple[Array, list[str]]:
    """rP_dm from records 16 and 15; rotary inertia of nodes is in 15 only, so it is the one to believe."""
    rP = from_crossed(-given[16].transpose(0, 2, 1)) if 16 in given else _needed(lumped, 16)[1]
    if 15 not in given:
        return rP, []
    off = relative(axial(rP) - given[15], limit.second)
    warning = f"lumped mass: the identity I4 = axial part of I8 fails by {off:.1e} (relative); record 15 was taken"
    return from_parts(rP + rP.swapaxes(0, 1), given[15]), [warning] * (off > IDENTITY_TOLERANCE)


def _second_moments(
    given: Mapping[int, Array], lumped: tuple[Array, Array, Array] | None, limit: Bounds
) -> tuple[Array, list[str]]:
    """PP_dm from record 18, checked against 17 and 9."""
    PP = from_crossed(given[18].transpose(0, 3, 1, 2)) if 18 in given else _needed(lumped, 18)[2]
    hold("I9_jk = transpose of I9_kj (record 18)", PP - PP.transpose(1, 0, 3, 2), limit.third)
    if 17 in given:
        hold("I5 = axial part of I9 (records 17, 18)", axial(PP) - given[17], limit.third)
    mended, off = mended_trace(PP, given[9])
    identity = f"the identity trace of I9 = -2 M (record 9) fails by {off:.1e} (relative)"
    if off > LUMPING_LIMIT:
        raise InputError(f"{identity}: too much for a lumped mass; a record is damaged")
    warning = f"lumped mass: {identity}; each axis of PP_dm took a third"
    return mended, [warning] * (off > IDENTITY_TOLERANCE)


def _lost(given: Mapping[int, Array]) -> list[str]:
    lost = []
    for record, what in ((3, "initial modal displacements"), (4, "initial modal velocities")):
        if record in given and given[record].any():
            lost.append(f"dropped: the {what} of record {record}")
    return lost
