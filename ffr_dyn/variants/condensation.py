"""Fewer elastic coordinates that still move the interfaces as statics demands.

Of a reduced body with the frequencies Omega and the interface shapes Phi_I (rows: translations, and rotations times a length)
a smaller basis V is made as Craig and Bampton make it of a mesh (AIAA Journal 6 (1968), 1313): the static shapes
Omega^-2 Phi_I^T first, those of the largest compliance before the others, then the lowest modes with the interfaces held,
Phi_I v = 0. With all static shapes in it, loads and joints at the interfaces deform the body exactly as before once its
vibration has died out; the lowest modes alone would make it too stiff.

Modes that share no interface coordinate (bending in two planes, torsion, tension) are kept apart, so that a basis which is
symmetric about a plane stays so.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.linalg import eigh, null_space, qr
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from ffr_prep.body import KEPT, FlexibleBody, cut_twins, paired
from ffr_prep.common.arrays import Array

_APART = 1e-7  # an interface coordinate below this share of the largest of its mode is none
_STILL = (
    1e-9  # interface coordinates below this share of those of a rigid motion are rounding, as where a body is clamped
)
_SOFTEST = 1e-12  # share of the largest eigenvalue below which a mode counts as free
_INDEPENDENT = 1e-6  # of static shapes: what is left of a column after the others are taken out of it

_Candidate = tuple[int, float, int, Array]  # 0 static or 1 not, rank among these, family, shape (n,)


def statically_complete(body: FlexibleBody, count: int, interfaces: Iterable[str] | None = None) -> Array:
    """(n, count) basis V of elastic coordinates q = V p with V^T V = I and V^T Omega^2 V diagonal, ascending.

    Static shapes of the named interfaces (all by default) come first; with fewer than these, the stiffest are missing.
    `count` is from 1 to n.
    """
    families: dict[int, list[Array]] = {}
    for _, _, family, shape in _ranked(body, interfaces)[:count]:
        families.setdefault(family, []).append(shape)
    V = np.concatenate([_diagonal(np.array(shapes).T, body.omega2) for shapes in families.values()], axis=1)
    return V[:, np.argsort(np.einsum("ij,i,ij->j", V, body.omega2, V), kind="stable")]


def cut_of_shapes(body: FlexibleBody, count: int, interfaces: Iterable[str] | None = None) -> tuple[str, ...]:
    """Says so when `statically_complete` leaves out one of two shapes that a symmetric body has in two planes: static ones of
    equal compliance, or modes of equal frequency with the interfaces held."""
    ranked = _ranked(body, interfaces)
    static = np.array([1 / rank**2 for kind, rank, *_ in ranked if kind == 0])
    held = np.array([rank for kind, rank, *_ in ranked if kind == 1])
    apart = np.zeros(1 if static.size and held.size else 0, bool)
    twins = np.concatenate([paired(static), apart, paired(held)])
    equal = "compliance at the interfaces"
    if count > static.size:
        equal = f"frequency ({np.sqrt(held[count - static.size - 1]) / (2 * np.pi):.4g} Hz)"
    return cut_twins(twins, count, KEPT, equal)


def _ranked(body: FlexibleBody, interfaces: Iterable[str] | None) -> list[_Candidate]:
    """All shapes that there are to choose from, in the order in which they are taken."""
    shapes = _interface_shapes(body, None if interfaces is None else set(interfaces))
    candidates = [one for family in _families(shapes) for one in _candidates(shapes, body.omega2, family)]
    return sorted(candidates, key=lambda one: one[:2])


def _interface_shapes(body: FlexibleBody, names: set[str] | None) -> Array:
    """(6 I, n) motion of the interfaces per elastic coordinate, none where it is rounding; rotations times the body's radius
    of gyration."""
    length = np.sqrt(np.trace(body.rr_dm) / body.mass)
    rows = [part for i in body.interfaces if names is None or i.name in names for part in (i.phi_t, length * i.phi_r)]
    shapes = np.concatenate(rows) if rows else np.zeros((0, body.n))
    return np.where(np.abs(shapes) > _STILL / np.sqrt(body.mass), shapes, 0.0)  # of unit modal mass, as a rigid motion


def _families(shapes: Array) -> list[Array]:
    """The numbers of the modes of each family: those linked by interface coordinates that they share."""
    n = shapes.shape[1]
    largest = np.abs(shapes).max(axis=0, initial=0.0)
    linked = np.abs(shapes) > _APART * np.where(largest > 0, largest, 1.0)
    graph = csr_array(np.block([[np.zeros((n, n)), linked.T], [linked, np.zeros((len(linked), len(linked)))]]))
    label = connected_components(graph, directed=False)[1][:n]
    return [np.flatnonzero(label == k) for k in np.unique(label)]


def _candidates(shapes: Array, omega2: Array, family: Array) -> list[_Candidate]:
    """Every shape that a family offers."""
    rows, stiffness = shapes[:, family], np.maximum(omega2[family], _SOFTEST * omega2.max())
    compliant = rows / np.sqrt(stiffness)
    _, R, order = qr(compliant.T, mode="economic", pivoting=True)
    left = np.abs(np.diag(R))
    order = order[: len(left)][left > _INDEPENDENT * left.max(initial=0.0)]
    held = null_space(rows[order]) if order.size else np.eye(family.size)
    found = [(0, -float(left[k]), rows[row] / stiffness) for k, row in enumerate(order)]
    if held.shape[1]:
        values, vectors = eigh(held.T @ (stiffness[:, None] * held))
        found += [(1, float(values[k]), held @ vectors[:, k]) for k in range(len(values))]
    return [(kind, rank, int(family[0]), _spread(shape, family, omega2.size)) for kind, rank, shape in found]


def _spread(values: Array, at: Array, size: int) -> Array:
    out = np.zeros(size)
    out[at] = values
    return out


def _diagonal(shapes: Array, omega2: Array) -> Array:
    """The span of the shapes (n, k), orthonormal and with diagonal stiffness."""
    Q, _ = np.linalg.qr(shapes / np.linalg.norm(shapes, axis=0))
    _, vectors = np.linalg.eigh(Q.T @ (omega2[:, None] * Q))
    V = Q @ vectors
    return V * np.sign(V[np.abs(V).argmax(axis=0), np.arange(V.shape[1])])
