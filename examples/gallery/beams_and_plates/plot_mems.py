"""
Pull-in of an electrostatic actuator
====================================

A shuttle of polysilicon hangs on a folded flexure, eight beams of 200 × 2 × 2 µm with k = 24EI/L³ in all. A voltage V
to a plate at the distance g pulls it by ε A V²/2(g − y)². Beyond a third of the gap no spring holds it, and it snaps to
the plate: the largest voltage is given by V² = 8 k g³/27 ε A.

Source: S. D. Senturia, *Microsystem Design*, 2001, section 6.4; closed form.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

L, c, w, g, eps_A = 200e-6, 20e-6, 2e-6, 2e-6, 8.854e-12 * 8e-10  # m, m, m, m, F m
silicon = fp.Material("polysilicon", 160e9, 0.22, 2330.0)
soft, stiff = (fp.Member(fp.rectangle(b=w, h=h), silicon, axis) for h, axis in ((w, (0, 1, 0)), (40 * w, (1, 0, 0))))
lines = [fp.polyline([(-L, y, 0), (0, y, 0), (L, y, 0)], soft) for y in (-2 * c, -c, c, 2 * c)]
lines += [fp.polyline([(x, y * c, 0) for y in range(-2, 3, n)], stiff) for x, n in ((-L, 1), (0, 4), (L, 1))]
frame = fp.named(fp.joined(*lines), low=(0, -c, 0), high=(0, c, 0), tip=(0, 2 * c, 0))
model = fp.from_frame(frame, [fp.InterfaceRegion(name) for name in ("low", "high", "tip")])
leaf = fp.reduce(model, fp.Request(name="leaf", reference=fp.FixedTo("low"), reduction=fp.CraigBampton(0)))
anchors = [fd.Joint(name, "fixed", f"ground.{name}", f"leaf.{name}") for name in ("low", "high")]
k, at = 24 * silicon.E * w**4 / 12 / L**3, {"low": (0, -c, 0), "high": (0, c, 0)}


def moved(V):
    def pull(t, state):
        return 0, eps_A * V**2 / 2 / (g + 2 * c - state.position("leaf.tip")[1]) ** 2, 0

    scene = fd.Scene([fd.Body("leaf", leaf)], anchors, loads=[fd.Load("pull", "leaf.tip", function=pull)], ground=at)
    return fd.static(scene)["leaf.tip.displacement.y"][0]


# %%
pull_in = np.sqrt(8 * k * g**3 / (27 * eps_A))
voltages, y = pull_in * np.array([0.2, 0.5, 0.7, 0.85, 0.95]), np.linspace(0, 0.6 * g)
found = np.array([moved(V) for V in voltages])
plt.plot(np.sqrt(2 * k * y / eps_A) * (g - y), 1e6 * y, voltages, 1e6 * found, "o")
plt.gca().set(xlabel="voltage [V]", ylabel="moved [µm]", title=f"pull-in at {pull_in:.2f} V")

assert np.allclose(np.sqrt(2 * k * found / eps_A) * (g - found), voltages, rtol=1e-3)
