"""
Buckling load of a column
=========================

A column, clamped at its foot, carries a weight P at its top. The heavier it is, the slower the column vibrates, and at
Euler's load P = π² EI/4L² not at all. So the load is found without breaking anything, from frequencies under part of
it.

Source: L. Euler, *De curvis elasticis*, 1744; S. P. Timoshenko, J. M. Gere, *Theory of Elastic Stability*, 1961,
section 2.1.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

L, steel, section = 2.0, fp.material("steel"), fp.shear_rigid(fp.rectangle(0.04, 0.02))
line = fp.polyline([(0, 0, 0), (0, 0, L)], fp.Member(section, steel, (1, 0, 0)), elements=12)
line = fp.named(line, foot=(0, 0, 0), top=(0, 0, L))
model = fp.from_frame(line, [fp.InterfaceRegion("foot"), fp.InterfaceRegion("top")])
column = fp.reduce(model, fp.Request(name="column", reference=fp.FixedTo("foot"), reduction=fp.CraigBampton(6)))
clamp, euler = fd.Joint("clamp", "fixed", "ground.O", "column.foot"), np.pi**2 * steel.E * section.Iz / (4 * L**2)
loads, squares = euler * np.linspace(0, 0.8, 5), []
for P in loads:
    weight = fd.Load("P", "column.top", force=(0, 0, -P))
    scene = fd.Scene([fd.Body("column", column)], [clamp], loads=[weight], ground={"O": (0, 0, 0)})
    about = fd.linearise(fd.scene_at(scene, fd.static(scene)))
    squares.append(np.abs(about.eigenvalues[0]) ** 2)

# %%
load_at = np.polynomial.Polynomial.fit(squares, loads, 3)
ticks = np.linspace(0, squares[0])
plt.plot(1e-3 * loads, squares, "o", 1e-3 * load_at(ticks), ticks)
plt.gca().set(xlabel="weight [kN]", ylabel="square of the first frequency [1/s²]")
plt.title(f"{load_at(0):.1f} N; Euler {euler:.1f} N")

assert abs(load_at(0) / euler - 1) < 5e-4
