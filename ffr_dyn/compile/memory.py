"""Python functions of a scene that remember what they were called with before.

A run calls them several times in a step and again for its rows, and the runs that tell its error call them at the same time.
What a function keeps between calls is then of no one motion. So each is called at a state, elsewhere, and at the state again;
and at rows of a motion, forth and back.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ffr_dyn.compile.force_tables import Callback
from ffr_dyn.compile.scene_tables import UserFunctions
from ffr_dyn.equations.state_view import StateView
from ffr_dyn.functions.rotation import product
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

LATER = (1e-4, 1e-2, 1.0, 100.0)  # s, at which it is called between
ASIDE = 0.1  # of the size of a body, rad, m/s and rad/s: how far from the state
LOOKED = 17  # rows at which it is called
SAME = 1e-6  # of what a function gives

Place = tuple[float, Array, Array]  # time [s], x, v


def check_memory(user: UserFunctions, time: float, x: Array, v: Array) -> None:
    """Raises InputError for the first function that gives other numbers at the state than it gave there before."""
    here = time, x, v
    for callback in user.callbacks:
        first = _given(user, callback, [here])
        _given(user, callback, _elsewhere(user, here))
        _compare(callback, first, _given(user, callback, [here]))


def check_repeats(user: UserFunctions, times: Array, x: Array, v: Array) -> None:
    """The same of rows (T,), (T, X), (T, V) of a motion, called forth and back."""
    rows = np.unique(np.linspace(0, times.size - 1, LOOKED).round().astype(int)).tolist()
    places = [(float(times[k]), x[k], v[k]) for k in rows]
    for callback in user.callbacks if len(places) > 1 else ():
        first = _given(user, callback, places)
        _given(user, callback, _elsewhere(user, places[-1]))
        _compare(callback, first, _given(user, callback, places[::-1])[::-1])


def _given(user: UserFunctions, callback: Callback, places: Iterable[Place]) -> list[Array]:
    """What a function gives; no numbers where it raises something, which a run tells where it comes there."""
    found = []
    for t, x, v in places:
        arguments = (t, StateView(user.scene, user.place, x, v)) if callback.with_state else (t,)
        try:
            with np.errstate(all="ignore"):
                found.append(np.array(callback.function(*arguments), float).ravel())
        except Exception:
            found.append(np.zeros(0))
    return found


def _compare(callback: Callback, first: list[Array], again: list[Array]) -> None:
    largest = max((float(np.abs(of).max(initial=0.0)) for of in (*first, *again)), default=0.0)
    for before, now in zip(first, again, strict=True):
        if before.size == now.size > 0 and np.abs(now - before).max() > SAME * largest:
            raise InputError(
                f"{callback.what}: its Python function keeps something of its own between calls: for one time and state it "
                f"has given {np.array2string(before, precision=6)}, then {np.array2string(now, precision=6)}. A run calls it "
                "several times in a step, and the runs that tell the error do, too: let it depend on time and state alone. A "
                "controller that samples or remembers sets an input, fd.signal, from a Stepper"
            )


def _elsewhere(user: UserFunctions, here: Place) -> list[Place]:
    """Later and later, and farther and farther away: moved, turned, faster."""
    (time, x, v), place, found = here, user.place, list[Place]()
    for k, later in enumerate(LATER, 1):
        x = x.copy()
        turn = np.array([1.0, *(0.5 * k * ASIDE * np.array([0.36, 0.48, 0.8]))])
        for b, body in enumerate(user.scene.bodies):
            x[place.R(b)] += k * ASIDE * (body.model.size or 1.0)
            x[place.p(b)] = product(x[place.p(b)], turn / np.linalg.norm(turn))
        found.append((time + later, x, v + k * ASIDE))
    return found
