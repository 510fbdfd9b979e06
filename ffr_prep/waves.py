"""How finely the elements of a model resolve the waves of its modes.

A wave of wave number k changes by |k h u| over an element of size h. The mean of that over the edges of all elements
gives the elements per wavelength 2 pi / (k h) of a mode, without knowing what kind of wave it is; bending counts shorter,
by up to sqrt 2, for the rotation of its sections.

Source: K. J. Bathe, Finite Element Procedures (1996), section 9.4 (elements for the shortest wave of interest).
"""

from __future__ import annotations

import numpy as np

from ffr_prep.elements import KINDS
from ffr_prep.interface import CoupledModel
from ffr_prep.mesh import Mesh

Array = np.ndarray

ENOUGH = 6.0


def element_edges(mesh: Mesh) -> Array:
    """(E, 2) the corners at the ends of the edges of all elements of a mesh."""
    ends = [block.nodes[:, _edges(block.kind)].reshape(-1, 2) for block in mesh.blocks]
    return np.unique(np.sort(np.concatenate(ends), axis=1), axis=0)


def _edges(kind: str) -> Array:
    """(e, 2) the edges of an element, by the positions of their corners among its nodes."""
    around = [[node for node in face if node < KINDS[kind].corners] for face in KINDS[kind].faces.tolist()]
    return np.unique([sorted(edge) for face in around for edge in zip(face, (*face[1:], face[0]), strict=True)], axis=0)


def elements_per_wavelength(model: CoupledModel, Z: Array) -> Array:
    """(n,) elements per wavelength of the shapes Z (Z, n); infinite where the model does not know its elements."""
    if model.edges is None or not Z.size:
        return np.full(Z.shape[1], np.inf)
    first, last = (model.B @ Z).reshape(*model.points.shape, -1)[model.edges.T]
    size = np.einsum("ecj,ecj->j", first, first) + np.einsum("ecj,ecj->j", last, last)
    change = first - last
    # of the edges of an element, one in `dimension` lies along the wave
    phase = np.sqrt(2 * model.dimension * np.einsum("ecj,ecj->j", change, change) / size)
    return 2 * np.pi / phase


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
