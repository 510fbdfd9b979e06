"""The sides of joints in space, their rows held in registers: elimination of a body's coordinates, coupling of two sides.

A side has six rigid and six elastic coefficients, each a row of lanes over the joint's rows (see `lanes`).
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils

from ffr_dyn.kernels.intrinsics import LIBERTIES, POOLED, broadcast, intrinsic, load_row, pooled_data, store_row
from ffr_dyn.kernels.tables import LANES

_ELASTIC = (0, 1, 2, 6, 7, 8)  # of the nine coefficients of a side, those that elastic coordinates move


def _number(builder: Any, data: Any, at: Any, number: int) -> Any:
    """A row of lanes of one number of pooled data."""
    return broadcast(builder, builder.load(builder.gep(data, [builder.add(at, cgutils.intp_t(number))])))


def _plus(builder: Any, total: Any, factor: Any, row: Any) -> Any:
    product = builder.fmul(factor, row, flags=LIBERTIES)
    return product if total is None else builder.fadd(total, product, flags=LIBERTIES)


def _less(builder: Any, total: Any, factor: Any, row: Any) -> Any:
    return builder.fsub(total, builder.fmul(factor, row, flags=LIBERTIES), flags=LIBERTIES)


def _elimination(flexible: bool) -> Any:
    @intrinsic
    def eliminate(typing, jac, P, L, X, at):  # type: ignore[no-untyped-def]
        """X = L^-1 (rigid - P elastic), six rows: what is left of a side without the elastic coordinates; then elastic.

        jac : (9 * 8,) its coefficients;  P, L : (36,)
        """

        def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
            jac, P, L, X, at = args
            jac, P, L, X = (pooled_data(context, builder, array) for array in (jac, P, L, X))
            zero = cgutils.intp_t(0)
            given = [load_row(builder, jac, zero, k) for k in range(9 if flexible else 6)]
            rows = given[:6]
            if flexible:
                for k, coefficient in enumerate(_ELASTIC):
                    store_row(builder, given[coefficient], X, at, 6 + k)
                for c in range(6):
                    for k, coefficient in enumerate(_ELASTIC):
                        rows[c] = _less(builder, rows[c], _number(builder, P, zero, 6 * c + k), given[coefficient])
            for c in range(6):
                for k in range(c):
                    rows[c] = _less(builder, rows[c], _number(builder, L, zero, 6 * c + k), rows[k])
                rows[c] = builder.fmul(rows[c], _number(builder, L, zero, 7 * c), flags=LIBERTIES)
                store_row(builder, rows[c], X, at, c)
            return context.get_dummy_value()

        return types.void(POOLED, POOLED, POOLED, POOLED, types.intp), generate

    return eliminate


eliminate_flexible, eliminate_rigid = _elimination(True), _elimination(False)


def _coupling(flexible: bool) -> Any:
    @intrinsic
    def couple(typing, X, later, earlier, rows, phiphi, S, offset):  # type: ignore[no-untyped-def]
        """Add the coupling of two sides on one body to its block of S.

        later, earlier : where the sides begin in X;  rows : of the earlier
        phiphi (36,)   : phi dinv phi^T of the two markers
        """

        def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
            X, later, earlier, rows, phiphi, S, offset = args
            X, phiphi, S = (pooled_data(context, builder, array) for array in (X, phiphi, S))
            factors = [load_row(builder, X, later, k) for k in range(6)]
            if flexible:
                elastic = [load_row(builder, X, later, 6 + k) for k in range(6)]
                for c in range(6):
                    total = None
                    for k in range(6):
                        total = _plus(
                            builder, total, _number(builder, phiphi, cgutils.intp_t(0), 6 * k + c), elastic[k]
                        )
                    factors.append(total)
            with cgutils.for_range(builder, rows) as loop:
                place = builder.add(offset, builder.mul(loop.index, cgutils.intp_t(LANES)))
                own = builder.add(earlier, loop.index)
                total = load_row(builder, S, place)
                for k, row in enumerate(factors):
                    total = _plus(builder, total, _number(builder, X, own, LANES * k), row)
                store_row(builder, total, S, place)
            return context.get_dummy_value()

        index = types.intp
        return types.void(POOLED, index, index, index, POOLED, POOLED, index), generate

    return couple


couple_flexible, couple_rigid = _coupling(True), _coupling(False)
