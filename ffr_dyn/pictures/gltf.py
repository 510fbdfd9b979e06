"""Results as glTF 2.0 (binary, .glb): bodies as nodes that move, their deformation as morph targets with weights over time.

Source: Khronos, glTF 2.0 specification. Lengths are metres, y is up in viewers: nothing is turned.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ffr_dyn.pictures.film import Film, film_at
from ffr_dyn.pictures.morphs import beside, morph, quadratic
from ffr_dyn.pictures.page import Piece, pieces
from ffr_dyn.results.result import Result
from ffr_prep.common.arrays import Array
from ffr_prep.common.outputs import replacing

_FLOAT, _UINT = 5126, 5125
_TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
_MOST = 24, 8  # morph targets, linear and quadratic

Item = dict[str, Any]


class _Buffer:
    """Accessors over one chunk of bytes."""

    def __init__(self) -> None:
        self.content = bytearray()
        self.views: list[Item] = []
        self.accessors: list[Item] = []

    def add(self, values: Array, kind: int = _FLOAT, target: int | None = None) -> int:
        """The number of the accessor of values (k,) or (k, 3 or 4)."""
        array = np.ascontiguousarray(values, "<f4" if kind == _FLOAT else "<u4")
        view: Item = {"buffer": 0, "byteOffset": len(self.content), "byteLength": array.nbytes}
        self.views.append(view | ({"target": target} if target else {}))
        self.content += array.tobytes()
        flat = array.reshape(len(array), -1)
        accessor: Item = {"bufferView": len(self.views) - 1, "componentType": kind, "count": len(array)}
        ends = {"min": flat.min(axis=0).tolist(), "max": flat.max(axis=0).tolist()}
        self.accessors.append(accessor | {"type": _TYPES[flat.shape[1]]} | ends)
        return len(self.accessors) - 1


def write_glb(result: Result, path: Path) -> Path:
    """One file with all bodies and their motion, undeformed at weights of zero; the deformation is not exaggerated."""
    film = film_at(result, result.time, colour="body")
    tree, content = _scene(film)
    text = json.dumps(tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = b"".join(
        np.array([len(of), kind], "<u4").tobytes() + of for of, kind in ((text, 0x4E4F534A), (content, 0x004E4942))
    )
    with replacing(path) as part:
        part.write_bytes(b"glTF" + np.array([2, 12 + len(chunks)], "<u4").tobytes() + chunks)
    return path


def _scene(film: Film) -> tuple[Item, bytes]:
    buffer, bodies = _Buffer(), pieces(film)
    times = buffer.add(film.times - film.times[0])
    tree: Item = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(bodies)))}]}
    tree |= {"nodes": [], "meshes": [], "materials": []}
    samplers, channels = list[Item](), list[Item]()
    for number, body in enumerate(bodies):
        mesh, weights = _mesh(body, buffer, number)
        moving = {"translation": body.pose[:, :3], "rotation": np.roll(body.pose[:, 3:], -1, axis=1)}
        tree["nodes"].append({"name": body.name, "mesh": number, **{key: of[0].tolist() for key, of in moving.items()}})
        tree["meshes"].append(mesh)
        tree["materials"].append(_material(body.colour))
        for key, values in moving.items() if len(film.times) > 1 else ():
            samplers.append({"input": times, "output": buffer.add(values)})
            channels.append({"sampler": len(samplers) - 1, "target": {"node": number, "path": key}})
        if weights.size and len(film.times) > 1:
            samplers.append({"input": times, "output": buffer.add(weights.ravel())})
            channels.append({"sampler": len(samplers) - 1, "target": {"node": number, "path": "weights"}})
    if channels:
        tree["animations"] = [{"name": "motion", "samplers": samplers, "channels": channels}]
    tree |= {
        "buffers": [{"byteLength": len(buffer.content)}],
        "bufferViews": buffer.views,
        "accessors": buffer.accessors,
    }
    return tree, bytes(buffer.content)


def _mesh(body: Piece, buffer: _Buffer, number: int) -> tuple[Item, Array]:
    """A mesh with its morph targets, and their weights (T, k)."""
    surface = body.surface
    linear = morph(surface.Phi, body.q, _MOST[0])
    whole = beside(linear, morph(*quadratic(surface.second, surface.Phi, body.q), _MOST[1]))
    primitive: Item = {"attributes": {"POSITION": buffer.add(surface.points, target=34962)}, "material": number}
    primitive["indices"] = buffer.add(surface.triangles.ravel(), _UINT, 34963)
    shapes: Sequence[Array] = [whole.shapes[:, :, k] * whole.scales[k] for k in range(len(whole.scales))]
    if shapes:
        primitive["targets"] = [{"POSITION": buffer.add(shape, target=34962)} for shape in shapes]
    mesh: Item = {"name": body.name, "primitives": [primitive]}
    return mesh | ({"weights": whole.weights[0].tolist()} if shapes else {}), whole.weights


def _material(colour: str) -> Item:
    red, green, blue = ((int(colour[k : k + 2], 16) / 255) ** 2.2 for k in (1, 3, 5))
    metal = {"baseColorFactor": [red, green, blue, 1.0], "metallicFactor": 0.1, "roughnessFactor": 0.7}
    return {"pbrMetallicRoughness": metal, "doubleSided": True}
