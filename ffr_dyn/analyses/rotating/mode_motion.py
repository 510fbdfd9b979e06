"""The motion of a scene in one of its modes, as a result that can be animated and plotted."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ffr_dyn.analyses.outcome import result_of
from ffr_dyn.consistency.evaluation import record_states
from ffr_dyn.consistency.tangent import Chart, sizes
from ffr_dyn.equations.layout import moved, to_global_axes
from ffr_dyn.results.result import Result
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

ROWS = 48


class Modes(Protocol):
    """The part of a `ffr_dyn.analyses.linearise.Linearisation` that is used here."""

    @property
    def eigenvalues(self) -> Array: ...
    @property
    def modes(self) -> Array: ...
    @property
    def leading(self) -> tuple[str, ...]: ...
    @property
    def near(self) -> Chart: ...


def mode_motion(found: Modes, number: int, *, size: float = 0.05) -> Result:
    """One period of a mode in 49 rows, the last as the first: poses and elastic coordinates of all bodies.

    number : of the eigenvalue, from 0, as in `found.eigenvalues`;  size : of the largest movement [rad, or of the
    scene's size]

    A mode without a vibration moves in one second to its shape and back. In a scene that turns the motion is that in
    the turning axes.

        fd.animate(fd.mode_motion(fd.linearise(scene), 0), "mode.gif", scale=1)

    Raises InputError for a number that there is not.

    >>> fd.animate(fd.mode_motion(fd.linearise(scene), 1), "mode.html")
    """
    if not 0 <= number < found.eigenvalues.size:
        raise InputError(f"mode {number}: there are modes 0 to {found.eigenvalues.size - 1}")
    near, mode, rate = found.near, found.modes[:, number], float(abs(found.eigenvalues[number].imag)) or 2 * np.pi
    mode = mode * (size / np.abs(mode / sizes(near.at)).max())
    place, phases = near.at.system.layout, np.linspace(0, 2 * np.pi, ROWS + 1)
    motion = np.array([(mode * np.exp(1j * phase)).real for phase in phases])
    speeds = np.array([(1j * rate * mode * np.exp(1j * phase)).real for phase in phases])
    x = np.array([moved(place, near.x, y) for y in motion])
    v = np.array([to_global_axes(place, there, y_dot) for there, y_dot in zip(x, speeds, strict=True)])
    record = record_states(near.at, np.full(ROWS + 1, near.time), x, v)._replace(time=phases / rate)
    attributes = {"title": found.leading[number], "analysis": "mode", "notes": [], "status": "complete"}
    return result_of(near.at.system, record, attributes)
