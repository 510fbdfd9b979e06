"""
Pull-in of an electrostatic actuator
====================================

A shuttle of polysilicon hangs on a folded flexure: eight beams of 200 × 2 × 2 µm. A voltage V to a fixed plate at the distance g pulls it by
ε A V²/2(g − y)². Beyond a third of the gap no spring holds it: it snaps to the plate at V² = 8 k g³/27 ε A.

The flexure has k = 24EI/L³. S. D. Senturia, *Microsystem Design*, 2001, sections 6.4 and 20.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

L, c, w, gap, eps_A = 200e-6, 20e-6, 2e-6, 2e-6, 8.854e-12 * 8e-10  # m, m, m, m, F m
silicon = fp.Material("polysilicon", 160e9, 0.22, 2330.0)
soft, stiff = (fp.Member(fp.rectangle(b=w, h=h), silicon, axis) for h, axis in ((w, (0, 1, 0)), (40 * w, (1, 0, 0))))
beams = [fp.polyline([(-L, y, 0), (0, y, 0), (L, y, 0)], soft, elements=2) for y in (-2 * c, -c, c, 2 * c)]
trusses = [fp.polyline([(x, -2 * c, 0), (x, -c, 0), (x, c, 0), (x, 2 * c, 0)], stiff) for x in (-L, L)]
shuttle = fp.polyline([(0, -2 * c, 0), (0, 2 * c, 0)], stiff)
frame = fp.named(fp.joined(*beams, *trusses, shuttle), low=(0, -c, 0), high=(0, c, 0), plate=(0, 2 * c, 0))
model = fp.from_frame(frame, [fp.InterfaceRegion(name) for name in ("low", "high", "plate")])
flexure = fp.reduce(model, fp.Request(name="flexure", reference=fp.FixedTo("low"), reduction=fp.CraigBampton(0)))
anchors = [fd.Joint(name, "fixed", f"ground.{name}", f"flexure.{name}") for name in ("low", "high")]
k = 24 * silicon.E * w**4 / 12 / L**3
voltages, moved = np.sqrt(8 * k * gap**3 / (27 * eps_A)) * np.array([0.3, 0.6, 0.8, 0.9, 0.95, 0.99]), []
for V in voltages:

    def pull(t, state, V=V):
        return 0, eps_A * V**2 / 2 / (gap - state.position("flexure.plate")[1] + 2 * c) ** 2, 0

    load = fd.Load("pull", "flexure.plate", function=pull)
    rest = fd.static(fd.Scene([fd.Body("flexure", flexure)], anchors, loads=[load], ground={"low": (0, -c, 0), "high": (0, c, 0)}))
    moved.append(rest["flexure.plate.position.y"][0] - 2 * c)

y = np.array(moved)
print(y, np.sqrt(2*k*y*(gap-y)**2/eps_A)/voltages, voltages)
