"""Geometry and meshes that gmsh reads, brought to plain arrays.

Numbers stay in the unit of the file. Node order is that of `elements`; faces are given by their corners only, since
the volume elements know the rest of their faces.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.mesh import gmsh_process
from ffr_prep.mesh.cells import node_order
from ffr_prep.mesh.source import Source, supported_kind

Array = np.ndarray

CAD_UNITS = {"m": "M", "cm": "CM", "mm": "MM", "in": "INCH"}
GEOMETRY = (".geo", ".step", ".stp", ".iges", ".igs", ".brep")
BY_GMSH = (*GEOMETRY, ".msh", ".med", ".unv")
IGES = (".iges", ".igs")
WITH_UNIT = (".step", ".stp", *IGES)

_TIMEOUT = 3600.0
_LIBRARIES = "libglu1-mesa libgl1 libxcursor1 libxft2 libxinerama1 libgomp1"


# ---- the mesh -------------------------------------------------------------------------------------------------------


def from_gmsh(path: Path, *, unit: str, size: float | None, numbers: Mapping[str, float], order: int) -> Source:
    """What gmsh makes of a file, in a process of its own.

    unit : for CAD files that declare a unit, the unit to convert to; size : largest element edge
    Raises InputError for a file that gmsh cannot read, ComputationError when meshing fails.
    """
    return _source(_arrays(path, dimension=3, unit=unit, size=size, numbers=numbers, order=order))


def lines_from_gmsh(
    path: Path, *, unit: str, size: float | None, numbers: Mapping[str, float]
) -> tuple[Array, dict[str, Array], dict[str, Array]]:
    """The curves of a file as straight lines: points (N, 3), the lines (L, 2) of each group and the nodes of each group.

    Arguments and errors as in `from_gmsh`.
    """
    stored = _arrays(path, dimension=1, unit=unit, size=size, numbers=numbers, order=1)
    names = json.loads(stored["names"].tobytes())
    lines = {name: stored[f"line_{g}"] for g, name in enumerate(names["lines"])}
    return stored["points"], lines, {name: stored[f"node_{g}"] for g, name in enumerate(names["nodes"])}


@dataclass(frozen=True)
class LinesAndFaces:
    """points (N, 3); by group: lines (L, 2), the corners of faces (T, 3) and (Q, 4), and nodes."""

    points: Array
    lines: Mapping[str, Array]
    faces: Mapping[str, tuple[Array, Array]]
    nodes: Mapping[str, Array]


def faces_from_gmsh(path: Path, *, unit: str, size: float | None, numbers: Mapping[str, float]) -> LinesAndFaces:
    """The surfaces of a file as flat triangles and quadrilaterals, and its curves as straight lines.

    Arguments and errors as in `from_gmsh`.
    """
    stored = _arrays(path, dimension=2, unit=unit, size=size, numbers=numbers, order=1)
    names = json.loads(stored["names"].tobytes())
    return LinesAndFaces(
        points=stored["points"],
        lines={name: stored[f"line_{g}"] for g, name in enumerate(names["lines"])},
        faces={name: (stored[f"face_{g}_3"], stored[f"face_{g}_4"]) for g, name in enumerate(names["faces"])},
        nodes={name: stored[f"node_{g}"] for g, name in enumerate(names["nodes"])},
    )


def _arrays(
    path: Path, *, dimension: int, unit: str, size: float | None, numbers: Mapping[str, float], order: int
) -> dict[str, Array]:
    """The arrays that the process writes."""
    job = {
        "path": str(path.resolve()),
        "dimension": dimension,
        "generate": path.suffix.lower() in GEOMETRY,
        "unit": CAD_UNITS[unit],
        "size": size,
        "numbers": dict(numbers),
        "order": order,
    }
    with tempfile.TemporaryDirectory(prefix="ffr-gmsh-") as folder:
        job_file, result = Path(folder, "job.json"), Path(folder, "result.npz")
        job_file.write_text(json.dumps(job))
        _run_gmsh(path, job_file, result)
        with np.load(result) as stored:
            return dict(stored)


def _run_gmsh(path: Path, job_file: Path, result: Path) -> None:
    # By its path, so that it also runs where the package is not installed; -P keeps its folder off sys.path.
    command = [sys.executable, "-P", gmsh_process.__file__, str(job_file), str(result)]
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise ComputationError(
            f"gmsh did not finish {path} within {_TIMEOUT:g} s: choose a larger element size, or simplify the geometry"
        ) from None
    said = _last_words(done.stdout + done.stderr)
    if done.returncode == gmsh_process.UNLOADABLE:
        raise ComputationError(f"gmsh cannot be loaded ({said}); on Debian: apt-get install {_LIBRARIES}")
    if done.returncode == gmsh_process.UNREADABLE:
        raise InputError(f"gmsh cannot read {path}: {said}; is it complete, and does its ending name its format?")
    if done.returncode == gmsh_process.UNMESHED:
        raise ComputationError(f"gmsh could not mesh {path}: {said}; try another element size, or repair the geometry")
    if done.returncode:
        raise ComputationError(f"gmsh ended with code {done.returncode} on {path}; its last words: {said or 'none'}")


def _last_words(log: str) -> str:
    """The errors in a log of gmsh in one line, or its last lines where there are none."""
    plain = re.sub(r"\x1b\[[0-9;]*m", "", log)
    lines = [re.sub(r"\s+", " ", line).strip() for line in plain.splitlines() if line.strip()]
    errors = [line for line in lines if re.match(r"Error|.*Error\b", line)]
    return " | ".join(dict.fromkeys((errors or lines)[-3:]))


def _source(stored: dict[str, Array]) -> Source:
    names = json.loads(stored["names"].tobytes())
    kinds = [_gmsh_kind(name, stored[f"cells_{k}"].shape[1]) for k, name in enumerate(names["kinds"])]
    blocks = [_gmsh_block(kind, stored, k) for k, kind in enumerate(kinds)]
    first = np.cumsum([0, *(len(nodes) for _, nodes in blocks)])
    return Source(
        points=stored["points"],
        blocks=tuple(blocks),
        volumes={
            name: np.concatenate([stored[f"volume_{g}_{k}"] + first[k] for k in range(len(kinds))])
            for g, name in enumerate(names["volumes"])
            if kinds
        },
        faces={name: (stored[f"face_{g}_3"], stored[f"face_{g}_4"]) for g, name in enumerate(names["faces"])},
        nodes={name: stored[f"node_{g}"] for g, name in enumerate(names["nodes"])},
        notes=tuple(names["notes"]),
    )


def _gmsh_kind(name: str, size: int) -> str:
    kind = f"{'tet' if 'etrahedron' in name else 'hex' if 'exahedron' in name else name}{size}"
    return supported_kind(kind, name)


def _gmsh_block(kind: str, stored: dict[str, Array], k: int) -> tuple[str, Array]:
    local = stored[f"local_{k}"]
    unit = local if kind.startswith("tet") else (local + 1) / 2
    return kind, stored[f"cells_{k}"][:, node_order(kind, unit)]


# ---- the unit that a CAD file declares ----------------------------------------------------------------------------


def declared_unit(path: Path) -> str:
    """The length unit of a STEP file: "m", "cm", "mm" or "in"; "mm" where it declares another, and for IGES files.

    OpenCASCADE converts to the unit it is asked for, except that it gives IGES in millimetres whatever they declare.
    """
    if path.suffix.lower() in IGES:
        return "mm"
    text = path.read_text(errors="replace")
    context = re.search(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([^)]*)\)", text)
    for reference in re.findall(r"#\d+", context[1]) if context else []:
        entity = re.search(rf"{reference}\s*=\s*\(([^;]*)\)\s*;", text)
        if entity and "LENGTH_UNIT" in entity[1]:
            if re.search(r"CONVERSION_BASED_UNIT\s*\(\s*'INCH", entity[1], re.IGNORECASE):
                return "in"
            prefix = re.search(r"SI_UNIT\s*\(\s*(\$|\.\w+\.)\s*,\s*\.METRE\.", entity[1])
            return {"$": "m", ".CENTI.": "cm"}.get(prefix[1], "mm") if prefix else "mm"
    return "mm"
