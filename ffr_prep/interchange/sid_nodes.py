"""The nodes of a standard input data file: positions, shapes, orientations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ffr_prep.body import Interface
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.interchange.common_format import IDENTITY_TOLERANCE
from ffr_prep.interchange.sid_blocks import Section, Taylor, only, part, taylor, value
from ffr_prep.model.invariants import skew


@dataclass(frozen=True)
class Nodes:
    """The interfaces, the geometric stiffness (6 N, n, n) of unit forces and moments on them, and warnings of what was
    left out."""

    interfaces: tuple[Interface, ...]
    stiffening: Array
    lost: tuple[str, ...]


def read_nodes(frame: Section, count: int, n: int, names: Sequence[str]) -> Nodes:
    """The nodes of the frame block; the first of them have `names`, the others their label.

    Raises InputError for a number of nodes other than announced, and for blocks that contradict each other.
    """
    only(frame, ("node",))
    if len(frame.parts) != count:
        raise InputError(f"{frame} holds {len(frame.parts)} nodes, but line 1 announces {count}")
    interfaces, lost = [], set()
    stiffening = np.zeros((count, 6, n, n))
    for k, node in enumerate(frame.parts):
        blocks = _blocks(node, n)
        interfaces.append(_interface(names[k] if k < len(names) else node.label, blocks))
        _check(node, blocks)
        stiffening[k] = -np.concatenate([blocks["phi"].m1, blocks["psi"].m1]).transpose(0, 2, 1)
        if not np.allclose(blocks["AP"].m0, np.eye(3), atol=IDENTITY_TOLERANCE):
            lost.add("dropped: the orientation of nodes; interfaces are parallel to the body frame")
        if any(part_.word == "sigma" and part_.entries for part_ in node.parts):
            lost.add("dropped: the stresses sigma of nodes")
    return Nodes(tuple(interfaces), stiffening.reshape(6 * count, n, n), tuple(sorted(lost)))


def _blocks(node: Section, n: int) -> dict[str, Taylor]:
    only(node, ("origin", "phi", "psi", "AP", "sigma"))
    reference = " ".join(value(node, "rframe").lower().split())
    if reference != "body ref":
        raise InputError(f"{node} is given in the frame {reference!r}; only 'body ref' can be read")
    sizes = {"origin": (3, 1), "phi": (3, n), "psi": (3, n), "AP": (3, 3)}
    return {name: taylor(part(node, name), *size, n) for name, size in sizes.items()}


def _interface(name: str, blocks: dict[str, Taylor]) -> Interface:
    return Interface(name, blocks["origin"].m0[:, 0], blocks["phi"].m0, blocks["psi"].m0)


def _check(node: Section, blocks: dict[str, Taylor]) -> None:
    """The blocks of order 1 repeat the shapes; of order 0 they say nothing."""
    phi, psi = blocks["phi"].m0, blocks["psi"].m0
    turned = np.einsum("klq,lm->kqm", skew(psi), blocks["AP"].m0)
    _hold(node, "origin.m1 = phi", blocks["origin"].m1[:, :, 0], phi)
    _hold(node, "AP.m1 = skew(psi) AP", blocks["AP"].m1, turned)


def _hold(node: Section, identity: str, first_order: Array, shapes: Array) -> None:
    if not first_order.any():
        return
    off = np.abs(first_order - shapes).max() / max(np.abs(first_order).max(), np.abs(shapes).max())
    if off > IDENTITY_TOLERANCE:
        raise InputError(f"{node}: the identity {identity} fails by {off:.1e} of the largest entry: it is damaged")
