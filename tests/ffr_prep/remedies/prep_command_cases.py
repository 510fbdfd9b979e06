"""What ffr-prep says of its arguments, of files that it reads and of those that it writes."""

from __future__ import annotations

import os
from pathlib import Path
from unittest.mock import patch

import h5py
from mutated_inputs import STRUCTURE
from prep_remedy import command, with_files, words
from said import Case

from ffr_prep.body import load_body
from ffr_prep.common.hdf5 import check_heaps
from ffr_prep.common.outputs import replacing
from ffr_prep.common.reading import check_count, read_text, read_toml, reading
from ffr_prep.common.registry import Registry, Setting
from ffr_prep.common.units import to_si

REDUCE = "reduce block.inp --linear -o new.ffr --interface LEFT"
SUPPORT = '[[support]]\ninterface = "LEFT"\nmotion = "{}"\ndirection = [1, 0, 0]\n'
SIX = "".join(
    f'[[support]]\ninterface = "LEFT"\nmotion = "{motion}"\ndirection = {axis}\n'
    for motion in ("translation", "rotation")
    for axis in ("[1, 0, 0]", "[0, 1, 0]", "[0, 0, 1]")
)


def reduces(wrong: str, right: str = "", **files: str) -> Case:
    return words(f"{REDUCE} {wrong}", f"{REDUCE} {right}", **files)


GEOMETRY = "reduce part.geo --size 0.1 --interface surface_1 --modes 1 --linear -o new.ffr"
OPTIONS = [
    words("modes body.ffr --modes x -o out", "modes body.ffr --modes 1-1 -o out"),
    words("modes body.ffr --modes 9 -o out", "info body.ffr"),
    words("rigid part.geo -o new.ffr", "rigid part.geo --density 7850 -o new.ffr"),
    words("rigid part.geo --material ALL=steel -o new.ffr", "rigid part.geo --material steel -o new.ffr"),
    reduces("--set a --mesher-timeout 9", "--mesher-timeout 9"),
    words("mesh part.geo --set w", "mesh part.geo --size 1 --order 1 --set w=0.2"),
    words("mesh part.geo --set w=wide", "mesh part.geo --size 1 --order 1 --set w=2e-1"),
    words("mesh part.geo --set w=3deg", "mesh part.geo --size 1 --order 1 --set w=20cm"),
    reduces("--material steel --material ALL=brass", "--material ALL=steel"),
    reduces("--material ALL=steel --material ALL=brass", "--material ALL=brass"),
    reduces("--interface =x", "--interface RIGHT"),
    reduces("--interface 'nearest 1,0,0'", "--interface 'tip=nearest 1,0.1,0.05'"),
    reduces("--region 'plane x=1'", "--region 'end=plane x=1'"),
    reduces("--region 'end=plane x=1' --region 'end=plane x=0'", "--region 'end=plane x=1'"),
    reduces("--interface RIGHT@1,0", "--interface RIGHT@1,0,0"),
    reduces("--reference free", "--reference fixed:LEFT"),
    reduces("--interface RIGHT@900,0,0", "--interface RIGHT@0.9,0,0"),
    reduces("--damping-band 100", "--damping-band 100:0.005"),
    reduces("--band 10,20", "--modes 2"),
    reduces("--quality q", "--quality q --band 1,20"),
    reduces("--parts two", "--modes 0 --parts 2"),
    reduces("--accuracy 10;20;3", "--modes 2"),
    reduces("--accuracy 10,20", "--frequency 2000"),
    reduces("--method guyan --modes 2", "--method guyan --method craig-bampton --modes 2"),
    reduces("--moments 1", "--method krylov --moments 1"),
    words("reduce block.inp --interface LEFT -o scene.toml", REDUCE),
    words(
        "reduce part.geo --interface surface_1 -o new.ffr",
        "reduce part.geo --interface surface_1 --material steel -o new.ffr",
    ),
    words("faces block.inp --page page.png", "faces block.inp"),
    words("modes body.ffr -o block.inp", "info body.ffr"),
]


def supports(wrong: str, right: str = SIX) -> Case:
    line = f"{REDUCE} --reference s.toml"
    return Case(lambda: command(line, s_toml=wrong), lambda: command(line, s_toml=right))


MATRICES = "reduce-matrices matrices.npz --interface tip --modes 0 -o new.ffr"
OPTIONS += [
    supports("[[support]]\nmotion = 3\n"),
    supports(SIX + "more = 3\n"),
    supports(SUPPORT.format("turn")),
    supports(SUPPORT.format("translation").replace("[1, 0, 0]", "[0, 0, 0]")),
    words(f"{MATRICES} --group tip", f"{MATRICES} --group tip=3"),
    words(f"{MATRICES} --group tip=3-1", f"{MATRICES} --group tip=2-3"),
    words(f"{MATRICES} --group tip={'9' * 25}", f"{MATRICES} --group tip=3"),
    words(f"{MATRICES} --group tip@1,0,x", f"{MATRICES} --group tip@1,0,0"),
    words(f"{MATRICES} --group tip=77", f"{MATRICES} --group tip=2"),
    words(f"{MATRICES} --group tip@0.3,0,0", f"{MATRICES} --group tip@0.5,0,0"),
    words(f"{MATRICES} --group tip=1-3", f"{MATRICES} --group tip=2-3"),
    words("reduce-matrices K.mtx M.mtx --interface tip -o new.ffr", f"{MATRICES} --group tip=3"),
]

# ---- plug-ins, units, files ------------------------------------------------------------------------------------------

PLUGIN = "from ffr_prep import register_mesh_format, MeshFormat\n"


def plugged(text: str) -> object:
    return command("--plugin own.py mesh block.inp", own_py=text)


def registered(*settings: Setting, name: str = "other") -> object:
    class Entry:
        def __init__(self, name: str, settings: tuple[Setting, ...] = ()) -> None:
            self.name, self.settings = name, settings

    registry = Registry("entry", (Entry("one", (Setting("count", int, 1, "How many."),)),))
    return registry.register(Entry(name, settings))


def piped(path: Path) -> object:
    """A body that is a pipe, which nobody writes to."""

    def act() -> object:
        os.mkfifo(path)
        return load_body(path)

    return with_files(act, {})


def linked(name: str) -> object:
    def act() -> object:
        os.symlink("block.inp", "link.ffr")
        Path("folder.ffr").mkdir()
        os.mkfifo("pipe.ffr")
        Path(".new.ffr.part").touch()
        with replacing(Path(name)) as part:
            part.write_text("new")

    return with_files(act, {})


def toml(text: str, name: str = "a.toml") -> object:
    return with_files(lambda: read_toml(name, "a scene file"), {name: (("", text),)})


def unwritable(line: str) -> object:
    """A command in a folder that the user may not write to."""
    with patch("os.access", lambda _, mode: mode != os.W_OK):
        return command(line)


def written(failing: bool = False, twice: bool = False) -> object:
    def act() -> object:
        with replacing("new.txt") as part:
            part.write_text("new")
            if failing:
                raise OSError(28, "No space left on device")
            if twice:
                written_again()

    return with_files(act, {})


def written_again() -> None:
    with replacing("new.txt"):
        pass


def read(content: bytes) -> object:
    def act() -> object:
        Path("a.txt").write_bytes(content)
        return read_text("a.txt", "a deck")

    return with_files(act, {})


def reading_of(error: Exception | None = None) -> object:
    """A file that a reader fails at."""

    def act() -> object:
        with reading("block.inp", "a deck", ValueError):
            if error is not None:
                raise error

    return with_files(act, {})


def heap(damage: bytes) -> object:
    """The heap of texts of an HDF5 file, the first of which takes no room where it is damaged."""

    def act() -> object:
        with h5py.File("a.nc", "w") as file:
            for k in range(60):
                file.attrs[f"text {k}"] = "word " * 10
        content = bytearray(Path("a.nc").read_bytes())
        at = content.find(b"GCOL")
        if damage:
            content[at + 16 : at + 18] = damage
            content[at + 24 : at + 32] = bytes(8)
        Path("a.nc").write_bytes(content)
        return check_heaps("a.nc")

    return with_files(act, {})


GOOD = "a = 1\n"
FILES = [
    words("--plugin nowhere.py mesh block.inp", "mesh block.inp"),
    Case(lambda: plugged("1 / 0"), lambda: plugged(PLUGIN)),
    Case(lambda: registered(name="one"), registered),
    Case(
        lambda: registered(Setting("count", float, 1.0, "How much.")),
        lambda: registered(Setting("count", int, 1, "How many.")),
    ),
    *(Case(lambda unit=unit: to_si(3, unit, "m"), lambda: to_si(3, "mm", "m")) for unit in ("N", "mm+m", "metre")),
    *(
        Case(lambda name=name: linked(name), lambda: linked("new.ffr"))
        for name in ("link.ffr", "folder.ffr", "pipe.ffr")
    ),
    words("mesh nowhere.inp", "mesh block.inp"),
    words("mesh .", "mesh block.inp"),
    words("mesh /dev/null", "mesh block.inp"),
    words(f"mesh {'a' * 300}.inp", "mesh block.inp"),
    words("info block.inp", "info body.ffr"),
    words("export body.ffr -o body.ffr", "export body.ffr -o new.sid"),
    Case(lambda: toml("a = " + "[" * 100 + "1" + "]" * 100), lambda: toml("a = " + "[" * 30 + "1" + "]" * 30)),
    Case(lambda: toml("a = " + "[" * 3000), lambda: toml(GOOD)),
    Case(lambda: toml("a = 92233720368547758080"), lambda: toml("a = 92233720368547758080.0")),
    Case(lambda: toml("a = "), lambda: toml(GOOD)),
    Case(lambda: toml("a = " + "1" * 5000), lambda: toml(GOOD)),
    Case(lambda: check_count(10**9, "nodes"), lambda: check_count(10, "nodes")),
    Case(
        lambda: with_files(lambda: read_text("block.inp", "a deck", 5), {}),
        lambda: with_files(lambda: read_text("block.inp", "a deck"), {}),
    ),
    words("import block.inp -o new.ffr", "import legacy.fem -o new.ffr"),
    words("export body.ffr -o new.xyz", "export body.ffr -o new.sid"),
    words("export body.ffr -o new.sid --kind full", "export body.ffr -o new.fem --kind full"),
    words("info body.ffr --terms I10", "info body.ffr --terms I1"),
    reduces("--stiffening", "--linear"),
    words("reduce block.inp --linear --interface LEFT -o -", REDUCE),
    words("modes body.ffr -o block.inp/out", "info body.ffr"),
    words(
        "reduce-structure s.toml -o new.ffr -p nodes.tip.1=1 -p nodes.tip.1=1",
        "reduce-structure s.toml -o new.ffr -p nodes.tip.1=1",
        s_toml=STRUCTURE,
    ),
    words("mesh end.geo --size 1 --order 1", "mesh part.geo --size 1 --order 1", end_geo="Exit;\n"),
    words("mesh own.geo --size 1 --set w=1", "mesh part.geo --size 1 --order 1 --set w=0.2", own_geo="w = 2;\n"),
    reduces("--parts 3", "--modes 0 --parts 2"),
    Case(lambda: piped(Path("pipe.ffr")), lambda: with_files(lambda: load_body("body.ffr"), {})),
    Case(lambda: unwritable(REDUCE), lambda: command(REDUCE)),
    Case(lambda: written(failing=True), written),
    Case(lambda: written(twice=True), written),
    Case(lambda: read(b"\xff\xfeabc"), lambda: read("abc".encode("utf-16"))),
    Case(lambda: reading_of(MemoryError()), reading_of),
    Case(lambda: reading_of(KeyError("of no kind")), reading_of),
    Case(lambda: reading_of(ValueError("no header")), reading_of),
    Case(lambda: heap(bytes(2)), lambda: heap(b"")),
]

# ---- structures ------------------------------------------------------------------------------------------------------


def structure(*changes: tuple[str, str]) -> Case:
    text = STRUCTURE
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    line = "reduce-structure s.toml -o new.ffr"
    return Case(lambda: command(line, s_toml=text), lambda: command(line, s_toml=STRUCTURE))


STRUCTURES = [
    structure(('member = "column"', 'member = "colum"')),
    structure(('material = "steel"', 'material = "stel"')),
    structure(("elements = 2", "elements = -2")),
    structure(("elements = 2", "element = 2")),
    structure(("[[0, 0, 0], [1, 0, 0], [1, 1, 0]]", "[[0, 0, 0]]")),
    structure(("tip = [1, 1, 0]", "tip = [1, 2, 0]")),
    structure(("tip = [1, 1, 0]", "tip = [inf, 2, 0]")),
    structure(("b = 0.02", "b = -0.02")),
    structure(("orientation = [0, 0, 1]", "orientation = [0, 0, 0]")),
    structure(("orientation = [0, 0, 1]", "")),
    structure(("orientation = [0, 0, 1]", "orientation = [1, 0, 0]")),
    structure(('interface = "foot"}', 'interface = "fot"}')),
    structure(("[interfaces.tip]", "[interfaces.tipp]")),
    structure(('method = "craig-bampton"', 'method = "craig"')),
]
CASES = OPTIONS + FILES + STRUCTURES
