"""What scenes, their bodies in parts and what one registers say."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from functools import cache, partial
from unittest.mock import patch

import numpy as np
from boxes import STEEL, box_mesh
from ffr_gallery.bodies import beam
from remedy import CLOUD, DOUBLE, HINGED, run
from said import Case
from synthetic import cloud

import ffr_dyn as fd
from ffr_dyn.analyses import registry
from ffr_dyn.analyses.linearise import Linearise
from ffr_dyn.analyses.registry import OfMoment, register_analysis
from ffr_dyn.analyses.settings import MomentSettings
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.integrators import METHODS, RK4, ROS2, register_integrator
from ffr_dyn.kernels.simd.force_kernel import force_kernel, kernel_of
from ffr_dyn.kernels.tables import Tables, Vector
from ffr_dyn.scene import force_kinds, joints
from ffr_dyn.scene.couplings import Coupling
from ffr_dyn.scene.force_kinds import register_force
from ffr_dyn.scene.forces import Bushing, JointSpring, Load, ModalForce, NodalForces, Pressure
from ffr_dyn.scene.joints import Joint, register_joint
from ffr_dyn.scene.parts import as_declared
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene_file.write import to_toml
from ffr_dyn.variants.variant import vary
from ffr_prep.body import FlexibleBody, rigid_body
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo
from ffr_prep.pipelines.reduce import Request, reduce
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.solids.model import from_mesh

p = partial

# ---- forces, joints and planes ------------------------------------------------------------------------------------------


def forced(*forces: object, scene: Scene = CLOUD) -> object:
    return run(replace(scene, forces=forces), end=0.01)


def exchanged(model: FlexibleBody, values: tuple[float, ...], other: FlexibleBody) -> Scene:
    scene = replace(CLOUD, bodies=(Body("cloud", model),), forces=(ModalForce("f", "cloud", values),))
    return vary(scene, models={"cloud": other})


def geared(ratio: float) -> Scene:
    tooth = Coupling("gear", "hinge0.angle", "hinge1.angle", ratio)
    return assemble(replace(DOUBLE, couplings=(tooth,)))


def tied(i: str) -> object:
    return forced(Bushing("b", i, "bar.b", (1.0,) * 6), scene=HINGED)


def flat(plane: str) -> object:
    return run(replace(HINGED, gravity=(0, 0, -9.81), plane=plane), end=0.01)


def older(*, stiffening: bool) -> object:
    """A body whose file knows no matrices of its end, at which a load acts."""
    model = beam("strip", 1.0, 1.0, 100.0, 2)
    known = np.repeat([i.name != "b" for i in model.interfaces], 6)
    model = replace(model, stiffening=model.stiffening * np.concatenate([np.ones(12), known])[:, None, None])
    body = Body("strip", model, stiffening=stiffening)
    joint, push = Joint("hinge", "revolute", "ground.O", "strip.a"), Load("push", "strip.b", force=(0, 1.0, 0))
    return assemble(Scene((body,), (joint,), ground={"O": (0, 0, 0)}, loads=(push,)))


def placed(**how: object) -> object:
    return run(replace(HINGED, bodies=(replace(HINGED.bodies[0], **how),)), end=0.01)


def slim(inertia: float) -> object:
    model = rigid_body("needle", mass=1.0, inertia=(inertia, 0.1, 0.1), points={"a": (0, 0, 0)})
    return assemble(replace(HINGED, bodies=(Body("bar", model),), plane="none"))


SIZE = len(cloud(2).surface.points)
SCENES = [
    Case(p(run, replace(CLOUD, plane="z"), end=0.01), p(run, replace(CLOUD, plane="none"), end=0.01)),
    Case(p(exchanged, cloud(2), (1.0, 1.0), cloud(3)), p(exchanged, cloud(3), (1.0, 1.0, 1.0), cloud(3))),
    Case(p(forced, Pressure("p", "bar", 1.0), scene=HINGED),
         lambda: run(replace(HINGED, loads=(Load("p", "bar.b", force=(0, 1.0, 0)),)))),
    Case(p(tied, "bar.a"), p(tied, "ground.O")),
    Case(p(forced, Pressure("p", "cloud", [1.0])), p(forced, Pressure("p", "cloud", [1.0] * SIZE))),
    Case(p(forced, Pressure("p", "cloud", 1.0, triangles="top")), p(forced, Pressure("p", "cloud", 1.0))),
    Case(p(forced, Pressure("p", "cloud", 1.0, triangles=[9])), p(forced, Pressure("p", "cloud", 1.0, triangles=[0]))),
    Case(p(geared, np.pi), p(geared, 22 / 7)),
    Case(p(flat, "z"), p(flat, "none")),
    Case(p(older, stiffening=True), p(older, stiffening=False)),
    *(Case(p(placed, **wrong), p(placed, rotation=(0, 0, 0.1))) for wrong in (
        {"position": (1e200, 0, 0)}, {"velocity": (np.nan, 0, 0)}, {"omega_bar": (0, 0, 1e300)},
        {"rotation": (1e300, 0, 0)}, {"rotation": (1e7, 0, 0)})),
    Case(lambda: replace(HINGED, gravity=(0, 1e300, 0)), lambda: replace(HINGED, gravity=(0, -9.81, 0))),
    Case(p(Coupling, "c", "hinge0.angle", "hinge0.angle", 2.0), p(geared, 2.0)),
    Case(p(run, HINGED, end=1e9), p(run, HINGED, end=0.01)),
    Case(p(slim, 0.0), p(slim, 0.1)),
]  # fmt: skip

# ---- bodies in parts ----------------------------------------------------------------------------------------------------


@cache
def bar(*, broken: bool = False) -> FlexibleBody:
    """Of two parts, the surface of the second one elsewhere if it is broken."""
    mesh = box_mesh("hex8", (1.0, 0.06, 0.04), (4, 1, 1))
    model = from_mesh(mesh, STEEL, [InterfaceRegion("root", "left"), InterfaceRegion("tip", "right")])
    request = Request(name="bar", reference=FixedTo("root"), reduction=CraigBampton(1), linear=True, parts=2)
    whole = reduce(model, request)
    one, two = whole.parts
    surface = replace(two.surface, points=two.surface.points + 0.01)
    return replace(whole, parts=[one, replace(two, surface=surface)]) if broken else whole


def clamped(*forces: object, model: FlexibleBody | None = None, **more: object) -> Scene:
    body = Body("bar", bar() if model is None else model, **more)
    return Scene((body,), (Joint("c", "fixed", "ground.O", "bar.root"),), ground={"O": (0, 0, 0)}, forces=forces)


def moved(shift: float) -> object:
    one, two = clamped().bodies
    return as_declared((one, replace(two, position=two.position + shift)))


def loaded(body: str, count: int = 14) -> object:
    return run(clamped(ModalForce("f", body, np.ones(count))), end=0.01)


def count() -> int:
    return clamped().bodies[0].model.n


POINTS = np.arange(20)
SOME = NodalForces("f", "bar_2", POINTS[:8], np.ones((8, 3)))
SOME = NodalForces("f", "bar_2", POINTS[:8], np.ones((8, 3)))
AT_ALL = NodalForces("f", "bar", POINTS, np.ones((20, 3)))
PARTS = [
    Case(lambda: clamped(q=np.ones(bar().n)), lambda: run(clamped(), end=0.01)),
    Case(lambda: clamped(damping=np.arange(bar().n)), lambda: run(clamped(damping=0.1), end=0.01)),
    Case(p(moved, 0.1), p(moved, 0.0)),
    Case(lambda: loaded("bar"), lambda: loaded("bar_1", count())),
    Case(lambda: run(clamped(AT_ALL, model=bar(broken=True))),
         lambda: run(clamped(SOME, model=bar(broken=True)))),
    Case(lambda: run(clamped(Pressure("p", "bar", 1.0), model=bar(broken=True))),
         lambda: run(clamped(Pressure("p", "bar_2", 1.0), model=bar(broken=True)))),
]  # fmt: skip

# ---- what one registers -------------------------------------------------------------------------------------------------


class Twin(JointSpring):
    """With the word of its parent."""


class OwnSpring(JointSpring):
    """With a word of its own."""

    word = "own-spring"


class Static(OfMoment):
    """With the name of another analysis."""


class Sag(OfMoment):
    """With a name of its own."""


def declared(r: Tables, k: int, x: Vector, f: Vector) -> int:
    return 0


def undeclared(k: int) -> int:
    return 0


def registered(register: object, *given: object) -> object:
    """Registered while this lasts."""
    tables = (registry._REGISTERED, METHODS, joints.KINDS, joints.COORDINATES, joints.NEEDS)
    with ExitStack() as stack:
        for table in tables:
            stack.enter_context(patch.dict(table))
        stack.enter_context(patch.object(force_kinds, "FORCES", list(force_kinds.FORCES)))
        return register(*given)


def own(wrong: tuple[object, ...], right: tuple[object, ...]) -> Case:
    return Case(p(registered, *wrong), p(registered, *right))


def written(*inputs: object) -> str:
    return to_toml(HINGED, MomentSettings(analysis=Linearise(inputs=inputs)))


MOTOR = fd.JointEffort("m", "hinge")
OWN = [
    own((register_force, Twin), (register_force, OwnSpring)),
    own((register_analysis, int), (register_analysis, Sag)),
    own((register_analysis, Static), (register_analysis, Sag)),
    own((register_integrator, "mine", int), (register_integrator, "mine", RK4)),
    own((register_integrator, "rk4", ROS2), (register_integrator, "mine", ROS2)),
    own((register_joint, "revolute", joints.spherical), (register_joint, "mine", joints.spherical)),
    own((kernel_of, undeclared), (kernel_of, force_kernel(declared))),
    own((kernel_of, force_kernel(undeclared)), (kernel_of, force_kernel(declared))),
    Case(p(written, "push", MOTOR), p(written, MOTOR, "push")),
    Case(p(fd.table, [0.0], [1.0]), p(fd.table, [0.0, 1.0], [1.0, 1.0])),
    Case(p(fd.table, [0.0, 2.0, 1.0], [1.0, 2.0, 3.0]), p(fd.table, [0.0, 1.0, 2.0], [1.0, 3.0, 2.0])),
    Case(p(fd.piecewise, [0.0, 1.0], [1.0, 2.0]), p(fd.piecewise, [0.0, 1.0], [[1.0, 2.0]])),
]
CASES = SCENES + PARTS + OWN
