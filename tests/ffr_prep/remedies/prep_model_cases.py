"""What is said of materials, interfaces, reference conditions, cuts, reductions and the bodies that come of them."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np
from boxes import STEEL, box_mesh
from matrix_models import rod
from prep_remedy import box, edited, reduced, samples, with_files
from said import Case
from synthetic import cloud

import ffr_prep as fp
from ffr_prep.body import cut_names
from ffr_prep.body.planar import in_plane
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Rows, parse_material
from ffr_prep.model.model import Model
from ffr_prep.model.reference import at_interfaces
from ffr_prep.reduction.second_order import check_size
from ffr_prep.reduction.selection import selection_of
from ffr_prep.report.integrals import chosen, integral
from ffr_prep.report.mode_pictures import mode_pictures
from ffr_prep.report.quality_pictures import quality_pictures
from ffr_prep.solids.surface_regions import region_triangles

p = partial

# ---- materials -------------------------------------------------------------------------------------------------------

PINE = {"E": (11e9, 0.9e9, 0.5e9), "nu": (0.4, 0.4, 0.4), "G": (0.7e9, 0.6e9, 0.1e9), "rho": 500.0}
ELASTIC: Rows = tuple(map(tuple, (1e10 * np.eye(6)).tolist()))


def pine(**changes: object) -> fp.AnisotropicMaterial:
    return fp.orthotropic("pine", **{**PINE, **changes})


def crystal(C: object = ELASTIC, **more: object) -> fp.AnisotropicMaterial:
    return fp.AnisotropicMaterial("crystal", C, 500.0, **more)


def isotropic(E: float = 2e11, nu: float = 0.3, rho: float = 7850.0) -> fp.Material:
    return fp.Material("steel", E, nu, rho)


def entry(i: int, j: int, value: float) -> list[list[float]]:
    C = np.array(ELASTIC)
    C[i, j] = value
    return C.tolist()


MATERIALS = [
    *(Case(p(isotropic, **wrong), isotropic) for wrong in ({"E": -1}, {"nu": 0.6}, {"rho": 0}, {"rho": 7.85e-9})),
    Case(p(fp.Shell, 1e-3, pine()), p(fp.Shell, 1e-3, STEEL)),
    Case(p(pine, G=(0, 1, 1)), pine),
    Case(p(pine, nu=(0.4, 0.4, 4.0)), pine),
    Case(p(crystal, "stiff"), crystal),
    Case(p(crystal, np.eye(3)), crystal),
    Case(p(crystal, entry(0, 1, 1e9)), crystal),
    Case(p(crystal, entry(5, 5, -1e9)), crystal),
    Case(p(crystal, axes=((1, 0, 0), (2, 0, 0))), p(crystal, axes=((1, 0, 0), (0, 1, 0)))),
    Case(p(parse_material, "stele"), p(parse_material, "steel")),
    Case(p(parse_material, "E=2e11,nu=0.3"), p(parse_material, "E=2e11,nu=0.3,rho=7850")),
    Case(p(parse_material, "E=2e11,E=2e11,nu=0.3"), p(parse_material, "E=2e11,nu=0.3,rho=7850")),
    Case(p(parse_material, "E=x,nu=0.3,rho=1e3"), p(parse_material, "E=2e11,nu=0.3,rho=1e3")),
    edited(lambda path: parse_material(str(path)), "material.toml", ("E1 = 1.4e11", 'E1 = "stiff"')),
    edited(lambda path: parse_material(str(path)), "material.toml", ("E1 = 1.4e11", "E1 = [1.4e11]")),
]

# ---- interfaces, conditions, cuts ------------------------------------------------------------------------------------

LEFT, RIGHT = InterfaceRegion("left"), InterfaceRegion("right")


def solids(*interfaces: object, mesh: fp.Mesh | None = None) -> Model:
    return fp.from_mesh(mesh or box(), STEEL, interfaces)


def held(reference: object) -> fp.FlexibleBody:
    return reduced(LEFT, RIGHT, reference=reference)


def supports(count: int) -> fp.Supports:
    six = [fp.Support("left", kind, tuple(axis)) for kind in ("translation", "rotation") for axis in np.eye(3)]
    return fp.Supports(tuple(six[:count]))


def on_nodes(value: float, count: int = 12) -> fp.UserConditions:
    rows = np.zeros((6, count, 3))
    rows[range(6), [0, 0, 0, 8, 8, 2], [0, 1, 2, 1, 2, 2]] = value
    return fp.UserConditions(rows)


@cache
def long() -> fp.Mesh:
    return box_mesh("hex8", (1.0, 0.1, 0.1), (6, 1, 1))


def cut(parts: object, *interfaces: InterfaceRegion, mesh: fp.Mesh | None = None) -> fp.FlexibleBody:
    return reduced(*(interfaces or (LEFT, RIGHT)), mesh=mesh or long(), parts=parts, reduction=fp.Guyan())


def requested(**flags: object) -> object:
    return fp.Request(name="bar", reference=fp.FixedTo("root"), reduction=fp.Guyan(), **flags)


def placed(conditions: fp.FixedTo) -> object:
    """Where two interfaces lie in one plane."""
    return at_interfaces(conditions, ("one", "other"), np.zeros((2, 3)))


PLANE = fp.CutPlane((0.5, 0, 0), (1, 0, 0))
HALVES = p(cut, 2)
CONDITIONS = [
    Case(p(InterfaceRegion, "a", kind="stiff"), p(InterfaceRegion, "a", kind="mean")),
    Case(p(InterfaceRegion, "a", point=(0, 0)), p(InterfaceRegion, "a", point=(0, 0, 0))),
    Case(p(held, fp.FixedTo("lift")), p(held, fp.FixedTo("left"))),
    Case(p(placed, fp.FixedTo("plane x=0")), p(placed, fp.FixedTo("one"))),
    Case(p(requested, linear="yes"), p(requested, linear=True)),
    Case(
        p(solids, LEFT, InterfaceRegion("side", "left", "mean")),
        p(solids, LEFT, InterfaceRegion("side", "right", "mean")),
    ),
    Case(p(solids, "left"), p(solids, LEFT)),
    Case(p(solids, LEFT, LEFT), p(solids, LEFT, RIGHT)),
    Case(p(held, supports(5)), p(held, supports(6))),
    Case(p(held, fp.SimplySupported("left", "left")), p(held, fp.SimplySupported("left", "right"))),
    Case(p(held, on_nodes(1.0, 11)), p(held, on_nodes(1.0))),
    Case(p(held, on_nodes(np.nan)), p(held, on_nodes(1.0))),
    Case(p(fp.CutPlane, (0, 0), (1, 0, 0)), p(fp.CutPlane, (0, 0, 0), (1, 0, 0))),
    *(Case(p(cut, parts), HALVES) for parts in (1, "two", [0.7, 0.3], 9)),
    Case(p(cut, 2, InterfaceRegion(cut_names(1)[0], "left")), HALVES),
    Case(p(cut, [PLANE, fp.CutPlane((0.52, 0, 0), (1, 0, 0))]), p(cut, [PLANE])),
    Case(p(cut, 2, InterfaceRegion("side", "front", "mean")), p(cut, 2, RIGHT)),
    Case(p(fp.Request, name="a", reference="mean", reduction=fp.Guyan()), p(held, fp.MeanAxis())),
    Case(p(reduced, LEFT, drawn_modes=0), p(reduced, LEFT, drawn_modes=1, linear=False)),
    Case(p(reduced, LEFT, drawn_modes=1, linear=True), p(reduced, LEFT, linear=True)),
    Case(
        p(reduced, "left", InterfaceRegion("right", point=(1e4, 0.0, 0.0))),
        p(reduced, "left", InterfaceRegion("right", point=(1.0, 0.0, 0.0))),
    ),
    Case(p(reduced, LEFT, damping=None), p(reduced, LEFT, damping=fp.Damping(beta=1e-6))),
]

# ---- reductions ------------------------------------------------------------------------------------------------------


def by(reduction: object, *interfaces: InterfaceRegion, **more: object) -> fp.FlexibleBody:
    return reduced(*(interfaces or (LEFT, RIGHT)), mesh=long(), reduction=reduction, **more)


def vectors(value: float, count: int = 28) -> fp.UserVectors:
    given = np.zeros((count, 3, 1))
    given[13 % count, 1, 0] = value
    return fp.UserVectors(given)


SHOWN = fp.Surface(np.zeros((2000, 3)), np.zeros((0, 3), int), np.zeros((2000, 3, 0)))
RUBIN = p(by, fp.Rubin(2))
REDUCTIONS = [
    Case(p(reduced, reduction=fp.CraigBampton(2)), p(reduced, reduction=fp.Eigenmodes(2))),
    Case(p(by, fp.CharacteristicModes(2, 9)), p(by, fp.CharacteristicModes(2, 6))),
    Case(p(fp.Krylov, 0), p(by, fp.Krylov(1))),
    Case(p(fp.Krylov, 1, ()), p(by, fp.Krylov(1))),
    Case(p(by, fp.Krylov(9)), p(by, fp.Krylov(1))),
    Case(p(fp.Union, ()), p(fp.Union, (fp.Guyan(),))),
    Case(p(by, vectors(1.0, 5)), p(by, vectors(1.0))),
    Case(p(by, vectors(np.inf)), p(by, vectors(1.0))),
    Case(p(by, vectors(0.0)), p(by, vectors(1.0))),
    Case(p(by, fp.CraigBampton(999)), p(by, fp.CraigBampton(3))),
    Case(p(fp.Band, 10.0, 1.0), p(fp.Band, 1.0, 10.0)),
    Case(p(fp.UpTo, 0.0), p(fp.UpTo, 10.0)),
    Case(p(fp.Accuracy, fp.Band(1, 2), 2.0), p(fp.Accuracy, fp.Band(1, 2), 0.1)),
    Case(p(fp.CraigBampton, "ten"), p(fp.CraigBampton, 10)),
    Case(p(selection_of, {"modes": 1, "frequency": 3.0}, 1), p(selection_of, {"modes": 1}, 1)),
    Case(p(reduced, reduction=fp.Eigenmodes(fp.Accuracy(fp.Band(1, 2), 0.1))), p(reduced, reduction=fp.Eigenmodes(2))),
    Case(p(check_size, 9000, 60, None, None), p(check_size, 90, 6, None, None)),
    Case(p(check_size, 300, 2, SHOWN, None), p(check_size, 300, 2, SHOWN, 60)),
    Case(p(fp.Solver, "umfpack"), p(by, fp.Guyan(), solver=fp.Solver("superlu"))),
    Case(p(fp.Solver, "cholesky", ranks=2), p(fp.Solver, "cholesky", ranks=1)),
    Case(p(by, fp.Guyan(), solver=fp.Solver("pardiso")), p(by, fp.Guyan(), solver=fp.Solver())),
    Case(
        p(reduced, InterfaceRegion("all", "left+right+front+back+top+bottom"), reduction=fp.Guyan()),
        p(reduced, InterfaceRegion("all", "left"), reduction=fp.Guyan()),
    ),
    Case(lambda: fp.with_reference(RUBIN(), on_nodes(1.0)), lambda: fp.with_reference(RUBIN(), fp.FixedTo("left"))),
]

# ---- solids ----------------------------------------------------------------------------------------------------------

FLAT = replace(box(), points=box().points * [1, 1, 0])
APART = fp.Mesh(
    np.vstack([box().points, box().points + 3]),
    (fp.Block("hex8", np.vstack([box().blocks[0].nodes, box().blocks[0].nodes + 12])),),
    {"body": np.arange(4)},
    {},
    {},
)
NODES = replace(
    box(), node_groups={"edge": np.array([0, 1]), "line": np.array([0, 4, 8]), "face": np.array([0, 1, 2, 3])}
)
OF_ONE = {"body": STEEL}
SOLIDS = [
    Case(p(fp.from_mesh, FLAT, STEEL), p(fp.from_mesh, box(), STEEL)),
    Case(p(fp.from_mesh, box(), "steel"), p(fp.from_mesh, box(), fp.material("steel"))),
    Case(p(fp.from_mesh, box(), {"arm": STEEL}), p(fp.from_mesh, box(), OF_ONE)),
    Case(
        p(fp.from_mesh, replace(box(), volume_groups={"body": np.array([0])}), OF_ONE), p(fp.from_mesh, box(), OF_ONE)
    ),
    Case(p(fp.from_mesh, APART, STEEL), p(fp.from_mesh, box(), STEEL)),
    Case(p(solids, InterfaceRegion("edge"), mesh=NODES), p(solids, InterfaceRegion("face"), mesh=NODES)),
    Case(p(solids, InterfaceRegion("line"), mesh=NODES), p(solids, InterfaceRegion("face"), mesh=NODES)),
    Case(p(solids, LEFT, InterfaceRegion("top")), p(solids, LEFT, InterfaceRegion("top", kind="mean"))),
    Case(p(solids, InterfaceRegion("letf")), p(solids, LEFT)),
]

# ---- bodies ----------------------------------------------------------------------------------------------------------

CLOUD = cloud(3, points=4, stiffness=50.0)
PLATE = reduced(LEFT, RIGHT)


def rigid(mass: float = 1.0, inertia: object = (1, 1, 1), centre: object = (0, 0, 0)) -> fp.FlexibleBody:
    return fp.rigid_body("a", mass=mass, inertia=inertia, centre_of_mass=centre)


def pointed(name: str = "a", x: float = 0.0) -> fp.FlexibleBody:
    return fp.rigid_body("a", mass=1.0, inertia=(1, 1, 1), points={name: (x, 0, 0)})


def damping(**how: object) -> fp.FlexibleBody:
    return fp.damped(CLOUD, **how)


def kept(D: np.ndarray) -> fp.FlexibleBody:
    return replace(CLOUD, damping=D)


def loaded(change: object) -> fp.FlexibleBody:
    """A body file whose arrays a function has changed."""

    def act() -> fp.FlexibleBody:
        arrays = change(dict(np.load(samples() / "body.ffr")))
        with open("other.ffr", "wb") as stream:
            np.savez(stream, **arrays)
        return fp.load_body("other.ffr")

    return with_files(act, {})


def newer(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    meta = json.loads(arrays["meta"].tobytes()) | {"format_version": 99}
    return {**arrays, "meta": np.frombuffer(json.dumps(meta).encode(), np.uint8)}


def strange(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {**arrays, "meta": np.frombuffer(b"{}", np.uint8)}


def bare(_: object) -> fp.FlexibleBody:
    def act() -> fp.FlexibleBody:
        with open("other.ffr", "wb") as stream:
            np.save(stream, np.ones(3))
        return fp.load_body("other.ffr")

    return with_files(act, {})


SOUND = p(loaded, dict)
TOP = p(region_triangles, box(), PLATE, "top")
ROD = fp.reduce(
    fp.from_frame(rod(fp.rectangle(0.02, 0.05), 1.0, 4)),
    fp.Request(name="rod", reference=fp.MeanAxis(), reduction=fp.Eigenmodes(4), linear=True),
)
SECOND = reduced(LEFT, RIGHT, linear=False)
BODIES = [
    Case(p(rigid, centre=(0, 0)), rigid),
    Case(p(rigid, -1.0), rigid),
    Case(p(rigid, 1.0, (1, 1)), rigid),
    Case(p(rigid, 1.0, (1, 1, 3)), rigid),
    Case(p(rigid, 1e308), rigid),
    *(Case(p(pointed, name), pointed) for name in ("", "a.b", "a\nb")),
    Case(p(pointed, x=1e200), pointed),
    Case(p(fp.truncated, CLOUD, 4), p(fp.truncated, CLOUD, 3)),
    Case(p(fp.truncated, CLOUD, [0, 0]), p(fp.truncated, CLOUD, [0, 1])),
    Case(p(fp.with_point, rigid(), "a", (0, 0, 0)), p(fp.with_point, PLATE, "a", (0, 0, 0))),
    Case(p(fp.with_point, PLATE, "a", (900, 0, 0)), p(fp.with_point, PLATE, "a", (0.9, 0, 0))),
    Case(p(fp.Damping, alpha=-1.0), p(fp.Damping, alpha=1.0)),
    Case(p(damping, ratios=[-1.0]), p(damping, ratios=[0.1])),
    Case(p(damping, bands=[1, 2, 3]), p(damping, bands=[(1, 0.1)])),
    Case(p(damping, bands=[(2, 0.1), (1, 0.1)]), p(damping, bands=[(1, 0.1), (2, 0.1)])),
    Case(p(kept, np.triu(np.ones((3, 3)))), p(kept, np.eye(3))),
    Case(p(kept, -np.eye(3)), p(kept, np.eye(3))),
    Case(p(fp.load_body, "/nowhere/a.ffr"), SOUND),
    Case(p(fp.load_body, "/tmp"), SOUND),
    Case(p(bare, None), SOUND),
    Case(p(loaded, lambda arrays: {"a": np.ones(1)}), SOUND),
    Case(p(loaded, strange), SOUND),
    Case(p(loaded, newer), SOUND),
    Case(p(loaded, lambda arrays: {**arrays, "omega2": arrays["omega2"][:1]}), SOUND),
    Case(p(loaded, lambda arrays: {**arrays, "omega2": -arrays["omega2"]}), SOUND),
    Case(p(loaded, lambda arrays: {**arrays, "omega2": arrays["omega2"] * np.nan}), SOUND),
    Case(p(replace, CLOUD, mass=-1.0), p(replace, CLOUD, name="b")),
    Case(p(replace, CLOUD, interfaces=CLOUD.interfaces * 2), p(replace, CLOUD, interfaces=CLOUD.interfaces)),
    Case(p(replace, CLOUD, interfaces=cloud(2).interfaces), p(replace, CLOUD, interfaces=CLOUD.interfaces)),
    Case(p(replace, CLOUD, PP_dm=2 * CLOUD.PP_dm), p(replace, CLOUD, PP_dm=CLOUD.PP_dm)),
    Case(p(replace, CLOUD, PP_dm=CLOUD.PP_dm[[1, 2, 0]][:, [1, 0, 2]]), p(replace, CLOUD, PP_dm=CLOUD.PP_dm)),
    Case(lambda: CLOUD.interface("d"), lambda: CLOUD.interface("a")),
    Case(
        p(replace, PLATE.surface, triangles=PLATE.surface.triangles + 9),
        p(replace, PLATE.surface, points=PLATE.surface.points),
    ),
    Case(
        p(replace, PLATE.surface, moduli=np.ones((len(PLATE.surface.points), 2))),
        p(replace, PLATE.surface, points=PLATE.surface.points),
    ),
    Case(
        lambda: with_files(lambda: fp.save_body(replace(CLOUD, provenance={"by": {1, 2}}), Path("a.ffr")), {}),
        lambda: with_files(lambda: fp.save_body(replace(CLOUD, provenance={"by": [1, 2]}), Path("a.ffr")), {}),
    ),
    Case(p(in_plane, ROD, (0, 0)), p(in_plane, ROD, (0, 0, 1))),
    Case(p(in_plane, CLOUD), p(in_plane, ROD)),
    Case(p(in_plane, fp.truncated(ROD, [0])), p(in_plane, ROD)),
    Case(p(fp.mean_axis_form, PLATE), p(fp.mean_axis_form, SECOND)),
    Case(p(integral, CLOUD, "I11"), p(integral, CLOUD, "I1")),
    Case(p(chosen, ["I11"]), p(chosen, ["I1"])),
    Case(p(mode_pictures, replace(CLOUD, surface=None), "/tmp"), TOP),
    Case(p(mode_pictures, PLATE, "/tmp", modes=[9]), TOP),
    Case(p(mode_pictures, PLATE, "/tmp", modes=[1], scale=0.0), TOP),
    Case(p(quality_pictures, PLATE, "/tmp"), p(reduced, LEFT, quality=fp.Band(1.0, 20.0))),
    Case(p(region_triangles, box(), CLOUD, "top"), TOP),
    Case(p(region_triangles, long(), PLATE, "top"), TOP),
    Case(
        lambda: with_files(lambda: fp.rigid_part("block.inp", -1.0), {}),
        lambda: with_files(lambda: fp.rigid_part("block.inp", 1e3), {}),
    ),
    Case(
        lambda: with_files(lambda: fp.rigid_part("block.inp", 1e3, [InterfaceRegion("patch_1")] * 2), {}),
        lambda: with_files(lambda: fp.rigid_part("block.inp", 1e3, [InterfaceRegion("patch_1")]), {}),
    ),
]

# ---- parts that are tied ---------------------------------------------------------------------------------------------

MEAN = InterfaceRegion("end", "right", "mean")


def joined(*ties: tuple[str, str], names: tuple[str, ...] = ("one", "two"), **parts: Model) -> Model:
    return fp.tied({name: parts.get(name) or solids(LEFT, MEAN) for name in names}, ties)


ONE_END = p(joined, ("one.left", "two.left"), two=solids(LEFT))
TIES = [
    Case(p(joined, ("one.end", "two.end")), ONE_END),
    Case(p(joined, ("one", "two.end")), ONE_END),
    Case(p(joined, ("one.left", "two.left"), ("one.left", "two.end")), ONE_END),
    Case(p(joined, ("one.left", "two.left")), ONE_END),
    Case(p(joined, two=solids(LEFT)), ONE_END),
]
CASES = MATERIALS + CONDITIONS + REDUCTIONS + SOLIDS + BODIES + TIES
