"""
Robot arm under PD control
==========================

Three joints, each held by a servo with a spring and a damper constant, move a tool of 2 kg along with a forearm that
bends. There is no integral part: at rest each joint stays off its target by the moment of the weights over kp.

For the elbow that is g cos(pitch) (m_tool a + m_arm a / 2) / kp, with a the length of the forearm.

Source: M. W. Spong, S. Hutchinson, M. Vidyasagar, *Robot Modeling and Control*, 2006, section 6.3; the closed form
above.
"""

import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

a, kp, kd = 0.5, 2000.0, 200.0  # m, N m/rad, N m s/rad
line = fp.polyline([(0, 0, 0), (a, 0, 0)], fp.Member(fp.tube(0.04, 0.003), fp.material("aluminium")), elements=8)
line = fp.named(line, elbow=(0, 0, 0), tip=(a, 0, 0))
model = fp.from_frame(line, [fp.InterfaceRegion("elbow"), fp.InterfaceRegion("tip")])
arm = fp.reduce(model, fp.Request(name="arm", reference=fp.FixedTo("elbow"), reduction=fp.CraigBampton(2)))
column = fd.rigid_body("column", mass=20.0, inertia=(1.0,) * 3, points={"base": (0, 0, 0), "top": (0, 0, 0.5)})
upper = fd.rigid_body("upper", mass=6.0, inertia=(0.01, 0.1, 0.1), points={"a": (-0.2, 0, 0), "b": (0.2, 0, 0)})
tool = fd.rigid_body("tool", mass=2.0, inertia=(2e-3,) * 3, points={"c": (0, 0, 0)})
places = (column, 0, 0), (upper, 0.2, 0.5), (arm, 0.4, 0.5), (tool, 0.4 + a, 0.5)
bodies = [fd.Body(model.name, model, position=(x, 0, z)) for model, x, z in places]
pairs = {"shoulder": ("column.top", "upper.a"), "elbow": ("upper.b", "arm.elbow")}
joints = [fd.Joint(name, "revolute", *pair, axis=(0, 1, 0)) for name, pair in pairs.items()]
joints += [fd.Joint("waist", "revolute", "ground.O", "column.base"), fd.Joint("grip", "fixed", "arm.tip", "tool.c")]
targets = {"waist": 1.2, "shoulder": -0.9, "elbow": 0.6}  # rad, reached in a second
servos = [fd.Servo(f"{name}_servo", name, fd.formula(f"{x} * smooth(t)"), kp, kd) for name, x in targets.items()]
scene = fd.Scene(bodies, joints, forces=servos, ground={"O": (0, 0, 0)}, gravity=(0, 0, -9.81))

# %%
result = fd.forward(scene, end=2.5, output_step=0.02, method=fd.ROS3(2e-3))
drawing = fd.plot(result, ["waist.angle", "shoulder.angle", "elbow.angle"])
fd.animate(result, traces=["arm.tip"], plots=["elbow.angle"])

# %%
off = 9.81 * np.cos(result["shoulder.angle"][-1] + result["elbow.angle"][-1]) * (tool.mass + arm.mass / 2) * a / kp
assert abs((result["elbow.angle"][-1] - targets["elbow"]) / off - 1) < 1e-3
