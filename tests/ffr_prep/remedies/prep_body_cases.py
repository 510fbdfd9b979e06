"""What is said of bodies that contradict themselves, of their parts, pictures and second order, and of their exchange."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
import scipy.optimize
from boxes import STEEL, box_mesh
from matrix_models import rod
from prep_remedy import box, raising, reduced, with_files, with_part
from said import Case
from synthetic import cloud

import ffr_prep as fp
from ffr_prep.body import cut_names
from ffr_prep.body.mean_axis import _check
from ffr_prep.body.planar import in_plane
from ffr_prep.body.reduced import QuadraticField
from ffr_prep.interchange import common_format
from ffr_prep.interchange.formats import EXCHANGE_FORMATS, export_body, import_body
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.reduction import second_order
from ffr_prep.report import integrals, mode_pictures
from ffr_prep.solids.assembly import assemble
from ffr_prep.solids.reference_regions import at_regions
from ffr_prep.solids.surface_regions import region_triangles

p = partial
LEFT, RIGHT = InterfaceRegion("left"), InterfaceRegion("right")


# ---- integrals, surfaces, planes -------------------------------------------------------------------------------------

CLOUD = cloud(3, points=4, stiffness=50.0)
FRAME = rod(fp.rectangle(0.02, 0.05), 1.0, 4)
BAR = fp.from_frame(FRAME, [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")])
ROD = fp.reduce(BAR, fp.Request(name="rod", reference=fp.MeanAxis(), reduction=fp.Eigenmodes(4), stress=True))
SOLID = reduced(LEFT, RIGHT, linear=False)
PLATE = reduced(LEFT, RIGHT)
FORM = fp.mean_axis_form(SOLID)


def asymmetric() -> np.ndarray:
    """PP_dm whose trace is sound, and which is not symmetric."""
    PP_dm = np.array(CLOUD.PP_dm)
    PP_dm[0, 1, 0, 1] += 1e-3
    return PP_dm


def surface(**how: object) -> Case:
    return Case(p(replace, ROD.surface, **how), p(replace, ROD.surface, points=ROD.surface.points))


def moving(rounding: float) -> fp.FlexibleBody:
    """A body of one mode, which is a translation along x but for this."""
    body, share = rigid_ball(), 1.0 + rounding
    shape = share * np.array([[1.0], [0.0], [0.0]]) / np.sqrt(body.mass)
    PP_dm = np.zeros((3, 3, 1, 1))
    PP_dm[0, 0] = 1.0
    return replace(
        body,
        P_dm=body.mass * shape,
        rP_dm=body.r_dm[:, None, None] * shape,
        PP_dm=PP_dm,
        omega2=[1.0],
        stiffening=np.zeros((12, 1, 1)),
    )


def rigid_ball() -> fp.FlexibleBody:
    return fp.rigid_body("ball", mass=2.0, inertia=(1, 1, 1))


INTEGRALS = [
    Case(lambda: fp.mean_axis_form(moving(1e-9)), lambda: fp.mean_axis_form(SOLID)),
    Case(p(replace, CLOUD, PP_dm=asymmetric()), p(replace, CLOUD, PP_dm=CLOUD.PP_dm)),
    surface(second=QuadraticField(np.zeros((2, 3, 1)), np.zeros((1, 4, 4)))),
    surface(Phi=ROD.surface.Phi[..., :2], stress=None, moduli=None, second=None, second_stress=None),
    Case(p(fp.with_point, replace(SOLID, surface=replace(SOLID.surface, second=None)), "p", (0.5, 0.1, 0.05)),
         p(fp.with_point, replace(SOLID, stiffening=None), "p", (0.5, 0.1, 0.05))),
    Case(p(_check, SOLID, replace(FORM.body, P_dm=FORM.body.P_dm + 1e-3)), p(_check, SOLID, FORM.body)),
    Case(p(in_plane, replace(CLOUD, omega2=CLOUD.omega2[:1], **{k: getattr(CLOUD, k)[..., :1] for k in ("P_dm", "rP_dm")},
                             PP_dm=1e-7 * np.diag([0, 0, 1.0])[..., None, None] + np.diag([1 - 1e-7, 0, 0])[..., None, None],
                             interfaces=(), surface=None)), p(in_plane, ROD)),
]  # fmt: skip

# ---- parts -----------------------------------------------------------------------------------------------------------

LONG = box_mesh("hex8", (1.0, 0.1, 0.1), (6, 1, 1))
HALVES = reduced(LEFT, RIGHT, mesh=LONG, parts=2, reduction=fp.Guyan())
ONE, OTHER = HALVES.parts


def parted(*parts: fp.FlexibleBody) -> Case:
    return Case(p(replace, HALVES, parts=parts), p(replace, HALVES, parts=(ONE, OTHER)))


def moved_cut() -> fp.FlexibleBody:
    name = cut_names(1)[0]
    return replace(ONE, interfaces=tuple(replace(i, position=i.position + 0.1) if i.name == name else i
                                         for i in ONE.interfaces))  # fmt: skip


def bent(normal: tuple[float, float, float]) -> object:
    """Three parts, the planes of which meet in the body or not."""
    mesh = box_mesh("hex8", (1.0, 0.4, 0.1), (8, 4, 1))
    planes = [fp.CutPlane((0.5, 0, 0), (1, 0, 0)), fp.CutPlane((0.7, 0, 0), normal)]
    return reduced(LEFT, RIGHT, mesh=mesh, parts=planes, reduction=fp.Guyan())


PARTS = [
    parted(ONE),
    parted(replace(ONE, mass=2 * ONE.mass), OTHER),
    parted(moved_cut(), OTHER),
    Case(p(bent, (1, 0.6, 0)), p(bent, (1, 0, 0))),
]

# ---- ties ------------------------------------------------------------------------------------------------------------

MEAN, TOP = InterfaceRegion("end", "right", "mean"), InterfaceRegion("top", kind="mean")


def tied(one: tuple[InterfaceRegion, ...], other: tuple[InterfaceRegion, ...], *ties: tuple[str, str]) -> fp.Model:
    parts = {name: fp.from_mesh(box(), STEEL, regions) for name, regions in (("one", one), ("two", other)) if regions}
    return fp.tied(parts, ties)


def alone(region: InterfaceRegion) -> object:
    return tied((RIGHT, region), (), ("one.right", f"one.{region.name}"))


JOINED = p(tied, (LEFT, MEAN), (LEFT,), ("one.end", "two.left"))
TIES = [
    Case(p(tied, (MEAN,), (MEAN,), ("one.end", "two.end")), JOINED),
    Case(p(alone, TOP), p(alone, InterfaceRegion("far", "left", "mean"))),
    Case(p(tied, (LEFT,), (RIGHT,)), JOINED),
]

# ---- second order, pictures, solids ----------------------------------------------------------------------------------


def turned(at: str) -> object:
    """A body whose frame is held at a point, which earlier versions gave no load matrices, or at an interface."""
    body = fp.with_point(SOLID, "middle", (0.5, 0.2, 0.1))
    stiffening = np.array(body.stiffening)
    stiffening[-6:] = 0.0
    return fp.with_reference(replace(body, stiffening=stiffening), fp.FixedTo(at))


def pictured(error: Exception | None, **modules: object) -> object:
    """Pictures of a body where VTK fails, is not there, or is not asked for."""
    plotter = raising(error) if error else None
    with patch.dict(sys.modules, modules):
        return (
            mode_pictures.shot(type("pyvista", (), {"Plotter": plotter}), None, ())
            if error
            else mode_pictures.off_screen()
        )


WANTED = p(reduced, LEFT, RIGHT, linear=False)
DRAWN = p(mode_pictures._drawable, PLATE, [1])
TRIANGLES = p(region_triangles, box(), PLATE, "top")
INSIDE = replace(box(), face_groups={**box().face_groups, "within": (np.array([[4, 5, 6, 7]]),)})
REST = [
    Case(
        lambda: with_part(second_order, "MOST", 1e4, WANTED),
        lambda: with_part(second_order, "MOST", 1e4, lambda: reduced(LEFT)),
    ),
    Case(p(turned, "middle"), p(turned, "left")),
    Case(
        lambda: with_part(
            integrals, "_MOST_COORDINATES", 3, lambda: integrals.in_full(fp.nodal_integrals(FRAME), "I9")
        ),
        p(fp.nodal_integrals, FRAME),
    ),
    Case(p(pictured, RuntimeError("no display")), DRAWN),
    Case(p(pictured, None, pyvista=None), DRAWN),
    Case(lambda: assemble(replace(box(), points=box().points * [1, 1, -1]), STEEL), p(assemble, box(), STEEL)),
    Case(p(at_regions, box(), [LEFT], fp.FixedTo("lft")), p(at_regions, box(), [LEFT], fp.FixedTo("left"))),
    Case(p(region_triangles, INSIDE, PLATE, "within"), TRIANGLES),
]

# ---- exchange --------------------------------------------------------------------------------------------------------

BESIDE = cloud(4)


def exported(body: fp.FlexibleBody = BESIDE, name: str = "new.fem", surface: bool = True, **how: object) -> object:
    return with_files(lambda: export_body(body, Path(name), surface, how), {})


def one_way(way: str, act: object) -> object:
    """Do it where MBDyn's format lacks a way."""
    with patch.dict(EXCHANGE_FORMATS.entries, MBDyn=replace(EXCHANGE_FORMATS.entries["MBDyn"], **{way: None})):
        return act()


CALLED = replace(BESIDE, interfaces=tuple(replace(i, name=f"surface-{k}") for k, i in enumerate(BESIDE.interfaces, 1)))
LUMPED = p(exported, kind="legacy", surface=False)
DEPENDENT = np.ones((3, 3))
SID = p(exported, name="new.SID_FEM")
FAILING = raising(RuntimeError("too many iterations"))
EXCHANGE = [
    Case(p(one_way, "write", exported), SID),
    Case(
        p(one_way, "read", lambda: with_files(lambda: import_body(Path("full.fem")), {})),
        lambda: with_files(lambda: import_body(Path("body.sid")), {}),
    ),
    Case(p(exported, CALLED), exported),
    Case(lambda: with_part(common_format, "MANY_MOMENTS", 100, p(exported, kind="legacy")), exported),
    Case(lambda: with_part(scipy.optimize, "nnls", FAILING, p(exported, kind="legacy")), p(exported, surface=False)),
    Case(
        lambda: common_format.normal_coordinates(DEPENDENT, np.eye(3)),
        lambda: common_format.normal_coordinates(np.eye(3), np.eye(3)),
    ),
    Case(
        lambda: fp.rigid_body("a", mass=1.0, inertia=(1, 1, 1), points=[(0, 0, 0)]),  # type: ignore[arg-type]
        lambda: fp.rigid_body("a", mass=1.0, inertia=(1, 1, 1), points={"pin": (0, 0, 0)}),
    ),
    Case(
        lambda: fp.rigid_body("a", mass=1.0, inertia=(1, (1, 2), 1)),  # type: ignore[arg-type]
        lambda: fp.rigid_body("a", mass=1.0, inertia=(1, 1, 1)),
    ),
    Case(lambda: fp.damped(CLOUD, ratios=0.01), lambda: fp.damped(CLOUD, ratios=[0.01])),  # type: ignore[arg-type]
    Case(
        lambda: fp.with_reference(CLOUD, "mean-axis"),  # type: ignore[arg-type]
        lambda: fp.with_reference(CLOUD, fp.MeanAxis()),
    ),
]
CASES = INTEGRALS + PARTS + TIES + REST + EXCHANGE
