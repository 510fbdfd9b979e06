"""The internal dynamics of a linearised plant under known motions, by differentiating them until the efforts appear.

With z = (y, y_dot), z_dot = F z + G u, known motions C z = 0: of the derivatives C F z + C G u those combinations without u
are known in turn, as often as it takes; the others give u. (Silverman, IEEE Transactions on Automatic Control
14 (1969) 270-276.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import null_space, qr

from ffr_dyn.analyses.efforts import Effort
from ffr_dyn.analyses.inversion.plant import Plant, Slopes, motions
from ffr_dyn.consistency.mobility import coordinate_gradients
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

INDEPENDENT = 1e-8  # of a row of length one, beside those before


@dataclass(frozen=True)
class Internal:
    """The internal dynamics at a state of rest.

    matrix    : (k, k) of its linear dynamics;  basis : (2 D, k) its coordinates in z
    chain     : (c, 2 D) rows of z that the known motions fix, of length one
    degree    : the largest number of derivatives until efforts appear
    gain      : (r, U) rows by which the efforts appear; r < U of the known motions have an effort
    unreached : (m, U) combinations of the known motions that no effort changes at any derivative
    """

    matrix: Array
    basis: Array
    chain: Array
    degree: int
    gain: Array
    unreached: Array


def internal(of: Slopes) -> Internal:
    """The internal dynamics of the plant with these derivatives, in a time whose unit is that of its fastest motion [s]."""
    D, unit = len(of.by_y), time_unit(of)
    zero, one = np.zeros((D, D)), np.eye(D)
    F = np.block([[zero, one], [unit**2 * of.by_y, unit * of.by_rate]])
    G = np.concatenate([np.zeros_like(of.by_u), of.by_u / np.maximum(np.linalg.norm(of.by_u, axis=0), 1e-300)])
    rows, combinations = np.hstack([of.outputs, np.zeros_like(of.outputs)]), np.eye(len(of.outputs))
    chain, gain, feedback = np.zeros((0, 2 * D)), np.zeros((0, G.shape[1])), np.zeros((0, 2 * D))
    unreached, degree = np.zeros((0, len(of.outputs))), 0
    while len(rows):
        rows, combinations, chain, lost = _new(rows, combinations, chain)
        unreached, degree = np.concatenate([unreached, lost]), degree + 1
        gain, feedback, rows, combinations = _without_efforts(rows @ G, rows @ F, combinations, gain, feedback)
    basis = null_space(chain) if len(chain) else np.eye(2 * D)
    closed = F - G @ np.linalg.lstsq(gain, feedback, rcond=None)[0] if len(gain) else F
    return Internal(basis.T @ closed @ basis / unit, basis, chain, degree, gain, unreached)


def time_unit(of: Slopes) -> float:
    """The time [s] in which the fastest motion of the plant moves by a radian."""
    fastest = max(np.sqrt(np.linalg.norm(of.by_y, 2)), np.linalg.norm(of.by_rate, 2))
    return float(1 / fastest) if fastest > 0 else 1.0


def _new(rows: Array, combinations: Array, chain: Array) -> tuple[Array, Array, Array, Array]:
    """Of the rows those that are independent of the chain and of each other, of length one, their combinations, the chain
    with them, and the combinations of the others."""
    kept, of_kept, lost = [], [], []
    for row, combination in zip(rows, combinations, strict=True):
        size = np.linalg.norm(row)
        left = row - chain.T @ (chain @ row)
        left = left - chain.T @ (chain @ left)
        length = np.linalg.norm(left)
        if length > INDEPENDENT * size:
            kept.append(left / length)
            of_kept.append(combination / np.linalg.norm(combination))
            chain = np.concatenate([chain, kept[-1][None]])
        else:
            lost.append(combination / np.linalg.norm(combination))
    width, count = rows.shape[1], combinations.shape[1]
    return (
        np.array(kept).reshape(-1, width),
        np.array(of_kept).reshape(-1, count),
        chain,
        np.array(lost).reshape(-1, count),
    )


def _without_efforts(
    direct: Array, derivative: Array, combinations: Array, gain: Array, feedback: Array
) -> tuple[Array, Array, Array, Array]:
    """gain and feedback with the derivatives in which new combinations of efforts appear, and the derivatives without any."""
    shares = np.linalg.lstsq(gain.T, direct.T, rcond=None)[0].T if len(gain) else np.zeros((len(direct), 0))
    direct, derivative = direct - shares @ gain, derivative - shares @ feedback
    left, values, _ = np.linalg.svd(direct)
    rank = int((values > INDEPENDENT).sum())
    left = left.T
    gain = np.concatenate([gain, left[:rank] @ direct])
    feedback = np.concatenate([feedback, left[:rank] @ derivative])
    return gain, feedback, left[rank:] @ derivative, left[rank:] @ combinations


# ---- do the efforts fit the motions? ---------------------------------------------------------------------------------


def fitting(of: Plant, at: Slopes, x: Array, labels: list[str]) -> tuple[Effort, ...]:
    """As many of the plant's efforts as motions are known, the best determined ones; labels (U,) of the known motions.

    Raises InputError, with the combinations of motions that they do not reach.
    """
    unknown, found = of.own.unknown, internal(at)
    if len(found.gain) < len(labels):
        raise InputError(_unfit(of, at, found, x, labels))
    _, _, order = qr(found.gain, pivoting=True)
    return tuple(unknown[k] for k in np.sort(order[: len(labels)]))


def _unfit(of: Plant, at: Slopes, found: Internal, x: Array, labels: list[str]) -> str:
    """The motions that no effort reaches, the efforts that reach none, and what those move instead."""
    names = [effort.name for effort in of.own.unknown]
    lost = found.unreached[0] / of.own.units.known
    motions = combination(lost / np.linalg.norm(lost), labels)
    idle = null_space(found.gain)[:, 0] if len(found.gain) else np.eye(len(names))[0]
    forces = combination(idle, names)
    size = np.maximum(np.linalg.norm(at.by_u, axis=0), 1e-300)
    return (
        f"the unknown forces do not determine the known motions: no force changes the acceleration {motions}, nor any "
        f"derivative of it, and {forces} changes none of them: it accelerates {_moved(of, at.by_u @ (idle / size), x)}; know "
        "another motion or let another force be unknown"
    )


def _moved(of: Plant, y_ddot: Array, x: Array) -> str:
    """The effect of accelerations y_ddot (D,) at rest on joint coordinates, the largest first, and on the coordinates y."""
    own, place = of.own, of.own.at.system.layout
    names, gradients = coordinate_gradients(own.at.system.scene, place, x, np.zeros(place.v_size))
    moved = np.concatenate(
        [gradients @ (motions(of, own.span[0], x) @ y_ddot), (y_ddot * own.units.y)[own.inner.size :]]
    )
    said = [*names, *own.names[own.inner.size :]]
    largest = np.argsort(-np.abs(moved))[:4]
    if not np.abs(moved).max(initial=0.0) > 0:
        return "nothing"
    return combination(moved[largest] / np.abs(moved).max(), [said[k] for k in largest])


def combination(weights: Array, names: list[str]) -> str:
    """Weighted names, but for weights near zero."""
    said = [(weight, name) for weight, name in zip(weights, names, strict=True) if abs(weight) > 1e-3]
    return " ".join(f"{weight:+.3g} ({name})" for weight, name in said)
