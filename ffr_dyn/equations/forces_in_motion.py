"""Forces that see velocities, in a steady motion: what the velocities add to forces, tangent and damping.

A force f(c, c_dot) on coordinates c of two markers, whose small motions mu (12,) and velocities m (12,) in their
screws R_dot = u + w x R are as in `ffr_dyn.equations.jets`, has the rate c_dot = g m, g and S the first and second
derivatives of c. As the markers move, g changes by S mu less half of what the order of turns makes (S is symmetric),
and m by w x the motion:

    d c_dot = m S mu - 1/2 g_r . (mu_r x m_r) + g_t . (w x mu_t)
"""

from __future__ import annotations

import numpy as np

from ffr_dyn.equations.forces import At
from ffr_dyn.equations.forces_at_rest import STEP, differences, law_on, steps_of
from ffr_dyn.equations.jets import FIRST, SECOND, coordinates, pair_motion
from ffr_dyn.equations.placed import Sums, pair
from ffr_dyn.scene.forces.force import Force
from ffr_prep.common.arrays import Array

CANCELS = 1e-9  # of the velocities that a rate is made of: what is left of ends that turn alike is rounding


def add_velocities(total: Sums, damping: Array, now: At, force: Force, screws: tuple[Array, Array]) -> None:
    """Add the part of the velocities of two markers in their screws (u (2, 3), w (2, 3)) to forces, their tangent, and the
    damping (V, V), of a force on coordinates whose law sees these and their rates alone."""
    ends = force.place.ends(now.scene)
    both = [total.placed[number] for number in ends]
    jets = coordinates(now.scene, pair(*both), force.place)
    if not jets:
        return
    c, still = np.array([float(jet.value) for jet in jets]), np.zeros(len(jets))
    g, S = np.array([jet.first for jet in jets]), np.array([jet.second for jet in jets])
    m = pair_motion(both[0].r, both[1].r, *screws)
    rate, by_motion = g @ m, S @ m
    rate[np.abs(rate) <= CANCELS * (np.abs(g) @ np.abs(m))] = 0.0  # steps beside rounding would make differences of it
    for at, w in ((FIRST, screws[1][0]), (SECOND, screws[1][1])):
        shift, turn = slice(at, at + 3), slice(at + 3, at + 6)
        by_motion[:, shift] += np.cross(g[:, shift], w)
        by_motion[:, turn] -= 0.5 * np.cross(m[turn], g[:, turn])

    def added(step: Array) -> Array:
        return law_on(force, now, c + step, rate) - law_on(force, now, c + step, still)

    unit = float(np.abs(rate).max()) or 1.0  # of differences of the rates, beside which the law is nearly straight

    def by_rate(of: Array) -> Array:
        return differences(lambda rate: law_on(force, now, c, of + rate), np.full(c.size, STEP * unit))

    extra, slopes = added(still), differences(added, steps_of(now, jets, c))
    moving, resting = by_rate(rate), by_rate(still)
    second = g.T @ slopes @ g + g.T @ moving @ by_motion + np.tensordot(extra, S, 1)
    total.add_on_pair(ends, extra @ g, second)
    along = total.gradient(ends, g)
    damping -= along.T @ (moving - resting) @ along
