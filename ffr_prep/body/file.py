"""The body file: a zip of .npy members (numpy's .npz, readable without this package) and a JSON member "meta". No pickle."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, is_zipfile

import numpy as np

from ffr_prep.body.reduced import (
    BeamForces,
    BodyError,
    FlexibleBody,
    Interface,
    QuadraticField,
    Surface,
    integral_shapes,
)
from ffr_prep.common.arrays import Array
from ffr_prep.common.outputs import note_input, replacing
from ffr_prep.common.reading import nearest_file, not_of_its_ending
from ffr_prep.common.stored_arrays import read_arrays

MAGIC = "ffr-body"
# 2 adds stress modes and section forces, 3 the parts of a body that is cut, 4 a damping matrix. Files of before are read as
# bodies without them, and a body without parts and damping is written as before.
WHOLE, IN_PARTS, DAMPED = 2, 3, 4
MAKE_AGAIN = "make it again with ffr-prep reduce"  # the remedy of a file that is damaged
_LEVEL = 3  # of compression: a third of the time of zlib's own level, for files a twentieth larger


def content_hash(*arrays: Array) -> str:
    """Short SHA-256 of array contents, for provenance."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(str((array.shape, array.dtype.str)).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]


def save_body(body: FlexibleBody, path: str | Path) -> Path:
    """Write the body to one file, atomically: an existing file is replaced only by a complete new one.

    Raises BodyError when the provenance is not JSON; other errors as in `replacing`.

    >>> fd.save_body(body, "rod.ffr")
    """
    path = Path(path)
    arrays = _arrays(body)
    for k, part in enumerate(body.parts):
        arrays |= {f"part/{k}/{key}": value for key, value in _arrays(part).items()}
    version = IN_PARTS if body.parts else WHOLE
    version = DAMPED if any(one.damping is not None for one in (body, *body.parts)) else version
    meta = {"magic": MAGIC, "format_version": version, **_described(body)}
    if body.parts:
        meta["parts"] = [_described(part) for part in body.parts]
    arrays["meta"] = np.frombuffer(_header(body, meta).encode(), dtype=np.uint8)
    return save_arrays(arrays, path)


def _arrays(body: FlexibleBody) -> dict[str, Array]:
    """The arrays of a body by name, those of its parts not among them."""
    arrays = {key: getattr(body, key) for key in integral_shapes(body.n)}
    for k, interface in enumerate(body.interfaces):
        for key in ("position", "phi_t", "phi_r"):
            arrays[f"interface/{k}/{key}"] = getattr(interface, key)
    if body.surface is not None:
        arrays |= {f"surface/{key}": value for key, value in surface_arrays(body.surface).items()}
    if body.stiffening is not None:
        arrays["stiffening"] = body.stiffening
    if body.damping is not None:
        arrays["damping"] = body.damping
    return arrays


def _described(body: FlexibleBody) -> dict[str, Any]:
    """The description of a body in the header of its file."""
    return {
        "name": body.name,
        "mass": body.mass,
        "interfaces": [{"name": i.name, "kind": i.kind} for i in body.interfaces],
        "provenance": dict(body.provenance),
    }


def save_arrays(arrays: Mapping[str, Any], path: Path) -> Path:
    """Write a compressed .npz file that appears only when it is complete; errors as in `replacing`."""
    with replacing(path) as part, ZipFile(part, "w", ZIP_DEFLATED, compresslevel=_LEVEL) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as stream:
                np.lib.format.write_array(stream, np.asanyarray(array), allow_pickle=False)
    return path


def surface_arrays(surface: Surface) -> dict[str, Array]:
    """The arrays of a surface by name, without those it does not have: how files keep it."""
    arrays = {"points": surface.points, "triangles": surface.triangles, "Phi": surface.Phi}
    if surface.stress is not None and surface.moduli is not None:
        arrays |= {"stress": surface.stress, "moduli": surface.moduli}
    parts = {"beams": surface.beams, "second": surface.second, "second_stress": surface.second_stress}
    for key, part in parts.items():
        arrays |= _arrays_of(key, part)
    return arrays


def _arrays_of(key: str, part: BeamForces | QuadraticField | None) -> dict[str, Array]:
    if part is None:
        return {}
    found = {f"{key}/{f.name}": getattr(part, f.name) for f in fields(part) if f.name != "second"}
    return found | (_arrays_of(f"{key}/second", part.second) if isinstance(part, BeamForces) else {})


def surface_of(arrays: Mapping[str, Array]) -> Surface:
    """The surface of these arrays; the inverse of `surface_arrays`."""
    given: dict[str, dict[str, Array]] = {"beams": {}}
    for key, value in arrays.items():
        part, _, name = key.rpartition("/")
        given.setdefault(part, {})[name] = value
    second = {key: QuadraticField(**of) for key, of in given.items() if "shapes" in of}
    own, beams = given[""], given["beams"]
    return Surface(
        points=own["points"],
        triangles=own["triangles"],
        Phi=own["Phi"],
        stress=own.get("stress"),
        moduli=own.get("moduli"),
        beams=BeamForces(beams["positions"], beams["axes"], beams["modes"], second.get("beams/second"))
        if beams
        else None,
        second=second.get("second"),
        second_stress=second.get("second_stress"),
    )


def load_body(path: str | Path) -> FlexibleBody:
    """Read a body file. Raises BodyError for a missing, damaged, truncated, foreign or newer file.

    >>> rod = fd.load_body("rod.ffr")
    """
    path = Path(path)
    note_input(path)
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise BodyError(f"body file {path} is no ordinary file; name one that `ffr-prep reduce` has made")
    try:
        return _with_parts(*_read(path))
    except FileNotFoundError:
        raise BodyError(
            f"body file {path} does not exist; make it with `ffr-prep reduce`, or name one that is there{nearest_file(path)}"
        ) from None
    except (PermissionError, IsADirectoryError) as error:
        raise BodyError(f"body file {path} cannot be read ({error.strerror})") from None
    except BodyError as error:
        raise BodyError(f"{path}: {error}") from None
    except Exception as error:  # a damaged zip, array header or field can fail in any way the readers know
        what = "no zip file" if not is_zipfile(path) else str(error) or type(error).__name__
        fault = f"is damaged, truncated or not a body file ({what}); {MAKE_AGAIN}"
        raise BodyError(not_of_its_ending(path, "a body file", fault)) from None


def _header(body: FlexibleBody, meta: Mapping[str, Any]) -> str:
    try:
        return json.dumps(meta, sort_keys=True)
    except (TypeError, ValueError) as error:
        raise BodyError(f"body {body.name!r}: the provenance must be plain JSON values ({error})") from None


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Array]]:
    with open(path, "rb") as stream:
        magic = stream.read(6)
        if magic == b"\x93NUMPY":
            raise BodyError("not a body file (a bare array); write one with ffr-prep reduce")
        if magic[:2] != b"PK":
            raise ValueError("no zip file")
        stream.seek(0)
        arrays = read_arrays(stream)
        return _meta(arrays), {key: array for key, array in arrays.items() if key != "meta"}


def _meta(stored: Mapping[str, Array]) -> dict[str, Any]:
    if "meta" not in stored:
        raise BodyError("not a body file (it has no header); write one with ffr-prep reduce")
    meta = json.loads(stored["meta"].tobytes())
    if not isinstance(meta, dict) or meta.get("magic") != MAGIC:
        raise BodyError("not a body file (foreign header); write one with ffr-prep reduce")
    if meta["format_version"] > DAMPED:
        raise BodyError(f"body format {meta['format_version']}; this program reads up to {DAMPED}: update the program")
    return meta


def _with_parts(meta: Mapping[str, Any], arrays: Mapping[str, Array]) -> FlexibleBody:
    own: list[dict[str, Array]] = [{} for _ in meta.get("parts", ())]
    for key in [key for key in arrays if key.startswith("part/")]:
        _, k, name = key.split("/", 2)
        own[int(k)][name] = arrays[key]
    parts = tuple(_from_arrays(of, found) for of, found in zip(meta.get("parts", ()), own, strict=True))
    return replace(_from_arrays(meta, arrays), parts=parts)


def _from_arrays(meta: Mapping[str, Any], arrays: Mapping[str, Array]) -> FlexibleBody:
    interfaces = tuple(
        Interface(
            entry["name"],
            arrays[f"interface/{k}/position"],
            arrays[f"interface/{k}/phi_t"],
            arrays[f"interface/{k}/phi_r"],
            entry["kind"],
        )
        for k, entry in enumerate(meta["interfaces"])
    )
    of_surface = {key.removeprefix("surface/"): value for key, value in arrays.items() if key.startswith("surface/")}
    surface = surface_of(of_surface) if of_surface else None
    core: dict[str, Any] = {key: arrays[key] for key in integral_shapes(arrays["omega2"].size)}
    return FlexibleBody(
        name=meta["name"],
        mass=meta["mass"],
        interfaces=interfaces,
        surface=surface,
        stiffening=arrays.get("stiffening"),
        provenance=meta["provenance"],
        damping=arrays.get("damping"),
        **core,
    )
