"""
Five-bar from a STEP file
=========================

Four equal links, drawn in a CAD program, make a robot with two motors: a five-bar. The link is read from its STEP file,
held by its bores, meshed and reduced once; the scene has four bodies of it.

Known numbers: the mass of a link, ρ t (2 r L + π r² − 2 π b²), and the place of the tip, where two circles about the
elbows meet; the links bend by some micrometres.

Source: closed forms.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

L, d, alloy = 0.16, 0.04, fp.material("aluminium")  # length of a link, half the distance of the motors
bores = [fp.InterfaceRegion(name, f"cylinder r=6mm at {x},0,0mm") for name, x in (("near", 0), ("far", 160))]
model = fp.from_mesh(fp.read_mesh("meshes/link.step", size=12), alloy, bores)
link = fp.reduce(model, fp.Request(name="link", reference=fp.FixedTo("near"), reduction=fp.CraigBampton(2)))
assert abs(link.mass / (alloy.rho * 0.01 * (2 * 0.015 * L + np.pi * (0.015**2 - 2 * 0.006**2))) - 1) < 1e-4

# %%
# At the start the elbows are at 120° and 60°.
lift, y = np.arccos(d / L + 0.5), L * np.sqrt(0.75)
places = {"left": (-d, 0, 2 * np.pi / 3), "right": (d, 0, np.pi / 3)}
places |= {"rod": (-d - L / 2, y, lift), "bar": (d + L / 2, y, np.pi - lift)}
bodies = [fd.Body(name, link, position=(x, y, 0), rotation=(0, 0, angle)) for name, (x, y, angle) in places.items()]
pairs = "ground.P left.near, ground.Q right.near, left.far rod.near, right.far bar.near, rod.far bar.far"
joints = [fd.Joint(f"hinge{k}", "revolute", *pair.split()) for k, pair in enumerate(pairs.split(", "))]
text = "{} * pi / 3 + 0.25 * sin(2 * pi * {} * t) * smooth(2 * t)"
turns = [fd.Driver(f"motor{k}", f"hinge{k}", fd.formula(text.format(2 - k, k + 1))) for k in (0, 1)]
scene = fd.Scene(bodies, joints, turns, ground={"P": (-d, 0, 0), "Q": (d, 0, 0)}, plane="z")
result = fd.forward(scene, end=1.5, output_step=5e-3, method=fd.ROS3(5e-4))
tip = result["rod.far.position"] @ (1, 1j, 0)
e1, e2 = -d + L * np.exp(1j * result["hinge0.angle"]), d + L * np.exp(1j * result["hinge1.angle"])
exact = (e1 + e2) / 2 + 1j * (e2 - e1) * np.sqrt((L / np.abs(e2 - e1)) ** 2 - 0.25)
plt.subplot(xlabel="x [m]", ylabel="y [m]", title="path of the tip", aspect="equal").plot(tip.real, tip.imag)
fd.animate(result, scale="auto", traces=["rod.far"])

# %%
assert np.abs(tip - exact).max() < 1e-5
