"""
Stable inversion: a tip that follows its path
=============================================

The tip of a flexible arm is to move along a smooth path and to stand still before and after it. The moment of the hub
that does this begins *before* the tip moves, because the arm has to bend first: the solution that stays bounded, found
over all times at once. Fed into an ordinary forward run, the moment moves the tip along its path.

Source: S. Devasia, D. Chen, B. Paden, Nonlinear inversion-based output tracking, IEEE Transactions on Automatic Control
41 (1996) 930-942.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

member = fp.Member(fp.rectangle(0.03, 0.004), fp.material("aluminium"), (0, 1, 0))
line = fp.named(fp.polyline([(0, 0, 0), (1, 0, 0)], member, elements=10), root=(0, 0, 0), tip=(1, 0, 0))
model = fp.from_frame(line, [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")])
arm = fp.reduce(model, fp.Request(name="arm", reference=fp.FixedTo("root"), reduction=fp.Eigenmodes(4)))
hub = fd.rigid_body("hub", mass=0.2, inertia=(0.02, 0.02, 0.02), points={"axle": (0, 0, 0)})
bodies = [fd.Body("hub", hub), fd.Body("arm", arm, damping=0.01)]
joints = [fd.Joint("bearing", "revolute", "ground.O", "hub.axle"), fd.Joint("weld", "fixed", "hub.axle", "arm.root")]

# 0.3 m in 0.5 s, with three derivatives zero at both ends.
path = fd.piecewise([0.0, 0.5], 0.3 * np.array([[0, 0, 0, 0, 35, -84, 70, -20]]) / 0.5 ** np.arange(8))
ground, motor = {"O": (0, 0, 0)}, fd.JointEffort("motor", "bearing")
known = fd.Scene(bodies, joints, [fd.PointDriver("path", "ground.O", "arm.tip", y=path)], ground=ground)
found = fd.mixed(known, unknown=(motor,), end=0.5, output_step=5e-3, method=fd.RK4(1e-4))

free = fd.scene_at(fd.Scene(bodies, joints, ground=ground), found, 0)
fed = fd.with_effort(free, motor, found.time, found["motor.effort"])
run = fd.forward(fed, start=found.time[0], end=found.time[-1], output_step=5e-3, method=fd.RK4(2e-4), check=False)
wanted = 0.3 * np.polyval([-20, 70, -84, 35, 0, 0, 0, 0], np.clip(run.time / 0.5, 0, 1))
plt.plot(found.time, found["motor.effort"] / np.abs(found["motor.effort"]).max(), label="moment of the hub")
plt.plot(run.time, run["arm.tip.position.y"] / 0.3, label="place of the tip")
plt.gca().set(xlabel="time [s]", ylabel="relative to the largest")
plt.legend()
assert np.allclose(run["arm.tip.position.y"], wanted, atol=1e-5)
assert np.abs(found["motor.effort"][found.time < 0]).max() > 0.02 * np.abs(found["motor.effort"]).max()
