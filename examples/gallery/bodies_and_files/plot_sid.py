"""
Exchange by SID
===============

Standard input data (SID) carries a flexible body to other multibody programs. Written and read back, the body moves as
before: a strip of metal, hinged and released from the horizontal. Its tip after half a second is that of a
geometrically exact beam.

Sources: O. Wallrapp, Standardization of flexible body modeling in multibody system codes, Mechanics of Structures and
Machines 22 (1994) 283-304; the number: a planar geometrically exact beam of high order, Radau IIA, right to 3e-6 m.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

metal = fp.Material("metal", 7e10, 0.3, 5540.0)
line = fp.polyline([(0, 0, 0), (1.2, 0, 0)], fp.Member(fp.rectangle(0.2, 0.009), metal, (0, 1, 0)), elements=24)
ends = [fp.InterfaceRegion("hinge"), fp.InterfaceRegion("tip")]
request = fp.Request(name="rod", reference=fp.SimplySupported("hinge", "tip"), reduction=fp.CraigBampton(8))
rod = fp.reduce(fp.from_frame(fp.named(line, hinge=(0, 0, 0), tip=(1.2, 0, 0)), ends), request)
file = fp.write_sid(rod, "out/rod.SID_FEM")

tips = []
for body in (rod, fp.read_sid(file)):
    hinge = fd.Joint("hinge", "revolute", "ground.wall", "rod.hinge")
    scene = fd.Scene([fd.Body("rod", body)], [hinge], ground={"wall": (0, 0, 0)}, gravity=(0, -9.81, 0))
    tips.append(fd.forward(scene, end=0.5, output_step=0.01, method=fd.ROS3(5e-5), check=False)["rod.tip.position"])
plt.plot(*tips[0].T[:2], label="as reduced")
plt.plot(*tips[1][::4].T[:2], "ko", fillstyle="none", label="written and read back")
plt.gca().set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="path of the tip")
plt.legend()

# %%
# The strip that was read back, as it is before it moves:
fd.show(scene)

# %%
# Both move alike, and as the exact beam does:
assert np.allclose(*tips, atol=1e-9)
assert np.allclose(tips[1][-1], (0.1737356, -1.1873578, 0), atol=1e-5), tips[1][-1]
