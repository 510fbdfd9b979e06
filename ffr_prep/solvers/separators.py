"""The smallest set of points that parts two sets of points of a graph, by Menger's theorem.

As many paths without a common point lead from the one to the other as the smallest separating set has points. The paths
are a largest flow in which every point passes one unit: it grows along shortest ways through the residual graph, in which a
point has an entry and an exit and flow may be taken back. Where no way is left, the points whose entry is reached and whose
exit is not separate.

Sources: K. Menger, Fund. Math. 10 (1927) 96-115; E. A. Dinic, Soviet Math. Dokl. 11 (1970) 1277-1280 (the flow); J. W. H.
Liu, ACM Trans. Math. Softw. 15 (1989) 198-219 (separators made smaller by flows).
"""

from __future__ import annotations

import numba
import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.compile_cache import check_compiled_code

check_compiled_code()

_NONE, _END = -1, -2
_BELOW, _ABOVE = -2, -3
_IN, _OUT = 0, 1


def separated(
    indptr: Array, indices: Array, ordered: Array, low: int, high: int, place: Array
) -> tuple[Array, Array, Array]:
    """The points `ordered` of a graph in two parts that do not touch, and what separates them, a smallest set of points
    low...high of these. Points before that touch points behind belong to it beside.

    indptr, indices : neighbours of all points of the graph; place (N,) : for work, all -1, and stays
    """
    below, above = ordered[:low], ordered[high:]
    place[below], place[above] = _BELOW, _ABOVE
    touching = below[_touching(indptr, indices, below, place)]
    band = np.concatenate([touching, ordered[low:high]])
    place[band] = np.arange(band.size)
    start, stop, steps, back = _reached(indptr, indices, band, place, touching)
    below = below[place[below] == _BELOW]
    place[ordered] = _NONE
    first, other = _parts(below, band, above, start, steps), _parts(above, band, below, stop, back)
    return min(first, (other[1], other[0], other[2]), key=lambda parts: abs(len(parts[0]) - len(parts[1])))


@numba.njit(cache=True, nogil=True)
def narrowest(indptr, indices, ordered, low, high, place):  # type: ignore[no-untyped-def]
    """How many of the points `ordered` come before the cut low...high that fewest points before touch points behind, of equal
    ones the one nearest to the middle; the other arguments as of `separated`."""
    size = ordered.size
    place[ordered] = np.arange(size)
    change = np.zeros(size + 1, np.int64)
    for i in range(size):
        last = i
        for e in range(indptr[ordered[i]], indptr[ordered[i] + 1]):
            last = max(last, place[indices[e]])
        change[i + 1] += 1  # touches points behind every cut from here on
        change[last + 1] -= 1  # to the last point that it touches
    place[ordered] = _NONE
    touching = np.cumsum(change)
    best = low
    for cut in range(low, high + 1):
        fewer = touching[cut] < touching[best]
        if fewer or (touching[cut] == touching[best] and abs(2 * cut - size) < abs(2 * best - size)):
            best = cut
    return best


def _parts(this: Array, band: Array, other: Array, start: Array, steps: Array) -> tuple[Array, Array, Array]:
    """The parts on this side and on the other, and the separator, of what a residual graph reaches from this side."""
    own = steps[:, _OUT] >= 0
    separator = (start | (steps[:, _IN] >= 0)) & ~own
    return (
        np.sort(np.concatenate([this, band[own]])),
        np.sort(np.concatenate([other, band[~own & ~separator]])),
        np.sort(band[separator]),
    )


@numba.njit(cache=True, nogil=True)
def _touching(indptr, indices, below, place):  # type: ignore[no-untyped-def]
    """(p,) which of the points below touch one above."""
    found = np.zeros(below.size, np.bool_)
    for i in range(below.size):
        for e in range(indptr[below[i]], indptr[below[i] + 1]):
            if place[indices[e]] == _ABOVE:
                found[i] = True
                break
    return found


@numba.njit(cache=True, nogil=True)
def _within(indptr, indices, band, place):  # type: ignore[no-untyped-def]
    """Neighbours of the points of the band within it, as of a sparse matrix, and which touch points below and above."""
    ends = np.zeros(band.size + 1, np.int32)
    near = np.empty(np.sum(indptr[band + 1] - indptr[band]), np.int32)
    start, stop = np.zeros(band.size, np.bool_), np.zeros(band.size, np.bool_)
    for i in range(band.size):
        ends[i + 1] = ends[i]
        for e in range(indptr[band[i]], indptr[band[i] + 1]):
            p = place[indices[e]]
            start[i] |= p == _BELOW
            stop[i] |= p == _ABOVE
            if p >= 0 and p != i:
                near[ends[i + 1]] = p
                ends[i + 1] += 1
    return ends, near, start, stop


@numba.njit(cache=True, nogil=True)
def _reached(indptr, indices, band, place, touching):  # type: ignore[no-untyped-def]
    """(m,) which points of the band are at the start, next to points below, and at the stop, next to points above; (m, 2)
    steps in the residual graph of a largest flow from the start, and backwards from the stop."""
    ends, near, start, stop = _within(indptr, indices, band, place)
    start[place[touching]] = True
    before, after = np.full(start.size, _NONE, np.int32), np.full(start.size, _NONE, np.int32)
    while True:
        back = _steps(ends, near, stop, start, after, before)
        if not _augment(ends, near, start, stop, before, after, back):
            break
    return start, stop, _steps(ends, near, start, stop, before, after), back


@numba.njit(cache=True, nogil=True)
def _steps(ends, near, start, stop, before, after):  # type: ignore[no-untyped-def]
    """(m, 2) how many steps lead from the start to the entry and exit of each point, -1 where none do."""
    steps = np.full((start.size, 2), _NONE, np.int32)
    queue = np.empty((2 * start.size, 2), np.int32)
    head = tail = 0
    for i in range(start.size):
        if start[i] and before[i] != _END:
            steps[i, _IN] = 0
            queue[tail] = i, _IN
            tail += 1
    while head < tail:
        i, side = queue[head]
        head += 1
        for choice in range(_choices(ends, i, side)):
            j, entry = _way(ends, near, before, i, side, choice)
            if j >= 0 and steps[j, entry] < 0:
                steps[j, entry] = steps[i, side] + 1
                queue[tail] = j, entry
                tail += 1
    return steps


@numba.njit(cache=True, inline="always")
def _choices(ends, i, side):  # type: ignore[no-untyped-def]
    return 1 if side == _IN else ends[i + 1] - ends[i] + 1


@numba.njit(cache=True, inline="always")
def _way(ends, near, before, i, side, choice):  # type: ignore[no-untyped-def]
    """Where a choice leads from the entry or exit of a point: the other point, or _NONE, and its side."""
    if side == _IN:
        if before[i] == _NONE:
            return i, _OUT  # nothing passes it yet
        return before[i], _OUT  # what passes is taken back to the point before; negative where there is none
    if choice < ends[i + 1] - ends[i]:
        return near[ends[i] + choice], _IN
    return (_NONE if before[i] == _NONE else i), _IN  # nothing passes it any more


@numba.njit(cache=True, nogil=True)
def _augment(ends, near, start, stop, before, after, back):  # type: ignore[no-untyped-def]
    """Send flow along ways that come nearer to the stop with every step; each entry and exit is tried once. Whether any is
    sent. back (m, 2) : steps backwards from the stop, to the exit of each point and to its entry
    """
    tried = np.zeros((start.size, 2), np.bool_)
    way = np.empty((2 * start.size + 1, 2), np.int32)
    choices = np.empty(2 * start.size + 1, np.int32)
    sent = False
    for first in range(start.size):
        height = (
            0 if start[first] and before[first] != _END and back[first, _OUT] >= 0 and not tried[first, _IN] else -1
        )
        way[0] = first, _IN
        choices[0] = 0
        while height >= 0:
            i, side = way[height]
            if back[i, 1 - side] == 0:
                _send(way, height, before, after)
                sent = True
                break
            if choices[height] == _choices(ends, i, side):
                height -= 1
                continue
            j, entry = _way(ends, near, before, i, side, choices[height])
            choices[height] += 1
            if j >= 0 and back[j, 1 - entry] == back[i, 1 - side] - 1 and not tried[j, entry]:
                tried[j, entry] = True
                height += 1
                way[height] = j, entry
                choices[height] = 0
    return sent


@numba.njit(cache=True, nogil=True)
def _send(way, height, before, after):  # type: ignore[no-untyped-def]
    """One unit of flow along a way."""
    before[way[0, 0]] = _END
    for step in range(1, height + 1):
        last, point = way[step - 1, 0], way[step, 0]
        if way[step, 1] == _IN:
            if last == point:
                before[point], after[point] = _NONE, _NONE
            else:
                after[last], before[point] = point, last
    after[way[height, 0]] = _END
