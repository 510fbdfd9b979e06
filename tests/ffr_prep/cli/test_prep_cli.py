"""The command line of ffr-prep: the whole way once, and every way to fail with exit code and one line."""

import re
import subprocess
import sys
import textwrap
from dataclasses import replace

import meshio
import numpy as np
import pytest
from boxes import box_mesh
from PIL import Image
from places import MESHES

from ffr_prep import cli
from ffr_prep.body import damped, load_body, rigid_body, save_body
from ffr_prep.cli.options import interface_of, numbers_of, reference_of
from ffr_prep.cli.terminal import Step, Steps
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.mesh.mesh import Block
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported, Support, Supports
from ffr_prep.report import mode_pictures as plots

BAR = [str(MESHES / "box.geo"), "--set", "nx=6", "--set", "ny=1", "--set", "nz=1"]
INTERFACES = ["--interface", "left", "--interface", "right:mean"]


def run(*arguments, code=0):
    """The exit code of a command, in this process."""
    try:
        cli.main([str(word) for word in arguments])
        ended = 0
    except SystemExit as error:
        ended = error.code or 0
    assert ended == code


def assert_fails(capsys, message, *arguments, code=2):
    """The command ends with the code and one line that holds the message."""
    run(*arguments, code=code)
    said = capsys.readouterr().err.strip()
    assert said.startswith("ffr-prep: ")
    assert "\n" not in said
    assert message in said


@pytest.fixture(scope="module")
def body_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("body") / "bar.ffr"
    run("reduce", *BAR, "--material", "steel", *INTERFACES, "--reference", "fixed:left", "--modes", 4, "-o", path)
    return path


# ---- the whole way ------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_stress_modes_are_kept_when_asked_for(tmp_path, body_file, capsys):
    run("reduce", *BAR, "--material", "steel", *INTERFACES, "--modes", 1, "--stress", "-o", tmp_path / "bar.ffr")
    surface = load_body(tmp_path / "bar.ffr").surface
    assert surface.stress.shape == (len(surface.points), 6, surface.Phi.shape[2])
    assert load_body(body_file).surface.stress is None
    run("info", tmp_path / "bar.ffr")
    assert "mean over the elements of one material" in capsys.readouterr().out


def test_reduced_cantilever(body_file):
    """f_1 = 1.8751^2/(2 pi) sqrt(EI/(rho A L^4)) of a slender clamped beam; a square section has it twice."""
    body = load_body(body_file)
    assert body.name == "bar"
    assert body.mass == pytest.approx(7850.0 * 0.01, rel=1e-9)
    assert body.n == 4 + 12 - 6
    slender = 1.875104**2 / (2 * np.pi) * np.sqrt(2.1e11 * 0.1**2 / 12 / 7850.0)
    np.testing.assert_allclose(body.frequencies[:2], slender, rtol=0.02)
    assert [interface.kind for interface in body.interfaces] == ["rigid", "mean"]
    source = body.provenance["source"]
    assert source == {"file": "box.geo", "unit": None, "size": None, "numbers": {"nx": 6, "ny": 1, "nz": 1}, "order": 2}


def test_the_same_command_writes_the_same_bytes(body_file, tmp_path):
    again = tmp_path / "bar.ffr"
    run("reduce", *BAR, "--material", "steel", *INTERFACES, "--reference", "fixed:left", "--modes", 4, "-o", again)
    one, two = load_body(body_file), load_body(again)
    for name in ("omega2", "P_dm", "rP_dm", "PP_dm"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    assert one.provenance == two.provenance


@pytest.mark.slow
def test_damping_by_options(body_file, tmp_path, capsys):
    """Rayleigh's damping, a loss factor, ratios by mode and by frequency: of body and parts, each as `damped` has it."""
    plain = load_body(body_file)
    base = ["reduce", *BAR, "--material", "steel", *INTERFACES, "--reference", "fixed:left", "--modes", 4]
    cases = [
        (["--rayleigh", "2,1e-6", "--loss-factor", "0.01"], {"alpha": 2.0, "beta": 1e-6, "loss_factor": 0.01}),
        (["--damping", "0.01,0.02"], {"ratios": [0.01, 0.02]}),
        (["--damping-band", "300:0.005", "--damping-band", "1e3:0.02"], {"bands": [(300, 0.005), (1000, 0.02)]}),
    ]
    for words, given in cases:
        run(*base, *words, "-o", tmp_path / "d.ffr")
        np.testing.assert_allclose(load_body(tmp_path / "d.ffr").damping, damped(plain, **given).damping, rtol=1e-12)
    capsys.readouterr()
    run("info", tmp_path / "d.ffr")
    assert "damping     ratios 0.005 to 0.02 of the modes\n" in capsys.readouterr().out


def test_report_of_a_reduction(tmp_path, capsys):
    run("reduce", *BAR, "--material", "steel", *INTERFACES, "--modes", 2, "-o", tmp_path / "new" / "bar.ffr")
    said = capsys.readouterr()
    assert said.err == ""
    for words in (
        "6 hex27",
        "surfaces    left, right",
        "mass        78.5 kg",
        "right  mean",
        "Hz",
        "read the mesh",
        "bar.ffr",
    ):
        assert words in said.out
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["bar.ffr"]


def test_info(body_file, capsys):
    run("info", body_file)
    said = capsys.readouterr().out
    for words in (
        "mass        78.5 kg",
        "centre      (0.5, 0.05, 0.05) m",
        "principal",
        "FixedTo interface left",
        "CraigBampton modes 4",
        "all 12 coordinates can move independently",
        "half the frequency of mode 4",
        "steel",
    ):
        assert words in said


def test_info_says_which_interface_motions_are_missing(tmp_path, capsys):
    run(
        "reduce", *BAR, "--material", "steel", *INTERFACES, "--method", "eigenmodes", "--modes", 3, "-o", tmp_path / "b"
    )
    capsys.readouterr()
    run("info", tmp_path / "b")
    assert "only 9 independent motions of the 12 interface coordinates" in capsys.readouterr().out


def test_info_of_a_rigid_body(tmp_path, capsys):
    save_body(rigid_body("block", mass=2.0, inertia=np.array([1.0, 2.0, 2.5])), tmp_path / "b.ffr")
    run("info", tmp_path / "b.ffr")
    assert "a rigid body: it does not deform" in capsys.readouterr().out


def test_mesh(capsys):
    run("mesh", MESHES / "box.geo")
    assert "surfaces    left, right, front, back, bottom, top" in capsys.readouterr().out


def test_several_materials(tmp_path, capsys):
    script = """SetFactory("OpenCASCADE");
    Box(1) = {0, 0, 0, 1, 1, 1}; Box(2) = {1, 0, 0, 1, 1, 1};
    Coherence; Physical Volume("a") = {1}; Physical Volume("b") = {2};
    """
    (tmp_path / "two.geo").write_text(script)
    materials = ["--material", "a=E=1e9,nu=0.3,rho=1000", "--material", "b=steel"]
    run("reduce", tmp_path / "two.geo", *materials, "--method", "eigenmodes", "--modes", 1, "-o", tmp_path / "b")
    assert load_body(tmp_path / "b").mass == pytest.approx(8850.0, rel=1e-9)
    capsys.readouterr()
    assert_fails(
        capsys, "needs its volume", "reduce", tmp_path / "two.geo", "--material", "a=steel", "--material", "steel",
        "-o", tmp_path / "b",
    )  # fmt: skip


# ---- pictures -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_pictures_of_modes(body_file, tmp_path, capsys):
    run("modes", body_file, "-o", tmp_path / "pictures", "--modes", "1,3")
    names = sorted(path.name for path in (tmp_path / "pictures").iterdir())
    assert names == ["mode_01.png", "mode_03.png", "modes.png"]
    assert len(capsys.readouterr().out.splitlines()) == 3
    for name in names:
        pixels = np.asarray(Image.open(tmp_path / "pictures" / name).convert("RGB"))
        assert min(pixels.shape[:2]) > 400
        colourful = np.ptp(pixels.astype(int), axis=-1) > 60
        assert 0.01 < colourful.mean() < 0.6


def test_modes_that_a_body_does_not_have(body_file, tmp_path, capsys):
    reduce = ["reduce", *BAR, "--material", "steel", "-o", tmp_path / "d.ffr"]
    assert_fails(capsys, "alpha is -1.0; damping is a number from zero", *reduce, "--rayleigh", "-1,0")
    assert_fails(capsys, "--rayleigh 2: 2 numbers with commas", *reduce, "--rayleigh", "2")
    assert_fails(capsys, "loss_factor is nan; damping is", *reduce, "--loss-factor", "nan")
    assert_fails(capsys, "damping ratios are [-0.01]; give numbers from zero", *reduce, "--damping", "-0.01")
    assert_fails(capsys, "write a frequency in Hz and a ratio, such as 100:0.005", *reduce, "--damping-band", "100")
    bands = ["--damping-band", "9:0.1", "--damping-band", "3:0.1"]
    assert_fails(capsys, "give frequencies in Hz that ascend", *reduce, *bands)
    assert_fails(capsys, "the body has 10 modes", "modes", body_file, "-o", tmp_path, "--modes", "11")
    assert_fails(capsys, "write numbers and ranges", "modes", body_file, "-o", tmp_path, "--modes", "first")
    assert_fails(capsys, "'big' is not a number", "modes", body_file, "-o", tmp_path, "--scale", "big")
    assert_fails(capsys, "scale of the mode shapes is nan", "modes", body_file, "-o", tmp_path, "--scale", "nan")
    assert_fails(capsys, "is a file; name a folder", "modes", body_file, "-o", body_file)
    assert_fails(capsys, "--set wide: write it as NAME=VALUE", "mesh", tmp_path / "a.geo", "--set", "wide")
    assert_fails(capsys, "is a folder", "mesh", tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("text", "numbers"), [("1-3", [1, 2, 3]), ("2", [2]), ("3,1-2,1", [3, 1, 2]), ("2-99", [2, 3]), ("all", [1, 2, 3])]
)
def test_mode_numbers(text, numbers):
    assert cli._mode_numbers(text, 3) == numbers


def test_a_body_without_surface_or_modes_cannot_be_drawn(body_file, tmp_path):
    body = load_body(body_file)
    with pytest.raises(InputError, match="no surface"):
        plots.mode_pictures(replace(body, surface=None), tmp_path)
    block = rigid_body("block", mass=1.0, inertia=np.ones(3))
    with pytest.raises(InputError, match="0 modes"):
        plots.mode_pictures(replace(block, surface=replace(body.surface, Phi=body.surface.Phi[:, :, :0])), tmp_path)


def test_a_machine_that_cannot_render_is_told_what_to_install(body_file, tmp_path, capsys, monkeypatch):
    import pyvista

    def refuse(**settings):
        raise RuntimeError("no EGL")

    monkeypatch.setattr(pyvista, "Plotter", refuse)
    assert_fails(capsys, "libegl1 libgl1-mesa-dri", "modes", body_file, "-o", tmp_path / "p", code=1)
    assert not (tmp_path / "p").exists()


@pytest.mark.parametrize(
    ("extent", "right", "up"),
    [((3, 2, 1), 0, 1), ((3, 1, 2), 0, 2), ((2, 1, 3), 0, 2), ((1, 1, 1), 0, 2), ((1, 3, 2), 1, 2), ((1, 2, 9), 1, 2)],
)
def test_the_camera_sees_the_broad_side(extent, right, up):
    towards, vertical = plots._axes(np.array(extent, float))
    np.testing.assert_array_equal(vertical, np.eye(3)[up])
    assert abs(np.cross(vertical, towards)[right]) == 1


# ---- failures: exit code 2, one line, nothing overwritten ---------------------------------------------------------


def write_hexahedra(path, mesh):
    meshio.Mesh(mesh.points, [("hexahedron", mesh.blocks[0].nodes)]).write(path)
    return path


def loose_parts(folder):
    one = box_mesh("hex8", (1, 1, 1), (1, 1, 1))
    nodes = np.vstack([one.blocks[0].nodes, one.blocks[0].nodes + 8])
    points = np.vstack([one.points, one.points + np.array([3.0, 0, 0])])
    return write_hexahedra(folder / "loose.vtu", replace(one, points=points, blocks=(Block("hex8", nodes),)))


def inverted_element(folder):
    mesh = box_mesh("hex8", (2, 1, 1), (2, 1, 1))
    nodes = mesh.blocks[0].nodes.copy()
    nodes[1] = nodes[1][[4, 5, 6, 7, 0, 1, 2, 3]]
    return write_hexahedra(folder / "inverted.vtu", replace(mesh, blocks=(Block("hex8", nodes),)))


def one_node(folder):
    deck = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT,TYPE=C3D4\n1,1,2,3,4\n*NSET,NSET=tip\n4\n"
    (folder / "one.inp").write_text(deck)
    return folder / "one.inp"


def bar(folder):
    return BAR[0]


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("L=0.5", "mm", 0.5),
        ("L=0.5 m", "mm", 500.0),
        ("L=30cm", None, 0.3),
        ("L=0.3m", "mm", 300.0),
        ("L=2 in", "in", 2.0),
    ],
)
def test_lengths_with_a_unit_come_in_that_of_the_script(text, unit, value):
    """As studies give ranges with units to the lines that make bodies, each of which failed: '0.4m' is not a number."""
    assert numbers_of([text], unit) == {"L": value}


FAILURES = {
    "missing group": (bar, ["--interface", "lift"], "'lift'; did you mean 'left'"),
    "loose parts": (loose_parts, [], "2 unconnected parts"),
    "inverted element": (inverted_element, [], "element 1 (hex8)"),
    "negative density": (bar, ["--material", "E=1e9,nu=0.3,rho=-1"], "density rho is -1"),
    "unknown material": (bar, ["--material", "stel"], "did you mean steel"),
    "one node": (one_node, ["--interface", "tip"], "region 'tip' has 1 nodes"),
    "no mesh": (lambda folder: folder / "none.msh", [], "none.msh does not exist"),
    "parameter": (bar, ["--set", "nx=many"], "'many' is not a number"),
    "interface": (bar, ["--interface", "left@1,2"], "three coordinates"),
    "interface in millimetres": (bar, ["--interface", "left@500,50,50"], "(0, 0, 0) and (1, 0.1, 0.1) m; give it in"),
    "interface kind": (bar, ["--interface", "left:soft"], "kind is 'soft'"),
    "interface text": (bar, ["--interface", ":rigid"], "write NAME"),
    "reference": (bar, ["--reference", "clamped"], "write fixed:NAME"),
    "reference interface": (bar, ["--interface", "left", "--reference", "fixed:rigt"], "'rigt'; there are: 'left'"),
    "reference file": (bar, ["--reference", "none.toml"], "none.toml does not exist"),
    "method": (bar, ["--method", "magic"], "magic is not known"),
    "option": (bar, ["--colour", "red"], "--colour"),
    "unit": (bar, ["--unit", "yd"], "'yd'"),
}  # fmt: skip


@pytest.mark.parametrize("failure", FAILURES)
def test_bad_input(failure, tmp_path, capsys):
    make, arguments, message = FAILURES[failure]
    material = [] if "--material" in arguments else ["--material", "steel"]
    output = tmp_path / "body.ffr"
    output.write_text("precious")
    assert_fails(capsys, message, "reduce", make(tmp_path), *material, *arguments, "-o", output)
    assert output.read_text() == "precious"
    assert not list(tmp_path.glob("*.part"))


def test_failed_computation_has_exit_code_1(tmp_path, capsys):
    (tmp_path / "flat.geo").write_text('SetFactory("OpenCASCADE");\nRectangle(1) = {0, 0, 0, 1, 1};\n')
    assert_fails(
        capsys, "no volume", "reduce", tmp_path / "flat.geo", "--material", "steel", "-o", tmp_path / "b", code=1
    )


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (ComputationError("did not converge"), 1, "did not converge"),
        (MemoryError(), 1, "not enough memory"),
        (KeyboardInterrupt(), 1, "interrupted"),
        (PermissionError(13, "Permission denied", "b.ffr"), 2, "b.ffr: Permission denied"),
    ],
)
def test_exit_codes(error, code, message, capsys, monkeypatch):
    def fail(*arguments, **settings):
        raise error

    monkeypatch.setattr("ffr_prep.mesh.mesh.read_mesh", fail)
    assert_fails(capsys, message, "mesh", "any.msh", code=code)


def test_output_that_cannot_be_written(tmp_path, capsys):
    assert_fails(capsys, "is a folder", "reduce", BAR[0], "--material", "steel", "-o", tmp_path)
    (tmp_path / "file").write_text("")
    assert_fails(
        capsys,
        "file: File exists; choose another place",
        "reduce",
        BAR[0],
        "--material",
        "steel",
        "-o",
        tmp_path / "file" / "b.ffr",
    )


@pytest.mark.parametrize("damage", ["foreign", "truncated", "missing"])
@pytest.mark.parametrize("command", [["info"], ["modes", "-o", "pictures"]])
def test_body_files_that_cannot_be_used(damage, command, body_file, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "bad.ffr"
    if damage == "foreign":
        path.write_text("a letter")
    if damage == "truncated":
        path.write_bytes(body_file.read_bytes()[:2000])
    assert_fails(capsys, "bad.ffr", *command, path)
    assert not (tmp_path / "pictures").exists()


# ---- arguments ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "region"),
    [
        ("eye", InterfaceRegion("eye")),
        ("eye:mean", InterfaceRegion("eye", None, "mean")),
        ("pin=surface_7", InterfaceRegion("pin", "surface_7")),
        ("hook=tip:mean@0.1,-2,3e-2", InterfaceRegion("hook", "tip", "mean", (0.1, -2.0, 0.03))),
        ("hook@0.1,-2,3e-2=plane z=10", InterfaceRegion("hook", "plane z=10", "rigid", (0.1, -2.0, 0.03))),
        ("hook@0.1,-2,3e-2=tip:mean", InterfaceRegion("hook", "tip", "mean", (0.1, -2.0, 0.03))),
        ("hook:mean=tip", InterfaceRegion("hook", "tip", "mean")),
        ("hook:mean@0.1,-2,3e-2=tip", InterfaceRegion("hook", "tip", "mean", (0.1, -2.0, 0.03))),
        ("hook:mean=tip@0.1,-2,3e-2", InterfaceRegion("hook", "tip", "mean", (0.1, -2.0, 0.03))),
    ],
)
def test_interfaces(text, region):
    assert interface_of(text) == region


SUPPORTS = """
[[support]]
interface = "left"
motion = "translation"
direction = [1.0, 0.0, 0.0]
"""


def test_reference_conditions(tmp_path):
    assert reference_of("mean-axis") == MeanAxis()
    assert reference_of("fixed:left") == FixedTo("left")
    assert reference_of("fixed:bore r=6 at 1,2,0") == FixedTo("bore r=6 at 1,2,0")
    assert reference_of("simply-supported:a at 1,2,0; b") == SimplySupported("a at 1,2,0", "b")
    assert reference_of("simply-supported:left, right") == SimplySupported("left", "right")
    (tmp_path / "r.toml").write_text(SUPPORTS)
    assert reference_of(str(tmp_path / "r.toml")) == Supports((Support("left", "translation", (1.0, 0.0, 0.0)),))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[support", "not a readable TOML"),
        ("x = 1", "not a list of supports"),
        ("support = 3", "not a list of supports"),
        (SUPPORTS.replace("direction", "towards"), "not a list of supports"),
        (SUPPORTS + "stiffness = 3", "'stiffness' is not known"),
        (SUPPORTS.replace('"translation"', '"dance"'), "motion is 'dance'"),
    ],
)
def test_files_of_reference_conditions_that_cannot_be_used(text, message, tmp_path):
    (tmp_path / "r.toml").write_text(text)
    with pytest.raises(InputError, match=message):
        reference_of(str(tmp_path / "r.toml"))


def test_steps_are_told_on_a_terminal_only(capsys):
    for visible, said in ((True, "mesh ... "), (False, "")):
        steps = Steps(visible)
        steps("mesh")
        steps("reduce")
        steps.end()
        assert capsys.readouterr().err.startswith(said)
        assert [step.name for step in steps.ended] == ["mesh", "reduce"]
        assert re.fullmatch(
            r"time        0\.0 s; the longest steps: (mesh|reduce) 0\.0 s, \w+ 0\.0 s", next(iter(steps.lines()))
        )


def test_a_terminal_shows_how_far_a_step_is(capsys, monkeypatch):
    ticks = iter(np.arange(100.0))
    monkeypatch.setattr("ffr_prep.cli.terminal.time.perf_counter", lambda: next(ticks))
    steps = Steps(visible=True)
    steps("reduce")
    steps.advance(0.25, "5 of 20 modes")
    steps.end()
    shown = capsys.readouterr().err
    assert "\rreduce ... 25 %, 5 of 20 modes" in shown
    assert re.search(r"\rreduce \.\.\. 2\.0 s, \d+\.\d\d GiB\n$", shown)


def test_the_memory_of_each_step_is_its_own():
    steps = Steps(visible=False)
    steps("large")
    large = np.ones(3 * 2**24)
    steps("small")
    del large
    steps("smaller")
    steps.end()
    first, _, last = (step.memory for step in steps.ended)
    assert first - last > 300 * 2**20
    *_, memory = steps.lines()
    assert re.fullmatch(r"memory      \d\.\d\d GiB at most \(\w+\)", memory)


def test_the_longest_steps_are_told_and_the_one_with_most_memory():
    steps = Steps(visible=False, ended=[Step(f"step {k}", float(k), 2**30 * (5 - k)) for k in range(1, 5)])
    assert list(steps.lines()) == [
        "time        10.0 s; the longest steps: step 4 4.0 s, step 3 3.0 s, step 2 2.0 s",
        "memory      4.00 GiB at most (step 1)",
    ]
    assert list(Steps(visible=False, ended=[Step("all", 1.0, None)]).lines())[1] == "memory      not known"


# ---- the program as it is started ---------------------------------------------------------------------------------


def test_help_loads_nothing_heavy():
    code = """
        import sys
        from ffr_prep.cli import cli
        cli(["--help"], standalone_mode=False)
        heavy = {"numpy", "scipy", "gmsh", "skfem", "meshio", "vtk", "pyvista", "matplotlib"}
        assert not heavy & set(sys.modules)
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, check=True)
    assert "reduce" in done.stdout


def test_no_traceback_at_the_door(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "ffr_prep.cli", "info", "no.ffr"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert (
        done.stderr
        == "ffr-prep: body file no.ffr does not exist; make it with `ffr-prep reduce`, or name one that is there\n"
    )


def test_a_wrong_call_names_the_help_and_none_gets_it(capsys):
    assert_fails(capsys, "(ffr-prep reduce --help tells more)", "reduce", "--modes", "abc", "rod.msh")
    run()
    assert re.match(r"Usage: ffr-prep \[OPTIONS\] \[?COMMAND\]?", capsys.readouterr().out)  # as click has it
