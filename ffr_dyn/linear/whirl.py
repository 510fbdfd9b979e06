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
from ffr_prep.body import FlexibleBody
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
    modes = np.where(values.imag > 0, modes, modes.conj())
    parts = np.array([_parts(body, place, screws, x, b, modes) for b, body in enumerate(scene.bodies)])
    for m in np.flatnonzero(values.imag):
        b = int(np.argmax(parts[:, :, m].sum(axis=1)))
        forth, back = np.sqrt(parts[b, :, m])
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


def _parts(body: Body, place: Layout, screws: Screws, x: Array, b: int, modes: Array) -> Array:
    """Integrals (2, m) of |z_+|^2 dm and |z_-|^2 dm of a body in modes (V, m), and the same of its turning."""
    A, speed = rotation_matrix(x[place.p(b)]), float(np.linalg.norm(screws.w[b]))
    f, g = triad(A.T @ (screws.w[b] / speed))[:, :2].T if speed else np.eye(3)[:2]
    motion = modes[place.R_dot(b)], modes[place.omega(b)], modes[place.q_dot(b)]
    found: Array = np.array([_integral(body.model, along, *motion) for along in (f + 1j * g, f - 1j * g)])
    return np.maximum(found, 0.0)


def _integral(model: FlexibleBody, along: Array, shift: Array, turn: Array, q: Array) -> Array:
    """(m,) of |along . u|^2 dm, u = shift + turn x x + Phi q, and of |along . turn|^2 at the radius of gyration."""
    a, t = along @ shift, np.cross(along, turn, axisb=0).T  # along . u = a + t . x + (along . Phi) q
    mean = np.conj(a) * (model.r_dm @ t) + np.conj(a) * (along @ model.P_dm @ q)
    mixed = t.conj() * (np.tensordot(model.rP_dm, along, (1, 0)) @ q)
    elastic = np.einsum("k,klij,l->ij", along, model.PP_dm, along.conj(), optimize=True)
    own = model.mass * np.abs(a) ** 2 + (t * (model.rr_dm @ t.conj())).sum(axis=0).real
    turned = np.trace(model.rr_dm) * np.abs(along @ turn) ** 2
    found: Array = own + turned + 2 * (mean + mixed.sum(axis=0)).real + (q * (elastic @ q.conj())).sum(axis=0).real
    return found
