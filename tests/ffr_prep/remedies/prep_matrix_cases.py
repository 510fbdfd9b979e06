"""What is said of stiffness and mass matrices of other programs."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import scipy.sparse as sp
from matrix_models import bar, of_frame, rod
from prep_remedy import edited, rewritten, samples, with_files, words
from said import Case

import ffr_prep as fp

p = partial
ROD = of_frame(rod(fp.rectangle(0.02, 0.05), 1.0, 2))
BAR = bar("hex8", (2, 1, 1))
TIP = [fp.InterfaceRegion("tip")]


def used(model: fp.MatrixModel = ROD, *interfaces: fp.InterfaceRegion) -> object:
    return fp.from_matrices(model, interfaces or TIP)


def changed(model: fp.MatrixModel = ROD, right: tuple[fp.InterfaceRegion, ...] = (), **how: object) -> Case:
    return Case(lambda: used(replace(model, **how)), p(used, ROD))


def entry(A: sp.csr_array, i: int, j: int, value: float) -> sp.csr_array:
    dense = A.toarray()
    dense[i, j] = value
    return sp.csr_array(dense)


def rowless(A: sp.csr_array, row: int) -> sp.csr_array:
    dense = A.toarray()
    dense[row] = dense[:, row] = 0.0
    return sp.csr_array(dense)


def reduced(model: fp.MatrixModel) -> fp.FlexibleBody:
    return fp.reduce(used(model), fp.Request(name="a", reference=fp.FixedTo("tip"), reduction=fp.Eigenmodes(2)))


SCALE = sp.diags_array(np.where(ROD.components == 0, 1.2, 1.0))
GROUND = sp.diags_array(np.where(ROD.nodes == 0, 1e6, 0.0))
MODELS = [
    changed(points=ROD.points[:, :2]),
    changed(K=ROD.K[:3, :3]),
    changed(K=entry(ROD.K, 0, 0, np.nan)),
    changed(K=ROD.K.astype(complex) * 1j),
    *(changed(points=np.vstack([ROD.points[:2], [[x, 0, 0]]])) for x in (np.nan, 1e200)),
    changed(labels=np.arange(9)),
    changed(components=ROD.components[:3]),
    changed(nodes=ROD.nodes + 1),
    changed(components=ROD.components + 1),
    changed(components=np.where(ROD.components == 5, 4, ROD.components)),
    changed(groups={"tip": np.array([9])}),
    changed(K=entry(ROD.K, 0, 1, 1e9)),
    changed(M=entry(ROD.M, 0, 0, -1.0)),
    changed(M=sp.csr_array(SCALE @ ROD.M @ SCALE)),
    changed(K=sp.csr_array(ROD.K + GROUND)),
    *(Case(p(reduced, replace(ROD, K=K)), p(reduced, ROD)) for K in (sp.csr_array(-ROD.K), sp.csr_array(0 * ROD.K))),
    changed(M=sp.csr_array(0 * ROD.M)),
    changed(K=rowless(ROD.K, 9)),
    Case(p(fp.with_group, ROD, "a", [9]), p(fp.with_group, ROD, "a", [1])),
    Case(p(fp.with_node, ROD, "a", (0.3, 0, 0)), p(fp.with_node, ROD, "a", (0.5, 0, 0))),
    Case(p(fp.with_node, ROD, "a", (np.inf, 0, 0)), p(fp.with_node, ROD, "a", (0.5, 0, 0))),
    Case(
        p(fp.with_surface, ROD, ROD.points + 0.1, np.array([[0, 1, 2]])),
        p(fp.with_surface, ROD, ROD.points, np.array([[0, 1, 2]])),
    ),
    Case(
        p(used, ROD, fp.InterfaceRegion("a", "root+tip"), fp.InterfaceRegion("tip")),
        p(used, ROD, fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")),
    ),
    Case(p(used, BAR, fp.InterfaceRegion("a", "nearest 0,0,0")), p(used, BAR, fp.InterfaceRegion("left"))),
    Case(
        lambda: fp.reduce(used(), fp.Request(name="a", reference=fp.FixedTo("tip"), reduction=fp.Guyan(), stress=True)),
        lambda: fp.reduce(used(), fp.Request(name="a", reference=fp.FixedTo("tip"), reduction=fp.Eigenmodes(2))),
    ),
    Case(
        lambda: fp.reduce(used(), fp.Request(name="a", reference=fp.FixedTo("tip"), reduction=fp.Guyan(), parts=2)),
        lambda: fp.reduce(used(), fp.Request(name="a", reference=fp.FixedTo("tip"), reduction=fp.Eigenmodes(2))),
    ),
]

# ---- files -----------------------------------------------------------------------------------------------------------

MARKET, ABAQUS = ("K.mtx", "M.mtx", "rows.csv"), ("abaqus_K.mtx", "abaqus_M.mtx", "deck.inp")


def of(files: tuple[str, ...], name: str, *changes: tuple[str, str]) -> Case:
    return edited(lambda _: fp.read_matrices(files), name, *changes)


def stored(change: object = dict, **how: object) -> object:
    """A .npz file whose arrays a function has changed."""

    def act() -> object:
        np.savez("other.npz", **change(dict(np.load(samples() / "matrices.npz"))))
        return fp.read_matrices(["other.npz"], **how)

    return with_files(act, {})


def without(name: str) -> Case:
    return Case(p(stored, lambda arrays: {key: of for key, of in arrays.items() if key != name}), stored)


def with_array(name: str, value: object) -> Case:
    return Case(p(stored, lambda arrays: {**arrays, name: np.array(value)}), stored)


DOFS = "1.1\n1.2\n1.3\n2.1\n2.2\n2.3\n"
ENTRIES = "".join(f"{k} {k} {k}.\n" for k in range(1, 7))
TWO = "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n"


def calculix(**changes: str) -> object:
    files = {"a.sti": ENTRIES, "a.mas": ENTRIES, "a.dof": DOFS, "a.inp": TWO} | {
        k.replace("_", "."): v for k, v in changes.items()
    }
    return with_files(lambda: fp.read_matrices(list(files)), {name: (("", text),) for name, text in files.items()})


PUNCHED = """DMIG,KAAX,0,6,2,0,,,12
DMIG,KAAX,1,1,,1,1,2.+6
,2,1,-2.+6
DMIG,KAAX,2,1,,2,1,2.+6
DMIG,MAAX,0,6,2,0,,,12
DMIG,MAAX,1,1,,1,1,3.0
DMIG,MAAX,2,1,,2,1,5.0
"""
GRIDS = "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\n"


def dmig(old: str = "", new: str = "", grids: str = GRIDS) -> object:
    files = {"a.pch": PUNCHED.replace(old, new) if old else PUNCHED, "a.bdf": grids}
    return with_files(lambda: fp.read_matrices(list(files)), {name: (("", text),) for name, text in files.items()})


DMIG = [
    *(
        Case(p(dmig, old, new), dmig)
        for old, new in (
            ("MAAX", "MGG"),
            ("DMIG,KAAX,0,6,2", "DMIG,KAAX,0,6,3"),
            ("DMIG,KAAX,0,6", "DMIG,KAAX,0,2"),
            ("DMIG,MAAX,0,6,2,0,,,12\n", ""),
            ("DMIG,MAAX,0,", "DMIG,KAAX,0,6,2,0\nDMIG,MAAX,0,"),
            ("DMIG,MAAX,1,1,,1,1", "DMIG,MAAX,1,0,,1,1"),
        )
    ),
    Case(p(dmig, grids="CORD2R,7,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n" + GRIDS.replace("0.\nG", "0.,7\nG")), dmig),
    Case(p(dmig, grids="PARAM,POST,-1\n"), dmig),
]
FILES = [
    *DMIG,
    of(MARKET, "rows.csv", ("\n1,2,0.0", "\n1,2,0.5")),
    of(MARKET, "rows.csv", ("\n1,2,0.0", "\n1,2,left")),
    of(MARKET, "K.mtx", ("real", "complex")),
    rewritten(lambda _: fp.read_matrices(MARKET), "K.mtx", (("real", "complex"),), (("%%Matrix", "\ufeff%%Matrix"),)),
    of(MARKET, "rows.csv", ("\n1,2,", "\n1,9,")),
    of(ABAQUS, "abaqus_K.mtx", ("1,1,1,1,", "1,1,")),
    of(ABAQUS, "abaqus_K.mtx", ("1,1,1,1,", "x,1,1,1,")),
    rewritten(lambda _: fp.read_matrices(ABAQUS), "abaqus_K.mtx", (("", "1,1,1,1\n"),), ()),
    rewritten(lambda _: fp.read_matrices(ABAQUS), "abaqus_K.mtx", (("", "1,1,3.\n"),), ()),
    of(ABAQUS, "abaqus_K.mtx", ("1,1,1,1,", "1,1,1,1,1e36 \n1,1,1,1,")),
    of(ABAQUS, "abaqus_K.mtx", ("1,1,1,1,", "-3,1,-3,1,1.\n1,1,1,1,")),
    of(ABAQUS, "deck.inp", ("*NSET", "*TRANSFORM, NSET=ALL\n1., 0., 0.\n*NSET")),
    of(ABAQUS, "deck.inp", ("1, 3, 2", "1, 9, 2")),
    of(ABAQUS, "deck.inp", ("*NODE, NSET=ALL\n1,", "*NODE, NSET=ALL\n7,")),
    rewritten(lambda _: fp.read_matrices(ABAQUS), "deck.inp", (("", "*HEADING\n"),), ()),
    Case(p(calculix, a_dof=DOFS.replace("2.3", "2.4")), calculix),
    Case(p(calculix, a_sti="one\n"), calculix),
    Case(p(calculix, a_sti="1 1\n"), calculix),
    Case(p(calculix, a_sti="9 9 1.\n"), calculix),
    without("points"),
    without("K/indptr"),
    without("K/shape"),
    with_array("dofs", [[1.0, 2.0]]),
    with_array("K", [1.0, 2.0]),
    with_array("K/indptr", [1, 2]),
    with_array("units", "yd-oz-h"),
    Case(p(stored, units="yards"), p(stored, units="m-kg-s")),
    Case(
        lambda: with_files(lambda: fp.read_matrices(["a.npz"]), {"a.npz": (("", "none"),)}),
        stored,
    ),
    words("reduce-matrices matrices.npz --group tip=1 --interface tip --modes 0 --surface part.geo -o n.ffr --units in-lbf-s",
          "reduce-matrices matrices.npz --group tip=1 --interface tip --modes 0 -o n.ffr"),
]  # fmt: skip
CASES = MODELS + FILES
