"""Accuracy against an independent code: the same reduced bodies in Exudyn's reduced-order floating frame.

    python benchmarks/against_exudyn.py [--quick]

Exudyn (J. Gerstmayr, Int. J. Mech. Sys. Dyn. 3 (2023); `pip install "ffr[bench]"`) gets the mesh, the consistent mass,
the stiffness and the mode basis of `ffr_prep` and forms its own inertia terms from them; joints, loads and start are
those of the scene. Both codes then run with a sequence of steps: ours with ROS2, Exudyn's with its generalised-alpha
method, both of order two and extrapolated to step zero. Printed: how far the inertia terms are apart; for each step the
largest distance over all output times of our run from Exudyn's extrapolation, and of Exudyn's run from ours with RK4 at
a step that resolves every mode; last, these distances at step zero.

Two things are made equal on purpose, and the table of the pendulum shows what the first is worth:

- Gravity. Exudyn's LoadMassProportional on this object takes the moment of the weight about the *undeformed* centre of
  mass, A^T r_dm x g; the virtual work of gravity has A^T (r_dm + P_dm q) x g. The same weight given as a force on a
  massless node that moves with the centre of mass, c + P_dm q / m, contains the missing term.
- Markers. Exudyn's marker is a weighted mean of nodes. Six massless nodes about an interface, which move with its
  translation and rotation, make that mean our interface, rigid (RBE2) or mean (RBE3) alike. Its rotation is taken
  linearly (rotationsExponentialMap = 0), as ours is.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import exudyn
import numpy as np
import scipy.sparse as sp
from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface
from exudyn.itemInterface import (
    LoadForceVector,
    LoadMassProportional,
    MarkerBodyMass,
    MarkerBodyRigid,
    MarkerNodeCoordinate,
    MarkerSuperElementPosition,
    MarkerSuperElementRigid,
    NodePointGround,
    NodeRigidBodyRxyz,
    ObjectConnectorCoordinate,
    ObjectGround,
    ObjectJointRevoluteZ,
    ObjectRigidBody,
    SensorMarker,
)

from ffr_dyn.analyses.assemble import assemble as assemble_scene
from ffr_dyn.analyses.forward import forward
from ffr_dyn.drivers import Driver
from ffr_dyn.integrators import RK4, ROS2, Integrator
from ffr_dyn.joints import Joint
from ffr_dyn.scene import Body, Scene
from ffr_dyn.timefunction import polynomial
from ffr_prep.body import FlexibleBody, rigid_body, with_point
from ffr_prep.interface import InterfaceRegion, couple
from ffr_prep.invariants import inertia_integrals
from ffr_prep.material import Material
from ffr_prep.mesh import read_mesh
from ffr_prep.reduce import boundary, interface_shapes, nodal_basis
from ffr_prep.reduction import CraigBampton
from ffr_prep.reference import SimplySupported, functionals
from ffr_prep.solids import assemble, vector_mass

Array = np.ndarray
Gravity = Callable[[Any, "Twin", int], None]

MESHES = Path(__file__).resolve().parent.parent / "meshes"
GRAVITY = np.array([0.0, -9.81, 0.0])
CRANK, SPEED = 0.15, 150.0  # [m], [rad/s]
ARM = 0.05  # [m] of the massless nodes from their interface; any length gives the same marker


# ---- the same body in both codes ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Twin:
    """A reduced body and Exudyn's form of it: node numbers of each interface, and of the centre of mass."""

    body: FlexibleBody
    exudyn: ObjectFFRFreducedOrderInterface
    nodes: dict[str, list[int]]
    centre: int


def twin(
    mesh_file: str, material: Material, ends: tuple[str, str], kind: str, modes: int, middle: tuple | None = None
) -> Twin:
    """Reduce the mesh with `modes` fixed-interface modes and hand the same matrices and basis to both codes."""
    mesh = read_mesh(MESHES / mesh_file)
    matrices = assemble(mesh, material)
    model = couple(mesh, matrices, [InterfaceRegion(end, kind=kind) for end in ends])
    basis = CraigBampton(modes).basis(model, functionals(SimplySupported(*ends), model))
    Phi = nodal_basis(model, basis)
    body = FlexibleBody(
        name="rod",
        omega2=basis.omega2,
        interfaces=interface_shapes(model, basis),
        surface=boundary(mesh, Phi),
        **vars(inertia_integrals(mesh.points, matrices.m, Phi)),
    )
    if middle is not None:
        body = with_point(body, "middle", np.array(middle))
    return in_exudyn(body, mesh.points, Phi, vector_mass(matrices.m), matrices.K)


def in_exudyn(body: FlexibleBody, points: Array, Phi: Array, M: sp.sparray, K: sp.sparray) -> Twin:
    """Exudyn's reduced object of the mesh points (N, 3), basis Phi (N, 3, n), mass M and stiffness K (3N, 3N)."""
    added, shapes, nodes = [body.centre_of_mass[None]], [body.P_dm[None] / body.mass], {}
    count = len(points) + 1
    arms = ARM * np.vstack([np.eye(3), -np.eye(3)])
    for interface in body.interfaces:
        added.append(interface.position + arms)
        turned = np.cross(interface.phi_r[None], arms[:, :, None], axis=1)
        shapes.append(interface.phi_t + turned)
        nodes[interface.name] = list(range(count, count + len(arms)))
        count += len(arms)
    massless = sp.csr_array((3 * (count - len(points)),) * 2)
    fem = FEMinterface()
    fem.nodes = {"Position": np.vstack([points, *added])}
    fem.massMatrix = sp.csr_matrix(sp.block_diag([M, massless]))
    fem.stiffnessMatrix = sp.csr_matrix(sp.block_diag([K, massless]))
    fem.modeBasis = {"matrix": np.vstack([Phi, *shapes]).reshape(3 * count, body.n), "type": "NormalModes"}
    theirs = ObjectFFRFreducedOrderInterface(fem, roundMassMatrix=0.0, roundStiffnessMatrix=0.0)
    return Twin(body, theirs, nodes, len(points))


def integral_differences(pair: Twin) -> dict[str, float]:
    """Largest difference of each inertia and stiffness term, relative to its largest entry."""
    ours, theirs, n = pair.body, pair.exudyn, pair.body.n
    I8 = ours.I8.transpose(1, 0, 2).reshape(3, 3 * n)
    I9 = ours.I9.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n)
    pairs: dict[str, tuple[Any, Any]] = {
        "I1 mass": (ours.mass, theirs.totalMass),
        "I2 first moment": (ours.r_dm, theirs.totalMass * theirs.chiU),
        "I3 S": (ours.I3, theirs.mPhitTPsi),
        "I4": (-ours.I4, theirs.mXRefTildePsi),
        "I5": (-ours.I5.transpose(1, 0, 2).reshape(3 * n, n), theirs.mPsiTildePsi),
        "I6 modal mass": (ours.I6, theirs.massMatrixReduced),
        "I7 inertia": (ours.inertia, theirs.inertiaLocal),
        "I8": (-I8, theirs.mXRefTildePsiTilde),
        "I9": (-I9, theirs.mPsiTildePsiTilde),
        "stiffness": (np.diag(ours.omega2), theirs.stiffnessMatrixReduced),
    }
    return {name: float(np.abs(a - b).max() / np.abs(a).max()) for name, (a, b) in pairs.items()}


# ---- scenes ---------------------------------------------------------------------------------------------------------


def pendulum(kind: str, modes: int) -> Twin:
    """The rod of the flexible pendulum: 1.2 m, E = 7e10 Pa."""
    return twin("pendulum.geo", Material("metal", 7e10, 0.3, 5540.0), ("hinge", "tip"), kind, modes)


def pendulum_scene(body: FlexibleBody) -> Scene:
    """Released at rest from the horizontal, on a revolute joint to the ground."""
    hinge = Joint("hinge", "revolute", "ground.O", "rod.hinge")
    return Scene((Body("rod", body),), (hinge,), ground={"O": body.interface("hinge").position}, gravity=GRAVITY)


def rod(kind: str, modes: int) -> Twin:
    """The connecting rod of the slider-crank: 0.3 m, 6 mm, steel."""
    steel = Material("steel", 2e11, 0.3, 7870.0)
    return twin("slidercrank_rod.geo", steel, ("crankpin", "slider"), kind, modes, middle=(0.15, 0.0, 0.0))


def slidercrank_scene(body: FlexibleBody) -> Scene:
    """A rigid crank driven at 150 rad/s, the flexible rod, a slider of half the rod's mass."""
    points = {"hub": np.zeros(3), "pin": np.array([CRANK, 0, 0])}
    crank = rigid_body("crank", mass=0.1, inertia=np.full(3, 1e-4), points=points)
    slider = rigid_body("slider", mass=body.mass / 2, inertia=np.full(3, 1e-5), points={"pin": np.zeros(3)})
    at = np.array([CRANK, 0, 0])
    span = body.interface("slider").position - body.interface("crankpin").position
    return Scene(
        (
            Body("crank", crank),
            Body("rod", body, position=at - body.interface("crankpin").position),
            Body("slider", slider, position=at + span),
        ),
        (
            Joint("bearing", "revolute", "ground.O", "crank.hub"),
            Joint("crankpin", "revolute", "crank.pin", "rod.crankpin"),
            Joint("wrist", "revolute", "rod.slider", "slider.pin"),
            Joint("guide", "translational", "ground.O", "slider.pin", axis=(1, 0, 0)),
        ),
        (Driver("motor", "bearing", polynomial(0.0, SPEED)),),
        ground={"O": (0, 0, 0)},
    )


def ours(scene: Scene, markers: list[str], end: float, output: float, method: Integrator) -> Array:
    """Positions (T, 3 * markers) of the markers; every joint must have kept all its rows."""
    result = forward(scene, end=end, output_step=output, method=method)
    notes = result.attributes["notes"]
    assert not any("redundant" in note for note in notes), f"the two models would differ: {notes}"
    return np.hstack([result[f"{marker}.position"] for marker in markers])


# ---- the same scenes in Exudyn --------------------------------------------------------------------------------------


def weight_on_centre(mbs: Any, pair: Twin, object_number: int) -> None:
    """The weight as a force on the node that moves with the centre of mass of the deformed body."""
    marker = mbs.AddMarker(
        MarkerSuperElementPosition(bodyNumber=object_number, meshNodeNumbers=[pair.centre], weightingFactors=[1.0])
    )
    mbs.AddLoad(LoadForceVector(markerNumber=marker, loadVector=list(pair.body.mass * GRAVITY)))


def mass_proportional(mbs: Any, pair: Twin, object_number: int) -> None:
    """Exudyn's own gravity, whose moment is that of the undeformed body."""
    marker = mbs.AddMarker(MarkerBodyMass(bodyNumber=object_number))
    mbs.AddLoad(LoadMassProportional(markerNumber=marker, loadVector=list(GRAVITY)))


def exudyn_pendulum(pair: Twin, step: float, end: float, output: float, gravity: Gravity = weight_on_centre) -> Array:
    """Tip positions (T, 3) of the pendulum."""
    container = exudyn.SystemContainer()
    mbs = container.AddSystem()
    number = pair.exudyn.AddObjectFFRFreducedOrder(mbs)["oFFRFreducedOrder"]
    gravity(mbs, pair, number)
    hinge, tip = (interface_marker(mbs, pair, number, name) for name in ("hinge", "tip"))
    fixed = mbs.AddMarker(
        MarkerBodyRigid(
            bodyNumber=mbs.AddObject(ObjectGround()),
            localPosition=list(pair.body.interface("hinge").position),
        )
    )
    mbs.AddObject(ObjectJointRevoluteZ(markerNumbers=[fixed, hinge]))
    return solved(mbs, [tip], step, end, output)


def exudyn_slidercrank(pair: Twin, step: float, end: float, output: float) -> Array:
    """Positions (T, 6) of the slider and of the rod's middle."""
    scene = slidercrank_scene(pair.body)
    start = assemble_scene(scene, time=0.0)
    place = start.system.layout
    container = exudyn.SystemContainer()
    mbs = container.AddSystem()
    ground = mbs.AddNode(NodePointGround())
    crank = guided_body(mbs, ground, scene, start, 0, free=5, function=lambda mbs, t, item, offset: SPEED * t)
    slider = guided_body(mbs, ground, scene, start, 2, free=0)
    assert not start.x[place.q(1)].any(), "the rod must start undeformed"
    number = pair.exudyn.AddObjectFFRFreducedOrder(
        mbs,
        positionRef=list(start.x[place.R(1)]),
        initialVelocity=list(start.v[place.R_dot(1)]),
        initialAngularVelocity=list(start.v[place.omega(1)]),
    )["oFFRFreducedOrder"]
    ends = {name: interface_marker(mbs, pair, number, name) for name in pair.nodes}
    pin = mbs.AddMarker(MarkerBodyRigid(bodyNumber=crank, localPosition=[CRANK, 0.0, 0.0]))
    wrist = mbs.AddMarker(MarkerBodyRigid(bodyNumber=slider))
    mbs.AddObject(ObjectJointRevoluteZ(markerNumbers=[pin, ends["crankpin"]]))
    mbs.AddObject(ObjectJointRevoluteZ(markerNumbers=[ends["slider"], wrist]))
    return solved(mbs, [wrist, ends["middle"]], step, end, output)


def interface_marker(mbs: Any, pair: Twin, object_number: int, name: str) -> Any:
    """The interface as a marker on its massless nodes."""
    nodes = pair.nodes[name]
    return mbs.AddMarker(
        MarkerSuperElementRigid(
            bodyNumber=object_number,
            meshNodeNumbers=nodes,
            weightingFactors=[1 / len(nodes)] * len(nodes),
            rotationsExponentialMap=0,
        )
    )


def guided_body(mbs: Any, ground: Any, scene: Scene, start: Any, b: int, free: int, function: Any = 0) -> Any:
    """Rigid body b with all its coordinates held but one (0: x, 5: rotation about z), which may follow a function."""
    body, place = scene.bodies[b].model, start.system.layout
    node = mbs.AddNode(
        NodeRigidBodyRxyz(
            referenceCoordinates=[*start.x[place.R(b)], 0.0, 0.0, 0.0],
            initialVelocities=[*start.v[place.R_dot(b)], *start.v[place.omega(b)]],
        )
    )
    J = body.central_inertia
    six = [J[0, 0], J[1, 1], J[2, 2], J[1, 2], J[0, 2], J[0, 1]]
    number = mbs.AddObject(ObjectRigidBody(nodeNumber=node, mass=body.mass, inertia=six))
    fixed = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
    for c in range(6):
        if c == free and not function:
            continue
        moving = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=c))
        driver = {"offsetUserFunction": function} if c == free else {}
        mbs.AddObject(ObjectConnectorCoordinate(markerNumbers=[fixed, moving], **driver))
    return number


def solved(mbs: Any, markers: list[Any], step: float, end: float, output: float) -> Array:
    """Run generalised alpha (index 3); positions (T, 3 * markers) every `output` seconds."""
    sensors = [
        mbs.AddSensor(
            SensorMarker(
                markerNumber=marker,
                outputVariableType=exudyn.OutputVariableType.Position,
                storeInternal=True,
                writeToFile=False,
            )
        )
        for marker in markers
    ]
    mbs.Assemble()
    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = output
    settings.linearSolver.solverType = exudyn.LinearSolverType.EXUdense
    integration = settings.timeIntegration
    integration.endTime, integration.numberOfSteps, integration.verboseMode = end, round(end / step), 0
    integration.generalizedAlpha.spectralRadius = 0.9
    integration.newton.relativeTolerance, integration.newton.absoluteTolerance = 1e-10, 1e-12
    mbs.SolveDynamic(settings)
    return np.hstack([mbs.GetSensorStoredData(sensor)[:, 1:4] for sensor in sensors])


# ---- tables ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """One scene in both codes: `ours` of a method and `theirs` of a step give positions (T, 3 * points) [m]."""

    title: str
    pair: Twin
    ours: Callable[[Integrator], Array]
    theirs: Callable[[float], Array]
    steps: tuple[float, ...]


def pendulum_case(kind: str, modes: int, steps: tuple[float, ...], gravity: Gravity = weight_on_centre) -> Case:
    """The tip over 0.5 s."""
    pair = pendulum(kind, modes)
    scene = pendulum_scene(pair.body)
    return Case(
        f"pendulum, {kind} interfaces, tip over 0.5 s",
        pair,
        lambda method: ours(scene, ["rod.tip"], 0.5, 0.01, method),
        lambda step: exudyn_pendulum(pair, step, 0.5, 0.01, gravity),
        steps,
    )


def slidercrank_case(kind: str, modes: int, steps: tuple[float, ...], end: float) -> Case:
    """The slider and the middle of the rod."""
    pair = rod(kind, modes)
    scene = slidercrank_scene(pair.body)
    return Case(
        f"slider-crank, {kind} interfaces, slider and middle of the rod over {end:g} s",
        pair,
        lambda method: ours(scene, ["slider.pin", "rod.middle"], end, 1e-3, method),
        lambda step: exudyn_slidercrank(pair, step, end, 1e-3),
        steps,
    )


def distance(a: Array, b: Array) -> float:
    """Largest distance of a point over all output times [m]."""
    return float(np.linalg.norm((a - b).reshape(len(a), -1, 3), axis=2).max())


def extrapolated(runs: list[Array]) -> Array:
    """Step zero from the last two runs of a method of order two, the last with half the step."""
    return (4 * runs[-1] - runs[-2]) / 3


def resolving(case: Case) -> RK4:
    """RK4 with the finest step of the case, or a smaller one that resolves the fastest mode."""
    fastest = float(np.sqrt(case.pair.body.omega2.max()))
    return RK4(case.steps[-1] / np.ceil(case.steps[-1] * fastest / 0.35))


def compare(case: Case) -> float:
    """Print the table of one case; the difference at step zero [m]."""
    us, them = [case.ours(ROS2(step)) for step in case.steps], [case.theirs(step) for step in case.steps]
    fine, their_limit = case.ours(resolving(case)), extrapolated(them)
    print(f"\n{case.title}, n = {case.pair.body.n}\n{'step [s]':>12}{'ours [m]':>14}{'Exudyn [m]':>14}")
    for step, a, b in zip(case.steps, us, them, strict=True):
        print(f"{step:12.3g}{distance(a, their_limit):14.2e}{distance(b, fine):14.2e}")
    print(f"{'0':>12}{distance(extrapolated(us), their_limit):14.2e}{distance(fine, their_limit):14.2e}", flush=True)
    return distance(fine, their_limit)


def print_integrals(pair: Twin) -> None:
    """One line: how far the inertia terms of the two codes are apart."""
    terms = "  ".join(f"{name} {value:.0e}" for name, value in integral_differences(pair).items())
    print(f"\nrelative differences of the terms: {terms}")


def main() -> None:
    quick = "--quick" in sys.argv[1:]
    modes, count = (2, 3) if quick else (8, 4)
    steps = tuple(1e-4 / 2**k for k in range(count))
    for kind in ("rigid", "mean"):
        case = pendulum_case(kind, modes, steps)
        print_integrals(case.pair)
        compare(case)
    print("\nwith LoadMassProportional in Exudyn, which leaves out the weight's moment of the deformation:", end="")
    compare(pendulum_case("rigid", modes, steps, mass_proportional))
    for kind in ("rigid", "mean"):
        case = slidercrank_case(kind, modes, tuple(8e-6 / 2**k for k in range(count)), 0.084)
        print_integrals(case.pair)
        compare(case)
    if not quick:
        compare(slidercrank_case("rigid", modes, (4e-6, 2e-6, 1e-6), 0.5))


if __name__ == "__main__":
    main()
