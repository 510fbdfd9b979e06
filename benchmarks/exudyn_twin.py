"""A scene of `ffr_dyn` built again in Exudyn: the same bodies, joints, drivers and initial state.

A flexible body becomes an ObjectFFRFreducedOrder. Its interfaces are made of three massless nodes: a small star
about the interface that moves as phi_t + phi_r x arm, so that the mean motion which a MarkerSuperElementRigid takes of
them is the motion of the interface, whether that is rigid (RBE2) or mean (RBE3) on the mesh. One more massless node is the
centre of mass of the deformed body. Gravity acts there: the LoadMassProportional of Exudyn 1.13 takes the lever of gravity
from the undeformed body, which leaves out the moment (I3 q) x g (see `twin`, gravity_on).

Revolute joints about z, spherical joints, translational joints along x and drivers of constant speed on a revolute joint
between the ground and a rigid body are translated; that is what the benchmarks need.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
import scipy.sparse as sp
from exudyn import itemInterface as items  # noqa: N813
from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface
from exudyn.rigidBodyUtilities import GetRigidBodyNode

from benchmarks.scenes import MeshedBody
from ffr_dyn.equations.layout import layout
from ffr_dyn.functions.rotation import rotation_matrix
from ffr_dyn.functions.time_functions import evaluate
from ffr_dyn.scene.joints import frames
from ffr_dyn.scene.scene import GROUND, Scene, joint_of
from ffr_prep.body import FlexibleBody, Interface

Array = np.ndarray

EULER_PARAMETERS = "NodeType.RotationEulerParameters"
ROTATION_VECTOR = "NodeType.RotationRotationVector"
TAIT_BRYAN = "NodeType.RotationRxyz"

CENTRE_OF_MASS, UNDEFORMED_BODY = "centre of mass", "undeformed body"  # where gravity acts
EXPONENTIAL_MAP = 2  # rotation of a marker on flexible nodes, as here, with its tangent map

_ANGLES = 2 * np.pi / 3 * np.arange(3)
ARMS = 0.01 * np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES), 0 * _ANGLES])  # m; their length does not matter


@dataclass(frozen=True)
class Twin:
    """The assembled system, and the numbers of what it consists of."""

    container: Any
    mbs: Any
    bodies: dict[str, dict[str, int]]
    markers: dict[str, int]


# ---- flexible bodies ----------------------------------------------------------------------------------------------


def star_motion(interface: Interface) -> Array:
    """(3, 3, n) motion of the nodes of the star on an interface."""
    turned = np.cross(interface.phi_r.T[None, :, :], ARMS[:, None, :])  # (node, n, 3)
    return interface.phi_t[None] + turned.transpose(0, 2, 1)


def massless_nodes(body: FlexibleBody) -> tuple[Array, Array]:
    """Positions (N, 3) and motion (N, 3, n) of the centre of mass and of the stars on all interfaces."""
    positions = [body.centre_of_mass[None], *(i.position + ARMS for i in body.interfaces)]
    motions = [body.I3[None] / body.mass, *(star_motion(i) for i in body.interfaces)]
    return np.concatenate(positions), np.concatenate(motions)


def fem_interface(meshed: MeshedBody) -> FEMinterface:
    """Nodes, finite element matrices and modes of a body, followed by its massless nodes."""
    positions, motions = massless_nodes(meshed.body)
    empty = sp.csr_matrix((positions.size, positions.size))
    fem = FEMinterface()
    fem.nodes = {"Position": np.vstack([meshed.points, positions])}
    fem.massMatrix = sp.csr_matrix(sp.block_diag([meshed.M, empty]))
    fem.stiffnessMatrix = sp.csr_matrix(sp.block_diag([meshed.K, empty]))
    Phi = np.concatenate([meshed.Phi, motions])
    fem.modeBasis = {"matrix": Phi.reshape(-1, meshed.body.n), "type": "HCBmodes"}
    return fem


def mass_terms(body: FlexibleBody) -> dict[str, Array]:
    """The mass terms that ObjectFFRFreducedOrder asks for, from the inertia integrals of a body.

    With tilde(a) b = a x b:  tilde^T = -tilde, so mPsiTildePsi = -I5, mPsiTildePsiTilde = -I9, mXRefTildePsi = -I4 and
    mXRefTildePsiTilde = -I8; mPhitTPsi = I3, mPhitTPsiTilde = tilde(I3).
    """
    n = body.n
    tilde = np.cross(np.eye(3), body.I3.T[:, None, :])  # (n, 3, 3): transposed, that is row c = e_c x I3_j
    return {
        "massMatrixReduced": body.I6,
        "stiffnessMatrixReduced": np.diag(body.omega2),
        "totalMass": np.array(body.mass),
        "inertiaLocal": body.I7,
        "chiU": body.centre_of_mass,
        "mPsiTildePsi": -body.I5.transpose(1, 0, 2).reshape(3 * n, n),
        "mPsiTildePsiTilde": -body.I9.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n),
        "mPhitTPsi": body.I3,
        "mPhitTPsiTilde": -tilde.transpose(2, 0, 1).reshape(3, 3 * n),
        "mXRefTildePsi": -body.I4,
        "mXRefTildePsiTilde": -body.I8.transpose(1, 0, 2).reshape(3, 3 * n),
    }


def lean_interface(body: FlexibleBody, node_type: str) -> ObjectFFRFreducedOrderInterface:
    """The body without its mesh: only its massless nodes, and the mass terms of `mass_terms`. Exudyn's fastest."""
    cms = ObjectFFRFreducedOrderInterface()
    positions, motions = massless_nodes(body)
    for key, value in mass_terms(body).items():
        setattr(cms, key, float(value) if key == "totalMass" else value)
    cms.modeBasis = motions.reshape(-1, body.n)
    cms.xRef = positions.ravel()
    cms.trigList, cms.postProcessingModes = [], {}
    cms.nModes, cms.dim3D = body.n, 3
    cms.rigidBodyNodeType = _node_type(node_type)
    return cms


def _node_type(name: str) -> Any:
    return getattr(exu.NodeType, name.partition(".")[2])


def _add_flexible(
    mbs: Any, cms: ObjectFFRFreducedOrderInterface, scene: Scene, b: int, x: Array, v: Array
) -> dict[str, int]:
    place = layout(scene)
    A = rotation_matrix(x[place.p(b)])
    added = cms.AddObjectFFRFreducedOrder(
        mbs,
        positionRef=list(x[place.R(b)]),
        initialVelocity=list(v[place.R_dot(b)]),
        rotationMatrixRef=A,
        initialAngularVelocity=list(A @ v[place.omega(b)]),
    )
    mbs.SetNodeParameter(added["nGenericODE2"], "initialCoordinates", list(x[place.q(b)]))
    mbs.SetNodeParameter(added["nGenericODE2"], "initialCoordinates_t", list(v[place.q_dot(b)]))
    number, n = added["oFFRFreducedOrder"], scene.bodies[b].model.n
    mbs.SetObjectParameter(number, "massMatrixReduced", _sparse(np.eye(n)))  # without rounding off the diagonal: faster
    if scene.bodies[b].damping.any():
        rates = 2 * scene.bodies[b].damping * np.sqrt(scene.bodies[b].model.omega2)
        mbs.SetObjectParameter(number, "dampingMatrixReduced", _sparse(np.diag(rates)))
    return {"object": number, "node": added["nRigidBody"], "modes": added["nGenericODE2"]}


def _sparse(matrix: Array) -> Any:
    held = exu.MatrixContainer()
    held.SetWithDenseMatrix(matrix, useDenseMatrix=False)
    return held


def _add_gravity(mbs: Any, scene: Scene, b: int, number: int, node: int | None) -> None:
    """Gravity on a body, at a mesh node of it if given."""
    if not any(scene.gravity):
        return
    if node is None:
        at = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=number))
        mbs.AddLoad(items.LoadMassProportional(markerNumber=at, loadVector=list(scene.gravity)))
        return
    at = mbs.AddMarker(
        items.MarkerSuperElementPosition(bodyNumber=number, meshNodeNumbers=[node], weightingFactors=[1.0])
    )
    mbs.AddLoad(items.LoadForceVector(markerNumber=at, loadVector=list(scene.bodies[b].model.mass * scene.gravity)))


def _interface_markers(mbs: Any, scene: Scene, b: int, number: int, first: int) -> dict[str, int]:
    """Markers "body.interface"; `first`: mesh node with which the stars begin."""
    body, count = scene.bodies[b], len(ARMS)
    found = {}
    for k, interface in enumerate(body.model.interfaces):
        nodes = list(range(first + k * count, first + (k + 1) * count))
        marker = items.MarkerSuperElementRigid(
            bodyNumber=number,
            meshNodeNumbers=nodes,
            weightingFactors=[1 / count] * count,
            rotationsExponentialMap=EXPONENTIAL_MAP,
        )
        found[f"{body.name}.{interface.name}"] = mbs.AddMarker(marker)
    return found


# ---- rigid bodies, joints, drivers --------------------------------------------------------------------------------


def _add_rigid(mbs: Any, scene: Scene, b: int, x: Array, v: Array) -> dict[str, int]:
    place, model = layout(scene), scene.bodies[b].model
    A = rotation_matrix(x[place.p(b)])
    node = mbs.AddNode(
        GetRigidBodyNode(
            _node_type(TAIT_BRYAN),
            position=list(x[place.R(b)]),
            velocity=list(v[place.R_dot(b)]),
            rotationMatrix=A,
            angularVelocity=list(A @ v[place.omega(b)]),
        )
    )
    J = model.inertia
    body = items.ObjectRigidBody(
        mass=model.mass,
        centerOfMass=list(model.centre_of_mass),
        inertia=[J[0, 0], J[1, 1], J[2, 2], J[1, 2], J[0, 2], J[0, 1]],
        nodeNumber=node,
    )
    number = mbs.AddObject(body)
    _add_gravity(mbs, scene, b, number, None)
    return {"object": number, "node": node}


def _point_markers(mbs: Any, scene: Scene, b: int, number: int) -> dict[str, int]:
    body = scene.bodies[b]
    return {
        f"{body.name}.{i.name}": mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=number, localPosition=list(i.position)))
        for i in body.model.interfaces
    }


def _ground_markers(mbs: Any, scene: Scene) -> dict[str, int]:
    ground = mbs.AddObject(items.ObjectGround())
    return {
        f"{GROUND}.{name}": mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=ground, localPosition=list(at)))
        for name, at in scene.ground.items()
    }


def _add_joints(mbs: Any, scene: Scene, markers: Mapping[str, int]) -> None:
    makers = {
        ("revolute", 2): items.ObjectJointRevoluteZ,
        ("spherical", 2): items.ObjectJointSpherical,
        ("translational", 0): items.ObjectJointPrismaticX,
    }
    for joint in scene.joints:
        axis = int(np.argmax(np.abs(frames(joint)[0][:, 2])))
        mbs.AddObject(makers[joint.kind, axis](markerNumbers=[markers[joint.i], markers[joint.j]]))


def _add_drivers(mbs: Any, scene: Scene, bodies: Mapping[str, Mapping[str, int]]) -> None:
    """The third Tait-Bryan angle of a body that turns about the ground's z axis, at constant speed."""
    for driver in scene.drivers:
        joint = joint_of(scene, driver)
        node = bodies[joint.j.partition(".")[0]]["node"]
        speed = evaluate(driver.function, 0.0)[1]
        fixed = mbs.AddNode(items.NodePointGround())
        at = [mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=n, coordinate=c)) for n, c in ((fixed, 0), (node, 5))]
        mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=at, offset=speed, velocityLevel=True))


# ---- the whole scene ----------------------------------------------------------------------------------------------


def twin(
    scene: Scene,
    x: Array,
    v: Array,
    meshed: Mapping[str, MeshedBody] | None = None,
    *,
    node_type: str = EULER_PARAMETERS,
    gravity_on: str = CENTRE_OF_MASS,
) -> Twin:
    """The scene at the state (x, v) in Exudyn.

    meshed    : for each flexible body that brings its mesh; the others consist of their interfaces and mass terms
    node_type : rotation parameters of flexible bodies
    gravity_on: the deformed body's CENTRE_OF_MASS, or the UNDEFORMED_BODY as Exudyn's own LoadMassProportional does
    """
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    bodies, markers = {}, _ground_markers(mbs, scene)
    for b, body in enumerate(scene.bodies):
        if body.model.n == 0:
            bodies[body.name] = _add_rigid(mbs, scene, b, x, v)
            markers |= _point_markers(mbs, scene, b, bodies[body.name]["object"])
            continue
        cms, first = lean_interface(body.model, node_type), 0
        if meshed is not None and body.name in meshed:
            cms = ObjectFFRFreducedOrderInterface(fem_interface(meshed[body.name]), rigidBodyNodeType=node_type)
            first = len(meshed[body.name].points)
        bodies[body.name] = added = _add_flexible(mbs, cms, scene, b, x, v)
        _add_gravity(mbs, scene, b, added["object"], first if gravity_on == CENTRE_OF_MASS else None)
        markers |= _interface_markers(mbs, scene, b, added["object"], first + 1)
    _add_joints(mbs, scene, markers)
    _add_drivers(mbs, scene, bodies)
    return Twin(container, mbs, bodies, markers)


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Without what Exudyn prints of steps that fail."""
    exu.config.printToConsole = False
    try:
        yield
    finally:
        exu.config.printToConsole = True


def settings(end: float, steps: int) -> Any:
    """Simulation settings without any output, one thread, dense linear algebra."""
    s = exu.SimulationSettings()
    s.timeIntegration.endTime = end
    s.timeIntegration.numberOfSteps = steps
    s.timeIntegration.verboseMode = 0
    s.timeIntegration.newton.relativeTolerance = 1e-10
    s.timeIntegration.newton.absoluteTolerance = 1e-12
    s.solution.file.write = False
    s.parallel.numberOfThreads = 1
    return s


def motion(
    made: Twin, end: float, steps: int, rows: int, solver: Any, points: Sequence[str], nodes: Mapping[str, int]
) -> dict[str, Array]:
    """Positions (rows + 1, 3) of markers and of mesh nodes (body -> number, under the name "body.node")."""
    position = exu.OutputVariableType.Position
    sensors: dict[str, Any] = {
        name: items.SensorMarker(
            markerNumber=made.markers[name], outputVariableType=position, storeInternal=True, writeToFile=False
        )
        for name in points
    }
    for body, node in nodes.items():
        sensors[f"{body}.node"] = items.SensorSuperElement(
            bodyNumber=made.bodies[body]["object"], meshNodeNumber=node, outputVariableType=position,
            storeInternal=True, writeToFile=False,
        )  # fmt: skip
    numbers = {name: made.mbs.AddSensor(sensor) for name, sensor in sensors.items()}
    made.mbs.Assemble()
    s = settings(end, steps)
    s.solution.sensors.writePeriod = end / rows
    made.mbs.SolveDynamic(s, solverType=solver)
    return {name: made.mbs.GetSensorStoredData(number)[:, 1:] for name, number in numbers.items()}
