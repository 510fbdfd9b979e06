"""What is said of frames of beams and plates, their sections, and the curves and surfaces that they are drawn as."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
from boxes import STEEL
from matrix_models import rod
from prep_remedy import with_files
from said import Case

import ffr_prep as fp
from ffr_prep.common.entries import assignments, with_entries
from ffr_prep.structures.sections import with_mass_moments

p = partial

# ---- sections --------------------------------------------------------------------------------------------------------

RAIL = {"A": 7.7e-3, "Iy": 3e-5, "Iz": 5.1e-6, "J": 2.2e-6}


def rail(**changes: float) -> fp.Section:
    return fp.general("rail", **{**RAIL, **changes})


BAR = fp.rectangle(0.02, 0.05)
SECTIONS = [
    Case(p(fp.tube, 0.04, 0.02), p(fp.circle, 0.04)),
    Case(p(fp.box, 0.08, 0.12, 0.04), p(fp.rectangle, 0.08, 0.12)),
    Case(p(fp.i_section, 0.2, 0.1, 0.1, 0.01), p(fp.rectangle, 0.1, 0.2)),
    Case(p(fp.circle, -0.02), p(fp.circle, 0.02)),
    Case(p(rail, A=0.0), rail),
    Case(p(rail, ky=0.0), p(rail, ky=math.inf)),
    Case(p(rail, J=1.0), rail),
    Case(p(fp.shifted, BAR, math.inf, 0.0), p(fp.shifted, BAR, 0.01, 0.0)),
    Case(p(with_mass_moments, BAR, 0.0, 0.0), p(with_mass_moments, BAR, 1e-8, 0.0)),
    Case(p(fp.Member, BAR, STEEL, (0, 0, 0)), p(fp.Member, BAR, STEEL, (0, 0, 1))),
    Case(p(fp.Shell, 0.0, STEEL), p(fp.Shell, 2e-3, STEEL)),
    Case(p(fp.Shell, 2e-3, STEEL, -1.0), p(fp.Shell, 2e-3, STEEL, 0.0)),
]

# ---- entries that are given from outside -----------------------------------------------------------------------------

ENTRIES = [
    Case(p(assignments, ("section.d",)), p(assignments, ("section.d=0.02",))),
    Case(p(with_entries, {"section": {"d": 0.01}}, {"section.e": "0.02"}),
         p(with_entries, {"section": {"d": 0.01}}, {"section.d": "0.02"})),
]  # fmt: skip

# ---- frames ----------------------------------------------------------------------------------------------------------

MEMBER, SHEET = fp.Member(BAR, STEEL, (0, 1, 0)), fp.Shell(2e-3, STEEL)
LINE, SQUARE = [(0, 0, 0), (1, 0, 0)], [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
FRAME, PANEL = rod(BAR, 1.0, 2), fp.panel(SQUARE, SHEET, elements=(1, 1))


def used(frame: fp.Frame = FRAME) -> object:
    return fp.from_frame(frame)


def changed(frame: fp.Frame = FRAME, **how: object) -> Case:
    return Case(lambda: used(replace(frame, **how)), p(used, frame))


def drawn(*corners: tuple[float, float, float]) -> Case:
    return Case(lambda: used(replace(PANEL, points=np.array(corners, float))), p(used, PANEL))


AWAY = fp.polyline([(0, 0, 3), (1, 0, 3)], MEMBER, elements=1)
CLOSE = fp.polyline([(1, 0, 0), (1, 1, 0)], replace(MEMBER, orientation=(0, 0, 1)), elements=1)
LOOSE = replace(
    FRAME,
    points=np.vstack([FRAME.points, CLOSE.points]),
    elements=np.vstack([FRAME.elements, CLOSE.elements + 3]),
    member_of=np.zeros(3, int),
)
APART = replace(LOOSE, points=np.vstack([FRAME.points, AWAY.points]))
FRAMES = [
    changed(points=[[np.inf, 0, 0]] * 3),
    changed(points=[[0, 0]] * 3),
    Case(p(fp.polyline, LINE[:1], MEMBER), p(fp.polyline, LINE, MEMBER)),
    Case(p(fp.polyline, [*LINE, (np.nan, 0, 0)], MEMBER), p(fp.polyline, LINE, MEMBER)),
    Case(p(fp.polyline, LINE, MEMBER, elements=0), p(fp.polyline, LINE, MEMBER, elements=1)),
    Case(p(fp.panel, LINE, SHEET, elements=(1, 1)), p(fp.panel, SQUARE, SHEET, elements=(1, 1))),
    Case(p(fp.panel, SQUARE, SHEET, elements=(0, 1)), p(fp.panel, SQUARE, SHEET, elements=(1, 1))),
    Case(fp.joined, p(fp.joined, FRAME)),
    Case(p(fp.named, FRAME, a=(np.nan, 0, 0)), p(fp.named, FRAME, a=(0.5, 0, 0))),
    Case(p(fp.named, FRAME, a=(0.3, 0, 0)), p(fp.named, FRAME, a=(0.5, 0, 0))),
    changed(elements=np.zeros((0, 2), int), member_of=[]),
    changed(elements=FRAME.elements + 2),
    changed(member_of=FRAME.member_of + 1),
    changed(PANEL, shell_of=PANEL.shell_of + 1),
    changed(elements=FRAME.elements[:1], member_of=[0]),
    changed(node_groups={"a": []}),
    changed(elements=FRAME.elements[[0, 1, 1]], member_of=[0, 0, 0]),
    Case(p(used, LOOSE), lambda: used(fp.joined(FRAME, CLOSE))),
    Case(p(used, APART), p(used, FRAME)),
    changed(points=[(0, 0, 0), (0.5, 0, 0), (0.5, 0, 0)]),
    changed(members=(replace(MEMBER, orientation=None),)),
    changed(members=(replace(MEMBER, orientation=(1, 0, 0)),)),
    drawn((0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)),
    drawn((0, 0, 0), (0, 1, 0.5), (1, 0, 0), (1, 1, 0)),
    drawn((0, 0, 0), (0.2, 0.2, 0), (1, 0, 0), (0, 1, 0)),
    Case(
        p(fp.from_frame, FRAME, [fp.InterfaceRegion("a", "root+tip"), fp.InterfaceRegion("tip")]),
        p(fp.from_frame, FRAME, [fp.InterfaceRegion("a", "root"), fp.InterfaceRegion("tip")]),
    ),
]  # fmt: skip

# ---- drawings --------------------------------------------------------------------------------------------------------

DRAWING = """SetFactory("OpenCASCADE");
Rectangle(1) = {0, 0, 0, 1, 1};
Physical Surface("roof") = {1};
Physical Curve("edge") = {1};
MeshSize{:} = 1;
"""


def read(text: str = DRAWING, name: str = "frame.geo", **parts: object) -> object:
    return with_files(lambda: fp.read_frame(name, **parts), {name: (("", text),)})


def meshed(element: str, **parts: object) -> object:
    """A mesh of one element of gmsh, without names."""
    head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n"
    return read(f"{head}$Elements\n1\n1 {element}\n$EndElements\n", "a.msh", **parts)


SHEETS = p(read, shells={"roof": SHEET})
BARS = p(read, members={"edge": MEMBER})
DRAWINGS = [
    Case(p(read, name="frame.xyz"), BARS),
    Case(p(read, shells={"rof": SHEET}), SHEETS),
    Case(
        p(
            read,
            DRAWING + 'Rectangle(2) = {1, 0, 0, 1, 1};\nPhysical Surface("floor") = {2};\n',
            shells={"roof": SHEET},
        ),
        SHEETS,
    ),
    Case(p(read, members={"egde": MEMBER}), BARS),
    Case(p(read, DRAWING + 'Physical Curve("side") = {2};\n', members={"edge": MEMBER}), BARS),
    Case(p(meshed, "1 2 1 1 1 2", shells={"roof": SHEET}), SHEETS),
    Case(p(meshed, "2 2 1 1 1 2 3", members={"edge": MEMBER}), BARS),
    Case(p(read, "Point(1) = {0, 0, 0};\n", members={"edge": MEMBER}), BARS),
    Case(p(read, "Point(1) = {0, 0, 0};\n", shells={"roof": SHEET}), SHEETS),
    Case(p(read, members=MEMBER), BARS),
]
CASES = SECTIONS + ENTRIES + FRAMES + DRAWINGS
