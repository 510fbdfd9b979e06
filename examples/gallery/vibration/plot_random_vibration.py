"""
Random vibration of a mast
==========================

A light mast with a heavy head stands on a base that shakes at random: white noise of 0.01 g^2/Hz up to twenty times the
first frequency. One vibration dominates, so the acceleration of the head has the root mean square of Miles' equation.

Source: J. W. Miles, On structural fatigue under random loading, Journal of the Aeronautical Sciences 21 (1954) 753-762:
rms^2 = (pi/2) f Q S, Q = 1 / (2 z); with the force of the damper, 1 + 4 z^2 times that.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

HEIGHT, S, z = 0.5, 0.01 * 9.81**2, 0.05  # m, (m/s^2)^2/Hz, damping ratio
line = fp.polyline([(0, 0, 0), (0, 0, HEIGHT)], fp.Member(fp.circle(0.012), fp.material("aluminium")), elements=20)
ends = [fp.InterfaceRegion("foot"), fp.InterfaceRegion("top")]
request = fp.Request(name="mast", reference=fp.FixedTo("foot"), reduction=fp.CraigBampton(4))
mast = fp.reduce(fp.from_frame(fp.named(line, foot=(0, 0, 0), top=(0, 0, HEIGHT)), ends), request)
head = fd.rigid_body("head", mass=5.0, inertia=(1e-3, 1e-3, 1e-3), points={"c": (0, 0, 0)})


def scene(beta: float) -> fd.Scene:
    """With the damping beta K in the mast."""
    bodies = [fd.Body("mast", fp.damped(mast, beta=beta)), fd.Body("head", head, position=(0, 0, HEIGHT))]
    joints = [fd.Joint("clamp", "fixed", "ground.base", "mast.foot"), fd.Joint("hub", "fixed", "mast.top", "head.c")]
    return fd.Scene(bodies, joints, ground={"base": (0, 0, 0)})


first = fd.linearise(scene(0.0)).frequencies[0]  # Hz
output, noise = "head.c.acceleration.y", [(0.1, S), (20 * first, S)]
found = fd.response(scene(z / (np.pi * first)), input="base.y", outputs=[output], psd=noise)
plt.loglog(found["frequency"], found["density"][:, 0])
plt.gca().set(xlabel="frequency [Hz]", ylabel="acceleration of the head [(m/s²)²/Hz]")
rms, miles = found.attributes["rms"][output], np.sqrt(np.pi / 2 * first * S / (2 * z) * (1 + 4 * z**2))
print(f"{first:.2f} Hz, rms {rms:.2f} m/s^2, Miles {miles:.2f} m/s^2")
assert abs(rms / miles - 1) < 0.01
