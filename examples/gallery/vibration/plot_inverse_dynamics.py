"""
Inverse dynamics of a flexible arm
==================================

A slender arm is turned by half a radian and brought to rest. How large is the moment of the motor, and how far does the
arm bend meanwhile? The motion is slow beside the first vibration, so the moment is that of the rigid arm, J times the
angular acceleration, and the tip lags by the deflection of a cantilever under a load that grows along it.

Source: W. C. Young, R. G. Budynas, Roark's Formulas for Stress and Strain, 7th ed. 2002, table 8.1, case 2a: 11 w L^4 /
(120 E I), with the load w = rho A a L at the tip under the angular acceleration a.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

L, T, metal = 1.0, 1.0, fp.material("aluminium")  # m, s
section = fp.shear_rigid(fp.rectangle(0.03, 0.008))
line = fp.polyline([(0, 0, 0), (L, 0, 0)], fp.Member(section, metal, (0, 1, 0)), elements=20)
ends = [fp.InterfaceRegion("hub"), fp.InterfaceRegion("tip")]
request = fp.Request(name="arm", reference=fp.FixedTo("hub"), reduction=fp.CraigBampton(6))
arm = fp.reduce(fp.from_frame(fp.named(line, hub=(0, 0, 0), tip=(L, 0, 0)), ends), request)
axle = fd.Joint("axle", "revolute", "ground.O", "arm.hub")
turn = fd.formula(f"0.5 * (t / {T} - sin(2 * pi * t / {T}) / (2 * pi))")  # rad
scene = fd.Scene([fd.Body("arm", arm)], [axle], [fd.Driver("motor", "axle", turn)], ground={"O": (0, 0, 0)})
found = fd.inverse(scene, end=T, output_step=T / 200, elastic=fd.QuasiStatic())

acceleration = 0.5 * 2 * np.pi / T**2 * np.sin(2 * np.pi * found.time / T)  # rad/s^2
moment = metal.rho * section.A * L**3 / 3 * acceleration
lag = -11 * metal.rho * section.A * acceleration * L**5 / (120 * metal.E * section.Iz)
figure, (upper, lower) = plt.subplots(2, 1, sharex=True)
upper.plot(found.time, found["motor.effort"], found.time[::10], moment[::10], "ko", fillstyle="none")
upper.set(ylabel="moment of the motor [N m]")
lower.plot(found.time, 1e3 * found["arm.tip.displacement.y"], found.time[::10], 1e3 * lag[::10], "ko", fillstyle="none")
lower.set(xlabel="time [s]", ylabel="deflection [mm]")

# %%
# The arm as it moves, with ten times its deflection:
fd.animate(found, scale=10)

# %%
# Moment and deflection of the closed forms:
assert np.allclose(found["motor.effort"], moment, atol=5e-3 * max(moment))
assert np.allclose(found["arm.tip.displacement.y"], lag, atol=5e-3 * max(lag))
