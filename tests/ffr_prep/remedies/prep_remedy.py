"""What the cases of remedies of ffr_prep share: sound files of every format, changed or not, and how a command is run."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable
from contextlib import chdir
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from unittest.mock import patch

from boxes import box_mesh
from mutated_inputs import make_samples
from said import Case

from ffr_prep.body import FlexibleBody
from ffr_prep.cli import cli
from ffr_prep.common.interrupts import ending_in_order
from ffr_prep.common.outputs import command_inputs
from ffr_prep.mesh.mesh import Mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import material
from ffr_prep.model.reference import MeanAxis
from ffr_prep.pipelines.reduce import Request, reduce
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.solids.model import from_mesh

Change = tuple[str, str]

GEO = """SetFactory("OpenCASCADE");
DefineConstant[ w = 0.1 ];
Box(1) = {0, 0, 0, 1, w, 0.1};
"""


@cache
def samples() -> Path:
    """A folder of sound files, made once."""
    folder = Path(mkdtemp(prefix="ffr-samples-"))
    make_samples(folder)
    (folder / "part.geo").write_text(GEO)
    (folder / "block.inp").write_text(deck())
    return folder


def deck(cells: tuple[int, int, int] = (2, 1, 1)) -> str:
    """An Abaqus deck of a steel box of 1 m x 0.2 m x 0.1 m, with its ends LEFT and RIGHT as sets of nodes."""
    mesh = box_mesh("hex8", (1.0, 0.2, 0.1), cells)
    lines = ["*NODE", *(f"{k}, {', '.join(map(str, at))}" for k, at in enumerate(mesh.points, 1))]
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=ALL"]
    lines += [f"{k}, {', '.join(map(str, of + 1))}" for k, of in enumerate(mesh.blocks[0].nodes, 1)]
    for name, x in (("LEFT", 0.0), ("RIGHT", 1.0)):
        lines += [f"*NSET, NSET={name}", *(str(k) for k, at in enumerate(mesh.points, 1) if at[0] == x)]
    material = ["*MATERIAL, NAME=STEEL", "*ELASTIC", "2.1e11, 0.3", "*DENSITY", "7850."]
    return "\n".join([*lines, *material, "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL", ""])


def with_files(act: Callable[[], object], changes: dict[str, tuple[Change, ...]]) -> object:
    """Do it in a folder with the samples, of which some are changed, and some made of others ("new < old")."""
    with TemporaryDirectory() as folder, chdir(folder):
        for path in samples().iterdir():
            if path.name not in changes:
                os.link(path, path.name)
        for name, pairs in changes.items():
            text = (samples() / name).read_text() if (samples() / name).exists() else ""
            for old, new in pairs:
                assert old in text, (old, text[:500])
                text = text.replace(old, new, 1) if old else new
            Path(name).write_text(text)
        return act()


def _commands(lines: tuple[str, ...]) -> None:
    for line in lines:
        with ending_in_order(), command_inputs():
            cli(shlex.split(line), standalone_mode=False)


def command(*lines: str, **changes: str) -> object:
    """Run commands of ffr-prep beside the samples and files given by their names, "_" for the dot."""
    return with_files(
        partial(_commands, lines), {name.replace("_", "."): (("", text),) for name, text in changes.items()}
    )


def words(wrong: str, right: str, **files: str) -> Case:
    """A command that is refused, and the one that it should have been."""
    return Case(partial(command, wrong, **files), partial(command, right, **files))


def edited(read: Callable[[Path], object], name: str, *changes: Change) -> Case:
    """A sample with what cannot be read put in its place, and the sample."""
    return rewritten(read, name, changes, ())


def rewritten(read: Callable[[Path], object], name: str, wrong: tuple[Change, ...], right: tuple[Change, ...]) -> Case:
    """A sample changed so that it cannot be read, and so that it can."""
    return Case(
        partial(with_files, lambda: read(Path(name)), {name: wrong}),
        partial(with_files, lambda: read(Path(name)), {name: right} if right else {}),
    )


# ---- bodies and models -----------------------------------------------------------------------------------------------


@cache
def box(kind: str = "hex8", cells: tuple[int, int, int] = (2, 1, 1)) -> Mesh:
    return box_mesh(kind, (1.0, 0.2, 0.1), cells)


def reduced(*interfaces: str | InterfaceRegion, mesh: Mesh | None = None, **more: object) -> FlexibleBody:
    """The body of a small steel box."""
    regions = [InterfaceRegion(one) if isinstance(one, str) else one for one in interfaces]
    usual = {"name": "box", "reduction": CraigBampton(modes=2), "reference": MeanAxis(), "linear": True}
    return reduce(from_mesh(mesh or box(), material("steel"), regions), Request(**{**usual, **more}))


def with_part(owner: object, name: str, value: object, act: Callable[[], object]) -> object:
    """Do it with another value of a part of a module."""
    with patch.object(owner, name, value):
        return act()


def raising(error: Exception) -> Callable[..., object]:
    """A function that raises an error, whatever it is given."""

    def raises(*_: object, **__: object) -> None:
        raise error

    return raises
