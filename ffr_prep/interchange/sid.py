"""Standard input data of flexible bodies (SID): write and read `.SID_FEM` files.

Source: O. Wallrapp, "Standardization of flexible body modeling in multibody system codes, Part I: Definition of
standard input data", Mechanics of Structures and Machines 22 (1994) 283-304. The equations of motion there are
Me q'' + Ct a + Cr alpha + Ge(omega) q' + Oe Omega + Ke q = ..., with Omega the six products of the angular velocity.

How the blocks follow from the integrals of FlexibleBody, and back (r: position, phi_j: mode j):

    mdCM  r_dm; m1 = P_dm                               Ct      P_dm
    J     tr(rr) I - rr; m1 = the same of rP + rP^T     Cr      axial(rP); m1(k, l) = axial(PP)[:, l, k]
    Gr_l  -2 (rP_l^T - tr(rP_l) I)                      Ge_l    2 Cr.m1(:, l)
    Oe    xx: rP_xx - tr(rP), xy: rP_xy + rP_yx; m1 the same of PP

The geometric stiffness K per load stands beside them: in Ct.m1, Cr.m1 (the part symmetric in the modes) and Oe.m1 for
what multiplies them, and, with the opposite sign, in phi.m1 and psi.m1 of the nodes for the forces and moments there.

J.m1 holds the symmetric part of rP_dm, Cr the other; Oe.m1 holds the symmetric part of PP_dm, Cr.m1 the other.
Everything else repeats them and is checked on reading.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import get_args
from urllib.parse import quote, unquote

import numpy as np

from ffr_prep.body import FlexibleBody, Interface, axial
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.interchange.common_format import Content, bounds, nodes, read_body, real, usable, write_lines
from ffr_prep.interchange.sid_blocks import (
    Section,
    Taylor,
    in_standard_order,
    integer,
    only,
    part,
    sections,
    taylor,
    value,
)
from ffr_prep.interchange.sid_identities import (
    PRODUCTS,
    Layout,
    centrifugal,
    check_repeated,
    laid_out,
    lost_blocks,
    lumped_mass,
    of_accelerations,
    six,
    tensor,
)
from ffr_prep.interchange.sid_moments import first_moments, with_second_moments
from ffr_prep.interchange.sid_nodes import read_nodes
from ffr_prep.interchange.stated_frequencies import other_frequencies
from ffr_prep.model.invariants import from_inertia, skew

BLOCKS = ("mdCM", "J", "Ct", "Cr", "Me", "Gr", "Ge", "Oe", "ksigma", "Ke", "De")
_OPTIONAL = {"ksigma": "prestress", "De": "damping"}
NAMES = "interfaces="


def write_sid(body: FlexibleBody, path: str | Path, *, layout: Layout = "mode-major", surface: bool = False) -> Path:
    """Write the body as standard input data, SI units, 17 significant digits.

    layout  : of the matrices Gr (3, 3n) and Ge (n, 3n), which programs do not agree on: column 3(l-1)+a for mode l and
              axis a ("mode-major") or (a-1)n+l ("axis-major"); line 1 of the file says which
    surface : also write the points of the surface as nodes, after the interfaces. The format has no triangles, no
              kinds of interfaces and no provenance

    Source: Wallrapp 1994. Raises InputError for an unknown layout, a body without nodes, or a missing surface.

    >>> fp.write_sid(body, "rod.SID_FEM")
    """
    if layout not in get_args(Layout):
        raise InputError(f"layout {layout!r} is not known; take mode-major or axis-major")
    return write_lines(Path(path), list(_lines(body, layout, nodes(body, surface=surface))))


def left_out(body: FlexibleBody, *, layout: Layout = "mode-major") -> tuple[str, ...]:
    """The losses of a file, in words; the layout makes none."""
    if body.stiffening is None:
        return ()
    return (
        "Oe.m1 holds the inertia of the shapes and the geometric stiffness of spin as one sum, as the format has it: a "
        "program that wants the inertia alone, for how the deflection changes moments of inertia (I9), takes it from masses "
        "at the nodes, as `ffr-prep import` does. A .fem file holds both",
    )


def blocks(body: FlexibleBody, layout: Layout) -> dict[str, tuple[Array, Array | None]]:
    """The Taylor blocks by name: m0 (rows, columns) and, of order 1, m1 (rows, n, columns)."""
    n = body.n
    K = np.zeros((12, n, n)) if body.stiffening is None else body.stiffening[:12]
    first = np.einsum("klj->jkl", body.rP_dm + body.rP_dm.transpose(1, 0, 2))
    J1 = np.trace(first, axis1=1, axis2=2)[:, None, None] * np.eye(3) - first
    Cr1 = axial(body.PP_dm).transpose(2, 1, 0)
    return {
        "mdCM": (body.r_dm[:, None], body.P_dm[:, :, None]),
        "J": (six(body.inertia)[:, None], six(J1).T[:, :, None]),
        "Ct": (body.P_dm.T, None if body.stiffening is None else K[:3].transpose(1, 2, 0)),
        "Cr": (axial(body.rP_dm).T, Cr1 + K[3:6].transpose(1, 2, 0)),
        "Me": (np.eye(n), None),
        "Gr": (laid_out(-2 * body.I8.transpose(1, 0, 2), layout), None),
        "Ge": (laid_out(2 * Cr1, layout), None),
        "Oe": (centrifugal(body.rP_dm).T, (centrifugal(body.PP_dm) + K[PRODUCTS]).transpose(1, 2, 0)),
        "ksigma": (np.zeros((n, 1)), None),
        "Ke": (np.diag(body.omega2), None),
        "De": (np.zeros((n, n)) if body.damping is None else body.damping, None),
    }


# ---- text ---------------------------------------------------------------------------------------------------------


def label(name: str) -> str:
    """A name without blanks and without the words at which simple readers of the format would stop."""
    plain = quote(name, safe="+-")
    for word in ("frame", "refmod"):
        plain = plain.replace(word, f"%{ord(word[0]):02X}{word[1:]}")
    return plain


def _lines(body: FlexibleBody, layout: Layout, at: tuple[Interface, ...]) -> Iterator[str]:
    named = ",".join(label(i.name) for i in body.interfaces)
    yield f"{len(at):5d}{body.n:5d}   :No. nodes, No. modes: ffr-prep, SI, Gr,Ge={layout}, {NAMES}{named}"
    yield "part "
    yield f"  new modal = {label(body.name)}"
    yield "    refmod "
    yield _pair(6, "mass ", _number(body.mass))
    yield _pair(6, "nelastq ", f"{body.n}")
    for k, frequency in enumerate(body.frequencies, start=1):
        yield _pair(6, f"ielastq ({k:4d}) ", f"Eigen Mode {k:5d} : {frequency:.9g} Hz")
    yield "    end refmod "
    yield "    frame "
    for k, node in enumerate(at):
        known = None if body.stiffening is None or k >= len(body.interfaces) else body.stiffening
        yield from _node(k + 1, node, body.n, None if known is None else known[12 + 6 * k : 18 + 6 * k])
    yield "    end frame "
    for name, (m0, m1) in blocks(body, layout).items():
        yield from _block(4, name, m0, m1, body.n)
    yield "  end modal "
    yield "end part "


def _node(number: int, node: Interface, n: int, K: Array | None) -> Iterator[str]:
    """A node, with the geometric stiffness (6, n, n) of unit forces and moments on it."""
    by_force, by_moment = (None, None) if K is None else (-K[:3].transpose(0, 2, 1), -K[3:].transpose(0, 2, 1))
    yield f"      new node = {number}"
    yield _pair(8, "rframe ", "body ref")
    yield from _block(8, "origin", node.position[:, None], node.phi_t[:, :, None], n)
    yield from _block(8, "phi", node.phi_t, by_force, n)
    yield from _block(8, "psi", node.phi_r, by_moment, n)
    yield from _block(8, "AP", np.eye(3), skew(node.phi_r).transpose(0, 2, 1), n)
    yield "      end node "


def _block(indent: int, name: str, m0: Array, m1: Array | None, n: int) -> Iterator[str]:
    """A Taylor block. Structure 3 (general) or 0 (zero) only: simple readers know no other."""
    anything = m0.any() or (m1 is not None and m1.any())
    head = {
        "order": int(m1 is not None),
        "nrow": m0.shape[0],
        "ncol": m0.shape[1],
        "nq": n,
        "nqn": 0,
        "structure": 3 if anything else 0,
    }
    yield f"{'':{indent}}{name} "
    for key, number in head.items():
        yield _pair(indent + 2, f"{key} ", f"{number}")
    for i, j in np.argwhere(m0):
        yield _pair(indent + 2, f"m0({i + 1:4d},{j + 1:4d}) ", _number(m0[i, j]))
    if m1 is not None:
        for i, q, j in np.argwhere(m1):
            yield _pair(indent + 2, f"m1({i + 1:4d},{q + 1:4d},{j + 1:4d}) ", _number(m1[i, q, j]))
    yield f"{'':{indent}}end {name} "


def _pair(indent: int, key: str, value: str) -> str:
    return f"{'':{indent}}{key:<{44 - indent}}= {value}"


def _number(value: float) -> str:
    return f"{value:23.16E}".replace("E", "D")


# ---- reading ------------------------------------------------------------------------------------------------------


def read_sid(path: str | Path) -> FlexibleBody:
    """The body of a standard input data file; every node becomes an interface of the kind "node".

    The numbers are taken to be in SI units. The layouts of Gr and Ge are those that satisfy Gr_l + Gr_l^T =
    2 dJ/dq_l and Ge = 2 Cr.m1. Where Me is not the unit matrix or Ke not diagonal, the modes are combined. In Oe.m1
    geometric stiffness and mass stand as a sum: the part of the mass is that of masses at the nodes which fit all other
    integrals best, and the sum stays exact. De is the damping of the body. provenance: "layout", "notes" (what was changed),
    "warnings" (what was lost or does not agree).

    Source: Wallrapp 1994. Raises InputError for a file that does not exist, is damaged, truncated or foreign, or
    whose blocks contradict each other, naming line, block or identity, and by how much.

    >>> body = fp.read_sid("rod.SID_FEM")
    """
    return read_body(Path(path), _content)


def _content(lines: list[str], path: Path) -> Content:
    first = next((k for k, line in enumerate(lines) if line.strip()), 0)
    count, n, names = _first_line(lines[first:])
    modal = part(part(sections(lines, first + 1), "part"), "modal")
    only(modal, ("refmod", "frame", *BLOCKS))
    notes = ["every node became an interface of the kind 'node'", "the format has no surface to draw"]
    if not in_standard_order(modal, n):
        notes.append("the indices of m1 are in the order (row, column, mode)")
    refmod = part(modal, "refmod")
    mass = _mass(refmod, n)
    found = {name: _taylor(modal, name, size, n, notes) for name, size in _sizes(n).items()}
    at = read_nodes(part(modal, "frame"), count, n, names)
    M, K = found["Me"].m0, found["Ke"].m0
    limit = bounds(mass, from_inertia(tensor(found["J"].m0[:, 0])), M)
    moments = first_moments(mass, found)
    layout = check_repeated(found, limit)
    stiffness, left = of_accelerations(found, layout, limit)
    content = Content(
        name=unquote(modal.label) or path.stem,
        mass=mass,
        r_dm=moments.r_dm,
        rr_dm=moments.rr_dm,
        P_dm=moments.P_dm,
        rP_dm=moments.rP_dm,
        PP_dm=np.zeros((3, 3, n, n)),
        M=M,
        K=K,
        interfaces=at.interfaces,
        facts={
            "source": {"file": path.name, "format": "SID"},
            "layout": layout,
            "notes": notes,
            "warnings": [
                *at.lost,
                *lost_blocks(found),
                *([] if moments.normal is not None else lumped_mass(found, layout, limit)),
                *left,
                *moments.warnings(),
                *other_frequencies(refmod.values, M, K),
            ],
            **moments.facts(),
        },
        D=usable(found["De"].m0, "De", notes),
    )
    stiffening = np.concatenate([stiffness, np.zeros((6, n, n)), at.stiffening])
    return with_second_moments(content, stiffening, found, limit, moments.axes)


def _taylor(modal: Section, name: str, size: tuple[int, int], n: int, notes: list[str]) -> Taylor:
    """A block; of zeros, with a note, where a file leaves out one of those that are so in most."""
    if name in _OPTIONAL and not any(block.word == name.lower() for block in modal.parts):
        notes.append(f"the file has no block {name}, which says {_OPTIONAL[name]}: none is taken")
        return Taylor(np.zeros(size), np.zeros((size[0], n, size[1])))
    return taylor(part(modal, name), *size, n)


def _sizes(n: int) -> dict[str, tuple[int, int]]:
    square, axes, wide = (n, n), (n, 3), 3 * n
    sizes = ((3, 1), (6, 1), axes, axes, square, (3, wide), (n, wide), (n, 6), (n, 1), square, square)
    return dict(zip(BLOCKS, sizes, strict=True))


def _first_line(lines: list[str]) -> tuple[int, int, list[str]]:
    """Numbers of nodes and modes, and the names of the nodes where this program wrote them."""
    numbers = re.match(r"\s*([0-9]{1,7})\s+([0-9]{1,5})(?![0-9])(.*)", lines[0] if lines else "")
    if numbers is None:
        raise InputError("line 1 must begin with the numbers of nodes and modes: this is not a SID file, or damaged")
    count, n, comment = int(numbers[1]), int(numbers[2]), numbers[3]
    named = comment.partition(NAMES)[2].split(",") if NAMES in comment else []
    return count, n, [unquote(name.strip()) for name in named if name.strip()]


def _mass(refmod: Section, n: int) -> float:
    if integer(refmod, "nelastq") != n:
        raise InputError(f"{refmod} has nelastq = {integer(refmod, 'nelastq')}, but line 1 announces {n} modes")
    return real(value(refmod, "mass"), f"{refmod}: mass")
