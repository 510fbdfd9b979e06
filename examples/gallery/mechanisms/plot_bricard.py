"""
Bricard's mechanism
===================

Five rods of 1 m and six hinges whose axes are at right angles in turn. Counted, it cannot move: 30 coordinates and 30
constraints. But one constraint follows from the others in every position, and so it moves. Programs that factorise the
constraints fail here; `fd.mobility` finds the redundant rows, and the run leaves them out.

Source of the mechanism: IFToMM benchmark A04 (M. González et al., *Multibody System Dynamics* 16, 2006). The positions
of the third hinge after 1 s and 2 s under gravity come from an integration in a single coordinate, to eight digits.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd

P = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], float)
EXACT = [(0.51050146, -1.64916760, 0.14012311), (-0.96934034, -1.22124689, 0.75427801)]
rods, frames, inertia, ends = [], [np.eye(3)], np.array([2, 101, 101]) / 1200, {"a": (0, 0, 0), "b": (1, 0, 0)}
for k, along in enumerate(np.diff(P, axis=0)):
    frames.append(np.column_stack([along, np.roll(along, 1), np.cross(along, np.roll(along, 1))]))
    rod = fd.rigid_body(f"r{k}", mass=1.0, inertia=inertia, centre_of_mass=(0.5, 0, 0), points=ends)
    rods.append(fd.Body(f"r{k}", rod, position=P[k], rotation=frames[-1]))
frames.append(np.eye(3))
pairs = ["ground.p0-r0.a", "r0.b-r1.a", "r1.b-r2.a", "r2.b-r3.a", "r3.b-r4.a", "r4.b-ground.p5"]
hinges = [
    fd.Joint(f"h{k}", "revolute", *pairs[k].split("-"), axis=frames[k].T @ e, axis_j=frames[k + 1].T @ e)
    for k, e in enumerate(np.eye(3)[[1, 2, 0, 1, 2, 0]])
]
scene = fd.Scene(rods, hinges, ground={"p0": P[0], "p5": P[5]}, gravity=(0, -9.81, 0))
print(fd.mobility(scene))

# %%
result = fd.forward(scene, end=2.0, output_step=0.02, method=fd.RK4(5e-4))
plt.plot(result.time, result["r2.b.position"], label=["x", "y", "z"])
plt.plot([1, 2], EXACT, "ko")
plt.gca().set(xlabel="time [s]", ylabel="third hinge [m]")
plt.legend()
fd.animate(result, colour="body", traces=["r2.b"])

# %%
assert np.abs(result["r2.b.position"][[50, 100]] - EXACT).max() < 1e-6
