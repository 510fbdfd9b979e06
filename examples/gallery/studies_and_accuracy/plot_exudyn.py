"""
Side by side with Exudyn
========================

The same reduced body in two programs: the pendulum's nodes, stiffness, mass and fourteen modes were given to Exudyn's
ObjectFFRFreducedOrder, which makes its own integrals of them. Tips differ by 8e-8 m, as far as Exudyn's step was
refined. Its bodies are linear, so ours is told to be: to second order, with the tension that stiffens the rod, the tip
is 0.13 mm elsewhere.

Source: Exudyn 1.13.6 (J. Gerstmayr, Multibody System Dynamics 2023), run on 23 November 2026 by
`benchmarks/against_exudyn.py`: generalised-alpha method, extrapolated from steps of 20 and 10 microseconds. Which is
faster, and where: the page on speed.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

EXUDYN = np.array([(1.2, 0), (1.199866638, -0.017891646), (1.197830006, -0.072135451), (1.188775927, -0.163744761),
                   (1.164301210, -0.290523085), (1.113798839, -0.446602326), (1.025715992, -0.622823237),
                   (0.889215054, -0.805791091), (0.697614419, -0.976389974), (0.454338382, -1.11066662),
                   (0.173852918, -1.187341200)])  # fmt: skip
ends = [fp.InterfaceRegion("hinge"), fp.InterfaceRegion("tip")]
model = fp.from_mesh(fp.read_mesh("meshes/pendulum.geo"), fp.Material("metal", 7e10, 0.3, 5540.0), ends)
request = fp.Request(name="rod", reference=fp.SimplySupported("hinge", "tip"), reduction=fp.CraigBampton(8))
rod = fp.reduce(model, request)
hinge = fd.Joint("hinge", "revolute", "ground.O", "rod.hinge")
tips = {}
for second_order in (False, True):
    body = fd.Body("rod", rod, stiffening=second_order)
    scene = fd.Scene([body], [hinge], ground={"O": rod.interface("hinge").position}, gravity=(0, -9.81, 0))
    run = fd.forward(scene, end=0.5, output_step=0.05, method=fd.RK4(2e-5), check=False)
    tips[second_order] = np.linalg.norm(run["rod.tip.position"][:, :2] - EXUDYN, axis=1)
plt.semilogy(run.time[1:], tips[False][1:], "o-", label="linear, as in Exudyn")
plt.semilogy(run.time[1:], tips[True][1:], "s-", label="to second order")
plt.gca().set(xlabel="time [s]", ylabel="distance of the tip from Exudyn's [m]")
plt.legend()

# %%
# The strip as it moves, with twenty times its deflection:
fd.animate(run, scale=20)

# %%
# As near as Exudyn's step was refined:
assert tips[False].max() < 2e-7
