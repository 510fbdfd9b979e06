"""Meshes of other programs (VTK, Medit, ...) that meshio reads or holds, brought to plain arrays."""

from __future__ import annotations

import contextlib
import io
import pickle
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import meshio
import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.children import finished
from ffr_prep.common.errors import InputError
from ffr_prep.common.reading import not_of_its_ending
from ffr_prep.mesh.cells import WEDGE_TURNED
from ffr_prep.mesh.file_mesh import FileMesh, supported_kind
from ffr_prep.mesh.medit import from_medit

_VOLUMES = {"tetra": "tet4", "tetra10": "tet10", "hexahedron": "hex8", "hexahedron20": "hex20", "hexahedron27": "hex27"}
_VOLUMES |= {"wedge": "wedge6", "wedge18": "wedge18", "pyramid": "pyramid5"}
_FACES = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4}
_MOST_TAGS = 100
# Formats whose readers look for ever for what a file that is cut off does not have, and how long one may take [s]: any,
# and for a megabyte.
_ENDLESS = (".ele", ".node", ".dat", ".tec", ".off", ".ply")
_PATIENCE, _PER_MEGABYTE = 20.0, 2.0
_READER = "import meshio, pickle, sys; pickle.dump(meshio.read(sys.argv[1]), open(sys.argv[2], 'wb'))"
_NO_NODE_TAGS = ("gmsh:dim_tags",)
_SAVE = "save the mesh as .msh, .med, .unv, .inp, .bdf or .vtu"

Groups = Mapping[str, Sequence[Array]]


def from_meshio(path: Path) -> FileMesh:
    """The mesh that meshio reads. Raises InputError for a file that it cannot read and for other element kinds."""
    read = _read(path)
    volumes = [k for k, block in enumerate(read.cells) if block.dim == 3]
    faces = [k for k, block in enumerate(read.cells) if block.type in _FACES]
    groups = dict(_cell_sets(read)) | dict(_tagged_cells(read))
    return FileMesh(
        points=_in_space(path, read.points),
        blocks=tuple(_block(read, k) for k in volumes),
        volumes=_volume_groups(read, volumes, groups),
        faces=_face_groups(read, faces, groups),
        nodes=_node_groups(read),
        notes=tuple(_ignored(read)),
    )


def _read(path: Path) -> meshio.Mesh:
    """meshio's readers raise whatever comes, exit, and write to the terminal; its reader of Medit stops at second order."""
    if path.suffix.lower() == ".mesh":
        return from_medit(path)
    if not path.name.lower().endswith(tuple(meshio.extension_to_filetypes)):
        raise InputError(
            not_of_its_ending(path, "a mesh", f"has an ending that no reader knows: {_SAVE}, or a geometry as .step")
        )
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as said:
        try:
            return _read_apart(path) if path.suffix.lower() in _ENDLESS else meshio.read(path)
        except (Exception, SystemExit) as error:
            first = [] if isinstance(error, SystemExit) else [f"{type(error).__name__}: {error}"]
            words = " ".join([*first, *said.getvalue().split()])
    fault = f"cannot be read as a mesh ({words}); is it complete, and does its ending name its format? If so, {_SAVE}"
    raise InputError(not_of_its_ending(path, "a mesh", fault))


def _read_apart(path: Path) -> meshio.Mesh:
    """By a process of its own. Raises EOFError where that is ended because it finds no end, ValueError where it fails."""
    seconds = _PATIENCE + _PER_MEGABYTE * path.stat().st_size / 1e6
    with TemporaryDirectory() as folder:
        made = Path(folder) / "mesh"
        try:
            done = finished([sys.executable, "-P", "-c", _READER, str(path), str(made)], seconds)
        except subprocess.TimeoutExpired:
            raise EOFError(f"no end was found within {seconds:.3g} s") from None
        if done.returncode:
            raise ValueError(done.stderr.strip().rpartition("\n")[2])
        mesh: meshio.Mesh = pickle.loads(made.read_bytes())
        return mesh


def _in_space(path: Path, points: Array) -> Array:
    if np.ndim(points) != 2 or np.shape(points)[1] != 3:
        raise InputError(f"{path} has no points with x, y and z (their shape is {np.shape(points)}); is it complete?")
    return np.asarray(points, np.float64)


def _block(read: meshio.Mesh, k: int) -> tuple[str, Array]:
    """Kind and nodes of the elements; of wedges the lower triangle first, for which the lists of VTK have either."""
    cells = read.cells[k]
    kind, nodes = supported_kind(_VOLUMES.get(cells.type, cells.type), cells.type), np.asarray(cells.data, np.int64)
    if kind not in WEDGE_TURNED or not len(nodes):
        return kind, nodes
    first, second, third, above = (np.asarray(read.points, float)[nodes[:, c]] for c in range(4))
    up = np.sum(np.cross(second - first, third - first) * (above - first), axis=1)
    return kind, nodes if (up > 0).any() else nodes[:, WEDGE_TURNED[kind]]


def _ignored(read: meshio.Mesh) -> Iterator[str]:
    for block in read.cells:
        if block.dim != 3 and block.type not in _FACES and block.type != "vertex":
            yield f"{len(block.data)} {block.type} elements are ignored; only solids are reduced"


# ---- groups -------------------------------------------------------------------------------------------------------


def _cell_sets(read: meshio.Mesh) -> Iterator[tuple[str, Sequence[Array]]]:
    """Named sets of cells: for each block the indices within it."""
    for name, members in read.cell_sets.items():
        if not name.startswith("gmsh:"):
            yield name, [np.asarray([] if of is None else of, np.int64) for of in members]


def _tagged_cells(read: meshio.Mesh) -> Iterator[tuple[str, Sequence[Array]]]:
    """Groups by integer tags of cells; many values are a numbering instead."""
    for key, blocks in read.cell_data.items():
        tags = [np.asarray(tag) for tag in blocks]
        for value in _tag_values(tags):
            yield f"{_short(key)}_{value}", [np.flatnonzero(tag == value) for tag in tags]


def _node_groups(read: meshio.Mesh) -> dict[str, Array]:
    groups = {name: np.unique(np.asarray(members, np.int64)) for name, members in read.point_sets.items()}
    for key, tag in read.point_data.items():
        if key in _NO_NODE_TAGS:
            continue
        groups |= {f"{_short(key)}_{value}": np.flatnonzero(tag == value) for value in _tag_values([tag])}
    return groups


def _tag_values(tags: Sequence[Array]) -> list[int]:
    if not tags or any(tag.ndim != 1 or not np.issubdtype(tag.dtype, np.integer) for tag in tags):
        return []
    values = np.unique(np.concatenate(tags))
    return values.tolist() if values.size <= _MOST_TAGS else []


def _short(key: str) -> str:
    return key.rpartition(":")[2]


def _volume_groups(read: meshio.Mesh, volumes: Sequence[int], groups: Groups) -> dict[str, Array]:
    first = np.cumsum([0, *(len(read.cells[k].data) for k in volumes)])
    found = {name: [of[k] + first[i] for i, k in enumerate(volumes)] for name, of in groups.items()}
    return {name: np.concatenate(of) for name, of in found.items() if any(part.size for part in of)}


def _face_groups(read: meshio.Mesh, faces: Sequence[int], groups: Groups) -> dict[str, tuple[Array, ...]]:
    corners = {k: np.asarray(read.cells[k].data, np.int64)[:, : _FACES[read.cells[k].type]] for k in faces}
    found = {name: tuple(corners[k][of[k]] for k in faces) for name, of in groups.items()}
    return {name: of for name, of in found.items() if any(part.size for part in of)}
