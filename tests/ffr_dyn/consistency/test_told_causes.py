"""What is told names the cause: small jumps of drivers, explicit forces that are too stiff, energy of negative springs, a
start that many motions leave."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp

BLOCK = fp.rigid_body("block", mass=1.0, inertia=(0.1, 0.1, 0.1), points={"a": np.zeros(3)})
ORIGIN = {"o": (0, 0, 0)}


def sliding(x: float = 0.0, **more) -> fd.Scene:
    guide = fd.Joint("guide", "translational", "ground.o", "block.a", axis=(1, 0, 0))
    return fd.Scene((fd.Body("block", BLOCK, position=(x, 0, 0)),), (guide,), ground=ORIGIN, **more)


def step_of(size: float) -> fd.TimeFunction:
    return fd.piecewise(np.array([0, 0.5, 1.0]), np.array([[0.0], [size]]))


@pytest.mark.parametrize("size", [0.02, 0.05])
def test_a_small_jump_of_a_driver_is_told_as_a_jump(size):
    """No smaller step helps it."""
    free = fd.Scene((fd.Body("block", BLOCK),), (), ground=ORIGIN)
    point = fd.PointDriver("d", "ground.o", "block.a", x=step_of(size), y=0.0, z=0.0)
    for scene in (
        sliding(drivers=(fd.Driver("d", "guide", step_of(size), coordinate="stroke"),)),
        fd.Scene(free.bodies, ground=ORIGIN, drivers=(point,)),
    ):
        result = fd.forward(scene, end=1.0, output_step=0.01, method=fd.ROS2(1e-3))
        assert any(f"driver 'd' jumps by {size:g} m at t = 0.5 s" in note for note in result.attributes["notes"])


ANALYSES = {
    "forward": lambda scene, **of: fd.forward(scene, method=fd.ROS2(2e-3), check=False, **of),
    "inverse": lambda scene, **of: fd.inverse(scene, elastic=fd.Dynamic(fd.ROS2(2e-3)), **of),
    "quasi-static": lambda scene, **of: fd.inverse(scene, elastic=fd.QuasiStatic(), **of),
    "kinematic": fd.kinematic,
}
CORNERS = {
    "formula": (fd.formula("0.2 * min(t, 0.505)"), -0.2, 0.505),
    "turned back": (fd.formula("0.1 * abs(0.3 - t)"), 0.2, 0.3),
    "pieces": (fd.piecewise(np.array([0, 0.3, 1.0]), np.array([[0.0, 0.1], [0.03, 0.3]])), 0.2, 0.3),
    "table that ends": (fd.table(np.array([0, 0.2, 0.4, 0.6]), np.array([0, 0.04, 0.08, 0.12])), -0.2, 0.6),
    "Python": (fd.user(lambda t: (0.2 * max(t, 0.3), 0.2 * (t >= 0.3), 0.0), breaks=[0.3]), 0.2, 0.3),
}


@pytest.mark.parametrize("analysis", ANALYSES)
@pytest.mark.parametrize("corner", CORNERS)
def test_the_impulse_of_a_driver_that_changes_its_rate_is_told(corner, analysis):
    """m Δv = 1 kg 0.2 m/s at once: velocities have it, and no force at a row."""
    function, change, at = CORNERS[corner]
    scene = sliding(float(function.callback(0.0)[0]) if function.callback else 0.0)
    driven = replace(scene, drivers=(fd.Driver("d", "guide", function, coordinate="stroke"),))
    result = ANALYSES[analysis](driven, end=0.9, output_step=0.01)
    told = f"driver 'd' changes its rate by {change:.4g} m/s at once at t = {at:g} s: that takes an impulse"
    assert len([note for note in result.attributes["notes"] if told in note]) == 1
    velocity, row = result["block.v"][:, 0], int(at / 0.01)
    assert velocity[row + 2] - velocity[row - 2] == pytest.approx(change, rel=1e-6)
    assert abs(result["d.force"]).max() < 1e-6


@pytest.mark.parametrize("analysis", ANALYSES)
def test_driven_motions_without_a_corner_are_told_no_impulse(analysis):
    """Nor those that begin and end on their way, or have a corner before or after the run."""
    times = np.linspace(0, 0.6, 25)
    for function in (
        fd.formula("0.2 * 0.1 * ramp(t / 0.1) + 0.01 * sin(9 * t)"),
        fd.table(times, 0.02 * np.sin(np.pi * times / 1.2) ** 4),  # from rest to rest
        fd.formula("0.2 * min(t, 1.2) + 0.1 * abs(t + 1)"),
        fd.table(np.array([0, 0.3, 0.9]), np.array([0, 0.1, 0.3])),
    ):
        driven = sliding(drivers=(fd.Driver("d", "guide", function, coordinate="stroke"),))
        result = ANALYSES[analysis](driven, end=0.9, output_step=0.01)
        assert not [note for note in result.attributes["notes"] if "impulse" in note]


def test_a_step_that_begins_at_a_corner_has_the_rate_behind_it():
    """Rates of both operands differ where they are equal, which is a time at which steps begin, with others about it that
    a note on fast changes asked for: the driver was off by its whole motion within such a step."""
    driven = sliding(drivers=(fd.Driver("d", "guide", fd.formula("min(t, 0.3)"), coordinate="stroke"),))
    result = fd.forward(driven, end=0.7, output_step=0.1, method=fd.ROS2(2.5e-3), check=False)
    assert not [note for note in result.attributes["notes"] if "is open by" in note or "changes within" in note]
    assert result.attributes["largest_drift"][0] < 1e-12


@pytest.mark.parametrize("size", [0.15, 0.2, 0.3, 0.5, 2.0])
def test_a_jump_that_no_run_can_go_on_from_is_told_as_one(size):
    scene = sliding(drivers=(fd.Driver("d", "guide", step_of(size), coordinate="stroke"),))
    for how in ({}, {"method": fd.ROS2(1e-3)}):
        with pytest.raises(fd.ComputationError, match=rf"driver 'd' jumps by {size:g} m at t = 0.5 s"):
            fd.forward(scene, end=1.0, output_step=0.01, **how)


@pytest.mark.parametrize("method", [fd.RK4(1e-3), fd.HalfExplicit(1e-3), fd.Variational(1e-3)])
def test_steps_that_fail_by_a_damper_name_it(method):
    hinge = fd.Joint("hinge", "revolute", "ground.o", "block.a")
    damper = fd.JointSpring("damper", "hinge", damping=1e6)
    body = fd.Body("block", BLOCK, omega_bar=(0, 0, 1.0))
    scene = fd.Scene((body,), (hinge,), ground=ORIGIN, forces=(damper,))
    with pytest.raises(fd.ComputationError, match=r"force 'damper' is too stiff for steps of 0.001 s"):
        fd.forward(scene, end=0.1, output_step=0.01, method=method)


def test_the_energy_of_a_negative_spring_is_energy():
    """A block that runs away; what its steps leave is small against what it has taken out of the spring."""
    spring = fd.JointSpring("spring", "guide", stiffness=-100.0, coordinate="stroke")
    result = fd.forward(sliding(1e-6, forces=(spring,)), end=2.0, output_step=0.01)
    assert not any("energy" in note for note in result.attributes["notes"])
    np.testing.assert_allclose(result["guide.stroke"][-1], 1e-6 * np.cosh(20.0), rtol=1e-3)


@pytest.mark.slow
def test_statics_tells_a_force_that_jumps_from_a_motion_that_nothing_holds():
    spring = fd.JointSpring("spring", "guide", stiffness=100.0, coordinate="stroke")
    jumping = fd.Load("load", "block.a", function=lambda t, s: (10.0 * np.sign(0.05 - s.position("block.a")[0]), 0, 0))
    with pytest.raises(
        fd.ComputationError, match=r"a force jumps, has a kink or a pole near there, along guide\.stroke"
    ):
        fd.static(sliding(forces=(spring,), loads=(jumping,)))


def test_a_net_that_is_lost_at_its_flat_start_is_told_so():
    """Nine square plates on spherical joints at the middles of their edges, hung up along one side, and flat."""
    sides = {"west": (-0.05, 0, 0), "east": (0.05, 0, 0), "south": (0, -0.05, 0), "north": (0, 0.05, 0)}
    plate = fp.rigid_body("plate", mass=0.1, inertia=(1e-4, 1e-4, 2e-4), points=sides)
    places = [(i, j) for i in range(3) for j in range(3)]
    bodies = [fd.Body(f"p{i}{j}", plate, position=(0.1 * i, 0.1 * j, 0)) for i, j in places]
    ends = [(f"p{i - 1}{j}.east", f"p{i}{j}.west") for i, j in places if i]
    ends += [(f"p{i}{j - 1}.north", f"p{i}{j}.south") for i, j in places if j]
    ends += [(f"ground.g{i}", f"p{i}2.north") for i in range(3)]
    joints = [fd.Joint(f"j{k}", "spherical", *pair) for k, pair in enumerate(ends)]
    ground = {f"g{i}": (0.1 * i, 0.25, 0) for i in range(3)}
    scene = fd.Scene(bodies, joints, ground=ground, gravity=(0, 0, -9.81))
    with pytest.raises(
        fd.ComputationError, match=r"no longer finite: the scene starts in a singular position.* draw it a"
    ):
        fd.forward(scene, end=0.01, output_step=0.01, method=fd.ROS2(1e-4))


WHEEL = """
[analysis]
end = 1.5
output_step = 0.01
step = 1e-3
check = false
[ground]
o = [0, 0, 0]
[bodies.wheel]
mass = 1.0
inertia = [0.1, 0.1, 0.1]
points = {hub = [0, 0, 0]}
[joints.axle]
kind = "revolute"
i = "ground.o"
j = "wheel.hub"
[forces.motor]
kind = "actuator"
joint = "axle"
"""
FOLLOWING = "max(min(5 * (4 * t - axle.angle) + 0.5 * (4 - axle.angle_rate), 2), -2)"


def wheel(tmp_path, force: str):
    (tmp_path / "wheel.toml").write_text(f'{WHEEL}force = "{force}"\n', encoding="utf-8")
    return fd.load_scene(tmp_path / "wheel.toml")


def test_a_formula_that_jumps_where_a_joint_passes_half_a_turn_is_told(tmp_path):
    """A controller by a formula of the angle runs away there, where a servo with the same numbers goes on."""
    scene, settings = wheel(tmp_path, FOLLOWING)
    servo = fd.Servo("motor", "axle", fd.formula("4 * t"), kp=5.0, kd=0.5, limit=2.0)
    found, meant = (fd.run(one, settings) for one in (scene, replace(scene, forces=(servo,))))
    row = int(np.argmax(meant["axle.angle"] > np.pi))
    np.testing.assert_allclose(found["axle.angle"][:row], meant["axle.angle"][:row], atol=1e-3)
    assert found["axle.angle"][-1] > meant["axle.angle"][-1] + 3.0
    (told,) = [note for note in found.attributes["notes"] if "half a turn" in note]
    assert told.startswith("force 'motor': its formula reads axle.angle")
    assert f"at t = {found.time[row]:g} s; use a servo" in told
    assert not [note for note in meant.attributes["notes"] if "half a turn" in note]
    stepper = fd.Stepper(scene, fd.ROS2(1e-3))
    for _ in range(150):
        stepper.step(10)
        told_by_stepper = [note for note in stepper.doubts() if "half a turn" in note]
    assert told_by_stepper == [told]


TURNING = ("2 + 0.5 * sin(axle.angle) + cos(3 * axle.angle)", "3 - 0.1 * axle.angle_rate")


@pytest.mark.parametrize("force", [*TURNING, "0.2 * axle.angle + 0.1"])
def test_formulas_that_do_not_jump_are_told_nothing(force, tmp_path):
    """Those of period one turn, those without the angle, and an angle that does not come so far."""
    scene, settings = wheel(tmp_path, force)
    result = fd.run(scene, settings)
    assert (result["axle.angle"][-1] > 2 * np.pi) == (force in TURNING)
    assert not [note for note in result.attributes["notes"] if "half a turn" in note]
