"""The parts of numba's private modules that compiled code uses, imported here alone, and whether they are as expected.

`PLAIN` tells that it is not, or that plain forms are asked for (see the package).
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import numba
from llvmlite import ir
from numba import types
from numba.extending import intrinsic as _intrinsic

from ffr_prep.common.compile_cache import is_sound

__all__ = [
    "PLAIN",
    "AttributeTemplate",
    "call_of",
    "cgutils",
    "compiled_forms",
    "intrinsic",
    "make_array",
    "populate_array",
]

KNOWN = (0, 60), (0, 70)  # numba from, and below

try:
    from numba.core import cgutils
    from numba.core.caching import FunctionCache
    from numba.core.typing.templates import AttributeTemplate
    from numba.np.arrayobj import make_array, populate_array

    known = KNOWN[0] <= tuple(int(number) for number in numba.__version__.split(".")[:2]) < KNOWN[1]
except ImportError:
    known = False
    cgutils = FunctionCache = AttributeTemplate = make_array = populate_array = None  # type: ignore[assignment, misc]

PLAIN = not known or os.environ.get("FFR_DYN_PLAIN") == "1"
if PLAIN and "FFR_DYN_COMPILING" not in os.environ:  # in the processes that only compile it was said before
    why = "asked for" if known else f"the inner parts of numba {numba.__version__} are not as expected"
    print(f"ffr-dyn: {why}: plain kernels run, which are several times slower", file=sys.stderr)

intrinsic: Any = _intrinsic  # whose callers give one argument less than its definition has


def call_of(*kinds: Any) -> Any:
    """The compiled function that calls the machine address it is given first with four arguments of these types.

    What is called returns an integer.
    """

    @intrinsic
    def call(typing, address, first, second, third, fourth):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            function = ir.FunctionType(ir.IntType(64), [context.get_value_type(kind) for kind in kinds])
            return builder.call(builder.inttoptr(args[0], function.as_pointer()), list(args[1:]))

        return types.int64(types.int64, *kinds), generate

    return call


def compiled_forms(function: Any) -> list[Path]:
    """The files in which numba keeps compiled forms of a function; none where it does not tell or one is damaged."""
    if not known:
        return []
    kept = list(Path(FunctionCache(function).cache_path).glob(f"*.{function.__name__}-*.nb[ic]"))
    return [path for path in kept if path.suffix == ".nbi"] if all(map(is_sound, kept)) else []
