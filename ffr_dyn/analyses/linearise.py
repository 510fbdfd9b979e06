"""Linearised equations about a state: matrices A, B, C, D in minimal coordinates, eigenvalues, modes, stability.

    d/dt (y, z) = A (y, z) + B u,     outputs - outputs at the state = C (y, z) + D u

y are small motions along the free motions Z (mass-orthonormal), z their rates, both seen from axes that move with the bodies
(see `tangent`): at an equilibrium, and in steady rotation, A is constant. Of a state that is neither, A describes the next
moment only; a note says so.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, get_args

import numpy as np

from ffr_dyn.analyses.efforts import Effort, sized, with_units, with_work, without, work_of
from ffr_dyn.analyses.integration import with_reactions_of
from ffr_dyn.analyses.outcome import result_of, some_of
from ffr_dyn.analyses.registry import OfMoment, option
from ffr_dyn.analyses.rotating.steady import steady
from ffr_dyn.analyses.settings import MomentSettings
from ffr_dyn.analyses.states import scene_at
from ffr_dyn.analyses.static import static
from ffr_dyn.compile.engine import with_model
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.structure import Structure
from ffr_dyn.consistency.assemble import assemble, seen_in_space
from ffr_dyn.consistency.doubts import KINK, checked
from ffr_dyn.consistency.evaluation import Evaluator, evaluate, evaluator
from ffr_dyn.consistency.held_frequencies import beyond_modes
from ffr_dyn.consistency.kinks import check_sizes, held_by_nothing, kinked_forces
from ffr_dyn.consistency.tangent import STEP, Chart, at_rest, chart, derivative, rates, sizes, state, state_matrix
from ffr_dyn.equations.forces import At
from ffr_dyn.equations.layout import to_global_axes
from ffr_dyn.kernels.tables import LAW, Record
from ffr_dyn.linear.eigen import NULL, eigen
from ffr_dyn.linear.matrices import Modes, graded, modes_of, reduced
from ffr_dyn.linear.matrices import state_matrix as steady_matrix
from ffr_dyn.linear.prestrained import prestrained, told
from ffr_dyn.linear.spectrum import main_parts, rates_of
from ffr_dyn.linear.steady_state import TURNED, Steady, carried, screws_of, steady_here
from ffr_dyn.linear.whirl import damping_ratios, ways_of, whirls
from ffr_dyn.linear.words import in_words
from ffr_dyn.results.file import save_result
from ffr_dyn.results.quantities import catalogue
from ffr_dyn.results.result import Axis, Quantity, Result
from ffr_dyn.scene.checks import several
from ffr_dyn.scene.described import described
from ffr_dyn.scene.forces.load import Load
from ffr_dyn.scene.scene import Scene, length_of
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief
from ffr_prep.common.errors import ComputationError, InputError

SHOWN = 12  # modes that a command prints
BASE = {"base.x": 0, "base.y": 1, "base.z": 2}  # inputs: accelerations of the ground
SAME = 1e-6  # of matrices at two angles of a steady motion, relative
STATIONARY = 1e-6  # of the accelerations in moving axes, relative to those of the applied forces
NEXT_MOMENT = (
    "the state is no equilibrium and no steady rotation: the eigenvalues describe its next moment only; linearise about the "
    "{} ({}; in Python {}, or {} and `fd.scene_at`)"
)
LASTING = {  # by whether nothing moves
    True: ("equilibrium", "`--at-equilibrium`, `response --equilibrium`", 'about="equilibrium"', "`fd.static`"),
    False: ("steady motion", "`--at-steady`, `response --steady`", 'about="steady"', "`fd.steady`"),
}


@dataclass(frozen=True, repr=False)
class Linearisation(Brief):
    """A scene near a state, with d degrees of freedom.

    A (2d, 2d), B (2d, inputs), C (outputs, 2d), D (outputs, inputs);  inputs, outputs : names
    Z           : (V, d) free motions, in body axes [A^T R_dot, omega_bar, q_dot]
    eigenvalues : (2d,) [1/s] by rising modulus;  modes : (V, 2d) the motions of the bodies that belong to them
    leading     : what moves in each mode: "rod: first bending, y" of one that strains a body, else the coordinate
    free        : how many eigenvalues are zero, which come first: motions that nothing holds, two for each
    driven      : drivers, whose motions are none of the degrees of freedom
    seen        : (2d,) [Hz] frequencies seen from the ground, of scenes that turn: positive where the whirl is forward
    whirl       : (2d,) share of the amplitude that whirls so, 1 for a circle and 1/2 for a line in the turning axes; nan of
                  what does not turn, or vibrates along the axis
    error       : [1] relative difference of A from step halving; zero at rest and in steady motion, where A is exact

    >>> found = fd.linearise(scene)
    >>> np.abs(found.eigenvalues) / (2 * np.pi)  # [Hz]
    """

    A: Array
    B: Array
    C: Array
    D: Array
    Z: Array
    eigenvalues: Array
    modes: Array
    leading: tuple[str, ...]
    free: int
    driven: tuple[str, ...]
    seen: Array
    whirl: Array
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    error: float
    notes: tuple[str, ...]
    near: Chart = field(repr=False)

    @property
    def frequencies(self) -> Array:
        """(2d,) [Hz] of the damped vibration."""
        found: Array = np.abs(self.eigenvalues.imag) / (2 * np.pi)
        return found

    @property
    def damping_ratios(self) -> Array:
        """(2d,) -Re / modulus, of whirls at the frequency seen from the ground; 1 for a decay without vibration, negative
        where the motion grows."""
        return damping_ratios(self.eigenvalues, 2 * np.pi * self.seen, self.whirl)

    @property
    def stability_margin(self) -> float:
        """Largest real part of an eigenvalue [1/s]: negative where all small motions decay."""
        return float(self.eigenvalues.real.max())

    def to_statespace(self) -> Any:
        """A `scipy.signal.StateSpace` of A, B, C, D; python-control takes its matrices: control.ss(s.A, s.B, s.C, s.D)."""
        from scipy.signal import StateSpace

        return StateSpace(self.A, self.B, self.C, self.D)


@dataclass(frozen=True)
class Linearise(OfMoment):
    """Inputs are efforts and names of loads; quantities such as "rod.tip.position.y" are what comes out.

    >>> result = fd.run(scene, fd.MomentSettings(analysis=fd.Linearise(at_equilibrium=True)))
    """

    keeps: ClassVar[bool] = False
    example: ClassVar[str] = (
        "ffr-dyn linearise crane.toml --at-equilibrium --input push=trolley.hook:1,0,0 --quantity load.pin.position.x"
    )
    inputs: tuple[Effort | str, ...] = field(
        default=(),
        metadata=option("--input", "Input: a force, or the name of a load; repeat.", metavar="FORCE", names="loads"),
    )
    quantities: tuple[str, ...] = field(
        default=(), metadata=option("--quantity", "Output: a component, such as rod.tip.position.y; repeat.")
    )
    at_equilibrium: bool = field(
        default=False,
        metadata=option("--at-equilibrium/--at-start", "About the static equilibrium, or (default) the start."),
    )

    at_steady: bool = field(
        default=False,
        metadata=option("--at-steady/--at-any", "About the steady motion with the scene's drivers and velocities."),
    )

    film: str = field(default="", metadata=option("--film", "Film of a mode, .html, .gif or .mp4.", metavar="FILE"))
    mode: int = field(
        default=1, metadata=option("--mode", "Which mode the film shows, by its line in what is printed.")
    )

    def perform(self, scene: Scene, settings: MomentSettings, **how: Any) -> Result:
        time, path = settings.time, how["path"]
        if self.at_equilibrium and self.at_steady:
            raise InputError(
                "about the equilibrium or about the steady motion? give one of --at-equilibrium, --at-steady"
            )
        at = scene_at(scene, static(scene, time=time)) if self.at_equilibrium else scene
        at = scene_at(scene, steady(scene, time=time)) if self.at_steady else at
        found = linearise(at, time=time, inputs=self.inputs, outputs=self.quantities)
        if self.film:
            _draw(found, self.mode, self.film)
        result = as_result(scene, found, time)
        if path is not None:
            save_result(result, path)
        return result

    def report(self, result: Result) -> list[str]:
        a = result.attributes
        columns = (result[name][0] for name in ("eigenvalues", "frequencies", "damping_ratios", "seen", "whirl"))
        lines = _lines_of_modes(*columns, leading=a["leading"], free=a["free"])
        more = [f"... and {len(lines) - SHOWN} more in the file"] if len(lines) > SHOWN else []
        driven = [f"driven       {name}" for name in a["driven"]]
        return [*lines[:SHOWN], *more, *driven, *(f"note         {note}" for note in a["notes"])]


def _draw(found: Linearisation, line: int, path: str) -> None:
    """The film of the mode in a line of the table, from 1."""
    from ffr_dyn.analyses.rotating.mode_motion import mode_motion
    from ffr_dyn.pictures.animate import animate

    numbers = [
        *range(0, found.free, 2),
        *(k for k, v in enumerate(found.eigenvalues) if k >= found.free and v.imag >= 0),
    ]
    if not 1 <= line <= len(numbers):
        raise InputError(f"mode {line}: the modes that are told are 1 to {len(numbers)}")
    animate(mode_motion(found, numbers[line - 1]), path)


def linearise(
    scene: Scene, *, time: float = 0.0, inputs: tuple[Effort | str, ...] = (), outputs: tuple[str, ...] = ()
) -> Linearisation:
    """Linearise a scene about its assembled state at `time` [s], its drivers' positions and rates being those of the time.

    About a steady motion inputs and outputs that do not turn with the bodies are those of this moment, which a note tells;
    `response` takes them over the turn.

    inputs  : efforts, names of loads of the scene (an input of one doubles the load), or "base.x", "base.y", "base.z", an
              acceleration of the ground, to whose frame all outputs refer
    outputs : components of a result, such as "rod.tip.position.y", or quantities, "rod.tip.position": its components
    For an equilibrium: ``linearise(scene_at(scene, static(scene)))``.

    Raises InputError when nothing is free to move, or for a name that does not exist.

    >>> found = fd.linearise(scene, inputs=(fd.JointEffort("torque", "hinge"),), outputs=("rod.tip.position.y",))
    """
    found = linearised(scene, time, inputs, outputs)
    highest = float(np.abs(found.eigenvalues.imag).max(initial=0.0)) / (2 * np.pi)
    return replace(found, notes=(*found.notes, *_of_this_moment(found, scene, inputs), *beyond_modes(scene, highest)))


def linearised(
    scene: Scene, time: float, inputs: tuple[Effort | str, ...] = (), outputs: tuple[str, ...] = ()
) -> Linearisation:
    """As `linearise`, whatever turns."""
    several("inputs", inputs, (*get_args(Effort), str)), several("outputs", outputs, (str,))
    fed = with_units(seen_in_space(scene), _efforts(inputs))
    assembled = assemble(fed, time=time)
    at, whole = (
        None if system is None else _with_inputs(evaluator(system), scene, inputs, np.zeros(len(inputs)))
        for system in (assembled.system, assembled.all_rows)
    )
    assert at is not None
    near = replace(chart(at, time, assembled.x, assembled.v), all_rows=whole)
    if near.steps.size == 0:
        raise InputError("nothing is free to move: joints and drivers fix every motion; linearise with fewer drivers")
    steady = steady_about(near, inputs)
    near, rounding = graded(near, _without_inputs(near, inputs))
    A, error, solved = _solved(_without_inputs(near, inputs), steady, rounding)
    outputs = _components(near, outputs)
    B, C, D = inputs_and_outputs(near, scene, inputs, outputs)
    parts = near.Z @ solved.parts
    modes = main_parts(parts)
    modes = modes / np.where((size := np.abs(modes).max(axis=0)) > 0, size, 1.0)
    where = assembled.system.scene, assembled.system.layout
    screws = screws_of(where[1], assembled.x, assembled.v)
    seen, whirl, _ = whirls(*where, screws, assembled.x, rates_of(solved.values, len(parts), solved.shift), parts)
    ways = ways_of(seen, whirl)
    leading = in_words(*where, assembled.x, near.M, modes, _rates_of_shapes(near, A, solved, seen, ways), ways)
    names = tuple(item if isinstance(item, str) else item.name for item in inputs)
    evaluate(at, time, assembled.x, assembled.v)
    unit = main_parts(parts) / np.sqrt(np.maximum((np.abs(solved.parts) ** 2).sum(axis=(0, 1)), 1e-300))
    strained = prestrained(*where, assembled.x, solved.values, unit)
    here = _here(_without_inputs(near, inputs))
    notes = (
        *assembled.notes,
        *_notes(near, steady, A, rounding),
        *solved.notes,
        *checked("linearise", assembled, at.record, {KINK: kinked_forces(here)}),
        *held_by_nothing(here),
    )
    notes = (*notes, *told(strained, leading[strained.mode]))
    driven = tuple(driver.name for driver in scene.drivers)
    return Linearisation(
        A, B, C, D, near.Z, solved.values, modes, leading, solved.free, driven, seen / (2 * np.pi), whirl, names,
        outputs, error, notes, near,
    )  # fmt: skip


def steady_about(near: Chart, inputs: tuple[Effort | str, ...]) -> Steady | None:
    """The steady motion that a chart's state is in without the inputs; None of one that is in none, or at rest."""
    if at_rest(near):
        return None
    plain = _without_inputs(near, inputs)
    return steady_here(plain.at.system, near.time, near.x, to_global_axes(plain.at.system.layout, near.x, near.V))


def _here(near: Chart) -> At:
    system = near.at.system
    return At(system.scene, system.layout, near.time, near.x, to_global_axes(system.layout, near.x, near.V))


def _without_inputs(near: Chart, inputs: tuple[Effort | str, ...]) -> Chart:
    """With the efforts, which are of one in the scene, left out of what is computed from its declarations."""
    system = near.at.system
    plain = replace(system, scene=without(system.scene, _efforts(inputs)), structure=Structure())
    return replace(near, at=replace(near.at, engine=replace(near.at.engine, system=plain)))


def _solved(near: Chart, steady: Steady | None, rounding: Array | None) -> tuple[Array, float, Modes]:
    """A, its error, and the modes; about a steady motion and at rest from exact matrices, at rest with the rounding (d,) of
    the stiffness."""
    if steady is not None:
        steady = replace(steady, Z=near.Z)
        return steady_matrix(steady, reduced(steady)), 0.0, modes_of(steady)
    d = near.steps.size
    A, error = state_matrix(near)
    if not np.isfinite(A).all():
        raise ComputationError(
            f"at t = {near.time:.6g} s a force has no finite value beside the state that is linearised; look at its function"
        )
    if at_rest(near):
        rest = eigen(-A[d:, :d], -A[d:, d:], rounding)
        return A, error, Modes(rest.values, rest.vectors[None], rest.free, 0.0)
    values, vectors = np.linalg.eig(A)
    order = np.lexsort((np.sign(values.imag), np.round(np.abs(values), 9)))
    return A, error, Modes(values[order], vectors[None, :d, order], 0, 0.0)


def _rates_of_shapes(near: Chart, A: Array, solved: Modes, seen: Array, ways: Sequence[str]) -> Array:
    """(2d,) [rad/s] by which modes are counted: from the ground; of what decays at rest, which has two rates for one shape,
    that of the shape without dampers."""
    rates: Array = np.hypot(solved.values.real, np.where([bool(way) for way in ways], seen, solved.values.imag))
    if not at_rest(near):
        return rates
    d, y = near.steps.size, solved.parts[0]
    strain = -(y.conj() * (A[d:, :d] @ y)).sum(axis=0).real / np.maximum((np.abs(y) ** 2).sum(axis=0), 1e-300)
    rates = np.where(solved.values.imag == 0, np.sqrt(np.abs(strain)), rates)
    rates[: solved.free] = 0.0  # whose strain is rounding
    return rates


def _notes(near: Chart, steady: Steady | None, A: Array, rounding: Array | None) -> list[str]:
    """Of the steady motion; of another state whether it is an equilibrium, as far as the rounding of positions tells it."""
    if steady is not None:
        return list(steady.notes)
    at, place, d = near.at, near.at.system.layout, near.steps.size
    v = to_global_axes(place, near.x, near.V)
    left = rates(near, near.x, v)[d:]
    if rounding is None:
        rounding = np.full(d, NULL * max(1.0, float(np.abs(A[d:, :d]).max(initial=0.0))))
    left = near.Z @ np.where(np.abs(left) > rounding * near.steps / STEP, left, 0.0) / sizes(at)
    applied = np.linalg.solve(near.M, evaluate(at, near.time, near.x, v).force) / sizes(at)
    if np.abs(left).max() <= STATIONARY * max(
        float(np.abs(applied).max()), float(np.abs(near.V / sizes(at)).max()) ** 2
    ):
        return []
    return [NEXT_MOMENT.format(*LASTING[at_rest(near)])]


def _of_this_moment(found: Linearisation, scene: Scene, inputs: tuple[Effort | str, ...]) -> list[str]:
    """A note on inputs and outputs that change as a steady motion goes on."""
    near = found.near
    steady = steady_about(near, inputs) if found.B.size or found.C.size else None
    if steady is None or not steady.machine.screws.fastest:
        return []
    screws = steady.machine.screws
    later = TURNED / screws.fastest
    there = replace(near, time=near.time + later, x=carried(near.at.system.layout, screws, near.x, later))
    again = inputs_and_outputs(there, scene, inputs, found.outputs)
    before = (found.B, found.C, found.D)
    if all(
        np.abs(b - a).max(initial=0.0) <= SAME * np.abs(a).max(initial=0.0) for a, b in zip(before, again, strict=True)
    ):
        return []
    return [
        "inputs or outputs change with the angle of what turns: B, C and D are those of this moment; `response` takes them "
        "over the turn"
    ]


# ---- inputs and outputs ----------------------------------------------------------------------------------------------


def inputs_and_outputs(
    near: Chart, scene: Scene, inputs: tuple[Effort | str, ...], outputs: tuple[str, ...]
) -> tuple[Array, Array, Array]:
    """B, C, D about a chart's state."""
    v = to_global_axes(near.at.system.layout, near.x, near.V)
    now = evaluate(near.at, near.time, near.x, v)
    amounts = _amounts(near, scene, inputs, np.abs(now.force) + np.abs(near.M @ now.acceleration))
    B = _columns(lambda u: rates(_fed(near, scene, inputs, u), near.x, v), amounts)
    return B, *_output_matrices(near, scene, inputs, outputs, amounts)


def _amounts(near: Chart, scene: Scene, inputs: tuple[Effort | str, ...], inertia: Array) -> Array:
    """(U,) of inputs that are not lost beside the forces of the scene and its inertia (V,)."""
    here, place = without(near.at.system.scene, _efforts(inputs)), near.at.system.layout
    now = At(here, place, near.time, near.x, to_global_axes(place, near.x, near.V))
    work = work_of(now, inertia) or 1.0
    weight = length_of(here) * sum(body.model.mass for body in here.bodies)
    for load in _loads(scene, inputs):
        _check_there(load, now)
    found = np.array([work / weight if isinstance(item, str) and _is_base(scene, item) else 1.0 for item in inputs])
    efforts = np.array([not isinstance(item, str) for item in inputs], bool)
    found[efforts] = with_work(here, _efforts(inputs), work)
    return found


def _columns(function: Callable[[Array], Array], amounts: Array) -> Array:
    """d function / d u by u of these amounts (U,): exact, since the efforts enter linearly."""
    zero = function(np.zeros(amounts.size))
    return np.array([(function(u) - zero) / u.sum() for u in np.diag(amounts)]).reshape(amounts.size, zero.size).T


def _fed(near: Chart, scene: Scene, inputs: tuple[Effort | str, ...], u: Array) -> Chart:
    whole = None if near.all_rows is None else _with_inputs(near.all_rows, scene, inputs, u)
    return replace(near, at=_with_inputs(near.at, scene, inputs, u), all_rows=whole)


def _efforts(inputs: tuple[Effort | str, ...]) -> tuple[Effort, ...]:
    return tuple(item for item in inputs if not isinstance(item, str))


def _with_inputs(at: Evaluator, scene: Scene, inputs: tuple[Effort | str, ...], u: Array) -> Evaluator:
    """The evaluator with the inputs u, on top of the scene's own loads."""
    model, data = at.system.model, at.system.model.loads.data.copy()
    gravity = model.gravity.copy()
    for item, amount in zip(inputs, u, strict=True):
        if isinstance(item, str) and _is_base(scene, item):
            gravity[BASE[item]] -= amount
        elif isinstance(item, str):
            first = model.loads.row[_load_number(scene, item), LAW]
            data[first : first + 6] *= 1.0 + amount
    fed = replace(
        at, engine=with_model(at.engine, model._replace(loads=model.loads._replace(data=data), gravity=gravity))
    )
    sizes = [amount for item, amount in zip(inputs, u, strict=True) if not isinstance(item, str)]
    return sized(fed, _efforts(inputs), np.array(sizes))


def _loads(scene: Scene, inputs: tuple[Effort | str, ...]) -> list[Load]:
    """Those that are inputs, by a share of themselves."""
    return [
        scene.loads[_load_number(scene, item)] for item in inputs if isinstance(item, str) and not _is_base(scene, item)
    ]


def _check_there(load: Load, now: At) -> None:
    """InputError for a load that is zero now, but for the rounding of the time: every share of it is zero as well."""
    for component in (*load.force, *load.moment):
        value, rate, _ = now.value(component)
        if abs(value) > 4.0 * np.finfo(float).eps * abs(now.t * rate):
            return
    raise InputError(
        f"input {load.name!r}: the load is zero at {now.t:g} s, and so is every share of it; take a force as input, such as "
        f"{load.marker}:1,0,0, or a time at which the load is there"
    )


def _is_base(scene: Scene, item: str) -> bool:
    """Whether an input is an acceleration of the base, and no load of that name."""
    return item in BASE and item not in [load.name for load in scene.loads]


def _load_number(scene: Scene, name: str) -> int:
    names = [load.name for load in scene.loads]
    if name not in names:
        raise InputError(f"input {name!r}: the scene has no such load; there are {', '.join(names) or 'none'}")
    if scene.loads[names.index(name)].function is not None:
        raise InputError(f"input {name!r}: a load by a Python function has no size to vary; use an effort as input")
    return names.index(name)


def _output_matrices(
    near: Chart, scene: Scene, inputs: tuple[Effort | str, ...], outputs: tuple[str, ...], amounts: Array
) -> tuple[Array, Array]:
    d = near.steps.size
    quantities = quantities_of(near, outputs)
    if not outputs:
        return np.zeros((0, 2 * d)), np.zeros((0, len(inputs)))

    def measured(chart: Chart, deviation: Array) -> Array:
        x, v = state(chart, deviation[:d], deviation[d:])
        evaluate(chart.at, chart.time, x, v)
        record = chart.at.record
        if chart.all_rows is not None:
            record = with_reactions_of(chart.all_rows.engine, chart.at.system, record)
        result = of_outputs(chart.at.system, record, quantities, outputs)
        values = np.array([float(result[name][0]) for name in outputs])
        return values - 2 * np.pi * turns * np.round((values - here) / (2 * np.pi))

    turns, here = np.array([name.endswith(".angle") for name in outputs]), np.zeros(len(outputs))
    here = measured(near, np.zeros(2 * d))  # angles are told within half a turn; these go on from here
    steps = np.concatenate([near.steps, near.steps])
    C, _ = derivative(lambda deviation: measured(near, deviation), steps)
    check_sizes(near.at.system.scene, outputs, lambda deviation: measured(near, deviation), C, steps)
    return C, _columns(lambda u: measured(_fed(near, scene, inputs, u), np.zeros(2 * d)), amounts)


def quantities_of(near: Chart, outputs: tuple[str, ...]) -> list[str]:
    """The quantities of the scene of which the outputs are components; what is none of them a result will name."""
    names = catalogue(near.at.system)
    found = [max((n for n in names if f"{output}.".startswith(f"{n}.")), key=len, default="") for output in outputs]
    for output, name in zip(outputs, found, strict=True):
        if name.endswith(".work"):
            raise InputError(f"output {output!r} adds up over time and is no function of the state; take the power")
    return [name for name in found if name]


def of_outputs(system: System, record: Record, quantities: Sequence[str], outputs: Sequence[str]) -> Result:
    """What outputs are components of: these quantities alone, or of efforts, which are none of a scene's, a whole result."""
    if len(quantities) == len(outputs):
        return some_of(system, record, quantities)
    return result_of(system, record, {}, outputs=("default", *quantities))


def _components(near: Chart, outputs: tuple[str, ...]) -> tuple[str, ...]:
    """Every component of the outputs."""
    result = result_of(near.at.system, near.at.record, {}, outputs=("default", *quantities_of(near, outputs)))
    return tuple(one for name in outputs for one in result.components([name]))


# ---- as a result -----------------------------------------------------------------------------------------------------


def as_result(scene: Scene, found: Linearisation, time: float = 0.0) -> Result:
    """The linearisation as a labelled result of one row, which can be kept in a file."""
    d = found.Z.shape[1]
    states = Axis("state", (*(f"y{k + 1}" for k in range(d)), *(f"z{k + 1}" for k in range(d))))
    columns = replace(states, name="of_state")
    modes = Axis("eigenvalue", tuple(str(k + 1) for k in range(2 * d)))
    complex_parts = Axis("part", ("re", "im"))
    parts = np.column_stack([found.eigenvalues.real, found.eigenvalues.imag])
    motions, shapes = Axis("motion", _motions(found)), np.stack([found.modes.real, found.modes.imag], axis=2)
    quantities = {
        "A": Quantity(found.A[None], "1", (states, columns), "state matrix"),
        "eigenvalues": Quantity(parts[None], "1/s", (modes, complex_parts), "eigenvalues of A"),
        "frequencies": Quantity(found.frequencies[None], "Hz", (modes,), "of the damped vibration"),
        "damping_ratios": Quantity(found.damping_ratios[None], "1", (modes,), "of the modes; negative where they grow"),
        "seen": Quantity(found.seen[None], "Hz", (modes,), "from the ground, positive of forward whirls"),
        "whirl": Quantity(found.whirl[None], "1", (modes,), "share of the amplitude that whirls so"),
        "modes": Quantity(shapes[None], "1", (motions, modes, complex_parts), "motions of the bodies, body axes"),
    }
    matrices = (
        ("B", found.B, (states, found.inputs)),
        ("C", found.C, (found.outputs, columns)),
        ("D", found.D, (found.outputs, found.inputs)),
    )
    for name, matrix, axes in matrices:
        if matrix.size:
            labelled = tuple(a if isinstance(a, Axis) else Axis(_AXES[a is found.inputs], _labels(a)) for a in axes)
            quantities[name] = Quantity(matrix[None], "1", labelled, f"state space matrix {name}")
    attributes = {
        **described(scene),
        "analysis": "linearised",
        "method": f"central differences, step halving changes A by {found.error:.1e}"
        if found.error
        else "exact tangent",
        "degrees_of_freedom": d,
        "stability_margin": found.stability_margin,
        "leading": list(found.leading),
        "free": found.free,
        "driven": list(found.driven),
        "inputs": list(found.inputs),
        "outputs": list(found.outputs),
        "notes": list(found.notes),
        "status": "complete",
    }
    return Result(np.array([time]), quantities, {}, attributes)


def _motions(found: Linearisation) -> tuple[str, ...]:
    """Of each body its shift and its turning, and its elastic coordinates."""
    system = found.near.at.system
    named = zip(system.scene.bodies, system.layout.n, strict=True)
    own = [
        (body.name, ("x", "y", "z", "turn x", "turn y", "turn z", *(f"q{k + 1}" for k in range(n))))
        for body, n in named
    ]
    return tuple(f"{body} {motion}".replace(".", " ") for body, motions in own for motion in motions)


_AXES = {True: "input", False: "output"}


def _labels(names: tuple[str, ...]) -> tuple[str, ...]:
    """Labels of an axis contain no dot."""
    return tuple(name.replace(".", " ") for name in names)


def _lines_of_modes(
    parts: Array, frequencies: Array, ratios: Array, seen: Array, whirl: Array, *, leading: Sequence[str], free: int
) -> list[str]:
    still = [f"{'free':>12}                                                    {name}" for name in leading[:free:2]]
    rows = zip(parts[free:], frequencies[free:], ratios[free:], seen[free:], whirl[free:], leading[free:], strict=True)
    return still + [
        f"{frequency:12.6g} Hz   damping {ratio + 0.0:9.3g}   real part {real + 0.0:11.4g} 1/s   "
        f"{name}{_whirling(ground, share)}"
        for (real, imag), frequency, ratio, ground, share, name in rows
        if imag >= 0
    ]


def _whirling(seen: float, share: float) -> str:
    """The words for a whirl; empty for a mode that does not turn, or moves to and fro."""
    (way,) = ways_of(np.array([seen]), np.array([share]))
    return f"   {way} whirl, {abs(seen):.6g} Hz from the ground" if way else ""
