"""
Rayleigh damping
================

Damping alpha M + beta K of a body gives each of its vibrations the ratio alpha / (2 w) + beta w / 2. Two ratios at two
frequencies fix alpha and beta: here 2 % at 20 Hz and at 200 Hz. Between them the damping is less, beyond them more.

Source: K.-J. Bathe, Finite Element Procedures, 2nd ed. 2014, section 9.3.3.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

z, low, high = 0.02, 2 * np.pi * 20, 2 * np.pi * 200  # ratio, rad/s
alpha, beta = 2 * z * low * high / (low + high), 2 * z / (low + high)
line = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(fp.circle(0.02), fp.material("steel")), elements=30)
ends = [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")]
request = fp.Request(name="beam", reference=fp.FixedTo("root"), reduction=fp.CraigBampton(6))
plain = fp.reduce(fp.from_frame(fp.named(line, root=(0, 0, 0), tip=(1, 0, 0)), ends), request)
beam = fp.damped(plain, alpha=alpha, beta=beta)
clamp = fd.Joint("clamp", "fixed", "ground.wall", "beam.root")
found = fd.linearise(fd.Scene([fd.Body("beam", beam)], [clamp], ground={"wall": (0, 0, 0)}))

f, ratios = np.abs(found.eigenvalues) / (2 * np.pi), found.damping_ratios
plt.plot(f, 100 * ratios, "o", label="vibrations of the clamped beam")
plt.axline((0, 0), slope=100 * np.pi * beta, color="gray", linestyle=":", label="β K alone")
everywhere = np.geomspace(5, 1000, 200)
plt.plot(everywhere, 100 * (alpha / (4 * np.pi * everywhere) + beta * np.pi * everywhere), label="α / 2ω + β ω / 2")
plt.gca().set(xlabel="frequency [Hz]", ylabel="damping ratio [%]", xlim=(5, 1000), ylim=(0, 10))
plt.legend()
assert np.allclose(ratios, alpha / (4 * np.pi * f) + beta * np.pi * f, rtol=1e-9)
