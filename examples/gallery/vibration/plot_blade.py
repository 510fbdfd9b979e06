"""
Flap of a turning blade
=======================

A thin aluminium blade on its hub is stiffened by the centrifugal tension: its flap frequencies rise with the speed. The
second-order displacement of the body does that by itself. Circles are what Epps and Chandra measured, crosses a fine
beam with the exact tension in its stiffness (polynomials of degree eight, `benchmarks/rotating.py`). The measured blade
is stiffer than its dimensions say, by a tenth of the frequency; the two computations agree to a thousandth.

Source: J. J. Epps, R. Chandra, The natural frequencies of rotating composite beams with tip sweep, Journal of the
American Helicopter Society 41 (1996) 29-36.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

HUB, END = (0.0635, 0, 0), (0.9525, 0, 0)  # m
BEAM = {0: (1.464, 9.175, 25.69), 500: (9.184, 23.78, 44.30), 750: (13.54, 33.96, 59.28)}  # Hz, by rev/min
MEASURED = {0: (1.4, 10.3, 27.7), 500: (10.2, 25.2, 47.0), 750: (14.8, 36.1, 62.9)}  # Hz
aluminium = fp.Material("aluminium", 7.31e10, 0.33, 2768.0)
line = fp.polyline([(0, 0, 0), END], fp.Member(fp.rectangle(0.0016, 0.0254), aluminium, (0, 1, 0)), elements=36)
model = fp.from_frame(fp.named(line, root=(0, 0, 0), tip=END), [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")])
blade = fp.reduce(model, fp.Request(name="blade", reference=fp.FixedTo("root"), reduction=fp.CraigBampton(14)))

hub = fd.rigid_body("hub", mass=1.0, inertia=(1.0, 1.0, 1.0), points={"o": (0, 0, 0), "rim": HUB})
bodies = [fd.Body("hub", hub), fd.Body("blade", blade, position=HUB)]
joints = [fd.Joint("axis", "revolute", "ground.O", "hub.o"), fd.Joint("clamp", "fixed", "hub.rim", "blade.root")]
motor = fd.Driver("motor", "axis", fd.polynomial(0.0, 1.0))
scene, speeds = fd.Scene(bodies, joints, [motor], ground={"O": (0, 0, 0)}), np.linspace(0, 750, 16) * np.pi / 30
found = fd.campbell(scene, speeds=speeds, modes=6)
flap = [k for k, name in enumerate(found.attributes["names"]) if not name.endswith("bending, y")][:3]

plt.plot(found["speed"] * 30 / np.pi, found["frequencies"][:, flap])
plt.plot(list(BEAM), list(BEAM.values()), "kx", list(MEASURED), list(MEASURED.values()), "ko", fillstyle="none")
plt.gca().set(xlabel="speed [rev/min]", ylabel="flap frequency [Hz]", title="crosses: beam; circles: measured")
own = found["frequencies"][[0, 10, 15]][:, flap]
assert np.allclose(own, list(MEASURED.values()), rtol=0.12), own
assert np.allclose(own, list(BEAM.values()), rtol=1e-3), own
