"""The checkpoint of a stopped run: its state, all counters, and the mark of the run that it belongs to."""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import astuple, dataclass
from typing import Any

import numpy as np

from ffr_dyn.results.power import Worked
from ffr_dyn.results.quantities import Memory, Unwound
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError


@dataclass(frozen=True)
class Checkpoint:
    """The end of the last row of a run.

    fingerprint : of the scene and the settings (`fingerprint`)
    steps       : of the integrator, done since the start
    arrays      : by name; everything that changes while a run goes on
    memory      : what `measure` continues
    """

    fingerprint: str
    steps: int
    arrays: Mapping[str, Array]
    memory: Memory


def fingerprint(tables: Any, *settings: object) -> str:
    """A hash of compiled tables (nested tuples of arrays and numbers) and of settings, by their text.

    Addresses of Python functions are not part of it: what these do cannot be compared.
    """
    digest = hashlib.sha256()
    for name, array in leaves(tables):
        if not name.endswith("address"):
            digest.update(f"{name} {array.dtype} {array.shape}".encode())
            digest.update(np.ascontiguousarray(array).tobytes())
    for setting in settings:
        digest.update(repr(setting).encode())
    return digest.hexdigest()


def leaves(tables: Any, name: str = "") -> Iterator[tuple[str, Array]]:
    """(dotted name, array) of everything in nested named tuples, dictionaries of arrays, arrays and numbers."""
    if isinstance(tables, tuple):
        for key, value in zip(tables._fields, tables, strict=True):  # type: ignore[attr-defined]
            yield from leaves(value, f"{name}.{key}".strip("."))
    else:
        yield name, np.asarray(tables)


def encode(checkpoint: Checkpoint) -> Array:
    """The checkpoint as bytes (uint8), without pickle."""
    stored = {f"a {name}": array for name, array in checkpoint.arrays.items()}
    for name, memory in checkpoint.memory.items():
        stored[f"{_LETTERS[type(memory)]} {name}"] = np.array(_numbers(memory))
    stream = io.BytesIO()
    np.savez(stream, fingerprint=checkpoint.fingerprint, steps=checkpoint.steps, **stored)  # type: ignore[arg-type]
    return np.frombuffer(stream.getvalue(), dtype=np.uint8)


def decode(content: Array) -> Checkpoint:
    """The checkpoint from its bytes. Raises InputError for bytes that are not one."""
    try:
        with np.load(io.BytesIO(content.tobytes())) as stored:
            arrays = {name[2:]: stored[name] for name in stored if name.startswith("a ")}
            memory = {name[2:]: _memory(name[0], stored[name]) for name in stored if name[:2] in ("u ", "w ")}
            return Checkpoint(str(stored["fingerprint"]), int(stored["steps"]), arrays, memory)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"the checkpoint is damaged ({error}); run from the start") from None


_LETTERS = {Unwound: "u", Worked: "w"}


def _numbers(memory: Unwound | Worked) -> list[float]:
    if isinstance(memory, Worked):
        return [memory.work, memory.time, *memory.powers]
    return list(astuple(memory))


def _memory(letter: str, numbers: Array) -> Unwound | Worked:
    first, second, *rest = map(float, numbers)
    return Worked(first, second, tuple(rest)) if letter == "w" else Unwound(first, second, *rest)
