"""Assembly as an analysis: the consistent start of a scene as a result of one row, and what was changed for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ffr_dyn.analyses.integration import with_all_reactions
from ffr_dyn.analyses.outcome import needed, result_of
from ffr_dyn.analyses.registry import OfMoment
from ffr_dyn.analyses.settings import MomentSettings
from ffr_dyn.consistency.assemble import Assembled, assemble, turned
from ffr_dyn.consistency.doubts import checked
from ffr_dyn.consistency.evaluation import evaluator, record_states
from ffr_dyn.equations.layout import initial_state
from ffr_dyn.kernels.tables import EVALUATIONS
from ffr_dyn.results.quantities import selected
from ffr_dyn.results.result import Result
from ffr_dyn.scene.described import described
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array

CHANGED = 1e-9  # m, rad, m/s, rad/s and elastic coordinates, from where a change is told


@dataclass(frozen=True)
class Assemble(OfMoment):
    """Corrections are the smallest in the norm of the mass matrix: heavy bodies move least.

    >>> result = fd.run(scene, fd.MomentSettings(analysis=fd.Assemble()))
    """

    def perform(self, scene: Scene, settings: MomentSettings, **how: Any) -> Result:
        return assembly(scene, **settings.span, **how)


def assembly(
    scene: Scene, *, time: float = 0.0, outputs: Sequence[str] = ("default",), path: str | Path | None = None
) -> Result:
    """Positions and velocities of a scene at `time` [s] that meet its joints and drivers: one row, with all reactions.

    outputs : names or patterns of the quantities to keep, as in `forward`

    The notes tell what was changed of each body: by how much it was shifted and turned, and its velocities.

    Raises InputError as `assemble` does, ComputationError when there are no accelerations.

    >>> result = fd.assembly(scene)
    """
    assembled = assemble(scene, time=time)
    selected(assembled.system, needed(scene, outputs))
    at = evaluator(assembled.system)
    rows = record_states(at, np.array([time]), assembled.x[None], assembled.v[None])
    record = with_all_reactions(assembled, rows)
    notes = [note for note in assembled.notes if not note.startswith(("assembly moved", "assembly turned"))]
    attributes = {
        **described(scene),
        "analysis": "assembly",
        "method": "smallest changes in the norm of the mass matrix",
        "evaluations": int(at.work.info[EVALUATIONS]),
        "degrees_of_freedom": assembled.degrees_of_freedom,
        "computed": assembled.computed,
        "notes": [*changes(assembled), *notes, *checked("assemble", assembled, record)],
        "status": "complete",
    }
    return result_of(assembled.system, record, attributes, path, outputs)


def changes(assembled: Assembled) -> list[str]:
    """The changes that assembly made to each body, in words; one line where it changed nothing."""
    scene, place = assembled.system.scene, assembled.system.layout
    x, v = initial_state(scene, place)
    found = []
    for b, body in enumerate(scene.bodies):
        sizes = {
            "position by {:.4g} m": _change(assembled.x, x, place.R(b)),
            "attitude by {:.4g} rad": turned(assembled.x[place.p(b)], x[place.p(b)]),
            "elastic coordinates by {:.4g}": _change(assembled.x, x, place.q(b)),
            "velocity by {:.4g} m/s": _change(assembled.v, v, place.R_dot(b)),
            "angular velocity by {:.4g} rad/s": _change(assembled.v, v, place.omega(b)),
            "elastic rates by {:.4g}": _change(assembled.v, v, place.q_dot(b)),
        }
        words = [text.format(size) for text, size in sizes.items() if size > CHANGED]
        if words:
            found.append(f"body {body.name!r} was changed: {', '.join(words)}")
    return found or ["nothing was changed: the scene is assembled as it stands"]


def _change(now: Array, before: Array, where: slice) -> float:
    return float(np.linalg.norm(now[where] - before[where]))
