"""What a result says of its scene: plain values from which it can be drawn."""

import json

import numpy as np

import ffr_dyn as fd
from ffr_dyn.scene.described import described


def test_joints_drivers_and_forces_are_told_by_their_markers():
    bar = fd.rigid_body("bar", mass=1.0, inertia=np.eye(3), points={"a": (0, 0, 0), "b": (1, 0, 0)})
    scene = fd.Scene(
        (fd.Body("bar", bar),),
        (
            fd.Joint("hinge", "revolute", "ground.O", "bar.a", axis=(0, 0, 2.0)),
            fd.Joint("stay", "distance", "ground.P", "bar.b", length=1.0),
        ),
        (fd.Driver("motor", "hinge", 0.0),),
        loads=(
            fd.Load("pull", "bar.b", force=(1, 0, 0), axes="body"),
            fd.Load("wave", "bar.b", force=(fd.polynomial(0, 1), 0, 0)),
        ),
        forces=(fd.JointSpring("coil", "hinge", stiffness=1.0),),
        ground={"O": (0, 0, 0), "P": (1, 1, 0)},
        name="bar",
    )
    told = described(scene)
    assert json.loads(json.dumps(told)) == told
    assert told["title"] == "bar"
    assert told["ground"] == {"O": [0, 0, 0], "P": [1, 1, 0]}
    found = told["connections"]
    assert found["hinge"] == {"kind": "revolute", "at": ["ground.O", "bar.a"], "axis": [0, 0, 1], "drivers": ["motor"]}
    assert found["stay"]["axis"] is None
    assert found["motor"] == {"kind": "driver", "at": ["ground.O", "bar.a"], "axis": None}
    assert found["pull"] == {"kind": "Load", "at": ["bar.b"], "constant": {"force": [1, 0, 0]}, "axes": "body"}
    assert found["wave"] == {"kind": "Load", "at": ["bar.b"], "axes": "global"}
    effort = {"of": "torque", "unit": "N m", "at": "bar.a", "body": "ground", "along": [0, 0, 1]}
    assert found["coil"] == {"kind": "JointSpring", "at": ["ground.O", "bar.a"], "efforts": [effort]}
