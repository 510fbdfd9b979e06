"""Quality of a reduction: every number against the full model, closed forms of sag and growth, the report, guards."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from boxes import STEEL, box_mesh
from matrix_models import lumped, of_frame
from matrix_models import space_frame as matrix_frame
from PIL import Image
from test_prep_cli import BAR, INTERFACES, assert_fails, run
from test_structural import regions, straight

import ffr_prep as fp
from ffr_prep.body import load_body, save_body
from ffr_prep.common.errors import InputError
from ffr_prep.mesh.mesh import Block, Mesh
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis, SimplySupported, functionals
from ffr_prep.reduction.basis import factorised
from ffr_prep.reduction.mesh_resolution import element_edges, elements_per_wavelength, resolution_warnings
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.reduction.methods.guyan import Guyan
from ffr_prep.reduction.methods.inertia_relief import InertiaRelief
from ffr_prep.reduction.methods.rubin import Rubin
from ffr_prep.reduction.methods.union import Union
from ffr_prep.reduction.quality import assess, quality_of, steady_errors
from ffr_prep.reduction.selection import Accuracy, Band, UpTo
from ffr_prep.report.quality_pictures import quality_pictures
from ffr_prep.report.text import body_lines, quality_lines, short_lines
from ffr_prep.solids.assembly import assemble
from ffr_prep.solids.interfaces import couple
from ffr_prep.solids.stiffening import inertial_loads
from ffr_prep.structures.frame import Member, polyline
from ffr_prep.structures.sections import rectangle

SIZE = (1.0, 0.1, 0.1)
BOTH = (InterfaceRegion("left"), InterfaceRegion("right", kind="mean"))
BAND = Band(10.0, 1200.0)


def coupled(mesh, interfaces=BOTH):
    matrices = assemble(mesh, STEEL)
    model = couple(mesh, matrices, interfaces)
    loads = model.B.T @ inertial_loads(mesh.points, matrices)
    return replace(model, inertial_loads=loads, edges=element_edges(mesh))


def reduced(mesh, reference, reduction, interfaces=BOTH, quality=None):
    return fp.reduce(
        fp.from_mesh(mesh, STEEL, interfaces),
        fp.Request(name="b", reference=reference, reduction=reduction, quality=quality),
    )


@pytest.fixture(scope="module")
def model():
    return coupled(box_mesh("hex20", SIZE, (10, 1, 1)))


@pytest.fixture(scope="module")
def body(model):
    return factorised(model)


def assessed(model, body, reference, reduction):
    L = functionals(reference, model)
    return assess(model, body, L, reduction.basis(model, body, L), BAND)


# ---- against the full model -------------------------------------------------------------------------------------------


def test_frequency_errors_are_those_of_the_dense_model(model, body):
    found = assessed(model, body, FixedTo("left"), CraigBampton(4))
    L = functionals(FixedTo("left"), model)
    null = scipy.linalg.null_space(L)
    omega2 = scipy.linalg.eigvalsh(null.T @ model.K @ null, null.T @ model.M @ null)
    exact = np.sqrt(omega2) / (2 * np.pi)
    count = found.mode_frequencies.size
    assert exact[count - 1] <= 2 * BAND.high < exact[count]
    np.testing.assert_allclose(found.mode_frequencies, exact[:count], rtol=1e-7)
    basis = CraigBampton(4).basis(model, body, L)
    errors = np.sqrt(basis.omega2[:count]) / (2 * np.pi) / exact[: min(count, basis.omega2.size)] - 1
    np.testing.assert_allclose(found.frequency_errors, errors, atol=1e-7)
    assert (found.frequency_errors > -1e-7).all()
    assert found.frequency_errors.max() > 1e-3


@pytest.mark.parametrize(
    "reference", [FixedTo("left"), SimplySupported("left", "right"), MeanAxis()], ids=lambda r: type(r).__name__
)
def test_what_concerns_the_free_body_does_not_depend_on_the_reference(model, body, reference):
    one, other = (assessed(model, body, r, CraigBampton(6)) for r in (MeanAxis(), reference))
    np.testing.assert_allclose(one.receptance_errors, other.receptance_errors, rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(one.flexibility_error, other.flexibility_error, rtol=1e-4)
    np.testing.assert_allclose(one.full, other.full, rtol=1e-6)


def test_more_modes_are_better(model, body):
    few, many = (assessed(model, body, FixedTo("left"), CraigBampton(n)) for n in (2, 20))
    assert many.receptance_errors.max() < few.receptance_errors.max() / 10
    assert many.frequency_errors.max() < few.frequency_errors[: many.frequency_errors.size].max() / 10


def test_inertia_relief_makes_steady_deformation_exact(model, body):
    for reference in (FixedTo("left"), MeanAxis()):
        found = assessed(model, body, reference, Union((CraigBampton(2), InertiaRelief())))
        assert np.nanmax(found.displacement_errors) < 1e-6
        assert np.nanmax(found.stress_errors) < 1e-4
        assert found.flexibility_error < 1e-8
        assert not any("steady deformation" in warning for warning in found.warnings)


def test_steady_errors_are_those_of_the_static_solutions(model, body):
    """A cantilever under gravity across it, reduced to two bending modes."""
    L = functionals(FixedTo("left"), model)
    basis = Eigenmodes(2).basis(model, body, L)
    displacement, stress = steady_errors(model, body, L, basis)
    null = scipy.linalg.null_space(L)
    load = -(model.M @ model.T[:, 1])
    exact = null @ np.linalg.solve(null.T @ model.K @ null, null.T @ load)
    found = basis.Z @ (basis.Z.T @ load / basis.omega2)
    off = exact - found
    assert displacement[1] == pytest.approx(np.sqrt(off @ model.M @ off / (exact @ model.M @ exact)), rel=1e-4)
    assert stress[1] == pytest.approx(np.sqrt(off @ model.K @ off / (exact @ model.K @ exact)), rel=1e-4)


def test_bodies_without_interfaces(body):
    model = coupled(box_mesh("hex8", SIZE, (6, 1, 1)), ())
    found = assessed(model, factorised(model), MeanAxis(), Eigenmodes(3))
    assert found.points == ()
    assert np.isnan(found.flexibility_error)
    assert np.isnan(found.displacement_errors[:6]).all()
    assert found.displacement_errors[7] > 0.01


# ---- sag and growth ---------------------------------------------------------------------------------------------------

G = 9.81


def steady_tip(body, force):
    """Displacement of "right" under a generalised force (n,)."""
    return body.interface("right").phi_t @ (force / body.omega2)


@pytest.mark.slow
def test_a_cantilever_sags_under_gravity():
    """q L^4 / 8 E I, through the integral of the modes alone; without Poisson's ratio, which the clamp would hinder."""
    size, material = (1.0, 0.02, 0.02), Material("beam", 2.1e11, 0.0, 7850.0)
    body = fp.reduce(
        fp.from_mesh(box_mesh("hex20", size, (20, 1, 1)), material, BOTH),
        fp.Request(
            name="b", reference=FixedTo("left"), reduction=Union((Guyan(), InertiaRelief())), quality=Band(5.0, 100.0)
        ),
    )
    sag = material.rho * G * size[0] ** 4 / (8 * material.E * size[1] ** 2 / 12)
    assert steady_tip(body, body.P_dm.T @ (0, -G, 0))[1] == pytest.approx(-sag, rel=5e-3)
    assert not any("steady" in warning for warning in body.provenance["warnings"])


def test_a_basis_that_cannot_sag_says_so():
    """Free-free modes of a body that is held at one end."""
    mesh = box_mesh("hex20", SIZE, (10, 1, 1))
    body = reduced(mesh, MeanAxis(), Eigenmodes(2), quality=Band(5.0, 100.0))
    warnings = [warning for warning in body.provenance["warnings"] if "steady deformation" in warning]
    assert len(warnings) == 1
    assert "gravity" in warnings[0]
    assert "spin" in warnings[0]
    assert any("steady deformation" in line for line in short_lines(body))


def ring(radius: float, width: float, cells: int) -> Mesh:
    """A thin ring about z: a bar of square section whose ends are joined."""

    def around(points):
        angle = 2 * np.pi * points[:, 0]
        r = radius + points[:, 1] - width / 2
        return np.stack([r * np.cos(angle), r * np.sin(angle), points[:, 2]], axis=1)

    mesh = box_mesh("hex20", (1.0, width, width), (cells, 1, 1), mapped=around)
    _, first, index = np.unique(mesh.points.round(9), axis=0, return_index=True, return_inverse=True)
    index = index.ravel()
    # the mapping turns x, y, z into a left-handed order, so the elements are turned inside out
    nodes = index[mesh.blocks[0].nodes][:, [4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 16, 17, 18, 19]]
    return Mesh(mesh.points[first], (Block("hex20", nodes),), {"body": np.arange(cells)}, {}, {})


def spin_growth(body, radius):
    """Mean radial growth of the surface per square of the angular velocity about z, from the integrals alone."""
    force = body.rP_dm[0, 0] + body.rP_dm[1, 1]  # - (w w^T - w^2 I) : rP of a rotation about z
    Phi, points = body.surface.Phi, body.surface.points
    radial = points * (1, 1, 0) / np.linalg.norm(points * (1, 1, 0), axis=1)[:, None]
    return np.einsum("pc,pcn,n->p", radial, Phi, force / body.omega2).mean()


@pytest.mark.slow
def test_a_thin_ring_grows_under_spin():
    """rho Omega^2 R^3 / E."""
    radius = 1.0
    mesh = ring(radius, 0.02, 40)
    grown = STEEL.rho * radius**3 / STEEL.E
    body = reduced(mesh, MeanAxis(), Union((Eigenmodes(4), InertiaRelief())), (), quality=Band(1.0, 50.0))
    assert spin_growth(body, radius) == pytest.approx(grown, rel=1e-2)
    assert not any("steady" in warning for warning in body.provenance["warnings"])
    poor = reduced(mesh, MeanAxis(), Eigenmodes(4), (), quality=Band(1.0, 50.0))
    assert abs(spin_growth(poor, radius)) < 0.01 * grown
    assert any("spin" in warning for warning in poor.provenance["warnings"])


def test_a_ring_of_beams_grows_under_spin():
    section = rectangle(0.02, 0.02)
    angle = np.linspace(0, 2 * np.pi, 49)
    corners = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    corners[-1] = corners[0]
    frame = polyline(corners, Member(section, STEEL, (0, 0, 1)))
    body = fp.reduce(
        fp.from_frame(frame, ()),
        fp.Request(name="ring", reference=MeanAxis(), reduction=Union((Eigenmodes(2), InertiaRelief()))),
    )
    assert spin_growth(body, 1.0) == pytest.approx(STEEL.rho / STEEL.E, rel=1e-2)


# ---- resolution -------------------------------------------------------------------------------------------------------


def test_elements_per_wavelength_of_waves():
    """Bending, shear and stretch waves of six elements, given as fields."""
    mesh = box_mesh("hex20", (2.0, 0.1, 0.1), (24, 1, 1))
    model = coupled(mesh, ())
    x, y = mesh.points[:, 0], mesh.points[:, 1] - 0.05
    k = 2 * np.pi / 0.5
    bending = np.stack([-k * y * np.cos(k * x), np.sin(k * x), 0 * x], axis=1)
    shear = np.stack([0 * x, np.sin(k * x), 0 * x], axis=1)
    stretch = np.stack([np.sin(k * x), 0 * x, 0 * x], axis=1)
    waves = np.stack([field.ravel() for field in (bending, shear, stretch)], axis=1)
    np.testing.assert_allclose(elements_per_wavelength(model, waves), 6.0, rtol=0.35)


def test_coarse_meshes_are_named():
    model = coupled(box_mesh("hex20", SIZE, (6, 1, 1)))
    L = functionals(FixedTo("left"), model)
    basis = CraigBampton(UpTo(4000.0)).basis(model, factorised(model), L)
    assert "elements per wavelength, fewer than 6" in basis.warnings[0]
    fine = coupled(box_mesh("hex20", SIZE, (6, 1, 1)))
    assert CraigBampton(UpTo(300.0)).basis(fine, factorised(fine), L).warnings == ()
    assert Union((CraigBampton(UpTo(4000.0)), Guyan())).basis(model, factorised(model), L).warnings == basis.warnings
    assert resolution_warnings(replace(model, edges=None), basis.omega2, basis.Z, 1e6) == ()


def test_beams_know_their_elements():
    model = fp.from_frame(straight(rectangle(0.02, 0.02), 1.0, 12), regions("root", "tip")).coupled
    L = functionals(MeanAxis(), model)
    found = elements_per_wavelength(model, Eigenmodes(5).basis(model, factorised(model), L).Z)
    assert 15 < found[0] < 30
    assert found[4] < found[0]


# ---- in the body and its report ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def judged():
    return reduced(box_mesh("hex20", SIZE, (10, 1, 1)), FixedTo("left"), CraigBampton(4), quality=BAND)


def test_the_quality_is_kept_with_the_body(judged, model, body, tmp_path):
    kept = quality_of(load_body(save_body(judged, tmp_path / "b.ffr")).provenance)
    fresh = assessed(model, body, FixedTo("left"), CraigBampton(4))
    for key in ("mode_frequencies", "frequency_errors", "receptance_errors", "full", "reduced", "displacement_errors"):
        np.testing.assert_allclose(getattr(kept, key), getattr(fresh, key), rtol=1e-4, atol=1e-6)
    assert kept.points == ("left translation", "left rotation", "right translation", "right rotation")
    assert kept.band == (10.0, 1200.0)
    assert len(json.dumps(judged.provenance)) < 60_000
    assert quality_of({}) is None


def test_the_report_tells_the_quality(judged):
    said = "\n".join(body_lines(judged))
    for words in (
        "against the full model, 10 to 1200 Hz",
        "within the band, off by up to",
        "static flexibility",
        "gravity",
    ):
        assert words in said
    assert "{'band'" not in said
    assert list(quality_lines(replace(judged, provenance={}))) == []


def test_missing_frequencies_are_counted():
    body = reduced(box_mesh("hex20", SIZE, (10, 1, 1)), FixedTo("left"), Eigenmodes(2), quality=BAND)
    assert "3 of the full model are missing" in "\n".join(quality_lines(body))


@pytest.mark.parametrize(
    ("reduction", "says"),
    [
        (CraigBampton(UpTo(2000.0)), "vibration up to about 1e+03 Hz, as its modes were chosen"),
        (Rubin(Accuracy(Band(10.0, 800.0), 0.1)), "vibration up to about 800 Hz, as its modes were chosen"),
        (Guyan(), "slow deformation only"),
        (Union((InertiaRelief(), Eigenmodes(2))), "half the frequency of mode 2"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_the_report_tells_what_was_asked_for(reduction, says):
    body = reduced(box_mesh("hex20", SIZE, (10, 1, 1)), FixedTo("left"), reduction)
    assert says in "\n".join(body_lines(body))


def test_many_interfaces_are_not_all_listed(judged):
    many = tuple(replace(judged.interfaces[0], name=f"i{k}") for k in range(30))
    said = list(short_lines(replace(judged, interfaces=many, stiffening=None)))
    assert sum("rigid" in line for line in said) == 24
    assert any("6 more" in line for line in said)


@pytest.mark.slow
def test_pictures(judged, tmp_path):
    paths = quality_pictures(judged, tmp_path / "q")
    assert [path.name for path in paths] == ["receptances.png", "errors.png"]
    assert all(Image.open(path).size[0] > 1000 for path in paths)
    with pytest.raises(InputError, match="was not compared with its full model"):
        quality_pictures(replace(judged, provenance={}), tmp_path)


# ---- command line -----------------------------------------------------------------------------------------------------

REDUCE = ["reduce", *BAR, "--material", "steel", *INTERFACES]


@pytest.mark.slow
def test_the_command_line_joins_reductions_and_reports(tmp_path, capsys):
    methods = ["--method", "craig-bampton", "--method", "inertia-relief", "--modes", 4]
    run(*REDUCE, *methods, "--quality", tmp_path / "q", "--band", "10,500", "-o", tmp_path / "b.ffr")
    said = capsys.readouterr().out
    assert "quality     against the full model, 10 to 500 Hz" in said
    assert "receptances.png" in said
    body = load_body(tmp_path / "b.ffr")
    assert body.provenance["reduction"]["parts"] == [{"type": "CraigBampton", "modes": 4}, {"type": "InertiaRelief"}]


@pytest.mark.parametrize(
    ("options", "reduction"),
    [
        (["--method", "rubin", "--frequency", 900], {"type": "Rubin", "modes": {"type": "UpTo", "frequency": 900.0}}),
        (["--method", "guyan"], {"type": "Guyan"}),
        (
            ["--method", "krylov", "--moments", 1, "--match", "0,300"],
            {"type": "Krylov", "moments": 1, "frequencies": [0.0, 300.0]},
        ),
        (
            ["--method", "characteristic", "--modes", 3, "--interface-modes", 2],
            {"type": "CharacteristicModes", "modes": 3, "interface_modes": 2},
        ),
        (["--method", "attachment"], {"type": "AttachmentModes"}),
    ],
    ids=lambda value: value.get("type") if isinstance(value, dict) else None,
)  # fmt: skip
def test_methods_on_the_command_line(options, reduction, tmp_path):
    run(*REDUCE, *options, "-o", tmp_path / "b.ffr")
    assert load_body(tmp_path / "b.ffr").provenance["reduction"] == reduction


@pytest.mark.slow
def test_accuracy_on_the_command_line(tmp_path):
    run(*REDUCE, "--method", "rubin", "--accuracy", "10,600,0.1", "--quality", tmp_path / "q", "-o", tmp_path / "b.ffr")
    assert quality_of(load_body(tmp_path / "b.ffr").provenance).receptance_errors.max() <= 0.1


def test_fields_of_ones_own(tmp_path, capsys):
    np.save(tmp_path / "wrong.npy", np.zeros((2, 3, 1)))
    assert_fails(capsys, "user vectors have shape", *REDUCE, "--method", tmp_path / "wrong.npy", "-o", tmp_path / "b")
    (tmp_path / "text.npy").write_text("no array")
    assert_fails(capsys, "is not an array", *REDUCE, "--method", tmp_path / "text.npy", "-o", tmp_path / "b")
    assert_fails(capsys, "does not exist", *REDUCE, "--method", tmp_path / "none.npy", "-o", tmp_path / "b")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--method", "guess"], "is not known: write one of craig-bampton"),
        (["--modes", 3, "--frequency", 100], "both say how many modes"),
        (["--frequency", 100, "--accuracy", "1,2,3"], "both say how many modes"),
        (["--method", "inertia-relief", "--accuracy", "1,2,3"], "accuracy says which normal modes to keep"),
        (["--method", "inertia-relief", "--modes", 3], "leave it out, or add the method craig-bampton"),
        (["--moments", 3], "moments is a setting of krylov, and not of craig-bampton: leave it out"),
        (
            ["--method", "guyan", "--method", "rubin", "--match", "5"],
            "match is a setting of krylov, and not of guyan and",
        ),
        (["--interface-modes", 3], "leave it out, or take the method characteristic"),
        (["--linear", "--drawn-modes", 3], "drawn_modes says which modes foreshorten what is drawn, and linear"),
        (["--accuracy", "1,2"], "3 numbers with commas"),
        (["--accuracy", "a,b,c"], "write numbers with commas"),
        (["--frequency", -1], "must be positive"),
        (["--band", "1,2"], "add --quality FOLDER"),
        (["--quality", "q"], "--quality needs the frequencies"),
        (["--quality", "q", "--band", "5,1"], "must be 0 < low < high"),
        (["--method", "krylov", "--match", "-1"], "none negative"),
    ],
)
def test_options_that_do_not_fit(options, message, tmp_path, capsys):
    assert_fails(capsys, message, *REDUCE, *options, "-o", tmp_path / "b")


# ---- own matrices -----------------------------------------------------------------------------------------------------


def test_matrices_from_outside_are_assessed_like_the_model_they_come_from():
    frame = of_frame(matrix_frame())
    settings = {"name": "b", "reference": FixedTo("a"), "quality": Band(5.0, 100.0)}
    body = fp.reduce(
        fp.from_matrices(frame, regions("a", "b")),
        fp.Request(**settings, reduction=Union((CraigBampton(2), InertiaRelief()))),
    )
    quality = quality_of(body.provenance)
    assert np.nanmax(quality.displacement_errors) < 1e-6
    assert quality.flexibility_error < 1e-8
    with pytest.raises(InputError, match="needs a mass for every coordinate"):
        fp.reduce(
            fp.from_matrices(replace(frame, M=lumped(frame)), regions("a", "b")),
            fp.Request(**settings, reduction=Eigenmodes(2)),
        )
