"""The damping matrix of a body: what it is made of, where it goes, and what it does to the motion."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from boxes import STEEL, box_mesh
from synthetic import cloud

import ffr_dyn as fd
import ffr_prep as fp
from ffr_prep.body import FlexibleBody, load_body, save_body, truncated
from ffr_prep.common.errors import InputError
from ffr_prep.interchange.mbdyn import read_fem, write_fem
from ffr_prep.interchange.sid import read_sid, write_sid


def coupled(body: FlexibleBody, size: float = 3.0, seed: int = 0) -> FlexibleBody:
    half = np.random.default_rng(seed).normal(size=(body.n, body.n))
    return replace(body, damping=size * half @ half.T)


@pytest.fixture(scope="module")
def bar() -> FlexibleBody:
    """A box, held at one end in its frame, of second order."""
    mesh = box_mesh("hex8", (0.5, 0.03, 0.02), (6, 1, 1))
    mesh = replace(mesh, points=mesh.points - [0.0, 0.015, 0.01])
    model = fp.from_mesh(mesh, STEEL, [fp.InterfaceRegion("left"), fp.InterfaceRegion("right")])
    return fp.reduce(model, fp.Request(name="bar", reference=fp.FixedTo("left"), reduction=fp.CraigBampton(4)))


def held(body: FlexibleBody, **more) -> fd.Scene:
    at = body.interfaces[0]
    weld = fd.Joint("weld", "fixed", "ground.O", f"arm.{at.name}")
    return fd.Scene((fd.Body("arm", body, **more),), (weld,), ground={"O": at.position}, plane="none")


# ---- what it is ---------------------------------------------------------------------------------------------------


def test_rayleigh_loss_factor_and_bands_are_those_of_the_modes():
    body = cloud(3)
    omega = np.sqrt(body.omega2)
    f = body.frequencies
    cases = [
        ({"alpha": 2.0, "beta": 1e-3}, 2.0 + 1e-3 * omega**2),
        ({"loss_factor": 0.01}, 0.01 * omega),
        ({"bands": [(f[0] + 1e-9, 0.01), (f[1] + 1e-9, 0.02)]}, 2 * np.array([0.01, 0.02, 0.02]) * omega),
    ]
    for given, rates in cases:
        np.testing.assert_allclose(fp.damped(body, **given).damping, np.diag(rates), rtol=1e-12)
    twice = fp.damped(fp.damped(body, alpha=1.0), alpha=1.0)
    np.testing.assert_allclose(twice.damping, fp.damped(body, alpha=2.0).damping)
    assert fp.damped(body).damping is None


@pytest.mark.parametrize(
    "given",
    [
        {"alpha": -1.0},
        {"beta": np.nan},
        {"bands": [(2.0, 0.1), (1.0, 0.1)]},
        {"bands": [(1.0, -0.1)]},
        {"bands": ["a"]},
    ],
)
def test_damping_that_is_none_is_refused(given):
    with pytest.raises(InputError, match="body 'cloud'"):
        fp.damped(cloud(2), **given)
    for matrix, said in (([[1.0, 0.5], [0.0, 1.0]], "not symmetric"), ([[1.0, 2.0], [2.0, 1.0]], "feed vibration")):
        with pytest.raises(InputError, match=said):
            replace(cloud(2), damping=matrix)


def test_files_keep_it(tmp_path):
    body = coupled(cloud(3))
    D = body.damping
    np.testing.assert_array_equal(load_body(save_body(body, tmp_path / "b.ffr")).damping, D)
    for back in (read_sid(write_sid(body, tmp_path / "b.SID_FEM")), read_fem(write_fem(body, tmp_path / "b.fem"))):
        np.testing.assert_allclose(back.damping, D, rtol=1e-13)
        assert not [w for w in back.provenance["warnings"] if "damping" in w]
    assert load_body(save_body(cloud(1), tmp_path / "c.ffr")).damping is None
    np.testing.assert_array_equal(truncated(body, [0, 2]).damping, D[np.ix_([0, 2], [0, 2])])


def test_the_power_that_is_lost_is_the_same_in_any_frame(bar):
    """q_user = C q: the same deformation rates lose the same power."""
    body = coupled(bar)
    form = fp.mean_axis_form(body)
    rates = np.random.default_rng(1).normal(size=(body.n, 5))
    lost = np.einsum("it,ij,jt->t", form.C @ rates, body.damping, form.C @ rates)
    np.testing.assert_allclose(np.einsum("it,ij,jt->t", rates, form.body.damping, rates), lost, rtol=1e-10)


# ---- what it does -------------------------------------------------------------------------------------------------


def test_eigenvalues_are_those_of_the_damped_body(bar):
    """Held where its frame is, the body has the eigenvalues of its own modes and its damping matrix."""
    body = coupled(bar, 30.0)
    n = body.n
    found = fd.linearise(held(body)).eigenvalues
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(body.omega2), -body.damping]])
    expected = scipy.linalg.eigvals(A)
    for value in expected:
        assert np.abs(found - value).min() < 1e-7 * abs(value)


@pytest.mark.parametrize(
    ("method", "within"),
    [(fd.RK4(2e-5), 1e-6), (fd.ROS2(1e-5), 2e-4), (fd.ROS3(2e-5), 1e-4), (fd.GeneralisedAlpha(2e-5), 1e-3)],
)
def test_the_decay_is_that_of_the_matrix(method, within):
    body = coupled(cloud(3, stiffness=400.0), 3.0)
    q = np.array([1e-3, -2e-3, 1e-3])
    scene = held(replace(body, interfaces=(fixed_point(body),)), q=q)
    run = fd.forward(scene, end=0.05, output_step=0.005, method=method, outputs=("*.q",))
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.diag(body.omega2), -body.damping]])
    expected = np.array([scipy.linalg.expm(t * A) @ np.r_[q, 0, 0, 0] for t in run.time])[:, :3]
    np.testing.assert_allclose(run["arm.q"], expected, atol=within * np.abs(q).max())


def fixed_point(body: FlexibleBody) -> fp.Interface:
    """A point of the frame that no mode moves."""
    return fp.Interface("frame", np.zeros(3), np.zeros((3, body.n)), np.zeros((3, body.n)))


@pytest.mark.parametrize(
    "method",
    [
        fd.ROS2(1e-3),
        fd.ROS3(1e-3),
        fd.HHT(1e-3),
        fd.GeneralisedAlpha(1e-3),
        fd.GeneralisedAlpha(1e-3, form="stabilised"),
    ],
)
def test_heavy_damping_is_implicit(method):
    """Coordinates that creep, at steps of twenty of their time constants."""
    body = coupled(cloud(3, stiffness=100.0), 2e4)
    scene = held(replace(body, interfaces=(fixed_point(body),)), q=np.array([1e-3, 0.0, 0.0]))
    run = fd.forward(scene, end=0.2, output_step=0.05, method=method, outputs=("*.q",))
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-np.diag(body.omega2), -body.damping]])
    expected = np.array([scipy.linalg.expm(t * A) @ np.r_[1e-3, np.zeros(5)] for t in run.time])[:, :3]
    np.testing.assert_allclose(run["arm.q"], expected, atol=1e-6)


def test_the_energy_balance_is_whole(bar):
    body = coupled(bar, 20.0)
    scene = replace(held(body), gravity=(0.0, 0.0, -9.81))
    run = fd.forward(scene, end=0.05, output_step=5e-5, method=fd.ROS2(5e-6), outputs=("energy.*", "arm.damping.power"))
    total = run["energy.kinetic"] + run["energy.strain"] + run["energy.gravity"]
    power = run["arm.damping.power"]
    lost = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(run.time) * (power[1:] + power[:-1]))])
    assert lost[-1] < 0
    np.testing.assert_allclose(total - total[0], lost, atol=2e-3 * np.abs(lost).max())


def test_coordinates_of_the_plane_that_damping_couples_with_others_stay_in_space(bar):
    diagonal = replace(bar, damping=np.diag(np.linspace(1.0, 2.0, bar.n)))
    assert fd.assemble(replace(held(diagonal), plane="auto")).system.scene.plane != "none"
    assert fd.assemble(replace(held(coupled(bar)), plane="auto")).system.scene.plane == "none"


@pytest.mark.parametrize(("hold", "told"), [("fixed", True), ("none", False)])
def test_a_run_tells_the_ratio_that_comes_of_one_of_the_free_body(bar, hold, told):
    """Clamped it is that of the eigenvalues of the scene, which `linearise` finds; free it is the one that is given."""
    scene = held(bar, damping=0.01) if hold == "fixed" else fd.Scene((fd.Body("arm", bar, damping=0.01),))
    run = fd.forward(scene, end=0.004, output_step=0.002)
    notes = [note for note in run.attributes["notes"] if "belongs to the modes of the free body" in note]
    assert len(notes) == told
    found = fd.linearise(scene)
    ratio = found.damping_ratios[found.frequencies > 1.0].min()
    assert ratio == pytest.approx(0.01, rel=1e-3) if not told else 0.0 < ratio < 0.002
    assert all(f"{found.frequencies[0]:.4g} Hz, has {ratio:.2g}. For 0.01" in note for note in notes)


def test_a_ratio_of_the_body_as_it_is_held_is_not_told(bar):
    scene = held(fp.damped(bar, ratios=[0.01]))
    run = fd.forward(scene, end=0.004, output_step=0.002)
    assert not [note for note in run.attributes["notes"] if "damping ratio" in note]
    assert fd.linearise(scene).damping_ratios[0] == pytest.approx(0.01, rel=1e-3)


# ---- against the full finite-element model ------------------------------------------------------------------------


def grounded(body: FlexibleBody) -> fd.Scene:
    at = body.interface("left")
    weld = fd.Joint("weld", "fixed", "ground.O", "arm.left")
    return fd.Scene((fd.Body("arm", body),), (weld,), ground={"O": at.position}, plane="none")


@pytest.fixture(scope="module")
def full():
    """K, M of a box held at one end, as matrices, with the rows that are free when it is held."""
    mesh = box_mesh("hex8", (0.5, 0.03, 0.02), (6, 1, 1))
    basis, K, M = assembled(mesh)
    model = fp.from_skfem(basis, K, M)
    left = np.flatnonzero(np.isclose(model.points[:, 0], 0.0))
    model = replace(model, groups={**model.groups, "left": left})
    return model, np.flatnonzero(~np.isin(model.nodes, left))


def assembled(mesh):
    import skfem
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    grid = skfem.MeshHex(mesh.points.T, mesh.blocks[0].nodes[:, [0, 1, 3, 4, 2, 5, 7, 6]].T)
    basis = skfem.Basis(grid, skfem.ElementVector(skfem.ElementHex1()))
    K = linear_elasticity(*lame_parameters(STEEL.E, STEEL.nu)).assemble(basis)
    M = skfem.BilinearForm(lambda u, v, w: STEEL.rho * sum(u[k] * v[k] for k in range(3))).assemble(basis)
    return basis, K, M


@pytest.mark.parametrize("kind", ["rayleigh", "dashpots"])
def test_decay_rates_are_those_of_the_full_model(full, kind, tmp_path):
    """Of the first six modes, to 1e-4 of themselves: Rayleigh's damping, and dashpots between nodes."""
    model, free = full
    if kind == "rayleigh":
        C = 3.0 * model.M + 2e-6 * model.K
    else:  # along x and y, from the end to the middle
        far = np.flatnonzero(np.isclose(model.points[:, 0], 0.5))[0]
        middle = np.flatnonzero(np.isclose(model.points[:, 0], 0.25))[0]
        C = np.zeros(model.K.shape)
        for component, d in ((0, 200.0), (1, 40.0), (2, 25.0)):
            rows = [np.flatnonzero((model.nodes == n) & (model.components == component))[0] for n in (far, middle)]
            C[np.ix_(rows, rows)] += d * np.array([[1.0, -1.0], [-1.0, 1.0]])
    given = replace(model, C=C)
    K, M, C = (A[free][:, free].toarray() for A in (given.K, given.M, given.C))
    invM = np.linalg.inv(M)
    expected = np.linalg.eigvals(np.block([[np.zeros_like(K), np.eye(len(K))], [-invM @ K, -invM @ C]]))
    expected = expected[expected.imag > 0]
    expected = expected[np.argsort(np.abs(expected))][:6]
    read = fp.read_matrices([fp.save_matrices(given, tmp_path / "m.npz")])
    region = [fp.InterfaceRegion("left")]
    body = fp.reduce(
        fp.from_matrices(read, region),
        fp.Request(name="arm", reference=fp.FixedTo("left"), reduction=fp.Eigenmodes(30)),
    )
    found = fd.linearise(grounded(body)).eigenvalues
    for value in expected:
        nearest = found[np.argmin(np.abs(found - value))]
        assert abs(nearest.real - value.real) < 1e-4 * abs(value.real)
        assert abs(nearest.imag - value.imag) < 1e-4 * abs(value.imag)


def test_scene_files_add_damping(tmp_path):
    body = cloud(3)
    save_body(body, tmp_path / "b.ffr")
    text = '[analysis]\nend = 0.1\noutput_step = 0.1\n[bodies.arm]\nfile = "b.ffr"\n'
    cases = [
        ("rayleigh = [2.0, 1e-3]", {"alpha": 2.0, "beta": 1e-3}),
        ("loss_factor = 0.01", {"loss_factor": 0.01}),
        ("damping_bands = [[1.0, 0.01], [100.0, 0.02]]", {"bands": [(1.0, 0.01), (100.0, 0.02)]}),
    ]
    for line, given in cases:
        (tmp_path / "s.toml").write_text(text + line + "\n")
        scene, _ = fd.load_scene(tmp_path / "s.toml")
        np.testing.assert_allclose(scene.bodies[0].model.damping, fp.damped(body, **given).damping)
    (tmp_path / "s.toml").write_text(text + "rayleigh = [-1, 0]\n")
    with pytest.raises(InputError, match=r"alpha is -1\.0; damping is a number from zero"):
        fd.load_scene(tmp_path / "s.toml")


@pytest.mark.parametrize("to", ["arm.left", "ground.O"])
def test_dashpots_at_interfaces_are_rows_of_the_damping_matrix(bar, to):
    """Along x between two interfaces of the body, or from one to the ground: c phi phi^T of the body held at the left."""
    body = replace(bar, stiffening=None)
    ends = [i.position for i in body.interfaces]
    dashpot = fd.SpringDamper("dashpot", to, "arm.right", stiffness=0.0, damping=300.0, free_length=0.0)
    scene = replace(held(body), springs=(dashpot,))
    line = ends[1] - ends[0]
    along = line / np.linalg.norm(line) @ (body.interfaces[1].phi_t - body.interfaces[0].phi_t)
    wanted = fd.linearise(held(replace(body, damping=300.0 * np.outer(along, along)))).eigenvalues
    found = fd.linearise(scene).eigenvalues
    for value in wanted:
        assert np.abs(found - value).min() < 1e-7 * abs(value)
    assert (found.real < -1).any()


def test_parts_that_are_tied_keep_their_damping(full):
    """A body of one part, tied to a bar of no damping: the damping of the part, in the shapes of the whole."""
    model, _ = full
    far = np.flatnonzero(np.isclose(model.points[:, 0], 0.5))
    damped = replace(model, C=2e-6 * model.K, groups={**model.groups, "far": far})
    region = [fp.InterfaceRegion("left"), fp.InterfaceRegion("far")]
    mesh = box_mesh("hex8", (0.2, 0.03, 0.02), (2, 1, 1))
    other = fp.from_mesh(
        replace(mesh, points=mesh.points + np.array([0.5, 0.0, 0.0])), STEEL, [fp.InterfaceRegion("left")]
    )
    whole = fp.tied({"a": fp.from_matrices(damped, region), "b": other}, [("a.far", "b.left")])
    body = fp.reduce(whole, fp.Request(name="arm", reference=fp.FixedTo("left"), reduction=fp.Eigenmodes(4)))
    assert np.linalg.eigvalsh(2e-6 * np.diag(body.omega2) - body.damping).min() > 0  # the other part loses nothing
    assert (np.diag(body.damping) > 0).all()


def test_a_body_with_damping_is_held_against_its_joints(bar):
    """The body that the check of reference conditions makes has other coordinates."""
    ends = [fd.Joint(name, "revolute", f"ground.{name}", f"arm.{name}") for name in ("left", "right")]
    ground = {i.name: i.position for i in bar.interfaces}
    few = fp.reduce(
        fp.from_mesh(box_mesh("hex8", (0.5, 0.03, 0.02), (6, 1, 1)), STEEL, [fp.InterfaceRegion(n) for n in ground]),
        fp.Request(name="arm", reference=fp.FixedTo("left"), reduction=fp.Eigenmodes(2)),
    )
    ground = {i.name: i.position for i in few.interfaces}
    scene = fd.Scene((fd.Body("arm", fp.damped(few, alpha=1.0)),), tuple(ends), ground=ground)
    plain = fd.Scene((fd.Body("arm", few),), tuple(ends), ground=ground)
    assert fd.assemble(scene).notes == fd.assemble(plain).notes
