"""Mass matrix and forces of one body from its inertia integrals, in the form one would write on paper.

In body axes, for the accelerations [a = A^T R_ddot, omega_bar_dot, q_ddot] (Shabana 2013, ch. 5, with body-frame
velocities, so that M depends on q alone):

    s = I2 + I3 q                   first moment of the deformed body
    G_j = int u phi_j^T dm          H_j = int u x phi_j dm
    J = tr(W) I - W,  W = int u u^T dm
    D = int u u_dot^T dm            L_j = int u_dot x phi_j dm

The second-order part u_2 of a body (`ffr_dyn.equations.second_order`, mean-axis form) adds to W what int u_0 u_2^T dm says
and so to G: the integral PP_dm has X added to it, and nothing else changes. T holds all terms up to second order in q and
q_dot then, but those of int phi_i . u_2 dm, which would make the elastic block depend on q.

The compiled form, which the tests hold equal to this one, is `ffr_dyn.kernels.bodies`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.equations.second_order import second_moments
from ffr_dyn.functions.rotation import skew
from ffr_dyn.scene.scene import INERTIA_TERMS, Body
from ffr_prep.body import FlexibleBody, axial, remembered
from ffr_prep.common.arrays import Array


@dataclass(frozen=True)
class Integrals:
    """The integrals of a body as its equations have them; names as of `FlexibleBody`."""

    mass: float
    r_dm: Array
    rr_dm: Array
    P_dm: Array
    rP_dm: Array
    PP_dm: Array
    omega2: Array
    I5: Array
    I6: Array
    damping: Array | None


def kept_integrals(body: Body) -> Integrals:
    """The integrals of a body of a scene: X of its second-order part is in PP_dm, and the terms that it drops are left out.

    I4 and I5 are the skew parts of rP_dm and PP_dm, I8 and I9 the symmetric ones; X stays without I9.
    """
    return remembered(body.model, ("integrals", body.dropped, body.stiffening), lambda: _kept_integrals(body))


def _kept_integrals(body: Body) -> Integrals:
    model = body.model
    if not model.n:
        none = model.P_dm, model.rP_dm, model.PP_dm, model.omega2, np.zeros((3, 0, 0)), np.zeros((0, 0))
        return Integrals(model.mass, model.r_dm, model.rr_dm, *none, model.damping)
    kept = {term: float(term not in body.dropped) for term in INERTIA_TERMS}
    rP, PP = (
        symmetric * 0.5 * (part + np.swapaxes(part, 0, 1)) + skewed * 0.5 * (part - np.swapaxes(part, 0, 1))
        for part, symmetric, skewed in ((model.rP_dm, kept["I8"], kept["I4"]), (model.PP_dm, kept["I9"], kept["I5"]))
    )
    P, I5 = kept["I3"] * model.P_dm, kept["I5"] * model.I5
    PP = PP + second_moments(body)
    for part in (rP, PP, P, I5):
        part.setflags(write=False)
    return Integrals(model.mass, model.r_dm, model.rr_dm, P, rP, PP, model.omega2, I5, model.I6, model.damping)


@dataclass(frozen=True)
class Moments:
    """s (3,), G (3, 3, n), W (3, 3) of the deformed body."""

    s: Array
    G: Array
    W: Array


def moments(body: FlexibleBody | Integrals, q: Array) -> Moments:
    """Moments of the mass of the body deformed by q (n,). Equation (10) of docs/notation.md."""
    if not q.size:
        return Moments(body.r_dm, body.rP_dm, body.rr_dm)
    G = body.rP_dm + np.einsum("klij,i->klj", body.PP_dm, q)
    rest = np.einsum("klj,j->kl", body.rP_dm, q)
    W = body.rr_dm + rest.T + np.einsum("klj,j->kl", G, q)  # int u u0^T + int u (Phi q)^T
    return Moments(body.r_dm + body.P_dm @ q, G, W)


def inertia_tensor(moment: Moments) -> Array:
    """(3, 3) J of the deformed body about the origin of its frame. Equation (11) of docs/notation.md."""
    W = moment.W
    return (W[0, 0] + W[1, 1] + W[2, 2]) * np.eye(3) - W


def mass_matrix(body: FlexibleBody | Integrals, q: Array) -> Array:
    """(6 + n, 6 + n) mass matrix at q (n,), body axes. Equation (12) of docs/notation.md."""
    moment = moments(body, q)
    M, s = np.zeros((6 + q.size, 6 + q.size), moment.W.dtype), skew(moment.s)
    M[:3, :3].flat[::4] = body.mass
    M[:3, 3:6], M[3:6, :3], M[3:6, 3:6] = -s, s, inertia_tensor(moment)
    if not q.size:
        return M
    M[:3, 6:], M[3:6, 6:] = body.P_dm, axial(moment.G)
    M[6:, :6], M[6:, 6:] = M[:6, 6:].T, body.I6
    return M


def quadratic_velocity(body: FlexibleBody | Integrals, q: Array, omega: Array, q_dot: Array) -> Array:
    """(6 + n,) quadratic velocity forces Q_v at q, omega (3,) in body axes, q_dot (n,).

    Equation (13) of docs/notation.md.
    """
    moment = moments(body, q)
    J = inertia_tensor(moment)
    D = np.einsum("klj,j->kl", moment.G, q_dot)
    L = np.einsum("cij,i->cj", body.I5, q_dot)
    return np.concatenate([
        -np.cross(omega, np.cross(omega, moment.s)) - 2 * np.cross(omega, body.P_dm @ q_dot),
        -np.cross(omega, J @ omega) - 2 * (np.trace(D) * omega - D.T @ omega),
        -np.einsum("k,klj,l->j", omega, moment.G, omega) + omega @ omega * np.einsum("kkj->j", moment.G) - 2 * omega @ L,
    ])  # fmt: skip


def elastic_force(body: FlexibleBody | Integrals, damping: Array, q: Array, q_dot: Array) -> Array:
    """(6 + n,) elastic and damping forces; damping (n,) ratios. Equation (14) of docs/notation.md."""
    return np.concatenate([np.zeros(6), -body.omega2 * q - damping_matrix(body, damping) @ q_dot])


def damping_matrix(body: FlexibleBody | Integrals, ratios: Array) -> Array:
    """(n, n) [1/s] of the ratios (n,) of a scene and of the matrix that the body has."""
    own = np.diag(2 * ratios * np.sqrt(body.omega2))
    return own if body.damping is None else own + body.damping


def gravity_force(body: FlexibleBody | Integrals, q: Array, A: Array, gravity: Array) -> Array:
    """(6 + n,) force of a uniform field gravity (3,) [m/s^2], global. Equation (15) of docs/notation.md."""
    field = A.T @ gravity
    return np.concatenate([body.mass * field, np.cross(body.r_dm + body.P_dm @ q, field), body.P_dm.T @ field])


def energies(
    body: FlexibleBody | Integrals, R: Array, A: Array, q: Array, y: Array, gravity: Array
) -> tuple[float, float, float]:
    """Kinetic, strain and gravity energy [J] at R (3,), A (3, 3), q (n,), y (6 + n,) = [A^T R_dot, omega_bar, q_dot].

    Equation (16) of docs/notation.md.

    gravity : (3,) [m/s^2], global; its energy is zero where the mass is in the origin
    """
    s = body.r_dm + body.P_dm @ q
    kinetic, strain = 0.5 * y @ mass_matrix(body, q) @ y, 0.5 * body.omega2 @ q**2
    return float(kinetic), float(strain), float(-gravity @ (body.mass * R + A @ s))
