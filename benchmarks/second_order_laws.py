"""The laws in `benchmarks.second_order`: energy and momentum of free and jointed second-order bodies, stiff joints.

Energies are those at the rows, relative to the largest kinetic or strain energy. The order of a method in the energy is that
by halving its step.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

import ffr_prep as fp
from benchmarks.preparation import Figure
from benchmarks.second_order_scenes import REFERENCES, beam, measured, pendulum
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.equations.inertia import kept_integrals, mass_matrix
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.functions.time_functions import harmonic
from ffr_dyn.integrators import RK4, ROS2, Integrator
from ffr_dyn.results.result import Result
from ffr_dyn.scene.forces import Bushing, JointSpring, Servo
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, rigid_body
from ffr_prep.body.mean_axis import mean_axis_form
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import MeanAxis, ReferenceConditions
from ffr_prep.reduction.conversion import with_reference
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import circle, rectangle

Array = np.ndarray

STEEL = Material("steel", 2e11, 0.3, 7870.0)
ALUMINIUM = Material("aluminium", 7e10, 0.33, 2700.0)
ROWS = 50
SWAY = harmonic(amplitude=-0.3, frequency=1.5, phase=np.pi / 2, mean=0.3)  # from rest


def highest(body: FlexibleBody) -> float:
    """Highest frequency of the body alone, free [rad/s]."""
    free = with_reference(replace(body, stiffening=None), MeanAxis())
    return float(np.sqrt(free.omega2.max()))


def run(scene: Scene, method: Integrator, steps: int) -> Result:
    """A result of `ROWS` rows with the default outputs."""
    apart = steps // ROWS * method.step
    return integrate(scene, end=ROWS * apart, output_step=apart, method=method)


def energy(found: Result) -> Array:
    """(T,) energy, of springs included, less that at the start, relative to the largest kinetic or strain energy."""
    whole = found["energy.total"] + (found["energy.springs"] if "energy.springs" in found.quantities else 0.0)
    off: Array = (whole - whole[0]) / max(found["energy.kinetic"].max(), found["energy.strain"].max())
    return off


def orders(scene: Scene, omega: float, steps: int) -> tuple[float, ...]:
    """By RK4 at h Omega = 0.2: how far the energy moves, and what it lacks in order 4 against 0.4; how much it grows at
    steps below the limit, and with ROS2 far above."""
    coarse, fine = (np.abs(energy(run(scene, RK4(0.4 / k / omega), k * steps))).max() for k in (1, 2))
    below = [energy(run(scene, RK4(h / omega), steps)).max() for h in (0.8, 1.6, 2.0, 2.5, 2.7)]
    above = energy(run(scene, ROS2(20 / omega), steps)).max()
    return fine, 4 - np.log2(coarse / fine), max(below), above


ORDERS = {
    "energy, RK4, h Omega = 0.2": 1e-6,
    "lack of order in its energy": 0.2,
    "growth of energy, RK4, h Omega to 2.7": 1e-3,
    "growth of energy, ROS2, h Omega = 20": 1e-2,
}


# ---- free ---------------------------------------------------------------------------------------------------------


def deflected(body: FlexibleBody, share: float, reach: float) -> Array:
    """(n,) the lowest free mode, whose largest deflection at an interface from the mean axes is a share of the reach [m]."""
    form = mean_axis_form(body)
    largest = max(float(np.abs(interface.phi_t[:, 0]).max()) for interface in form.body.interfaces)
    q: Array = form.C[:, 0] * share * reach / largest
    return q


def free_beams() -> Iterator[Figure]:
    """A steel beam of 1 m, 10 modes, set free from a deflection in its lowest mode."""
    for words, reference in REFERENCES.items():
        body = beam(rectangle(0.03, 0.01), STEEL, 1.0, 4, reference)
        for share in (0.01, 0.05):
            scene = Scene((Body("beam", body, q=deflected(body, share, 1.0)),))
            who = f"free beam, {words}, deflection {share:.0%}"
            yield from measured(who, ORDERS, orders, scene, highest(body), 10000)


def spinning_strips() -> Iterator[Figure]:
    """A strip of steel, bent by 3 % of its length, spinning about all axes: 1e5 steps of RK4 at h Omega = 0.2."""
    frame = polyline([(0, 0, 0), (0.3, 0, 0)], Member(rectangle(0.02, 0.001), STEEL, (0, 1.0, 0)), elements=24)
    ends = [InterfaceRegion("root"), InterfaceRegion("tip")]
    model = fp.from_frame(named(frame, root=(0, 0, 0), tip=(0.3, 0, 0)), ends)
    body = fp.reduce(model, fp.Request(name="strip", reference=MeanAxis(), reduction=Eigenmodes(10)))
    start = Body("strip", body, q=deflected(body, 0.03, 0.3), omega_bar=(3.0, -5.0, 20.0), velocity=(0.3, 0.2, -0.1))

    def drifts() -> tuple[float, ...]:
        found = run(Scene((start,)), RK4(0.2 / highest(body)), 100_000)
        off = [np.linalg.norm(x - x[0], axis=1).max() / np.linalg.norm(x[0]) for x in momenta(start, found)]
        return np.abs(energy(found)).max(), *off

    goals = {"energy": 1e-6, "momentum": 1e-10, "angular momentum": 1e-10}
    yield from measured("bent spinning strip, 1e5 steps", goals, drifts)


def momenta(body: Body, found: Result) -> tuple[Array, Array]:
    """(T, 3) momentum and angular momentum about the origin, in global axes, of a body under mean axes."""
    p, L, integrals = [], [], kept_integrals(body)
    for R, parameters, v, omega, q, q_dot in zip(
        *(found[f"{body.name}.{key}"] for key in ("R", "p", "v", "omega_bar", "q", "q_dot")), strict=True
    ):
        A = rotation_matrix(parameters)
        both = mass_matrix(integrals, q)[:6] @ np.concatenate([A.T @ v, omega, q_dot])
        p.append(A @ both[:3])
        L.append(np.cross(R, p[-1]) + A @ both[3:])
    return np.array(p), np.array(L)


# ---- jointed ------------------------------------------------------------------------------------------------------


def hinged() -> Iterator[Figure]:
    """The pendulum E = 7e9 with its frame at the hinge."""
    scene = pendulum(7e9, 8, REFERENCES["fixed"])
    omega = highest(scene.bodies[0].model)
    yield from measured("pendulum, frame at the hinge", ORDERS, orders, scene, omega, 20000)


def four_bar(reference: ReferenceConditions) -> Scene:
    """Crank and rocker on skew axes, between them a bent bar of steel of 8 mm; no gravity."""
    corners = [(0.0, 0.0, 0.0), (0.2, 0.11, 0.1), (0.4, 0.15, 0.05)]
    frame = polyline(corners, Member(circle(0.008), STEEL, (0, 0, 1.0)), elements=12)
    model = fp.from_frame(
        named(frame, root=corners[0], tip=corners[2]), [InterfaceRegion("root"), InterfaceRegion("tip")]
    )
    coupler = fp.reduce(model, fp.Request(name="coupler", reference=reference, reduction=CraigBampton(4)))
    crank = rigid_body(
        "crank", mass=0.3, inertia=np.full(3, 1e-3), points={"O": np.zeros(3), "A": np.array([0, 0.1, 0])}
    )
    rocker = rigid_body(
        "rocker", mass=0.5, inertia=np.full(3, 5e-3), points={"C": np.zeros(3), "B": np.array([0, 0.25, 0])}
    )
    at = np.add(corners[2], (0, 0.1, 0))
    bodies = (
        Body("crank", crank, omega_bar=(0, 0, 120.0)),
        Body("coupler", coupler, position=(0, 0.1, 0)),
        Body("rocker", rocker, position=at - (0, 0.25, 0)),
    )
    joints = (
        Joint("O", "revolute", "ground.O", "crank.O"),
        Joint("A", "universal", "crank.A", "coupler.root", axis=(0, 0, 1), axis_j=(0, 1, 0)),
        Joint("B", "spherical", "coupler.tip", "rocker.B"),
        Joint("C", "revolute", "ground.C", "rocker.C", axis=(0.3, 0, 1)),
    )
    return Scene(bodies, joints, ground={"O": (0, 0, 0), "C": at - (0, 0.25, 0)})


def four_bars() -> Iterator[Figure]:
    """In space."""
    for words, reference in REFERENCES.items():
        scene = four_bar(reference)
        omega = highest(scene.bodies[1].model)
        yield from measured(f"four-bar, bent coupler, {words}", ORDERS, orders, scene, omega, 20000)


def conditions() -> Iterator[Figure]:
    """A point of bodies reduced under each reference condition, over 0.2 s [m]."""

    def apart(make: Callable[[ReferenceConditions], Scene], point: str) -> tuple[float]:
        tracks = [
            integrate(make(of), end=0.2, output_step=0.01, method=ROS2(2e-4))[point] for of in REFERENCES.values()
        ]
        return (np.ptp(tracks, axis=0).max(),)

    who, goals = "a body under three reference conditions", {"tip of the pendulum E = 7e9 [m]": 1e-10}
    yield from measured(who, goals, apart, lambda of: pendulum(7e9, 8, of), "beam.tip.position")
    yield from measured(who, {"coupler of the four-bar [m]": 1e-10}, apart, four_bar, "coupler.tip.position")


# ---- stiff joints -------------------------------------------------------------------------------------------------


def arm(forces: tuple[JointSpring | Servo, ...]) -> Scene:
    """Two links of aluminium, 0.1 m x 10 mm x 6 mm, modes from 3 kHz, that fall from the horizontal."""
    link = beam(rectangle(0.01, 0.006), ALUMINIUM, 0.1, 6, REFERENCES["supported"])
    bodies = (Body("upper", link), Body("lower", link, position=(0.1, 0, 0)))
    joints = (
        Joint("shoulder", "revolute", "ground.O", "upper.root"),
        Joint("elbow", "revolute", "upper.tip", "lower.root"),
    )
    return Scene(bodies, joints, forces=forces, ground={"O": (0, 0, 0)}, gravity=(0.0, -9.81, 0.0))


def arms() -> Iterator[Figure]:
    """Default run (ROS2, 1 ms) against half its step: tip relative to the length of the arm."""
    hinges = ("shoulder", "elbow")
    forces: dict[str, list[JointSpring] | list[Servo]] = {}
    for d, k in ((0.05, 0.0), (0.5, 0.0), (5.0, 0.0), (50.0, 0.0), (5.0, 200.0)):
        springs = [JointSpring(f"at_{hinge}", hinge, stiffness=k, damping=d) for hinge in hinges]
        forces[f"joints {d:g} N m s/rad and {k:g} N m/rad"] = springs
    for kd in (0.1, 1.0, 6.0):
        forces[f"servos kd = {kd:g} N m s/rad"] = [Servo(f"at_{hinge}", hinge, SWAY, 20 * kd, kd) for hinge in hinges]
    for words, acting in forces.items():
        yield from measured(f"light arm, {words}", {"half the step": 1e-3}, _halved, arm(tuple(acting)))


def _halved(scene: Scene) -> tuple[float]:
    coarse, fine = (
        integrate(scene, end=1.0, output_step=0.01, method=method, outputs=["lower.tip.position"])["lower.tip.position"]
        for method in (None, ROS2(5e-4))
    )
    return (np.linalg.norm(coarse - fine, axis=1).max() / 0.2,)


def bushings() -> Iterator[Figure]:
    """A rigid and a flexible body held by a bushing of h omega = 100, let go out of its middle: ROS2, energy."""
    h = 1e-3
    block = rigid_body("block", mass=1.0, inertia=(1.0, 1.0, 1.0), points={"O": np.zeros(3)})
    rod = beam(rectangle(0.03, 0.01), STEEL, 1.0, 4, REFERENCES["supported"])

    def growth(model: FlexibleBody, marker: str) -> tuple[float]:
        bushing = Bushing("bushing", "ground.O", marker, stiffness=((100 / h) ** 2 * model.mass,) * 6)
        body = Body("b", model, position=(1e-4, 0, 0), omega_bar=(0, 0, 1.0))
        return (energy(run(Scene((body,), forces=(bushing,), ground={"O": (0, 0, 0)}), ROS2(h), 1000)).max(),)

    for name, model, marker in (("rigid body", block, "b.O"), ("beam", rod, "b.root")):
        yield from measured(
            f"{name} on a bushing, ROS2, h omega = 100", {"growth of energy": 1e-6}, growth, model, marker
        )


CASES: dict[str, Callable[[], Iterator[Figure]]] = {
    "free": free_beams,
    "strip": spinning_strips,
    "hinged": hinged,
    "four-bar": four_bars,
    "conditions": conditions,
    "arm": arms,
    "bushing": bushings,
}
