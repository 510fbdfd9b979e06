"""The sides of joints, their rows held in registers: elimination of a body's coordinates, coupling of two sides.

A side has six rigid and six elastic coefficients, in the plane three of each: rows of lanes over the joint's rows (see
`lanes`), in the plane half of them.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils

from ffr_dyn.kernels.simd.intrinsics import LIBERTIES, POOLED, broadcast, intrinsic, pooled_data, row_pointer
from ffr_dyn.kernels.tables import LANES, NARROW

_ELASTIC = (0, 1, 2, 6, 7, 8)  # of the nine coefficients of a side, those that elastic coordinates move


def _number(builder: Any, data: Any, at: Any, number: int, lanes: int = LANES) -> Any:
    """A row of lanes of one number of pooled data."""
    return broadcast(builder, builder.load(builder.gep(data, [builder.add(at, cgutils.intp_t(number))])), lanes)


def _place(builder: Any, data: Any, at: Any, number: int, lanes: int) -> Any:
    return row_pointer(builder, data, builder.add(at, cgutils.intp_t(LANES * number)), lanes)


def _row(builder: Any, data: Any, at: Any, number: int, lanes: int = LANES) -> Any:
    """The first lanes of row `number` after `at`."""
    return builder.load(_place(builder, data, at, number, lanes), align=8)


def _keep(builder: Any, row: Any, data: Any, at: Any, number: int, lanes: int = LANES) -> None:
    builder.store(row, _place(builder, data, at, number, lanes), align=8)


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
            given = [_row(builder, jac, zero, k) for k in range(9 if flexible else 6)]
            rows = given[:6]
            if flexible:
                for k, coefficient in enumerate(_ELASTIC):
                    _keep(builder, given[coefficient], X, at, 6 + k)
                for c in range(6):
                    for k, coefficient in enumerate(_ELASTIC):
                        rows[c] = _less(builder, rows[c], _number(builder, P, zero, 6 * c + k), given[coefficient])
            for c in range(6):
                for k in range(c):
                    rows[c] = _less(builder, rows[c], _number(builder, L, zero, 6 * c + k), rows[k])
                rows[c] = builder.fmul(rows[c], _number(builder, L, zero, 7 * c), flags=LIBERTIES)
                _keep(builder, rows[c], X, at, c)
            return context.get_dummy_value()

        return types.void(POOLED, POOLED, POOLED, POOLED, types.intp), generate

    return eliminate


eliminate_flexible, eliminate_rigid = _elimination(True), _elimination(False)


def _elimination_in_plane(flexible: bool) -> Any:
    @intrinsic
    def eliminate(typing, jac, i, j, k, twist, P, L, X, at):  # type: ignore[no-untyped-def]
        """X = L^-1 (rigid - P elastic), three rows; then elastic.

        jac        : (9 * 8,) coefficients of the side
        i, j, k    : those of the two translations and of the rotation in the plane;  twist : of the elastic rotation
        P (9,), L  : L is of all six coordinates
        """

        def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
            jac, i, j, k, twist, P, L, X, at = args
            jac, P, L, X = (pooled_data(context, builder, array) for array in (jac, P, L, X))
            zero, own = cgutils.intp_t(0), (i, j, k)
            rows = [_row(builder, jac, builder.mul(c, cgutils.intp_t(LANES)), 0, NARROW) for c in own]
            if flexible:
                elastic = [rows[0], rows[1], _row(builder, jac, builder.mul(twist, cgutils.intp_t(LANES)), 0, NARROW)]
                for c in range(3):
                    _keep(builder, elastic[c], X, at, 3 + c, NARROW)
                    for e in range(3):
                        rows[c] = _less(builder, rows[c], _number(builder, P, zero, 3 * c + e, NARROW), elastic[e])
            for c in range(3):
                first = builder.mul(own[c], cgutils.intp_t(6))
                for e in range(c):
                    factor = _number(builder, L, builder.add(first, own[e]), 0, NARROW)
                    rows[c] = _less(builder, rows[c], factor, rows[e])
                factor = _number(builder, L, builder.add(first, own[c]), 0, NARROW)
                rows[c] = builder.fmul(rows[c], factor, flags=LIBERTIES)
                _keep(builder, rows[c], X, at, c, NARROW)
            return context.get_dummy_value()

        index = types.intp
        return types.void(POOLED, index, index, index, index, POOLED, POOLED, POOLED, index), generate

    return eliminate


eliminate_flexible_in_plane, eliminate_rigid_in_plane = _elimination_in_plane(True), _elimination_in_plane(False)


def _coupling(flexible: bool, size: int, lanes: int) -> Any:
    """Of sides with `size` coefficients of each kind."""

    @intrinsic
    def couple(typing, X, later, earlier, rows, phiphi, S, offset):  # type: ignore[no-untyped-def]
        """Add the coupling of two sides on one body to its block of S.

        later, earlier : where the sides begin in X;  rows : of the earlier
        phiphi         : phi dinv phi^T of the two markers, 36 numbers, in the plane nine
        """

        def generate(context, builder, sig, args):  # type: ignore[no-untyped-def]
            X, later, earlier, rows, phiphi, S, offset = args
            X, phiphi, S = (pooled_data(context, builder, array) for array in (X, phiphi, S))
            factors = [_row(builder, X, later, k, lanes) for k in range(size)]
            if flexible:
                elastic = [_row(builder, X, later, size + k, lanes) for k in range(size)]
                for c in range(size):
                    total = None
                    for k in range(size):
                        factor = _number(builder, phiphi, cgutils.intp_t(0), size * k + c, lanes)
                        total = _plus(builder, total, factor, elastic[k])
                    factors.append(total)
            with cgutils.for_range(builder, rows) as loop:
                place = builder.add(offset, builder.mul(loop.index, cgutils.intp_t(LANES)))
                own = builder.add(earlier, loop.index)
                total = _row(builder, S, place, 0, lanes)
                for k, row in enumerate(factors):
                    total = _plus(builder, total, _number(builder, X, own, LANES * k, lanes), row)
                _keep(builder, total, S, place, 0, lanes)
            return context.get_dummy_value()

        index = types.intp
        return types.void(POOLED, index, index, index, POOLED, POOLED, index), generate

    return couple


couple_flexible, couple_rigid = _coupling(True, 6, LANES), _coupling(False, 6, LANES)
couple_flexible_in_plane, couple_rigid_in_plane = _coupling(True, 3, NARROW), _coupling(False, 3, NARROW)
