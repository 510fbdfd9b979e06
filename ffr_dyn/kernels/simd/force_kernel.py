"""Kernels of forces: each compiled alone and called by its address in `Tables.forces`.

A scene has the kernels of the kinds of force in it, in the order of `ffr_dyn.scene.force_kinds.kernels_of`; `Loads.row` says
which is of a force. Arguments and calls are those of entry points (`ffr_dyn.kernels.simd.entry_point`).
"""

from __future__ import annotations

from functools import cache
from typing import Any, get_type_hints

from ffr_dyn.kernels.simd.entry_point import CompiledFunction, call_like
from ffr_dyn.kernels.tables import Tables, Vector
from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import loaded


def _declared(r: Tables, k: int, x: Vector, f: Vector) -> int:
    """Force number k at positions x: adds to f (V,) the right-hand sides, body axes. Returns OK."""
    raise NotImplementedError


force_kernel = CompiledFunction  # the decorator of a kernel, a function with the arguments of `_declared`

call_force = call_like(_declared)  # call_force(address, r, k, x, f)


def kernel_of(kernel: str | CompiledFunction) -> CompiledFunction:
    """The kernel that a kind of force names, "package.module:name", or is given. InputError for what is none."""
    found = loaded(kernel) if isinstance(kernel, str) else kernel
    if not isinstance(found, CompiledFunction):
        raise InputError(f"{kernel!r} is no kernel of a force: decorate a function with force_kernel")
    if _types(found.function) != _types(_declared):
        raise InputError(
            f"the kernel {found.name} of a force must be declared as"
            f" {found.name}(r: Tables, k: int, x: Vector, f: Vector) -> int"
        )
    return found


@cache
def _types(function: Any) -> list[Any]:
    """Of all arguments, in order, and of what it returns."""
    return list(get_type_hints(function).values())
