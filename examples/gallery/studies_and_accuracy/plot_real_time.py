"""
In step with a controller
=========================

Another program turns a flexible arm: every millisecond it reads the angle, and sets a torque by a
proportional-derivative law. The stepper takes one step, compiled and without allocation, in some microseconds. The
angle overshoots as a second-order system does.

Source: K. Ogata, Modern Control Engineering, 5th ed. 2010, section 5.3: overshoot exp(-pi z / sqrt(1 - z^2)) of a step,
with the natural frequency w = sqrt(kp / J) and the damping ratio z = kd / (2 J w).
"""

import time

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

line = fp.polyline([(0, 0, 0), (0.5, 0, 0)], fp.Member(fp.tube(0.03, 0.002), fp.material("aluminium")), elements=8)
ends = [fp.InterfaceRegion("hub"), fp.InterfaceRegion("tip")]
request = fp.Request(name="arm", reference=fp.FixedTo("hub"), reduction=fp.CraigBampton(4))
arm = fp.reduce(fp.from_frame(fp.named(line, hub=(0, 0, 0), tip=(0.5, 0, 0)), ends), request)
axle = fd.Joint("axle", "revolute", "ground.O", "arm.hub")
motor = fd.Actuator("motor", "axle", force=fd.signal("torque"))
scene = fd.Scene([fd.Body("arm", arm, damping=0.01)], [axle], forces=[motor], ground={"O": (0, 0, 0)})

J, w, z, target = arm.inertia[2, 2], 10.0, 0.4, 0.2  # kg m^2, rad/s, -, rad
stepper = fd.Stepper(scene, fd.ROS2(1e-3), outputs=("axle.angle", "axle.angle_rate"))
angle, spent = [], []
for _ in range(1000):
    began, now = time.perf_counter(), stepper.outputs()
    stepper.set_inputs(torque=float(J * w**2 * (target - now["axle.angle"]) - 2 * z * w * J * now["axle.angle_rate"]))
    stepper.step()
    spent.append(1e6 * (time.perf_counter() - began))
    angle.append(float(now["axle.angle"]))
plt.plot(np.arange(1000) / 1000, angle)
plt.gca().set(xlabel="time [s]", ylabel="angle [rad]", title=f"median of a step: {np.median(spent):.0f} µs of 1000 µs")
assert abs(max(angle) / target - 1 - np.exp(-np.pi * z / np.sqrt(1 - z**2))) < 0.005
