"""Forward dynamics with as many modes as are needed now: modes enter and leave, bodies become rigid and flexible again.

The run goes in pieces of some output rows. In each, the modes that are left out are driven one-way by the motion, as passive
oscillators that go on from piece to piece (`drive`). Where they would change an output by more than a share of its tolerance
they enter with the amplitudes and rates of their oscillators, frame and joints in the place that belongs to these, and the
piece is run again. A mode that did less than a smaller share leaves, and goes on as an oscillator. So outputs jump by less
than that share; what the energy does at every switch is kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ffr_dyn.analyses.integration import geometry
from ffr_dyn.closing.constraints import constraints_of
from ffr_dyn.closing.positions import close_positions, close_velocities
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.economy.contributions import effects_of
from ffr_dyn.economy.model_choice import Choice, Part, full
from ffr_dyn.economy.outputs import Output, Probe, as_output, check_meaning, limits, probe, ranges
from ffr_dyn.economy.policy import DEFAULT, Policy
from ffr_dyn.economy.residual_estimate import Samples, driven, followed, samples
from ffr_dyn.economy.run import Made, Span, Trial, make, run, states
from ffr_dyn.equations.layout import Layout, initial_state, moved, to_body_axes, to_global_axes
from ffr_dyn.integrators.stabilisation import Projection, Stabilisation
from ffr_dyn.results.result import Axis, Quantity, Result
from ffr_dyn.scene.described import described
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.variants.mean_axis import in_new_frames
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

KEPT = ("*.R", "*.p", "*.v", "*.omega_bar", "*.position", "*.velocity", "energy.*", "constraint.*")


@dataclass(frozen=True)
class Adaptation:
    """The thresholds at which modes enter and leave.

    enter : share of a tolerance above which a mode that is left out enters [1]
    leave : share [1] below which a mode that is there leaves; well below `enter`, so that it does not come back at once
    rows  : output rows between two looks

    Raises InputError unless 0 < leave < enter <= 1 and rows is two or more.

    >>> settings = fd.Adaptation(enter=0.2, leave=0.05)
    """

    enter: float = 0.3
    leave: float = 0.05
    rows: int = 10

    def __post_init__(self) -> None:
        if not 0 < self.leave < self.enter <= 1:
            raise InputError(
                f"modes enter at {self.enter} and leave at {self.leave} of a tolerance; these must be 0 < leave < enter <= 1"
            )
        if self.rows < 2:
            raise InputError(f"a look at every {self.rows} output rows is too often; at least two are needed")


@dataclass
class _State:
    """Where the run is: time, the scene's bodies there with amplitudes of all modes, and which modes are in the model."""

    time: float
    bodies: tuple[Body, ...]
    modes: tuple[tuple[int, ...], ...]


def adaptive_forward(
    scene: Scene,
    outputs: Sequence[Output | str],
    *,
    end: float,
    output_step: float,
    tolerance: float = 1e-3,
    method: str = "ros3",
    divisions: int = 4,
    start: float = 0.0,
    adaptation: Adaptation = Adaptation(),
    stabilisation: Stabilisation = Projection(),  # noqa: B008 - frozen
    policy: Policy = DEFAULT,
) -> Result:
    """Integrate a scene from `start` to `end` [s] with bodies rigid and modes absent while the outputs allow it.

    outputs   : as of `economise`; for relative tolerances their ranges are taken from one coarse run of the full model
    divisions : steps from one output row to the next
    policy    : numbers of the estimates

    The result has the states (of second-order bodies those of their mean-axis form), marker motions and energies of a forward
    run. Beside them are model.coordinates, the elastic coordinates of each body, and energy.switched, the energy that
    switches have added since the start, negative where they took some away.

    Raises InputError and ComputationError as `economise`.

    >>> result = fd.adaptive_forward(scene, ["rod.tip.position"], end=0.5, output_step=1e-3)
    """
    span, (scene, moved) = Span(start, end, output_step, stabilisation), in_new_frames(scene)
    of = probe(assemble(scene, time=start), [as_output(one, tolerance) for one in outputs], policy)
    check_meaning(of, scene, moved)
    everything = replace(full(scene, method, divisions), plane=scene.plane)
    models = _Models(span)
    bound = _bound(scene, everything, models, of, policy)
    state = _State(start, scene.bodies, tuple(() for _ in scene.bodies))
    pieces: list[_Piece] = []
    first, repeats = 0, 0
    while first < span.rows:
        count = min(adaptation.rows, span.rows - first)
        piece = _piece(scene, everything, state, models, of, bound, start + first * output_step, count, policy)
        entering = _entering(piece, bound, adaptation)
        if entering and repeats < policy.piece_repeats:
            state, repeats = _entered(piece, state, entering), repeats + 1
            continue
        pieces.append(piece)
        state = _next(scene, piece, state, bound, adaptation)
        first, repeats = first + count, 0
    return _result(scene, pieces, method, divisions, output_step)


def _bound(scene: Scene, everything: Choice, models: _Models, of: Probe, policy: Policy) -> Array:
    if all(output.absolute for output in of.outputs):
        return np.array([output.tolerance for output in of.outputs])
    coarse = replace(everything, divisions=1)
    return limits(of, ranges(run(models.at(scene, coarse, models.span.start), coarse, models.span, of).values), policy)


@dataclass(frozen=True)
class _Models:
    """The compiled models of the run, by what is modelled: a switch back to one, or the next piece, only moves it."""

    span: Span
    made: dict[tuple[Part, ...], Made] = field(default_factory=dict)

    def at(self, here: Scene, choice: Choice, time: float) -> Made:
        """The model in the state that the bodies of a scene declare, its joints closed."""
        if choice.parts not in self.made:
            self.made[choice.parts] = make(here, choice, replace(self.span, start=time))
            return self.made[choice.parts]
        made = self.made[choice.parts]
        system = made.assembled.system
        bodies = [
            _in_state(body, flat, choice.parts[b].modes)
            for b, (body, flat) in enumerate(zip(here.bodies, system.scene.bodies, strict=True))
        ]
        flat = replace(system.scene, bodies=tuple(bodies))
        rows, (x, v) = constraints_of(flat, list(system.blocks), time), initial_state(flat, system.layout)
        x = close_positions(rows, x, v)
        v = close_velocities(rows, x, v)
        return replace(made, assembled=replace(made.assembled, x=x, v=v))


def _in_state(body: Body, flat: Body, modes: tuple[int, ...]) -> Body:
    """The body of a compiled scene in the state of the scene's own, of which it has some modes."""
    there = list(modes) if flat.kept is None else [modes[k] for k in flat.kept[0]]
    return replace(
        flat,
        position=body.position,
        rotation=body.rotation,
        velocity=body.velocity,
        omega_bar=body.omega_bar,
        q=body.q[there],
        q_dot=body.q_dot[there],
    )


# ---- one piece ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Piece:
    """A piece of the run: the trial, how the full model sees it, and what each mode did or would do.

    inside, outside : columns of the modes in the model and left out, as (body, mode)
    effects         : (columns, outputs) for the modes inside, then outside;  Z : (T, V, columns) their motions
    own_q, own_rate : (T, inside) amplitudes and rates of the modes inside;  q, q_dot : (T, outside) of the oscillators
    """

    trial: Trial
    seen: Samples
    inside: tuple[tuple[int, int], ...]
    outside: tuple[tuple[int, int], ...]
    effects: Array
    Z: Array
    own_q: Array
    own_rate: Array
    q: Array
    q_dot: Array


def _piece(
    scene: Scene,
    everything: Choice,
    state: _State,
    models: _Models,
    of: Probe,
    bound: Array,
    start: float,
    count: int,
    policy: Policy,
) -> _Piece:
    here = replace(scene, bodies=state.bodies)
    choice = replace(everything, parts=tuple(Part(modes) for modes in state.modes))
    part = replace(models.span, start=start, end=start + count * models.span.output_step)
    trial = run(models.at(here, choice, start), choice, part, of, outputs=KEPT)
    large = models.at(here, everything, start)
    small, big = trial.made.assembled, large.assembled
    x, v = states(trial)
    numbers = _numbers(big.system.scene, everything)
    bases = tuple(
        np.eye(body.model.n)[list(there)][:, list(modes)]
        for body, there, modes in zip(scene.bodies, numbers, state.modes, strict=True)
    )
    seen = samples(small, big, bases, trial.result.time, x, v)
    where = {
        (b, k): seen.system.layout.q_dot(b).start + i for b, there in enumerate(numbers) for i, k in enumerate(there)
    }
    inside = tuple(key for key in where if key[1] in state.modes[key[0]])
    outside = tuple(key for key in where if key not in inside)
    D = np.eye(seen.system.layout.v_size)[:, [where[key] for key in (*inside, *outside)]]
    Z = followed(seen, D, policy)
    initial = [np.array([getattr(state.bodies[b], of_)[k] for b, k in outside]) for of_ in ("q", "q_dot")]
    q, q_dot = driven(seen, D[:, len(inside) :], Z[:, :, len(inside) :], *initial)
    own_q, own_rate = (_amplitudes(trial, scene, inside, name) for name in ("q", "q_dot"))
    sign = np.array([-1.0] * len(inside) + [1.0] * len(outside))
    amplitudes, rates = np.hstack([own_q, q]) * sign, np.hstack([own_rate, q_dot]) * sign
    effects, _ = effects_of(large.scene, of, seen, Z, amplitudes, rates, bound, policy)
    return _Piece(trial, seen, inside, outside, effects, Z, own_q, own_rate, q, q_dot)


def _amplitudes(trial: Trial, scene: Scene, inside: tuple[tuple[int, int], ...], name: str) -> Array:
    """(T, inside) amplitudes "q" or rates "q_dot" of modes of a run."""
    values = np.zeros((trial.result.time.size, len(inside)))
    for c, (b, mode) in enumerate(inside):
        at = trial.choice.parts[b].modes.index(mode)
        values[:, c] = trial.result[f"{scene.bodies[b].name}.{name}"][:, at]
    return values


def _numbers(flat: Scene, everything: Choice) -> list[tuple[int, ...]]:
    """Of each body, the numbers of the modes that the compiled scene has."""
    return [body.kept[0] if body.kept else part.modes for body, part in zip(flat.bodies, everything.parts, strict=True)]


def _shares(piece: _Piece, bound: Array) -> tuple[Array, Array]:
    share = (piece.effects / bound).max(axis=1, initial=0.0)
    return share[: len(piece.inside)], share[len(piece.inside) :]


def _entering(piece: _Piece, bound: Array, adaptation: Adaptation) -> list[int]:
    """Which of the modes outside would matter, alone or together with those that do less."""
    share = _shares(piece, bound)[1]
    order = np.argsort(share, kind="stable")
    together = np.cumsum(share[order])
    return sorted(int(k) for k, sum_ in zip(order, together, strict=True) if sum_ > adaptation.enter)


def _entered(piece: _Piece, state: _State, entering: list[int]) -> _State:
    """The state at the start of the piece with more modes in the model."""
    place = piece.seen.system.layout
    columns = [len(piece.inside) + k for k in entering]
    x, v = _shifted(piece, 0, columns, piece.q[0, entering], piece.q_dot[0, entering])
    there = {(b, k) for b, modes in enumerate(state.modes) for k in modes} | {piece.outside[k] for k in entering}
    bodies = tuple(_posed(body, place, b, x, v, body.q, body.q_dot) for b, body in enumerate(state.bodies))
    return replace(state, bodies=bodies, modes=_sorted(there, len(bodies)))


def _next(scene: Scene, piece: _Piece, state: _State, bound: Array, adaptation: Adaptation) -> _State:
    """The state at the end of a piece; modes that did little leave the model and go on as oscillators."""
    share, place = _shares(piece, bound)[0], piece.seen.system.layout
    order = np.argsort(share, kind="stable")
    leaving = [int(k) for k, s in zip(order, np.cumsum(share[order]), strict=True) if s < adaptation.leave]
    q, q_dot = ({(b, k): 0.0 for b, body in enumerate(scene.bodies) for k in range(body.model.n)} for _ in range(2))
    for values, inside, outside in ((q, piece.own_q, piece.q), (q_dot, piece.own_rate, piece.q_dot)):
        values.update(zip((*piece.inside, *piece.outside), (*inside[-1], *outside[-1]), strict=True))
    x, v = _shifted(piece, -1, leaving, -piece.own_q[-1, leaving], -piece.own_rate[-1, leaving])
    bodies = []
    for b, body in enumerate(scene.bodies):
        own = [np.array([values[b, k] for k in range(body.model.n)]) for values in (q, q_dot)]
        bodies.append(_posed(body, place, b, x, v, *own))
    there = set(piece.inside) - {piece.inside[k] for k in leaving}
    return _State(float(piece.seen.time[-1]), tuple(bodies), _sorted(there, len(bodies)))


def _shifted(piece: _Piece, row: int, columns: list[int], q: Array, q_dot: Array) -> tuple[Array, Array]:
    """(x, v) of a row, moved along columns with their amplitudes and rates."""
    place, Z = piece.seen.system.layout, piece.Z[row][:, columns]
    x = moved(place, piece.seen.x[row], Z @ q)
    V = to_body_axes(place, piece.seen.x[row], piece.seen.v[row])
    return x, to_global_axes(place, x, V + Z @ q_dot)


def _posed(body: Body, place: Layout, b: int, x: Array, v: Array, q: Array, q_dot: Array) -> Body:
    return replace(
        body,
        position=x[place.R(b)],
        rotation=x[place.p(b)],
        velocity=v[place.R_dot(b)],
        omega_bar=v[place.omega(b)],
        q=q,
        q_dot=q_dot,
    )


def _sorted(there: set[tuple[int, int]], bodies: int) -> tuple[tuple[int, ...], ...]:
    return tuple(tuple(sorted(k for body, k in there if body == b)) for b in range(bodies))


# ---- the result -----------------------------------------------------------------------------------------------------


def _result(scene: Scene, pieces: list[_Piece], method: str, divisions: int, output_step: float) -> Result:
    """All pieces, each without its first row, which is the last of the one before."""
    first = pieces[0].trial.result
    rows = [slice(0 if k == 0 else 1, None) for k in range(len(pieces))]
    time = np.concatenate([piece.trial.result.time[at] for piece, at in zip(pieces, rows, strict=True)])
    quantities = {
        name: replace(q, values=_joined(pieces, rows, name))
        for name, q in first.quantities.items()
        if not name.endswith((".q", ".q_dot")) and all(name in piece.trial.result.quantities for piece in pieces)
    }
    for b, body in enumerate(scene.bodies):
        if body.model.n:
            axis = Axis(f"{body.name}_mode", tuple(str(k + 1) for k in range(body.model.n)))
            for name, unit in (("q", "m sqrt(kg)"), ("q_dot", "m sqrt(kg)/s")):
                values = np.concatenate([_spread(p, b, body, name)[at] for p, at in zip(pieces, rows, strict=True)])
                quantities[f"{body.name}.{name}"] = Quantity(
                    values, unit, (axis,), "elastic coordinates, zero while absent"
                )
    counts = np.concatenate([_counts(p, len(time_of(p)[at])) for p, at in zip(pieces, rows, strict=True)])
    names = Axis("body", tuple(body.name for body in scene.bodies))
    quantities["model.coordinates"] = Quantity(counts, "1", (names,), "elastic coordinates in the model")
    quantities["energy.switched"] = Quantity(
        _switched(pieces, rows), "J", (), "energy that switches of the model have added"
    )
    evaluations = sum(piece.trial.evaluations for piece in pieces)
    attributes = {
        **described(scene),
        "analysis": "forward dynamics, adaptive order",
        "method": f"{method}, step {output_step / divisions:g}",
        "evaluations": evaluations,
        "notes": _notes(pieces),
        "status": "complete",
    }
    return Result(time, quantities, geometry(scene), attributes)


def time_of(piece: _Piece) -> Array:
    """(T,) of a piece."""
    return piece.trial.result.time


def _joined(pieces: list[_Piece], rows: list[slice], name: str) -> Array:
    return np.concatenate([piece.trial.result[name][at] for piece, at in zip(pieces, rows, strict=True)])


def _spread(piece: _Piece, b: int, body: Body, name: str) -> Array:
    modes = list(piece.trial.choice.parts[b].modes)
    values = np.zeros((time_of(piece).size, body.model.n))
    if modes:
        values[:, modes] = piece.trial.result[f"{body.name}.{name}"]
    return values


def _counts(piece: _Piece, rows: int) -> Array:
    return np.tile([float(part.count) for part in piece.trial.choice.parts], (rows, 1))


def _switched(pieces: list[_Piece], rows: list[slice]) -> Array:
    """(T,) sum of the changes of the energy at the switches so far: that of the new model at its start less that of the old
    one at the same time."""
    added, parts = 0.0, []
    for k, (piece, at) in enumerate(zip(pieces, rows, strict=True)):
        if k:
            added += float(piece.trial.result["energy.total"][0] - pieces[k - 1].trial.result["energy.total"][-1])
        parts.append(np.full(time_of(piece)[at].size, added))
    return np.concatenate(parts)


def _notes(pieces: list[_Piece]) -> list[str]:
    """A line for each change of the model."""
    notes, before = [], None
    for piece in pieces:
        now = [part.count for part in piece.trial.choice.parts]
        if now != before:
            notes.append(f"from t = {time_of(piece)[0]:.6g} s elastic coordinates by body: {', '.join(map(str, now))}")
        before = now
    return notes
