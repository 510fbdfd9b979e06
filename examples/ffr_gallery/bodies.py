"""Bodies and scenes of the gallery: slender beams in a plane by Rayleigh and Ritz, and rigid bars."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.polynomial import Legendre

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.results.result import Result
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, Interface, Surface, rigid_body
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import ComputationError

GRAVITY = (0.0, -9.81, 0.0)
POINTS = 30  # of the quadrature: exact for the polynomials that are used


def beam(
    name: str, length: float, density: float, bending: float, modes: int, *, held: str = "root", spare: int = 6
) -> FlexibleBody:
    """A slender beam along x that bends in the x-y plane, with geometric stiffening by its axial force.

    density : mass per length [kg/m];  bending : EI [N m^2]
    held    : by its frame: "root" clamped at interface "a", or "ends" on both interfaces "a" and "b"; "m" is the middle
    spare   : shapes beyond `modes`: with six the last frequencies are right to 1e-3; with none, and two modes or more, a
              force and a moment at the end bend it exactly

    The shapes are x^2 or x (L - x) times polynomials, made orthogonal by the eigenvalue problem of stiffness and mass. The
    axial forces of an acceleration along x, of rotation about y and z, and of a force at "b" stiffen (root held).
    """
    at, weight = np.polynomial.legendre.leggauss(POINTS)
    s, w = 0.5 * (at + 1), 0.5 * weight * length
    shapes = [_shape(held, k) for k in range(modes + spare)]
    values, slopes, curves = (np.array([p.deriv(d)(s) for p in shapes]) / length**d for d in (0, 1, 2))
    M, K = density * (values * w) @ values.T, bending * (curves * w) @ curves.T
    scale = 1 / np.sqrt(np.diag(M))
    omega2, vectors = np.linalg.eigh(_inverse_root(scale, M) @ (scale[:, None] * K * scale) @ _inverse_root(scale, M))
    vectors = (scale[:, None] * (_inverse_root(scale, M) @ vectors))[:, :modes]
    phi, slope = vectors.T @ values, vectors.T @ slopes
    x, m = s * length, density * w
    Phi = np.zeros((POINTS, 3, modes))
    Phi[:, 1] = phi.T
    u = np.column_stack([x, 0 * x, 0 * x])
    ends = {"a": 0.0, "b": 1.0, "m": 0.5}
    return FlexibleBody(
        name=name,
        mass=m.sum(),
        r_dm=m @ u,
        rr_dm=np.einsum("p,pk,pl->kl", m, u, u) + np.diag([0, 0.5, 0.5]) * 1e-4 * m.sum() * length**2,
        P_dm=np.einsum("p,pkj->kj", m, Phi),
        rP_dm=np.einsum("p,pk,plj->klj", m, u, Phi),
        PP_dm=np.einsum("p,pki,plj->klij", m, Phi, Phi),
        omega2=omega2[:modes],
        interfaces=tuple(_end(key, at, length, shapes, vectors) for key, at in ends.items()),
        surface=Surface(u, np.array([[0, 1, 2]]), Phi),
        stiffening=_stiffening(slope, x, w, density, length, list(ends)),
        provenance={},
    )


def _shape(held: str, k: int) -> Legendre:
    x = Legendre([0.5, 0.5], domain=[0, 1])
    edge = x * x if held == "root" else x * (1 - x)
    return edge * Legendre.basis(k, domain=[0, 1])


def _inverse_root(scale: Array, M: Array) -> Array:
    values, vectors = np.linalg.eigh(scale[:, None] * M * scale)
    return (vectors / np.sqrt(values)) @ vectors.T


def _end(name: str, at: float, length: float, shapes: list[Legendre], vectors: Array) -> Interface:
    phi_t, phi_r = np.zeros((3, vectors.shape[1])), np.zeros((3, vectors.shape[1]))
    phi_t[1] = [p(at) for p in shapes] @ vectors
    phi_r[2] = [p.deriv()(at) / length for p in shapes] @ vectors
    return Interface(name, np.array([at * length, 0, 0]), phi_t, phi_r)


def _stiffening(slope: Array, x: Array, w: Array, density: float, length: float, ends: list[str]) -> Array:
    """(12 + 6 I, n, n): integral of N slope slope^T for the axial force N of each unit load."""
    K = np.zeros((12 + 6 * len(ends), slope.shape[0], slope.shape[0]))
    beyond = density * (length - x), 0.5 * density * (length**2 - x**2)
    for load, force in ((0, -beyond[0]), (7, beyond[1]), (8, beyond[1]), (12 + 6 * ends.index("b"), np.ones_like(x))):
        K[load] = (slope * (w * force)) @ slope.T
    return K


def bar(name: str, length: float = 1.0, mass: float = 1.0, inertia: tuple[float, ...] = (1e-3, 1 / 12, 1 / 12)) -> Any:
    """A rigid bar along x from "a" to "b"."""
    ends = {"a": np.zeros(3), "b": np.array([length, 0, 0])}
    return rigid_body(
        name, mass=mass, inertia=np.array(inertia), centre_of_mass=np.array([length / 2, 0, 0]), points=ends
    )


def pendulum(*models: FlexibleBody, **more: Any) -> Scene:
    """Bodies in a row, the first on a hinge at the origin, released from the horizontal."""
    starts = np.cumsum([0.0, *(model.interface("b").position[0] for model in models)])
    bodies = tuple(Body(model.name, model, position=(x, 0, 0)) for model, x in zip(models, starts[:-1], strict=True))
    before = ["ground.O", *(f"{model.name}.b" for model in models[:-1])]
    joints = tuple(Joint(f"hinge{k}", "revolute", before[k], f"{m.name}.a") for k, m in enumerate(models))
    return Scene(bodies, joints, ground={"O": (0, 0, 0)}, **{"gravity": GRAVITY, "plane": "z"} | more)


def tried(scene: Scene, **settings: Any) -> Result | None:
    """A forward run, or None where it failed."""
    try:
        return integrate(scene, **settings)
    except ComputationError:
        return None
