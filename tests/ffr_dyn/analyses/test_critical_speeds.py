"""Critical speeds do not depend on the speeds of the diagram."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp
from ffr_dyn.analyses.rotating.campbell import _at_speeds, _crossings, _off_order
from ffr_dyn.analyses.rotating.steady import steady_states
from ffr_dyn.linear.spectrum import followed, spectrum


def rotor() -> fd.Scene:
    """A disc in the middle of a shaft in two bearings that are equally stiff all around."""
    at = {"left": (0, 0, 0), "middle": (0.5, 0, 0), "right": (1, 0, 0)}
    line = fp.polyline([at["left"], at["right"]], fp.Member(fp.circle(0.04), fp.material("steel")), elements=24)
    model = fp.from_frame(fp.named(line, **at), [fp.InterfaceRegion(name) for name in at])
    shaft = fp.reduce(model, fp.Request(name="shaft", reference=fp.MeanAxis(), reduction=fp.CraigBampton(6)))
    disc = fd.rigid_body("disc", mass=20.0, inertia=(0.3, 0.15, 0.15), points={"c": (0, 0, 0)})
    bodies = [
        fd.Body("shaft", shaft, omega_bar=(1, 0, 0)),
        fd.Body("disc", disc, position=at["middle"], omega_bar=(1, 0, 0)),
    ]
    hub = fd.Joint("hub", "fixed", "shaft.middle", "disc.c")
    k = (1e7, 1e7, 1e7, 0, 0, 0)
    bearings = [fd.Bushing(f"at_{side}", f"ground.{side}", f"shaft.{side}", k) for side in ("left", "right")]
    return fd.Scene(bodies, [hub], forces=bearings, ground=at)


@pytest.mark.slow
def test_how_far_a_whirl_is_from_the_speed_is_smooth_where_it_stands_still():
    """In the turning axes its eigenvalue is real there, by rounding, and says nothing of how fast it is seen."""
    at, off = _at_speeds(rotor(), "", 0.0), _off_order(True, 1.0)
    near = at(200.0, None)
    m = near.names.index("shaft: first bending, forward")
    critical = 200.0 + off(200.0, followed(near, at(200.0, (200.0, near))), m)
    for _ in range(3):
        critical += off(critical, followed(near, at(critical, (200.0, near))), m)
    beside = critical + np.array([-1e-2, -1e-4, -1e-5, 0.0, 1e-5, 1e-4, 1e-2])
    found = [off(speed, followed(near, at(speed, (200.0, near))), m) for speed in beside]
    np.testing.assert_allclose(found, critical - beside, atol=1e-3)


@pytest.mark.slow  # with a disc on a massless shaft below
def test_critical_speeds_do_not_depend_on_the_list_of_speeds():
    found = [fd.campbell(rotor(), speeds=np.linspace(*speeds), modes=2) for speeds in ((0, 800, 21), (100, 300, 3))]
    one, other = ({of["mode"]: of["speed"] for of in result.attributes["critical"]} for result in found)
    assert one == pytest.approx(other, rel=1e-6)
    assert len(one) == 2


# ---- Jeffcott's rotor: a disc of 1 kg on a massless shaft that turns in a stiff bearing -----------------------------------


def jeffcott(stiffness: tuple[float, float], damping: float = 0.0, outside: float = 0.0, **of) -> fd.Scene:
    """Stiff along x and y of the shaft [N/m], damped within the shaft and from outside [N s/m]."""
    name, x = of.get("name", ""), of.get("x", 0.0)
    disc = fd.rigid_body(f"disc{name}", mass=1.0, inertia=(1e-3, 1e-3, 2e-3), points={"c": (0, 0, 0)})
    hub = fd.rigid_body(f"hub{name}", mass=1.0, inertia=(1, 1, 1), points={"c": (0, 0, 0)})
    place, marker, turns = (x, 0, 0), f"ground.O{name}", (0, 0, of.get("speed", 1.0))
    shaft = fd.Bushing(
        f"shaft{name}", f"hub{name}.c", f"disc{name}.c", (*stiffness, 1e6, 1e3, 1e3, 1e3), (damping,) * 2 + (0,) * 4
    )
    air = fd.Bushing(f"air{name}", marker, f"disc{name}.c", (0,) * 6, (outside,) * 2 + (0,) * 4)
    return fd.Scene(
        [fd.Body(hub.name, hub, position=place), fd.Body(disc.name, disc, position=place, omega_bar=turns)],
        [fd.Joint(f"axle{name}", "revolute", marker, f"hub{name}.c", axis=(0, 0, 1))],
        [fd.Driver("motor", f"axle{name}", fd.polynomial(0, 1.0))] if not of.get("geared") else [],
        forces=[shaft, air] if outside else [shaft],
        ground={f"O{name}": place},
    )


@pytest.mark.parametrize(
    ("speeds", "criticals"),
    [
        ((0, 50, 100, 150), (100, 100)),
        ((0, 100, 130, 150), (100, 100)),
        ((80, 100), (100, 100)),
        ((-150, -50, -10), (-100, -100)),
        ((-150, -50, 0, 50, 150), (-100, -100, 100, 100)),
    ],
)
def test_a_critical_speed_may_be_one_of_the_list_and_the_rotor_may_turn_backwards(speeds, criticals):
    """Of the forward and the backward whirl of a disc on a round shaft: the root of stiffness over mass."""
    found = fd.campbell(jeffcott((1e4, 1e4)), speeds=speeds, modes=2).attributes
    assert sorted(one["speed"] for one in found["critical"]) == pytest.approx(criticals, rel=1e-8)
    assert {one["axes"] for one in found["critical"]} == {"ground"}
    assert sorted(name.rpartition(", ")[2] for name in found["names"]) == ["backward", "forward"]


@pytest.mark.parametrize(
    "speeds",
    [
        (0, 50, 105, 150),
        *(
            pytest.param(more, marks=pytest.mark.slow)
            for more in ((0, 50, 150), (0, 90, 103, 107, 150), (90, 120), (-150, 0))
        ),
    ],
)
def test_a_flat_shaft_is_unstable_between_its_critical_speeds(speeds):
    """The roots of both stiffnesses over the mass are the ends of the range; the backward whirl meets the order between."""
    found = fd.campbell(jeffcott((1e4, 1.21e4)), speeds=speeds, modes=2).attributes
    sign = 1 if speeds[-1] else -1
    forward = sorted(abs(one["speed"]) for one in found["critical"] if one["mode"].endswith("forward"))
    assert forward == pytest.approx([100, 110], rel=1e-7)
    (limit,) = found["limits"]
    assert [limit["speed"], limit["until"]] == pytest.approx([sign * 100, sign * 110], rel=1e-7)
    (backward,) = (one["speed"] for one in found["critical"] if one["mode"].endswith("backward"))
    whirl = np.sqrt(np.roots([9, -5 * 2.21e4, 1.21e8]).max())  # (k1 - 5 w^2) (k2 - 5 w^2) = 16 w^4, of 1 kg
    assert backward == pytest.approx(sign * whirl, rel=1e-7)


@pytest.mark.parametrize(
    ("off", "weight", "speeds"),
    [
        (1e-5, 0.0, (0, 50, 150)),
        *(
            pytest.param(*more, marks=pytest.mark.slow)
            for more in ((1e-5, 9.81, (0, 50, 150)), (1e-6, 9.81, (80, 100, 120)), (1e-4, 0.0, (80, 100, 120)))
        ),
    ],
)
def test_an_unbalance_or_the_weight_do_not_hide_a_critical_speed(off, weight, speeds):
    """Which bend an undamped shaft without bound there: its vibrations are those about the positions beside it."""
    scene = jeffcott((1e4, 1e4))
    hub, disc = scene.bodies
    model = fd.rigid_body(
        "disc", mass=1.0, inertia=(1e-3, 1e-3, 2e-3), centre_of_mass=(off, 0, 0), points={"c": (0, 0, 0)}
    )
    scene = replace(scene, bodies=(hub, replace(disc, model=model)), gravity=(0, -weight, 0))
    found = fd.campbell(scene, speeds=speeds, modes=2)
    critical = {one["mode"].rpartition(", ")[2]: one["speed"] for one in found.attributes["critical"]}
    assert critical == pytest.approx({"forward": 100.0, "backward": 100.0}, rel=1e-5)
    assert any("no steady motion was found" in note for note in found.attributes["notes"]) == (100 in speeds)


@pytest.mark.slow
@pytest.mark.parametrize("speeds", [(0, 100, 200, 300), (-300, -200, -100, 0)])
def test_damping_within_the_shaft_is_unstable_from_the_same_speed_in_either_direction(speeds):
    """The critical speed times one plus outer over inner damping."""
    found = fd.campbell(jeffcott((1e4, 1e4), damping=2.0, outside=1.0), speeds=speeds, modes=2).attributes
    (limit,) = found["limits"]
    assert limit["speed"] == pytest.approx(150 * np.sign(sum(speeds)), rel=1e-7)
    assert "until" not in limit


@pytest.mark.parametrize("stiffness", [(1e4, 1e4), (1e4, 1.21e4)])
def test_an_undamped_rotor_is_not_unstable_by_rounding_where_it_stands_still(stiffness):
    assert fd.steady(jeffcott(stiffness), speeds=(100.0,)).attributes["stable"]
    assert not fd.steady(jeffcott((1e4, 1.21e4)), speeds=(105.0,)).attributes["stable"]


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [3.0, -3.0])
def test_a_rotor_that_is_geared_to_a_faster_one_has_its_own_critical_speed(ratio):
    slow = jeffcott((1e4, 1e4), name="A")
    fast = jeffcott((240.0**2, 240.0**2), name="B", x=1.0, speed=ratio, geared=True)
    scene = fd.Scene(
        (*slow.bodies, *fast.bodies), (*slow.joints, *fast.joints), slow.drivers,
        couplings=[fd.Coupling("gear", "axleA.angle", "axleB.angle", ratio)], forces=(*slow.forces, *fast.forces),
        ground={**slow.ground, **fast.ground},
    )  # fmt: skip
    found = fd.campbell(scene, speeds=(10, 40, 70, 130, 150), orders=(1, 3), modes=4).attributes["critical"]
    told = sorted((one["order"], one["mode"][:5], one["speed"]) for one in found)
    assert [one[:2] for one in told] == [(1, "discA")] * 2 + [(3, "discA")] * 2 + [(3, "discB")] * 2
    assert [one[2] for one in told] == pytest.approx([100, 100, 100 / 3, 100 / 3, 80, 80], rel=1e-7)


def test_a_measure_that_leaps_across_zero_crosses_it_only_where_it_passes(monkeypatch):
    monkeypatch.setattr("ffr_dyn.analyses.rotating.campbell.followed", lambda before, now: now)
    rows = [(speed, None) for speed in (100.0, 200.0)]
    for values, speeds in (
        (lambda speed: 50.0 if speed < 130 else -50.0, []),
        (lambda speed: speed - 120, [120.0]),
    ):
        found = _crossings(lambda speed, near: None, rows, 0, lambda speed, one, m, of=values: of(speed))
        assert found == pytest.approx(speeds, rel=1e-7)


@pytest.mark.slow
def test_where_a_whirl_takes_the_shape_of_another_is_no_critical_speed():
    """Of two discs on a flat shaft the first backward and the second forward whirl meet in the turning axes, and turn into
    each other: from the ground the frequency leaps across the speed. No root of the equations in turning axes lies there."""
    near, far = (1e4, 1.6e4), 2e5
    scene = jeffcott(near)
    between = fd.Bushing("between", "disc.c", "outer.c", (far, far, 1e6, 1e3, 1e3, 1e3))
    bodies = (*scene.bodies, replace(scene.bodies[1], name="outer"))
    found = fd.campbell(replace(scene, bodies=bodies, forces=(*scene.forces, between)), speeds=(200, 240, 280))
    leaps = np.abs(np.diff(np.abs(found["seen"]) * 2 * np.pi, axis=0)) > 200
    assert leaps.any()
    roots = [np.sqrt(np.linalg.eigvalsh([[k + far, -far], [-far, far]])) for k in near]
    assert not any(((root > 200) & (root < 280)).any() for root in roots)
    assert found.attributes["critical"] == []


def test_a_diagram_that_begins_at_a_critical_speed_says_to_begin_beside_it():
    scene = jeffcott((1e4, 1e4))
    hub, disc = scene.bodies
    model = fd.rigid_body(
        "disc", mass=1.0, inertia=(1e-3, 1e-3, 2e-3), centre_of_mass=(1e-4, 0, 0), points={"c": (0, 0, 0)}
    )
    scene = replace(scene, bodies=(hub, replace(disc, model=model)))
    with pytest.raises(fd.InputError, match="at a critical speed, where nothing holds a shaft, begin beside it"):
        fd.campbell(scene, speeds=(100.0, 130.0), modes=2)


# ---- a rigid disc whose centre of mass is off its axis, in damped bearings that are alike; nothing drives it ---------------


def off_its_axis(speed: float, off: float = 1e-4, along_y: float = 2e4) -> fd.Scene:
    """2 kg; critical at sqrt(2 k / m) = 141.42 rad/s, or of the damped vibration at sqrt(2 k / m - (c / m)^2)."""
    ends = {"l": (0, 0, -0.3), "r": (0, 0, 0.3)}
    disc = fd.rigid_body("disc", mass=2.0, inertia=(0.1, 0.1, 0.2), centre_of_mass=(off, 0, 0), points=ends)
    k, c = (2e4, along_y, 1e4, 0, 0, 0), (3.0, 3.0, 0, 0, 0, 0)
    bearings = [fd.Bushing(f"at_{side}", f"ground.{side}", f"disc.{side}", k, c) for side in "lr"]
    return fd.Scene([fd.Body("disc", disc, omega_bar=(0, 0, speed))], forces=bearings, ground=ends)


@pytest.mark.parametrize(("speed", "off"), [(145.0, 1e-5), (150.0, 1e-4), (200.0, 1e-3)])
def test_the_drag_of_an_unbalance_is_no_instability(speed, off):
    """It brakes the rotor less beyond the critical speed the faster it turns. The shaft goes around by e w^2 / |w_0^2 - w^2 +
    i w c / m|."""
    found = fd.steady(off_its_axis(speed, off))
    assert found.attributes["stable"] == 1
    assert found.attributes["notes"] == []
    exact = off * speed**2 / abs(2e4 - speed**2 + 3j * speed)
    assert np.hypot(*found["disc.R"][0, :2]) == pytest.approx(exact, rel=1e-4)


@pytest.mark.slow  # with the drag above
def test_a_damped_unbalanced_rotor_has_one_forward_critical_speed_and_no_limit():
    """Its slow turning, which nothing holds, was a vibration by rounding, and the whirl grew with it."""
    found = fd.campbell(off_its_axis(1.0), speeds=(50.0, 130.0, 150.0, 250.0), modes=6).attributes
    speeds = {one["mode"].split(", ")[1]: one["speed"] for one in found["critical"] if ", " in one["mode"]}
    exact = np.sqrt(2e4 - 1.5**2)
    assert speeds["forward"] == pytest.approx(exact, rel=1e-6)
    assert len([one for one in found["critical"] if abs(one["speed"] - exact) < 10.0]) == 2  # and the backward one
    assert found["limits"] == []


@pytest.mark.slow  # with Hill's determinant of a rotor below
def test_an_unbalance_hides_no_critical_speed_in_unlike_bearings():
    """In the mean of a turn it is in resonance between the two, with the mean stiffness, and bends the shaft far there."""
    found = fd.campbell(off_its_axis(1.0, 1e-3, 1.2e4), speeds=(0.0, 50.0, 100.0, 150.0, 200.0), modes=6).attributes
    speeds = [one["speed"] for one in found["critical"] if "shift x" in one["mode"] or "shift y" in one["mode"]]
    exact = [np.sqrt(k - 1.5**2) for k in (1.2e4, 2e4)]
    assert sorted(speeds) == pytest.approx(exact, rel=1e-4)
    assert found["limits"] == []


def with_a_weight(velocity: tuple[float, float, float]) -> fd.Scene:
    """Of 20 g, 0.1 m from the axis of the disc, on which it is."""
    scene = off_its_axis(1.0, 0.0)
    model = fd.rigid_body("weight", mass=0.02, inertia=(1e-6, 1e-6, 1e-6), points={"hub": (-0.1, 0, 0)})
    ends = {"l": (0, 0, -0.3), "r": (0, 0, 0.3), "c": (0, 0, 0)}
    disc = replace(scene.bodies[0], model=fd.rigid_body("disc", mass=2.0, inertia=(0.1, 0.1, 0.2), points=ends))
    weight = fd.Body("weight", model, position=(0.1, 0, 0), velocity=velocity, omega_bar=(0, 0, 1.0))
    return replace(scene, bodies=(disc, weight), joints=[fd.Joint("fit", "fixed", "disc.c", "weight.hub")])


@pytest.mark.slow
def test_a_body_off_the_axis_without_its_velocity_is_told():
    """Assembly gives the two the velocities with the least change: they turn about an axis beside the bearings, but at the
    speed that is asked for. With the velocity the bearings have m r w^2."""
    told, quiet = (fd.steady(with_a_weight((0, v, 0)), speeds=[60.0]) for v in (0.0, 0.1))
    (note,) = [note for note in told.attributes["notes"] if "passes bushing" in note]
    assert "velocity that it has, omega x r" in note
    assert told["disc.omega_bar"][0, 2] == pytest.approx(60.0, rel=1e-6)
    assert quiet.attributes["notes"] == []
    both = quiet["at_l.force"][0] + quiet["at_r.force"][0]
    exact = 0.02 * 0.1 * 60.0**2 * 4e4 / abs(4e4 - 2.02 * 60.0**2 + 6j * 60.0)
    assert np.linalg.norm(both[:2]) == pytest.approx(exact, rel=1e-3)


# ---- a rigid rotor of 2 kg in bearings that are alike, in a casing of 20 kg on feet that are not ---------------------------


def in_a_casing(speed: float) -> fd.Scene:
    ends = {"l": (0, 0, -0.3), "r": (0, 0, 0.3)}
    disc = fd.rigid_body("disc", mass=2.0, inertia=(0.1, 0.1, 0.2), points=ends)
    casing = fd.rigid_body("casing", mass=20.0, inertia=(1.5, 1.5, 1.5), points=ends)
    bearings = [fd.Bushing(f"at_{k}", f"casing.{k}", f"disc.{k}", (1e4, 1e4, 1e4, 0, 0, 0)) for k in "lr"]
    feet = [fd.Bushing(f"on_{k}", f"ground.{k}", f"casing.{k}", (6e4, 5e4, 8e4, 1e3, 1e3, 1e3)) for k in "lr"]
    bodies = [fd.Body("disc", disc, omega_bar=(0, 0, speed)), fd.Body("casing", casing)]
    return fd.Scene(bodies, forces=[*bearings, *feet], ground=ends)


def shifts_in_a_casing() -> np.ndarray:
    """(6,) [rad/s] along x, y and z, closed form."""
    K = [[[2e4, -2e4], [-2e4, 2e4 + 2 * foot]] for foot in (6e4, 5e4, 8e4)]
    return np.sort(np.sqrt([np.linalg.eigvals(np.linalg.solve(np.diag([2.0, 20.0]), one)).real for one in K]).ravel())


@pytest.mark.parametrize("speed", [pytest.param(60.0, marks=pytest.mark.slow), 300.0])
def test_vibrations_of_a_rotor_in_its_casing_are_seen_from_the_ground(speed):
    """Whichever of the two moves more. Where the casing does they were told in axes of the rotor. The casing does not turn
    along, which would tear it off its feet."""
    ((_, found),) = steady_states(in_a_casing(speed), ())
    one = spectrum(found)
    assert not any("turn with it" in note for note in found.notes)
    for exact in shifts_in_a_casing():
        assert np.abs(np.abs(one.seen) - exact).min() < 1e-6 * exact


@pytest.mark.slow  # with one speed above
def test_a_campbell_diagram_of_a_rotor_in_its_casing():
    found = fd.campbell(in_a_casing(1.0), speeds=[60.0, 240.0, 400.0], modes=12)
    for row in np.abs(found["seen"]) * 2 * np.pi:
        for exact in shifts_in_a_casing():
            assert np.abs(row - exact).min() < 1e-6 * exact
    assert all(found.attributes["whirling"][m] for m, name in enumerate(found.attributes["names"]) if "casing" in name)


@pytest.mark.slow
@pytest.mark.parametrize("off", [1e-4, 1e-3])
def test_a_rotor_level_with_its_axis_turns_under_its_weight(off):
    """Which turns it at that angle, by m g e, but not over a turn."""
    scene = replace(off_its_axis(50.0, off), gravity=(0, -9.81, 0))
    found = fd.steady(scene)
    exact = off * 50.0**2 / abs(2e4 - 50.0**2 + 150j)
    assert np.hypot(*found["disc.R"][0, :2]) == pytest.approx(exact, rel=1e-5)
    assert any("mean over a turn" in note for note in found.attributes["notes"])


@pytest.mark.parametrize("spring", [0.0, 5e3])
@pytest.mark.parametrize("speeds", [(0.0, 15.0, 30.0), (-30.0, 0.0, 30.0)])
def test_blades_on_hinges_vibrate_though_they_are_free_at_rest(spring, speeds):
    """Of a uniform blade with hinges at the distance e, of the length l beyond, w_flap^2 = W^2 (1 + 3 e / (2 l)) and
    w_lag^2 = k / J + W^2 3 e / (2 l). (Johnson, Helicopter Theory, 1994, sections 5-1 and 5-18.)"""
    e, length, mass = 0.3, 4.7, 40.0
    J, speed = mass * length**2 / 3, speeds[-1]
    blade = fd.rigid_body(
        "blade",
        mass=mass,
        inertia=(1e-6, mass * length**2 / 12, mass * length**2 / 12),
        centre_of_mass=(length / 2, 0, 0),
        points={"h": (0, 0, 0)},
    )
    hub = fd.rigid_body("hub", mass=10.0, inertia=(1, 1, 1), points={"o": (0, 0, 0), "h": (e, 0, 0)})
    link = fd.rigid_body("link", mass=1e-3, inertia=(1e-6,) * 3, points={"h": (0, 0, 0)})
    out = {"position": (e, 0, 0), "velocity": (0, speed * e, 0), "omega_bar": (0, 0, speed)}
    scene = fd.Scene(
        (fd.Body("hub", hub, omega_bar=(0, 0, speed)), fd.Body("link", link, **out), fd.Body("blade", blade, **out)),
        (
            fd.Joint("mast", "revolute", "ground.o", "hub.o", axis=(0, 0, 1)),
            fd.Joint("lag", "revolute", "hub.h", "link.h", axis=(0, 0, 1)),
            fd.Joint("flap", "revolute", "link.h", "blade.h", axis=(0, -1, 0)),
        ),
        (fd.Driver("motor", "mast", fd.polynomial(0.0, speed)),),
        forces=(fd.JointSpring("damper", "lag", stiffness=spring),) if spring else (),
        ground={"o": (0, 0, 0)},
    )
    found, W = fd.campbell(scene, speeds=speeds), np.abs(speeds)
    rates = dict(zip(found.attributes["names"], 2 * np.pi * found["frequencies"].T, strict=True))
    np.testing.assert_allclose(rates["flap.angle"], W * np.sqrt(1 + 1.5 * e / length), rtol=1e-6)
    np.testing.assert_allclose(rates["lag.angle"], np.sqrt(spring / J + W**2 * 1.5 * e / length), rtol=1e-6)
