"""Andrews' squeezing mechanism: seven bodies, ten revolute joints, one spring, driven by a constant moment.

IVP Test Set (F. Mazzia, C. Magherini, University of Bari), problem "Andrews' squeezing mechanism"; IFToMM benchmark A03. The
seven angles at t = 0.03 s come from two independent integrations that agree to 1e-12; published digits are right to 1e-10.
"""

from __future__ import annotations

import numpy as np

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.linearise import linearise
from ffr_dyn.consistency.mobility import mobility
from ffr_dyn.integrators import RK4
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.scene.forces import Load, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body

A, B, C = (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)
D, DA, E, EA, RR, RA, SS, SA, SB, SC, SD = (
    0.028,
    0.0115,
    0.02,
    0.01421,
    0.007,
    0.00092,
    0.035,
    0.01874,
    0.01043,
    0.018,
    0.02,
)
TA, TB, U, UA, UB, ZF, ZT, FA = 0.02308, 0.00916, 0.04, 0.01228, 0.00449, 0.02, 0.04, 0.01421
MASS = (0.04325, 0.00365, 0.02373, 0.00706, 0.0705, 0.00706, 0.05498)
INERTIA = (2.194e-6, 4.41e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5)
START = {
    "beta": -0.06171389001427645, "theta": 0.0, "gamma": 0.45527981916307037, "phi": 0.22266839016588588,
    "delta": 0.48736497954384256, "omega": -0.22266839016588588, "epsilon": 1.2305474445498212,
}  # fmt: skip
END = {
    "beta": 15.8107711951537, "theta": -15.7563710584118, "gamma": 0.0408222401196458, "phi": -0.534730116342080,
    "delta": 0.524409965879954, "omega": 0.534730116342080, "epsilon": 1.04808074104194,
}  # fmt: skip


def andrews() -> Scene:
    """Joints carry the names of the angles; P is where the second, third, fourth and sixth body meet."""
    q = START
    total = (
        q["beta"],
        q["beta"] + q["theta"],
        q["gamma"],
        q["phi"] + q["delta"],
        q["delta"],
        q["omega"] + q["epsilon"],
        q["epsilon"],
    )
    local = (
        ((RA, 0), {"o": (0, 0), "b": (RR, 0)}),
        ((-DA, 0), {"b": (0, 0), "p": (-D, 0)}),
        ((SB, -SA), {"b": (0, 0), "p": (0, -SS), "d": (SD, -SC)}),
        ((0, EA - E), {"e": (0, 0), "p": (0, -E)}),
        ((TA, TB), {"a": (0, 0), "e": (ZT, 0)}),
        ((ZF - FA, 0), {"f": (0, 0), "p": (ZF, 0)}),
        ((-UB, -UA), {"a": (0, 0), "f": (0, -U)}),
    )

    def at(body: int, point: str) -> np.ndarray:
        x, y = local[body][1][point]
        c, s = np.cos(total[body]), np.sin(total[body])
        return np.array([c * x - s * y, s * x + c * y])

    zero = np.zeros(2)
    origins = (zero, at(0, "b"), np.array(B), A + at(4, "e"), np.array(A), A + at(6, "f"), np.array(A))
    bodies = tuple(
        Body(f"k{k + 1}", rigid_body(
            f"k{k + 1}", mass=MASS[k], inertia=(INERTIA[k],) * 3, centre_of_mass=(*local[k][0], 0),
            points={name: (*xy, 0) for name, xy in local[k][1].items()},
        ), position=(*origins[k], 0), rotation=(0, 0, total[k]))
        for k in range(7)
    )  # fmt: skip
    ends = {
        "beta": ("ground.O", "k1.o"), "theta": ("k1.b", "k2.b"), "gamma": ("ground.B", "k3.b"), "phi": ("k5.e", "k4.e"),
        "delta": ("ground.A", "k5.a"), "omega": ("k7.f", "k6.f"), "epsilon": ("ground.A", "k7.a"),
        "P3": ("k2.p", "k3.p"), "P4": ("k2.p", "k4.p"), "P6": ("k2.p", "k6.p"),
    }  # fmt: skip
    return Scene(
        bodies,
        tuple(Joint(name, "revolute", *pair) for name, pair in ends.items()),
        loads=(Load("motor", "k1.o", moment=(0, 0, 0.033)),),
        springs=(SpringDamper("spring", "ground.C", "k3.d", 4530.0, free_length=0.07785),),
        ground={"O": (0, 0, 0), "A": (*A, 0), "B": (*B, 0), "C": (*C, 0)},
    )


def test_seven_angles_after_eight_turns_of_the_crank():
    result = integrate(andrews(), end=0.03, output_step=2.5e-4, method=RK4(1e-6), stabilisation=Projection(1e-13))
    for name, expected in END.items():
        assert abs(result[f"{name}.angle"][-1] - expected) < 1e-9, name
    work = 0.033 * (result["beta.angle"] - result["beta.angle"][0])
    stretch = result["spring.tension"] / 4530.0
    stored = result["energy.kinetic"] + 0.5 * 4530.0 * stretch**2
    np.testing.assert_allclose(stored - stored[0], work, atol=1e-9)


def test_its_mobility():
    found = mobility(andrews())
    assert found.degrees_of_freedom == 1
    assert len(found.free[0].bodies) >= 2
    assert {name for name, _ in found.redundant} <= {joint.name for joint in andrews().joints}
    assert len(found.redundant) == 50 - 41
    assert linearise(andrews()).A.shape == (2, 2)


def point(name: str, **points) -> object:
    """A unit mass with hardly any inertia."""
    return rigid_body(name, mass=1.0, inertia=(1e-12,) * 3, points={"c": (0, 0, 0), **points})


def test_double_pendulum_for_five_seconds():
    """Point masses of 1 kg on massless links of 1 m, both horizontal at first: angles at 1 s and 5 s."""
    scene = Scene(
        (
            Body("one", point("one", pivot=(-1, 0, 0)), position=(1, 0, 0)),
            Body("two", point("two", pivot=(-1, 0, 0)), position=(2, 0, 0)),
        ),
        (Joint("A", "revolute", "ground.O", "one.pivot"), Joint("B", "revolute", "one.c", "two.pivot")),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )
    result = integrate(scene, end=5.0, output_step=1.0, method=RK4(2e-4), stabilisation=Projection(1e-13))
    first, second = result["one.c.position"], result["two.c.position"] - result["one.c.position"]
    angles = np.arctan2([first[:, 0], second[:, 0]], [-first[:, 1], -second[:, 1]])
    np.testing.assert_allclose(angles[:, 1], (-0.62508769980639, -1.03458508568), atol=1e-9)
    np.testing.assert_allclose(angles[:, 5], (-0.62718670506653, -1.3013155502098), atol=1e-8)


def test_stiff_spring_pendulum_for_two_seconds():
    """1 kg on a spring of 1e6 N/m and 1 m, from the horizontal at rest: position at 1 s and 2 s."""
    scene = Scene(
        (Body("ball", point("ball"), position=(1, 0, 0)),),
        springs=(SpringDamper("spring", "ground.O", "ball.c", 1e6, free_length=1.0),),
        ground={"O": (0, 0, 0)},
        gravity=(0, -9.81, 0),
    )
    result = integrate(scene, end=2.0, output_step=1.0, method=RK4(5e-5))
    expected = [(-0.98629074, -0.16504631), (0.79350278, -0.60859605)]
    np.testing.assert_allclose(result["ball.c.position"][1:, :2], expected, atol=2e-7)
