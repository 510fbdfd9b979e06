"""Geometry and meshes that gmsh reads, brought to plain arrays.

Numbers stay in the unit of the file. Node order is that of `elements`; faces are given by their corners only, since
the volume elements know the rest of their faces.
"""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.children import finished
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.common.reading import read_text
from ffr_prep.common.registry import choice
from ffr_prep.mesh import gmsh_process
from ffr_prep.mesh.cells import KINDS, node_order
from ffr_prep.mesh.file_mesh import DrawnFace, FileMesh, FileSkin, FileSolid, supported_kind
from ffr_prep.mesh.formats import MOST_ELEMENTS
from ffr_prep.mesh.geometry.face import METRES
from ffr_prep.mesh.geometry.step_text import face_labels, length_unit
from ffr_prep.mesh.time_limit import limit

CAD_UNITS = {"m": "M", "cm": "CM", "mm": "MM", "in": "INCH"}

_MESHES = (".msh", ".med", ".unv")
_IGES, _STEP = (".iges", ".igs"), "a STEP file"
_CRASHES = (signal.SIGABRT, signal.SIGBUS, signal.SIGSEGV)
_SCRIPT = ".geo"
_IGES_LINE = rb"[^\n]{72}[SC]"
_SIGNATURES = {  # how files of data begin
    ".msh": rb"\$(MeshFormat|Comments|NOD)\b",
    ".med": rb"\x89HDF\r\n\x1a\n",
    ".unv": rb"\s*-1\s*\n",
    ".step": rb"\s*ISO-10303-21",
    ".stp": rb"\s*ISO-10303-21",
    ".iges": _IGES_LINE,
    ".igs": _IGES_LINE,
    ".brep": rb"\s*(DBRep_DrawableShape|CASCADE Topology)",
}
_WITH_UNIT = (".step", ".stp", *_IGES)
_SHAPES = {"etrahedron": "tet", "exahedron": "hex", "rism": "wedge", "yramid": "pyramid"}
_SYMMETRIC = {  # by corners, the coordinates of gmsh's reference element that go from -1 to 1
    4: (False, False, False),
    5: (True, True, False),
    6: (False, False, True),
    8: (True, True, True),
}
_LIBRARIES = "libglu1-mesa libgl1 libxcursor1 libxft2 libxinerama1 libgomp1"


# ---- the mesh -------------------------------------------------------------------------------------------------------


def from_gmsh(path: Path, **wanted: Any) -> FileMesh:
    """The mesh that gmsh reads or makes of a file, in a process of its own; arguments as of `read_mesh`.

    Raises InputError for a file that gmsh cannot read, for parameters that a script does not have and for a unit that
    contradicts the file's; ComputationError when meshing fails.
    """
    stored, unit = _arrays(path, "solids", **wanted)
    return _file_mesh(path, stored, unit)


def mesh_from_gmsh(path: Path) -> FileMesh:
    """A mesh that gmsh reads, in the unit that a universal file declares, but metres, which some write whatever they have;
    errors as in `from_gmsh`."""
    mesh = from_gmsh(path)
    declared = _unit_of_universal(path) if path.suffix.lower() == ".unv" else None
    return mesh if declared in (None, "m") else replace(mesh, unit=declared)


def _unit_of_universal(path: Path) -> str | None:
    """By the factor of dataset 164 by which lengths are divided to be metres (I-deas Test Data Format); None of others."""
    found = re.search(
        r"^ *-1 *\n *164 *\n.*\n *([\d.]+)[DE]([+-]\d+)", read_text(path, "a universal file"), re.MULTILINE
    )
    factor = float(f"{found[1]}e{found[2]}") if found else 0.0
    return next((unit for unit, metres in METRES.items() if abs(factor * metres - 1) < 1e-3), None)


def skin_from_gmsh(path: Path, **wanted: Any) -> FileSkin:
    """The faces of the solids of a geometry with what they are, without a volume mesh; otherwise as `from_gmsh`."""
    stored, unit = _arrays(path, "skin", **wanted)
    names = json.loads(stored["names"].tobytes())
    solids = [
        (s["name"], s["label"], s["volume"], np.array(s["centre"]), np.reshape(s["inertia"], (3, 3)))
        for s in names["solids"]
    ]
    return FileSkin(
        points=stored["points"],
        drawn=_drawn_faces(path, stored, names),
        solids=tuple(FileSolid(*of) for of in solids),
        unit=unit,
        overlaps=tuple((one, other, volume) for one, other, volume in names.get("overlaps", ())),
        notes=(gmsh_process.NO_GROUP,) if names["left_out"] else (),
    )


@dataclass(frozen=True)
class LinesAndFaces:
    """points (N, 3); by group: lines (L, 2), the corners of faces (T, 3) and (Q, 4), and nodes; the unit, if declared."""

    points: Array
    lines: Mapping[str, Array]
    faces: Mapping[str, tuple[Array, Array]]
    nodes: Mapping[str, Array]
    unit: str | None


def lines_and_faces(
    path: Path, *, faces: bool, unit: str | None, size: float | None, numbers: Mapping[str, float]
) -> LinesAndFaces:
    """The curves of a file as straight lines, and if asked for its surfaces as flat triangles and quadrilaterals.

    Other arguments and errors as in `from_gmsh`.
    """
    stored, unit = _arrays(path, "surfaces" if faces else "lines", unit=unit, size=size, numbers=numbers)
    names = json.loads(stored["names"].tobytes())
    return LinesAndFaces(
        points=stored["points"],
        lines={name: stored[f"line_{g}"] for g, name in enumerate(names["lines"])},
        faces=_faces(stored, names) if faces else {},
        nodes=_nodes(stored, names),
        unit=unit,
    )


def _arrays(
    path: Path,
    wanted: str,
    *,
    unit: str | None = None,
    size: float | None = None,
    numbers: Mapping[str, float] | None = None,
    order: int = 1,
    most_elements: float = MOST_ELEMENTS,
    glue: bool = False,
    solids: Sequence[str] = (),
    overlaps: bool = False,
) -> tuple[dict[str, Array], str | None]:
    """The arrays that the process writes, and the unit of their numbers, where it is known."""
    suffix = path.suffix.lower()
    _check_content(path)
    _check_geometry(path, unit, numbers or {})
    if suffix == _SCRIPT and (glue or solids):
        what = "--glue joins" if glue else "--solid chooses"
        raise InputError(f"{what} solids of CAD files; in {path}, write BooleanFragments and Physical Volume")
    declared = declared_unit(path) if suffix in _WITH_UNIT else None
    job: dict[str, Any] = {
        "wanted": wanted,
        "generate": suffix not in _MESHES,
        "unit": CAD_UNITS[declared or unit or "m"],  # what a script merges comes in the unit of its own numbers
        "size": size,
        "numbers": dict(numbers or {}),
        "order": order,
        "most": most_elements,
        "glue": glue,
        "solids": list(solids),
        "overlaps": overlaps,
    }
    with _temporary() as folder:
        job_file, result = Path(folder, "job.json"), Path(folder, "result.npz")
        job_file.write_text(json.dumps(job | {"path": str(_alone(path, Path(folder)))}))
        _run_gmsh(path, job_file, result)
        if not result.exists():
            raise InputError(
                f"gmsh ended before {path} was a mesh: take Exit, and what else ends it, out of the script"
            )
        with np.load(result) as stored:
            return dict(stored), declared or unit


def _temporary() -> tempfile.TemporaryDirectory[str]:
    try:
        return tempfile.TemporaryDirectory(prefix="ffr-gmsh-")
    except OSError as error:
        raise ComputationError(
            f"there is no room for temporary files ({error.strerror}); set TMPDIR to a folder with some"
        ) from None


def _alone(path: Path, folder: Path) -> Path:
    """Where gmsh finds a file that holds data: it would run options that stand beside it, and unknown endings as scripts."""
    suffix = path.suffix.lower()
    if suffix == _SCRIPT:
        return path.resolve()
    data = folder / f"{path.stem}{suffix}"
    data.symlink_to(path.resolve())
    return data


def _check_content(path: Path) -> None:
    """InputError for what is not what its ending says: gmsh runs content that it does not know as a script."""
    suffix = path.suffix.lower()
    if suffix != _SCRIPT and suffix not in _SIGNATURES:
        raise InputError(f"{path}: gmsh is asked for {', '.join([_SCRIPT, *_SIGNATURES])} only; does its ending fit?")
    with open(path, "rb") as stream:
        start = stream.read(4096)
    if suffix != _SCRIPT and not re.match(_SIGNATURES[suffix], start):
        raise InputError(f"{path} is not what its ending says: a {suffix} file begins in another way; is it complete?")


def _check_geometry(path: Path, unit: str | None, numbers: Mapping[str, float]) -> None:
    suffix = path.suffix.lower()
    if suffix in _IGES and unit not in (None, "mm"):
        raise InputError(f"{path} declares its unit and is converted to millimetres; leave out the unit {unit!r}")
    if suffix in _WITH_UNIT and unit not in (None, declared_unit(path)):
        raise InputError(
            f"{path} declares that its numbers are {declared_unit(path)}, and the unit {unit!r} is given: leave it out, or, "
            "if the file is wrong, export it again with the unit that is meant"
        )
    if suffix == _SCRIPT:
        if path.read_bytes().rpartition(b"\n")[2].strip():
            raise InputError(
                f"the last line of {path} does not end with a line break, so gmsh would ignore it: add one"
            )
        _check_parameters(path, numbers)
        if unit != "mm" and re.search(r"\.(iges|igs)[\"']", path.read_text(errors="replace"), re.IGNORECASE):
            raise InputError(
                f"{path} names an IGES file, which comes in millimetres: give the unit mm, in which all its lengths are then"
            )


def _check_parameters(path: Path, numbers: Mapping[str, float]) -> None:
    """Gmsh ignores a parameter that its script does not have, and one that it sets whatever it is given."""
    script = re.sub(r"//.*", "", path.read_text(errors="replace"))
    if re.search(r"^\s*Include\b", script, re.MULTILINE):
        return  # the parameter may be in the other file
    declared = re.findall(r"DefineConstant\s*\[(.*?)\]\s*;", script, re.DOTALL)
    known = dict.fromkeys(re.findall(r"(\w+)\s*=", "".join(declared)))
    for name in numbers:
        if not re.search(rf"\b{re.escape(name)}\b", script):
            raise InputError(f"{path} has no parameter {name!r}; {choice(name, known)}")
        first = re.search(rf"(?<![\w.]){re.escape(name)}\s*=(?!=)", script)
        if name not in known and first and not re.search(rf"\bExists\s*\(\s*{re.escape(name)}\b", script):
            line = script[first.start() :].partition(";")[0].strip()
            raise InputError(
                f"{path} sets {name} itself, whatever is given for it: {line}; write DefineConstant[ {name} = ... ]; in its "
                "place, whose number is a default"
            )


def _run_gmsh(path: Path, job_file: Path, result: Path) -> None:
    # By its path, so that it also runs where the package is not installed; -P keeps its folder off sys.path.
    command = [sys.executable, "-P", gmsh_process.__file__, str(job_file), str(result)]
    try:
        done = finished(command, limit())
        if -done.returncode in _CRASHES:  # one of some dozens of runs on one input ends so
            done = finished(command, limit())
    except subprocess.TimeoutExpired:
        raise ComputationError(
            f"gmsh did not finish {path} within {limit():g} s: choose a larger element size, simplify the geometry, or give "
            "it more time (--mesher-timeout)"
        ) from None
    said = _last_words(done.stdout + done.stderr).replace(str(job_file.parent), str(path.parent))
    if done.returncode == gmsh_process.UNLOADABLE:
        raise ComputationError(f"gmsh cannot be loaded ({said}); on Debian: apt-get install {_LIBRARIES}")
    if done.returncode == gmsh_process.UNREADABLE:
        raise InputError(f"gmsh cannot read {path}: {said}; is it complete, and does its ending name its format?")
    if done.returncode == gmsh_process.REFUSED:
        raise InputError(f"{path}: {done.stderr.strip()}")
    if done.returncode == gmsh_process.UNMESHED:
        raise ComputationError(f"gmsh could not mesh {path}: {said}; try another element size, or repair the geometry")
    if done.returncode:
        raise ComputationError(f"gmsh ended with code {done.returncode} on {path}; its last words: {said or 'none'}")


def _last_words(log: str) -> str:
    """The errors in a log of gmsh in one line, or its last lines where there are none."""
    plain = re.sub(r"\x1b\[[0-9;]*m", "", log)
    lines = [re.sub(r"\s+", " ", line).strip() for line in plain.splitlines()]
    lines = [line for line in lines if line and not line.startswith("Info")] or lines
    errors = [line for line in lines if re.match(r"Error|.*Error\b", line)]
    return " | ".join(dict.fromkeys((errors or lines)[-3:]))


def _file_mesh(path: Path, stored: dict[str, Array], unit: str | None) -> FileMesh:
    names = json.loads(stored["names"].tobytes())
    kinds = [_gmsh_kind(name, stored[f"cells_{k}"].shape[1]) for k, name in enumerate(names["kinds"])]
    blocks = [_gmsh_block(kind, stored, k) for k, kind in enumerate(kinds)]
    first = np.cumsum([0, *(len(nodes) for _, nodes in blocks)])
    return FileMesh(
        points=stored["points"],
        blocks=tuple(blocks),
        volumes={
            name: np.concatenate([stored[f"volume_{g}_{k}"] + first[k] for k in range(len(kinds))])
            for g, name in enumerate(names["volumes"])
            if kinds
        },
        faces=_faces(stored, names),
        nodes=_nodes(stored, names),
        notes=tuple(names["notes"]),
        unit=unit,
        drawn=_drawn_faces(path, stored, names),
    )


def _drawn_faces(path: Path, stored: Mapping[str, Array], names: Mapping[str, Any]) -> tuple[DrawnFace, ...]:
    """The faces of the geometry, with the names that the text of a STEP file has for them."""
    faces = [
        DrawnFace(**facts, corners=(stored[f"geometry_{k}_3"], stored[f"geometry_{k}_4"]))
        for k, facts in enumerate(names["geometry"])
    ]
    if path.suffix.lower() not in (".step", ".stp"):
        return tuple(faces)
    of_solids = [list(group) for _, group in groupby(faces, key=lambda face: face.solids)]
    glued = any(len(face.solids) > 1 for face in faces)  # into solids whose faces are not those of the file
    labels = [""] * len(faces)
    if not glued:
        labels = face_labels(read_text(path, _STEP), [[face.kind for face in group] for group in of_solids])
    return tuple(replace(f, label=label or _own_label(f)) for f, label in zip(faces, labels, strict=True))


def _own_label(face: DrawnFace) -> str:
    """The label of the CAD library, which repeats that of the solid for faces with a colour of their own."""
    return "" if face.label in {solid.rpartition("#")[0] or solid for solid in face.solids} else face.label


def _faces(stored: Mapping[str, Array], names: Mapping[str, list[str]]) -> dict[str, tuple[Array, Array]]:
    return {name: (stored[f"face_{g}_3"], stored[f"face_{g}_4"]) for g, name in enumerate(names["faces"])}


def _nodes(stored: Mapping[str, Array], names: Mapping[str, list[str]]) -> dict[str, Array]:
    return {name: stored[f"node_{g}"] for g, name in enumerate(names["nodes"])}


def _gmsh_kind(name: str, size: int) -> str:
    shape = next((ours for word, ours in _SHAPES.items() if word in name), name)
    return supported_kind(f"{shape}{size}", name)


def _gmsh_block(kind: str, stored: dict[str, Array], k: int) -> tuple[str, Array]:
    local = stored[f"local_{k}"]
    unit = np.where(_SYMMETRIC[KINDS[kind].corners], (local + 1) / 2, local)
    return kind, stored[f"cells_{k}"][:, node_order(kind, unit)]


# ---- the unit that a CAD file declares ----------------------------------------------------------------------------


def declared_unit(path: Path) -> str:
    """The length unit of a STEP file: "m", "cm", "mm" or "in"; "mm" where it declares another, and for IGES files.

    OpenCASCADE converts to the unit it is asked for, except that it gives IGES in millimetres whatever they declare.
    """
    if path.suffix.lower() in _IGES:
        return "mm"
    return length_unit(read_text(path, _STEP))
