"""What is said of matrices of Nastran and scikit-fem, and of those that no free body has."""

from __future__ import annotations

import builtins
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import scipy.sparse as sp
import skfem
from boxes import STEEL
from matrix_models import bar, lumped, of_frame, of_solid, rod, space_frame
from prep_remedy import samples, with_files, words
from said import Case
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

import ffr_prep as fp
from ffr_prep.matrices.model import without_empty_rows
from ffr_prep.matrices.nastran import GridTable, grids_of_op2, model_of_nastran

p = partial
ROD = of_frame(rod(fp.rectangle(0.02, 0.05), 1.0, 2))
FRAME = of_frame(space_frame())
SOLID = bar("hex8", (2, 1, 1))
SOLID = replace(SOLID, groups={**SOLID.groups, "middle": np.flatnonzero(SOLID.points[:, 0] == 0.5)})
GIVEN = Path("run.op2")

# ---- Nastran ---------------------------------------------------------------------------------------------------------


def grids(**changes: object) -> GridTable:
    count = len(ROD.points)
    fields = {"labels": ROD.labels, "kinds": np.ones(count, int), "points": ROD.points, "systems": np.zeros(count, int)}
    return GridTable(**{**fields, "groups": {}, **changes})


def nastran(table: GridTable | None = None, **found: object) -> object:
    found = found or {"KGG": ROD.K, "MGG": ROD.M}
    return model_of_nastran(
        GIVEN, {name: SimpleNamespace(data=A) for name, A in found.items()}, table or grids(), {"format": "Nastran OP2"}
    )


def with_scalar_point(stiffness: float) -> object:
    """A scalar point behind the grid points."""
    table = grids(
        labels=np.append(ROD.labels, 99),
        kinds=np.array([1, 1, 1, 2]),
        points=np.vstack([ROD.points, [[np.nan] * 3]]),
        systems=np.zeros(4, int),
    )
    K, M = (sp.block_diag([A, sp.csr_array([[value]])], "csr") for A, value in ((ROD.K, stiffness), (ROD.M, 0.0)))
    return nastran(table, KGG=K, MGG=M)


def op2(count: int = 3, **tables: object) -> object:
    """Tables of an OP2 file with `count` places."""
    usual = {
        "eqexin": SimpleNamespace(nid=ROD.labels, dof=6 * np.arange(3) + 1, doftype=np.ones(3, int)),
        "bgpdt": SimpleNamespace(nid_cp_cd_ps=np.zeros((count, 1), int), xyz=ROD.points[:count]),
    }
    return grids_of_op2(GIVEN, SimpleNamespace(op2_results=SimpleNamespace(**{**usual, "gpdt": None, **tables})))


LOCAL = SimpleNamespace(nid_cp_cd_ps=np.full((3, 4), 2), xyz=ROD.points)


def without_pynastran(name: str, raised: Exception) -> object:
    real = builtins.__import__

    def missing(module: str, *rest: object, **named: object) -> object:
        if module.startswith("pyNastran"):
            raise raised
        return real(module, *rest, **named)

    with patch.object(builtins, "__import__", missing):
        return with_files(lambda: fp.read_matrices([name]), {name: (("", ""),)})


NPZ = p(with_files, lambda: fp.read_matrices(["matrices.npz"]), {})
NASTRAN = [
    Case(p(nastran, KGG=ROD.K), nastran),
    Case(p(nastran, KGG=[ROD.K, ROD.K], MGG=ROD.M), p(nastran, KGG=ROD.K, MGG=ROD.M)),
    Case(p(nastran, grids(kinds=np.array([1, 1, 2]))), nastran),
    Case(p(nastran, grids(systems=np.array([0, 4, 0]))), p(nastran, grids(systems=np.zeros(3, int)))),
    Case(p(with_scalar_point, 2.0), p(with_scalar_point, 0.0)),
    Case(p(op2, eqexin=None), op2),
    Case(p(op2, bgpdt=None), op2),
    Case(p(op2, bgpdt=None, gpdt=LOCAL), op2),
    Case(p(op2, 2), op2),
    Case(p(without_pynastran, "a.op2", ImportError("pyNastran")), NPZ),
    Case(p(without_pynastran, "a.op2", ValueError("no header")), NPZ),
    Case(p(without_pynastran, "a.op2", AttributeError("module 'numpy' has no attribute 'in1d'")), NPZ),
]

# ---- scikit-fem ------------------------------------------------------------------------------------------------------

PLAIN = skfem.MeshTet().with_boundaries({"left": lambda x: x[0] < 1e-9})


@cache
def assembled(element: skfem.Element, elements: object = None) -> tuple[skfem.Basis, sp.csr_array, sp.csr_array]:
    basis = skfem.Basis(PLAIN, element, elements=elements)
    K = linear_elasticity(*lame_parameters(STEEL.E, STEEL.nu)).assemble(basis)
    return basis, K, skfem.BilinearForm(lambda u, v, w: STEEL.rho * dot(u, v)).assemble(basis)


VECTOR = skfem.ElementVector(skfem.ElementTetP1())


def used(
    element: skfem.Element = VECTOR, elements: object = None, rows: int | None = None, **regions: object
) -> object:
    basis, K, M = assembled(element, elements)
    return fp.from_skfem(basis, K[:rows, :rows], M, regions=regions)


def plane() -> object:
    basis = skfem.Basis(skfem.MeshTri(), skfem.ElementVector(skfem.ElementTriP1()))
    return fp.from_skfem(basis, np.eye(8), np.eye(8))


def scalar() -> object:
    return fp.from_skfem(skfem.Basis(PLAIN, skfem.ElementTetP1()), np.eye(8), np.eye(8))


SKFEM = [
    Case(scalar, used),
    Case(plane, used),
    Case(p(used, elements=(0, 1)), used),
    Case(p(used, skfem.ElementVector(skfem.ElementTetMini())), used),
    Case(p(used, rows=6), used),
    Case(p(used, left=[0]), p(used, tip=[0])),
    Case(p(used, tip=[999]), p(used, tip=[0])),
]

# ---- matrices that no free body has ----------------------------------------------------------------------------------


def reduced(model: fp.MatrixModel, tip: str = "tip", n: int = 2, **more: object) -> fp.FlexibleBody:
    coupled = fp.from_matrices(model, [fp.InterfaceRegion(tip)])
    wanted = fp.Request(name="a", reference=fp.FixedTo(tip), reduction=fp.Eigenmodes(n), **more)
    return fp.reduce(coupled, wanted)


def entries(A: sp.csr_array, *places: tuple[int, int, float]) -> sp.csr_array:
    """A with these values added, on both sides of its diagonal."""
    dense = A.toarray()
    for i, j, value in places:
        dense[i, j] += value
        dense[j, i] += value if i != j else 0.0
    return sp.csr_array(dense)


def changed(model: fp.MatrixModel = ROD, tip: str = "tip", **how: object) -> Case:
    return Case(lambda: reduced(replace(model, **how), tip), p(reduced, model, tip))


def rows_of(model: fp.MatrixModel, rows: np.ndarray) -> fp.MatrixModel:
    K, M = (A[rows][:, rows] for A in (model.K, model.M))
    return replace(model, K=K, M=M, nodes=model.nodes[rows], components=model.components[rows])


def hinged() -> fp.MatrixModel:
    """Two cubes that share an edge, which is a hinge without energy."""
    corner = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    one = np.vstack([corner, np.add(corner, (0, 0, 1))])
    two = np.add(one, (1, 1, 0))[[1, 2, 3, 5, 6, 7]]
    cells = np.array([[0, 1, 2, 3, 4, 5, 6, 7], [2, 8, 9, 10, 6, 11, 12, 13]])
    cubes = of_solid(fp.Mesh(np.vstack([one, two]), (fp.Block("hex8", cells),), {}, {}, {}))
    return replace(cubes, groups={"tip": np.arange(3)})


def softened(model: fp.MatrixModel = SOLID) -> fp.MatrixModel:
    """With a spring of negative stiffness between two nodes, along their line."""
    i, j = (3 * int(model.groups[name][0]) for name in ("left", "right"))
    k = model.K.diagonal()[[i, j]].min() / 2
    return replace(model, K=entries(model.K, (i, i, -k), (j, j, -k), (i, j, k)))


LUMPED = replace(ROD, M=lumped(ROD))
TURNED = 6 * 1 + 3
SPARED = entries(LUMPED.M, (TURNED, 0, 1e-3))
NEGATIVE = entries(ROD.M, (0, 6, 10.0 * ROD.M.diagonal()[0]))
TWISTED = entries(ROD.M, *((6 * k, 6 * k + 3, 1e-3) for k in range(3)))
TIED = fp.from_matrices(ROD, [fp.InterfaceRegion("tip")])
SURFACED = replace(ROD, triangles=np.array([[0, 1, 2]]))
CHECKS = [
    Case(lambda: reduced(rows_of(SOLID, np.arange(1, len(SOLID.nodes))), "right"), p(reduced, SOLID, "right")),
    changed(M=SPARED),
    changed(M=NEGATIVE),
    changed(M=TWISTED),
    Case(lambda: reduced(hinged()), p(reduced, SOLID, "right")),
    Case(lambda: reduced(softened(), "middle"), p(reduced, SOLID, "middle")),
    Case(lambda: reduced(LUMPED), p(reduced, ROD)),
    Case(
        lambda: reduced(replace(FRAME, M=lumped(FRAME)), "a", 40),
        lambda: reduced(replace(FRAME, M=lumped(FRAME)), "a", 4),
    ),
    Case(
        lambda: reduced(replace(FRAME, M=lumped(FRAME)), "a", 4, quality=fp.Band(1.0, 20.0)),
        lambda: reduced(replace(FRAME, M=lumped(FRAME)), "a", 4),
    ),
    Case(
        lambda: fp.tied({"a": fp.from_matrices(LUMPED, [fp.InterfaceRegion("tip")])}, []),
        lambda: fp.tied({"a": TIED}, []),
    ),
    Case(
        lambda: without_empty_rows(rows_of(SURFACED, np.arange(6, 18))),
        lambda: without_empty_rows(SURFACED),
    ),
    Case(lambda: TIED.stiffening(np.zeros(0)), p(reduced, ROD)),
]
# ---- files of Abaqus -------------------------------------------------------------------------------------------------

DECK = "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n"
ROWS = "".join(f"{k} {k} {k}.\n" for k in range(1, 7))


def coordinates(entries: str = ROWS, **more: str) -> object:
    files = {"K.mtx": entries, "M.mtx": ROWS, "a.inp": DECK, **more}
    return with_files(lambda: fp.read_matrices(list(files)), {name: (("", text),) for name, text in files.items()})


def damaged() -> object:
    def act() -> object:
        content = (samples() / "matrices.npz").read_bytes()
        Path("other.npz").write_bytes(content[:60] + bytes(60) + content[120:])
        return fp.read_matrices(["other.npz"])

    return with_files(act, {})


FILES = [
    Case(p(coordinates, ROWS.replace("6 6", "0 0")), coordinates),
    Case(p(coordinates, ROWS + "7 7 7.\n"), coordinates),
    Case(damaged, NPZ),
    words(
        "reduce-matrices matrices.npz --group tip=1 --interface tip --modes 0 --surface part.geo -o n.ffr --units ft-lbf-s",
        "reduce-matrices matrices.npz --group tip=1 --interface tip --modes 0 -o n.ffr",
    ),
]
CASES = NASTRAN + SKFEM + CHECKS + FILES
