"""
Crane that leaves its payload at rest
=====================================

A bridge crane: a girder of 20 m, supported at its ends, and 5 t on a rope of 8 m in its middle. While the ends gather
speed along their rails the payload swings. A constant acceleration a over the time T leaves a swing of (2a/g) sin(π
T/T₀) with T₀ = 2π √(l/g): none after one whole period, the largest after half of it.

The elastic girder changes it by a per cent.

Source: O. J. M. Smith, *Proceedings of the IRE* 45 (1957) 1249–1255; closed form.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

L, rope, a, T0, left = 20.0, 8.0, 0.2, 2 * np.pi * np.sqrt(8.0 / 9.81), []  # m, m, m/s², s
beam = fp.Member(fp.i_section(h=1.0, b=0.5, web=0.02, flange=0.03), fp.material("steel"), (0, 0, 1))
line = fp.named(fp.polyline([(0, 0, 0), (L, 0, 0)], beam, elements=6), left=(0, 0, 0), mid=(L / 2, 0, 0), end=(L, 0, 0))
model = fp.from_frame(line, [fp.InterfaceRegion(name) for name in ("left", "mid", "end")])
girder = fp.reduce(model, fp.Request(name="girder", reference=fp.MeanAxis(), reduction=fp.CraigBampton(0)))
load = fd.rigid_body("load", mass=5000.0, inertia=(0.1,) * 3, points={"hook": (0, 0, rope)})
bodies = [fd.Body("girder", girder, damping=0.02), fd.Body("load", load, position=(L / 2, 0, -rope))]
joints = [fd.Joint("upright", "perpendicular", "ground.A", "girder.left", axis=(0, 0, 1), axis_j=(0, 1, 0))]
joints += [fd.Joint("rope", "revolute", "girder.mid", "load.hook", axis=(1, 0, 0))]
for T in (T0, T0 / 2):
    path = fd.piecewise([0, T, 99], [[0, 0, a / 2], [a * T**2 / 2, a * T, 0]])
    drivers = [fd.PointDriver("left", "ground.A", "girder.left", x=0.0, y=path, z=0.0)]
    drivers += [fd.PointDriver("end", "ground.B", "girder.end", y=path, z=0.0)]
    scene = fd.Scene(bodies, joints, drivers, ground={"A": (0, 0, 0), "B": (L, 0, 0)}, gravity=(0, 0, -9.81))
    result = fd.forward(fd.scene_at(scene, fd.static(scene)), end=20.0, output_step=0.05, method=fd.ROS3(5e-3))
    swing = (result["load.R.y"] - result["girder.mid.position.y"]) / rope
    plt.plot(result.time, np.degrees(swing), label=f"speed gathered in {T / T0:g} T₀")
    left.append(np.abs(swing[result.time > T]).max())
plt.gca().set(xlabel="time [s]", ylabel="swing [°]")
plt.legend(loc="lower right")

assert np.allclose(left, (0, 2 * a / 9.81), atol=0.03 * 2 * a / 9.81)
