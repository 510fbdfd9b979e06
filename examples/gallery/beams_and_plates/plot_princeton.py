"""
Princeton beam in parts
=======================

A cantilever of aluminium, 508 mm long, with a weight of 8.896 N at its end, is turned about its axis: it bends by up to
29 % of its length, and twists. One moving frame goes a tenth of the length; four parts with a frame each go all the
way.

Source: measured by E. H. Dowell and J. Traybar, 1975; the tip along and across the height of the section, in mm, by an
ANSYS beam in L. Obrezkov et al., *Nonlinear Dynamics* 109 (2022).
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

angles, L, force = np.radians([0, 30, 60, 90]), 0.508, 8.896
published = np.array([(10.7141763, 0), (10.1116963, 79.39482948), (6.604665004, 129.887616), (0, 146.245978)])
member = fp.Member(fp.rectangle(0.0032024, 0.0123777), fp.Material("aluminium", 71.7e9, 0.31, 2700.0), (0, 1, 0))
line = fp.named(fp.polyline([(0, 0, 0), (L, 0, 0)], member, elements=48), root=(0, 0, 0), tip=(L, 0, 0))
model = fp.from_frame(line, [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")])
request = fp.Request(name="beam", reference=fp.FixedTo("root"), reduction=fp.CraigBampton(6), parts=4)
clamp, beam = fd.Joint("clamp", "fixed", "ground.O", "beam.root"), fd.Body("beam", fp.reduce(model, request))
tips = []
for angle in angles:
    weight = fd.Load("weight", "beam.tip", force=(0, force * np.cos(angle), force * np.sin(angle)))
    rest = fd.static(fd.Scene([beam], [clamp], loads=[weight], ground={"O": (0, 0, 0)}))
    tips.append(1e3 * rest["beam.tip.position"][0, 1:])

# %%
plt.plot(np.degrees(angles), tips, "o-", label=["along the height", "across"])
plt.plot(np.degrees(angles), published, "k+")
plt.gca().set(xlabel="angle of the weight [°]", ylabel="tip [mm]")
plt.legend()

assert np.abs(tips - published).max() < 0.1  # mm
