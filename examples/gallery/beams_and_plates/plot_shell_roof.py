"""
Shell roof of Scordelis and Lo
==============================

A roof of 50 ft, part of a cylinder of 25 ft and 80°, rests on diaphragms at both ends and carries its own weight. It is
a standard test of shell elements: the middle of the free edge sinks by 0.3024 ft.

A. C. Scordelis, K. S. Lo, *ACI Journal* 61 (1964) 539–561; the number is that of R. H. MacNeal, R. L. Harder, *Finite Elements
in Analysis and Design* 1 (1985) 3–20. Units are pounds and feet.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_prep as fp

R, L, weight = 25.0, 50.0, 90.0
concrete = fp.Material("concrete", 4.32e8, 0.0, weight / 0.25)
angles = np.radians(np.linspace(-40, 40, 25))
arc = np.stack([R * np.sin(angles), R * np.cos(angles)], axis=1)
strips = [
    fp.panel([(0, *b), (L, *b), (L, *e), (0, *e)], fp.Shell(0.25, concrete), elements=(24, 1))
    for b, e in zip(arc[:-1], arc[1:], strict=True)
]


def diaphragms(points):
    held = [(p, axis) for p in np.flatnonzero((points[:, 0] < 1e-9) | (points[:, 0] > L - 1e-9)) for axis in (1, 2)]
    held.append((0, 0))
    rows = np.zeros((len(held), len(points), 3))
    for row, (p, axis) in zip(rows, held):
        row[p, axis] = 1
    return rows


frame = fp.named(fp.joined(*strips), edge=(L / 2, *arc[0]))
model = fp.from_frame(frame, [fp.InterfaceRegion("edge")])
roof = fp.reduce(
    model, fp.Request(name="roof", reference=fp.UserConditions(diaphragms), reduction=fp.InertiaRelief(), linear=True)
)
q = -roof.P_dm[2] / roof.omega2
print(roof.interface("edge").phi_t @ q, roof.n)
