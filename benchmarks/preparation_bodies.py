"""The bodies of `benchmarks.preparation`."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

import ffr_prep as fp
from ffr_prep.body import FlexibleBody, truncated
from ffr_prep.body.planar import in_plane
from ffr_prep.mesh.mesh import Block, Mesh, read_mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis, ReferenceConditions, SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.reduction.methods.guyan import Guyan
from ffr_prep.reduction.methods.inertia_relief import InertiaRelief
from ffr_prep.reduction.methods.union import Union
from ffr_prep.reduction.selection import Band
from ffr_prep.structures.frame import Member, Shell, joined, named, panel, polyline, triangulated
from ffr_prep.structures.sections import Section, circle, general, rectangle, shear_rigid, with_mass_moments

Array = np.ndarray

MESHES = Path(__file__).resolve().parent.parent / "meshes"
STEEL = Material("steel", 2.1e11, 0.3, 7850.0)
ROD_STEEL = Material("steel", 2e11, 0.3, 7870.0)
UNCONTRACTED = replace(STEEL, nu=0.0)  # a clamp would hinder its contraction across
ENDS = [InterfaceRegion("root"), InterfaceRegion("tip")]


def thin(section: Section) -> Section:
    """Rigid in shear, without rotary inertia of bending in the x'y' plane."""
    return with_mass_moments(shear_rigid(section), section.Iy, 0.0)


def box(size: tuple[float, float, float], cells: tuple[int, int, int]) -> Mesh:
    """A box of 27-node hexahedra from the origin."""
    numbers = dict(zip("xyz", size, strict=True)) | dict(zip(("nx", "ny", "nz"), map(float, cells), strict=True))
    return read_mesh(MESHES / "box.geo", numbers=numbers)


# ---- frames -------------------------------------------------------------------------------------------------------


def tree() -> tuple[FlexibleBody, float, Array, Array]:
    """Beams of four sections in arbitrary directions, one off its nodes; mass, first and second moments of their prisms."""
    rng = np.random.default_rng(7)
    sections = [
        rectangle(0.04, 0.02),
        circle(0.03),
        replace(rectangle(0.02, 0.05), offset=(0.03, -0.02)),
        rectangle(0.01, 0.01),
    ]
    corners = np.cumsum(rng.normal(size=(5, 3)), axis=0)
    parts, mass, first, second = [], 0.0, np.zeros(3), np.zeros((3, 3))
    for section, ends in zip(sections, pairwise(corners), strict=True):
        across = rng.normal(size=3)
        parts.append(polyline([tuple(end) for end in ends], Member(section, STEEL, tuple(across)), elements=3))
        m, centre, spread = _prism(np.array(ends), section, across)
        mass, first, second = mass + m, first + m * centre, second + m * (spread + np.outer(centre, centre))
    body = fp.reduce(
        fp.from_frame(joined(*parts), []), fp.Request(name="tree", reference=MeanAxis(), reduction=Eigenmodes(6))
    )
    return body, mass, first, second


def _prism(ends: Array, section: Section, across: Array) -> tuple[float, Array, Array]:
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    x = along / length
    y = across - across @ x * x
    y /= np.linalg.norm(y)
    z = np.cross(x, y)
    spread = np.outer(x, x) * length**2 / 12 + (np.outer(y, y) * section.Iz + np.outer(z, z) * section.Iy) / section.A
    return STEEL.rho * section.A * length, ends.mean(axis=0) + section.offset[0] * y + section.offset[1] * z, spread


def ring_of_beams(elements: int) -> FlexibleBody:
    """A ring of radius 1 m, its modes in its plane."""
    turn = 2 * np.pi * np.arange(elements + 1) / elements
    corners = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    corners[-1] = corners[0]
    section = with_mass_moments(shear_rigid(rectangle(0.02, 0.002)), 0.02**3 * 0.002 / 12, 0.0)
    sides = [
        polyline([tuple(a), tuple(b)], Member(section, STEEL, tuple((a + b) / 2)), elements=1)
        for a, b in pairwise(corners)
    ]
    body = fp.reduce(
        fp.from_frame(joined(*sides), []), fp.Request(name="ring", reference=MeanAxis(), reduction=Eigenmodes(6))
    )
    return in_plane(body)


def rod_of_beams(modes: int, *, axial: bool) -> float:
    """First frequency of a clamped-free rod of 1 m, in its unit: axial, or of bending in one plane."""
    if axial:
        section = with_mass_moments(general("bar", A=1e-4, Iy=1e-3, Iz=1e-3, J=1e-3), 1e-12, 1e-12)
        unit = np.sqrt(STEEL.E / STEEL.rho)
    else:
        section = with_mass_moments(general("beam", A=1e-4, Iy=1e-6, Iz=1e-9, J=1e-8), 1e-12, 0.0)
        unit = np.sqrt(STEEL.E * section.Iz / (STEEL.rho * section.A))
    frame = polyline([(0, 0, 0), (1.0, 0, 0)], Member(section, STEEL, (0, 1.0, 0)), elements=300 if axial else 60)
    body = fp.reduce(
        fp.from_frame(named(frame, root=(0, 0, 0), tip=(1.0, 0, 0)), ENDS),
        fp.Request(name="rod", reference=FixedTo("root"), reduction=CraigBampton(modes)),
    )
    return float(np.sqrt(body.omega2[0]) / unit)


def slider_crank_rod(elements: int, modes: int) -> FlexibleBody:
    """The rod of 0.3 m and 6 mm, simply supported, with stiffening."""
    frame = polyline(
        [(0, 0, 0), (0.3, 0, 0)], Member(slider_crank_section(), ROD_STEEL, (0, 1.0, 0)), elements=elements
    )
    return fp.reduce(
        fp.from_frame(
            named(frame, crankpin=(0, 0, 0), slider=(0.3, 0, 0)),
            [InterfaceRegion("crankpin"), InterfaceRegion("slider")],
        ),
        fp.Request(name="rod", reference=SimplySupported("crankpin", "slider"), reduction=CraigBampton(modes)),
    )


def slider_crank_section() -> Section:
    """A circle of 6 mm."""
    return thin(circle(0.006))


def pendulum_rod() -> FlexibleBody:
    """The rod of the flexible pendulum, 1.2 m x 0.2 m x 9 mm, with stiffening."""
    member = Member(thin(rectangle(0.2, 0.009)), Material("metal", 7e10, 0.3, 5540.0), (0, 1.0, 0))
    frame = polyline([(0, 0, 0), (1.2, 0, 0)], member, elements=40)
    return fp.reduce(
        fp.from_frame(named(frame, root=(0, 0, 0), tip=(1.2, 0, 0)), ENDS),
        fp.Request(name="rod", reference=SimplySupported("root", "tip"), reduction=CraigBampton(20)),
    )


def spin_up_beam() -> FlexibleBody:
    """L = 10 m, EA = 2.8e7, k G A = 1e7, EI = 1.4e4, rho A = 1.2, rho I = 6e-4; clamped at the root."""
    section = Section("beam", A=1.0, Iy=5e-4, Iz=5e-4, J=1e-3, ky=1e7 * 2.6 / 2.8e7, kz=1e7 * 2.6 / 2.8e7)
    frame = polyline(
        [(0, 0, 0), (10.0, 0, 0)], Member(section, Material("beam", 2.8e7, 0.3, 1.2), (0, 1.0, 0)), elements=30
    )
    return fp.reduce(
        fp.from_frame(named(frame, root=(0, 0, 0), tip=(10.0, 0, 0)), ENDS),
        fp.Request(name="beam", reference=FixedTo("root"), reduction=Eigenmodes(12)),
    )


# ---- beams, plates and solids ----------------------------------------------------------------------------------------


def rotating(kind: str) -> tuple[FlexibleBody, float]:
    """A cantilever along x of three modes in each plane, and the square of its unit of frequency for deflection along z."""
    if kind == "beams":
        section = with_mass_moments(general("rod", A=1.0, Iy=1e-6, Iz=1.1e-6, J=1e-6), 1e-9, 0.0)
        frame = polyline([(0, 0, 0), (1.0, 0, 0)], Member(section, STEEL, (0, 1.0, 0)), elements=45)
        body = fp.reduce(
            fp.from_frame(named(frame, root=(0, 0, 0)), ENDS[:1]),
            fp.Request(name="beam", reference=FixedTo("root"), reduction=Eigenmodes(10)),
        )
        unit = STEEL.E * 1e-6 / STEEL.rho
    else:
        mesh = box((1.0, 0.0101, 0.01), (24, 1, 1))
        mesh = replace(mesh, points=mesh.points - (0, 0.00505, 0.005))
        body = fp.reduce(
            fp.from_mesh(mesh, UNCONTRACTED, [InterfaceRegion("left")]),
            fp.Request(name="bar", reference=FixedTo("left"), reduction=Eigenmodes(10)),
        )
        unit = UNCONTRACTED.E * 0.01**2 / 12 / UNCONTRACTED.rho
    chosen = [np.flatnonzero(body.PP_dm[c, c].diagonal() > 0.9)[:3] for c in (1, 2)]
    return truncated(body, np.sort(np.concatenate(chosen))), unit


def three_theories() -> list[tuple[FlexibleBody, Array]]:
    """A cantilever of beams, quadrilaterals, triangles and solids, each with the numbers of two modes of bending along z."""
    L, B, H = 1.0, 0.06, 0.02
    beam = polyline([(0, 0, 0), (L, 0, 0)], Member(rectangle(H, B), UNCONTRACTED, (0, 1.0, 0)), elements=30)
    sheet = panel(
        [(0, -B / 2, 0), (L, -B / 2, 0), (L, B / 2, 0), (0, B / 2, 0)], Shell(H, UNCONTRACTED), elements=(30, 2)
    )
    sheet = replace(sheet, node_groups={"root": np.flatnonzero(sheet.points[:, 0] < 1e-9)})
    mesh = box((L, B, H), (20, 1, 1))
    root = {"name": "b", "reference": FixedTo("root"), "reduction": Eigenmodes(6)}
    bodies = [
        fp.reduce(fp.from_frame(named(beam, root=(0, 0, 0)), ENDS[:1]), fp.Request(**root)),
        fp.reduce(fp.from_frame(sheet, ENDS[:1]), fp.Request(**root)),
        fp.reduce(fp.from_frame(triangulated(sheet), ENDS[:1]), fp.Request(**root)),
        fp.reduce(
            fp.from_mesh(
                replace(mesh, points=mesh.points - (0, B / 2, H / 2)), UNCONTRACTED, [InterfaceRegion("root", "left")]
            ),
            fp.Request(**root),
        ),
    ]
    return [(body, np.flatnonzero(body.PP_dm[2, 2].diagonal() > 0.9)[:2]) for body in bodies]


def bar() -> tuple[FlexibleBody, float]:
    """A solid cantilever of 1 m x 20 mm x 20 mm and its sag under gravity along -y, by closed form."""
    body = fp.reduce(
        fp.from_mesh(
            box((1.0, 0.02, 0.02), (20, 1, 1)), UNCONTRACTED, [InterfaceRegion("left"), InterfaceRegion("right")]
        ),
        fp.Request(name="bar", reference=FixedTo("left"), reduction=Union((Guyan(), InertiaRelief()))),
    )
    return body, UNCONTRACTED.rho * 9.81 / (8 * UNCONTRACTED.E * 0.02**2 / 12)


def thin_ring(rich: bool) -> tuple[FlexibleBody, float]:
    """A solid ring of radius 1 m, with or without the shapes of inertia relief, and its growth by the square of its spin."""
    width, cells = 0.02, 40
    flat = box((1.0, width, width), (cells, 1, 1))
    angle, r = 2 * np.pi * flat.points[:, 0], 1.0 + width / 2 - flat.points[:, 1]
    points = np.stack([r * np.cos(angle), r * np.sin(angle), flat.points[:, 2]], axis=1)
    _, first, index = np.unique(points.round(9) + 0.0, axis=0, return_index=True, return_inverse=True)
    blocks = tuple(Block(block.kind, index.ravel()[block.nodes]) for block in flat.blocks)
    body = fp.reduce(
        fp.from_mesh(Mesh(points[first], blocks, {"ring": np.arange(cells)}, {}, {}), STEEL, ()),
        fp.Request(
            name="ring",
            reference=MeanAxis(),
            reduction=Union((Eigenmodes(4), InertiaRelief())) if rich else Eigenmodes(4),
            quality=Band(1.0, 50.0),
        ),
    )
    return body, STEEL.rho / STEEL.E


def strip(kind: str, reference: ReferenceConditions) -> FlexibleBody:
    """A strip of 1 m whose height is along y, of beams or solids, with stiffening."""
    make = {"name": "strip", "reference": reference}
    if kind == "beams":
        section = shear_rigid(general("strip", A=1e-3, Iy=1e-9, Iz=1e-4, J=4e-9))
        frame = polyline([(0, 0, 0), (1.0, 0, 0)], Member(section, STEEL, (0, 1.0, 0)), elements=40)
        frame = named(frame, root=(0, 0, 0), tip=(1.0, 0, 0))
        return fp.reduce(fp.from_frame(frame, ENDS), fp.Request(reduction=CraigBampton(24), **make))
    mesh = box((1.0, 0.06, 0.005), (20, 2, 1))
    ends = [InterfaceRegion("root", "left"), InterfaceRegion("tip", "right")]
    mesh = replace(mesh, points=mesh.points - (0, 0.03, 0.0025))
    return fp.reduce(fp.from_mesh(mesh, UNCONTRACTED, ends), fp.Request(reduction=CraigBampton(16), **make))
