"""Scenes on which no factor of the program was chosen: other mechanisms, forces, joints and bodies than in the benchmark set.

They say whether what was chosen on that set (`ffr_gallery.scene_set`) holds elsewhere: `python -m benchmarks.accuracy` and
`python -m benchmarks.economy` take them with `--unseen`.
"""

from __future__ import annotations

import numpy as np
from ffr_gallery.scene_set import (
    ALUMINIUM,
    DAMPING,
    GRAVITY,
    STEEL,
    Case,
    bar,
    block,
    cantilever,
    flat,
    placed,
    speeding_up,
)

from ffr_dyn.functions.formula import formula
from ffr_dyn.functions.time_functions import harmonic
from ffr_dyn.scene.couplings import Coupling
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Actuator, Bushing, JointFriction, JointSpring, JointStop, Load, Servo, SpringDamper
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body
from ffr_prep.structures.sections import rectangle, tube

ORIGIN = {"O": (0.0, 0.0, 0.0)}


def door() -> Scene:
    """A panel on a hinge with a closer, a spring and a damper, that a gust opens."""
    panel = cantilever("panel", 0.8, rectangle(0.004, 1.2), ALUMINIUM)
    hinge = Joint("hinge", "revolute", "ground.O", "panel.a", axis=(0, 1, 0))
    gust = Load("gust", "panel.b", force=(0.0, 0.0, formula("-60 * smooth(10 * t) * (1 - smooth(10 * t - 2))")))
    closer = JointSpring("closer", "hinge", stiffness=30.0, damping=4.0)
    return Scene((Body("panel", panel, damping=0.02),), (hinge,), loads=(gust,), forces=(closer,), ground=ORIGIN)


def whirling_chain() -> Scene:
    """Two thin rods on ball joints, thrown around the vertical."""
    rod = bar("rod", 0.5, flat(0.008))
    bodies = (
        Body("upper", rod, omega_bar=(0.0, 4.0, 0.0), damping=DAMPING),
        Body("lower", rod, position=(0.5, 0, 0), velocity=(0, 0, -2.0), omega_bar=(0.0, 2.0, 1.0), damping=DAMPING),
    )
    joints = (
        Joint("top", "spherical", "ground.O", "upper.a"),
        Joint("knee", "spherical", "upper.b", "lower.a"),
        Joint("twist_upper", "perpendicular", "ground.O", "upper.a", axis=(0, 1, 0), axis_j=(0, 0, 1)),
        Joint("twist_lower", "perpendicular", "upper.b", "lower.a", axis=(0, 1, 0), axis_j=(0, 0, 1)),
    )
    return Scene(bodies, joints, ground=ORIGIN, gravity=GRAVITY)


def trammel() -> Scene:
    """A bar whose ends slide in two slots across one another, one of them driven, with a weight at the other."""
    angle, length = 0.4, 0.6
    a, b = (length * np.cos(angle), 0.0), (0.0, length * np.sin(angle))
    link = bar("link", length, rectangle(0.02, 0.008), ALUMINIUM)
    bodies = (
        placed("link", link, a, b),
        Body("shoe", block("shoe", 0.2, 0.03), position=(*a, 0.0)),
        Body("weight", block("weight", 0.5, 0.04), position=(*b, 0.0)),
    )
    joints = (
        Joint("slot", "translational", "ground.O", "shoe.pin", axis=(1, 0, 0)),
        Joint("guide", "translational", "ground.O", "weight.pin", axis=(0, 1, 0)),
        Joint("pin_a", "revolute", "shoe.pin", "link.a"),
        Joint("pin_b", "revolute", "weight.pin", "link.b"),
    )
    motor = Driver(
        "motor", "slot", formula(f"{a[0]} - 0.2 * smooth(2 * t) + 0.15 * smooth(3 * t - 1.5)"), coordinate="stroke"
    )
    return Scene(bodies, joints, (motor,), ground=ORIGIN, gravity=GRAVITY)


def crane() -> Scene:
    """A trolley that is driven along a rail, with a mass on an elastic arm hinged below it and a rope beside."""
    arm = bar("arm", 1.0, tube(0.02, 0.001), ALUMINIUM)
    bodies = (
        Body("trolley", block("trolley", 5.0, 0.2)),
        placed("arm", arm, (0, 0), (0, -1.0)),
        Body("load", block("load", 2.0, 0.1), position=(0, -1.0, 0)),
    )
    joints = (
        Joint("rail", "translational", "ground.O", "trolley.pin", axis=(1, 0, 0)),
        Joint("hook", "revolute", "trolley.pin", "arm.a"),
        Joint("grip", "fixed", "arm.b", "load.pin"),
    )
    rope = SpringDamper("rope", "ground.side", "load.pin", 150.0, 8.0, free_length=1.0)
    motor = Driver("motor", "rail", formula("0.5 * smooth(t)"), coordinate="stroke")
    ground = {**ORIGIN, "side": (1.2, -0.6, 0.0)}
    return Scene(bodies, joints, (motor,), springs=(rope,), ground=ground, gravity=GRAVITY)


def unbalanced_rotor() -> Scene:
    """A shaft with a disc off its axis, brought to speed in two housings on bushings."""
    half = bar("half", 0.3, rectangle(0.014, 0.012))
    disc = rigid_body(
        "disc", mass=2.0, inertia=np.diag((0.01, 0.006, 0.006)), centre_of_mass=np.array([0, 1e-3, 0]),
        points={"pin": np.zeros(3)},
    )  # fmt: skip
    bodies = (
        Body("left", block("left", 0.5, 0.05)),
        Body("front", half, damping=DAMPING),
        Body("disc", disc, position=(0.3, 0, 0)),
        Body("back", half, position=(0.3, 0, 0), damping=DAMPING),
        Body("right", block("right", 0.5, 0.05), position=(0.6, 0, 0)),
    )
    joints = (
        Joint("motor_side", "revolute", "left.pin", "front.a", axis=(1, 0, 0)),
        Joint("press_front", "fixed", "front.b", "disc.pin"),
        Joint("press_back", "fixed", "disc.pin", "back.a"),
        Joint("far_side", "spherical", "right.pin", "back.b"),
    )
    stiffness, damping = (4e5, 2e5, 3e5, 800.0, 800.0, 800.0), (200.0, 150.0, 150.0, 0.5, 0.5, 0.5)
    mounts = (
        Bushing("mount_left", "ground.O", "left.pin", stiffness, damping),
        Bushing("mount_right", "ground.E", "right.pin", stiffness, damping),
    )
    spin = Driver("spin", "motor_side", speeding_up(60.0, 0.4))
    return Scene(bodies, joints, (spin,), forces=mounts, ground={**ORIGIN, "E": (0.6, 0, 0)})


def servo_arm() -> Scene:
    """A hub that a servo turns against the friction of its bearing, with an elastic bar and a mass at its end."""
    bodies = (
        Body("hub", block("hub", 4.0, 0.1)),
        Body("bar", bar("bar", 0.7, rectangle(0.01, 0.02), ALUMINIUM), damping=0.02),
        Body("mass", block("mass", 0.4, 0.04), position=(0.7, 0, 0)),
    )
    joints = (
        Joint("hinge", "revolute", "ground.O", "hub.pin"),
        Joint("root", "fixed", "hub.pin", "bar.a"),
        Joint("grip", "fixed", "bar.b", "mass.pin"),
    )
    forces = (
        Servo("servo", "hinge", target=formula("smooth(2.5 * t)"), kp=300.0, kd=25.0),
        JointFriction("bearing", "hinge", coulomb=0.5, creep=0.05),
    )
    return Scene(bodies, joints, forces=forces, ground=ORIGIN, gravity=GRAVITY)


def drop_on_stop() -> Scene:
    """A bar that falls on a stop of its hinge, and rebounds."""
    rod = bar("rod", 0.6, rectangle(0.03, 0.01))
    hinge = Joint("hinge", "revolute", "ground.O", "rod.a")
    stop = JointStop("stop", "hinge", stiffness=4e4, entry=5e-3, lower=-0.5, damping=20.0)
    return Scene((Body("rod", rod, damping=0.02),), (hinge,), forces=(stop,), ground=ORIGIN, gravity=GRAVITY)


def tethered() -> Scene:
    """Two free beams that spin about one another, a spring between them."""
    one, other = bar("one", 1.0, tube(0.03, 0.001), ALUMINIUM), bar("other", 0.8, tube(0.02, 0.001), ALUMINIUM)
    bodies = (
        Body("one", one, omega_bar=(0.0, 0.5, 3.0), damping=5e-3),
        Body("other", other, position=(1.6, 0.1, 0.0), velocity=(0, 4.0, 0), omega_bar=(0.2, 0.0, 2.0), damping=5e-3),
    )
    tether = SpringDamper("tether", "one.b", "other.a", 800.0, 1.0, free_length=0.5)
    return Scene(bodies, springs=(tether,))


def geared_arms() -> Scene:
    """Two arms of different length on shafts that a pair of gears couples, an actuator on one of them."""
    long = cantilever("long", 0.9, rectangle(0.02, 0.006), ALUMINIUM)
    short = cantilever("short", 0.4, rectangle(0.02, 0.004), STEEL)
    bodies = (
        Body("long", long, damping=DAMPING),
        Body("short", short, position=(-0.3, 0, 0), rotation=(0, 0, np.pi / 2), damping=DAMPING),
    )
    joints = (
        Joint("pinion", "revolute", "ground.O", "long.a"),
        Joint("wheel", "revolute", "ground.P", "short.a", axis_j=(0, 0, 1)),
    )
    gears = Coupling("gears", "pinion.angle", "wheel.angle", ratio=-2.0, offset=np.pi / 2)
    push = Actuator("push", "pinion", force=formula("1.5 * sin(8 * t)"), damping=0.05)
    return Scene(bodies, joints, couplings=(gears,), forces=(push,), ground={**ORIGIN, "P": (-0.3, 0, 0)})


def resonance() -> Scene:
    """A clamped beam with a mass at its end, shaken a little below its first frequency."""
    beam = cantilever("beam", 0.5, rectangle(0.03, 0.005), STEEL)
    bodies = (Body("beam", beam, damping=0.02), Body("mass", block("mass", 0.3, 0.03), position=(0.5, 0, 0)))
    joints = (Joint("clamp", "fixed", "ground.O", "beam.a"), Joint("tip", "fixed", "beam.b", "mass.pin"))
    shaker = Load("shaker", "mass.pin", force=(0.0, harmonic(amplitude=1.0, frequency=12.0), 0.0))
    return Scene(bodies, joints, loads=(shaker,), ground=ORIGIN)


def suspension() -> Scene:
    """A swing arm with a wheel on a strut and a tyre whose road goes up and down, under a mass on a guide."""
    arm = bar("arm", 0.4, rectangle(0.03, 0.02))
    bodies = (
        Body("car", block("car", 60.0, 0.3)),
        Body("arm", arm, damping=DAMPING),
        Body("wheel", block("wheel", 8.0, 0.2), position=(0.4, 0, 0)),
        Body("road", block("road", 1.0, 0.1), position=(0.4, -0.3, 0)),
    )
    joints = (
        Joint("guide", "translational", "ground.O", "car.pin", axis=(0, 1, 0)),
        Joint("pivot", "revolute", "car.pin", "arm.a"),
        Joint("hub", "fixed", "arm.b", "wheel.pin"),
        Joint("shaker", "translational", "ground.R", "road.pin", axis=(0, 1, 0)),
    )
    springs = (
        SpringDamper("strut", "ground.T", "arm.b", 9e3, 600.0, free_length=0.55),
        SpringDamper("tyre", "road.pin", "wheel.pin", 6e4, 100.0, free_length=0.31),
    )
    road = Driver("bumps", "shaker", formula("0.02 * (1 - cos(12 * t))"), coordinate="stroke")
    ground = {**ORIGIN, "R": (0.4, -0.3, 0), "T": (0.35, 0.5, 0)}
    return Scene(bodies, joints, (road,), springs=springs, ground=ground, gravity=GRAVITY)


UNSEEN = (
    Case("door", door, 1.0, 0.01, ("panel.b.position.x", "panel.b.position.z")),
    Case("whirling-chain", whirling_chain, 0.6, 0.006, ("lower.b.position.x", "lower.b.position.y")),
    Case("trammel", trammel, 1.0, 0.01, ("weight.pin.position.y", "link.stress")),
    Case("crane", crane, 1.5, 0.015, ("load.pin.position.x", "rope.tension")),
    Case("unbalanced-rotor", unbalanced_rotor, 0.8, 0.004, ("disc.pin.position.y", "disc.pin.position.z")),
    Case("servo-arm", servo_arm, 0.8, 0.008, ("mass.pin.position.x", "mass.pin.position.y")),
    Case("drop-on-stop", drop_on_stop, 0.8, 0.004, ("rod.b.position.x", "rod.b.position.y")),
    Case("tethered", tethered, 1.5, 0.01, ("one.b.position.x", "other.b.position.y")),
    Case("geared-arms", geared_arms, 1.0, 0.01, ("long.b.position.y", "short.b.position.x")),
    Case("resonance", resonance, 1.0, 0.005, ("mass.pin.position.y", "beam.stress")),
    Case("suspension", suspension, 1.0, 0.01, ("car.pin.position.y", "tyre.tension")),
)
