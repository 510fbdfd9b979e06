"""Scene -> compiled tables. Declarations end here; the kernels read numbers only."""

from __future__ import annotations

import ctypes
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ffr_dyn.compile.alignment import aligned
from ffr_dyn.compile.body_tables import body_tables, starts
from ffr_dyn.compile.elimination import Elimination, eliminate
from ffr_dyn.compile.force_tables import Callback, FunctionTable, base_functions, load_tables
from ffr_dyn.compile.marker_tables import marker_tables
from ffr_dyn.equations.constraint_rows import Block, blocks_of
from ffr_dyn.equations.layout import Layout, layout
from ffr_dyn.equations.second_order import is_second_order
from ffr_dyn.equations.state_view import StateView
from ffr_dyn.kernels.tables import LANES, WAYS, WORDS, Markers, Model, Pattern, Rows
from ffr_dyn.scene.joints import Word
from ffr_dyn.scene.scene import MarkerName, Scene, markers
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import InputError


@dataclass(frozen=True, repr=False)
class System(Brief):
    """A compiled scene: the tables, and what connects their numbers to the scene's names.

    blocks : in elimination order, as the rows in the tables;  user : keeps the callback of the user's functions alive
    inputs : where the numbers of a signal begin among those of the time functions, by its name
    """

    scene: Scene
    layout: Layout
    blocks: tuple[Block, ...]
    elimination: Elimination
    model: Model
    user: UserFunctions
    inputs: Mapping[str, tuple[int, ...]]


def compile_scene(scene: Scene, blocks: list[Block] | None = None, relaxation: float = 0.0) -> System:
    """Tables of a scene.

    blocks     : the constraint rows to use; default all
    relaxation : above zero where rows depend on one another (`ffr_dyn.kernels.entry_points.solve_of_dependent_rows`)
    """
    chosen = blocks_of(scene) if blocks is None else blocks
    place = layout(scene)
    table = markers(scene)
    ground = len(scene.bodies)
    moving = [_moving(block, table, ground) for block in chosen]
    elimination = eliminate([len(k.words) for k in chosen], moving)
    ordered = tuple(chosen[k] for k in elimination.order)
    functions = FunctionTable()
    marked = marker_tables(scene, place, ordered)
    equal = [
        (id(body.model), np.asarray(body.damping).tobytes(), place.normals[b], b if is_second_order(body) else -1)
        for b, body in enumerate(scene.bodies)
    ]
    model = {
        "gravity": np.array(scene.gravity),
        "base": base_functions(scene, functions),
        "relaxation": relaxation,
        "bodies": body_tables(scene, place),
        "markers": marked,
        "rows": _rows(ordered, functions),
        "pattern": _pattern(ordered, [moving[k] for k in elimination.order], elimination, marked, equal),
        "loads": load_tables(scene, functions),
        "functions": functions.tables(),
    }
    user = UserFunctions(functions.callbacks, place, scene)
    compiled = Model(**model, user_address=user.address, user_count=user.count)  # type: ignore[arg-type]
    return System(scene, place, ordered, elimination, aligned(compiled), user, functions.inputs())


def _moving(block: Block, table: tuple[MarkerName, ...], ground: int) -> tuple[int, ...]:
    """The bodies that a block ties, each once."""
    return tuple(dict.fromkeys(table[k][0] for k in block.markers if table[k][0] != ground))


# ---- constraints --------------------------------------------------------------------------------------------------


def _rows(blocks: tuple[Block, ...], functions: FunctionTable) -> Rows:
    said = [(block, word) for block in blocks for word in block.words]
    function = [-1 if w.function is None else functions.add(w.function, f"{b.name!r}") for b, w in said]
    listed = [word for _, word in said]
    axes = np.zeros((len(listed), 6, 3))
    for row, word in enumerate(listed):
        axes[row, : len(word.axes)] = word.axes
    sides = max((len(block.markers) for block in blocks), default=2)
    marker = np.array([b.markers + (-1,) * (sides - len(b.markers)) for b in blocks], dtype=np.int64).reshape(-1, sides)
    return Rows(
        kind=np.array([WORDS.index(word.kind) for word in listed], dtype=np.int64),
        axes=axes,
        relation=np.array([_relation(word) for word in listed], dtype=float).reshape(-1, 5),
        function=np.array(function, dtype=np.int64),
        start=starts([len(b.words) for b in blocks]),
        marker=marker,
        first=_first_of_each(marker),
    )


def _relation(word: Word) -> tuple[float, ...]:
    """`Rows.relation` of a word."""
    terms = word.relation or ((0.0, "angle"),) * 2
    return *(number for factor, kind in terms for number in (factor, WAYS[kind])), word.spacing


def _first_of_each(numbers: Array) -> Array:
    """Of numbers in any order, 1 where one is there for the first time."""
    first = np.zeros(numbers.size, dtype=np.int64)
    first[np.unique(numbers, return_index=True)[1]] = 1
    return first.reshape(numbers.shape)


def _pattern(
    blocks: tuple[Block, ...],
    moving: list[tuple[int, ...]],
    elimination: Elimination,
    marked: Markers,
    equal: Sequence[Hashable],
) -> Pattern:
    """equal : per body, what two bodies have in common whose elastic coordinates couple equal markers equally"""
    size = [len(b.words) for b in blocks]
    offsets: dict[tuple[int, int], int] = {}
    total = 0
    for k, column in enumerate(elimination.columns):
        for later in (k, *column):
            offsets[later, k] = total
            total += LANES * size[k]
    sides = [[int(marked.body[marker]) for marker in block.markers] for block in blocks]
    pairs = [
        (b, later, side, earlier, other, offsets[later, earlier])
        for earlier in range(len(blocks))
        for later in (earlier, *elimination.columns[earlier])
        for b in moving[earlier]
        for side in _where(sides[later], b)
        for other in _where(sides[earlier], b)
    ]
    listed = np.array(sorted(pairs, key=lambda pair: pair[1]), dtype=np.int64).reshape(-1, 6)
    shared = _shared(listed, [block.markers for block in blocks], marked, equal)
    reach = [max(column, default=k) for k, column in enumerate(elimination.columns)]
    updates = [
        [offsets[a, b] for at, a in enumerate(column) for b in column[: at + 1]] for column in elimination.columns
    ]
    stored = [(later, offsets[later, k]) for k, column in enumerate(elimination.columns) for later in column]
    return Pattern(
        pair_body=listed[:, 0].copy(),
        pair=np.column_stack([listed[:, 1:], shared]),
        sample=np.unique(shared, return_index=True)[1],
        pair_start=starts(np.bincount(listed[:, 1], minlength=len(blocks)).tolist()),
        reach=np.array(np.maximum.accumulate(reach), dtype=np.int64) if reach else np.zeros(0, dtype=np.int64),
        diagonal=np.array([offsets[k, k] for k in range(len(blocks))], dtype=np.int64),
        column_start=starts([len(column) for column in elimination.columns]),
        column=np.array(stored, dtype=np.int64).reshape(-1, 2),
        update_start=starts([len(column) for column in updates]),
        update=np.array([offset for column in updates for offset in column], dtype=np.int64),
    )


def _shared(pairs: Array, of: list[tuple[int, ...]], marked: Markers, equal: Sequence[Hashable]) -> Array:
    """(P,) numbers of pairs, the same for those of equal markers on equal bodies; `of`: the markers of each block."""
    numbers: dict[Hashable, int] = {}
    return np.array(
        [
            numbers.setdefault(
                (equal[b], *(int(marked.start[of[k][side]]) for k, side in ((later, i), (earlier, j)))), len(numbers)
            )
            for b, later, i, earlier, j, _ in pairs.tolist()
        ],
        dtype=np.int64,
    )


def _where(sides: list[int], body: int) -> list[int]:
    return [k for k, b in enumerate(sides) if b == body]


# ---- the user's Python functions ----------------------------------------------------------------------------------

_SIGNATURE = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)


class UserFunctions:
    """One C callback through which the kernels reach all Python functions of a scene.

    Python cannot raise through compiled code: the callback reports failure, and `failure` keeps what to tell the user.
    """

    def __init__(self, callbacks: list[Callback], place: Layout, scene: Scene) -> None:
        self.callbacks = callbacks
        self.place = place
        self.scene = scene
        self.count = sum(c.size for c in callbacks)
        self.failure: str | None = None
        self.cause: BaseException | None = None
        self._c_function = _SIGNATURE(self._call)
        self.address = ctypes.cast(self._c_function, ctypes.c_void_p).value or 0

    def _call(self, t: float, x_address: int, v_address: int, out_address: int) -> int:
        x = _at(x_address, self.place.x_size)
        v = _at(v_address, self.place.v_size)
        out = _at(out_address, self.count)
        for callback in self.callbacks:
            try:
                out[callback.slot : callback.slot + callback.size] = self._values(callback, t, x, v)
            except BaseException as error:
                self.failure = f"{callback.what} at t = {t:.6g} s: {error or type(error).__name__}"
                self.cause = error
                return 1
        return 0

    def _values(self, callback: Callback, t: float, x: Array, v: Array) -> Array:
        arguments = (t, StateView(self.scene, self.place, x, v)) if callback.with_state else (t,)
        given = np.atleast_1d(np.asarray(callback.function(*arguments), dtype=float))
        values = np.zeros(callback.size)
        if given.ndim != 1 or given.size not in callback.sizes:
            raise InputError(f"the function returned {given!r}, not numbers of the right count")
        if not np.isfinite(given).all():
            raise InputError(f"the function returned {given}; it must be finite")
        values[: given.size] = given
        return values


def _at(address: int, size: int) -> Array:
    return np.ctypeslib.as_array(ctypes.cast(address, ctypes.POINTER(ctypes.c_double)), (size,))
