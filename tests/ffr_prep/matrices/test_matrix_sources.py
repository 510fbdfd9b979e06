"""Files of matrix models: every format read back as the same model, every way in which a file can be wrong."""

from __future__ import annotations

import builtins
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
from boxes import box_mesh
from matrix_models import bar, of_frame, of_solid, rod, space_frame
from nastran_files import write_op2
from places import ROOT

import ffr_prep as fp
from ffr_prep.body import load_body
from ffr_prep.cli import main
from ffr_prep.cli.matrices import reduce_matrices_command
from ffr_prep.common.errors import InputError
from ffr_prep.matrices.model import MatrixModel, row_in_words, with_group
from ffr_prep.matrices.nastran import GridTable, grids_of_deck, grids_of_op2, model_of_nastran, rigid_of_deck
from ffr_prep.matrices.npz import save_matrices
from ffr_prep.matrices.readers import read_matrices
from ffr_prep.matrices.unit_systems import UNIT_SYSTEMS
from ffr_prep.mesh.abaqus import nodes_from_abaqus
from ffr_prep.model.reference import MeanAxis
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.structures.sections import rectangle


@pytest.fixture(scope="module")
def model() -> MatrixModel:
    """A frame with six rows to a node and numbers that are not 1, 2, 3, ..."""
    frame = of_frame(space_frame())
    labels = 10 * np.arange(1, 10) + 3
    return MatrixModel(
        frame.points,
        frame.K,
        frame.M,
        frame.nodes,
        frame.components,
        labels,
        groups=frame.groups,
        triangles=[[0, 1, 2]],
    )


def assert_same(one: MatrixModel, two: MatrixModel, digits: float = 0.0) -> None:
    """The same nodes, map and matrices, whatever the order of nodes and rows."""
    assert sorted(one.labels.tolist()) == sorted(two.labels.tolist())
    np.testing.assert_array_equal(one.points[np.argsort(one.labels)], two.points[np.argsort(two.labels)])
    orders = [np.lexsort((m.components, m.labels[m.nodes])) for m in (one, two)]
    for name in ("K", "M"):
        A, B = (getattr(m, name).toarray()[np.ix_(o, o)] for m, o in zip((one, two), orders, strict=True))
        np.testing.assert_allclose(A, B, rtol=0, atol=digits * np.abs(B).max())
    for name, of in one.groups.items():
        assert sorted(one.labels[of].tolist()) == sorted(two.labels[two.groups[name]].tolist())


def rows_csv(model: MatrixModel, header: str = "node,component,x,y,z,groups\n") -> str:
    lines = []
    for node, component in zip(model.nodes.tolist(), model.components.tolist(), strict=True):
        names = ";".join(name for name, of in model.groups.items() if node in of)
        at = ",".join(repr(x) for x in model.points[node].tolist())
        lines.append(f"{model.labels[node]},{component + 1},{at},{names}")
    return header + "\n".join(lines) + "\n"


# ---- npz ----------------------------------------------------------------------------------------------------------


def test_npz_and_back(model, tmp_path):
    path = save_matrices(model, tmp_path / "model.npz")
    back = read_matrices([path])
    assert_same(back, model)
    np.testing.assert_array_equal(back.triangles, model.triangles)
    assert back.source == {"format": "npz", "files": ["model.npz"], "units": "m-kg-s"}
    assert list(tmp_path.iterdir()) == [path]


def one_of_each_pair(A: sp.csr_array) -> sp.coo_array:
    """One triangle of a symmetric matrix whose rows are in another order than that in which it was written."""
    order = np.random.default_rng(3).permutation(A.shape[0])
    one = A.tocoo()
    kept = order[one.row] >= order[one.col]
    return sp.coo_array((one.data[kept], (one.row[kept], one.col[kept])), shape=A.shape)


@pytest.mark.parametrize("form", ["dense", "csr", "csc", "coo", "triangle", "either"])
def test_npz_by_hand(model, tmp_path, form):
    """What a user writes: dense arrays, or the members that scipy.sparse.save_npz writes, under K/ and M/."""
    arrays = {
        "labels": model.labels,
        "points": model.points,
        "dofs": np.stack([model.labels[model.nodes], model.components + 1], axis=1),
        "group/a": model.labels[model.groups["a"]],
    }
    for name in ("K", "M"):
        A = getattr(model, name)
        if form == "dense":
            arrays[name] = A.toarray()
            continue
        one = {"triangle": sp.tril, "either": one_of_each_pair}.get(form, lambda A: A.asformat(form))(A)
        sp.save_npz(tmp_path / "part.npz", one)
        with np.load(tmp_path / "part.npz") as stored:
            arrays |= {f"{name}/{key}": stored[key] for key in stored.files}
    np.savez(tmp_path / "model.npz", **arrays)
    back = read_matrices([tmp_path / "model.npz"])
    for name in ("K", "M"):
        np.testing.assert_array_equal(getattr(back, name).toarray(), getattr(model, name).toarray())
    assert list(back.groups) == ["a"]
    assert any("one triangle" in note for note in back.notes) == (form in ("triangle", "either"))


def test_units_of_a_file(model, tmp_path):
    arrays = {"points": model.points * 1e3, "dofs": np.stack([model.nodes + 1, model.components + 1], axis=1)}
    scale = sp.diags_array(np.where(model.components < 3, 1e-3, 1.0))
    arrays |= {"K": (scale @ model.K @ scale).toarray() * 1e3, "M": (scale @ model.M @ scale).toarray() * 1e3}
    np.savez(tmp_path / "mm.npz", units="mm-t-s", **arrays)
    np.savez(tmp_path / "odd.npz", units="mile-t-s", **arrays)
    back = read_matrices([tmp_path / "mm.npz"])
    np.testing.assert_allclose(back.points, model.points, rtol=1e-14)
    np.testing.assert_allclose(back.M.toarray(), model.M.toarray(), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(back.K.toarray(), model.K.toarray(), rtol=1e-12, atol=1e-3)
    assert back.source["units"] == "mm-t-s"
    assert read_matrices([tmp_path / "mm.npz"], units="m-kg-s").points.max() > 100
    with pytest.raises(InputError, match="declares the units 'mile-t-s'"):
        read_matrices([tmp_path / "odd.npz"])
    with pytest.raises(InputError, match="units 'km' are not known; they are m-kg-s"):
        read_matrices([tmp_path / "mm.npz"], units="km")


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"dofs": [[1, 1]]}, "has no array 'points'"),
        ({"points": np.zeros((1, 3))}, "has no array 'dofs'"),
        ({"points": np.zeros((1, 3)), "dofs": [1, 2]}, r"'dofs' has the shape \(2,\)"),
        ({"points": np.zeros((1, 3)), "dofs": [[1, 1.0]]}, "it must be .* integers"),
        ({"points": np.zeros((1, 3)), "dofs": [[1, 1]], "K": [1.0]}, r"K has the shape \(1,\)"),
        ({"points": np.zeros((1, 3)), "dofs": [[1, 1]]}, "K has no 'shape'"),
        (
            {"points": np.zeros((1, 3)), "dofs": [[1, 1]], "K/shape": [1, 1], "K/data": [1.0], "K/indices": [0]},
            "K has no 'indptr'",
        ),
        (
            {
                "points": np.zeros((1, 3)),
                "dofs": [[1, 1]],
                **{"K/shape": [1, 1], "K/data": [1.0], "K/indices": [4], "K/indptr": [0, 1]},
            },
            "K cannot be put together",
        ),
        (
            {"points": np.zeros((1, 3)), "dofs": [[2, 1]], "K": [[1.0]], "M": [[1.0]]},
            "a row belongs to node 2, which has no",
        ),
        (
            {"points": np.zeros((2, 3)), "labels": [1, 1], "dofs": [[1, 1]], "K": [[1.0]], "M": [[1.0]]},
            "node 1 is defined twice",
        ),
        (
            {"points": np.zeros((1, 3)), "dofs": [[1, 1]], "K": [[1.0]], "M": [[1.0, 0], [0, 1]]},
            "M is 2 x 2, but the table",
        ),
        ({"points": np.zeros((1, 3)), "dofs": [[1, 1]], "K": [[1.0, 2]], "M": [[1.0]]}, "K is 1 x 2, but the table"),
    ],
)
def test_npz_files_that_cannot_be_used(tmp_path, arrays, message):
    np.savez(tmp_path / "bad.npz", **arrays)
    with pytest.raises(InputError, match=message):
        read_matrices([tmp_path / "bad.npz"])


def test_files_that_are_none(tmp_path):
    (tmp_path / "bad.npz").write_bytes(b"PK not a zip")
    with pytest.raises(InputError, match=r"bad\.npz is damaged or not a \.npz file; write it with numpy\.savez"):
        read_matrices([tmp_path / "bad.npz"])
    with pytest.raises(InputError, match=r"none\.npz does not exist"):
        read_matrices([tmp_path / "none.npz"])
    (tmp_path / "K.mtx").write_text("")
    with pytest.raises(InputError, match=r"these are not files of a matrix model: .*K\.mtx; give MODEL\.npz"):
        read_matrices([tmp_path / "K.mtx"])


# ---- Matrix Market ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("header", ["", "node,component,x,y,z,groups\n"])
def test_matrix_market(model, tmp_path, header):
    for name in ("K", "M"):
        scipy.io.mmwrite(tmp_path / f"{name}.mtx", getattr(model, name), symmetry="symmetric")
    (tmp_path / "rows.csv").write_text(rows_csv(model, header))
    back = read_matrices([tmp_path / "K.mtx", tmp_path / "M.mtx", tmp_path / "rows.csv"])
    assert_same(back, model, 1e-15)
    assert back.source["format"] == "Matrix Market"


def test_matrices_of_scipy_with_a_table(model, tmp_path):
    for name in ("K", "M"):
        sp.save_npz(tmp_path / f"{name}.npz", getattr(model, name))
    (tmp_path / "rows.csv").write_text(rows_csv(model))
    assert_same(read_matrices([tmp_path / "K.npz", tmp_path / "M.npz", tmp_path / "rows.csv"]), model)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("13,1,0.0,0.0", r"rows\.csv, line 2: write node,component,x,y,z\[,groups\] \(three coordinates"),
        ("13,x,0,0,0", r"line 2: write node,component"),
        ("13,1,0,0,0\n\n13,2,0,0,1", r"line 4: node 13 is at \[0.0, 0.0, 1.0\], but was at \[0.0, 0.0, 0.0\]"),
    ],
)
def test_tables_that_cannot_be_used(tmp_path, line, message):
    scipy.io.mmwrite(tmp_path / "K.mtx", sp.eye_array(1))
    (tmp_path / "rows.csv").write_text(f"node,component,x,y,z\n{line}\n")
    with pytest.raises(InputError, match=message):
        read_matrices([tmp_path / "K.mtx", tmp_path / "K.mtx", tmp_path / "rows.csv"])


def test_a_matrix_file_that_ends_with_its_comments(tmp_path):
    (tmp_path / "K.mtx").write_text("%%MatrixMarket matrix coordinate real symmetric\n% nothing else\n")
    (tmp_path / "rows.csv").write_text("1,1,0,0,0\n")
    with pytest.raises(InputError, match="ends before the size of the matrix"):
        read_matrices([tmp_path / "K.mtx", tmp_path / "K.mtx", tmp_path / "rows.csv"])


def test_a_number_of_thousands_of_digits(tmp_path):
    (tmp_path / "K.mtx").write_text("%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 2.0\n")
    (tmp_path / "rows.csv").write_text(f"{'1' * 5000},1,0,0,0\n")
    with pytest.raises(InputError) as found:
        read_matrices([tmp_path / "K.mtx", tmp_path / "K.mtx", tmp_path / "rows.csv"])
    assert "please report" not in str(found.value)


def test_files_that_are_not_matrices(tmp_path):
    (tmp_path / "K.mtx").write_text("1,1,1,1,5.0\n")
    (tmp_path / "rows.csv").write_text("1,1,0,0,0\n")
    (tmp_path / "K.npz").write_text("1,1,1,1,5.0\n")
    with pytest.raises(InputError, match="is not a Matrix Market file"):
        read_matrices([tmp_path / "K.mtx", tmp_path / "K.mtx", tmp_path / "rows.csv"])
    with pytest.raises(InputError, match=r"K\.npz is damaged or not a \.npz file"):
        read_matrices([tmp_path / "K.npz", tmp_path / "K.npz", tmp_path / "rows.csv"])


# ---- Abaqus -------------------------------------------------------------------------------------------------------


def abaqus_deck(model: MatrixModel) -> str:
    lines = ["*Heading", "** made by hand", "*Node"]
    lines += [
        f"{label}, {', '.join(map(repr, at))}" for label, at in zip(model.labels, model.points.tolist(), strict=True)
    ]
    for name, of in model.groups.items():
        lines += [f"*Nset, nset={name}", ", ".join(map(str, model.labels[of]))]
    return "\n".join(lines) + "\n"


def abaqus_entries(model: MatrixModel, name: str, *, triangle: bool = True) -> str:
    """FORMAT=MATRIX INPUT: node, component, node, component, value, the lower triangle."""
    A = sp.coo_array(sp.tril(getattr(model, name)) if triangle else getattr(model, name))
    lines = [f"** {name} of the model"]
    for i, j, value in zip(A.row, A.col, A.data, strict=True):
        ends = [f"{model.labels[model.nodes[k]]},{model.components[k] + 1}" for k in (i, j)]
        lines.append(f"{', '.join(ends)}, {value:.17e}")
    return "\n".join(lines) + "\n"


def write_abaqus(model: MatrixModel, folder: Path, **parts: str) -> list[Path]:
    texts = {
        "STIF.mtx": abaqus_entries(model, "K"),
        "MASS.mtx": abaqus_entries(model, "M"),
        "model.inp": abaqus_deck(model),
    }
    for name, text in (texts | {key.replace("_", "."): part for key, part in parts.items()}).items():
        (folder / name).write_text(text)
    return [folder / name for name in texts]


@pytest.mark.parametrize("triangle", [True, False])
def test_abaqus_matrices(model, tmp_path, triangle):
    parts = {
        f"{file}_mtx": abaqus_entries(model, name, triangle=triangle) for file, name in (("STIF", "K"), ("MASS", "M"))
    }
    back = read_matrices(write_abaqus(model, tmp_path, **parts))
    assert_same(back, model, 1e-15)
    assert back.source["format"] == "Abaqus"
    assert any("one triangle" in note for note in back.notes) == triangle


def test_abaqus_coordinate_format(tmp_path):
    """Rows in ascending order of nodes; the exponent may be D."""
    solid = bar("hex8", (2, 1, 1))
    labels = 2 * np.arange(1, len(solid.points) + 1)
    solid = MatrixModel(solid.points, solid.K, solid.M, solid.nodes, solid.components, labels, groups=solid.groups)
    texts = {}
    for file, name in (("STIF_mtx", "K"), ("MASS_mtx", "M")):
        A = sp.coo_array(sp.tril(getattr(solid, name)))
        lines = [
            f"{i + 1} {j + 1} {value:.17e}".replace("e", "D") for i, j, value in zip(A.row, A.col, A.data, strict=True)
        ]
        texts[file] = "\n".join(lines)
    back = read_matrices(write_abaqus(solid, tmp_path, **texts))
    assert_same(back, solid, 1e-15)
    assert "rows are taken in ascending order of nodes" in back.notes


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"STIF_mtx": "13,1, 13,1, 1e36\n"}, r"stiffnesses of 1e\+36, by which Abaqus marks boundary conditions"),
        ({"STIF_mtx": "13,1, 13,1, 5.0\n-3,1, 13,1, 1.0\n"}, r"has 1 internal nodes \(the first is -3\): Lagrange"),
        ({"STIF_mtx": "13,1,13,1,5.0\n13,8, 13,8, 1.0\n"}, "is coordinate 8 of its node"),
        ({"STIF_mtx": "99,1,99,1,5.0\n"}, "a row belongs to node 99, which has no coordinates"),
        ({"STIF_mtx": "1 1 5.0\n"}, "are in different formats"),
        ({"STIF_mtx": "1 1 5.0\n", "MASS_mtx": "1 1 5.0\n"}, "9 nodes, which do not make 1 rows"),
        ({"STIF_mtx": "-1 1 5.0\n", "MASS_mtx": "1 1 5.0\n"}, "has row or column -1: Lagrange multipliers"),
        ({"STIF_mtx": "1 2\n"}, "its lines have 2 numbers"),
        ({"STIF_mtx": "** nothing\n"}, "its lines have 0 numbers"),
        ({"STIF_mtx": "one two\n"}, "is not a matrix that Abaqus writes as text"),
        ({"model_inp": "*Heading\n"}, r"model\.inp defines no nodes"),
        ({"model_inp": "*Node\n13, 0, 0, 0\n*Nset, nset=A\nB,\n"}, r"model\.inp refers to the set 'B'"),
        (
            {"model_inp": "*Node\n13, 0, 0, 0\n*Transform, nset=A\n0,1,0,-1,0,0\n"},
            r"'A' a coordinate system of its own",
        ),
    ],
)
def test_abaqus_files_that_cannot_be_used(model, tmp_path, parts, message):
    with pytest.raises(InputError, match=message):
        read_matrices(write_abaqus(model, tmp_path, **parts))


def test_nodes_of_an_input_file(tmp_path):
    (tmp_path / "a.inp").write_text("*Node, nset=All\n7, 1., 2., 3.\n3, 4., 5.\n*Nset, nset=one, generate\n3, 3, 1\n")
    labels, points, groups = nodes_from_abaqus(tmp_path / "a.inp")
    assert labels.tolist() == [7, 3]
    assert points.tolist() == [[1.0, 2.0, 3.0], [4.0, 5.0, 0.0]]
    assert {name: of.tolist() for name, of in groups.items()} == {"All": [3, 7], "one": [3]}


# ---- CalculiX -----------------------------------------------------------------------------------------------------

# Row, column and value of the first entries that CalculiX 2.20 wrote (*FREQUENCY, SOLVER=MATRIXSTORAGE) for one C3D8 element
# of 1 m x 0.5 m x 0.2 m, E = 2.1e11 Pa, nu = 0.3, 7850 kg/m^3; its rows are 10.1, 10.2, 10.3, 20.1 ...
OF_CALCULIX = {
    "K": ((1, 1, 2.9166666666667e10), (1, 2, 3.3653846153846e9), (2, 2, 3.5897435897436e10)),
    "M": ((1, 1, 2.9074074074074e1), (1, 2, 0.0), (2, 2, 2.9074074074074e1)),
}


def write_calculix(model: MatrixModel, folder: Path, **parts: str) -> list[Path]:
    """Entries of the upper triangles by columns, a line node.direction for each row, and the input file."""
    texts = {}
    for ending, name in (("sti", "K"), ("mas", "M")):
        A = sp.coo_array(sp.triu(sp.csc_array(getattr(model, name))))
        entries = zip(A.row + 1, A.col + 1, A.data, strict=True)
        texts[ending] = "".join(f"{i} {j}  {value:.13e}\n" for i, j, value in entries)
    rows = zip(model.labels[model.nodes], model.components + 1, strict=True)
    texts |= {"dof": "".join(f"{node}.{component}\n" for node, component in rows), "inp": abaqus_deck(model)}
    for ending, text in (texts | parts).items():
        (folder / f"job.{ending}").write_text(text)
    return [folder / f"job.{ending}" for ending in texts]


def test_calculix_matrices(tmp_path):
    solid = bar("hex8", (2, 1, 1))
    back = read_matrices(write_calculix(solid, tmp_path))
    assert_same(back, solid, 1e-13)
    assert back.source["format"] == "CalculiX"


def test_an_element_that_calculix_wrote(tmp_path):
    """Its matrices are those that are assembled here, rounded to 14 digits."""
    element = of_solid(box_mesh("hex8", (1.0, 0.5, 0.2), (1, 1, 1)))
    first = int(np.flatnonzero((element.points == 0.0).all(axis=1))[0])
    rows = [int(np.flatnonzero((element.nodes == first) & (element.components == c))[0]) for c in (0, 1)]
    for name, entries in OF_CALCULIX.items():
        for i, j, value in entries:
            assert getattr(element, name)[rows[i - 1], rows[j - 1]] == pytest.approx(value, rel=1e-12, abs=1e-6)


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"dof": "1.1\n1.2\nten\n"}, r"job\.dof, line 3: 'ten' is not node\.direction"),
        ({"dof": "1.1\n1.4\n"}, r"line 2: '1\.4' is not"),
        ({"dof": "1.1\n1.2\n1.3\n"}, "outside the 3 rows that the .dof file lists"),
        ({"sti": "1 1\n2 2\n"}, "has 2 numbers to a line"),
        ({"mas": "1 1 x\n"}, r"job\.mas is not a matrix that CalculiX writes"),
    ],
)
def test_calculix_files_that_cannot_be_used(tmp_path, parts, message):
    with pytest.raises(InputError, match=message):
        read_matrices(write_calculix(bar("hex8", (2, 1, 1)), tmp_path, **parts))


# ---- Nastran: the conversion, on objects as pyNastran holds them --------------------------------------------------


def grids(model: MatrixModel, **changes) -> GridTable:
    count = len(model.points)
    fields = {
        "labels": model.labels,
        "kinds": np.ones(count, int),
        "points": model.points,
        "systems": np.zeros(count, int),
        "groups": {name: model.labels[of] for name, of in model.groups.items()},
    }
    return GridTable(**{**fields, **changes})


def of_nastran(found, table: GridTable) -> MatrixModel:
    held = {name: SimpleNamespace(data=A) for name, A in found.items()}
    return model_of_nastran(Path("run.op4"), held, table, {"format": "Nastran OP4"})


@pytest.mark.parametrize("pair", [("KGG", "MGG"), ("KAA", "MAA")])
def test_nastran_matrices(model, pair):
    found = {pair[0]: sp.coo_array(model.K), pair[1]: model.M.toarray()}
    back = of_nastran(found, grids(model))
    assert_same(back, model)
    assert back.source["matrices"] == ", ".join(pair)


def with_scalar_point(model: MatrixModel, value: float) -> tuple[dict[str, np.ndarray], GridTable]:
    """A scalar point numbered between the second and the third grid point."""
    label = 25
    order = np.argsort([*model.labels, label], kind="stable")
    table = grids(
        model,
        labels=np.array([*model.labels, label])[order],
        kinds=np.array([1] * 9 + [2])[order],
        points=np.vstack([model.points, [[np.nan] * 3]])[order],
        systems=np.zeros(10, int),
    )
    found = {}
    for name, A in (("KGG", model.K.toarray()), ("MGG", model.M.toarray())):
        A = np.insert(np.insert(A, 12, 0.0, axis=0), 12, 0.0, axis=1)
        A[12, 12] = value
        found[name] = A
    return found, table


def test_scalar_points_without_stiffness_are_left_out(model):
    assert_same(of_nastran(*with_scalar_point(model, 0.0)), model)
    with pytest.raises(InputError, match="scalar point 25 has stiffness or mass"):
        of_nastran(*with_scalar_point(model, 2.0))


def test_a_matrix_that_is_there_twice(model):
    with pytest.raises(InputError, match=r"run\.op4 holds KGG 2 times"):
        of_nastran({"KGG": [model.K, model.K], "MGG": model.M}, grids(model))


@pytest.mark.parametrize(
    ("changes", "matrices", "message"),
    [
        ({}, ("KGG",), "holds KGG; it must hold KGG and MGG"),
        ({}, (), "holds no matrices"),
        ({"systems": np.array([0, 4] + [0] * 7)}, ("KGG", "MGG"), "grid point 23 are in coordinate system 4"),
        (
            {"kinds": np.array([1] * 8 + [2])},
            ("KGG", "MGG"),
            "but the 9 points have 49 degrees of freedom",
        ),
    ],
)
def test_nastran_models_that_cannot_be_used(model, changes, matrices, message):
    found = dict.fromkeys(matrices, model.K)
    with pytest.raises(InputError, match=message):
        of_nastran(found, grids(model, **changes))


def op2(model: MatrixModel, **tables) -> SimpleNamespace:
    """EQEXIN in the order of numbers, the points in internal sequence."""
    count = len(model.points)
    eqexin = SimpleNamespace(nid=model.labels, dof=6 * np.arange(count) + 1, doftype=np.ones(count, int))
    bgpdt = SimpleNamespace(nid_cp_cd_ps=np.zeros((count, 1), int), xyz=model.points)
    return SimpleNamespace(op2_results=SimpleNamespace(**({"eqexin": eqexin, "bgpdt": bgpdt, "gpdt": None} | tables)))


def test_points_of_an_op2(model):
    found = {"KGG": model.K, "MGG": model.M}
    assert_same(
        of_nastran(found, grids_of_op2(Path("run.op2"), op2(model))), MatrixModel(**{**vars(model), "groups": {}})
    )


def test_points_in_internal_sequence(model):
    """The first scalar index of each point says where its rows are."""
    shuffled = np.array([4, 0, 8, 1, 2, 3, 5, 6, 7])
    given = op2(model)
    given.op2_results.eqexin.nid = model.labels[shuffled]
    given.op2_results.eqexin.dof = 6 * shuffled + 1
    table = grids_of_op2(Path("run.op2"), given)
    np.testing.assert_array_equal(table.labels, model.labels)
    np.testing.assert_array_equal(table.points, model.points)


def test_points_of_gpdt_and_their_systems(model):
    columns = np.stack([model.labels, np.zeros(9, int), np.full(9, 5), np.zeros(9, int)], axis=1)
    single = np.ascontiguousarray(model.points, np.float32).view(np.int32)
    gpdt = SimpleNamespace(nid_cp_cd_ps=columns, xyz=single)
    table = grids_of_op2(Path("run.op2"), op2(model, bgpdt=None, gpdt=gpdt))
    assert table.systems.tolist() == [5] * 9
    np.testing.assert_allclose(table.points, model.points, rtol=1e-6)
    columns[:, 1] = 2
    with pytest.raises(InputError, match="points in local coordinates only"):
        grids_of_op2(Path("run.op2"), op2(model, bgpdt=None, gpdt=gpdt))


def test_tables_that_an_op2_lacks(model):
    with pytest.raises(InputError, match="lacks the table EQEXIN"):
        grids_of_op2(Path("run.op2"), op2(model, eqexin=None))
    with pytest.raises(InputError, match="lacks the table BGPDT"):
        grids_of_op2(Path("run.op2"), op2(model, bgpdt=None))
    short = SimpleNamespace(nid_cp_cd_ps=np.zeros((8, 1), int), xyz=model.points[:8])
    with pytest.raises(InputError, match="EQEXIN has 9 points, BGPDT 8"):
        grids_of_op2(Path("run.op2"), op2(model, bgpdt=short))


def test_points_of_bulk_data(model):
    def node(at):
        return SimpleNamespace(get_position=lambda: at, Cd=lambda: 0)

    nodes = {int(label): node(at) for label, at in zip(model.labels, model.points, strict=True)}
    sets = {
        10: SimpleNamespace(type="SET1", get_ids=lambda: [13, 23]),
        11: SimpleNamespace(type="SET1", get_ids=lambda: [1]),
    }
    table = grids_of_deck(SimpleNamespace(nodes=nodes, spoints={25: None}, sets=sets))
    assert table.labels.tolist() == [13, 23, 25, 33, 43, 53, 63, 73, 83, 93]
    assert table.kinds.tolist() == [1, 1, 2] + [1] * 7
    assert {name: of.tolist() for name, of in table.groups.items()} == {"set_10": [13, 23]}


def test_rigid_elements_of_bulk_data_are_told(model):
    """Nastran ties their nodes after KGG."""
    elements = {1: SimpleNamespace(type="RBE2"), 2: SimpleNamespace(type="RBE2"), 3: SimpleNamespace(type="RBE3")}
    (note,) = rigid_of_deck(SimpleNamespace(rigid_elements=elements, mpcs={7: []}))
    assert note.startswith(
        "2 RBE2, 1 RBE3, 1 MPC left out: rigid and averaging connections; make their nodes an interface"
    )
    assert rigid_of_deck(SimpleNamespace(rigid_elements={}, mpcs={})) == ()
    held = {"KGG": SimpleNamespace(data=model.K), "MGG": SimpleNamespace(data=model.M)}
    assert model_of_nastran(Path("run.op4"), held, grids(model), {}, [note]).notes == (note,)


# ---- Nastran: files, where pyNastran is installed -----------------------------------------------------------------


def bulk_data(model: MatrixModel) -> str:
    lines = []
    for label, at in zip(model.labels, model.points, strict=True):
        x, y, z = (f"{value:16.10f}" for value in at)
        lines += [f"GRID*   {label:16d}{0:16d}{x}{y}", f"*       {z}{0:16d}"]
    lines.append(f"SET1,10,{model.labels[0]},{model.labels[1]}")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("control", ["", "SOL 103\nCEND\nBEGIN BULK\n"])
@pytest.mark.parametrize("sparse", [True, False])
def test_op4_file(model, tmp_path, control, sparse):
    op4 = pytest.importorskip("pyNastran.op4.op4")
    form = sp.coo_matrix if sparse else (lambda A: A.toarray())
    matrices = {"KGG": (6, form(model.K)), "MGG": (6, form(model.M))}
    op4.OP4(debug=False).write_op4(str(tmp_path / "run.op4"), matrices, precision="double", is_binary=False)
    end = "ENDDATA\n" if control else ""
    (tmp_path / "run.bdf").write_text(control + bulk_data(model) + end)
    back = read_matrices([tmp_path / "run.op4", tmp_path / "run.bdf"])
    np.testing.assert_allclose(back.points, model.points, atol=1e-9)
    np.testing.assert_allclose(back.K.toarray(), model.K.toarray(), rtol=1e-14, atol=1e-3)
    assert list(back.groups) == ["set_10"]
    body = fp.reduce(fp.from_matrices(back, ()), fp.Request(name="body", reference=MeanAxis(), reduction=Eigenmodes(2)))
    own = fp.reduce(fp.from_matrices(model, ()), fp.Request(name="body", reference=MeanAxis(), reduction=Eigenmodes(2)))
    np.testing.assert_allclose(body.omega2, own.omega2, rtol=1e-5)


@pytest.mark.parametrize("wide", [True, False], ids=["double", "single"])
def test_op2_file(model, tmp_path, wide):
    """A binary file: nodes, numbers, matrices and the body, with coordinates of both precisions."""
    pytest.importorskip("pyNastran.op2.op2")
    back = read_matrices([write_op2(model, tmp_path / "run.op2", wide=wide)])
    assert back.source == {"format": "Nastran OP2", "files": ["run.op2"], "units": "m-kg-s", "matrices": "KGG, MGG"}
    assert back.labels.tolist() == sorted(model.labels.tolist())
    np.testing.assert_allclose(back.points, model.points, rtol=0, atol=0 if wide else 1e-7)
    assert_same(replace(back, points=model.points), replace(model, groups={}, triangles=None))
    body = fp.reduce(fp.from_matrices(back, ()), fp.Request(name="body", reference=MeanAxis(), reduction=Eigenmodes(2)))
    own = fp.reduce(fp.from_matrices(model, ()), fp.Request(name="body", reference=MeanAxis(), reduction=Eigenmodes(2)))
    np.testing.assert_allclose(body.omega2, own.omega2, rtol=1e-12 if wide else 1e-5)


def test_op2_files_cut_short(model, tmp_path):
    pytest.importorskip("pyNastran.op2.op2")
    whole = write_op2(model, tmp_path / "run.op2").read_bytes()
    for share in (0.1, 0.5, 0.9):
        (tmp_path / "cut.op2").write_bytes(whole[: 4 * int(share * len(whole) / 4)])
        with pytest.raises(InputError, match=r"cut\.op2"):
            read_matrices([tmp_path / "cut.op2"])


def test_files_that_pynastran_cannot_read(tmp_path):
    pytest.importorskip("pyNastran.op4.op4")
    for name in ("run.op4", "run.op2"):
        (tmp_path / name).write_text("nothing of the kind\n")
    (tmp_path / "run.bdf").write_text("GRID,1\n")
    with pytest.raises(InputError, match=r"pyNastran cannot read .*run\.op4"):
        read_matrices([tmp_path / "run.op4", tmp_path / "run.bdf"])
    with pytest.raises(InputError, match=r"pyNastran cannot read .*run\.op2"):
        read_matrices([tmp_path / "run.op2"])


@pytest.mark.parametrize("names", [("run.op2",), ("run.op4", "run.bdf")])
@pytest.mark.parametrize(
    ("raised", "told"),
    [
        (ImportError("pyNastran"), r"needs pyNastran, which is not installed: pip install 'ffr\[nastran\]'"),
        (
            AttributeError("module 'numpy' has no attribute 'in1d'"),
            r"pyNastran that is installed does not work with NumPy",
        ),
    ],
)
def test_nastran_without_a_pynastran_that_works(tmp_path, monkeypatch, names, raised, told):
    real = builtins.__import__

    def missing(name, *arguments, **keywords):
        if name.startswith("pyNastran"):
            raise raised
        return real(name, *arguments, **keywords)

    for name in names:
        (tmp_path / name).write_text("")
    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(InputError, match=told):
        read_matrices([tmp_path / name for name in names])


# ---- viscous damping, in every format ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def damped_model(model) -> MatrixModel:
    """With a dashpot between two nodes beside Rayleigh's damping."""
    C = (2e-6 * model.K + 3.0 * model.M).tolil()
    for i, j, sign in ((0, 0, 1), (12, 12, 1), (0, 12, -1), (12, 0, -1)):
        C[i, j] += 40.0 * sign
    return replace(model, C=sp.csr_array(C.tocsr()))


def assert_damped(back: MatrixModel, model: MatrixModel) -> None:
    orders = [np.lexsort((m.components, m.labels[m.nodes])) for m in (back, model)]
    C, wanted = (m.C.toarray()[np.ix_(o, o)] for m, o in zip((back, model), orders, strict=True))
    np.testing.assert_allclose(C, wanted, rtol=0, atol=1e-14 * np.abs(wanted).max())


def test_viscous_damping_of_matrix_market_and_abaqus(damped_model, tmp_path):
    for name in ("K", "M", "C"):
        scipy.io.mmwrite(tmp_path / f"{name}.mtx", getattr(damped_model, name), symmetry="symmetric")
    (tmp_path / "rows.csv").write_text(rows_csv(damped_model))
    assert_damped(read_matrices([tmp_path / name for name in ("K.mtx", "M.mtx", "C.mtx", "rows.csv")]), damped_model)
    stiffness, mass, deck = write_abaqus(damped_model, tmp_path)
    (tmp_path / "DMPV.mtx").write_text(abaqus_entries(damped_model, "C"))
    assert_damped(read_matrices([stiffness, mass, tmp_path / "DMPV.mtx", deck]), damped_model)


def test_viscous_damping_of_nastran(damped_model):
    found = {"KGG": damped_model.K, "MGG": damped_model.M, "BGG": damped_model.C.toarray()}
    back = of_nastran(found, grids(damped_model))
    assert_damped(back, damped_model)
    assert back.source["matrices"] == "KGG, MGG, BGG"
    notes = of_nastran({**found, "K4GG": damped_model.K}, grids(damped_model)).notes
    assert any("structural damping, is left out: give a loss factor" in note for note in notes)
    with pytest.raises(InputError, match="BGG has 3 rows"):
        of_nastran({**found, "BGG": np.eye(3)}, grids(damped_model))


# ---- the command --------------------------------------------------------------------------------------------------


def run(*arguments, code=0):
    try:
        main([str(word) for word in arguments])
        ended = 0
    except SystemExit as error:
        ended = error.code or 0
    assert ended == code


def test_the_command(model, tmp_path, capsys):
    path = save_matrices(model, tmp_path / "frame.npz")
    at = ",".join(repr(x) for x in model.points[8].tolist())
    words = ["--group", "pair=13,23-23,33", "--group", f"end@{at}", "--interface", "a", "--interface", "end"]
    out = tmp_path / "new" / "frame.ffr"
    run("reduce-matrices", path, *words, "--reference", "fixed:a", "--modes", 3, "-o", out)
    said = capsys.readouterr().out
    assert "matrices    npz, 9 nodes, 54 degrees of freedom" in said
    assert "groups      a, b, c, pair, end" in said
    body = load_body(out)
    assert body.n == 9
    assert body.surface.triangles.tolist() == [[0, 1, 2]]
    run("info", out)
    said = capsys.readouterr().out
    assert "format npz" in said
    assert "the body is linear" in said


def test_the_command_with_units_and_a_surface(tmp_path):
    """The matrices of a bar in millimetres and tonnes, and the two elements they come from, in one input file."""
    solid = bar("hex8", (2, 1, 1))
    lines = ["*Node"] + [f"{k + 1}, {x}, {y}, {z}" for k, (x, y, z) in enumerate((1e3 * solid.points).tolist())]
    boxes = [(0, 1), (1, 2)]
    corners = []
    for one, two in boxes:
        wanted = [
            (one, 0, 0),
            (two, 0, 0),
            (two, 1, 0),
            (one, 1, 0),
            (one, 0, 1),
            (two, 0, 1),
            (two, 1, 1),
            (one, 1, 1),
        ]
        places = np.array(wanted) * [0.5, 0.1, 0.06]
        corners.append([int(np.argmin(np.linalg.norm(solid.points - at, axis=1))) + 1 for at in places])
    lines += ["*Element, type=C3D8, elset=all", *(f"{k + 1}, {', '.join(map(str, c))}" for k, c in enumerate(corners))]
    (tmp_path / "bar.inp").write_text("\n".join(lines) + "\n")
    scale = MatrixModel(1e3 * solid.points, solid.K / 1e3, solid.M / 1e3, solid.nodes, solid.components)
    files = write_abaqus(scale, tmp_path, model_inp=(tmp_path / "bar.inp").read_text())
    words = ["--units", "mm-t-s", "--surface", tmp_path / "bar.inp", "--method", "eigenmodes", "--modes", 2]
    run("reduce-matrices", *files, *words, "--name", "bar", "-o", tmp_path / "bar.ffr")
    body = load_body(tmp_path / "bar.ffr")
    assert body.name == "bar"
    assert body.mass == pytest.approx(7850 * 0.006, rel=1e-9)
    assert len(body.surface.points) == 12
    np.testing.assert_allclose(np.ptp(body.surface.points, axis=0), [1.0, 0.1, 0.06], rtol=1e-12)
    run(
        "reduce-matrices",
        *files,
        "--units",
        "ft-lbf-s",
        "--surface",
        tmp_path / "bar.inp",
        "-o",
        tmp_path / "b.ffr",
        code=2,
    )


@pytest.mark.parametrize(
    ("group", "message"),
    [
        ("tip", "--group tip: write NAME=12,15-20 or NAME@x,y,z"),
        ("tip@1,2,z", "--group tip@1,2,z: a point has three coordinates"),
        ("tip=7", "group 'tip': there is no node 7"),
    ],
)
def test_groups_that_cannot_be(model, tmp_path, capsys, group, message):
    path = save_matrices(model, tmp_path / "frame.npz")
    run("reduce-matrices", path, "--group", group, "-o", tmp_path / "frame.ffr", code=2)
    assert message in capsys.readouterr().err
    assert not (tmp_path / "frame.ffr").exists()


def test_rows_in_words():
    model = with_group(of_frame(rod(rectangle(0.02, 0.05), 1.0, 1)), "both", [1, 2])
    assert row_in_words(model, 10) == "rotation about y of node 2 at (1, 0, 0) m"


def test_the_example_of_the_documentation(tmp_path, monkeypatch):
    """A cantilever of one beam: the lowest frequency of a tip mass m/2 is sqrt(3 EI/(m/2 L^3)) but for its rotary inertia."""
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "matrices.md").read_text(encoding="utf-8")
    space: dict = {}
    exec(compile(page.split("```python\n")[1].split("```")[0], "matrices.md", "exec"), space)
    body = space["body"]
    assert body.n == 6
    np.testing.assert_allclose(body.frequencies[:2], np.sqrt(3 * 80.0 / 0.4) / (2 * np.pi), rtol=5e-3)
    axial_frequency = np.sqrt(2e7 / 0.4) / (2 * np.pi)
    assert np.abs(body.frequencies / axial_frequency - 1).min() < 1e-12


def test_the_command_offers_all_units():
    offered = next(option for option in reduce_matrices_command.params if option.name == "units")
    assert tuple(offered.type.choices) == tuple(UNIT_SYSTEMS)


def test_a_damping_matrix_that_lets_nothing_vibrate_is_told(model):
    """Stiffness in its place, as where files are given in another order."""
    request = fp.Request(name="body", reference=MeanAxis(), reduction=Eigenmodes(2))
    for C, told in ((1e-8 * model.K, 0), (model.K, 1)):
        body = fp.reduce(fp.from_matrices(replace(model, C=sp.csr_array(C)), ()), request)
        said = [w for w in body.provenance["warnings"] if "is their order K, M, C?" in w]
        assert len(said) == told
        ratio = body.damping.diagonal() / (2 * np.sqrt(body.omega2))
        assert all(f"every mode by {ratio.min():.3g} of its critical damping" in w for w in said)
