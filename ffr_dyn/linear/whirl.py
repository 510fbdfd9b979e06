"""Modes of turning bodies seen from the ground: which way a point whirls, and how fast.

Of a body that turns at w about an axis, a point vibrates across it by z = u_1 + i u_2 = z_+ exp(i nu t) + z_- exp(-i nu t) in
axes that turn with the body. From the ground z is exp(i w t) times as much, so the two parts have the frequencies w + nu and
w - nu: whirls forward, with the turning, where these are positive, and backward where they are negative.
(Genta 2005, Dynamics of Rotating Systems, ch. 4.)
"""

from __future__ import annotations

import numpy as np

from ffr_dyn.equations.layout import Layout
from ffr_dyn.functions.rotation import rotation_matrix, triad
from ffr_dyn.linear.steady_state import Screws
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.common.arrays import Array

ONE_WAY = 0.7  # of a whirl's amplitude is its larger part, from where the smaller is called a deviation
LEAST = 1e-6  # of a turning relative to the fastest body's: what counts as turning


def whirls(scene: Scene, place: Layout, screws: Screws, x: Array, values: Array, modes: Array) -> tuple[Array, Array]:
    """Frequencies (m,) [rad/s] seen from the ground of modes (V, m) with eigenvalues (m,), positive where the whirl
    is forward; and the share (m,) of their amplitude that whirls that way: 1 for a circle, 1/2 for a line in the
    turning axes.

    Modes of what does not turn, and of real eigenvalues, have the frequency that they have, and no share (nan).
    """
    seen, share = np.abs(values.imag), np.full(values.size, np.nan)
    for m, (value, mode) in enumerate(zip(values, modes.T, strict=True)):
        if not value.imag:
            continue
        mode = mode if value.imag > 0 else mode.conj()
        parts = np.array([_parts(body, place, screws, x, b, mode) for b, body in enumerate(scene.bodies)])
        b = int(np.argmax(parts.sum(axis=1)))
        forth, back = np.sqrt(parts[b])
        speed = float(np.linalg.norm(screws.w[b]))
        if forth + back <= 0 or speed <= LEAST * screws.fastest or not speed:
            continue
        seen[m] = speed + seen[m] if forth >= back else speed - seen[m]
        share[m] = max(forth, back) / (forth + back)
    return seen, share


def ways_of(seen: Array, share: Array) -> list[str]:
    """ "forward" or "backward" of each mode, "" where it is no whirl, or one that is nearly a line in the turning axes."""
    return [
        ("forward" if one > 0 else "backward") if part > ONE_WAY else "" for one, part in zip(seen, share, strict=True)
    ]


def _parts(body: Body, place: Layout, screws: Screws, x: Array, b: int, mode: Array) -> tuple[float, float]:
    """|z_+|^2 and |z_-|^2 of a body, summed over its points and its turning, with its mass."""
    A, speed = rotation_matrix(x[place.p(b)]), float(np.linalg.norm(screws.w[b]))
    f, g = triad(A.T @ (screws.w[b] / speed))[:, :2].T if speed else np.eye(3)[:2]
    shift, turn, q = mode[place.R_dot(b)], mode[place.omega(b)], mode[place.q_dot(b)]
    model, surface = body.model, body.model.surface
    known = surface is not None and surface.Phi.shape[2] == q.size
    points = surface.points if known and surface is not None else np.array([model.r_dm / model.mass])
    u = shift + np.cross(turn, points)
    if known and surface is not None and q.size:
        u = u + surface.Phi @ q
    radius = np.sqrt(np.trace(model.rr_dm) / model.mass)
    c = np.concatenate(
        [np.stack([u @ f, u @ g]) / np.sqrt(len(points)), radius * np.array([[turn @ f], [turn @ g]])], 1
    )
    return (
        float(model.mass * (np.abs(c[0] + 1j * c[1]) ** 2).sum()),
        float(model.mass * (np.abs(c[0] - 1j * c[1]) ** 2).sum()),
    )
