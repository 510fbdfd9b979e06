"""A reduction and file formats from a module of one's own: by command, structure file and Python, no other file touched."""

import re
import sys

import numpy as np
import pytest
from matrix_models import bar
from places import MESHES, ROOT

import ffr_prep as fp
from ffr_prep import cli
from ffr_prep.body import load_body
from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import Setting, load_plugin, loaded
from ffr_prep.interchange.formats import EXCHANGE_FORMATS
from ffr_prep.matrices.formats import MATRIX_FORMATS
from ffr_prep.matrices.npz import save_matrices
from ffr_prep.mesh.formats import MESH_FORMATS
from ffr_prep.mesh.mesh import check_mesh, read_mesh
from ffr_prep.model.material import material
from ffr_prep.reduction.registry import REDUCTIONS, ReductionMethod

BOX = [str(MESHES / "box.geo"), "--set", "nx=4", "--set", "ny=2", "--set", "nz=2", "--material", "steel"]
REGISTRIES = (REDUCTIONS, MESH_FORMATS, MATRIX_FORMATS, EXCHANGE_FORMATS)

BRICKS = '''
"""Bricks: a file of six numbers, the sides of a box and the elements along them."""
import numpy as np
from ffr_prep.mesh.file_mesh import FileMesh
from ffr_prep.mesh.formats import MESH_FORMATS, MeshFormat

CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


def read(path):
    numbers = [float(word) for word in path.read_text().split()]
    sides, counts = numbers[:3], [int(n) for n in numbers[3:]]
    ends = [np.linspace(0, side, n + 1) for side, n in zip(sides, counts)]
    points = np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(-1, 3)
    index = np.arange(len(points)).reshape([n + 1 for n in counts])
    first = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    nodes = np.stack([index[tuple((first + corner).T)] for corner in CORNERS], axis=1)
    left = np.flatnonzero(points[:, 0] == 0)
    return FileMesh(points, (("hex8", nodes),), {}, {}, {"left": left}, unit="mm")


MESH_FORMATS.register(MeshFormat("bricks", "boxes of bricks", read, (".bricks",)))
'''
MORE = '''
"""A chain of masses as a matrix model, and the frequencies of a body as a file."""
import numpy as np
import scipy.sparse as sp
from ffr_prep.common.registry import Setting
from ffr_prep.interchange.formats import EXCHANGE_FORMATS, ExchangeFormat
from ffr_prep.matrices.formats import MATRIX_FORMATS, MatrixFormat
from ffr_prep.matrices.npz import from_npz

def write(body, path, *, surface, digits):
    path.write_text("\\n".join(f"{f:.{digits}f}" for f in body.frequencies))

MATRIX_FORMATS.register(MatrixFormat("MODEL.renamed", ((".renamed",),), from_npz, "an .npz by another name"))
EXCHANGE_FORMATS.register(
    ExchangeFormat("frequencies", ".hz: one to a line", (".hz",), write, None,
                   left_out=lambda body, digits: (f"all but {digits} digits",),
                   settings=(Setting("digits", int, 3, "Of a .hz file.", least=0),)))
'''


def run(*arguments, code=0):
    """The exit code of a command, in this process."""
    try:
        cli.main([str(word) for word in arguments])
        ended = 0
    except SystemExit as error:
        ended = error.code or 0
    assert ended == code


@pytest.fixture(autouse=True)
def _as_before():
    """What a test registers is gone after it."""
    kept = [dict(registry.entries) for registry in REGISTRIES]
    yield
    for registry, entries in zip(REGISTRIES, kept, strict=True):
        registry.entries = entries
    for name in [name for name in sys.modules if name.startswith("ffr_plugin:")]:
        del sys.modules[name]


@pytest.fixture
def polynomials(tmp_path):
    """The worked example of CONTRIBUTING.md as a file."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    path = tmp_path / "polynomials.py"
    path.write_text(re.search(r"```python\n(.*?)```", text, re.DOTALL)[1])
    return path


# ---- a reduction --------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_reduction_of_ones_own_by_command_and_in_python(tmp_path, polynomials):
    """The same body both ways; a polynomial of degree 3 holds the bending of a beam with parabolic curvature."""
    command = ["--plugin", polynomials, "reduce", *BOX, "--method", "polynomials"]
    run(*command, "--degree", 3, "-o", tmp_path / "b.ffr")
    body = load_body(tmp_path / "b.ffr")
    numbers = {"nx": 4, "ny": 2, "nz": 2}
    made = sys.modules[f"ffr_plugin:{polynomials.resolve()}"].Polynomials(3)
    model = fp.from_mesh(read_mesh(MESHES / "box.geo", numbers=numbers), material("steel"))
    same = fp.reduce(model, fp.Request(name="b", reference=fp.MeanAxis(), reduction=made))
    np.testing.assert_array_equal(body.omega2, same.omega2)
    assert body.provenance["reduction"] == {"type": "Polynomials", "degree": 3}
    assert body.n == 3 * 19 - 3  # 19 monomials for each axis, without three rotations
    run(*command, "--method", "eigenmodes", "--modes", 2, "-o", tmp_path / "both.ffr")
    both = load_body(tmp_path / "both.ffr").provenance["reduction"]["parts"]
    assert [part["type"] for part in both] == ["Polynomials", "Eigenmodes"]
    assert both[0]["degree"] == 2


def test_a_reduction_of_ones_own_in_a_structure_file(tmp_path, polynomials):
    text = """
reduction = [{method = "polynomials", degree = 4}, {modes = 2}]
polylines = [{member = "bar", corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0.5]], elements = 8}]
members.bar = {section = {shape = "circle", d = 0.02}, material = "steel"}
nodes = {a = [0, 0, 0]}
interfaces = {a = {}}
"""
    (tmp_path / "bar.toml").write_text(text)
    run("reduce-structure", tmp_path / "bar.toml", "-o", tmp_path / "b.ffr", code=2)
    run("--plugin", polynomials, "reduce-structure", tmp_path / "bar.toml", "-o", tmp_path / "b.ffr")
    parts = load_body(tmp_path / "b.ffr").provenance["reduction"]["parts"]
    assert parts[0] == {"type": "Polynomials", "degree": 4}
    (tmp_path / "bar.toml").write_text(text.replace("degree = 4", "degree = 0"))
    with pytest.raises(InputError, match=r"reduction\.1\.degree: .*greater than or equal to 1"):
        fp.read_structure(tmp_path / "bar.toml")


def test_help_and_messages_know_it(polynomials, capsys):
    run("--plugin", polynomials, "reduce", "--help")
    said = capsys.readouterr().out
    assert "--degree INTEGER RANGE" in said
    assert "  polynomials                    polynomials of the position up to a --degree: compact bodies" in said
    run("--plugin", polynomials, "reduce", *BOX, "--method", "polinomials", "-o", "x.ffr", code=2)
    assert "FILE.npy, polynomials" in capsys.readouterr().err
    run("reduce", *BOX, "--method", "polynomials", "--modes", "x", "-o", "x.ffr", code=2)


@pytest.mark.parametrize("entry", list(REDUCTIONS), ids=lambda entry: entry.name)
def test_every_entry_is_a_documented_class(entry):
    assert loaded(entry.target).__doc__
    assert entry.help


def test_the_front_door_has_every_reduction():
    classes = {loaded(entry.target).__name__ for entry in REDUCTIONS if not entry.name.startswith("FILE.")}
    assert classes <= set(dir(fp))


def test_every_file_of_a_method_has_its_entry():
    listed = {entry.target.partition(":")[0].rpartition(".")[2] for entry in REDUCTIONS}
    files = {path.stem for path in (ROOT / "ffr_prep" / "reduction" / "methods").glob("[a-z]*.py")}
    assert files == {*listed, "union"}


# ---- formats ------------------------------------------------------------------------------------------------------


def test_a_mesh_format_of_ones_own(tmp_path, capsys):
    (tmp_path / "bricks.py").write_text(BRICKS)
    (tmp_path / "box.bricks").write_text("100 20 10 5 2 1")
    plugin = ["--plugin", tmp_path / "bricks.py"]
    run(*plugin, "mesh", tmp_path / "box.bricks")
    run(*plugin, "mesh", "--help")
    assert "boxes of bricks" in capsys.readouterr().out
    options = ["--material", "steel", "--interface", "left", "--reference", "fixed:left", "--modes", 2]
    run(*plugin, "reduce", tmp_path / "box.bricks", *options, "-o", tmp_path / "b.ffr")
    assert load_body(tmp_path / "b.ffr").mass == pytest.approx(0.1 * 0.02 * 0.01 * material("steel").rho)
    mesh = read_mesh(tmp_path / "box.bricks", unit="cm")
    check_mesh(mesh)
    np.testing.assert_allclose(np.ptp(mesh.points, axis=0), [1.0, 0.2, 0.1])
    with pytest.raises(InputError, match="is meshed already"):
        read_mesh(tmp_path / "box.bricks", size=1.0)


def test_a_matrix_and_an_exchange_format_of_ones_own(tmp_path, capsys):
    (tmp_path / "more.py").write_text(MORE)
    plugin = ["--plugin", tmp_path / "more.py"]
    save_matrices(bar(), tmp_path / "box.npz").rename(tmp_path / "box.renamed")
    command = [*plugin, "reduce-matrices", tmp_path / "box.renamed", "--method", "eigenmodes", "--modes", 3]
    run(*command, "-o", tmp_path / "b.ffr")
    run(*plugin, "export", tmp_path / "b.ffr", "-o", tmp_path / "b.hz", "--digits", 1)
    body = load_body(tmp_path / "b.ffr")
    assert (tmp_path / "b.hz").read_text().split() == [f"{f:.1f}" for f in body.frequencies]
    assert "note        all but 1 digits" in capsys.readouterr().out
    run(*plugin, "import", tmp_path / "b.hz", "-o", tmp_path / "c.ffr", code=2)
    assert "frequencies can be written only" in capsys.readouterr().err


# ---- what cannot be registered ------------------------------------------------------------------------------------


def test_names_and_settings_have_one_meaning(polynomials):
    load_plugin(polynomials)
    load_plugin(polynomials)  # once only
    with pytest.raises(InputError, match="the reduction 'krylov' is there already"):
        REDUCTIONS.register(ReductionMethod("krylov", dict, "another"))
    with pytest.raises(InputError, match="its setting 'moments' means something else"):
        REDUCTIONS.register(ReductionMethod("mine", dict, "mine", settings=(Setting("moments", float, 1.0, "Mine."),)))


@pytest.mark.parametrize(("text", "message"), [(None, "that exists"), ("1 / 0", "fails with ZeroDivisionError")])
def test_plugins_that_cannot_be_run(tmp_path, text, message):
    if text:
        (tmp_path / "p.py").write_text(text)
    with pytest.raises(InputError, match=message):
        load_plugin(tmp_path / "p.py")
