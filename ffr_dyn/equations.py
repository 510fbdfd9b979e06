"""Scene -> compiled tables. Declarations end here; the kernels read numbers only."""

from __future__ import annotations

import ctypes
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ffr_dyn.couplings import Coupling, coupling_word
from ffr_dyn.decoupling import in_blocks, stiffening_loads
from ffr_dyn.drivers import Driver, PointDriver, driver_word, path_words
from ffr_dyn.elimination import Elimination, eliminate
from ffr_dyn.errors import InputError
from ffr_dyn.force_tables import Callback, FunctionTable, base_functions, load_tables, marker_numbers
from ffr_dyn.joints import RELATION, Joint, Word, words
from ffr_dyn.kernels.tables import LANES, SIX, Bodies, Markers, Model, Pattern, Rows
from ffr_dyn.layout import Layout, layout
from ffr_dyn.scene import Body, MarkerName, Scene, joint_of, joints_of, marker_number, markers
from ffr_dyn.state import StateView
from ffr_prep.body import axial

Array = np.ndarray

ROUNDING = 1e-8  # of I5 and I9 of unit modes: what symmetry leaves of zeros
STIFFNESS_ROUNDING = 1e-7  # the same of the stiffness by a load, relative to its largest: slopes are rougher

SYMMETRIC = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@dataclass(frozen=True)
class Block:
    """The rows of one joint, driver or coupling.

    markers : numbers of markers i, j, or i, j of both joints of a relation
    driver  : whether it prescribes a motion
    """

    name: str
    markers: tuple[int, ...]
    words: tuple[Word, ...]
    driver: bool = False


@dataclass(frozen=True)
class _Blocks:
    """Tables of all bodies in blocks: pool and starts (or -1), plans and starts."""

    pool: Array
    start: Array
    plans: Array
    first: Array


@dataclass(frozen=True)
class System:
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


def blocks_of(scene: Scene) -> list[Block]:
    """Joints, then couplings, then drivers, as blocks of words."""
    joints = [_joint_block(scene, joint) for joint in scene.joints]
    couplings = [_coupling_block(scene, coupling) for coupling in scene.couplings]
    return joints + couplings + [_driver_block(scene, driver) for driver in scene.drivers]


def _ends(scene: Scene, joint: Joint | PointDriver) -> tuple[int, int]:
    return marker_number(scene, joint.i), marker_number(scene, joint.j)


def _joint_block(scene: Scene, joint: Joint) -> Block:
    ends, said = _ends(scene, joint), tuple(words(joint))
    related = any(word.kind == RELATION for word in said)
    return Block(joint.name, ends + ends if related else ends, said)


def _coupling_block(scene: Scene, coupling: Coupling) -> Block:
    first, second = joints_of(scene, coupling)
    word = coupling_word(coupling, first, second)
    return Block(coupling.name, _ends(scene, first) + _ends(scene, second), (word,))


def _driver_block(scene: Scene, driver: Driver | PointDriver) -> Block:
    if isinstance(driver, PointDriver):
        return Block(driver.name, _ends(scene, driver), tuple(path_words(driver)), driver=True)
    joint = joint_of(scene, driver)
    return Block(driver.name, _ends(scene, joint), (driver_word(driver, joint),), driver=True)


def compile_scene(scene: Scene, blocks: list[Block] | None = None, relaxation: float = 0.0) -> System:
    """Tables of a scene.

    blocks     : the constraint rows to use; default all
    relaxation : above zero where rows depend on one another (see `kernels.system.solve_motion`)
    """
    chosen = blocks_of(scene) if blocks is None else blocks
    place = layout(scene)
    table = markers(scene)
    ground = len(scene.bodies)
    moving = [_moving(block, table, ground) for block in chosen]
    elimination = eliminate([len(k.words) for k in chosen], moving)
    ordered = tuple(chosen[k] for k in elimination.order)
    functions = FunctionTable()
    marked = _markers(scene, ordered)
    model = {
        "gravity": np.array(scene.gravity),
        "base": base_functions(scene, functions),
        "relaxation": relaxation,
        "bodies": _bodies(scene, place, marked),
        "markers": marked,
        "rows": _rows(ordered, functions),
        "pattern": _pattern(ordered, [moving[k] for k in elimination.order], elimination, table),
        "loads": load_tables(scene, functions),
        "functions": functions.tables(),
    }
    user = UserFunctions(functions.callbacks, place, scene)
    compiled = Model(**model, user_address=user.address, user_count=user.count)  # type: ignore[arg-type]
    return System(scene, place, ordered, elimination, compiled, user, functions.inputs())


def _moving(block: Block, table: tuple[MarkerName, ...], ground: int) -> tuple[int, ...]:
    """The bodies that a block ties, each once."""
    return tuple(dict.fromkeys(table[k][0] for k in block.markers if table[k][0] != ground))


# ---- bodies -------------------------------------------------------------------------------------------------------


def _six(tensor: Array) -> Array:
    """(3, 3, ...) -> (6, ...) symmetric part."""
    return np.stack([0.5 * (tensor[k, l] + tensor[l, k]) for k, l in SYMMETRIC])  # noqa: E741


def _nine(tensor: Array) -> Array:
    """(3, 3, ...) -> (9, ...) symmetric part and axial vector."""
    return np.concatenate([_six(tensor), axial(tensor)])


def _parts(tensor: Array, symmetric: bool, skew: bool) -> Array:
    """`_nine` of a tensor, with zeros for a part that is left out."""
    nine = _nine(tensor)
    nine[:6] *= symmetric
    nine[6:] *= skew
    return nine


def _rP_parts(body: Body) -> Array:
    return _parts(body.model.rP_dm, "I8" not in body.dropped, "I4" not in body.dropped)


def _PP_parts(body: Body, normal: int) -> Array:
    """(n over i, 9, n over j); of a planar body (n, 3, n): two components in the plane, the axial one across."""
    nine = _parts(body.model.PP_dm, "I9" not in body.dropped, "I5" not in body.dropped)
    return np.moveaxis(nine if normal < 0 else nine[[*np.delete(np.arange(3), normal), 6 + normal]], 1, 0)


def _pool(parts: list[Array]) -> Array:
    return np.concatenate([np.ravel(p) for p in parts]) if parts else np.zeros(0)


def _starts(sizes: list[int]) -> Array:
    return np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)]).astype(np.int64)


def _once(parts: list[Array], owners: list[Hashable]) -> tuple[Array, Array]:
    """(pool, starts): parts of one owner are stored once, so that many equal bodies stay in the processor's cache."""
    starts: dict[Hashable, int] = {}
    stored: list[Array] = []
    size = 0
    for part, owner in zip(parts, owners, strict=True):
        if owner not in starts:
            starts[owner] = size
            stored.append(part)
            size += part.size
    return _pool(stored), np.array([starts[owner] for owner in owners], dtype=np.int64)


def _in_blocks(tables: list[Array], owners: list[Hashable], noises: list[Array], last: list[int]) -> _Blocks:
    """Tables of one owner are stored once; a table of zeros starts at -1, and the kernels skip it."""
    stored: dict[Hashable, tuple[Array, Array]] = {}
    for table, owner, noise, count in zip(tables, owners, noises, last, strict=True):
        if owner not in stored:
            nothing = np.zeros(0), np.zeros(0, dtype=np.int64)
            stored[owner] = in_blocks(table, count, noise) if table.any() else nothing
    pool, starts = _once([stored[owner][0] for owner in owners], owners)
    plans, firsts = _once([stored[owner][1] for owner in owners], owners)
    zero = np.array([not stored[owner][0].size for owner in owners], dtype=bool)
    return _Blocks(pool, np.where(zero, -1, starts), plans.astype(np.int64), firsts)


def _bodies(scene: Scene, place: Layout, marked: Markers) -> Bodies:
    models = [body.model for body in scene.bodies]
    n = [m.n for m in models]
    owners: list[Hashable] = [(id(b.model), b.dropped) for b in scene.bodies]
    PP = _second_moments(scene, place)
    P, P_start = _once([b.model.P_dm * ("I3" not in b.dropped) for b in scene.bodies], owners)
    rP, _ = _once([_rP_parts(b) for b in scene.bodies], owners)
    K, loads = _stiffness(scene, marked)
    counts = [len(which) for which in loads]
    where = np.full((len(n) + 1, 13), -1, dtype=np.int64)
    where[-1, [*range(7), *range(8, 13)]] = 0
    where[:-1, :7] = np.column_stack([n, place.ix, place.iv, _starts(n)[:-1], PP.start, K.start, counts])
    where[:-1, 8:] = np.column_stack(
        [
            _starts(counts)[:-1],
            _starts([a * in_sixes(b) for a, b in zip(n, counts, strict=True)])[:-1],
            P_start // 3,
            PP.first,
            len(PP.plans) + K.first,
        ]
    )
    where[:-1, 7] = place.normals
    where[-1, 3] = sum(n)
    return Bodies(
        where=where,
        mass=np.array([m.mass for m in models]),
        moments=np.array([np.concatenate([m.r_dm, _six(m.rr_dm)]) for m in models]),
        P_dm=P,
        rP_dm=rP,
        PP_dm=PP.pool,
        omega2=_pool([m.omega2 for m in models]),
        two_zeta_omega=_pool([2 * b.damping * np.sqrt(b.model.omega2) for b in scene.bodies]),
        stiffening=K.pool,
        loads=np.concatenate(loads) if loads else np.zeros(0, dtype=np.int64),
        blocks=np.concatenate([PP.plans, K.plans]),
    )


def in_sixes(loads: int) -> int:
    """How many loads there is room for."""
    return -(-loads // SIX) * SIX


def _second_moments(scene: Scene, place: Layout) -> _Blocks:
    """I5 and I9 of all bodies: a unit mode has a second moment of one, so the size of their rounding is known."""
    owners: list[Hashable] = [
        (id(body.model), body.dropped, int(k)) for body, k in zip(scene.bodies, place.normals, strict=True)
    ]
    parts = [_PP_parts(body, int(k)) for body, k in zip(scene.bodies, place.normals, strict=True)]
    noises = [np.full(part.shape[1], ROUNDING) for part in parts]
    return _in_blocks(parts, owners, noises, [part.shape[1] // 3 for part in parts])


def _stiffness(scene: Scene, marked: Markers) -> tuple[_Blocks, list[Array]]:
    """The geometric stiffness of all bodies, and the numbers of the loads that have any."""
    acting = [_acting(numbers) for numbers in _used_markers(scene, marked)]
    found = [_active(_stiffening(body), loads) for body, loads in zip(scene.bodies, acting, strict=True)]
    owners: list[Hashable] = [
        (id(body.model), body.stiffening, loads) for body, loads in zip(scene.bodies, acting, strict=True)
    ]
    noises = [STIFFNESS_ROUNDING * np.abs(K).max(axis=(0, 2), initial=0.0) for _, K in found]
    return _in_blocks([K for _, K in found], owners, noises, [0] * len(found)), [which for which, _ in found]


def _used_markers(scene: Scene, marked: Markers) -> list[list[int]]:
    """Per body, the numbers among its loads of the forces at markers that anything acts on."""
    used: list[list[int]] = [[] for _ in scene.bodies]
    for k in marked.active:
        if marked.load[k] >= 0:
            used[marked.body[k]].append(int(marked.load[k]))
    return used


def _acting(firsts: list[int]) -> tuple[int, ...]:
    """Which loads a body may have: twelve inertial ones, and those at interfaces that anything acts on."""
    return (*range(12), *(first + c for first in firsts for c in range(6)))


def _stiffening(body: Body) -> Array:
    """(loads, n, n) geometric stiffness of a body, none where it has none or the scene does without."""
    n = body.model.n
    if body.model.stiffening is None or not body.stiffening:
        return np.zeros((0, n, n))
    return body.model.stiffening


def _active(stiffening: Array, acting: Sequence[int]) -> tuple[Array, Array]:
    """(numbers of the loads, (n, loads, n) their stiffness) of those that act and do anything."""
    which = np.intersect1d(stiffening_loads(stiffening), acting).astype(np.int64)
    return which, np.moveaxis(stiffening[which], 2, 0)


# ---- markers ------------------------------------------------------------------------------------------------------


def _markers(scene: Scene, blocks: tuple[Block, ...]) -> Markers:
    table = markers(scene)
    ground = len(scene.bodies)
    interfaces = [i for body in scene.bodies for i in body.model.interfaces]
    shapes = [np.concatenate([i.phi_t, i.phi_r]) for i in interfaces] + [np.zeros((6, 0))] * len(scene.ground)
    phi, start = _once(shapes, [*(id(i) for i in interfaces), *("ground" for _ in scene.ground)])
    joint = sorted({k for block in blocks for k in block.markers})
    return Markers(
        body=np.array([entry[0] for entry in table], dtype=np.int64),
        u=np.array([i.position for i in interfaces] + list(scene.ground.values())).reshape(-1, 3),
        phi=phi,
        start=start,
        load=np.array(_load_numbers(scene), dtype=np.int64),
        active=np.array(sorted({*joint, *marker_numbers(scene)}), dtype=np.int64),
        joint=np.array([k for k in joint if table[k][0] != ground], dtype=np.int64),
    )


def _load_numbers(scene: Scene) -> list[int]:
    """Per marker, the number of its force in the stiffening loads of its body: twelve inertial ones come first."""
    numbers: list[int] = []
    for body in scene.bodies:
        has = len(_stiffening(body)) > 0
        numbers += [12 + 6 * k if has else -1 for k in range(len(body.model.interfaces))]
    return numbers + [-1] * len(scene.ground)


# ---- constraints --------------------------------------------------------------------------------------------------


def _rows(blocks: tuple[Block, ...], functions: FunctionTable) -> Rows:
    said = [(block, word) for block in blocks for word in block.words]
    function = [-1 if w.function is None else functions.add(w.function, f"{b.name!r}") for b, w in said]
    listed = [word for _, word in said]
    axes = np.zeros((len(listed), 6, 3))
    for row, word in enumerate(listed):
        axes[row, : len(word.axes)] = word.axes
    sides = max((len(block.markers) for block in blocks), default=2)
    return Rows(
        kind=np.array([word.kind for word in listed], dtype=np.int64),
        axes=axes,
        relation=np.array([word.relation for word in listed], dtype=float).reshape(-1, 5),
        function=np.array(function, dtype=np.int64),
        start=_starts([len(b.words) for b in blocks]),
        marker=np.array([b.markers + (-1,) * (sides - len(b.markers)) for b in blocks], dtype=np.int64).reshape(
            -1, sides
        ),
    )


def _pattern(
    blocks: tuple[Block, ...],
    moving: list[tuple[int, ...]],
    elimination: Elimination,
    table: tuple[MarkerName, ...],
) -> Pattern:
    size = [len(b.words) for b in blocks]
    offsets: dict[tuple[int, int], int] = {}
    total = 0
    for k, column in enumerate(elimination.columns):
        for later in (k, *column):
            offsets[later, k] = total
            total += LANES * size[k]
    sides = [[table[marker][0] for marker in block.markers] for block in blocks]
    pairs = [
        (b, later, side, earlier, other, offsets[later, earlier])
        for earlier in range(len(blocks))
        for later in (earlier, *elimination.columns[earlier])
        for b in moving[earlier]
        for side in _where(sides[later], b)
        for other in _where(sides[earlier], b)
    ]
    listed = np.array(pairs, dtype=np.int64).reshape(-1, 6)
    updates = [
        [offsets[a, b] for at, a in enumerate(column) for b in column[: at + 1]] for column in elimination.columns
    ]
    stored = [(later, offsets[later, k]) for k, column in enumerate(elimination.columns) for later in column]
    return Pattern(
        pair_body=listed[:, 0].copy(),
        pair=listed[:, 1:].copy(),
        diagonal=np.array([offsets[k, k] for k in range(len(blocks))], dtype=np.int64),
        column_start=_starts([len(column) for column in elimination.columns]),
        column=np.array(stored, dtype=np.int64).reshape(-1, 2),
        update_start=_starts([len(column) for column in updates]),
        update=np.array([offset for column in updates for offset in column], dtype=np.int64),
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
