"""
Campbell diagram of a rotor
===========================

The rotor of Nelson and McVaugh: a stepped shaft of eighteen stretches, a disc, and two bearings that are equally stiff
all around. Frequencies are those seen from the ground; where one meets the dotted line, unbalance excites it. The
critical speeds are those printed, to a thousandth. (Lengths are tenths of inches: the end is printed at 35.50 cm, and is at
35.56 cm; the disc's polar inertia is 0.00203 in the authors' other data, 0.0020 in print.)

Source: H. D. Nelson, J. M. McVaugh, The dynamics of rotor-bearing systems using finite elements, Journal of Engineering
for Industry 98 (1976) 593-600.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

# Ends of the stretches, their inner and outer radii [cm]
x = "0 1.27 5.08 7.62 8.89 10.16 10.67 11.43 12.7 13.46 16.51 19.05 22.86 26.67 28.7 30.48 31.5 34.54 35.56"
inner = "0 0 0 0 0 0 1.52 1.78 0 0 0 0 0 0 0 0 0 1.52"
outer = "0.51 1.02 0.76 2.03 2.03 3.3 3.3 2.54 2.54 1.27 1.27 1.52 1.52 1.27 1.27 3.81 2.03 2.03"
x, inner, outer = (np.array(one.split(), float) for one in (x, inner, outer))
sections = [fp.tube(b / 50, (b - a) / 100) if a else fp.circle(b / 50) for a, b in zip(inner, outer, strict=True)]
members = tuple(fp.Member(fp.shear_rigid(section), fp.Material("rotor", 2.078e11, 0.3, 7806.0)) for section in sections)
frame = fp.Frame(np.outer(x, (0.01, 0, 0)), np.column_stack([np.arange(18), np.arange(1, 19)]), members, np.arange(18))
at = {"disc": (0.0889, 0, 0), "left": (0.1651, 0, 0), "right": (0.2870, 0, 0)}
model = fp.from_frame(fp.named(frame, **at), [fp.InterfaceRegion(name) for name in at])
shaft = fp.reduce(model, fp.Request(name="shaft", reference=fp.MeanAxis(), reduction=fp.CraigBampton(8)))

disc = fd.rigid_body("disc", mass=1.401, inertia=(0.00203, 0.00136, 0.00136), points={"c": (0, 0, 0)})
bodies = [fd.Body("shaft", shaft, omega_bar=(1, 0, 0)), fd.Body("disc", disc, position=at["disc"], omega_bar=(1, 0, 0))]
k, sides = (0, 4.378e7, 4.378e7, 0, 0, 0), ("left", "right")  # N/m
bearings = [fd.Bushing(f"bearing_{side}", f"ground.{side}", f"shaft.{side}", k) for side in sides]
scene = fd.Scene(bodies, [fd.Joint("hub", "fixed", "shaft.disc", "disc.c")], forces=bearings, ground=at)
found = fd.campbell(scene, speeds=np.linspace(100.0, 6000.0, 9), modes=6)

critical = np.sort([one["speed"] for one in found.attributes["critical"]])  # rad/s
plt.plot(found["speed"], np.abs(found["seen"]), found["speed"], found["speed"] / (2 * np.pi), "k:")
plt.plot(critical, critical / (2 * np.pi), "ko")
plt.gca().set(xlabel="speed [rad/s]", ylabel="frequency [Hz]", ylim=(0, 1500), title="dots: critical speeds")
# rev/min: backward, forward, backward, forward
assert np.allclose(critical[:4] * 30 / np.pi, [15470, 17159, 46612, 49983], rtol=2e-3), critical
