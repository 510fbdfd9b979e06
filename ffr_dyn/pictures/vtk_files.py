"""Results as VTK reads them: VTKHDF, one mesh that stands still and fields over time; PVD, a VTU file for each row.

Source: VTK file formats, the documents "VTKHDF file format" (2.0, transient unstructured grids) and "VTK XML formats".
"""

from __future__ import annotations

import base64
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from ffr_dyn.pictures.film import Film, Solid, displaced, film_at
from ffr_dyn.results.result import Result
from ffr_dyn.results.stress import values_at
from ffr_dyn.scene.stress_sensors import MEASURES
from ffr_prep.body import displacements
from ffr_prep.common.arrays import Array
from ffr_prep.common.hdf5 import new_file
from ffr_prep.common.outputs import replacing

_TRIANGLE, _LINE = 5, 3  # kinds of cells
_BATCH = 400_000  # points times rows that are worked on at once


@dataclass(frozen=True, eq=False)
class Grid:
    """All bodies as one mesh. points (P, 3) [m] undeformed, where the bodies are at the first row; cells one after the other:
    connectivity, offsets (C + 1,), types (C,), and of each the number of its body."""

    points: Array
    connectivity: Array
    offsets: Array
    types: Array
    body: Array
    names: tuple[str, ...]


def grid(film: Film) -> Grid:
    """The mesh of a film: triangles of surfaces, lines between the markers of bodies without one."""
    points = [solid.R[0] + solid.surface.points @ solid.A[0].T for solid in film.solids]
    points += [link.points[0] for link in film.links]
    cells = [solid.surface.triangles for solid in film.solids] + [link.pairs for link in film.links]
    first = np.cumsum([0, *map(len, points)])
    sizes = np.concatenate([np.full(len(of), of.shape[1]) for of in cells])
    return Grid(
        np.concatenate(points),
        np.concatenate([(of + start).ravel() for of, start in zip(cells, first, strict=False)]),
        np.concatenate([[0], np.cumsum(sizes)]),
        np.where(sizes == 3, _TRIANGLE, _LINE).astype(np.uint8),
        np.concatenate([np.full(len(of), k) for k, of in enumerate(cells)]),
        (*(solid.name for solid in film.solids), *(link.name for link in film.links)),
    )


def fields(film: Film, mesh: Grid) -> Iterator[dict[str, Array]]:
    """For each row: displacement (P, 3) from the points of the mesh, elastic (P, 3), both [m] in global axes; von_mises (P,)
    [Pa] where a body has stress modes."""
    still = [np.zeros((len(link.points[0]), 3)) for link in film.links]
    stressed = any(solid.surface.stress is not None for solid in film.solids)
    pieces = max(1, len(film.times) * len(mesh.points) // _BATCH)
    for rows in np.array_split(np.arange(len(film.times)), pieces):
        local = [_elastic(solid, rows) for solid in film.solids]
        stress = [_von_mises(solid, rows) for solid in film.solids] if stressed else []
        for k, row in enumerate(rows):
            elastic = [u[k] @ solid.A[row].T for solid, u in zip(film.solids, local, strict=True)]
            places = [_at_rest(solid, row) + u for solid, u in zip(film.solids, elastic, strict=True)]
            moved = np.concatenate([*places, *(link.points[row] for link in film.links)]) - mesh.points
            found = {"displacement": moved, "elastic": np.concatenate([*elastic, *still])}
            if stressed:
                found["von_mises"] = np.concatenate([*(of[k] for of in stress), *(of[:, 0] for of in still)])
            yield found


def _at_rest(solid: Solid, row: int) -> Array:
    """(P, 3) undeformed points where the body is at a row."""
    return np.asarray(solid.R[row] + solid.surface.points @ solid.A[row].T)


def _elastic(solid: Solid, rows: Array) -> Array:
    """(B, P, 3) elastic displacements at some rows, body axes."""
    if solid.parts is not None:
        return np.stack([displaced(solid, int(row)) for row in rows])
    return displacements(solid.surface, solid.q[rows])


def _von_mises(solid: Solid, rows: Array) -> Array:
    """(B, P)."""
    if solid.surface.stress is None:
        return np.zeros((len(rows), len(solid.surface.points)))
    return values_at(solid.surface, solid.q[rows], MEASURES["von-mises"]).T


def write_vtkhdf(result: Result, path: Path) -> Path:
    """One file with the mesh and, for each row of the result, the fields."""
    film = film_at(result, result.time, colour="body")
    mesh, rows = grid(film), result.time.size
    with replacing(path) as part, new_file(part) as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 0], np.int64)
        root.attrs["Type"] = np.bytes_("UnstructuredGrid")
        _write_mesh(root, mesh)
        data, count = root.create_group("PointData"), len(mesh.points)
        for row, found in enumerate(fields(film, mesh)):
            for name, values in found.items():
                if row == 0:
                    shape = (rows * count, *values.shape[1:])
                    data.create_dataset(
                        name, shape, "f4", chunks=(count, *values.shape[1:]), compression=1, shuffle=True
                    )
                data[name][row * count : (row + 1) * count] = values
        _write_steps(root, result.time, mesh, tuple(data))
    return path


def _write_mesh(root: Any, mesh: Grid) -> None:
    counts = {"Points": mesh.points, "Cells": mesh.types, "ConnectivityIds": mesh.connectivity}
    for name, of in counts.items():
        root[f"NumberOf{name}"] = np.array([len(of)], np.int64)
    root["Points"], root["Types"] = mesh.points, mesh.types
    root["Connectivity"], root["Offsets"] = mesh.connectivity.astype(np.int64), mesh.offsets.astype(np.int64)
    root["CellData/body"] = mesh.body.astype(np.int64)
    root.attrs["bodies"] = ", ".join(mesh.names)


def _write_steps(root: Any, time: Array, mesh: Grid, names: tuple[str, ...]) -> None:
    """Where the parts of each time are: the mesh always at the start, fields one after the other."""
    steps, none = root.create_group("Steps"), np.zeros(len(time), np.int64)
    steps.attrs["NSteps"] = len(time)
    steps["Values"], steps["NumberOfParts"] = time, none + 1
    for name in ("PartOffsets", "PointOffsets", "CellDataOffsets/body"):
        steps[name] = none
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        steps[name] = none[:, None]
    for name in names:
        steps[f"PointDataOffsets/{name}"] = len(mesh.points) * np.arange(len(time), dtype=np.int64)


# ---- PVD and VTU -----------------------------------------------------------------------------------------------------


def write_pvd(result: Result, path: Path) -> Path:
    """A list of VTU files, one for each row, which are in a folder of the same name; points are where the bodies are."""
    film = film_at(result, result.time, colour="body")
    mesh, folder, digits = grid(film), path.with_suffix(""), len(str(result.time.size))
    files = [f"{folder.name}/{row:0{digits}}.vtu" for row in range(result.time.size)]
    for name, found in zip(files, fields(film, mesh), strict=True):
        with replacing(path.parent / name) as part:
            part.write_text("\n".join(_vtu(mesh, found)), encoding="ascii")
    sets = [
        f'<DataSet timestep="{t!r}" file={quoteattr(name)}/>'
        for t, name in zip(result.time.tolist(), files, strict=True)
    ]
    lines = ['<VTKFile type="Collection" version="0.1">', "<Collection>", *sets, "</Collection>", "</VTKFile>"]
    with replacing(path) as part:
        part.write_text("\n".join(lines), encoding="utf-8")
    return path


def _vtu(mesh: Grid, values: dict[str, Array]) -> Iterator[str]:
    yield '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">'
    yield f'<UnstructuredGrid><Piece NumberOfPoints="{len(mesh.points)}" NumberOfCells="{len(mesh.types)}">'
    yield "<Points>" + _array("Points", mesh.points + values["displacement"]) + "</Points>"
    yield "<Cells>"
    yield _array("connectivity", mesh.connectivity.astype(np.int64))
    yield _array("offsets", mesh.offsets[1:].astype(np.int64))
    yield _array("types", mesh.types)
    yield "</Cells><PointData>"
    yield from (_array(name, of) for name, of in values.items())
    yield "</PointData><CellData>" + _array("body", mesh.body.astype(np.int64)) + "</CellData>"
    yield "</Piece></UnstructuredGrid></VTKFile>"


def _array(name: str, values: Array) -> str:
    kind = {"f": "Float64", "i": "Int64", "u": "UInt8"}[values.dtype.kind]
    content = np.ascontiguousarray(values).tobytes()
    coded = base64.b64encode(np.uint64(len(content)).tobytes() + content).decode()
    parts = values.shape[1] if values.ndim > 1 else 1
    return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{parts}" format="binary">{coded}</DataArray>'
