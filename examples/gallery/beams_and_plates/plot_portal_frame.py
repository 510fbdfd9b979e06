"""
Portal frame
============

A frame of two clamped columns and a beam is pushed sideways at its corner by H. It gives way by H h³/(12EI) · (3k +
2)/(6k + 1) with k = (I_beam/I_column)(h/span): as columns that are clamped at both ends under a stiff beam, as
cantilevers under a soft one.

Source: A. Kleinlogel, *Rigid Frame Formulas*, 1952; axial and shear deformation are left out.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

h, span, H, Ic, steel = 2.0, 3.0, 1000.0, 4e-6, fp.material("steel")  # m, m, N, m⁴
ratios, found = np.array([0.05, 0.2, 1.0, 5.0, 20.0]), []
feet = [fd.Joint(name, "fixed", f"ground.{name}", f"portal.{name}") for name in ("left", "right")]
load, ground = fd.Load("H", "portal.corner", force=(H, 0, 0)), {"left": (0, 0, 0), "right": (span, 0, 0)}
for ratio in ratios:
    column, beam = (fp.Member(fp.general("s", A=0.1, Iy=i, Iz=i, J=i), steel, (0, 0, 1)) for i in (Ic, ratio * Ic))
    lines = [fp.polyline([(x, 0, 0), (x, h, 0)], column, elements=2) for x in (0, span)]
    frame = fp.joined(*lines, fp.polyline([(0, h, 0), (span, h, 0)], beam, elements=2))
    frame = fp.named(frame, left=(0, 0, 0), right=(span, 0, 0), corner=(0, h, 0))
    model = fp.from_frame(frame, [fp.InterfaceRegion(name) for name in ("left", "right", "corner")])
    body = fp.reduce(model, fp.Request(name="portal", reference=fp.FixedTo("left"), reduction=fp.CraigBampton(0)))
    rest = fd.static(fd.Scene([fd.Body("portal", body)], feet, loads=[load], ground=ground))
    found.append(rest["portal.corner.displacement.x"][0])

# %%


def exact(k):
    return H * h**3 / (12 * steel.E * Ic) * (3 * k + 2) / (6 * k + 1)


k, curve = ratios * h / span, np.geomspace(0.02, 20)
plt.semilogx(curve, 1e3 * exact(curve), k, 1e3 * np.array(found), "o")
plt.gca().set(xlabel="k = (I_beam / I_column) (h / span)", ylabel="sway [mm]")
plt.legend(["Kleinlogel", "computed"])

assert np.allclose(found, exact(k), rtol=1e-3)
