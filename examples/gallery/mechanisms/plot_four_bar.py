"""
Four-bar: Chebyshev's straight line
===================================

Chebyshev's lambda linkage has a crank of 1, a coupler and a rocker of 2.5, and pivots that are 2 apart. The coupler,
drawn out to twice its length, ends in a point that runs along a line of length 4 for half a turn of the crank, and
comes back in an arc.

With the crank at 90°, 180° and 270° the point is at (4, 4), (2, 4) and (0, 4), and between them near the line. The
whole curve is that of two circles that meet, here written with complex numbers.

Source: P. L. Chebyshev, 1878; closed form.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd


def bar(name, **points):
    return fd.rigid_body(name, mass=1.0, inertia=(1.0,) * 3, points={key: (x, 0, 0) for key, x in points.items()})


coupler, rocker = bar("coupler", pin=0, middle=2.5, foot=5), bar("rocker", top=0, pivot=2.5)
bodies = [
    fd.Body("crank", bar("crank", hub=0, pin=1), rotation=(0, 0, np.pi / 2)),
    fd.Body("coupler", coupler, position=(0, 1, 0), rotation=(0, 0, np.arctan2(3, 4))),
    fd.Body("rocker", rocker, position=(2, 2.5, 0), rotation=(0, 0, -np.pi / 2)),
]
pairs = "ground.O-crank.hub", "crank.pin-coupler.pin", "coupler.middle-rocker.top", "ground.P-rocker.pivot"
joints = [fd.Joint(f"hinge{k}", "revolute", *pair.split("-")) for k, pair in enumerate(pairs)]
turn = fd.Driver("turn", "hinge0", fd.polynomial(np.pi / 2, 2 * np.pi))
scene = fd.Scene(bodies, joints, [turn], ground={"O": (0, 0, 0), "P": (2, 0, 0)})

# %%
# All motion is prescribed: kinematics alone.
foot = fd.kinematic(scene, end=1.0, output_step=0.005)["coupler.foot.position"] @ (1, 1j, 0)
pin = np.exp(1j * np.linspace(np.pi / 2, 5 * np.pi / 2, 201))
middle = pin + (2 - pin) / 2 * (1 + 1j * np.sqrt(4 * 2.5**2 / abs(2 - pin) ** 2 - 1))
plt.plot(foot.real, foot.imag)
plt.plot([4, 2, 0], [4, 4, 4], "o")
plt.title(f"off the line by at most {np.abs(foot.imag[:101] - 4).max():.4f}")
plt.gca().set(xlabel="x / crank", ylabel="y / crank", aspect="equal")

assert np.abs(foot - (2 * middle - pin)).max() < 1e-9
assert np.abs(foot[[0, 50, 100]] - [4 + 4j, 2 + 4j, 4j]).max() < 1e-9
