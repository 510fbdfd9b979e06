"""Shared by the exchange formats of reduced bodies: coordinates, nodes, lumped masses and text files.

A foreign file has its own elastic coordinates, with a modal mass M and a modal stiffness K. A FlexibleBody has
mass-orthonormal coordinates with a diagonal stiffness; `body_from` changes from one to the other.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
import scipy.optimize

from ffr_prep.body import BodyError, FlexibleBody, Interface, with_point
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.outputs import replacing
from ffr_prep.common.reading import read_text
from ffr_prep.interchange.bare_inertia import judged
from ffr_prep.model.invariants import skew

IDENTITY_TOLERANCE = 1e-6
MISFIT_LIMIT = 0.05
_ORTHONORMAL = 1e-9
_DEPENDENT = 1e-12
_TINY, _HUGE = 1e-60, 1e60  # beyond these, products overflow
MANY_MOMENTS = 30_000_000
# Fortran leaves the letter out where an exponent has three digits.
_REAL = re.compile(r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?:[DEde]([+-]?[0-9]+)|([+-][0-9]{3}))?")


@dataclass(frozen=True)
class Content:
    """The body of a file, in the elastic coordinates of the file.

    mass [kg], r_dm (3,) [kg m], rr_dm (3, 3) [kg m^2] as in FlexibleBody; P_dm (3, n), rP_dm (3, 3, n),
    PP_dm (3, 3, n, n) likewise but not yet mass-orthonormal; M, K (n, n) modal mass and stiffness;
    interfaces : the nodes; facts : for the provenance, with the lists "notes" and "warnings"
    stiffening : (12 + 6 N, n, n) geometric stiffness per load as in FlexibleBody, or None
    D : (n, n) modal damping, or None
    """

    name: str
    mass: float
    r_dm: Array
    rr_dm: Array
    P_dm: Array
    rP_dm: Array
    PP_dm: Array
    M: Array
    K: Array
    interfaces: tuple[Interface, ...]
    facts: dict[str, Any]
    stiffening: Array | None = None
    D: Array | None = None


def read_body(path: Path, content: Callable[[list[str], Path], Content]) -> FlexibleBody:
    """The body of a text file, whose `content` is taken from its lines; InputError names the file."""
    lines = read_lines(path)
    try:
        return body_from(content(lines, path))
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def body_from(content: Content) -> FlexibleBody:
    """The body of a file, its coordinates made mass-orthonormal with a diagonal stiffness where they are not.

    Raises InputError for a modal mass or stiffness without such coordinates, and for what no body can be.
    """
    V, omega2, notes = normal_coordinates(content.M, content.K)
    facts = {**content.facts, "notes": [*content.facts["notes"], *notes]}
    try:
        body = FlexibleBody(
            name=content.name,
            mass=content.mass,
            r_dm=content.r_dm,
            rr_dm=content.rr_dm,
            P_dm=content.P_dm @ V,
            rP_dm=content.rP_dm @ V,
            PP_dm=V.T @ content.PP_dm @ V,
            omega2=omega2,
            interfaces=tuple(
                Interface(i.name, i.position, i.phi_t @ V, i.phi_r @ V, i.kind) for i in content.interfaces
            ),
            stiffening=None if content.stiffening is None else V.T @ content.stiffening @ V,
            provenance=facts,
            damping=None if content.D is None or not content.D.any() else V.T @ content.D @ V,
        )
    except BodyError as error:
        raise InputError(str(error)) from None
    return judged(body)


# ---- coordinates --------------------------------------------------------------------------------------------------


def normal_coordinates(M: Array, K: Array) -> tuple[Array, Array, list[str]]:
    """(n, n) V with V^T M V = I and V^T K V = diag(omega2), (n,) omega2, and a note where V is not the identity.

    The diagonal of M is positive. Raises InputError where M or K is not symmetric, M not positive definite or K has a
    negative eigenvalue.
    """
    n = len(M)
    if n == 0:
        return np.eye(0), np.zeros(0), []
    M, K = _symmetric("modal mass", M), _symmetric("modal stiffness", K)
    weight = np.sqrt(np.diag(M))
    cosines = M / np.outer(weight, weight)
    lowest = float(np.linalg.eigvalsh(cosines).min())
    if lowest <= _DEPENDENT:
        raise InputError(f"the modal mass is not positive definite: modes depend on each other (to {lowest:.1e})")
    unit = np.abs(M - np.eye(n)).max() <= _ORTHONORMAL
    stiffness = np.diag(K)
    mixed = max(_off_diagonal(cosines), _off_diagonal(K) / max(np.abs(stiffness).max(), 1e-300))
    if mixed <= _ORTHONORMAL and unit:
        return np.eye(n), _not_negative(stiffness), []
    if mixed <= _ORTHONORMAL:
        return np.diag(1 / weight), _not_negative(stiffness / weight**2), ["the modes were scaled to modal mass 1"]
    values, V = scipy.linalg.eigh(K, M)
    V = V * np.where(V[np.abs(V).argmax(axis=0), np.arange(n)] < 0, -1.0, 1.0)
    return V, _not_negative(values), ["the modes of the file were combined: K v = omega^2 M v with its mass, stiffness"]


def usable(D: Array, what: str, notes: list[str]) -> Array | None:
    """The damping matrix of a file, symmetric; None, with a note, where it would feed vibration."""
    if not D.any():
        return None
    symmetric = 0.5 * (D + D.T)
    largest = np.abs(D).max()
    if np.abs(D - symmetric).max() > IDENTITY_TOLERANCE * largest:
        notes.append(f"the damping {what} is not symmetric; its symmetric part was taken")
    if np.linalg.eigvalsh(symmetric)[0] < -IDENTITY_TOLERANCE * largest:
        notes.append(f"dropped: the damping {what} has a negative eigenvalue, which would feed vibration")
        return None
    return symmetric


def _symmetric(what: str, matrix: Array) -> Array:
    off = np.abs(matrix - matrix.T).max() / max(np.abs(matrix).max(), 1e-300)
    if off > IDENTITY_TOLERANCE:
        raise InputError(f"the {what} is not symmetric (off by {off:.1e} of its largest entry)")
    return 0.5 * (matrix + matrix.T)


def _off_diagonal(matrix: Array) -> float:
    return float(np.abs(matrix - np.diag(np.diag(matrix))).max(initial=0.0))


def _not_negative(omega2: Array) -> Array:
    if omega2.min() < -1e-9 * np.abs(omega2).max():
        raise InputError(f"the modal stiffness has the negative eigenvalue {omega2.min():g} rad^2/s^2: it is unstable")
    return np.maximum(omega2, 0.0)


# ---- products of vectors and their parts --------------------------------------------------------------------------


def from_parts(symmetric: Array, axial: Array) -> Array:
    """(3, 3, ...) T with T_kl + T_lk = symmetric and (T_yz - T_zy, ...) = axial (3, ...)."""
    return 0.5 * (symmetric - skew(axial))


def from_crossed(X: Array) -> Array:
    """(3, 3, ...) integral of a b^T dm from that of X = a~ b~ = b a^T - (a.b) I."""
    trace = -0.5 * np.einsum("kk...->...", X)
    return np.swapaxes(X, 0, 1) + np.einsum("kl,...->kl...", np.eye(3), trace)


def mended_trace(PP_dm: Array, M: Array, axes: Sequence[int] = (0, 1, 2)) -> tuple[Array, float]:
    """(3, 3, n, n) PP_dm whose trace over the axes is the modal mass M, and by how much it was not (relative).

    Lumped rotary inertia is in M but not in PP_dm; each of the axes along which the body moves takes the same share of it.
    Within 1e-9 nothing changes.
    """
    lack = M - np.einsum("kkij->ij", PP_dm)
    weight = np.sqrt(np.diag(M))
    off = float(np.abs(lack / np.outer(weight, weight)).max(initial=0.0))
    if off <= _ORTHONORMAL:
        return PP_dm, off
    shares = np.diag(np.isin(range(3), axes) / len(axes))
    return PP_dm + np.einsum("kl,ij->klij", shares, lack), off


@dataclass(frozen=True)
class Bounds:
    """Upper bounds of the integrals (Cauchy-Schwarz): residuals of identities are measured by it.

    first : (n,) of P_dm; second : (n,) of rP_dm; third : (n, n) of PP_dm
    """

    first: Array
    second: Array
    third: Array


def bounds(mass: float, rr_dm: Array, M: Array) -> Bounds:
    """The bounds of the integrals of a body. Raises InputError where mass or modal mass is not positive."""
    if not mass > _TINY:
        raise InputError(f"the mass is {mass:g} kg; it must be positive")
    own = np.diag(M)
    if own.size and own.min() <= _TINY:
        k = int(own.argmin())
        raise InputError(
            f"the modal mass of mode {k + 1} is {own[k]:g}; it must be positive: a mode without mass follows its loads "
            "at once, and static elements are not computed. Give its nodes mass, or make the stiffness a bushing"
        )
    weight = np.sqrt(own)
    spread = max(float(np.trace(rr_dm)), 1e-300)
    return Bounds(weight * np.sqrt(mass), weight * np.sqrt(spread), np.outer(weight, weight))


def relative(residual: Array, bound: Array) -> float:
    """Largest residual as a fraction of its bound."""
    return float(np.abs(residual / bound).max(initial=0.0))


def hold(identity: str, residual: Array, bound: Array) -> None:
    """Raises InputError where an identity fails by more than IDENTITY_TOLERANCE of the bound."""
    off = relative(residual, bound)
    if off > IDENTITY_TOLERANCE:
        raise InputError(f"the identity {identity} fails by {off:.1e} (relative): the file is damaged")


# ---- nodes and their masses ---------------------------------------------------------------------------------------


def nodes(body: FlexibleBody, *, surface: bool) -> tuple[Interface, ...]:
    """The nodes to write: the interfaces and, on request, the points of the surface.

    The rotation of a surface point is the least-squares rotation of its neighbours, as in `with_point`.
    Raises InputError when there is no surface to write, or no node at all.
    """
    if surface and body.surface is None:
        raise InputError(f"body {body.name!r} has no surface to export; leave the surface out")
    points = body.surface.points if surface and body.surface else np.zeros((0, 3))
    taken = {i.name for i in body.interfaces}
    names = [f"surface-{k + 1}" for k in range(len(points))]
    if taken & set(names):
        raise InputError(
            f"body {body.name!r}: rename the interface {min(taken & set(names))!r}; surface points need it"
        )
    linear = replace(body, stiffening=None)
    extra = tuple(with_point(linear, name, at).interfaces[-1] for name, at in zip(names, points, strict=True))
    if not body.interfaces + extra:
        raise InputError(f"body {body.name!r} has neither interfaces nor surface points; the format needs a node")
    return body.interfaces + extra


def moments(positions: Array, shapes: Array) -> tuple[Array, Array, Array]:
    """Integrands of P_dm (3, n, N), rP_dm (3, 3, n, N) and PP_dm (3, 3, n, n, N) at N nodes.

    positions (N, 3) [m], shapes (N, 3, n). Raises InputError where these do not fit in memory.
    """
    count, _, n = shapes.shape
    if 9 * n * n * count > MANY_MOMENTS:
        raise InputError(
            f"{count} nodes with {n} modes are too many to lump the mass at; keep fewer modes or leave the surface out"
        )
    return (
        np.einsum("plj->ljp", shapes),
        np.einsum("pk,plj->kljp", positions, shapes),
        np.einsum("pki,plj->klijp", shapes, shapes),
    )


def nodal_masses(rows: Array, target: Array) -> tuple[Array, float]:
    """(N,) masses m >= 0 that bring rows (R, N) @ m closest to target (R,), and the relative distance left.

    Non-negative least squares (Lawson and Hanson 1974, Solving Least Squares Problems, ch. 23). Raises
    ComputationError when it does not converge.
    """
    if not rows.size:
        return np.zeros(rows.shape[1]), float(target.any())
    try:
        masses, distance = scipy.optimize.nnls(rows, target)
    except RuntimeError as error:
        raise ComputationError(f"nodal masses: {error}; leave the surface points out") from None
    return masses, float(distance / max(np.linalg.norm(target), 1e-300))


# ---- text files ---------------------------------------------------------------------------------------------------


def read_lines(path: Path) -> list[str]:
    """The lines of a text file. Raises InputError for a file that does not exist or cannot be read."""
    return read_text(path, "a text file").splitlines()


def write_lines(path: Path, lines: Sequence[str]) -> Path:
    """Write the file whole or not at all."""
    with replacing(path) as part:
        part.write_text("\n".join([*lines, ""]), encoding="ascii")
    return path


def real(text: str, what: str) -> float:
    """A real number with an exponent marked by D, E or, of three digits, its sign alone.

    Raises InputError for anything else, `what` in its message.
    """
    match = _REAL.fullmatch(text)
    if match is None:
        raise InputError(f"{what}: {text[:40]!r} is not a number")
    value = float(f"{match[1]}E{match[2] or match[3] or 0}")
    if abs(value) > _HUGE:
        raise InputError(f"{what}: {text[:40]} is too large")
    return value


def whole(text: str, what: str) -> int:
    """A whole number from 0. Raises InputError for anything else, `what` in its message."""
    if not re.fullmatch(r"[0-9]{1,9}", text):
        raise InputError(f"{what}: {text[:40]!r} is not a whole number")
    return int(text)
