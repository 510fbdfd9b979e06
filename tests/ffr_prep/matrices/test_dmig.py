"""Matrices that Nastran and OptiStruct punch as DMIG: every field format, both forms, condensed models, what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
import scipy.sparse as sp
from matrix_models import of_frame, space_frame

import ffr_prep as fp
from ffr_prep.common.errors import InputError
from ffr_prep.matrices.model import MatrixModel

FRAME = of_frame(space_frame())
# As the guide of MSC Nastran shows it: a header, a column with two rows in small fields, one in large ones.
PRINTED = """
DMIG    KAAX    0       6       2       0                       12
DMIG    KAAX    1       1               1       1       2.+6
        2       1       -2.+6
DMIG*   KAAX                           2               1
*                      2               1 2.000000000D+06
DMIG,MAAX,0,6,2,0,,,12
DMIG,MAAX,1,1,,1,1,3.0
DMIG,MAAX,2,1,,2,1,5.0
"""
GRIDS = "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\n"


def punched(name: str, A: sp.sparray, model: MatrixModel, form: int = 6) -> str:
    """Large fields with nine digits, as programs punch them; of a symmetric matrix the lower triangle."""
    A = sp.csc_array(sp.tril(A) if form == 6 else A)
    label, component = model.labels[model.nodes], model.components + 1
    lines = [f"DMIG    {name:8}{0:8d}{form:8d}{2:8d}{0:8d}{'':16}{A.shape[1]:8d}"]
    for j in range(A.shape[1]):
        entries = slice(A.indptr[j], A.indptr[j + 1])
        if A.indptr[j] == A.indptr[j + 1]:
            continue
        lines.append(f"DMIG*   {name:16}{label[j]:16d}{component[j]:16d}{'':16}")
        lines += [
            f"*       {label[i]:16d}{component[i]:16d}{value:16.9E}".replace("E", "D")
            for i, value in zip(A.indices[entries], A.data[entries], strict=True)
        ]
    return "\n".join([*lines, ""])


def grids(model: MatrixModel, more: str = "") -> str:
    points = "".join(
        f"GRID,{n},,{x:.9f},{y:.9f},{z:.9f}\n" for n, (x, y, z) in zip(model.labels, model.points, strict=True)
    )
    sets = "".join(f"SET1,{k},{model.labels[of[0]]}\n" for k, of in enumerate(model.groups.values(), 1))
    return f"SOL 103\nCEND\nBEGIN BULK\n{points}{sets}{more}ENDDATA\n"


def read(folder: Path, matrices: str, deck: str) -> MatrixModel:
    paths = folder / "run.pch", folder / "run.bdf"
    for path, text in zip(paths, (matrices, deck), strict=True):
        path.write_text(text)
    return fp.read_matrices(paths)


def whole(form: int = 6, **more: sp.sparray) -> str:
    every = {"KAAX": FRAME.K, "MAAX": FRAME.M, **more}
    return "$TITLE = punched\n" + "".join(punched(name, A, FRAME, form) for name, A in every.items())


@pytest.mark.parametrize("form", [6, 1])
def test_a_model_comes_back(tmp_path, form):
    back = read(tmp_path, whole(form, BAAX=1e-5 * FRAME.K, K4AAX=FRAME.K), grids(FRAME, "GRID,99,,9.,9.,9.\n"))
    assert back.points == pytest.approx(FRAME.points, abs=1e-8)  # without the grid point that has no rows
    for name, A in (("K", FRAME.K), ("M", FRAME.M), ("C", 1e-5 * FRAME.K)):
        assert abs(getattr(back, name) - A).max() < 1e-9 * abs(A).max()
    assert {name: of.tolist() for name, of in back.groups.items()} == {
        f"set_{k}": of.tolist() for k, of in enumerate(FRAME.groups.values(), 1)
    }
    assert any("K4AAX left out" in note for note in back.notes)


@pytest.mark.slow
def test_a_body_of_it_is_that_of_the_model(tmp_path):
    """To ten digits of K, of which bending takes a thousandth."""
    back = read(tmp_path, whole(), grids(FRAME))
    request = fp.Request(name="b", reference=fp.FixedTo("a"), reduction=fp.CraigBampton(2))
    ends = {"a": [f"set_{k}" for k in (1, 2)], "given": list(FRAME.groups)[:2]}
    bodies = [
        fp.reduce(fp.from_matrices(of, [fp.InterfaceRegion("a", one), fp.InterfaceRegion("b", other)]), request)
        for of, (one, other) in zip((back, FRAME), ends.values(), strict=True)
    ]
    assert bodies[0].frequencies == pytest.approx(bodies[1].frequencies, rel=2e-5)
    assert bodies[0].mass == pytest.approx(bodies[1].mass, rel=1e-8)


def test_all_field_formats_are_read(tmp_path):
    model = read(tmp_path, PRINTED, GRIDS)
    assert model.K.toarray().tolist() == [[2e6, -2e6], [-2e6, 2e6]]
    assert model.M.toarray().tolist() == [[3.0, 0.0], [0.0, 5.0]]


def test_places_in_a_cylindrical_system_and_its_displacements(tmp_path):
    system = "CORD2C,7,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n"
    model = read(tmp_path, PRINTED, system + GRIDS.replace("GRID,2,,1.,0.,0.", "GRID,2,7,1.,90.,0."))
    assert model.points[1] == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    with pytest.raises(InputError, match="displacements of GRID 2 are in coordinate system 7"):
        read(tmp_path, PRINTED, system + GRIDS.replace("GRID,2,,1.,0.,0.", "GRID,2,,1.,0.,0.,7"))
    with pytest.raises(InputError, match="displacements of GRID 1 are in coordinate system 7"):
        read(tmp_path, PRINTED, system + "GRDSET,,,,,,7\n" + GRIDS)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("MAAX", "MGG", "it holds KAAX, MGG; it must hold one stiffness and one mass"),
        ("DMIG", "DMI", "it holds no matrices"),
        ("KAAX    0       6       2", "KAAX    0       6       3", "has complex numbers"),
        ("KAAX    0       6 ", "KAAX    0       2 ", "KAAX is of the form 2"),
        ("DMIG,MAAX,0,6,2,0,,,12\n", "", "MAAX has a column before its header"),
        ("DMIG,MAAX,0,", "DMIG,KAAX,0,6,2,0\nDMIG,MAAX,0,", "begins twice"),
        ("DMIG,MAAX,1,1,,1,1", "DMIG,MAAX,1,0,,1,1", "that of a scalar point"),
        ("2.+6", "two", "where a number belongs"),
    ],
)
def test_files_that_cannot_be_used(tmp_path, old, new, message):
    assert old in PRINTED
    with pytest.raises(InputError, match=message) as told:
        read(tmp_path, PRINTED.replace(old, new), GRIDS)
    assert "run.pch" in str(told.value)


def test_a_row_without_a_place_and_a_deck_without_grid_points(tmp_path):
    with pytest.raises(InputError, match="node 2, which has no coordinates"):
        read(tmp_path, PRINTED, GRIDS.partition("\n")[0])
    with pytest.raises(InputError, match=r"run\.bdf: it has no GRID"):
        read(tmp_path, PRINTED, "PARAM,POST,-1\n")
