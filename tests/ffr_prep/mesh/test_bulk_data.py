"""Nastran bulk data in every form of field, result files of CalculiX, and the materials that mesh files carry."""

import re
from dataclasses import replace

import meshio
import numpy as np
import pytest
from boxes import box_mesh

import ffr_prep as fp
from ffr_prep.cli import main
from ffr_prep.common.errors import InputError
from ffr_prep.mesh.bulk_data import Card, cards

HEX20 = [*range(12), *range(16, 20), *range(12, 16)]  # vertical edges before those of the second face
NAMES = {"tet4": "CTETRA", "tet10": "CTETRA", "hex8": "CHEXA", "hex20": "CHEXA"}


def small(name, fields, mark="+"):
    """Ten fields of eight columns."""
    rows = [fields[k : k + 8] for k in range(0, len(fields), 8)]
    heads = [name, *[mark] * (len(rows) - 1)]
    return "\n".join(
        f"{head:8}" + "".join(f"{str(field)[:8]:>8}" for field in row) for head, row in zip(heads, rows, strict=True)
    )


def large(name, fields, mark="*"):
    rows = [fields[k : k + 4] for k in range(0, len(fields), 4)]
    heads = [f"{name}*", *[mark] * (len(rows) - 1)]
    return "\n".join(
        f"{head:8}" + "".join(f"{field!s:>16}" for field in row) for head, row in zip(heads, rows, strict=True)
    )


def free(name, fields, mark="+"):
    rows = [fields[k : k + 8] for k in range(0, len(fields), 8)]
    heads = [name, *[mark] * (len(rows) - 1)]
    return "\n".join(",".join([head, *map(str, row)]) for head, row in zip(heads, rows, strict=True))


WRITERS = {
    "small, marked": lambda name, fields: small(name, fields, "+A1"),
    "small, blank": lambda name, fields: small(name, fields, ""),
    "large": large,
    "large, marked": lambda name, fields: large(name, fields, "*B"),
    "free": free,
    "free, blank": lambda name, fields: free(name, fields, ""),
    "free, capitals off": lambda name, fields: free(name.lower(), fields),
}


def short(x):
    """A number in eight columns, with and without its exponent's letter."""
    text = f"{x:.4g}"
    return text if "." in text or "e" in text else f"{text}."


def deck(mesh, kind, write, before="SOL 101\nCEND\nBEGIN BULK\n"):
    lines = [write("GRID", [k + 1, "", *map(short, p)]) for k, p in enumerate(mesh.points)]
    for k, nodes in enumerate(mesh.blocks[0].nodes + 1):
        lines.append(write(NAMES[kind], [k + 1, 7, *(nodes[HEX20] if kind == "hex20" else nodes)]))
    return before + "$ a comment\n" + "\n".join(lines) + "\nENDDATA\nbeyond the end\n"


def box(kind):
    mesh = box_mesh(kind, (1.5, 0.5, 0.25), (3, 2, 1))
    return mesh


def assert_same_mesh(given, mesh):
    np.testing.assert_allclose(given.points, mesh.points, atol=1e-12)
    np.testing.assert_array_equal(given.blocks[0].nodes, mesh.blocks[0].nodes)


@pytest.mark.parametrize("kind", NAMES)
@pytest.mark.parametrize("form", WRITERS)
def test_every_form_of_field_is_read(tmp_path, form, kind):
    mesh = box(kind)
    (tmp_path / "a.bdf").write_text(deck(mesh, kind, WRITERS[form]))
    given = fp.read_mesh(tmp_path / "a.bdf")
    assert_same_mesh(given, mesh)
    assert list(given.volume_groups) == ["property_7"]


def test_forms_may_change_from_card_to_card_and_files_include_others(tmp_path):
    mesh, forms = box("hex20"), list(WRITERS.values())
    count = iter(range(10**6))
    text = deck(mesh, "hex20", lambda name, fields: forms[next(count) % len(forms)](name, fields), before="")
    grids, elements = text[: text.lower().index("chexa")], text[text.lower().index("chexa") :]
    (tmp_path / "grids.inc").write_text(grids)
    (tmp_path / "a.bdf").write_text("INCLUDE 'grids.inc'\n" + elements)
    assert_same_mesh(fp.read_mesh(tmp_path / "a.bdf"), mesh)
    (tmp_path / "grids.inc").write_text("include 'a.bdf'\n")
    with pytest.raises(InputError, match="includes itself"):
        fp.read_mesh(tmp_path / "a.bdf")


@pytest.mark.parametrize(
    ("text", "value"),
    [("1.5", 1.5), ("1.5+3", 1500.0), ("-.5-2", -0.005), ("1.D2", 100.0), ("7", 7.0), ("2.e1", 20.0), ("", -1.0)],
)
def test_numbers_without_the_letter_of_their_exponent(text, value):
    assert Card("X", [text], 1).real(1, -1.0) == value


def test_data_files_are_bulk_data_or_tecplots(tmp_path):
    mesh = box("hex8")
    (tmp_path / "a.dat").write_text(
        deck(mesh, "hex8", free).replace("ENDDATA", "PSOLID,7,5\nMAT1,5,2.1+11,,.3,7850.\nENDDATA", 1)
    )
    given = fp.read_mesh(tmp_path / "a.dat")
    assert_same_mesh(given, mesh)
    assert [material.name for material in fp.file_materials(tmp_path / "a.dat", given).values()] == ["MAT1 5"]
    meshio.write(tmp_path / "b.dat", meshio.Mesh(mesh.points, [("hexahedron", mesh.blocks[0].nodes)]))
    np.testing.assert_allclose(fp.read_mesh(tmp_path / "b.dat").points, mesh.points)


def test_faces_sets_and_what_is_ignored(tmp_path):
    plain = box("hex8")
    face = ",".join(str(n + 1) for n in plain.blocks[0].nodes[0][[0, 3, 2, 1]])
    more = f"CQUAD4,100,9,{face}\nSET1,5,1,THRU,4,\nCBAR,200,1,1,2\nENDDATA"
    (tmp_path / "a.bdf").write_text(deck(plain, "hex8", free).replace("ENDDATA", more, 1))
    mesh = fp.read_mesh(tmp_path / "a.bdf")
    fp.check_mesh(mesh)
    assert [part.shape for part in mesh.face_groups["property_9"]] == [(1, 4)]
    assert mesh.node_groups["set_5"].tolist() == [0, 1, 2, 3]
    (note,) = mesh.notes
    assert note.startswith("1 CBAR left out: beams, bars and rods; only solids are reduced; a structure file")


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ("CDAMP1,9,1,1,1\nCBUSH,10,1,1,2\nCVISC,11,1,1,2", "1 CDAMP1, 1 CBUSH, 1 CVISC left out: springs and dashpots"),
        ("CONM2,9,1,0,2.5", "1 CONM2 left out: masses"),
        ("RBE2,9,1,123,2,3\nRBE3,10,,1,123,1.,123,2,3", "1 RBE2, 1 RBE3 left out: rigid and averaging"),
        ("PSHELL,9,1,0.1,1", "1 PSHELL left out: shells and membranes"),
        ("SPC1,1,123,1\nSPC,1,2,123", "1 SPC1, 1 SPC left out: supports"),
        ("FORCE,1,1,0,1.,1.,0.,0.", "1 FORCE left out: loads"),
        ("BGSET,1,1,2,3", "1 BGSET left out: connections of parts"),
        ("MAT1,5,2.1+11,,.3,7850.,,,0.02", "1 GE left out: damping"),
        ("MATT1,5,21", "1 MATT1 left out: tables over temperature"),
        ("MATS1,5,,PLASTIC", "1 MATS1 left out: yield and creep"),
        ("PSOLID,8,5,,,,,PFLUID", "1 PFLUID left out: acoustic elements"),
        ("DMIG,K2GG,0,6,1,0", "1 DMIG left out: matrices"),
    ],
)
def test_cards_that_would_change_the_body_are_told(tmp_path, more, told):
    text = deck(box("tet4"), "tet4", free).replace("ENDDATA", f"PARAM,POST,-1\nPSOLID,7,5\n{more}\nENDDATA", 1)
    (tmp_path / "a.bdf").write_text(text)
    (note,) = fp.read_mesh(tmp_path / "a.bdf").notes
    assert note.startswith(told)


def test_points_in_cylindrical_and_turned_systems(tmp_path):
    points = np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    lines = ["CORD2R,1,0,1.,2.,3.,1.,2.,4.,,\n,1.,3.,3.", "CORD2C,2,1,0.,0.,0.,0.,0.,1.,,\n,1.,0.,0."]
    turned = [f"GRID,{k + 1},1,{x},{y},{z}" for k, (x, y, z) in enumerate(points)]
    polar = [
        f"GRID,{k + 1},2,{np.hypot(x, y)},{np.degrees(np.arctan2(y, x))},{z}" for k, (x, y, z) in enumerate(points)
    ]
    for grids in (turned, polar):
        (tmp_path / "a.bdf").write_text("\n".join([*lines, *grids, "CTETRA,1,1,1,2,3,4", ""]))
        expected = np.array([1.0, 2, 3]) + points @ np.array([(0.0, 1, 0), (-1, 0, 0), (0, 0, 1)])
        np.testing.assert_allclose(fp.read_mesh(tmp_path / "a.bdf").points, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("CTETRA,9,1,1,2,3", "line .*CTETRA 9.*whole number|has 3 nodes"),
        ("CTETRA,9,1,1,2,3,4,5", "has 5 nodes; it must have 4 or 10"),
        ("CTETRA,9,1,1,2,3,4711", "GRID 4711, which the file does not define"),
        ("CPENTA,9,1,1,2,3,4,5", "has 5 nodes; it must have 6 or 15"),
        ("GRID,1,,0.,0.,0.", "GRID 1 is defined twice"),
        ("CTETRA,1,7,1,2,3,4", "CTETRA 1 is defined twice"),
        ("CORD2R,5,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nCORD2R,5,,0.,0.,1.,0.,0.,2.\n,1.,0.,0.", "CORD2R 5 is defined twice"),
        ("GRID,4711,,0.,x,0.", "field 5 is 'x', where a number belongs"),
    ],
)
def test_what_cannot_be_read_is_named(tmp_path, line, said):
    (tmp_path / "a.bdf").write_text(deck(box("hex8"), "hex8", free).replace("ENDDATA", f"{line}\nENDDATA", 1))
    with pytest.raises(InputError, match=said):
        fp.read_mesh(tmp_path / "a.bdf")


@pytest.mark.parametrize("backwards", [False, True])
def test_continuations_may_stand_anywhere_in_a_deck(tmp_path, backwards):
    """By their marks; cards with marks and nothing that goes on with them are whole."""
    mesh = box("hex20")
    cards_of = deck(mesh, "hex20", small).splitlines()
    begin = next(k for k, line in enumerate(cards_of) if line.startswith("CHEXA"))
    first, rest, count = [], [], 0
    for line in cards_of[begin:]:
        if line.startswith(("CHEXA", " ", "+")):
            own, count = count, count + (not line.startswith("CHEXA"))
            name = line[:8] if line.startswith("CHEXA") else f"+M{len(first) - 1}X{own}"
            count = 0 if line.startswith("CHEXA") else count
            mark = f"+M{len(first) - (not line.startswith('CHEXA'))}X{count}"
            (first if line.startswith("CHEXA") else rest).append(f"{name:<8}{line[8:72]:<64}{mark}")
    text = [*cards_of[:begin], *first, *(rest[::-1] if backwards else rest), "ENDDATA"]
    (tmp_path / "a.bdf").write_text("\n".join(text) + "\n")
    given = fp.read_mesh(tmp_path / "a.bdf")  # elements in the order in which they are complete
    order = np.argsort(given.blocks[0].nodes[:, 0])
    assert_same_mesh(replace(given, blocks=(replace(given.blocks[0], nodes=given.blocks[0].nodes[order]),)), mesh)


def test_marks_that_no_card_has_are_told(tmp_path):
    """The card above them ends with another mark; where it has none, it is the one that goes on."""
    (tmp_path / "a.bdf").write_text(f"{'CHEXA':72}+A\n{'+B':8}{1:8}\n")
    with pytest.raises(InputError, match=r"line 2 goes on with a card that ends with the mark \+B, but none does"):
        list(cards(tmp_path / "a.bdf"))
    (tmp_path / "a.bdf").write_text(f"CHEXA\n{'+B':8}{1:8}\n")
    (card,) = cards(tmp_path / "a.bdf")
    assert card.integer(9) == 1


def test_fields_beyond_a_line_and_repeated_cards_are_refused(tmp_path):
    text = deck(box("tet4"), "tet4", free)
    for line, said in (
        ("CTETRA,9,7,1,2,3,4,5,6,7,8,9,10", "has 12 fields behind the name; 8 is the most"),
        ("CTETRA,9,7,1,2,3,4,5,6,7", "has 9 fields behind the name; 8 is the most"),
        ("=,*(1),=,*(10.),==", "repeats the card above it"),
    ):
        (tmp_path / "a.bdf").write_text(text.replace("ENDDATA", f"{line}\nENDDATA", 1))
        with pytest.raises(InputError, match=said):
            fp.read_mesh(tmp_path / "a.bdf")


@pytest.mark.parametrize(
    ("line", "said"),
    [("+A1     1       2\n", "ends with the mark .*A1, but none does"), (",1,2\n", "but there is none above it")],
)
def test_a_continuation_of_nothing_is_refused(tmp_path, line, said):
    (tmp_path / "a.bdf").write_text(line)
    with pytest.raises(InputError, match=f"line 1 goes on with a card.*{said}"):
        list(cards(tmp_path / "a.bdf"))


def test_a_continuation_may_stand_before_all_cards(tmp_path):
    (tmp_path / "a.bdf").write_text(
        "+A1     8       9\nCHEXA   1       1       2       3       4       5       6       7       +A1\n"
    )
    (card,) = cards(tmp_path / "a.bdf")
    assert card.fields[:10] == ["1", "1", *"23456789"]


# ---- CalculiX -----------------------------------------------------------------------------------------------------


def frd(mesh, kind, width):
    """Nodes and elements as the solver writes them: long or short numbers, ten or fifteen a line."""
    numbers = {"hex8": 1, "tet4": 3, "hex20": 4, "tet10": 6}
    flag, per_line = (1, 10) if width == 10 else (0, 15)
    lines = ["    1C", f"    2C{len(mesh.points):30d}{flag:38d}"]
    lines += [f" -1{k + 1:{width}d}" + "".join(f"{x:12.5E}" for x in p) for k, p in enumerate(mesh.points)]
    lines += [" -3", f"    3C{len(mesh.blocks[0].nodes):30d}{flag:38d}"]
    for k, nodes in enumerate(mesh.blocks[0].nodes + 1):
        own = nodes[HEX20] if kind == "hex20" else nodes
        lines.append(f" -1{k + 1:{width}d}{numbers[kind]:5d}{0:5d}{1:5d}")
        for start in range(0, len(own), per_line):
            lines.append(" -2" + "".join(f"{n:{width}d}" for n in own[start : start + per_line]))
    return "\n".join([*lines, " -3", "  100CL  101 0.0", " -4  DISP        4    1", " -3", " 9999", ""])


@pytest.mark.parametrize("kind", NAMES)
@pytest.mark.parametrize("width", [5, 10])
def test_the_mesh_of_results_is_read(tmp_path, kind, width):
    mesh = box(kind)
    (tmp_path / "a.frd").write_text(frd(mesh, kind, width))
    given = fp.read_mesh(tmp_path / "a.frd")
    assert_same_mesh(given, mesh)
    assert list(given.volume_groups) == ["material_1"]


def test_binary_and_damaged_results_are_refused(tmp_path):
    text = frd(box("hex8"), "hex8", 10)
    for old, new, said in (
        ("1\n -1", "2\n -1", "is binary"),
        (" -2         1", " -2      4711", "node 4711, which the file does not define"),
        ("    1    0    1\n", "    2    0    1\n", "pe6|no result file"),
        ("0.00000E+00", "x.00000E+00", "no result file of CalculiX, or damaged"),
    ):
        (tmp_path / "a.frd").write_text(text.replace(old, new, 1))
        with pytest.raises(InputError, match=said):
            fp.read_mesh(tmp_path / "a.frd")


# ---- materials ----------------------------------------------------------------------------------------------------

FIRST = "the first of 2 temperatures"
STEEL = {"m": (2.1e11, 7850.0), "mm": (2.1e5, 7.85e-9)}


def inp(unit, elastic=None, more=""):
    E, rho = STEEL[unit]
    mesh = box("hex8")
    scale = 1000.0 if unit == "mm" else 1.0
    lines = ["*HEADING", "*NODE", *(f"{k + 1},{','.join(map(str, scale * p))}" for k, p in enumerate(mesh.points))]
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=Eall"]
    lines += [f"{k + 1},{','.join(map(str, nodes))}" for k, nodes in enumerate(mesh.blocks[0].nodes + 1)]
    lines += ["*MATERIAL, NAME=Stahl", "*ELASTIC" + (elastic or f"\n{E}, .3"), "*DENSITY", f"{rho},", more]
    return "\n".join([*lines, "*SOLID SECTION, ELSET=EALL, MATERIAL=STAHL", ""])


def test_parameters_go_on_over_several_lines_and_blanks_within_a_keyword_do_not_matter(tmp_path):
    text = inp("m").replace(
        "*SOLID SECTION, ELSET=EALL, MATERIAL=STAHL", "*Solid  Section,\n elset=Eall,\n material=STAHL"
    )
    (tmp_path / "a.inp").write_text(text)
    mesh = fp.read_mesh(tmp_path / "a.inp")
    (material,) = fp.file_materials(tmp_path / "a.inp", mesh).values()
    assert material.name == "Stahl"


@pytest.mark.parametrize("unit", STEEL)
def test_the_material_of_the_file_is_used_in_its_units(tmp_path, unit, capsys):
    (tmp_path / "a.inp").write_text(inp(unit))
    mesh = fp.read_mesh(tmp_path / "a.inp", unit=unit)
    (material,) = fp.file_materials(tmp_path / "a.inp", mesh, unit=unit).values()
    np.testing.assert_allclose((material.E, material.nu, material.rho), (2.1e11, 0.3, 7850.0))
    command = ["reduce", str(tmp_path / "a.inp"), "--unit", unit, "--method", "eigenmodes", "--modes", "2", "-o"]
    for name, more in (("own", []), ("given", ["--material", "E=2.1e11,nu=0.3,rho=7850"])):
        main([*command, str(tmp_path / f"{name}.ffr"), *more])
    said = capsys.readouterr().out
    assert "material    Eall: Stahl of a.inp, E = 2.1e+11 Pa" in said
    assert "note        --material is taken; not used: Stahl of a.inp" in said
    own, given = (fp.load_body(tmp_path / f"{name}.ffr") for name in ("own", "given"))
    np.testing.assert_allclose(own.omega2, given.omega2, rtol=1e-9)
    assert own.mass == pytest.approx(given.mass)


def test_constants_in_other_units_than_the_lengths_are_refused(tmp_path):
    (tmp_path / "a.inp").write_text(inp("mm"))
    mesh = fp.read_mesh(tmp_path / "a.inp")
    with pytest.raises(InputError, match=r"E = 210000 and density 7.85e-09, with lengths in m .*give --unit mm"):
        fp.file_materials(tmp_path / "a.inp", mesh)


def test_orthotropic_materials_and_those_that_are_not_read(tmp_path):
    nine = ", TYPE=ENGINEERING CONSTANTS\n1.2e10, 8e8, 5e8, .4, .3, .3, 7e8, 7e8,\n8e7"
    (tmp_path / "a.inp").write_text(inp("m", nine))
    mesh = fp.read_mesh(tmp_path / "a.inp")
    (material,) = fp.file_materials(tmp_path / "a.inp", mesh).values()
    expected = fp.orthotropic("Stahl", E=(1.2e10, 8e8, 5e8), nu=(0.4, 0.3, 0.3), G=(7e8, 7e8, 8e7), rho=7850.0)
    np.testing.assert_allclose(material.elasticity_tensor(), expected.elasticity_tensor(), rtol=1e-9)
    (tmp_path / "o.inp").write_text(inp("m", nine).replace("SECTION, ", "SECTION, ORIENTATION=o, "))
    with pytest.raises(InputError, match="a section has an ORIENTATION"):
        fp.file_materials(tmp_path / "o.inp", mesh)
    (tmp_path / "i.inp").write_text(inp("m").replace("SECTION, ", "SECTION, ORIENTATION=o, "))
    assert len(fp.file_materials(tmp_path / "i.inp", mesh)) == 1  # alike in all directions
    for elastic, said in ((", TYPE=ANISOTROPIC\n1.,2.", "TYPE ANISOTROPIC"), ("\nx, .3", "no number")):
        (tmp_path / "b.inp").write_text(inp("m", elastic))
        with pytest.raises(InputError, match=said):
            fp.file_materials(tmp_path / "b.inp", mesh)
    (tmp_path / "c.inp").write_text(re.sub(r"\*DENSITY\n.*\n", "", inp("m")))
    with pytest.raises(InputError, match="'Stahl' lacks its density"):
        fp.file_materials(tmp_path / "c.inp", mesh)
    (tmp_path / "d.inp").write_text(inp("m").partition("*MATERIAL")[0])
    with pytest.raises(InputError, match="no material for its elements; give --material"):
        fp.file_materials(tmp_path / "d.inp", mesh)


@pytest.mark.parametrize(
    ("elastic", "more", "name"),
    [
        ("\n2.1e11, .3, 20.\n1.9e11, .3, 300.", "", "Stahl at 20., the first of 2 temperatures"),
        (
            "\n2.1e11, .3, 20.\n1.9e11, .3, 300.",
            "7700., 300.",
            "Stahl at 20., the first of 2 temperatures with its density at 0, the first of 2 temperatures",
        ),
        ("\n2.1e11, .3", "*PLASTIC\n2e8, 0.\n*DAMPING, ALPHA=1.", "Stahl, without its *PLASTIC, without its *DAMPING"),
        (
            ", TYPE=ENGINEERING CONSTANTS\n1e10, 8e8, 5e8, .4, .3, .3, 7e8, 7e8\n8e7, 20."
            "\n9e9, 8e8, 5e8, .4, .3, .3, 7e8, 7e8\n8e7, 90.",
            "",
            "Stahl at 20., the first of 2 temperatures",
        ),
    ],
)
def test_what_of_a_material_is_not_taken_is_told_with_its_name(tmp_path, elastic, more, name):
    (tmp_path / "a.inp").write_text(inp("m", elastic, more))
    (material,) = fp.file_materials(tmp_path / "a.inp", fp.read_mesh(tmp_path / "a.inp")).values()
    assert material.name == name
    (tmp_path / "b.inp").write_text(inp("m"))
    (plain,) = fp.file_materials(tmp_path / "b.inp", fp.read_mesh(tmp_path / "b.inp")).values()
    assert plain.name == "Stahl"


@pytest.mark.parametrize("before", ["ENDDATA", "BEGIN BULK"])
def test_densities_that_are_weights(tmp_path, before):
    """PARAM,WTMASS makes mass of them, here of N/m^3, wherever it stands."""
    text = deck(box("tet4"), "tet4", free).replace("ENDDATA", "PSOLID,7,3\nMAT1,3,2.1+11,,.3,77008.5\nENDDATA", 1)
    text = text.replace(before, f"param,wtmass,.101936 $ 1/g\n{before}", 1)
    (tmp_path / "a.bdf").write_text(text)
    (material,) = fp.file_materials(tmp_path / "a.bdf", fp.read_mesh(tmp_path / "a.bdf")).values()
    assert material.rho == pytest.approx(77008.5 * 0.101936)


def test_nastran_materials(tmp_path):
    text = deck(box("tet4"), "tet4", free).replace(
        "ENDDATA", "PSOLID,7,3\nMAT1,3,2.1+11,8.0769231+10,,7850.\nENDDATA", 1
    )
    (tmp_path / "a.bdf").write_text(text)
    (material,) = fp.file_materials(tmp_path / "a.bdf", fp.read_mesh(tmp_path / "a.bdf")).values()
    np.testing.assert_allclose((material.E, material.nu, material.rho), (2.1e11, 0.3, 7850.0), rtol=1e-7)
    assert material.name == "MAT1 3"


@pytest.mark.parametrize(
    ("card", "constants", "name"),
    [
        ("MAT1,3,2.1+11,5.+10,.3,7850.", (2.1e11, 0.3), "by its E and nu, which make a shear modulus of 8.07692e+10 and not"),
        ("MAT1,3,2.1+11,8.+10,.3,7850.", (2.1e11, 0.3), ""),  # rounded
        ("MAT1,3,2.1+11,8.+10,0.,7850.", (2.1e11, 0.0), "which make a shear modulus of 1.05e+11"),
        ("MAT1,3,2.1+11,,,7850.", (2.1e11, 0.0), ""),
        ("MAT1,3,,8.+10,.3,7850.", (2.08e11, 0.3), ""),
        ("MAT1,3,,8.+10,0.,7850.", (1.6e11, 0.0), ""),
    ],
)  # fmt: skip
def test_a_shear_modulus_that_does_not_fit_is_told(tmp_path, card, constants, name):
    """Solids of Nastran take E and nu; a nu of zero is given, a blank one is not."""
    text = deck(box("tet4"), "tet4", free).replace("ENDDATA", f"PSOLID,7,3\n{card}\nENDDATA", 1)
    (tmp_path / "a.bdf").write_text(text)
    (material,) = fp.file_materials(tmp_path / "a.bdf", fp.read_mesh(tmp_path / "a.bdf")).values()
    np.testing.assert_allclose((material.E, material.nu), constants)
    assert material.name == "MAT1 3" if not name else name in material.name


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("MAT1,3,2.0+11,,.3,7850.", "material 3 is given its MAT1 twice"),
        ("PSOLID,7,4", "property 7 is given its PSOLID twice"),
    ],
)
def test_a_deck_that_contradicts_itself_is_refused(tmp_path, more, said):
    text = deck(box("tet4"), "tet4", free).replace(
        "ENDDATA", f"PSOLID,7,3\nMAT1,3,2.1+11,,.3,7850.\n{more}\nENDDATA", 1
    )
    (tmp_path / "a.bdf").write_text(text)
    with pytest.raises(InputError, match=said):
        fp.file_materials(tmp_path / "a.bdf", fp.read_mesh(tmp_path / "a.bdf"))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("*DENSITY\n7800.", "material 'Stahl' is given its \\*DENSITY twice"),
        ("*MATERIAL, NAME=STAHL\n*ELASTIC\n2e11, .3", "material 'Stahl' is given its \\*ELASTIC twice"),
        ("*SOLID SECTION, ELSET=EALL, MATERIAL=HOLZ", "element set 'EALL' is given its material twice"),
    ],
)
def test_an_input_file_that_contradicts_itself_is_refused(tmp_path, more, said):
    (tmp_path / "a.inp").write_text(inp("m", None, more))
    with pytest.raises(InputError, match=said):
        fp.file_materials(tmp_path / "a.inp", fp.read_mesh(tmp_path / "a.inp"))
