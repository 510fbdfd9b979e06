"""How finely the elements of a model resolve the waves of its modes.

In a wave of wave number k the displacement gradient g changes by |k h g| over an element of size h, whether the wave
bends, twists or stretches; the displacement itself would also count the rotation of sections. The mean of that over the
edges of all elements gives the elements per wavelength 2 pi / (k h) of a mode.

Source: K. J. Bathe, Finite Element Procedures (1996), section 9.4 (elements for the shortest wave of interest).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array, distinct
from ffr_prep.mesh.cells import KINDS
from ffr_prep.mesh.mesh import Mesh
from ffr_prep.model.coupled import CoupledModel

ENOUGH = 6.0


def element_edges(mesh: Mesh) -> Array:
    """(E, 2) the corners at the ends of the edges of all elements of a mesh."""
    count = len(mesh.points)
    ends = np.concatenate([block.nodes[:, _edges(block.kind)].reshape(-1, 2) for block in mesh.blocks])
    each = distinct(ends.min(axis=1).astype(np.int64) * count + ends.max(axis=1))
    return np.stack([each // count, each % count], axis=1)


def _edges(kind: str) -> Array:
    """(e, 2) the edges of an element, by the positions of their corners among its nodes."""
    faces = [face for of in KINDS[kind].faces for face in of.tolist()]
    around = [[node for node in face if node < KINDS[kind].corners] for face in faces]
    return np.unique([sorted(edge) for face in around for edge in zip(face, (*face[1:], face[0]), strict=True)], axis=0)


def elements_per_wavelength(model: CoupledModel, Z: Array) -> Array:
    """(n,) elements per wavelength of the shapes Z (Z, n); infinite where the model does not know its elements."""
    if model.edges is None or not Z.size:
        return np.full(Z.shape[1], np.inf)
    u = (model.B @ Z).reshape(len(model.points), -1)
    change, size = np.zeros(Z.shape[1]), np.zeros(Z.shape[1])
    for along in _derivatives(model.points, model.edges):
        first, last = (along @ u).reshape(*model.points.shape, -1)[model.edges.T]
        change += np.einsum("ecj,ecj->j", last - first, last - first)
        size += (np.einsum("ecj,ecj->j", first, first) + np.einsum("ecj,ecj->j", last, last)) / 2
    # of the edges of an element, one in `dimension` lies along the wave
    phase = np.sqrt(model.dimension * change / np.where(size > 0, size, np.inf))
    return 2 * np.pi / np.maximum(phase, np.finfo(float).tiny)


def sheet_doubt(record: Mapping[str, Any], model: CoupledModel, Z: Array) -> str | None:
    """Says so when the lowest mode of a frame of plates alone, the first shape Z (Z, n), is too short for its elements.

    Their bending has no other estimate of its error (`ffr_prep.structures.plate_mesh_error`). Beams need no elements for
    statics, and would seem too coarse.
    """
    if not record.get("shells") or record.get("members") or not Z.shape[1]:
        return None
    found = elements_per_wavelength(model, Z[:, :1])[0]
    if found >= ENOUGH:
        return None
    return (
        f"its plates are meshed too coarsely: the lowest mode has {found:.1f} elements per wavelength, fewer than "
        f"{ENOUGH:g}, and may be off by some 5 %, too low or too high; give its sheets more elements"
    )


def _derivatives(points: Array, edges: Array) -> list[sp.csr_array]:
    """Three (N, N) matrices: d/dx, d/dy, d/dz at the nodes, least squares over the edges that meet there."""
    count = len(points)
    ends = np.concatenate([edges, edges[:, ::-1]])
    arms = points[ends[:, 1]] - points[ends[:, 0]]
    normal = np.zeros((count, 3, 3))
    np.add.at(normal, ends[:, 0], arms[:, :, None] * arms[:, None, :])
    weights = np.einsum("ekl,el->ek", np.linalg.pinv(normal, rcond=1e-6, hermitian=True)[ends[:, 0]], arms)
    made = []
    for k in range(3):
        neighbours = sp.csr_array((weights[:, k], (ends[:, 0], ends[:, 1])), shape=(count, count))
        made.append(sp.csr_array(neighbours - sp.diags_array(np.bincount(ends[:, 0], weights[:, k], count))))
    return made


def resolution_warnings(model: CoupledModel, omega2: Array, Z: Array, frequency: float) -> tuple[str, ...]:
    """Says so when modes (Z, n) of omega2 (n,) up to a frequency [Hz] are too short for the elements."""
    wanted = np.sqrt(omega2) <= 2 * np.pi * frequency
    found = elements_per_wavelength(model, Z[:, wanted])
    if not (found < ENOUGH).any():
        return ()
    coarse = int(np.argmax(found < ENOUGH))
    limit = np.sqrt(omega2[wanted][coarse]) / (2 * np.pi)
    return (
        f"the mesh is too coarse for frequencies up to {frequency:.4g} Hz: the mode at {limit:.4g} Hz has "
        f"{found[coarse]:.1f} elements per wavelength, fewer than {ENOUGH:g}; refine it, or trust less",
    )
