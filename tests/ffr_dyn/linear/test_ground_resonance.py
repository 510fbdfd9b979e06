"""Ground resonance: blades with lag hinges on a hub that shifts aside, against Coleman's equations.

With x and y of the hub and the lag z_k = a cos psi_k + b sin psi_k of N blades at psi_k, of first and second moments S and I
about hinges at the distance e,

    (m_h + N m) x'' + c x' + k x - N/2 S b'' = 0,
    I (a'' + 2 w b' - w^2 a) + c_z (a' + w b) + (k_z + e S w^2) a + S y'' = 0,

and so on. (Coleman & Feingold, NACA Report 1351 (1958); Johnson, Helicopter Theory, 1994, section 12-4.)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ffr_dyn as fd

BLADES, MASS, LENGTH, HINGE, SPRING, HUB = 4, 1.0, 1.0, 0.3, 20.0, 20.0
S, J = MASS * LENGTH / 2, MASS * LENGTH**2 / 3
SUPPORTS = [
    ((4000.0, 4000.0), (10.0, 10.0), 0.05, 42.0),
    ((4000.0, 3000.0), (0.0, 0.0), 0.02, 42.0),
    ((4000.0, 3000.0), (5.0, 5.0), 0.1, 25.0),
]


def blade(angle):
    """A uniform rod from its hinge, out at an angle."""
    along = np.array([np.cos(angle), np.sin(angle), 0.0])
    A = np.stack([along, [-along[1], along[0], 0.0], [0, 0, 1.0]], axis=1)
    inertia = A @ np.diag([1e-4, MASS * LENGTH**2 / 12, MASS * LENGTH**2 / 12]) @ A.T
    return fd.rigid_body(
        "blade", mass=MASS, inertia=inertia, centre_of_mass=LENGTH / 2 * along, points={"h": (0, 0, 0)}
    )


def helicopter(k, c, lag, speed):
    angles = 2 * np.pi * np.arange(BLADES) / BLADES
    hinges = {f"h{n}": (HINGE * np.cos(a), HINGE * np.sin(a), 0.0) for n, a in enumerate(angles)}
    hub = fd.rigid_body("hub", mass=1e-3, inertia=(1e-3, 1e-3, 1e-3), points={"o": (0, 0, 0)} | hinges)
    body = fd.rigid_body("body", mass=HUB, inertia=(1, 1, 1), points={"o": (0, 0, 0)})
    gear = fd.Bushing("gear", "ground.O", "body.o", np.diag([*k, 1e8, 1e8, 1e8, 1e8]), np.diag([*c, 0, 0, 0, 0]))
    spin, bodies, joints, forces = (
        (0, 0, speed),
        [fd.Body("body", body)],
        [fd.Joint("mast", "revolute", "body.o", "hub.o")],
        [gear],
    )
    bodies.append(fd.Body("hub", hub, omega_bar=spin))
    for n, a in enumerate(angles):
        at = hinges[f"h{n}"]
        bodies.append(fd.Body(f"b{n}", blade(a), position=at, velocity=tuple(np.cross(spin, at)), omega_bar=spin))
        joints.append(fd.Joint(f"lag{n}", "revolute", f"hub.h{n}", f"b{n}.h"))
        forces.append(fd.JointSpring(f"spring{n}", f"lag{n}", stiffness=SPRING, damping=lag))
    motor = fd.Driver("rotor", "mast", fd.polynomial(0.0, speed))
    return fd.Scene(tuple(bodies), tuple(joints), (motor,), forces=tuple(forces), ground={"O": (0, 0, 0)})


def coleman(k, c, lag, speed):
    """Eigenvalues (8,)."""
    total, w, half = HUB + 1e-3 + BLADES * MASS, speed, BLADES / 2 * S
    held = SPRING + HINGE * S * w**2 - J * w**2
    M = np.array([[total, 0, 0, -half], [0, total, half, 0], [0, S, J, 0], [-S, 0, 0, J]])
    C = np.array([[c[0], 0, 0, 0], [0, c[1], 0, 0], [0, 0, lag, 2 * w * J], [0, 0, -2 * w * J, lag]])
    K = np.array([[k[0], 0, 0, 0], [0, k[1], 0, 0], [0, 0, held, lag * w], [0, 0, -lag * w, held]])
    none, one = np.zeros((4, 4)), np.eye(4)
    return np.linalg.eigvals(np.block([[none, one], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]]))


@pytest.mark.slow
@pytest.mark.parametrize("support", SUPPORTS)
def test_floquets_multipliers_are_those_of_coleman(support):
    """Of which one grows where a lagging blade's slow whirl meets a vibration of the hub, and none grows below."""
    period, exact = 2 * np.pi / support[-1], coleman(*support)
    found = fd.periodic(helicopter(*support), method=fd.ROS3(period / 400), floquet=True)
    values = np.array([complex(*one) for one in found.attributes["multipliers"]])
    for one in np.exp(exact * period):
        assert np.abs(values - one).min() < 1e-6
    assert found.attributes["stable"] == (exact.real.max() <= 0) == (support[-1] < 30)
    assert found.attributes["exponents"][0][0] == pytest.approx(exact.real.max(), abs=1e-6)


@pytest.mark.slow
def test_a_stiff_bushing_as_the_bearing_has_a_steady_motion():
    """The joint lets hub and fuselage move aside together, which the error says."""
    support = SUPPORTS[1]
    scene, exact = helicopter(*support), coleman(*support)
    with pytest.raises(fd.InputError, match=r"'mast' lets bodies .* move aside together.*a stiff Bushing"):
        fd.steady(scene)
    bearing = fd.Bushing("bearing", "body.o", "hub.o", np.diag([1e8, 1e8, 1e8, 1e6, 1e6, 0]))
    loose = replace(scene, joints=scene.joints[1:], drivers=(), forces=(*scene.forces, bearing))
    found = fd.linearise(fd.scene_at(loose, fd.steady(loose)))
    assert found.eigenvalues.real.max() == pytest.approx(exact.real.max(), rel=1e-4)
