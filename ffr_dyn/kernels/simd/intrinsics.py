"""What the hand-written parts of compiled code share: numba's decorator, the data of an array, calls of an address, and rows
of numbers that one instruction serves (`lanes`)."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic as _intrinsic
from numba.np.arrayobj import make_array

from ffr_dyn.kernels.tables import LANES, MOST_ROWS

intrinsic: Any = _intrinsic  # whose callers give one argument less than its definition has

REAL = types.float64
POOLED = types.Array(types.float64, 1, "C")
LIBERTIES = ("contract", "reassoc", "nsz")


def data_of(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    """The pointer to the first number of an array of numba's type `kind`."""
    return make_array(kind)(context, builder, array).data


def call_of(*kinds: Any) -> Any:
    """The compiled function that calls the machine address it is given first with arguments of these types.

    What is called returns an integer.
    """

    @intrinsic
    def call(typing, address, *arguments):  # type: ignore[no-untyped-def]
        def generate(context, builder, signature, args):  # type: ignore[no-untyped-def]
            function = ir.FunctionType(ir.IntType(64), [context.get_value_type(kind) for kind in kinds])
            given = cgutils.unpack_tuple(builder, args[1])
            return builder.call(builder.inttoptr(args[0], function.as_pointer()), given)

        return types.int64(types.int64, types.StarArgTuple(kinds)), generate

    return call


# ---- rows of lanes -----------------------------------------------------------------------------------------------------


def pooled_data(context: Any, builder: Any, array: Any) -> Any:
    return data_of(context, builder, POOLED, array)


def row_pointer(builder: Any, data: Any, at: Any, lanes: int = LANES) -> Any:
    return builder.bitcast(builder.gep(data, [at]), ir.VectorType(ir.DoubleType(), lanes).as_pointer())


def broadcast(builder: Any, number: Any, lanes: int = LANES) -> Any:
    vector = ir.VectorType(ir.DoubleType(), lanes)
    one = builder.insert_element(ir.Constant(vector, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), lanes), [0] * lanes)
    return builder.shuffle_vector(one, ir.Constant(vector, ir.Undefined), zeros)


def load_row(builder: Any, data: Any, at: Any, number: int = 0) -> Any:
    return builder.load(row_pointer(builder, data, builder.add(at, cgutils.intp_t(LANES * number))), align=8)


def store_row(builder: Any, row: Any, data: Any, at: Any, number: int = 0) -> None:
    builder.store(row, row_pointer(builder, data, builder.add(at, cgutils.intp_t(LANES * number))), align=8)


def lane_of(builder: Any, row: Any, number: int) -> Any:
    return builder.extract_element(row, ir.Constant(ir.IntType(32), number))


def sum_of_lanes(builder: Any, row: Any) -> Any:
    kind = ir.FunctionType(ir.DoubleType(), [ir.DoubleType(), row.type])
    reduce = cgutils.get_or_insert_function(builder.module, kind, f"llvm.vector.reduce.fadd.v{row.type.count}f64")
    return builder.call(reduce, [ir.Constant(ir.DoubleType(), 0.0), row], fastmath=LIBERTIES)


def case_by_case(context: Any, builder: Any, size: Any, emit: Any) -> Any:
    """emit(n) for the number of rows that `size` is; nothing where it is none of a joint's."""
    end = builder.append_basic_block()
    cases = builder.switch(size, end)
    for n in range(1, MOST_ROWS + 1):
        block = builder.append_basic_block()
        cases.add_case(context.get_constant(types.intp, n), block)
        builder.position_at_end(block)
        emit(n)
        builder.branch(end)
    builder.position_at_end(end)
    return context.get_dummy_value()
