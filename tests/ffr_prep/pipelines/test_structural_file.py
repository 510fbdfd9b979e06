"""Structure files, the command that reduces them, and every guard on the way."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from places import ROOT

import ffr_prep as fp
from ffr_prep.body import load_body
from ffr_prep.cli import cli, main
from ffr_prep.common.errors import InputError
from ffr_prep.model.material import Material, material
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported, Support, Supports
from ffr_prep.pipelines.structure_file import read_structure
from ffr_prep.reduction.methods.attachment import AttachmentModes
from ffr_prep.reduction.methods.characteristic import CharacteristicModes
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.reduction.methods.guyan import Guyan
from ffr_prep.reduction.methods.inertia_relief import InertiaRelief
from ffr_prep.reduction.methods.krylov import Krylov
from ffr_prep.reduction.methods.rubin import Rubin
from ffr_prep.reduction.methods.union import Union
from ffr_prep.reduction.selection import Accuracy, Band, UpTo
from ffr_prep.structures.frame import Member, Shell, check_frame
from ffr_prep.structures.sections import box, circle, general, i_section, rectangle, shear_rigid, shifted, tube

LINE = """
[[polylines]]
member = "bar"
corners = [[0, 0, 0], [1, 0, 0]]
elements = 2
[members.bar]
section = {shape = "circle", d = 0.01}
material = "steel"
[nodes]
a = [0, 0, 0]
b = [1, 0, 0]
[interfaces.a]
[interfaces.b]
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "bar.toml"
    path.write_text(text, encoding="utf-8")
    return path


def page(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / "docs/structural.md").read_text(encoding="utf-8"), re.S)


def body_of(path: Path) -> fp.FlexibleBody:
    structure = read_structure(path)
    return fp.reduce(structure.model(), structure.request)


@pytest.mark.slow
def test_the_file_of_the_documentation(tmp_path):
    loaded = read_structure(written(tmp_path, page("toml")[0]))
    check_frame(loaded.frame)
    assert loaded.request.name == "portal"
    assert loaded.frame.shells == (Shell(0.004, material("steel")),)
    profile = shifted(i_section(0.2, 0.1, 0.006, 0.009), 0.1, 0)
    assert loaded.frame.members == (Member(profile, material("steel"), (1.0, 0.0, 0.0)),)
    assert len(loaded.frame.points) == 45
    body = fp.reduce(loaded.model(), loaded.request)
    assert body.stiffening is not None
    assert body.surface.stress is not None


@pytest.mark.parametrize("which", [0, 1])
def test_the_programs_of_the_documentation_run(which, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "meshes").symlink_to(ROOT / "meshes")
    space: dict = {}
    exec(compile(page("python")[which], "docs", "exec"), space)
    assert space["body"].omega2[0] > 0


@pytest.mark.slow
def test_the_example_is_reduced_by_the_command(tmp_path):
    output = tmp_path / "tray.ffr"
    done = CliRunner().invoke(cli, ["reduce-structure", str(ROOT / "examples/tray.toml"), "-o", str(output)])
    assert done.exception is None, done.output
    assert "24 beams" in done.output
    body = load_body(output)
    sheet, floor = 7870 * 2 * 0.6 * 0.08 * 0.0015, 2700 * 0.6 * 0.3 * 0.002
    assert body.mass == pytest.approx(sheet + floor + 7850 * 1.2 * tube(0.012, 0.001).A, rel=1e-9)
    assert [(i.name, i.kind) for i in body.interfaces] == [("front", "rigid"), ("load", "mean")]
    assert body.provenance["source"] == {"file": "tray.toml"}
    assert body.frequencies[0] == pytest.approx(60.702, rel=1e-3)  # with elements of half the size


@pytest.mark.parametrize(
    ("text", "section"),
    [
        ('{shape = "rectangle", b = 0.02, h = 0.03}', rectangle(0.02, 0.03)),
        ('{shape = "tube", d = 0.02, t = 0.003}', tube(0.02, 0.003)),
        ('{shape = "box", b = "20 mm", h = 0.03, t = "2 mm"}', box(0.02, 0.03, 0.002)),
        (
            '{shape = "general", A = 1e-4, Iy = 1e-9, Iz = 1e-9, J = 2e-9}',
            general("general", A=1e-4, Iy=1e-9, Iz=1e-9, J=2e-9),
        ),
        ('{shape = "circle", d = 0.02}\nshear = false', shear_rigid(circle(0.02))),
    ],
)
def test_sections(tmp_path, text, section):
    loaded = read_structure(written(tmp_path, LINE.replace('{shape = "circle", d = 0.01}', text)))
    assert loaded.frame.members[0].section == section


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('reference = {kind = "mean-axis"}', MeanAxis()),
        ('reference = {kind = "fixed", interface = "a"}', FixedTo("a")),
        ('reference = {kind = "simply-supported", pin = "a", roller = "b"}', SimplySupported("a", "b")),
        (
            'reference = {kind = "supports", supports = [{interface = "a", motion = "rotation", direction = [0, 0, 1]}]}',
            Supports((Support("a", "rotation", (0.0, 0.0, 1.0)),)),
        ),
    ],
)
def test_references(tmp_path, text, expected):
    assert read_structure(written(tmp_path, text + LINE)).request.reference == expected


def test_reductions_materials_and_triangles(tmp_path):
    text = """
reduction = {method = "eigenmodes", modes = 3}
panels = [{shell = "s", corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], elements = [2, 1], triangles = true}]
shells.s = {thickness = 0.01, material = "own", rotary_inertia = false}
materials.own = {E = 1e9, nu = 0.25, rho = 1200}
"""
    loaded = read_structure(written(tmp_path, text))
    assert loaded.request.reduction == Eigenmodes(3)
    assert loaded.frame.shells == (Shell(0.01, Material("own", 1e9, 0.25, 1200.0), 0.0),)
    assert len(loaded.frame.triangles) == 4
    assert loaded.request.name == "bar"
    assert read_structure(written(tmp_path, LINE)).request.reduction == CraigBampton(10)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('{method = "rubin", modes = 3}', Rubin(3)),
        ('{method = "guyan"}', Guyan()),
        ('{method = "attachment"}', AttachmentModes()),
        ('{method = "characteristic", modes = 3, interface_modes = 4}', CharacteristicModes(3, 4)),
        ('{method = "krylov", moments = 3, match = [0, 120]}', Krylov(3, (0.0, 120.0))),
        ("{frequency = 500}", CraigBampton(UpTo(500.0))),
        ("{accuracy = [10, 500, 0.05]}", CraigBampton(Accuracy(Band(10.0, 500.0), 0.05))),
        ('[{modes = 2}, {method = "inertia-relief"}]', Union((CraigBampton(2), InertiaRelief()))),
    ],
)
def test_reductions(tmp_path, text, expected):
    assert read_structure(written(tmp_path, f"reduction = {text}" + LINE)).request.reduction == expected


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{moments = 7}", "moments is a setting of krylov, and not of craig-bampton"),
        (
            '[{method = "krylov", modes = 3}, {modes = 4}]',
            "modes says which normal modes to keep, and krylov keeps none",
        ),
        ('{method = "rubin", interface_modes = 3}', "take the method characteristic"),
    ],
)
def test_what_a_reduction_has_no_use_for_is_refused(tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        read_structure(written(tmp_path, f"reduction = {text}" + LINE))


def test_the_quality_of_a_structure_is_reported(tmp_path):
    text = "reduction = {modes = 2}\nquality = [5, 200]\n" + LINE.replace("elements = 2", "elements = 8")
    body = body_of(written(tmp_path, text))
    assert body.provenance["quality"]["band"] == [5, 200]


def test_damping_of_a_structure(tmp_path):
    text = "reduction = {modes = 2}\n" + LINE.replace("elements = 2", "elements = 8")
    plain = body_of(written(tmp_path, text))
    entry = "damping = {rayleigh = [2.0, 1e-6], loss_factor = 0.01, ratios = [0.01], bands = [[100, 0.005]]}\n"
    found = body_of(written(tmp_path, entry + text)).damping
    wanted = fp.damped(plain, alpha=2.0, beta=1e-6, loss_factor=0.01, ratios=[0.01], bands=[(100, 0.005)]).damping
    np.testing.assert_allclose(found, wanted, rtol=1e-6)
    with pytest.raises(InputError, match=r"loss_factor is -1.0; damping is a number from zero"):
        body_of(written(tmp_path, "damping = {loss_factor = -1}\n" + text))


SOLID = """
reference = {kind = "fixed", interface = "root"}
reduction = {modes = 4}
ties = [["frame.b", "block.left"]]
polylines = [{member = "bar", corners = [[-0.5, 0.05, 0.05], [0, 0.05, 0.05]], elements = 8}]
members.bar = {section = {shape = "rectangle", b = 0.1, h = 0.1}, material = "steel", orientation = [0, 1, 0]}
nodes = {root = [-0.5, 0.05, 0.05], b = [0, 0.05, 0.05]}
interfaces = {root = {}, b = {}}
[solids.block]
file = "box.geo"
material = "steel"
numbers = {nx = 6, ny = 1, nz = 1}
interfaces = {left = {}, right = {kind = "mean"}}
"""


@pytest.mark.slow
def test_a_solid_is_tied_to_a_frame(tmp_path):
    """Half beam, half solid: mass, length and frequencies of the whole cantilever; by file, by command."""
    (tmp_path / "box.geo").symlink_to(ROOT / "meshes" / "box.geo")
    body = body_of(written(tmp_path, SOLID))
    assert body.mass == pytest.approx(material("steel").rho * 1.5 * 0.01, rel=1e-9)
    assert [i.name for i in body.interfaces] == ["root", "right"]
    assert body.provenance["ties"] == [["frame.b", "block.left"]]
    steel, L = material("steel"), 1.5
    slender = 1.8751040687**2 / (2 * np.pi * L**2) * np.sqrt(steel.E * 0.01**2 / 12 / (steel.rho * 0.01))
    assert slender * 0.95 < body.frequencies[0] < slender
    main(["reduce-structure", str(tmp_path / "bar.toml"), "-o", str(tmp_path / "b.ffr")])
    np.testing.assert_array_equal(load_body(tmp_path / "b.ffr").PP_dm, body.PP_dm)


CUBE = """*NODE
1, 0., 0., 0.
2, .1, 0., 0.
3, .1, .1, 0.
4, 0., .1, 0.
5, 0., 0., .1
6, .1, 0., .1
7, .1, .1, .1
8, 0., .1, .1
*ELEMENT, TYPE=C3D8, ELSET=all
1, 1, 2, 3, 4, 5, 6, 7, 8
*NSET, NSET=left
1, 4, 5, 8
*NSET, NSET=right
2, 3, 6, 7
*ELEMENT, TYPE=MASS, ELSET=lump
2, 7
*MASS, ELSET=lump
1.5
"""


def test_what_the_mesh_of_a_solid_leaves_out_is_told_with_its_name(tmp_path, capsys):
    (tmp_path / "cube.inp").write_text(CUBE)
    text = SOLID.replace("box.geo", "cube.inp").replace("numbers = {nx = 6, ny = 1, nz = 1}", "")
    path = written(tmp_path, text)
    [note] = read_structure(path).model().record["notes"]
    assert note.startswith("block: 1 MASS left out: masses")
    main(["reduce-structure", str(path), "-o", str(tmp_path / "b.ffr")])
    assert f"note        {note}" in capsys.readouterr().out
    assert load_body(tmp_path / "b.ffr").provenance["notes"] == [note]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('ties = [["frame.b", "block.left"]]', "", "solids and ties need each other"),
        ("[solids.block]", "[solids.frame]", "the part 'frame' is that of beams"),
        ('"block.left"', '"block.lef"', "'lef'"),
        ('interfaces = {left = {}, right = {kind = "mean"}}', "", "solids.block.interfaces: is required, and missing"),
        ('file = "box.geo"', 'file = "none.geo"', "none.geo does not exist"),
    ],
)
def test_ties_that_cannot_be(tmp_path, old, new, says):
    (tmp_path / "box.geo").symlink_to(ROOT / "meshes" / "box.geo")
    assert old in SOLID
    with pytest.raises(InputError, match=says):
        body_of(written(tmp_path, SOLID.replace(old, new)))


# ---- guards -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x = 1\n" + LINE, "the file: 'x' is not a known entry here; known are name, "),
        ("stres = true\n" + LINE, "'stres' is not a known entry here; did you mean 'stress'"),
        (LINE + "knd = 'mean'", "interfaces.b: 'knd' is not a known entry here; did you mean 'kind'"),
        ("linear = 3\n" + LINE, r"linear: must be true or false \(it is 3\)"),
        ("stiffening = true\n" + LINE, "write linear = true to leave them out"),
        ("name = 'a'", "give a .geometry. file"),
        ("name = ", "is not a readable TOML"),
        (LINE.replace('"circle"', '"round"'), "members.bar.section: .*'round'"),
        (LINE.replace("d = 0.01", "d = nan"), "members.bar.section.d: must be a finite number"),
        (
            LINE.replace("d = 0.01", "d = '10 kg'"),
            r"d: the unit 'kg' does not fit: this is given in m \(it is '10 kg'\)",
        ),
        (LINE.replace("d = 0.01", "d = '10 mn'"), "d: unknown unit 'mn'"),
        (LINE.replace("d = 0.01", "d = '10 + 1'"), r"d: must be a number \(it is '10 \+ 1'\); write it without a unit"),
        (LINE.replace(", d = 0.01", ""), "members.bar.section.d: is required, and missing"),
        (LINE.replace("elements = 2", "elements = 2.5"), r"polylines.1.elements: must be a whole number \(it is 2.5\)"),
        (LINE.replace("d = 0.01", "d = -0.01"), "bar.toml: section circle -0.01 m: d is -0.01 m"),
        (LINE.replace('member = "bar"', 'member = "rod"'), "there is no member 'rod'; there are: 'bar'"),
        (LINE.replace('"steel"', '"stel"'), "no material 'stel' in the library; did you mean steel"),
        (
            LINE.replace('"steel"', "{E = 2e11}"),
            r"bar.material: names a material.*of a table \[materials.NAME\] with E, nu",
        ),
        (LINE.replace("b = [1, 0, 0]", "b = [1, 0, 1]"), "no node at .* to be called 'b'"),
        (LINE + 'kind = "soft"', "interfaces.b.kind: must be 'rigid' or 'mean'"),
        ("reduction = {modes = -1}\n" + LINE, "reduction.modes: must be greater than or equal to 0"),
        ("reduction = {modes = 2, frequency = 5}\n" + LINE, "reduction.*modes, frequency and accuracy all say"),
        ("geometry = {file = 'none.geo'}\n" + LINE, "none.geo does not exist"),
    ],
)
def test_files_that_cannot_be_used(tmp_path, text, says):
    with pytest.raises(InputError, match=says):
        read_structure(written(tmp_path, text))


def test_numbers_may_have_units(tmp_path):
    plain = "reduction = {modes = 2}\n[materials.own]\nE = 2.1e11\nnu = 0.3\nrho = 7850.0\n" + LINE.replace(
        '"steel"', '"own"'
    )
    given = plain.replace("2.1e11", '"210 GPa"').replace("7850.0", '"7.85 g/cm^3"').replace("d = 0.01", 'd = "1 cm"')
    assert given != plain
    first, second = (body_of(written(tmp_path, text)) for text in (plain, given))
    assert first.mass == pytest.approx(second.mass, rel=1e-14)
    np.testing.assert_allclose(first.omega2, second.omega2, rtol=1e-9)


def test_a_missing_file_ends_the_command_with_code_2_and_writes_nothing(tmp_path, capsys):
    with pytest.raises(SystemExit) as left:
        main(["reduce-structure", str(tmp_path / "none.toml"), "-o", str(tmp_path / "b.ffr")])
    assert left.value.code == 2
    assert "none.toml does not exist" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_failed_reduction_keeps_the_old_body(tmp_path):
    output = tmp_path / "b.ffr"
    output.write_bytes(b"old")
    path = written(tmp_path, 'reference = {kind = "fixed", interface = "c"}\n' + LINE)
    with pytest.raises(SystemExit) as left:
        main(["reduce-structure", str(path), "-o", str(output)])
    assert left.value.code == 2
    assert output.read_bytes() == b"old"


def test_the_same_file_gives_the_same_body(tmp_path):
    path = written(tmp_path, "reduction = {modes = 4}" + LINE)
    one, two = (body_of(path) for _ in range(2))
    np.testing.assert_array_equal(one.PP_dm, two.PP_dm)


def test_entries_can_be_given_from_outside(tmp_path):
    path = written(tmp_path, 'reduction = {method = "craig-bampton", modes = 3}' + LINE)
    given = {"members.bar.section.d": "0.02", "members.bar.material": "aluminium", "polylines.1.elements": "4"}
    loaded = read_structure(path, entries=given | {"reduction.modes": "5"})
    thick = (
        LINE.replace("d = 0.01", "d = 0.02").replace('"steel"', '"aluminium"').replace("elements = 2", "elements = 4")
    )
    other = read_structure(written(tmp_path, 'reduction = {method = "craig-bampton", modes = 5}' + thick))
    assert loaded.request == other.request
    assert loaded.frame.members == other.frame.members
    assert len(loaded.frame.points) == 5
    with pytest.raises(
        InputError, match=r"no entry 'members\.bar\.section\.b'; did you mean 'members\.bar\.section\.d'"
    ):
        read_structure(path, entries={"members.bar.section.b": "1"})
    with pytest.raises(InputError, match=r"elements: .*\(it is 'many'\)"):
        read_structure(path, entries={"polylines.1.elements": "many"})


def test_the_command_takes_entries(tmp_path, capsys):
    path = written(tmp_path, 'reduction = {method = "craig-bampton", modes = 3}' + LINE)
    out = tmp_path / "bar.ffr"
    command = ["reduce-structure", str(path), "-o", str(out), "-p", "reduction.modes=2"]
    assert CliRunner().invoke(cli, command).exit_code == 0
    assert load_body(out).provenance["reduction"]["modes"] == 2
    with pytest.raises(SystemExit, match="2"):
        main([*command[:-1], "reduction.modes"])
    assert "-p reduction.modes: write it as NAME=VALUE" in capsys.readouterr().err
