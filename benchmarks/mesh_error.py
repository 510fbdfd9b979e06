"""The error of its mesh that a body tells, against the true one by a fine mesh: `python -m benchmarks.mesh_error`.

For each mesh, how much higher its frequencies are than those of a fine one of second-order elements, number by number, and
what the body says of them. Elements of first order may exchange modes: where the true number is odd, look at its neighbours.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import ffr_prep as fp
from ffr_prep.body import mesh_errors_of

ROD = "Box(1) = {0, 0, 0, 200, 10, 10};"
PLATE = """
Box(1) = {0, 0, 0, 100, 60, 8};
Cylinder(2) = {30, 30, -1, 0, 0, 10, 12};
Cylinder(3) = {75, 30, -1, 0, 0, 10, 6};
BooleanDifference(4) = {Volume{1}; Delete;}{Volume{2, 3}; Delete;};
"""
BRICKS = """
Rectangle(1) = {0, 0, 0, 10, 10};
Rotate {{0, 1, 0}, {0, 0, 0}, -Pi/2} { Surface{1}; }
Transfinite Curve{:} = ACROSS + 1;
Transfinite Surface{1};
Recombine Surface{1};
Extrude {200, 0, 0} { Surface{1}; Layers{ALONG}; Recombine; }
"""
MODES = 8


def bricks(across: int) -> str:
    return BRICKS.replace("ACROSS", str(across)).replace("ALONG", str(10 * across))


Mesh = tuple[str, str, float, int]  # label, geometry, size [mm], order
ROD_MESHES: list[Mesh] = [
    ("tet10, 1.6 mm", ROD, 1.6, 2),
    *((f"tet10, {size:g} mm", ROD, size, 2) for size in (20.0, 10.0, 5.0, 2.5)),
    *((f"tet4, {size:g} mm", ROD, size, 1) for size in (10.0, 5.0, 2.5)),
    *((f"hex8, {10 / n:g} mm", bricks(n), 50.0, 1) for n in (1, 2, 4)),
    *((f"hex27, {10 / n:g} mm", bricks(n), 50.0, 2) for n in (1, 2, 4)),
]
PLATE_MESHES: list[Mesh] = [
    ("tet10, 2.5 mm", PLATE, 2.5, 2),
    *((f"tet10, {size:g} mm", PLATE, size, 2) for size in (16.0, 8.0, 4.0)),
    *((f"tet4, {size:g} mm", PLATE, size, 1) for size in (8.0, 4.0)),
]


def reduced(geometry: str, size: float, order: int) -> fp.FlexibleBody:
    """The part clamped at x = 0, meshed with that size [mm]."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "part.geo"
        path.write_text(f'SetFactory("OpenCASCADE");\n{geometry}\n')
        mesh = fp.read_mesh(path, unit="mm", size=size, order=order)
    model = fp.from_mesh(mesh, fp.material("steel"), [fp.InterfaceRegion("root", "plane x=0")])
    request = fp.Request(name="part", reference=fp.FixedTo("root"), reduction=fp.Eigenmodes(MODES))
    return fp.reduce(model, request)


def compare(name: str, meshes: list[Mesh]) -> None:
    """Prints a line for each mesh; the first is the truth."""
    print(f"{name}: per cent too high, true and told, of modes {[2**k for k in range(MODES.bit_length())]}")
    truth = reduced(meshes[0][1], meshes[0][2], meshes[0][3]).frequencies
    for label, geometry, size, order in meshes[1:]:
        body = reduced(geometry, size, order)
        told = mesh_errors_of(body.provenance)
        pairs = [(100 * (body.frequencies[k - 1] / truth[k - 1] - 1), 100 * told[k]) for k in told]
        print(f"  {label:14}", "   ".join(f"{true:8.3f} {said:8.3f}" for true, said in pairs), flush=True)


if __name__ == "__main__":
    compare("rod 200 x 10 x 10 mm", ROD_MESHES)
    compare("plate with bores", PLATE_MESHES)
