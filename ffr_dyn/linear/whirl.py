"""Modes of turning bodies seen from the ground: which way a point whirls, and how fast.

Of a body that turns at w about an axis, a point vibrates across it by z = u_1 + i u_2 = z_+ exp(i nu t) + z_- exp(-i nu t) in
axes that turn with the body. From the ground z is exp(i w t) times as much, so the two parts have the frequencies w + nu and
w - nu: whirls forward, with the turning, where these are positive, and backward where they are negative. In bearings that are
not the same all around a mode has parts at nu and nu + 2 w, and both a forward and a backward one at a frequency from the
ground: an ellipse. What vibrates along the axis is seen as it is. A disc that tilts moves more along the axis than across it,
but what it and its shaft do across the axis goes around one way.
(Genta 2005, Dynamics of Rotating Systems, ch. 4.)
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from ffr_dyn.equations.layout import Layout
from ffr_dyn.functions.rotation import rotation_matrix, triad
from ffr_dyn.linear.steady_state import Screws
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody
from ffr_prep.common.arrays import Array

ONE_WAY = 0.7  # of a whirl's amplitude is its larger part, from where the smaller is called a deviation
ALONG = (
    0.4  # of what moves across the axis, sections' turning included, from where what goes around neither way is axial
)
ONE_SIDED = 1e-4  # of what moves across the axis, the least that counts as going around neither way
ONE = 1e-6  # of frequencies that are one, relative to the speed
EQUAL = 1e-8  # of eigenvalues that are one, relative
LEAST = 1e-6  # of a turning relative to the fastest body's: what counts as turning


def whirls(
    scene: Scene, place: Layout, screws: Screws, x: Array, rates: Array, parts: Array
) -> tuple[Array, Array, Array]:
    """Frequencies (m,) [rad/s] seen from the ground of modes, positive where the whirl is forward; the share (m,) of their
    amplitude that has this frequency: 1 for a circle, and any whirl of an ellipse, 1/2 for a line in the turning axes; and
    the number (m,) of the body that moves most.

    rates, parts : (h, m) [rad/s] and (h, V, m) of the harmonics of each mode in the turning axes

    Modes of what does not turn, or vibrates along the axis, and those without frequency have the frequency that they have,
    and no share (nan).
    """
    each, speeds = np.arange(parts.shape[2]), np.linalg.norm(screws.w, axis=1)
    moving = np.array([_integrals(body, place, screws, x, b, parts) for b, body in enumerate(scene.bodies)])
    most = np.argmax(moving.sum(axis=(1, 2)), axis=0)
    main = np.argmax(moving[most, :, :, each].sum(axis=1), axis=1)  # of the body that moves most: others turn otherwise
    seen, share = np.abs(rates[main, each]), np.full(each.size, np.nan)
    for m in np.flatnonzero(rates[main, each]):
        b = most[m]
        forth, back, along = moving[b, ..., m]
        across = (forth + back).sum()
        either = across - np.abs(forth - back).sum()  # goes around neither way, as all that a blade does
        axial = along.sum() * max(either, ONE_SIDED * across) > ALONG * across**2
        if not axial and across > 0 and speeds[b] > LEAST * screws.fastest:
            seen[m], share[m] = _from_the_ground(speeds[b], rates[:, m], forth, back)
    return seen, share, most


def _from_the_ground(speed: float, rates: Array, forth: Array, back: Array) -> tuple[float, float]:
    """The frequency [rad/s] that most of the motion across the axis has, and its share of the amplitude."""
    found, sizes = np.concatenate([speed + rates, speed - rates]), np.concatenate([forth, back])
    same = np.abs(np.abs(found)[:, None] - np.abs(found)) <= ONE * speed
    amplitudes = np.sqrt(same @ sizes)
    groups = [k for k in range(found.size) if not same[k, :k].any()]
    best = groups[int(np.argmax(amplitudes[groups]))]
    forward = sizes[same[best] & (found > 0)].sum() >= sizes[same[best] & (found <= 0)].sum()
    frequency = float(abs(found[best]))
    return frequency if forward else -frequency, float(amplitudes[best] / amplitudes[groups].sum())


def parted(scene: Scene, place: Layout, screws: Screws, x: Array, values: Array, shapes: Array) -> Array:
    """Shapes (V, m) of vibrations at eigenvalues (m,), those at one eigenvalue as whirls forward and backward.

    Of a thin disc whose tilting about both axes is alike, both whirls have one frequency in the turning axes, and any sum of
    them is a mode. Those are wanted that have the most of one whirl and the least of the other.
    """
    if not screws.fastest:
        return shapes
    found = shapes.copy()
    upper = np.flatnonzero(values.imag > 0)
    while upper.size:
        same = np.abs(values[upper] - values[upper[0]]) <= EQUAL * np.abs(values[upper[0]])
        one, upper = upper[same], upper[~same]
        if one.size > 1:
            ways = _forms(scene, place, screws, x, shapes[:, one])
            found[:, one] = shapes[:, one] @ eigh(ways[0] - ways[1], ways.sum(axis=0))[1]
            lower = np.flatnonzero(np.abs(values - values[one[0]].conj()) <= EQUAL * np.abs(values[one[0]]))
            found[:, lower] = found[:, one].conj()
    return found


def _forms(scene: Scene, place: Layout, screws: Screws, x: Array, shapes: Array) -> Array:
    """(3, m, m) Hermitian forms of `_integrals` over all bodies, of sums of the shapes (V, m): by polarisation."""
    m = shapes.shape[1]
    i, j, k = (one.ravel() for one in np.meshgrid(range(m), range(m), range(4), indexing="ij"))
    sums = (shapes[:, i] + 1j**k * shapes[:, j])[None]
    each = [_integrals(body, place, screws, x, b, sums)[:, 0] for b, body in enumerate(scene.bodies)]
    sizes = np.sum(each, axis=0)
    found: Array = (sizes.reshape(3, m, m, 4) * (1j ** -np.arange(4))).sum(axis=-1) / 4
    return found


def ways_of(seen: Array, share: Array) -> list[str]:
    """ "forward" or "backward" of each mode, "" where it is no whirl, or one that is nearly a line in the turning axes."""
    return [
        ("forward" if one > 0 else "backward") if part > ONE_WAY else "" for one, part in zip(seen, share, strict=True)
    ]


def damping_ratios(values: Array, seen: Array, share: Array) -> Array:
    """(m,) -Re / modulus of eigenvalues (m,) [1/s], of a whirl with the frequency (m,) [rad/s] that is seen from the ground;
    1 of a decay without vibration, negative where a motion grows."""
    whirling = [bool(way) for way in ways_of(seen, share)]
    modulus = np.hypot(values.real, np.where(whirling, seen, values.imag))
    return np.where(modulus > 0, -values.real / np.where(modulus > 0, modulus, 1.0), 0.0)


def _integrals(body: Body, place: Layout, screws: Screws, x: Array, b: int, parts: Array) -> Array:
    """Integrals (3, h, m) of |z_+|^2 dm, |z_-|^2 dm and |u_3|^2 dm of a body in motions (h, V, m), turning included."""
    A, speed = rotation_matrix(x[place.p(b)]), float(np.linalg.norm(screws.w[b]))
    f, g, e = triad(A.T @ (screws.w[b] / speed)).T if speed else np.eye(3)
    modes = np.moveaxis(parts, 1, 0).reshape(parts.shape[1], -1)
    motion = modes[place.R_dot(b)], modes[place.omega(b)], modes[place.q_dot(b)]
    radius = np.sqrt(np.trace(body.model.rr_dm))
    found = [
        _integral(body.model, one, *motion) + np.abs(radius * one @ motion[1]) ** 2 for one in (f + 1j * g, f - 1j * g)
    ]
    found.append(_integral(body.model, e, *motion))
    return np.maximum(np.array(found), 0.0).reshape(3, len(parts), -1)


def _integral(model: FlexibleBody, along: Array, shift: Array, turn: Array, q: Array) -> Array:
    """(m,) of |along . u|^2 dm, u = shift + turn x x + Phi q."""
    a, t = along @ shift, np.cross(along, turn, axisb=0).T  # along . u = a + t . x + (along . Phi) q
    mean = np.conj(a) * (model.r_dm @ t) + np.conj(a) * (along @ model.P_dm @ q)
    mixed = t.conj() * (np.tensordot(model.rP_dm, along, (1, 0)) @ q)
    elastic = np.einsum("k,klij,l->ij", along, model.PP_dm, along.conj(), optimize=True)
    own = model.mass * np.abs(a) ** 2 + (t * (model.rr_dm @ t.conj())).sum(axis=0).real
    found: Array = own + 2 * (mean + mixed.sum(axis=0)).real + (q * (elastic @ q.conj())).sum(axis=0).real
    return found
