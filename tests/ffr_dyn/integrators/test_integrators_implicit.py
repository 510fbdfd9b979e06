"""Generalised-alpha, HHT, half-explicit Runge-Kutta, the variational integrator: orders, laws, constraints, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import cloud
from test_analyses_references import END, andrews
from test_beam_stiffening import rod
from test_chart_orders import double_pendulum, slider_crank, top
from test_chart_orders import pendulum as pendulum_a01
from test_dyn_laws import momenta, pendulum, spinning
from test_dyn_references import GRAVITY, mass_point
from test_dyn_singular import bricard, n_four_bar
from test_resume import SCENE, StoppedError, assert_same_bits, stop_after

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.equations.inertia import mass_matrix
from ffr_dyn.functions.time_functions import polynomial, user
from ffr_dyn.integrators import HHT, METHODS, RK4, ROS2, GeneralisedAlpha, HalfExplicit, Variational
from ffr_dyn.integrators.stabilisation import Baumgarte, Drifting, Projection
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.scene_file.write import save_scene
from ffr_prep.body import rigid_body
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.model.material import Material
from ffr_prep.model.reference import SimplySupported
from ffr_prep.structures.sections import rectangle

KINDS = {
    "generalised-alpha": GeneralisedAlpha,
    "stabilised": lambda h: GeneralisedAlpha(h, form="stabilised"),
    "damped": lambda h: GeneralisedAlpha(h, spectral_radius=0.0),
    "hht": HHT,
    "stabilised hht": lambda h: HHT(h, form="stabilised"),
    "half-explicit": HalfExplicit,
    "variational": Variational,
}
EXACT_RATES = ("stabilised", "stabilised hht", "half-explicit", "variational")
FINE = Projection(1e-13)


@pytest.fixture(params=KINDS)
def kind(request):
    return request.param


def run(scene: Scene, method, end: float, **settings):
    return integrate(scene, end=end, output_step=end, method=method, **settings)


def errors(scene: Scene, kind: str, end: float, steps, names, stabilisation=FINE) -> np.ndarray:
    """(steps, names) largest errors at ten moments, from RK4 at a quarter of the finest step."""
    truth = integrate(scene, end=end, output_step=end / 10, method=RK4(steps[-1] / 4), stabilisation=FINE)
    runs = [
        integrate(scene, end=end, output_step=end / 10, method=KINDS[kind](h), stabilisation=stabilisation)
        for h in steps
    ]
    return np.array([[np.abs(r[name] - truth[name])[1:].max() for name in names] for r in runs])


def order(kind: str) -> int:
    return KINDS[kind](1.0).order


# ---- order ----------------------------------------------------------------------------------------------------------


def test_motion_rates_and_reactions_converge_at_the_order(kind):
    found = errors(pendulum(), kind, 0.4, (2e-3, 1e-3), ("two.a.position", "two.omega_bar", "two.q", "B.force"))
    assert (found[1] < found[0] / 2 ** (order(kind) - 0.4)).all()
    assert (found[1] < (1e-4, 1e-3, 1e-3, 0.2)).all()


def stiffened_pendulum() -> Scene:
    body = rod(rectangle(0.02, 0.009), 1.2, 12, 0, SimplySupported("root", "tip"), Material("metal", 7e9, 0.3, 5540.0))
    links = (Body("one", body, omega_bar=(0, 0, 3.0)), Body("two", body, position=(1.2, 0, 0), omega_bar=(0, 0, 3.0)))
    joints = (
        Joint("hinge", "revolute", "ground.O", "one.root"),
        Joint("elbow", "spherical", "one.tip", "two.root"),
    )
    return Scene(links, joints, ground={"O": (0, 0, 0)}, gravity=GRAVITY)


@pytest.mark.parametrize("plane", ["auto", "none"])
@pytest.mark.parametrize("kind", ["generalised-alpha", "stabilised", "half-explicit", "variational"])
def test_geometric_stiffening_keeps_the_order(kind, plane):
    """It is solved for together with the accelerations, and must not be counted twice where equations are solved again."""
    scene = replace(stiffened_pendulum(), plane=plane)
    steps = (2e-4, 1e-4) if order(kind) == 4 else (1e-4, 5e-5)  # finer ones are at the rounding of the positions
    found = errors(scene, kind, 0.05, steps, ("two.tip.position", "hinge.force"))
    assert (found[1] < found[0] / 2 ** (order(kind) - 0.5)).all()
    assert found[1, 0] < 1e-6


def test_a_driven_slider_crank(kind):
    found = errors(slider_crank(), kind, 0.01, (5e-6, 2.5e-6), ("rod.q", "wrist.force"))
    assert (found[1] < found[0] / 2 ** (order(kind) - 0.5)).all()
    assert found[1, 0] < 4e-7


def test_a_driver_and_a_force_in_python(kind):
    """A rheonomic constraint and a force that follows the velocity."""
    body = cloud(3, stiffness=20.0)
    scene = Scene(
        (Body("bar", body),),
        (Joint("hinge", "revolute", "ground.O", "bar.a", axis=(0, 0, 1)),),
        (Driver("motor", "hinge", user(lambda t: (np.sin(t), np.cos(t), -np.sin(t)))),),
        loads=(Load("drag", "bar.c", function=lambda t, state: -2.0 * state.velocity("bar.c")),),
        ground={"O": (0, 0, 0)},
        gravity=GRAVITY,
    )
    found = errors(scene, kind, 0.08, (2e-3, 1e-3), ("bar.c.position", "bar.q"))
    assert (found[1] < found[0] / 2 ** (order(kind) - 0.6)).all()


def test_published_cases(kind):
    """Dzhanibekov's top, the double pendulum and Andrews' squeezer, near what others computed."""
    method = KINDS[kind]
    spun = run(top(), method(0.01), 10.0)["top.omega_bar"][-1]
    bound = {2: 3e-3, 4: 1e-7}[order(kind)]
    np.testing.assert_allclose(spun, (-0.117326383719773, 0.993093912821562, 0.0677433399352767), atol=bound)
    fallen = run(double_pendulum(), method(1e-3), 1.0)
    one, two = fallen["first.c.position"][-1], fallen["second.c.position"][-1]
    angles = np.arctan2([one[0], two[0] - one[0]], [-one[1], one[1] - two[1]])
    np.testing.assert_allclose(angles, (-0.62508769980639, -1.03458508568), atol={2: 2e-4, 4: 1e-7}[order(kind)])
    squeezed = run(andrews(), method(1e-5), 0.03)
    x, y = squeezed["k1.b.position"][-1, :2]
    assert abs(np.arctan2(y, x) - np.angle(np.exp(1j * END["beta"]))) < {2: 4e-2, 4: 2e-6}[order(kind)]


# ---- laws and constraints -------------------------------------------------------------------------------------------


def test_energy_and_momenta_of_a_free_body_are_conserved_at_the_order(kind):
    scene = spinning()

    def drift(h: float) -> np.ndarray:
        result = integrate(scene, end=0.4, output_step=0.04, method=KINDS[kind](h))
        return np.array([np.ptp(result["energy.total"]), *np.ptp(momenta(scene, result), axis=0)])

    coarse, fine = drift(4e-3), drift(2e-3)
    assert (fine < np.maximum(coarse / 2 ** (order(kind) - 0.3), 1e-9)).all()


def test_constraints_hold(kind):
    result = integrate(pendulum(), end=0.4, output_step=0.04, method=KINDS[kind](2e-3), stabilisation=Drifting())
    position, velocity = result["constraint.position"].max(), result["constraint.velocity"].max()
    if kind == "half-explicit":
        assert 1e-13 < position < 1e-9  # the drift of its order, which projection takes away
        projected = run(pendulum(), HalfExplicit(4e-4), 0.4, stabilisation=Projection(1e-13))
        assert projected["constraint.position"].max() < 0.01 * position
    else:
        assert position < 1e-10
    assert (velocity < 1e-6) == (kind in EXACT_RATES)
    if kind in ("half-explicit", "variational"):
        assert velocity < 1e-13


def test_the_variational_method_conserves_momenta_to_rounding():
    scene = spinning()
    result = integrate(scene, end=2.0, output_step=0.1, method=Variational(0.01, tolerance=1e-15))
    assert np.abs(np.ptp(momenta(scene, result), axis=0)).max() < 2e-9
    other = integrate(scene, end=2.0, output_step=0.1, method=ROS2(0.01))
    assert np.abs(np.ptp(momenta(scene, other), axis=0)).max() > 1e-3


def rotor() -> Scene:
    """A free flexible body that turns 0.48 times a second about its centre of mass; h Omega is 0.5 and 1 at h = 0.05 s."""
    model = replace(
        cloud(2, stiffness=0.25), interfaces=()
    )  # whose ends turn by more than half a turn: no motion to a run
    q, omega = np.array([0.01, 0.02]), np.array([0.3, 0.2, 3.0])
    momentum = mass_matrix(model, q)[:3, 3:6] @ omega
    return Scene((Body("b", model, velocity=-momentum / model.mass, omega_bar=omega, q=q),))


def energies(method, revolutions: float) -> np.ndarray:
    """Relative error of the energy at a hundred moments of a run."""
    row = round(revolutions * 2 * np.pi / 3.0 / 0.05 / 100) * 0.05
    total = integrate(rotor(), end=100 * row, output_step=row, method=method)["energy.total"]
    return total / total[0] - 1.0


def test_the_energy_of_the_variational_method_does_not_drift():
    # At h Omega = 1 the motion is chaotic, and which single moments stand out (up to three times) hangs on rounding.
    found = energies(Variational(0.05), 1000)
    most = [np.quantile(np.abs(half), 0.9) for half in (found[:50], found[50:])]
    assert most[1] < 1.2 * most[0]
    assert np.abs(found).max() < 5 * most[0]
    assert abs(found[50:].mean() - found[:50].mean()) < 0.3 * found.std() + 1e-4
    assert np.abs(energies(ROS2(0.05), 1000)).max() > 10 * np.abs(found).max()


@pytest.mark.slow
def test_the_energy_of_the_variational_method_does_not_drift_in_a_hundred_thousand_revolutions():
    found = energies(Variational(0.05), 100_000)
    print("largest relative error", np.abs(found).max(), "means of the halves", found[:50].mean(), found[50:].mean())
    assert np.abs(found[50:]).max() < 1.5 * np.abs(found[:50]).max()
    assert abs(found[50:].mean() - found[:50].mean()) < 0.3 * found.std() + 1e-4


@pytest.mark.parametrize("kind", ["generalised-alpha", "hht", "variational"])
def test_no_elastic_frequency_destabilises_the_implicit_methods(kind):
    """h Omega_max = 1e4 and more; the stiff bodies move as rigid ones."""
    scene = pendulum()
    stiff = tuple(replace(b, model=replace(b.model, omega2=b.model.omega2 * 1e10)) for b in scene.bodies)
    rigid = tuple(replace(b, model=as_rigid(b.model), q=None, q_dot=None, damping=0.0) for b in scene.bodies)
    moved, other = (run(replace(scene, bodies=bodies), KINDS[kind](5e-3), 0.5) for bodies in (stiff, rigid))
    np.testing.assert_allclose(moved["two.a.position"], other["two.a.position"], atol=2e-3)


def as_rigid(body):
    points = {i.name: i.position for i in body.interfaces}
    return rigid_body(
        body.name, mass=body.mass, inertia=body.central_inertia, centre_of_mass=body.centre_of_mass, points=points
    )


# ---- redundant and singular -----------------------------------------------------------------------------------------


def test_redundant_constraints(kind):
    """Bricard's mechanism has one row too many; its motion and its reactions are those of RK4."""
    found = errors(bricard(), kind, 0.5, (2e-3, 1e-3), ("r2.b.position",), Projection(1e-9))
    assert found[1, 0] < {2: 2e-6, 4: 1e-9}[order(kind)]
    assert found[1, 0] < found[0, 0] / 3 or found[1, 0] < 1e-11


@pytest.mark.parametrize("kind", ["generalised-alpha", "stabilised", "hht"])
def test_a_singular_position_is_passed(kind):
    """All links of a parallelogram align at 0.71 s."""
    found = errors(n_four_bar(1), kind, 1.0, (2e-3, 1e-3), ("s0.b.position",), Projection(1e-9))
    assert found[1, 0] < 3e-5


# ---- going on, refusing ---------------------------------------------------------------------------------------------


def test_a_stopped_run_goes_on_to_the_same_bits(tmp_path, kind):
    settings = {"end": 0.2, "output_step": 0.01, "method": KINDS[kind](1e-3)}
    whole = integrate(SCENE, **settings)
    path = tmp_path / "run.nc"
    with pytest.raises(StoppedError):
        integrate(SCENE, **settings, path=path, progress=stop_after(0.05))
    assert_same_bits(whole, integrate(SCENE, **settings, resume=path))


def stiff_ball(told: bool) -> Scene:
    """A ball on a spring, or on a Python function that says the same without its slopes."""

    def pull(t, state):
        place = state.x[:3]
        return -1e6 * (1.0 - 1.0 / np.linalg.norm(place)) * place

    return Scene(
        (Body("ball", mass_point("ball", c=(0, 0, 0)), position=(1, 0, 0)),),
        springs=(SpringDamper("spring", "ground.O", "ball.c", 1e6, free_length=1.0),) if told else (),
        loads=() if told else (Load("pull", "ball.c", function=pull),),
        ground={"O": (0, 0, 0)},
        gravity=GRAVITY,
    )


LONGEST = {
    "generalised-alpha": (False, 2e-3),
    "stabilised": (False, 2e-3),
    "hht": (False, 2e-3),
    "variational": (True, 1 / 504),  # at 2e-3 it tells the spring's own limit
}


@pytest.mark.parametrize("kind", LONGEST)
def test_a_step_that_does_not_converge_says_so(kind):
    """A force stiffer than the step allows (h^2 k/m = 4): not a wrong result, and with a smaller step a right one."""
    told, step = LONGEST[kind]
    with pytest.raises(ComputationError, match=r"at t = 0 s the iterations .*'ball'.*spring.*smaller step"):
        run(stiff_ball(told), KINDS[kind](step), 1.0)
    right = run(stiff_ball(told), KINDS[kind](2e-4), 1.0)["ball.c.position"][-1, :2]
    np.testing.assert_allclose(right, (-0.98629074, -0.16504631), atol=5e-7)


@pytest.mark.parametrize("kind", ["generalised-alpha", "stabilised", "hht"])
def test_a_spring_that_tells_its_slopes_converges_at_any_step(kind):
    """The same, with steps up to h^2 k/m = 1600: right by the error of a pendulum's motion."""
    for step in (2e-3, 1e-2, 4e-2):
        place = run(stiff_ball(True), KINDS[kind](step), 1.0)["ball.c.position"][-1, :2]
        np.testing.assert_allclose(place, (-0.98629074, -0.16504631), atol=10 * step**2)


def locking() -> Scene:
    """A crank of 1 m, driven at 1 rad/s, and a rod of 0.5 m to a slider: the rod is too short beyond 30 degrees."""
    crank = rigid_body("crank", mass=1.0, inertia=(1, 1, 1), points={"hub": np.zeros(3), "pin": np.array([1.0, 0, 0])})
    link = rigid_body("link", mass=1.0, inertia=(1, 1, 1), points={"a": np.zeros(3), "b": np.array([0.5, 0, 0])})
    slider = rigid_body("slider", mass=1.0, inertia=(1, 1, 1), points={"pin": np.zeros(3)})
    return Scene(
        (Body("crank", crank), Body("link", link, position=(1, 0, 0)), Body("slider", slider, position=(1.5, 0, 0))),
        (
            Joint("bearing", "revolute", "ground.O", "crank.hub"),
            Joint("crankpin", "revolute", "crank.pin", "link.a"),
            Joint("wrist", "revolute", "link.b", "slider.pin"),
            Joint("guide", "translational", "ground.O", "slider.pin", axis=(1, 0, 0)),
        ),
        (Driver("motor", "bearing", polynomial(0.0, 1.0)),),
        ground={"O": (0, 0, 0)},
    )


def test_a_mechanism_that_locks_is_no_result(kind):
    with pytest.raises(
        ComputationError, match=r"at t = 0\.5\d* s .*'(motor|bearing|crankpin|wrist|guide|crank|link|slider)'"
    ):
        run(locking(), KINDS[kind](1e-3), 1.0)


@pytest.mark.parametrize("form", ["index 3", "stabilised"])
def test_with_its_usual_damping_a_point_mass_on_a_link_is_not_lost(form):
    """IFToMM A01 at ten steps per swing; with little damping index 3 is weakly unstable, and says so before it is wrong."""
    swing = run(pendulum_a01(), GeneralisedAlpha(0.04, form=form), 20.0)
    assert abs(swing["bob.c.position"][-1, :2] @ swing["bob.c.position"][-1, :2] - 1.0) < 1e-8
    with pytest.raises(ComputationError, match="do not converge"):
        run(pendulum_a01(), GeneralisedAlpha(0.04, spectral_radius=0.95), 20.0)


def test_without_scaling_index_3_is_lost_at_small_steps():
    """Rounding errors of accelerations and multipliers grow as 1/h^2; judged as motions they do not."""
    assert run(pendulum(), GeneralisedAlpha(1e-3, scaled=False), 1e-2).time.size == 2
    assert run(pendulum(), GeneralisedAlpha(1e-6), 1e-5).time.size == 2
    with pytest.raises(ComputationError, match="do not converge"):
        run(pendulum(), GeneralisedAlpha(1e-6, scaled=False), 1e-5)


def test_an_explicit_step_beyond_its_limit_is_refused():
    with pytest.raises(InputError, match=r"HalfExplicit with a step of 0\.01 s is unstable"):
        run(Scene((Body("b", cloud(3, stiffness=1e3)),)), HalfExplicit(0.01), 1.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: GeneralisedAlpha(1e-3, spectral_radius=1.5), "spectral_radius must be from 0 to 1; it is 1.5"),
        (lambda: GeneralisedAlpha(1e-3, form="index 2"), "form must be 'index 3' or 'stabilised'; it is 'index 2'"),
        (lambda: GeneralisedAlpha(1e-3, tolerance=0.0), "tolerance must be above 0"),
        (lambda: GeneralisedAlpha(1e-3, iterations=1), "iterations must be at least 2"),
        (lambda: HHT(1e-3, alpha=0.5), "alpha must be from 0 to 1/3; it is 0.5"),
        (lambda: HHT(1e-3, form="index 1"), "form must be"),
        (lambda: Variational(1e-3, tolerance=2.0), "tolerance must be"),
    ],
)
def test_bad_settings_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


# ---- scene files ----------------------------------------------------------------------------------------------------

FILE = """
name = "pendulum"
gravity = [0, -9.81, 0]
[analysis]
end = 0.1
output_step = 0.1
step = 1e-3
method = "{method}"
settings = {settings}
[ground]
O = [0, 0, 0]
[bodies.bob]
mass = 1.0
inertia = [0.1, 0.1, 0.1]
points = {{pivot = [1, 0, 0]}}
[joints.hinge]
kind = "revolute"
i = "ground.O"
j = "bob.pivot"
"""


@pytest.mark.parametrize(
    ("method", "settings", "made"),
    [
        (
            "generalised-alpha",
            '{spectral_radius = 0.5, form = "stabilised"}',
            GeneralisedAlpha(1e-3, 0.5, "stabilised"),
        ),
        ("hht", "{alpha = 0.2, iterations = 30}", HHT(1e-3, 0.2, iterations=30)),
        ("half-explicit", "{}", HalfExplicit(1e-3)),
        ("variational", "{tolerance = 1e-10}", Variational(1e-3, 1e-10)),
        ("ros2", "{}", ROS2(1e-3)),
    ],
)
def test_scene_files_name_methods_and_their_settings(tmp_path, method, settings, made):
    path = tmp_path / "scene.toml"
    path.write_text(FILE.format(method=method, settings=settings))
    scene, read = load_scene(path)
    assert isinstance(read, Settings)
    assert read.method == made
    again = tmp_path / "again.toml"
    save_scene(scene, read, again)
    assert load_scene(again)[1].method == made
    assert type(made) in METHODS.values()


@pytest.mark.parametrize(
    ("method", "settings", "message"),
    [
        ("ros2", "{alpha = 0.1}", "settings: ros2 has no setting 'alpha'; it has none"),
        ("hht", "{spectral_radius = 0.1}", "hht has no setting 'spectral_radius'; it has alpha, form"),
        ("hht", "{alpha = 0.9}", "analysis.settings: alpha must be from 0 to 1/3"),
    ],
)
def test_bad_settings_of_a_scene_file_are_refused(tmp_path, method, settings, message):
    path = tmp_path / "scene.toml"
    path.write_text(FILE.format(method=method, settings=settings))
    with pytest.raises(InputError, match=message):
        load_scene(path)


@pytest.mark.parametrize("kind", [GeneralisedAlpha, HHT, HalfExplicit, Variational])
def test_gains_of_accelerations_are_refused(kind):
    top = Scene((Body("top", rigid_body("top", mass=1.0, inertia=(1, 2, 3))),))
    with pytest.raises(InputError, match=f"{kind.__name__} holds positions or rates"):
        integrate(top, end=1.0, output_step=0.1, method=kind(0.01), stabilisation=Baumgarte(1.0, 1.0))
