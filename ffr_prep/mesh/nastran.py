"""Meshes in Nastran bulk data: GRID, solids, faces of shells, property numbers, SET1, coordinate systems.

Source: MSC Nastran Quick Reference Guide (bulk data entries; order of the nodes of the solids).
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import check_count, read_text
from ffr_prep.mesh.bulk_data import Card, cards
from ffr_prep.mesh.file_mesh import FileMesh
from ffr_prep.mesh.left_out import left_out_of_nastran
from ffr_prep.mesh.meshio_files import from_meshio

# Corners of elements and their nodes; Nastran has the edges between both ends of CHEXA and CPENTA before those of the second.
_SOLIDS = {"CTETRA": (4, {4: "tet4", 10: "tet10"}), "CHEXA": (8, {8: "hex8", 20: "hex20"})}
_SOLIDS |= {"CPENTA": (6, {6: "wedge6", 15: "wedge15"})}
_SOLIDS |= dict.fromkeys(("CPYRAM", "CPYRA"), (5, {5: "pyramid5", 13: "pyramid13"}))
_ORDER = {"hex20": [*range(12), *range(16, 20), *range(12, 16)], "wedge15": [*range(9), *range(12, 15), *range(9, 12)]}
_FACES = {"CTRIA3": 3, "CTRIA6": 3, "CTRIAR": 3, "CQUAD4": 4, "CQUAD8": 4, "CQUADR": 4, "CQUAD": 4}
_FLUIDS = ("PFLUID", "FFLUID")
_SYSTEMS = ("CORD2R", "CORD2C", "CORD2S")
_TECPLOT = re.compile(r"^\s*(VARIABLES|ZONE)\b", re.MULTILINE | re.IGNORECASE)
_DEEPEST = 40


@dataclass
class _Deck:
    """The definitions of a bulk data file, by number."""

    grids: dict[int, Card] = field(default_factory=dict)
    systems: dict[int, Card] = field(default_factory=dict)
    elements: set[int] = field(default_factory=set)  # numbers of the solids
    solids: dict[str, list[tuple[int, list[int]]]] = field(default_factory=lambda: defaultdict(list))
    faces: list[tuple[int, list[int]]] = field(default_factory=list)
    sets: dict[int, list[int]] = field(default_factory=dict)
    system: int = 0
    displacements: int = 0  # the system of these where a GRID names none
    found: Counter[str] = field(default_factory=Counter)


def from_nastran(path: Path) -> FileMesh:
    """The mesh of Nastran bulk data. Properties are groups property_N of elements and of faces, SET1 groups set_N of nodes.
    A .dat file may be one of Tecplot, too, which meshio reads.

    Raises InputError for a file that cannot be read, for other solids, and for points in systems that it does not define.
    """
    if path.suffix.lower() == ".dat" and _TECPLOT.search(read_text(path, "Nastran bulk data")):
        return from_meshio(path)
    deck = _Deck()
    try:
        for card in cards(path):
            _take(deck, card)
            deck.found[_kind(card)] += 1
        if not deck.grids:
            raise InputError(
                "it has no GRID: is it Nastran bulk data? Meshes of other programs with this ending, as Ansys has .dat, are "
                "not read: save them as .cdb, .msh, .med, .unv, .inp, .bdf or .vtu"
            )
        return _file_mesh(deck)
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(str(path)) else f"{path}: {text}") from None


@dataclass(frozen=True)
class Grids:
    """The grid points of bulk data: labels (N,) numbers, points (N, 3) in basic coordinates, systems (N,) of their
    displacements (CD), groups: name -> numbers of grid points."""

    labels: Array
    points: Array
    systems: Array
    groups: Mapping[str, Array]


def grids_of_nastran(path: Path) -> Grids:
    """The grid points of bulk data, with SET1 as groups set_N, whatever elements there are.

    Raises InputError for a file that cannot be read or has none, and for points in systems that it does not define.
    """
    deck = _Deck()
    try:
        for card in cards(path):
            if card.name in ("GRID", "GRDSET", "SET1", *_SYSTEMS):
                _take(deck, card)
        if not deck.grids:
            raise InputError("it has no GRID: is it Nastran bulk data?")
        points = _points(deck)
        systems = [card.integer(6, deck.displacements) for card in deck.grids.values()]
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(str(path)) else f"{path}: {text}") from None
    groups = {f"set_{number}": np.array(of, np.int64) for number, of in deck.sets.items() if of}
    return Grids(np.array(list(deck.grids), np.int64), points, np.array(systems, np.int64), groups)


def _kind(card: Card) -> str:
    """The name of a card, or the word in it that says what it changes."""
    if card.name == "MAT1" and card.text(8):
        return "GE"
    fluid = card.text(7).upper() if card.name == "PSOLID" else ""
    return fluid if fluid in _FLUIDS else card.name


def _take(deck: _Deck, card: Card) -> None:
    if card.name == "GRID":
        if deck.grids.setdefault(card.integer(1), card) is not card:
            raise InputError(f"{card} is defined twice")
    elif card.name in _SOLIDS:
        _take_solid(deck, card)
    elif card.name in _FACES:
        deck.faces.append((card.integer(2, 0), [card.integer(3 + k) for k in range(_FACES[card.name])]))
    elif card.name in _SYSTEMS:
        if deck.systems.setdefault(card.integer(1), card).fields != card.fields:
            raise InputError(f"{card} is defined twice")
    elif card.name == "GRDSET":
        deck.system, deck.displacements = card.integer(2, 0), card.integer(6, 0)
    elif card.name == "SET1":
        deck.sets[card.integer(1)] = _members(card)


def _take_solid(deck: _Deck, card: Card) -> None:
    if card.integer(1) in deck.elements:
        raise InputError(f"{card} is defined twice")
    deck.elements.add(card.integer(1))
    corners, kinds = _SOLIDS[card.name]
    given = card.fields[2:]
    while given and not given[-1]:
        given = given[:-1]
    count = corners if len(given) <= corners else max(kinds)
    nodes = [card.integer(3 + k, 0) for k in range(count)]
    if 0 in nodes or len(given) > count:
        raise InputError(
            f"{card} has {len([n for n in given if n])} nodes; it must have {' or '.join(map(str, kinds))}, those at the "
            "middle of edges all or none"
        )
    deck.solids[kinds[count]].append((card.integer(2, 0), nodes))


def _members(card: Card) -> list[int]:
    """Numbers of a SET1: one by one, or FIRST, THRU, LAST."""
    words = [text.upper() for text in card.fields[1:] if text]
    members: list[int] = []
    for k, word in enumerate(words):
        if word == "THRU":
            last = Card(card.name, words, card.line).integer(k + 2)
            check_count(last - members[-1] if members else 0, "members of a set")
            members += range(members[-1] + 1, last) if members else ()
        elif word != "SKIN":
            members.append(Card(card.name, words, card.line).integer(k + 1))
    return members


# ---- to arrays ----------------------------------------------------------------------------------------------------


def _file_mesh(deck: _Deck) -> FileMesh:
    index = {number: k for k, number in enumerate(deck.grids)}
    blocks = []
    for kind, elements in deck.solids.items():
        nodes = _indices(index, [of for _, of in elements])
        blocks.append((kind, nodes[:, _ORDER[kind]] if kind in _ORDER else nodes))
    properties = np.array([number for elements in deck.solids.values() for number, _ in elements], np.int64)
    groups = {number: [of for own, of in deck.faces if own == number] for number in {own for own, _ in deck.faces}}
    sets = {f"set_{n}": np.unique([index[k] for k in of if k in index]) for n, of in deck.sets.items()}
    return FileMesh(
        points=_points(deck),
        blocks=tuple(blocks),
        volumes={f"property_{n}": np.flatnonzero(properties == n) for n in np.unique(properties).tolist()},
        faces={f"property_{n}": _by_size(index, of) for n, of in groups.items()},
        nodes={name: of.astype(np.int64) for name, of in sets.items() if of.size},
        notes=left_out_of_nastran(deck.found),
    )


def _by_size(index: Mapping[int, int], faces: list[list[int]]) -> tuple[Array, ...]:
    parts = [[face for face in faces if len(face) == size] for size in (3, 4)]
    return tuple(_indices(index, part) for part in parts if part)


def _indices(index: Mapping[int, int], numbers: list[list[int]]) -> Array:
    try:
        return np.array([[index[n] for n in row] for row in numbers], np.int64)
    except KeyError as error:
        raise InputError(f"an element refers to GRID {error.args[0]}, which the file does not define") from None


def _points(deck: _Deck) -> Array:
    """(N, 3) in the basic coordinate system."""
    own = [card.integer(2, deck.system) for card in deck.grids.values()]
    points = np.array([[card.real(3 + k, 0.0) for k in range(3)] for card in deck.grids.values()], float).reshape(-1, 3)
    for number in set(own) - {0}:
        here = np.array(own) == number
        points[here] = _in_basic(deck, number, points[here])
    return points


def _in_basic(deck: _Deck, number: int, places: Array, depth: int = 0) -> Array:
    """(P, 3) places in basic coordinates, from a rectangular, cylindrical or spherical system (CORD2x)."""
    if number == 0:
        return places
    if number not in deck.systems or depth > _DEEPEST:
        raise InputError(
            f"GRID points refer to coordinate system {number}, which the file does not define by CORD2R, CORD2C or CORD2S; "
            "write it with all points in the basic coordinate system"
        )
    card = deck.systems[number]
    three = np.array([card.real(3 + k, 0.0) for k in range(9)]).reshape(3, 3)
    origin, on_z, in_xz = _in_basic(deck, card.integer(2, 0), three, depth + 1)
    z = on_z - origin
    y = np.cross(z, in_xz - origin)
    if not np.linalg.norm(y) > 1e-9 * np.linalg.norm(z) * np.linalg.norm(in_xz - origin):
        raise InputError(f"{card}: its three points lie on a line, so it has no axes")
    axes = np.array([np.cross(y, z) / np.linalg.norm(np.cross(y, z)), y / np.linalg.norm(y), z / np.linalg.norm(z)])
    return np.asarray(origin + _rectangular(card.name, places) @ axes)


def _rectangular(kind: str, places: Array) -> Array:
    """Angles are in degrees: r, theta, z of a cylindrical system, r, theta (from z), phi of a spherical one."""
    if kind == "CORD2R":
        return places
    r, theta = places[:, 0], np.radians(places[:, 1])
    if kind == "CORD2C":
        return np.stack([r * np.cos(theta), r * np.sin(theta), places[:, 2]], axis=1)
    phi = np.radians(places[:, 2])
    return np.stack([r * np.sin(theta) * np.cos(phi), r * np.sin(theta) * np.sin(phi), r * np.cos(theta)], axis=1)
