"""The scenes that both codes are given: a flexible pendulum, a slider-crank, a chain of links, a body that flies free.

The bodies are those of the meshes in `meshes/`, with everything another code needs to build the same body: nodes, finite
element matrices and the modes at the nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from threadpoolctl import threadpool_limits

import ffr_prep as fp
from ffr_dyn.functions.time_functions import polynomial
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import FlexibleBody, rigid_body, with_point
from ffr_prep.mesh.mesh import read_mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import ReferenceConditions, SimplySupported, functionals
from ffr_prep.reduction.basis import factorised
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.solids.assembly import assemble, vector_mass
from ffr_prep.solids.model import nodal_basis

Array = np.ndarray

MESHES = Path(__file__).resolve().parent.parent / "meshes"
GRAVITY = (0.0, -9.81, 0.0)
CRANK_SPEED = 150.0  # rad/s


@dataclass(frozen=True)
class MeshedBody:
    """A reduced body with its mesh: points (N, 3) [m], K and M (3N, 3N), Phi (N, 3, n) [1/sqrt(kg)]."""

    body: FlexibleBody
    points: Array
    K: sp.csr_array
    M: sp.csr_array
    Phi: Array


def meshed_body(
    mesh_name: str, name: str, material: Material, ends: tuple[str, str], kind: str, modes: int,
    reference: ReferenceConditions | None = None, linear: bool = False,
) -> MeshedBody:  # fmt: skip
    """Reduce a mesh with two interfaces of one kind by `modes` fixed-interface modes; by default simply supported."""
    mesh = read_mesh(MESHES / mesh_name)
    regions = [InterfaceRegion(end, kind=kind) for end in ends]
    conditions = SimplySupported(*ends) if reference is None else reference
    method = CraigBampton(modes)
    meshed = fp.from_mesh(mesh, material, regions)
    body = fp.reduce(meshed, fp.Request(name=name, reference=conditions, reduction=method, linear=linear))
    with threadpool_limits(1):  # as fp.reduce: bit for bit the same modes, also where frequencies are double
        matrices, model = assemble(mesh, material), meshed.coupled
        Phi = nodal_basis(model, method.basis(model, factorised(model), functionals(conditions, model)))
    return MeshedBody(body, mesh.points, matrices.K, vector_mass(matrices.m), Phi)


@cache
def pendulum_rod(
    kind: str, modes: int, reference: ReferenceConditions | None = None, linear: bool = False
) -> MeshedBody:
    """Plate strip of 1.2 m, E = 7e10 Pa, interfaces "hinge" and "tip"."""
    metal = Material("metal", 7e10, 0.3, 5540.0)
    return meshed_body("pendulum.geo", "rod", metal, ("hinge", "tip"), kind, modes, reference, linear)


@cache
def connecting_rod(kind: str, modes: int) -> MeshedBody:
    """Round steel bar of 0.3 m, interfaces "crankpin" and "slider"."""
    steel = Material("steel", 2e11, 0.3, 7870.0)
    return meshed_body("slidercrank_rod.geo", "rod", steel, ("crankpin", "slider"), kind, modes)


def with_middle(body: FlexibleBody) -> FlexibleBody:
    """The rod with a marker "middle" between its two interfaces."""
    ends = [interface.position for interface in body.interfaces]
    return with_point(body, "middle", (ends[0] + ends[1]) / 2)


def pendulum(rod: FlexibleBody) -> Scene:
    """Released at rest from horizontal."""
    hinge = Joint("hinge", "revolute", "ground.O", "rod.hinge")
    return Scene((Body("rod", rod),), (hinge,), ground={"O": rod.interface("hinge").position}, gravity=GRAVITY)


def slider_crank(rod: FlexibleBody) -> Scene:
    """Rigid crank of 0.15 m at constant speed, flexible rod of 0.3 m, slider of half the rod's mass; no gravity."""
    crank = rigid_body(
        "crank", mass=0.1, inertia=np.full(3, 1e-4), centre_of_mass=np.array([0.075, 0, 0]),
        points={"hub": np.zeros(3), "pin": np.array([0.15, 0, 0])},
    )  # fmt: skip
    slider = rigid_body("slider", mass=rod.mass / 2, inertia=np.full(3, 1e-5), points={"pin": np.zeros(3)})
    bodies = (
        Body("crank", crank),
        Body("rod", rod, position=(0.15, 0, 0)),
        Body("slider", slider, position=(0.45, 0, 0)),
    )
    joints = (
        Joint("bearing", "revolute", "ground.O", "crank.hub"),
        Joint("crankpin", "revolute", "crank.pin", "rod.crankpin"),
        Joint("wrist", "revolute", "rod.slider", "slider.pin"),
        Joint("guide", "translational", "ground.O", "slider.pin", axis=(1, 0, 0)),
    )
    return Scene(bodies, joints, (Driver("motor", "bearing", polynomial(0.0, CRANK_SPEED)),), ground={"O": (0, 0, 0)})


def free_body(link: FlexibleBody) -> Scene:
    """A body thrown with spin about all axes."""
    return Scene((Body("link0", link, velocity=(1, 2, 0.5), omega_bar=(1.0, -2.0, 3.0)),), gravity=GRAVITY)


def chain(link: FlexibleBody, count: int, kind: str) -> Scene:
    """`count` equal links in a row, the first held by the ground, released at rest; `kind` of joint: axis z if it has one."""
    start, end = (link.interfaces[k] for k in (0, 1))
    bodies = [Body(f"link{k}", link, position=k * (end.position - start.position)) for k in range(count)]
    before = ["ground.O"] + [f"link{k}.{end.name}" for k in range(count - 1)]
    joints = [Joint(f"joint{k}", kind, before[k], f"link{k}.{start.name}") for k in range(count)]
    return Scene(tuple(bodies), tuple(joints), ground={"O": start.position}, gravity=GRAVITY)
