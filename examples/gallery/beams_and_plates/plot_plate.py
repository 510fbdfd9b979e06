"""
Modes of a cantilever plate
===========================

A square plate is clamped along one edge. Its frequencies are λ/(2π a²) √(D/ρh) with D = E h³/12(1 − ν²), and λ =
3.4917, 8.5246, 21.429, 27.331 and 31.111 for ν = 0.3. A mesh of 16 × 16 quadrilaterals is within 0.7 %. The colours are
deflections.

Source: A. W. Leissa, *Journal of Sound and Vibration* 31 (1973) 257–293.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_prep as fp

a, h, steel = 1.0, 0.005, fp.Material("steel", 2.1e11, 0.3, 7850.0)
frame = fp.panel([(0, 0, 0), (a, 0, 0), (a, a, 0), (0, a, 0)], fp.Shell(h, steel), elements=(16, 16))
model = fp.from_frame(frame, [fp.InterfaceRegion("edge", "plane x=0")])
plate = fp.reduce(model, fp.Request(name="plate", reference=fp.FixedTo("edge"), reduction=fp.CraigBampton(5)))
found = np.sqrt(plate.omega2) * a**2 / np.sqrt(steel.E * h**2 / (12 * (1 - steel.nu**2) * steel.rho))

# %%
figure, panels = plt.subplots(1, 5, figsize=(12, 3), layout="constrained", sharey=True)
for k, panel in enumerate(panels):
    panel.tricontourf(*plate.surface.points[:, :2].T, plate.surface.Phi[:, 2, k], levels=21, cmap="RdBu")
    panel.set(title=f"λ = {found[k]:.2f}, {plate.frequencies[k]:.1f} Hz", xlabel="x [m]", aspect="equal")
panels[0].set_ylabel("y [m]")

assert np.allclose(found, (3.4917, 8.5246, 21.429, 27.331, 31.111), rtol=0.007)
