"""Sound files of every format, what chance makes of them, and the readers that are to bear it.

    python tests/mutated_inputs.py FORMAT SEED FIRST LAST FOLDER

reads mutated inputs FIRST ... LAST - 1 of a format, in little memory, and prints a word for each: what became of it. It is
run as a process of its own by `tests/project/test_robustness.py` and by `benchmarks/robustness.py`.
"""

from __future__ import annotations

import contextlib
import os
import re
import select
import subprocess
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

MEMORY = 2 << 30  # bytes of address space of a reading process
PATIENCE = 10.0  # s for an input
FINE = ("read", "refused", "failed", "unforeseen")  # the last: refused by the net around a reader

NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eEdD][-+]?\d+)?")
STRANGE = (b"nan", b"-1", b"0", b"1e999", b"99999999999999999999", b"2147483648", b"4000000000", b"1e300", b"-0.0", b"inf",
           b"x", b"'", b"]", b"[[", b"{", b"=", b"*", b"\xff\xfe", b"\0", b"1e-320", b"\n\n", b"," * 9,
           b"9" * 5000)  # fmt: skip


# ---- chance ---------------------------------------------------------------------------------------------------------


def mutated(data: bytes, other: bytes, random: np.random.Generator) -> bytes:
    """One change or more: bits flipped, bytes cut out, doubled, zeroed, taken from another file, numbers replaced."""
    for _ in range(min(int(random.geometric(0.7)), 4)):
        data = _CHANGES[random.integers(len(_CHANGES))](data, other, random)
    return data


def _some(data: bytes, random: np.random.Generator) -> slice:
    start = int(random.integers(len(data) + 1))
    return slice(start, min(len(data), start + int(random.exponential(max(len(data) / 20, 4)))))


def _flipped(data: bytes, _: bytes, random: np.random.Generator) -> bytes:
    content = bytearray(data)
    for at in random.integers(len(data), size=int(random.integers(1, 9))) if data else ():
        content[at] ^= 1 << int(random.integers(8))
    return bytes(content)


def _truncated(data: bytes, _: bytes, random: np.random.Generator) -> bytes:
    return data[: int(random.integers(len(data) + 1))]


def _cut(data: bytes, _: bytes, random: np.random.Generator) -> bytes:
    part = _some(data, random)
    return data[: part.start] + data[part.stop :]


def _doubled(data: bytes, _: bytes, random: np.random.Generator) -> bytes:
    part = _some(data, random)
    return data[: part.stop] + data[part] * int(random.integers(1, 4)) + data[part.stop :]


def _zeroed(data: bytes, _: bytes, random: np.random.Generator) -> bytes:
    part = _some(data, random)
    return data[: part.start] + bytes(part.stop - part.start) + data[part.stop :]


def _spliced(data: bytes, other: bytes, random: np.random.Generator) -> bytes:
    part, taken = _some(data, random), _some(other, random)
    return data[: part.start] + other[taken] + data[part.stop :]


def _renumbered(data: bytes, _: bytes, random: np.random.Generator) -> bytes:
    found = list(NUMBER.finditer(data))
    if not found:
        return data
    at = found[random.integers(len(found))]
    return data[: at.start()] + STRANGE[random.integers(len(STRANGE))] + data[at.end() :]


def _swapped_lines(data: bytes, _: bytes, random: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    i, j = random.integers(len(lines), size=2)
    lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


_CHANGES = (
    _flipped,
    _truncated,
    _cut,
    _doubled,
    _zeroed,
    _spliced,
    _renumbered,
    _renumbered,
    _renumbered,
    _swapped_lines,
)


# ---- sound files ----------------------------------------------------------------------------------------------------

SCENE = """
name = "two links"
gravity = [0, -9.81, 0]
outputs = ["default", "*.power"]
[parameters]
length = 1.0
half = "length / 2"
[analysis]
end = 0.02
output_step = 0.01
step = 1e-3
[ground]
O = [0, 0, 0]
[bodies.one]
mass = 1.0
inertia = [0.1, 0.1, 0.1]
centre_of_mass = [0.5, 0, 0]
points = {a = [0, 0, 0], b = [1, 0, 0]}
[bodies.two]
file = "body.ffr"
position = [1, 0, 0]
damping = 0.01
[joints.hinge]
kind = "revolute"
i = "ground.O"
j = "one.a"
axis = [0, 0, 1]
[joints.ball]
kind = "spherical"
i = "one.b"
j = "two.a"
[drivers.motor]
joint = "hinge"
function = "0.1 * sin(2 * t)"
[loads.push]
marker = "two.b"
force = [{table = [[0, 1, 2], [0, 1, 0]]}, "3 N", 0]
"""
BULK = """SOL 101
BEGIN BULK
CORD2C,2,0,0.,0.,0.,0.,0.,1.,,
,1.,0.,0.
GRID*                  1               2             0.0             0.0*A
*A                   0.0
GRID,2,2,1.,0.,0.
GRID           3       2     1.0    90.0     0.0
GRID,4,,0.,0.,1.+0
CTETRA         1       1       1       2       3       4
SET1,3,1,THRU,4
PSOLID,1,1
MAT1,1,2.1+11,,.3,7850.
ENDDATA
"""
CDB = """/UNITS,SI
/PREP7
ET,1,185
ET,2,21
NBLOCK,6,SOLID,        9,        9
(3i9,6e21.13e3)
        1        0        0
        2        0        0  1.0000000000000E+00
        3        0        0  1.0000000000000E+00  1.0000000000000E+00
        4        0        0  0.0000000000000E+00  1.0000000000000E+00
        5        0        0  0.0000000000000E+00  0.0000000000000E+00  1.0000000000000E+00
        6        0        0  1.0000000000000E+00  0.0000000000000E+00  1.0000000000000E+00
        7        0        0  1.0000000000000E+00  1.0000000000000E+00  1.0000000000000E+00
        8        0        0  0.0000000000000E+00  1.0000000000000E+00  1.0000000000000E+00
        9        0        0  5.0000000000000E-01  5.0000000000000E-01  2.0000000000000E+00
N,UNBL,LOC,       -1,
EBLOCK,19,SOLID,        3,        3
(19i9)
        1        1        1        1        0        0        0        0        8        0        1        1        2        3        4        5        6        7        8
        1        1        1        1        0        0        0        0        8        0        2        5        6        7        8        9        9        9        9
        1        2        1        1        0        0        0        0        1        0        3        9
       -1
CMBLOCK,TOP,NODE,       2
(8i10)
         5        -8
FINISH
"""  # noqa: E501
FRD = """    1C
    2C                             4                                     1
 -1         1 0.00000E+00 0.00000E+00 0.00000E+00
 -1         2 1.00000E+00 0.00000E+00 0.00000E+00
 -1         3 0.00000E+00 1.00000E+00 0.00000E+00
 -1         4 0.00000E+00 0.00000E+00 1.00000E+00
 -3
    3C                             1                                     1
 -1         1    3    0    1
 -2         1         2         3         4
 -3
 9999
"""
STRUCTURE = """
reference = {kind = "fixed", interface = "foot"}
reduction = {method = "craig-bampton", modes = 2}
[members.column]
section = {shape = "rectangle", b = 0.02, h = 0.05}
material = "steel"
orientation = [0, 0, 1]
[[polylines]]
member = "column"
corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0]]
elements = 2
[nodes]
tip = [1, 1, 0]
foot = [0, 0, 0]
[interfaces.foot]
[interfaces.tip]
"""
MATERIAL = """
E1 = 1.4e11
E2 = 1e10
E3 = 1e10
nu12 = 0.3
nu13 = 0.3
nu23 = 0.4
G12 = 5e9
G13 = 5e9
G23 = 4e9
rho = 1600
"""
SUPPORTS = '[[support]]\ninterface = "a"\nmotion = "translation"\ndirection = [1.0, 0.0, 0.0]\n' * 6
SWING = """
[parameters]
stiffness = 100.0
damping = 5.0
[analysis]
end = 0.1
output_step = 0.05
step = 0.005
[ground]
O = [0, 0, 0]
[bodies.rod]
mass = 1.0
inertia = [0.01, 0.3333, 0.3333]
points.a = [0, 0, 0]
[joints.hinge]
kind = "revolute"
i = "ground.O"
j = "rod.a"
[forces.s]
kind = "joint-spring"
joint = "hinge"
stiffness = "stiffness"
damping = "damping"
"""
STUDY = """
scene = "swing.toml"
samples = 2
[parameters]
stiffness = {from = 100, to = 200, count = 2}
damping = {normal = [5.0, 0.1]}
[outputs]
turn = "hinge.angle: largest"
share = "= turn / stiffness"
"""
STEP = """ISO-10303-21;
DATA;
#1=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#3=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#1))REPRESENTATION_CONTEXT('',''));
#4=PLANE('',#5);
#7=ADVANCED_FACE('top of it',(#8),#4,.T.);
#9=CLOSED_SHELL('',(#7));
ENDSEC;
END-ISO-10303-21;
"""
SPRINGS = {
    "part.sti": "1 1 2.\n1 4 -2.\n4 4 2.\n",
    "part.mas": "".join(f"{k} {k} 1.5\n" for k in range(1, 7)),
    "part.dof": "1.1\n1.2\n1.3\n2.1\n2.2\n2.3\n",
    "part.inp": "*NODE, NSET=ALL\n1, 0., 0., 0.\n2, 1., 0., 0.\n",
}
TABLE = "# time, value\n0, 0\n0.5, 1e-3\n1, 2\n"


def make_samples(folder: Path) -> None:
    """One sound file or more of every format, and what they refer to."""
    import meshio
    import scipy.io
    from boxes import box_mesh
    from matrix_models import of_frame, rod
    from synthetic import cloud

    from ffr_dyn.analyses.forward import forward
    from ffr_dyn.integrators import ROS2
    from ffr_dyn.scene_file.read import load_scene
    from ffr_prep.body import save_body
    from ffr_prep.interchange.mbdyn import write_fem
    from ffr_prep.interchange.sid import write_sid
    from ffr_prep.matrices.npz import save_matrices
    from ffr_prep.structures.sections import rectangle

    texts = {
        "scene.toml": SCENE,
        "structure.toml": STRUCTURE,
        "material.toml": MATERIAL,
        "supports.toml": SUPPORTS,
        "table.csv": TABLE,
        "swing.toml": SWING,
        "study.toml": STUDY,
        "part.step": STEP,
        **SPRINGS,
    }
    for name, text in texts.items():
        (folder / name).write_text(text)
    _write_rich(folder)
    body = cloud(3, points=4, stiffness=50.0)
    save_body(body, folder / "body.ffr")
    write_sid(body, folder / "body.sid")
    for kind in ("legacy", "full"):
        write_fem(body, folder / f"{kind}.fem", kind=kind, surface=kind == "legacy")
    scene, _ = load_scene(folder / "scene.toml")
    forward(scene, end=0.02, output_step=0.01, method=ROS2(1e-3), path=folder / "run.nc")
    np.save(folder / "vectors.npy", np.ones((4, 3, 2)))
    model = of_frame(rod(rectangle(0.02, 0.05), 1.0, 2))
    save_matrices(model, folder / "matrices.npz")
    for name, A in (("K", model.K), ("M", model.M)):
        scipy.io.mmwrite(folder / f"{name}.mtx", A)
        _write_abaqus_matrix(folder / f"abaqus_{name}.mtx", A)
    labels = np.arange(1, len(model.points) + 1)
    rows = [
        f"{labels[n]},{c + 1},{','.join(map(str, model.points[n]))},all"
        for n, c in zip(model.nodes, model.components, strict=True)
    ]
    (folder / "rows.csv").write_text("node,component,x,y,z,groups\n" + "\n".join(rows) + "\n")
    deck = [
        "*HEADING",
        "a rod",
        "*NODE, NSET=ALL",
        *(f"{n}, {', '.join(map(str, at))}" for n, at in zip(labels, model.points, strict=True)),
    ]
    (folder / "deck.inp").write_text("\n".join([*deck, "*NSET, NSET=END, GENERATE", "1, 3, 2", ""]))
    _write_meshes(folder, box_mesh("tet10", np.array([1.0, 0.2, 0.1]), (1, 1, 1)), meshio)


def _write_rich(folder: Path) -> None:
    """A body with all that a body file may hold, the table of a study and the journal of one that goes on."""
    from matrix_models import rod

    import ffr_prep as fp
    from ffr_dyn.studies.plan import load_study
    from ffr_dyn.studies.runs import Row
    from ffr_dyn.studies.table import Journal, save_table, table

    ends = [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")]
    model = fp.from_frame(rod(fp.rectangle(0.02, 0.05), 1.0, 4), ends)
    request = fp.Request(
        name="rich",
        reference=fp.MeanAxis(),
        reduction=fp.CraigBampton(2),
        stress=True,
        parts=2,
        damping=fp.Damping(1.0),
    )
    fp.save_body(fp.reduce(model, request), folder / "rich.ffr")
    study = load_study(folder / "study.toml")
    rows = [Row(k, {"turn": 1.0, "share": 0.5}, "") for k in range(len(study.points))]
    save_table(table(study, {row.number: row for row in rows}), folder / "study.nc")
    with Journal(folder / "study.nc", study) as journal:
        journal.add(rows)


def _write_abaqus_matrix(path: Path, A) -> None:
    A = A.tocoo()
    rows = [
        f"{i // 6 + 1},{i % 6 + 1},{j // 6 + 1},{j % 6 + 1},{v:.17g}"
        for i, j, v in zip(A.row, A.col, A.data, strict=True)
    ]
    path.write_text("\n".join([*rows, ""]))


def _write_meshes(folder: Path, mesh, meshio) -> None:
    (block,) = mesh.blocks
    plain = meshio.Mesh(mesh.points, [("tetra10", block.nodes)])
    corners = meshio.Mesh(mesh.points, [("tetra", block.nodes[:, :4])])
    plain.write(folder / "mesh.vtu")
    corners.write(folder / "mesh.mesh")
    corners.write(folder / "mesh.bdf")
    corners.write(folder / "mesh.vtk")
    (folder / "fields.bdf").write_text(BULK)
    (folder / "mesh.frd").write_text(FRD)
    (folder / "mesh.cdb").write_text(CDB)
    plain.write(folder / "mesh.msh", file_format="gmsh", binary=False)
    corners.write(folder / "binary.msh", file_format="gmsh", binary=True)
    nodes = [f"{k}, {', '.join(map(str, at))}" for k, at in enumerate(mesh.points, 1)]
    cells = [f"{k}, {', '.join(map(str, of + 1))}" for k, of in enumerate(block.nodes, 1)]
    sets = [
        "*ELSET, ELSET=PART, GENERATE",
        "1, 4, 1",
        "*NSET, NSET=END",
        "1, 2, 3",
        "*SURFACE, NAME=SIDE",
        "PART, S1",
        "*MATERIAL, NAME=STEEL",
        "*ELASTIC",
        "2.1e11, 0.3",
        "*DENSITY",
        "7850.,",
        "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL",
        "",
    ]
    text = "\n".join(["*HEADING", "box", "*NODE", *nodes, "*ELEMENT, TYPE=C3D10, ELSET=ALL", *cells, *sets])
    (folder / "mesh.inp").write_text(text)


# ---- readers --------------------------------------------------------------------------------------------------------


def formats() -> dict[str, tuple[tuple[str, ...], Callable[[Path], object]]]:
    """By name: sound files, and the reader. Imported late, in the reading process."""
    from ffr_dyn.results.file import load_checkpoint, load_result
    from ffr_dyn.scene_file.read import load_scene
    from ffr_dyn.scene_file.values import _read_table
    from ffr_dyn.studies.plan import load_study
    from ffr_dyn.studies.table import Journal, load_table
    from ffr_prep.body import load_body
    from ffr_prep.cli.options import _supports
    from ffr_prep.interchange.formats import import_body
    from ffr_prep.matrices.readers import read_matrices
    from ffr_prep.mesh.geometry.step_text import face_labels, length_unit
    from ffr_prep.mesh.mesh import check_mesh, read_mesh
    from ffr_prep.model.material import parse_material
    from ffr_prep.pipelines.file_materials import file_materials, names_of_materials
    from ffr_prep.pipelines.structure_file import read_structure
    from ffr_prep.reduction.methods.user_vectors import read_user_vectors

    def beside(path: Path, *names: str) -> list[Path]:
        return [path.parent / name for name in names]

    def journalled(path: Path) -> None:
        with Journal(path.with_suffix(""), load_study(path.with_name("study.toml"))):
            pass

    def told_of_step(text: str) -> None:
        length_unit(text)
        face_labels(text, [["plane"]])

    def with_materials(path: Path) -> None:
        mesh = read_mesh(path)
        check_mesh(mesh)
        if names_of_materials(path):
            file_materials(path, mesh)

    return {
        "body": (("body.ffr",), load_body),
        "rich body": (("rich.ffr",), load_body),
        "study": (("study.toml",), load_study),
        "table of a study": (("study.nc",), load_table),
        "journal": (("study.nc.journal",), journalled),
        "result": (("run.nc",), lambda path: (load_result(path), load_checkpoint(path))),
        "scene": (("scene.toml",), load_scene),
        "structure": (("structure.toml",), read_structure),
        "material": (("material.toml",), lambda path: parse_material(str(path))),
        "supports": (("supports.toml",), _supports),
        "table": (("table.csv",), _read_table),
        "vectors": (("vectors.npy",), read_user_vectors),
        "SID": (("body.sid",), import_body),
        "MBDyn": (("legacy.fem", "full.fem"), import_body),
        "npz": (("matrices.npz",), lambda path: read_matrices([path])),
        "Matrix Market": (("K.mtx",), lambda path: read_matrices([path, *beside(path, "M.mtx", "rows.csv")])),
        "rows": (("rows.csv",), lambda path: read_matrices([*beside(path, "K.mtx", "M.mtx"), path])),
        "Abaqus matrix": (("abaqus_K.mtx",), lambda path: read_matrices([path, *beside(path, "abaqus_M.mtx", "deck.inp")])),
        "Abaqus deck": (("deck.inp",), lambda path: read_matrices([*beside(path, "abaqus_K.mtx", "abaqus_M.mtx"), path])),
        "CalculiX matrices": (
            ("part.sti", "part.mas", "part.dof", "part.inp"),
            lambda path: read_matrices(beside(path, *SPRINGS)),
        ),
        "STEP text": (("part.step",), lambda path: told_of_step(path.read_text(errors="replace"))),
        "Abaqus mesh": (("mesh.inp",), with_materials),
        "Nastran": (("mesh.bdf", "fields.bdf"), with_materials),
        "Ansys": (("mesh.cdb",), lambda path: check_mesh(read_mesh(path))),
        "CalculiX": (("mesh.frd",), lambda path: check_mesh(read_mesh(path))),
        "meshio": (("mesh.vtu", "mesh.vtk", "mesh.mesh"), lambda path: check_mesh(read_mesh(path))),
        "gmsh": (("mesh.msh", "binary.msh"), lambda path: check_mesh(read_mesh(path))),
    }  # fmt: skip


SLOW = {"gmsh": 20}  # times less inputs, where each starts a process of its own


def outcome(read: Callable[[Path], object], path: Path) -> str:
    """In a word, what became of reading a file."""
    from ffr_prep.common.errors import ComputationError, InputError

    try:
        read(path)
    except InputError as error:
        if "please report it" not in str(error):
            return "refused"
        traceback.print_exc()
        return "unforeseen"
    except ComputationError:
        return "failed"
    except BaseException as error:
        traceback.print_exc()
        return f"traceback:{type(error).__name__}"
    return "read"


def read_many(name: str, seed: int, first: int, last: int, folder: Path) -> None:
    """Print a word for every input as it is done."""
    import resource
    import warnings

    warnings.simplefilter("ignore")
    files, read = formats()[name]
    samples = [(folder / file).read_bytes() for file in files]
    others = [path.read_bytes() for path in sorted(folder.iterdir()) if path.is_file()]
    with contextlib.suppress(Exception):  # what the reader loads when it is first used
        read(folder / files[0])
    work = folder / f"work-{os.getpid()}"
    work.mkdir()
    for path in folder.iterdir():
        if path.is_file():
            (work / path.name).symlink_to(path)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for k in range(first, last):
        random = np.random.default_rng([seed, k, *name.encode()])
        which = int(random.integers(len(files)))
        target = work / files[which]
        target.unlink(missing_ok=True)
        target.write_bytes(mutated(samples[which], others[random.integers(len(others))], random))
        print(outcome(read, target), flush=True)
        target.unlink(missing_ok=True)
        target.symlink_to(folder / files[which])  # sound again, for those that are read with it


# ---- from outside ---------------------------------------------------------------------------------------------------


@dataclass
class Count:
    """Outcomes of a format, and numbers and words of those that are not FINE."""

    of: Counter[str] = field(default_factory=Counter)
    wrong: list[tuple[int, str]] = field(default_factory=list)
    slowest: float = 0.0


def count(name: str, folder: Path, number: int, seed: int = 0) -> Count:
    """Read so many mutated inputs of a format, in processes that are ended where they hang."""
    counted, done = Count(), 0
    while done < number:
        for word, seconds in _words(name, seed, done, number, folder):
            counted.of[word] += 1
            counted.slowest = max(counted.slowest, seconds)
            if word not in FINE:
                counted.wrong.append((done, word))
            done += 1
    return counted


def _words(name: str, seed: int, first: int, last: int, folder: Path) -> Iterator[tuple[str, float]]:
    """What a process says of its inputs, and how long each took; the last word may be that it hangs or has died."""
    command = [sys.executable, __file__, name, *map(str, (seed, first, last, folder))]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    environment["PYTHONPATH"] = str(
        Path(__file__).parent.parent
    )  # before this folder, which has rooms of the same names
    with open(folder.parent / f"{name}.log", "a") as log:
        child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, env=environment, text=True, bufsize=1)
    assert child.stdout is not None
    patience = 60.0  # the first has libraries to load
    for _ in range(first, last):
        since = time.monotonic()
        ready = select.select([child.stdout], [], [], patience)[0]
        word = child.stdout.readline().strip() if ready else "hangs"
        if not word:
            word = f"crashed:{child.wait()}"
        yield word, time.monotonic() - since if patience == PATIENCE else 0.0
        patience = PATIENCE
        if word == "hangs" or word.startswith("crashed"):
            break
    child.kill()
    child.communicate()


if __name__ == "__main__":
    sys.path += sorted(str(path) for path in Path(__file__).parent.rglob("[!_.]*") if path.is_dir())
    read_many(sys.argv[1], *map(int, sys.argv[2:5]), Path(sys.argv[5]))
