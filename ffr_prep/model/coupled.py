"""Interfaces: regions of the mesh tied to six-coordinate nodes to which joints and forces attach.

A *rigid* interface (RBE2) moves its region as one piece: the nodes of the region follow three translations and three
rotations of the interface. A *mean* interface (RBE3) leaves the region free and moves with it in the mean: its six
coordinates are the rigid motion closest to the region's displacement in the least-squares sense over the area.
Either way the field is  u = B z  in independent coordinates z, and the interface coordinates are  C z.

Source: R. H. MacNeal, The NASTRAN Theoretical Manual (1972), section 5 (rigid elements); the weights of the mean are
the consistent surface mass of the faces, so a rigid motion is recovered exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief, Rows, listed
from ffr_prep.common.errors import InputError
from ffr_prep.common.in_words import extent_in_words

_DEPENDENT = 1e-10


@dataclass(frozen=True)
class InterfaceRegion:
    """A region of the mesh that becomes an interface.

    name   : of the interface
    region : face or node group of the mesh; the name of the interface when not given
    kind   : "rigid" (RBE2) or "mean" (RBE3)
    point  : (3,) position of the six-coordinate node [m]; the area centroid of a face group when not given, as a geometry
             has it of whole faces, else of the mesh (the mean of a node group)

    Raises InputError for another kind.

    >>> pin = fp.InterfaceRegion("pin", "cylinder r=6mm at 0,0,0")
    """

    name: str
    region: str | None = None
    kind: str = "rigid"
    point: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        if self.kind not in ("rigid", "mean"):
            raise InputError(f"interface {self.name!r}: kind is {self.kind!r}; it must be 'rigid' or 'mean'")
        if self.point is not None and (np.shape(self.point) != (3,) or not np.isfinite(self.point).all()):
            raise InputError(f"interface {self.name!r}: point is {self.point}; it must be three finite numbers")


@dataclass(frozen=True, repr=False)
class CoupledModel(Brief):
    """The finite-element model in the independent coordinates z that the rigid interfaces leave.

    points  : (N, 3) nodes [m]
    B       : (3N, Z) field of the independent coordinates, u = B z
    K, M    : (Z, Z) stiffness and consistent mass
    T       : (Z, 6) rigid motions: three translations, three rotations about `centre`
    centre  : (3,) mean of the nodes [m]
    places  : (Z, 3) where each coordinate is [m]; NaN for those of rigid interfaces, which are in many places
    names, kinds, positions (I, 3) [m] : of the I interfaces
    C       : (6I, Z) interface coordinates C z: three translations [m] and three rotations [rad] of each interface
    inertial_loads : (Z, 12) loads of unit accelerations: translation, rotation, products of the angular velocity; None of
              a reduced body that is converted
    edges     : (E, 2) nodes at the ends of each edge of each element; None where the model does not know its elements
    dimension : of the elements: 3 of solids, 2 of plates, 1 of beams
    """

    points: Array
    B: sp.csr_array
    K: sp.csr_array
    M: sp.csr_array
    T: Array
    centre: Array
    places: Array
    names: tuple[str, ...]
    kinds: tuple[str, ...]
    positions: Array
    C: sp.csr_array
    inertial_loads: Array | None = None
    edges: Array | None = None
    dimension: int = 3

    def _rows(self) -> Rows:
        return [
            ("nodes", str(len(self.points))),
            ("extent", extent_in_words(self.points)),
            ("coordinates", str(self.K.shape[0])),
            ("interfaces", listed(f"{name} ({kind})" for name, kind in zip(self.names, self.kinds, strict=True))),
        ]


def interface_index(model: CoupledModel, name: str) -> int:
    """Position of the interface in the model; InputError lists the names there are."""
    if name not in model.names:
        known = ", ".join(repr(n) for n in model.names) or "none"
        raise InputError(f"there is no interface {name!r}; the interfaces are: {known}")
    return model.names.index(name)


# ---- regions ------------------------------------------------------------------------------------------------------


def skew_columns(v: Array) -> Array:
    """(..., 3) -> (..., 3, 3): a~ b = a x b."""
    return np.cross(np.eye(3), np.asarray(v)[..., None, :])


# ---- transformation and coordinates -------------------------------------------------------------------------------


def rigid_field(offsets: Array) -> Array:
    """(..., 3) -> (..., 3, 6): displacement of a point by three translations and three rotations."""
    identity = np.broadcast_to(np.eye(3), (*np.shape(offsets), 3))
    return np.concatenate([identity, -skew_columns(offsets)], axis=-1)


# ---- guards -------------------------------------------------------------------------------------------------------


def check_independent(interfaces: Sequence[InterfaceRegion], C: sp.csr_array) -> None:
    """InputError where interface coordinates C (6I, Z) depend on those of the interfaces before."""
    length = np.sqrt(np.asarray((C * C).sum(axis=1))).ravel()
    gram = (C @ C.T).toarray() / np.outer(length, length)
    for k, interface in enumerate(interfaces):
        if np.linalg.eigvalsh(gram[: 6 * k + 6, : 6 * k + 6])[0] < _DEPENDENT:
            raise InputError(
                f"interface {interface.name!r} moves only with interfaces already given "
                f"({', '.join(repr(i.name) for i in interfaces[:k])}): its region must have nodes of its own"
            )


def in_words(vector: Array, scale: float) -> str:
    """The vector to four digits; parts below 1e-9 of the scale are zero."""
    rounded = np.where(np.abs(vector) < 1e-9 * scale, 0.0, vector)
    return "(" + ", ".join(f"{value:.4g}" for value in rounded) + ")"
