"""A scene that another program steps: inputs in, outputs out, states kept and taken back, each step at a bounded cost.

    scene = Scene(..., forces=(Actuator("motor", "hinge", force=signal("torque")),))
    stepper = Stepper(scene, ROS2(1e-3), outputs=("rod.tip.position", "hinge.angle"))
    before = stepper.save()
    stepper.set_inputs(torque=0.5)
    stepper.step()
    tip = stepper.outputs()["rod.tip.position"]
    stepper.restore(before)

A step is one call of the compiled time loop: it allocates nothing, and its only iteration, the projection onto the
constraints, ends after four corrections. A step across a singular position may take the time of ten: it is tried with up to
three other places of its stages.
"""

from __future__ import annotations

import difflib
import fnmatch
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

import numpy as np

from ffr_dyn.analyses.checkpoint import fingerprint, leaves
from ffr_dyn.analyses.integration import check_method
from ffr_dyn.compile.divided_steps import too_fast
from ffr_dyn.compile.engine import new_engine, row_filler
from ffr_dyn.compile.scene_tables import System
from ffr_dyn.compile.workspace import new_record
from ffr_dyn.consistency.assemble import Assembled, assemble
from ffr_dyn.consistency.doubts import between_rows, ended, held, look, nothing_seen
from ffr_dyn.consistency.failure import Settings, failure
from ffr_dyn.integrators import Integrator, Within
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation, gains
from ffr_dyn.kernels.tables import MEASURED, NEXT, OK, PER_ROW
from ffr_dyn.results.quantities import DEFAULT_OUTPUTS, Entry, catalogue, needs_every_step, selected
from ffr_dyn.results.recorded_motion import View
from ffr_dyn.scene.force_kinds import forces_of
from ffr_dyn.scene.forces import Actuator
from ffr_dyn.scene.joints import COORDINATES
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief, Rows, listed
from ffr_prep.common.errors import InputError

Input = float | tuple[float, float, float]


@dataclass(frozen=True, eq=False, repr=False)
class State(Brief):
    """All that a stepper remembers: `arrays` of numbers, and of which scene and settings it is a state."""

    fingerprint: str
    steps: int
    arrays: tuple[Array, ...]


class Stepper(Brief):
    """A scene under way, from its assembled start.

    method        : with a fixed step, such as ROS2(1e-3)
    outputs       : quantities of `ffr_dyn.results.quantities`, patterns of them ("*.position"), or components
                    ("rod.tip.position.y")
    start         : time of the start [s]

    Raises InputError for a scene, method or outputs that cannot be used, ComputationError when the start has no
    accelerations.

    >>> stepper = fd.Stepper(scene, fd.ROS2(1e-3), outputs=("hinge.angle",))
    """

    def __init__(
        self,
        scene: Scene,
        method: Integrator,
        *,
        outputs: Sequence[str] = ("*.position",),
        start: float = 0.0,
        stabilisation: Stabilisation = Projection(),  # noqa: B008 - frozen
    ) -> None:
        check_method(method)
        if isinstance(method, Within | None) or method.controlled:
            raise InputError(
                f"{type(method).__name__} chooses its steps: their cost has no bound; use ROS2, ROS3 or RK4"
            )
        if not np.isfinite(start):
            raise InputError(f"the start of a stepper is {start} s; it must be finite")
        readers = _readers(scene, outputs)
        assembled = assemble(replace(scene, forces=(*scene.forces, *readers)), time=start)
        self._system = assembled.system
        self._start, self._step, self._steps, self._failed = start, method.step, 0, False
        self._loops = [_Loop(assembled.system, method, assembled.x.copy(), assembled.v.copy(), gains(stabilisation))]
        if assembled.all_rows is not None and _names_reactions(assembled, outputs):
            self._loops.append(_all_rows(assembled, method, self._loops[0]))
        settings = (method, start, stabilisation, len(self._loops))
        self._mark = fingerprint(self._system.model, assembled.x.tobytes(), assembled.v.tobytes(), *settings)
        self._arrays = tuple(array for loop in self._loops for array in loop.arrays())
        self._set = {name: _Setting(self._loops, name) for name in self._system.inputs}
        self._advance(0)
        self._outputs, self._computed = _outputs(
            self._loops[0], outputs, readers
        )  # which are computed of what there is
        self._seen = nothing_seen(assembled, method, *held(scene, stabilisation))

    def _title(self) -> str:
        return f"Stepper of {self._system.scene.name!r} at t = {self.time:.9g} s, step {self._step:g} s"

    def _rows(self) -> Rows:
        return [
            ("inputs", listed(f"{name} = {value:.6g}" for name, value in self.inputs.items())),
            ("outputs", listed(self._outputs)),
        ]

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return self._start + self._steps * self._step

    @property
    def length(self) -> float:
        """[s] of a step."""
        return self._step

    @property
    def inputs(self) -> dict[str, float]:
        """The inputs by name, and their values now."""
        return {name: setting.value(self.time) for name, setting in self._set.items()}

    def set_inputs(self, **values: Input) -> None:
        """Set inputs from now on: a number is held, (value, rate, second derivative) go on as a parabola.

        What drives a joint needs all three; a driver that is given a number stands still there, and the step in its
        motion is taken back by projection. Raises InputError for names that are none and for values that are no numbers or
        not finite, and sets nothing then.
        """
        now = self.time
        for name in values:
            if name not in self._set:
                raise InputError(f"there is no input {name!r}; {_offer(name, self._set)}")
        for name, parts in [(name, _parts(name, value)) for name, value in values.items()]:
            self._set[name].put(now, *parts)

    def step(self, count: int = 1) -> None:
        """Go on by `count` steps.

        Raises ComputationError as `forward` does: it stands at a step that nobody knows then, and goes on from a state that
        was saved and is restored. InputError where that was not done, and for another count than one or more whole steps.
        """
        if not isinstance(count, Real) or not 1 <= count < np.inf or count % 1:
            raise InputError(
                f"a stepper goes on by one whole step or more, not by {count!r}; use save and restore to go back"
            )
        self._check_whole()
        self._advance(int(count))

    def outputs(self) -> Mapping[str, Array]:
        """The outputs now, by name. They share memory with the stepper: the next step writes over them; copy to keep."""
        for compute in self._computed:
            compute()
        return self._outputs

    def doubts(self) -> list[str]:
        """Doubts about the states at which this was asked, beside the notes of assembly: as the notes of `forward`
        (the table in docs/analyses.md), but for the energy, and nothing is an error. Of the time since the start, that
        functions of time that are not Python's have changed faster than the steps."""
        loop = self._loops[0]
        look(self._seen, View(loop.system, loop.record))
        steps = between_rows(self._seen, loop.engine.system, loop.work, loop.record)
        fast = too_fast(self._system, self._start, self.time, self._step)
        return [*self._seen.assembled.notes, *ended("stepper", self._seen, steps), *fast]

    def save(self) -> State:
        """The state, with inputs. Raises InputError after a step that failed."""
        self._check_whole()
        return State(self._mark, self._steps, tuple(array.copy() for array in self._arrays))

    def restore(self, state: State) -> None:
        """Go back, or on, to a saved state: what follows equals what followed it, to the bit.

        Raises InputError for the state of another scene or of other settings.
        """
        if state.fingerprint != self._mark:
            raise InputError(
                "the state is one of another scene, method, step, start or stabilisation; it cannot be restored"
            )
        for array, saved in zip(self._arrays, state.arrays, strict=True):
            array[...] = saved
        self._steps, self._failed = state.steps, False

    def _check_whole(self) -> None:
        """InputError where the state is that of a step that failed, somewhere on its way."""
        if self._failed:
            raise InputError(
                "the last step of the stepper failed on its way: restore a state that was saved before it (state = "
                "stepper.save(), stepper.restore(state)), or begin with a new stepper"
            )

    def _advance(self, count: int) -> None:
        loop = self._loops[0]
        status = loop.run(self._start, self._steps, count)
        if status != OK:
            self._failed = True
            settings = Settings(loop.method, float(loop.engine.tables.clock.gains[2]) > 0)
            reached = int(loop.engine.tables.clock.steps[NEXT])
            raise failure(loop.engine.system, loop.work, status, self._start + reached * self._step, settings)
        self._steps += count
        for other in self._loops[1:]:
            _give_all_reactions(loop, other, self.time)


# ---- the compiled time loop ---------------------------------------------------------------------------------------


class _Loop:
    """A method on a compiled scene with all the memory it needs. The only place that calls it."""

    def __init__(
        self, system: System, method: Integrator, x: Array, v: Array, stabilised: tuple[float, float, float]
    ) -> None:
        self.system, self.engine = system, new_engine(system, x, v, method, stabilised)
        self.record = new_record(system, 1)
        self.x, self.v, self.work = self.engine.x, self.engine.v, self.engine.work
        self.method = method
        self._fill = row_filler(self.engine, self.record)

    def run(self, start: float, first: int, count: int) -> int:
        """`count` steps from step number `first`, and the record of where they end. Returns a status."""
        self.engine.tables.clock.steps[NEXT], self.engine.tables.clock.steps[PER_ROW] = first, count
        return self._fill(start)

    def arrays(self) -> list[Array]:
        """Everything that changes."""
        tables = (self.work, self.engine.tables.stages, self.engine.tables.clock, self.record)
        changing = [array for table in tables for _, array in leaves(table)]
        return [self.x, self.v, self.system.model.functions.data, *changing]


def _all_rows(assembled: Assembled, method: Integrator, loop: _Loop) -> _Loop:
    """The loop that finds the reactions of redundant rows: of no steps, at the states of the other."""
    assert assembled.all_rows is not None
    return _Loop(assembled.all_rows, method, loop.x.copy(), loop.v.copy(), (0.0, 0.0, 0.0))


def _give_all_reactions(loop: _Loop, all_rows: _Loop, time: float) -> None:
    """Reactions of the redundant rows too: the smallest that give the accelerations."""
    all_rows.x[:], all_rows.v[:] = loop.x, loop.v
    all_rows.work.loads.reference[:] = loop.record.forces[0]
    all_rows.run(time, 0, 0)
    names = [block.name for block in all_rows.system.blocks]
    for k, block in enumerate(loop.system.blocks):
        loop.record.reaction[0, k] = all_rows.record.reaction[0, names.index(block.name)]


# ---- inputs -------------------------------------------------------------------------------------------------------


class _Setting:
    """Where an input stands in the tables of time functions: [1, 3, time of setting, for ever, c0, c1, c2]."""

    def __init__(self, loops: Iterable[_Loop], name: str) -> None:
        tables = [(loop.system.model.functions.data, start) for loop in loops for start in loop.system.inputs[name]]
        self._numbers = [data[start + 2 : start + 7] for data, start in tables]

    def put(self, now: float, value: float, rate: float, second: float) -> None:
        for numbers in self._numbers:
            numbers[0], numbers[2], numbers[3], numbers[4] = now, value, rate, 0.5 * second

    def value(self, now: float) -> float:
        since, _, value, rate, half = self._numbers[0].tolist()
        return float(value + (now - since) * (rate + (now - since) * half))


def _parts(name: str, given: Input) -> tuple[float, float, float]:
    """(value, rate, second derivative) of an input."""
    try:
        value, rate, second = map(float, given) if np.ndim(given) else (float(given), 0.0, 0.0)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise InputError(
            f"input {name!r} is {given!r}; give a number, or three: (value, rate, second derivative)"
        ) from None
    if not abs(value) + abs(rate) + abs(second) < np.inf:
        raise InputError(f"input {name!r}: {(value, rate, second)} is not finite")
    return value, rate, second


# ---- outputs ------------------------------------------------------------------------------------------------------

_COORDINATES = ("angle", "angle_rate", "stroke", "stroke_rate")


def _readers(scene: Scene, outputs: Sequence[str]) -> tuple[Actuator, ...]:
    """Actuators without force on the joint coordinates that are outputs: by these the time loop measures them."""
    patterns = [each for name in outputs for each in (DEFAULT_OUTPUTS if name == "default" else (name,))]
    taken = {thing.name for things in (scene.bodies, scene.joints, scene.forces) for thing in things}
    pairs = {
        (joint.name, coordinate)
        for joint in scene.joints
        for coordinate in COORDINATES[joint.kind]
        for end in ("", "_rate")
        if any(fnmatch.fnmatchcase(f"{joint.name}.{coordinate}{end}", pattern) for pattern in patterns)
    }
    return tuple(
        Actuator(_unused(f"{joint}-{coordinate}", taken), joint, coordinate=coordinate)
        for joint, coordinate in sorted(pairs)
    )


def _unused(name: str, taken: Container[str]) -> str:
    return name if name not in taken else _unused(f"{name}-", taken)


def _outputs(
    loop: _Loop, names: Sequence[str], readers: Sequence[Actuator]
) -> tuple[dict[str, Array], list[Callable[[], None]]]:
    """Arrays by name, and what must be called to bring them up to date: nothing for those that the time loop writes."""
    shared, computed = {}, []
    view, measured = View(loop.system, loop.record), _measured(loop, readers)
    for name, (entry, at) in _wanted(loop.system, names, readers).items():
        values = measured[name] if name in measured else entry.compute(view, None)[0]
        if any(np.shares_memory(values, column) for column in loop.record):
            shared[name] = _read_only(values[0:1].reshape(()) if at is None and values.ndim == 1 else _at(values, at))
        else:
            shared[name], compute = _computed(loop, entry, at)
            computed.append(compute)
    return shared, computed


def _at(values: Array, at: int | None) -> Array:
    """The only row of values, or a component of it, without a copy."""
    return values[0] if at is None else values[0, at : at + 1].reshape(())


def _wanted(
    system: System, names: Sequence[str], readers: Sequence[Actuator] = ()
) -> dict[str, tuple[Entry, int | None]]:
    """Entries of the catalogue by output, with the number of a component. InputError for what cannot be an output."""
    found: dict[str, tuple[Entry, int | None]] = {}
    own = {reader.name for reader in readers}
    for name in names:
        owner, at = _component(system, name)
        entries = {
            each: entry for each, entry in selected(system, (owner,)).items() if each.partition(".")[0] not in own
        }
        if needs_every_step(entries):
            raise InputError(f"output {name!r}: work adds up over all steps, which a stepper does not; use the power")
        found |= {each if at is None else name: (entry, at) for each, entry in entries.items()}
    return found


def _component(system: System, name: str) -> tuple[str, int | None]:
    """("rod.tip.position", 1) of "rod.tip.position.y"; (name, None) of what is no component."""
    head, _, label = name.rpartition(".")
    if head in (known := catalogue(system)) and known[head].axes and label in known[head].axes[0].labels:
        return head, known[head].axes[0].labels.index(label)
    return name, None


def _measured(loop: _Loop, readers: Sequence[Actuator]) -> dict[str, Array]:
    """(1,) columns of the record that hold the joint coordinates of `readers` and their rates, by name."""
    starts = dict(
        zip((f.name for f in forces_of(loop.system.scene)), loop.system.model.loads.row[:, MEASURED], strict=True)
    )
    return {
        f"{r.joint}.{r.coordinate}{end}": loop.record.forces[:, starts[r.name] + column]
        for r in readers
        for end, column in (("", 0), ("_rate", 1))
    }


def _computed(loop: _Loop, entry: Entry, at: int | None) -> tuple[Array, Callable[[], None]]:
    """An array, and what fills it: from a view of its own each time, as the row is another one in the same place."""

    def values() -> Array:
        row: Array = entry.compute(View(loop.system, loop.record), None)[0][0]
        return row

    def compute() -> None:
        target[...] = values() if at is None else values()[at]

    target = np.array(values() if at is None else 0.0)
    return _read_only(target), compute


def _read_only(values: Any) -> Array:
    seen = np.asarray(values).view()
    seen.setflags(write=False)
    return seen


def _names_reactions(assembled: Assembled, outputs: Sequence[str]) -> bool:
    """Whether an output is a reaction: of a joint or driver, and not a coordinate."""
    blocks = {block.name for block in assembled.system.blocks}
    names = _wanted(assembled.system, outputs)
    return any(name.partition(".")[0] in blocks and name.rpartition(".")[2] not in _COORDINATES for name in names)


def _offer(name: str, known: Iterable[str]) -> str:
    known = list(known)
    close = difflib.get_close_matches(name, known, 1)
    hint = f"did you mean {close[0]!r}? " if close else ""
    return f"{hint}there are: {', '.join(map(repr, known)) or 'none; a `signal` in a load, force or driver makes one'}"
