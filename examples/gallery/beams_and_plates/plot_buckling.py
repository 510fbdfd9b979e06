"""
Buckling load of a column
=========================

A column, clamped at its foot, carries a weight P at its top. The heavier it is the slower the column vibrates, and at Euler's
load P = π² EI/4L² (1744) the frequency is zero. So the load is found without breaking anything: from the squares of frequencies
under small loads.
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
loads, squares = euler * np.array([0, 0.2, 0.4, 0.6, 0.8, 0.9]), []
for P in loads:
    scene = fd.Scene(
        [fd.Body("column", column)],
        [clamp],
        loads=[fd.Load("P", "column.top", force=(0, 0, -P))],
        ground={"O": (0, 0, 0)},
    )
    about = fd.linearise(fd.scene_at(scene, fd.static(scene)))
    squares.append(np.abs(about.eigenvalues[0]) ** 2)
print(np.sqrt(squares) / 2 / np.pi)
fit = np.polynomial.Polynomial.fit(squares, loads, 2)
plt.plot(loads, squares, "o", fit(np.linspace(0, squares[0])), np.linspace(0, squares[0]))
print(fit(0) / euler)
