"""
Shell roof of Scordelis and Lo
==============================

A roof of 50 ft, part of a cylinder of 25 ft and 80°, rests on diaphragms at both ends and carries its own weight: a
standard test of shell elements. User conditions hold the ends across the axis. The shapes of the body are its static
deflections under accelerations, of which gravity is one, so that its weight is borne as in the full model. The middle
of the free edge sinks by 0.3024 ft. Units are pounds and feet.

Source: A. C. Scordelis, K. S. Lo, *ACI Journal* 61 (1964) 539–561; the number of R. H. MacNeal, R. L. Harder, *Finite
Elements in Analysis and Design* 1 (1985) 3–20.
"""

from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np

import ffr_prep as fp

R, L, shell = 25.0, 50.0, fp.Shell(0.25, fp.Material("concrete", 4.32e8, 0.0, 360.0))  # 90 lb/ft² where g = 1
angles = np.radians(np.linspace(-40, 40, 25))
rim = np.stack([R * np.sin(angles), R * np.cos(angles)], axis=1)
facets = [[(0, *a), (L, *a), (L, *b), (0, *b)] for a, b in pairwise(rim)]
frame = fp.joined(*(fp.panel(corners, shell, elements=(24, 1)) for corners in facets))


def diaphragms(points):
    ends = np.flatnonzero(np.abs(points[:, 0] - L / 2) > L / 2 - 1e-6)
    held = np.eye(3 * len(points)).reshape(-1, len(points), 3)
    return held[np.concatenate([[0], 3 * ends + 1, 3 * ends + 2])]  # one node along the axis, the ends across it


# %%
model = fp.from_frame(fp.named(frame, edge=(L / 2, *rim[0])), [fp.InterfaceRegion("edge")])
conditions = fp.UserConditions(diaphragms)
roof = fp.reduce(model, fp.Request(name="roof", reference=conditions, reduction=fp.InertiaRelief(), linear=True))
q = -roof.P_dm[2] / roof.omega2  # under gravity along -z
axes = plt.figure().add_subplot(projection="3d")
x, y, z = (roof.surface.points + 20 * roof.surface.Phi @ q).T
axes.plot_trisurf(x, y, z, triangles=roof.surface.triangles, cmap="viridis")
axes.set(xlabel="x [ft]", ylabel="y [ft]", zlabel="z [ft]", title="20 times its deflection")

assert abs(roof.interface("edge").phi_t[2] @ q / -0.3024 - 1) < 0.01
