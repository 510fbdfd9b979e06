"""Scene -> compiled tables. Declarations end here; the kernels read numbers only."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from functools import cached_property
from inspect import signature
from typing import NamedTuple

import numpy as np

from ffr_dyn.compile.alignment import Piece, copied, in_one_piece
from ffr_dyn.compile.body_tables import RigidBodies, body_tables, masses_and_moments, rigid_bodies
from ffr_dyn.compile.elimination import Elimination, eliminate
from ffr_dyn.compile.force_tables import Callback, FunctionTable, base_functions, load_tables
from ffr_dyn.compile.marker_tables import marker_tables, points
from ffr_dyn.compile.row_tables import alike, moving_bodies, pattern_of, row_numbers, row_tables
from ffr_dyn.compile.structure import Recent, Structure, structure_key
from ffr_dyn.equations.constraint_rows import Block, blocks_of
from ffr_dyn.equations.layout import Layout, layout
from ffr_dyn.equations.state_view import StateView
from ffr_dyn.functions.time_functions import OPERATION
from ffr_dyn.kernels.functions import evaluate_functions
from ffr_dyn.kernels.simd.entry_point import ENTRY_POINTS, CompiledFunction
from ffr_dyn.kernels.simd.table_address import place_of
from ffr_dyn.kernels.tables import Functions, Loads, Model
from ffr_dyn.scene.force_kinds import kernels_of
from ffr_dyn.scene.scene import Scene, markers
from ffr_prep.body import remembered
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import InputError


@dataclass(frozen=True, repr=False)
class System(Brief):
    """A compiled scene: the tables, and what connects their numbers to the scene's names.

    blocks : in elimination order, as the rows in the tables;  user : keeps the callback of the user's functions alive
    inputs : where the numbers of a signal begin among those of the time functions, by its name
    purposes : what each time function is for
    words : the tables as `pack` writes them
    structure : what it has in common with other scenes, with what is remembered of that
    """

    scene: Scene
    layout: Layout
    blocks: tuple[Block, ...]
    elimination: Elimination
    model: Model
    user: UserFunctions
    inputs: Mapping[str, tuple[int, ...]]
    purposes: tuple[str, ...]
    words: Array
    structure: Structure

    @property
    def kernels(self) -> tuple[CompiledFunction | str, ...]:
        """Kernels of the forces, by number."""
        return tuple(kernels_of(self.scene))

    @property
    def chosen(self) -> tuple[CompiledFunction | None, ...]:
        """Compiled forms of all entry points, by number; None for those that the scene does not call."""
        m = self.model
        return tuple(entry.chosen(m) if entry.needed(m) else None for entry in ENTRY_POINTS.values())

    @cached_property
    def rigid(self) -> RigidBodies:
        """What is constant of its rigid bodies."""
        return rigid_bodies(self.scene, self.layout)


def compile_scene(scene: Scene, blocks: list[Block] | None = None, relaxation: float = 0.0) -> System:
    """Tables of a scene.

    blocks     : the constraint rows to use; default all
    relaxation : above zero where rows depend on one another (`ffr_dyn.kernels.entry_points.solve_of_dependent_rows`)
    """
    chosen = blocks_of(scene) if blocks is None else blocks
    place, table, ground = layout(scene), markers(scene), len(scene.bodies)
    moving = [moving_bodies(block, table, ground) for block in chosen]
    elimination = eliminate([len(k.words) for k in chosen], moving)
    ordered = tuple(chosen[k] for k in elimination.order)
    functions = FunctionTable()
    numbers = _numbers(scene, place, ordered, functions)
    sizes = tuple(array.shape for array in _listed(numbers)), functions.slots, relaxation

    def made() -> Piece[Model]:
        ties = [moving[k] for k in elimination.order]
        return in_one_piece(_model(scene, place, ordered, ties, elimination, numbers, functions.slots, relaxation))

    structure, tables, words = _tables((structure_key(scene, place, ordered), sizes), scene, place, made)
    for into, given in zip(_listed(_numbers_in(tables)), _listed(numbers), strict=True):
        into[...] = given
    user = UserFunctions(functions.callbacks, place, scene)
    words[place_of(Model, "user_address")] = user.address
    model = tables._replace(user_address=user.address)
    inputs, purposes = functions.inputs(), tuple(functions.purposes)
    return System(scene, place, ordered, elimination, model, user, inputs, purposes, words, structure)


TABLES = "tables"  # what is remembered of a structure: those of its first scene, to be copied
# Structures that are known; numbers in the tables, and velocities, of one that is not: its scenes take longer than it does.
MOST, LARGE, WIDE = 32, 200_000, 600

_KNOWN = Recent[Structure](MOST)


def _tables(
    key: Hashable, scene: Scene, place: Layout, made: Callable[[], Piece[Model]]
) -> tuple[Structure, Model, Array]:
    """The structure of this key, and tables with their words that are those of the scene but for its numbers."""
    structure = _KNOWN.find(key, scene)
    if structure is None:
        piece = made()
        if piece.numbers.size >= LARGE or place.v_size >= WIDE:
            return Structure(shared=False), piece.tables, piece.words
        structure = Structure()
        remembered(structure, TABLES, lambda: piece)
        _KNOWN.keep(key, scene, structure)
    return structure, *copied(remembered(structure, TABLES, made))


class _Numbers(NamedTuple):
    """Tables that are not the same for all scenes of a structure, by the names that they have in the model."""

    gravity: Array
    base: Array
    mass: Array
    moments: Array
    u: Array
    axes: Array
    relation: Array
    function: Array
    functions: Functions
    loads: Loads


def _numbers(scene: Scene, place: Layout, blocks: tuple[Block, ...], functions: FunctionTable) -> _Numbers:
    """Of a scene; its functions of time go to `functions`."""
    base = base_functions(scene, functions)
    axes, relation, function = row_numbers(blocks, functions)
    loads = load_tables(scene, functions)
    masses = masses_and_moments(scene, place)
    return _Numbers(
        np.array(scene.gravity), base, *masses, points(scene), axes, relation, function, functions.tables(), loads
    )


def _numbers_in(m: Model) -> _Numbers:
    """Those of a model."""
    bodies, rows = m.bodies, m.rows
    of_rows = rows.axes, rows.relation, rows.function
    return _Numbers(m.gravity, m.base, bodies.mass, bodies.moments, m.markers.u, *of_rows, m.functions, m.loads)


def _listed(numbers: _Numbers) -> list[Array]:
    *arrays, functions, loads = numbers
    return [*arrays, *functions, *loads]


def _model(
    scene: Scene,
    place: Layout,
    blocks: tuple[Block, ...],
    ties: list[tuple[int, ...]],
    elimination: Elimination,
    numbers: _Numbers,
    user_count: int,
    relaxation: float,
) -> Model:
    """The whole tables; ties : the moving bodies of each block."""
    marked = marker_tables(scene, place, blocks, numbers.u)
    return Model(
        gravity=numbers.gravity,
        base=numbers.base,
        relaxation=relaxation,
        bodies=body_tables(scene, place, numbers.mass, numbers.moments),
        markers=marked,
        rows=row_tables(blocks, numbers.axes, numbers.relation, numbers.function),
        pattern=pattern_of(blocks, ties, elimination, marked, alike(scene, place)),
        functions=numbers.functions,
        loads=numbers.loads,
        user_address=0,
        user_count=user_count,
        stiff_count=0,
    )


# ---- the user's Python functions ----------------------------------------------------------------------------------

_SIGNATURE = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)


class UserFunctions:
    """One C callback through which the kernels reach all Python functions of a scene.

    Python cannot raise through compiled code: the callback reports failure, and `failure` keeps what to tell the user. Where
    there are no functions there is no callback: it refers to this object, which only the garbage collector frees then.
    """

    def __init__(self, callbacks: list[Callback], place: Layout, scene: Scene) -> None:
        self.callbacks = callbacks
        self.place = place
        self.scene = scene
        self.count = sum(c.size for c in callbacks)
        self.failure: str | None = None
        self.cause: BaseException | None = None
        self._c_function = _SIGNATURE(self._call) if callbacks else None
        self.address = (ctypes.cast(self._c_function, ctypes.c_void_p).value or 0) if self._c_function else 0

    def _call(self, t: float, x_address: int, v_address: int, out_address: int) -> int:
        x = _at(x_address, self.place.x_size)
        v = _at(v_address, self.place.v_size)
        out = _at(out_address, self.count)
        for callback in self.callbacks:
            try:
                out[callback.slot : callback.slot + callback.size] = self.values(callback, t, x, v)
            except BaseException as error:
                self.failure = (
                    f"{callback.what} at t = {t:.6g} s: {error or type(error).__name__}{_called_so(callback)}"
                )
                self.cause = error
                return 1
        return 0

    def values(self, callback: Callback, t: float, x: Array, v: Array) -> Array:
        """(callback.size,) what a function returns, zero for what it does not. Raises what it raises."""
        arguments = (t, StateView(self.scene, self.place, x, v)) if callback.with_state else (t,)
        given, values = _checked(callback, callback.function(*arguments)), np.zeros(callback.size)
        values[: given.size] = given
        return values


def _called_so(callback: Callback) -> str:
    """What a Python function is called with, in words, where it cannot be called so; empty where it can."""
    try:
        signature(callback.function).bind(*(None,) * (2 if callback.with_state else 1))
    except TypeError:
        if callback.with_state:
            return "; it is called with (t, state): a function of t alone stands in the place of a number"
        return "; it is called with t alone: a function of (t, state) goes to `function` of a load or an actuator"
    except ValueError:  # of what is not written in Python
        return ""
    return ""


def given_at(system: System, t: float, x: Array, v: Array) -> dict[str, Array]:
    """What the functions of time and Python functions of a scene give at a time [s] and a state, by what they are for.

    Raises what Python functions raise."""
    functions, user = system.model.functions, system.user
    values, numbers = np.zeros((functions.kind.size, 3)), np.zeros(user.count)
    found: dict[str, list[float]] = {}
    for callback in user.callbacks:
        own = slice(callback.slot, callback.slot + callback.size)
        numbers[own] = user.values(callback, t, x, v)
        if callback.with_state:
            found.setdefault(callback.what, []).extend(numbers[own])
    evaluate_functions(functions, numbers, t, values)
    starts = functions.start[:-1][functions.kind == OPERATION]
    for k in set(range(values.shape[0])) - set(functions.data[starts[:, None] + [2, 3]].ravel().astype(int).tolist()):
        found.setdefault(system.purposes[k], []).append(values[k, 0])
    return {what: np.array(of) for what, of in found.items()}


def of_time(callback: Callback, t: float) -> Array:
    """(3,) value, rate and second derivative of a Python function of time, NaN where it does not return them.

    Raises what it raises, and InputError for what it must not return.
    """
    values = np.full(callback.size, np.nan)
    given = _checked(callback, callback.function(t))
    values[: given.size] = given
    return values


def _checked(callback: Callback, returned: object) -> Array:
    """The numbers that a Python function has returned."""
    given = np.atleast_1d(np.asarray(returned, dtype=float))
    if given.ndim != 1 or given.size not in callback.sizes:
        raise InputError(f"the function returned {given!r}, not {_wanted(callback)}")
    if not np.isfinite(given).all():
        raise InputError(f"the function returned {given}; it must be finite")
    return given


def _wanted(callback: Callback) -> str:
    """What it must return, in words."""
    if callback.with_state or min(callback.sizes) == 1:
        return f"numbers of the right count, {' or '.join(str(size) for size in callback.sizes)}"
    parts = ("(value, rate, second derivative)", "(value, rate)")[3 - min(callback.sizes)]
    return f"{parts}, which are needed here; give all, or a formula, fd.table or fd.recorded, which know theirs"


def _at(address: int, size: int) -> Array:
    return np.ctypeslib.as_array(ctypes.cast(address, ctypes.POINTER(ctypes.c_double)), (size,))
