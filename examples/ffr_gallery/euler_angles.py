"""Three angles cannot describe all rotations without a place where their rates are infinite; four Euler parameters can."""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.functions.rotation import from_vector, rotation_matrix
from ffr_dyn.integrators import RK4
from ffr_dyn.scene.scene import Body, Scene
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Mark, Panel, Proof
from ffr_prep.body import rigid_body
from ffr_prep.common.arrays import Array

SPEED, STEP, END = 1.0, 0.01, 3.0  # rad/s, s, s
FINER = 4
OFF = 1e-3  # rad, an orientation that is lost


def euler_angles() -> Exhibit:
    """A round body turns steadily, and passes the second Cardan angle of 90 degrees at a distance."""
    distances = np.geomspace(1e-4, 0.1, 60)
    angles, finer = (np.array([_with_angles(d, step) for d in distances]) for step in (STEP, STEP / FINER))
    parameters = np.array([_with_parameters(d) for d in distances[::6]])
    lost, lost_finer = (float(distances[errors > OFF].max(initial=0.0)) for errors in (angles, finer))
    return Exhibit(
        "Euler angles at 90 degrees",
        "Cardan angles: two rates grow like 1 / cos; a step that turns by more than the distance to 90 degrees is lost",
        "Euler parameters, which have no such place",
        (
            Claim("where the orientation is lost, over what a step turns by", 1 / 4, lost / (SPEED * STEP), 2.0),
            Claim("that distance, over the one with a quarter of the step", FINER, lost / lost_finer, 1.6),
        ),
        (
            Proof("error of the angles, at a distance of 1e-4 rad", float(angles[0]), OFF, True, "rad"),
            Proof("largest error of Euler parameters", float(parameters.max()), 1e-8, False, "rad"),
        ),
        (
            Panel(
                f"orientation after {END:g} s, RK4, h = {STEP:g} s", "least distance from 90 degrees [rad]", "error [rad]",
                (
                    Curve("Cardan angles", distances, angles, points=True),
                    Curve(f"Cardan angles, h / {FINER}", distances, finer, points=True),
                    Curve("Euler parameters", distances[::6], np.maximum(parameters, 1e-17), points=True),
                ),
                (Mark("turned in a step", SPEED * STEP), Mark(f"{OFF:g} rad are lost", lost, measured=True)),
                log=(True, True),
            ),
        ),
    )  # fmt: skip


def _about(axis: int, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    j, k = [(1, 2), (2, 0), (0, 1)][axis]
    A = np.eye(3)
    A[j, j], A[j, k], A[k, j], A[k, k] = c, -s, s, c
    return A


def _off(A: Array, B: Array) -> float:
    """Angle [rad] between two orientations; what is no rotation any more is off by half a turn."""
    apart = np.linalg.norm(A - B) / np.sqrt(8)
    return float(2 * np.arcsin(min(apart, 1.0))) if np.isfinite(apart) else np.pi


def _with_angles(distance: float, step: float) -> float:
    """RK4 on a = (alpha, beta, gamma) of A = A_x(alpha) A_y(beta) A_z(gamma), at a spin that is constant in body axes."""
    tilt = _about(0, distance)  # a turn about the global y axis from here misses the singular place by the distance
    omega_bar = tilt.T @ np.array([0.0, SPEED, 0.0])

    def rates(a: Array) -> Array:
        c, s, cb, tb = np.cos(a[2]), np.sin(a[2]), np.cos(a[1]), np.tan(a[1])
        x, y, z = omega_bar
        return np.array([(c * x - s * y) / cb, s * x + c * y, z - tb * (c * x - s * y)])

    a = np.array([distance, 0.0, 0.0])
    for _ in range(round(END / step)):
        k1 = rates(a)
        k2 = rates(a + step / 2 * k1)
        k3 = rates(a + step / 2 * k2)
        a = a + step / 6 * (k1 + 2 * k2 + 2 * k3 + rates(a + step * k3))
    return _off(_about(0, a[0]) @ _about(1, a[1]) @ _about(2, a[2]), tilt @ _turn(omega_bar))


def _turn(omega: Array) -> Array:
    """(3, 3) after a steady turn of END seconds."""
    return rotation_matrix(from_vector(omega * END))


def _with_parameters(distance: float) -> float:
    tilt = _about(0, distance)
    omega_bar = tilt.T @ np.array([0.0, SPEED, 0.0])
    ball = rigid_body("ball", mass=1.0, inertia=np.ones(3))
    scene = Scene((Body("ball", ball, rotation=tilt, omega_bar=omega_bar),), plane="none")
    result = integrate(scene, end=END, output_step=END, method=RK4(STEP))
    return _off(rotation_matrix(result["ball.p"][-1]), tilt @ _turn(omega_bar))
