"""Rows of a result that are coarser than the motion they sample show another motion."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.forward import forward
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.integrators import ROS3
from ffr_dyn.results.result import Result
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.bodies import beam
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Panel, Proof
from ffr_prep.common.arrays import Array

OUTPUT = "beam.q"
TURNS = 40  # of the first mode
FEW, ALIASED, ENOUGH = 2.5, 10 / 9, 25.0  # rows a turn


def plucked() -> Scene:
    """A cantilever let go from a bend in its first mode."""
    model = beam("beam", 1.0, 1.0, 100.0, 3)
    return Scene(
        (Body("beam", model, q=(1e-3, 0.0, 0.0)),),
        (Joint("clamp", "fixed", "ground.O", "beam.a"),),
        ground={"O": (0, 0, 0)},
        plane="z",
    )


def coarse_rows() -> Exhibit:
    """One vibration in rows 25, 2.5 and 10/9 times a turn."""
    scene = plucked()
    first = float(np.abs(linearise(scene).eigenvalues.imag).min()) / (2 * np.pi)

    def rows(count: float) -> Result:
        spacing = 1 / (count * first)
        steps = round(200 / count)
        return forward(
            scene,
            end=round(TURNS * count) * spacing,
            output_step=spacing,
            method=ROS3(spacing / steps),
            outputs=["beam.q", "beam.q_dot"],
        )

    runs = {count: rows(count) for count in (ENOUGH, FEW, ALIASED)}
    told = {count: any("too coarse" in note for note in run.attributes["notes"]) for count, run in runs.items()}
    seen = {count: run[OUTPUT][:, 0] for count, run in runs.items()}
    return Exhibit(
        "Rows coarser than the motion",
        "a vibration in 10/9 rows a turn looks like one of a ninth of its rows' rate; 2.5 rows a turn show a zigzag",
        "rows every twentieth of a turn; a run tells rows that are off what values and rates of their neighbours say",
        (
            Claim(
                "frequency in 10/9 rows a turn", first / 9, _frequency(runs[ALIASED].time, seen[ALIASED]), 1.05, "Hz"
            ),
            Claim("frequency in 25 rows a turn", first, _frequency(runs[ENOUGH].time, seen[ENOUGH]), 1.01, "Hz"),
        ),
        (
            Proof("2.5 rows a turn: told to be too coarse (1)", float(told[FEW]), 0.5, True),
            Proof("10/9 rows a turn: told to be too coarse (1)", float(told[ALIASED]), 0.5, True),
            Proof("25 rows a turn: told to be too coarse (1)", float(told[ENOUGH]), 0.5, False),
        ),
        (
            Panel(
                f"a cantilever at {first:.3g} Hz",
                "time [s]",
                "first mode [m sqrt(kg)]",
                tuple(
                    Curve(f"{count:.3g} rows a turn", *_until(runs[count].time, seen[count], 10 / first))
                    for count in runs
                ),
            ),
        ),
    )


def _frequency(time: Array, y: Array) -> float:
    """[Hz] by the times of the first and last rise through zero."""
    rises = np.flatnonzero((y[:-1] < 0) & (y[1:] >= 0))
    at = time[rises] - y[rises] * (time[rises + 1] - time[rises]) / (y[rises + 1] - y[rises])
    return float((at.size - 1) / (at[-1] - at[0]))


def _until(time: Array, y: Array, end: float) -> tuple[Array, Array]:
    return time[time <= end], y[time <= end]
