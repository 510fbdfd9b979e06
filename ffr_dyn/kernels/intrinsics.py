"""What the hand-written parts of compiled code share: numba's decorator, the data of an array, calls of an address."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic as _intrinsic
from numba.np.arrayobj import make_array

intrinsic: Any = _intrinsic  # whose callers give one argument less than its definition has


def data_of(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    """The pointer to the first number of an array of numba's type `kind`."""
    return make_array(kind)(context, builder, array).data


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
