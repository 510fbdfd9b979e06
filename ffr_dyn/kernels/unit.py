"""Compiled units: functions that are compiled once, on their own, and called by address."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from functools import cached_property, partial
from typing import Any

from numba import cfunc, types

from ffr_dyn.kernels.options import OPTIONS
from ffr_dyn.kernels.simd.intrinsics import call_of

# Of the units of `ffr_dyn.kernels.entry_points` and of integrators: tables, time, two addresses.
SIGNATURE = types.int64(types.int64, types.float64, types.int64, types.int64)
# Of the kernels of forces: tables, number of the force, addresses of x (X,), f (V,) and load (M, 6).
_OF_FORCE = (types.int64,) * 5


class Unit:
    """A function of `signature`, compiled at the first use of its address, or read from disk.

    Those of other packages are compiled anew by every process: nobody would notice that one on disk is older than the kernels
    it was compiled with.
    """

    def __init__(self, function: Callable[..., int], signature: Any = SIGNATURE) -> None:
        self.function = function
        self.signature = signature

    @property
    def own(self) -> bool:
        """Whether it is of this package, and kept on disk."""
        return self.function.__module__.startswith("ffr_dyn.")

    @cached_property
    def compiled(self) -> Any:
        return cfunc(self.signature, cache=self.own, **OPTIONS)(self.function)

    @property
    def address(self) -> int:
        return self.compiled.address


# A decorator: the kernel of a kind of force, a function of (tables, number of the force, x, f, load) that adds to f the
# right-hand sides, body axes, and to load what markers take. Returns OK.
force_kernel: Any = partial(Unit, signature=types.int64(*_OF_FORCE))

# call_force(kernel, tables, number of the force, x, f, load)
call_force = call_of(*_OF_FORCE)


def kernel_named(name: str) -> Unit:
    """The kernel "module:name"."""
    module, _, attribute = name.partition(":")
    unit = getattr(importlib.import_module(module), attribute)
    if not isinstance(unit, Unit):
        raise TypeError(f"{name} is no kernel of a force; decorate it with force_kernel")
    return unit
