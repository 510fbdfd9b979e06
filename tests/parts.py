"""Parts as files, drawn with gmsh: a plate with four bores of four faces each, and one with every kind of surface."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gmsh

BORES = ((-45, -25), (45, -25), (-45, 25), (45, 25))


def written(draw: Callable[[Any], object], path: Path, *, mesh: float | None = None) -> Path:
    """The part as a file of the kind that its ending says, in millimetres; meshed first with elements of this size."""
    gmsh.initialize(["gmsh"], readConfigFiles=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        draw(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        if mesh:
            gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 16)
            gmsh.model.mesh.setSize(gmsh.model.getEntities(0), mesh)
            gmsh.model.mesh.generate(3)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path


def plate(occ: Any) -> None:
    """120 x 80 x 10 around the origin, with bores of radius 6, each of four faces."""
    body = occ.addBox(-60, -40, -5, 120, 80, 10)
    for x, y in BORES:
        for quarter in range(4):
            tool = occ.addCylinder(x, y, -6, 0, 0, 12, 6, angle=math.pi / 2)
            occ.rotate([(3, tool)], x, y, 0, 0, 0, 1, quarter * math.pi / 2)
            body = occ.cut([(3, body)], [(3, tool)])[0][0][1]


def every_surface(occ: Any) -> None:
    """A block with a ball, a cone, a ring's groove and a bore."""
    block = occ.addBox(0, 0, 0, 60, 40, 30)
    ball, cone = occ.addSphere(60, 20, 15, 8), occ.addCone(45, 20, 30, 0, 0, 10, 8, 3)
    ring, bore = occ.addTorus(15, 20, 30, 8, 2), occ.addCylinder(30, 10, -1, 0, 0, 40, 4)
    body, _ = occ.fuse([(3, block)], [(3, ball), (3, cone)])
    occ.cut(body, [(3, ring), (3, bore)])


def fork(occ: Any) -> None:
    """Two lugs with bores on one axis y, and a step between."""
    body = occ.addBox(0, 0, 0, 40, 30, 20)
    slot, bore = occ.addBox(-1, 10, -1, 21, 10, 22), occ.addCylinder(10, -1, 10, 0, 32, 0, 5)
    occ.cut([(3, body)], [(3, slot), (3, bore)])


def stack(occ: Any) -> None:
    """A small block on a large one, which share no face."""
    occ.addBox(0, 0, 0, 40, 40, 10)
    occ.addBox(10, 10, 10, 20, 20, 10)
