"""Meshes in Abaqus input files (.inp), as written by Abaqus, CalculiX, gmsh and most mesh programs.

Nodes, elements, and all ways to name a part of them: *NSET, *ELSET, *SURFACE, the NSET and ELSET parameters, sets of
sets, GENERATE. meshio reads .inp too, but neither surfaces nor face elements of second order, and of a set that comes
in pieces it keeps the last.

Source: Abaqus Keywords Reference Guide; Abaqus Analysis User's Guide, Three-dimensional solid element library (node
order and face numbers).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import check_count, read_text
from ffr_prep.mesh.file_mesh import FileMesh, supported_kind
from ffr_prep.mesh.left_out import left_out_of_abaqus

Row = list[str]

# Corners of the faces S1, S2, ... of elements by their number of nodes. The node order is that of VTK but for the last
# seven nodes of C3D27: the centre, then those of the faces S1 to S6.
_TET_FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
_HEX_FACES = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
_WEDGE_FACES = ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0))
_PYRAMID_FACES = ((0, 1, 2, 3), (0, 4, 1), (1, 4, 2), (2, 4, 3), (3, 4, 0))
_FACES: dict[int, tuple[tuple[int, ...], ...]] = {
    **dict.fromkeys((4, 10), _TET_FACES),
    **dict.fromkeys((5, 13), _PYRAMID_FACES),
    **dict.fromkeys((6, 15), _WEDGE_FACES),
    **dict.fromkeys((8, 20, 27), _HEX_FACES),
}
_HEX27 = [*range(20), 26, 24, 23, 25, 21, 22, 20]
_SOLID = re.compile(r"(?:C3D|DC3D)(\d+)(V?)")  # V: as many nodes in the faces as there are
_PLANE = re.compile(r"(?:S|SC|STRI|CPS|CPE|CPEG|CAX|M3D|SFM3D|R3D|DS|DC2D)(3|4|6|8|9|65)(?!\d)")
_CORNERS = {3: 3, 6: 3, 65: 3, 4: 4, 8: 4, 9: 4}
_MAKING = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM")
_LISTED = "write the mesh with every node in global axes and every element listed, as programs with a window do"
_KINDS = {4: "tet4", 10: "tet10", 8: "hex8", 20: "hex20", 27: "hex27"}
_KINDS |= {6: "wedge6", 15: "wedge15", 5: "pyramid5", 13: "pyramid13"}


@dataclass
class _Deck:
    """The definitions of a file, by number and by name; set names in upper case lead to the spelling of the file."""

    nodes: dict[int, list[float]] = field(default_factory=dict)
    solids: dict[str, dict[int, list[int]]] = field(default_factory=dict)
    faces: dict[int, list[int]] = field(default_factory=dict)
    node_sets: dict[str, list[str]] = field(default_factory=dict)
    element_sets: dict[str, list[str]] = field(default_factory=dict)
    nodes_of: dict[str, list[str]] = field(
        default_factory=dict
    )  # of a node set the sets of elements whose nodes it has
    surfaces: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    spelling: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    found: Counter[str] = field(default_factory=Counter)
    instances: int = 0
    placed: tuple[Array, Array] | None = (
        None  # axes (3, 3) and origin (3,) of the one part, where its instance moves it
    )
    in_assembly: bool = False  # beside its instances, where numbers count anew
    reference_points: int = 0


def from_abaqus(path: Path) -> FileMesh:
    """The mesh of an Abaqus input file. Raises InputError for a file that cannot be read and for several parts."""
    deck = _deck(path, _READERS)
    try:
        return _file_mesh(deck)
    except KeyError as error:
        raise InputError(f"{path} refers to {error.args[0]}, which it does not define; is it complete?") from None


def nodes_from_abaqus(path: Path) -> tuple[Array, Array, dict[str, Array]]:
    """Numbers (N,) and coordinates (N, 3) of the nodes of an Abaqus input file, and the numbers in its node sets.

    Raises InputError for a file that cannot be read and for nodes with coordinate systems of their own.
    """
    deck = _deck(path, {key: _READERS[key] for key in ("NODE", "NSET", "INSTANCE")} | {"TRANSFORM": _read_transform})
    if not deck.nodes:
        raise InputError(f"{path} defines no nodes")
    try:
        sets = {deck.spelling[name]: np.unique(_resolved(name, deck.node_sets)) for name in deck.node_sets}
    except KeyError as error:
        raise InputError(f"{path} refers to {error.args[0]}, which it does not define; is it complete?") from None
    return (
        np.array(list(deck.nodes), np.int64),
        _points(deck),
        {name: of.astype(np.int64) for name, of in sets.items() if of.size},
    )


def _deck(path: Path, readers: Mapping[str, Callable[[_Deck, Mapping[str, str], list[Row]], None]]) -> _Deck:
    deck = _Deck()
    try:
        for keyword, parameters, rows in keyword_sections(path):
            deck.found[f"*{keyword}"] += 1
            if keyword in _MAKING and (rows or keyword != "SYSTEM"):
                raise InputError(f"*{keyword} makes nodes or elements, which is not done here: {_LISTED}")
            if keyword in readers:
                readers[keyword](deck, parameters, rows)
    except (ValueError, KeyError, IndexError, UnicodeDecodeError) as error:
        if isinstance(error, InputError):
            raise InputError(f"{path}: {error}") from None
        raise InputError(f"cannot read {path} as an Abaqus input file ({type(error).__name__}: {error})") from None
    return deck


# ---- reading ------------------------------------------------------------------------------------------------------


def keyword_sections(path: Path, above: tuple[Path, ...] = ()) -> Iterator[tuple[str, dict[str, str], list[Row]]]:
    """Keyword, parameters (in upper case, values as written) and data rows, through included files."""
    if path.resolve() in above:
        raise InputError(f"it includes itself: {' -> '.join(one.name for one in (*above, path))}")
    for block in re.split(r"^[ \t]*\*(?!\*)", _without_comments(path), flags=re.MULTILINE)[1:]:
        header, _, data = block.partition("\n")
        while header.rstrip().endswith(",") and re.match(r"[ \t]*[A-Za-z]", data):
            more, _, data = data.partition("\n")
            header += more
        keyword, *settings = (" ".join(word.split()) for word in header.split(","))
        pairs = (setting.partition("=") for setting in settings)
        parameters = {name.strip().upper(): value.strip().strip('"') for name, _, value in pairs}
        if keyword.upper() == "INCLUDE":
            yield from keyword_sections(path.parent / parameters["INPUT"], (*above, path.resolve()))
        else:
            if keyword.upper() in ("NODE", "ELEMENT") and "INPUT" in parameters:
                data = _without_comments(path.parent / parameters["INPUT"])
            yield keyword.upper(), parameters, [_row(line) for line in data.splitlines() if line.strip()]


def _without_comments(path: Path) -> str:
    text = read_text(path, "an Abaqus input file")
    return "\n".join(line for line in text.splitlines() if not line.startswith("**"))


def _row(line: str) -> Row:
    return [word.strip().strip('"') for word in line.strip().rstrip(",").split(",")]


def _read_nodes(deck: _Deck, parameters: Mapping[str, str], rows: list[Row]) -> None:
    if deck.in_assembly:
        deck.reference_points += len(rows)
        return
    if parameters.get("SYSTEM", "R").upper() != "R":
        raise InputError(f"nodes are given in cylindrical or spherical coordinates (SYSTEM): {_LISTED}")
    for number, *coordinates in rows:
        if int(number) in deck.nodes:
            raise InputError(f"node {number} is defined twice; write each part to a file of its own")
        xyz = [float(x.replace("D", "E").replace("d", "e") or 0) for x in coordinates[:3]]
        deck.nodes[int(number)] = xyz + [0.0] * (3 - len(xyz))
    if "NSET" in parameters:
        _extend(deck, deck.node_sets, parameters["NSET"], [row[0] for row in rows])


def _read_elements(deck: _Deck, parameters: Mapping[str, str], rows: list[Row]) -> None:
    kind = parameters["TYPE"].upper()
    solid, plane = _SOLID.match(kind), _PLANE.match(kind)
    size = int((solid or plane or [0, 0])[1])
    if solid:
        ours = kind if solid[2] else _KINDS.get(size, kind)
        target = deck.solids.setdefault(supported_kind(ours, parameters["TYPE"]), {})
    elif plane:
        target, size = deck.faces, 6 if size == 65 else size
    else:
        deck.found[kind] += len(rows)
        if not left_out_of_abaqus({kind: 1}):
            deck.notes.append(f"{len(rows)} elements of type {parameters['TYPE']} are ignored; only solids are reduced")
        return
    numbers = np.array([int(word) for row in rows for word in row], np.int64).reshape(-1, size + 1).tolist()
    for number, *nodes in numbers:
        if any(of.get(number, nodes) != nodes for of in (*deck.solids.values(), deck.faces)):
            raise InputError(f"element {number} is defined twice; write each part to a file of its own")
        target[number] = nodes
    if "ELSET" in parameters:
        _extend(deck, deck.element_sets, parameters["ELSET"], [str(number) for number, *_ in numbers])


def _read_node_set(deck: _Deck, parameters: Mapping[str, str], rows: list[Row]) -> None:
    _extend(deck, deck.node_sets, parameters["NSET"], _of_parts(deck, parameters, rows))
    if "ELSET" in parameters:
        deck.nodes_of.setdefault(parameters["NSET"].upper(), []).append(parameters["ELSET"])


def _read_element_set(deck: _Deck, parameters: Mapping[str, str], rows: list[Row]) -> None:
    _extend(deck, deck.element_sets, parameters["ELSET"], _of_parts(deck, parameters, rows))


def _of_parts(deck: _Deck, parameters: Mapping[str, str], rows: list[Row]) -> list[str]:
    """The members of a set, without the numbers of what the assembly itself defines: reference points, springs."""
    members = _members(parameters, rows)
    own = deck.in_assembly and "INSTANCE" not in parameters
    return [member for member in members if not (own and member.isdecimal())]


def _read_surface(deck: _Deck, parameters: Mapping[str, str], rows: list[Row]) -> None:
    name = parameters["NAME"]
    if parameters.get("TYPE", "ELEMENT").upper() == "NODE":
        _extend(deck, deck.node_sets, name, [row[0] for row in rows])
        return
    sides = [(row[0], row[1].upper() if len(row) > 1 else "") for row in rows]
    if not all(member and re.fullmatch(r"S[1-6]|SPOS|SNEG", side) for member, side in sides):
        deck.notes.append(f"surface {name!r} is left out: it is not a list of elements and faces S1 to S6")
        return
    deck.spelling.setdefault(name.upper(), name)
    deck.surfaces.setdefault(name.upper(), []).extend(sides)


def _read_instance(deck: _Deck, parameters: Mapping[str, str], rows: list[Row]) -> None:
    deck.instances += 1
    deck.in_assembly = False
    if deck.instances > 1:
        raise InputError("it places parts in an assembly; write the one part to reduce to a file of its own")
    if rows:
        deck.placed = _placed([[float(word or 0) for word in row] for row in rows])


def _placed(rows: list[list[float]]) -> tuple[Array, Array]:
    """Axes and origin of an instance: it is shifted first, then turned by an angle [deg] about a line through two points."""
    shift, *turn = rows
    axes, origin = np.eye(3), np.array([*shift, 0.0, 0.0, 0.0][:3])
    if turn:
        first, along, angle = np.array(turn[0][:3]), np.subtract(turn[0][3:6], turn[0][:3]), np.radians(turn[0][6])
        if not along.any():
            raise InputError("an instance turns about a line whose two points are one; give it another, or no turn")
        axes = Rotation.from_rotvec(angle * along / np.linalg.norm(along)).as_matrix()
        origin = first + axes @ (origin - first)
    return axes, origin


def _enter_assembly(deck: _Deck, parameters: Mapping[str, str], rows: list[Row]) -> None:
    deck.in_assembly = True


def _leave_assembly(deck: _Deck, parameters: Mapping[str, str], rows: list[Row]) -> None:
    deck.in_assembly = False


def _read_transform(deck: _Deck, parameters: Mapping[str, str], rows: list[Row]) -> None:
    raise InputError(
        f"it gives node set {parameters.get('NSET', '')!r} a coordinate system of its own (*TRANSFORM): matrices are needed "
        "in global axes"
    )


_READERS: Mapping[str, Callable[[_Deck, Mapping[str, str], list[Row]], None]] = {
    "NODE": _read_nodes,
    "ELEMENT": _read_elements,
    "NSET": _read_node_set,
    "ELSET": _read_element_set,
    "SURFACE": _read_surface,
    "INSTANCE": _read_instance,
    "ASSEMBLY": _enter_assembly,
    "END INSTANCE": _enter_assembly,
    "END ASSEMBLY": _leave_assembly,
}


def _members(parameters: Mapping[str, str], rows: list[Row]) -> list[str]:
    """Numbers and names of a set; GENERATE gives first, last and step."""
    if "GENERATE" not in parameters:
        return [word for row in rows for word in row]
    ranges = [(int(first), int(last), int(step[0]) if step else 1) for first, last, *step in rows]
    check_count(sum(len(range(first, last + 1, step)) for first, last, step in ranges), "members of a set")
    return [str(number) for first, last, step in ranges for number in range(first, last + 1, step)]


def _extend(deck: _Deck, sets: dict[str, list[str]], name: str, members: list[str]) -> None:
    deck.spelling.setdefault(name.upper(), name)
    sets.setdefault(name.upper(), []).extend(members)


# ---- to arrays ----------------------------------------------------------------------------------------------------


def _points(deck: _Deck) -> Array:
    """(N, 3) where the one instance has them."""
    points = np.array(list(deck.nodes.values()), float).reshape(-1, 3)
    return points if deck.placed is None else points @ deck.placed[0].T + deck.placed[1]


def _file_mesh(deck: _Deck) -> FileMesh:
    index = {number: k for k, number in enumerate(deck.nodes)}
    solids = {kind: elements for kind, elements in deck.solids.items() if elements}
    number_of = {n: k for k, n in enumerate(n for elements in solids.values() for n in elements)}
    found = {name: _resolved(name, deck.element_sets) for name in deck.element_sets}
    volumes = {name: [number_of[n] for n in members if n in number_of] for name, members in found.items()}
    planes = {name: [deck.faces[n] for n in members if n in deck.faces] for name, members in found.items()}
    sides = {name: _sides(deck, rows) for name, rows in deck.surfaces.items()}
    corners = {name: [face[: _CORNERS[len(face)]] for face in faces] for name, faces in (planes | sides).items()}
    nodes = {name: _resolved(name, deck.node_sets) + _nodes_of(deck, name) for name in deck.node_sets}
    return FileMesh(
        points=_points(deck),
        blocks=tuple((kind, _nodes_in_order(kind, _indices(index, list(of.values())))) for kind, of in solids.items()),
        volumes={deck.spelling[name]: np.unique(of) for name, of in volumes.items() if of},
        faces={deck.spelling[name]: _by_size(index, of) for name, of in corners.items() if of},
        nodes={deck.spelling[name]: np.unique(_indices(index, [of])) for name, of in nodes.items() if of},
        notes=(*deck.notes, *_points_left_out(deck), *left_out_of_abaqus(deck.found)),
    )


def _points_left_out(deck: _Deck) -> list[str]:
    return [
        f"{deck.reference_points} nodes of the assembly left out: reference points are those of interfaces, --interface "
        "NAME=REGION@x,y,z"
        for _ in range(deck.reference_points > 0)
    ]


def _nodes_of(deck: _Deck, name: str) -> list[int]:
    """Numbers of the nodes of the element sets that a node set names."""
    elements = deck.faces | {number: nodes for of in deck.solids.values() for number, nodes in of.items()}
    numbers = _resolved("", {"": deck.nodes_of.get(name, []), **deck.element_sets})
    return [node for number in numbers for node in elements.get(number, [])]


def _indices(index: Mapping[int, int], numbers: list[list[int]]) -> Array:
    try:
        return np.array([[index[n] for n in row] for row in numbers], np.int64)
    except KeyError as error:
        raise KeyError(f"node {error.args[0]}") from None


def _nodes_in_order(kind: str, nodes: Array) -> Array:
    return nodes[:, _HEX27] if kind == "hex27" else nodes


def _by_size(index: Mapping[int, int], faces: list[list[int]]) -> tuple[Array, ...]:
    parts = [[face for face in faces if len(face) == size] for size in (3, 4)]
    return tuple(_indices(index, part) for part in parts if part)


def _resolved(name: str, sets: Mapping[str, list[str]], within: tuple[str, ...] = ()) -> list[int]:
    """Numbers in a set, through the sets it names; a number may carry the name of its instance."""
    numbers: list[int] = []
    for member in sets[name]:
        whole, plain = member.upper(), member.rpartition(".")[2].upper()
        if whole in sets and whole not in (*within, name):  # a name may hold a point, too
            numbers += _resolved(whole, sets, (*within, name))
        elif plain.isdecimal():
            numbers.append(int(plain))
        elif plain in sets and plain not in (*within, name):
            numbers += _resolved(plain, sets, (*within, name))
        else:
            raise KeyError(f"the set {member!r}")
    return numbers


def _sides(deck: _Deck, rows: list[tuple[str, str]]) -> list[list[int]]:
    """Corners of the faces that a surface names by element, or set of elements, and side."""
    solids = {number: nodes for elements in deck.solids.values() for number, nodes in elements.items()}
    faces = []
    for member, side in rows:
        for number in _resolved("", {"": [member], **deck.element_sets}):
            if number in solids and side[1:].isdecimal():
                faces.append(_side(solids[number], int(side[1:]) - 1))
            elif number in deck.faces:
                faces.append(deck.faces[number])
            else:
                raise KeyError(f"side {side} of element {number}")
    return faces


def _side(nodes: list[int], side: int) -> list[int]:
    return [nodes[k] for k in _FACES[len(nodes)][side]]
