"""
Portal frame
============

A frame of two clamped columns and a beam, pushed sideways at its corner by H. It gives way by H h³/(12EI) · (3k + 2)/(6k + 1)
with k = (I_beam/I_column)(h/span), and each foot bears about the moment H h/2 · (3k + 1)/(6k + 1).

A. Kleinlogel, *Rigid Frame Formulas*, 1952; axial and shear deformation are left out.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

h, span, H, I, steel = 2.0, 3.0, 1000.0, 4e-6, fp.material("steel")


def pushed(stiffer):
    column, beam = (fp.general("s", A=0.1, Iy=of, Iz=of, J=of) for of in (I, stiffer * I))
    columns = [fp.polyline([(x, 0, 0), (x, h, 0)], fp.Member(column, steel, (0, 0, 1)), elements=2) for x in (0, span)]
    frame = fp.joined(*columns, fp.polyline([(0, h, 0), (span, h, 0)], fp.Member(beam, steel, (0, 0, 1)), elements=2))
    frame = fp.named(frame, left=(0, 0, 0), right=(span, 0, 0), corner=(0, h, 0))
    model = fp.from_frame(frame, [fp.InterfaceRegion(name) for name in ("left", "right", "corner")])
    body = fp.reduce(model, fp.Request(name="portal", reference=fp.FixedTo("left"), reduction=fp.CraigBampton(0)))
    feet = [fd.Joint(name, "fixed", f"ground.{name}", f"portal.{name}") for name in ("left", "right")]
    load, ground = fd.Load("H", "portal.corner", force=(H, 0, 0)), {"left": (0, 0, 0), "right": (span, 0, 0)}
    return fd.static(fd.Scene([fd.Body("portal", body)], feet, loads=[load], ground=ground))


# %%
ratios = np.array([0.05, 0.2, 1.0, 5.0, 20.0])
found = [pushed(ratio) for ratio in ratios]
sway = np.array([rest["portal.corner.displacement.x"][0] for rest in found])
moment = np.array([rest["left.moment.z"][0] for rest in found])
k = ratios * h / span
plt.semilogx(k, 1e3 * sway, "o", k, 1e3 * H * h**3 / (12 * steel.E * I) * (3 * k + 2) / (6 * k + 1))
plt.gca().set(xlabel="k", ylabel="sway [mm]")
print(
    sway / (H * h**3 / (12 * steel.E * I) * (3 * k + 2) / (6 * k + 1)) - 1,
    moment / (H * h / 2 * (3 * k + 1) / (6 * k + 1)),
)
assert np.allclose(sway, H * h**3 / (12 * steel.E * I) * (3 * k + 2) / (6 * k + 1), rtol=1e-3)
