"""
A row of four-bars through its singular positions
=================================================

Three cranks of 1 m and 1 kg and two couplers make two parallelograms side by side. Twice a turn all bars lie in a line,
where the mechanism could fold in other ways: three motions are free at once. A run has to go through there and stay a
row of parallelograms, which is a pendulum: φ̈ = c sin φ/J with J = (N + 1)/3 + N and c = g((N + 1)/2 + N) for N loops.

Source: IFToMM benchmark A02 (M. González et al., *Multibody System Dynamics* 16, 2006), N = 2; the place of the first
pin after 5, 10 and 20 s by the pendulum's equation, to ten digits: (−0.8113104610, −0.5846155453), (0.3284581115,
0.9445185382), (0.8397465743, 0.5429785364).
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd

EXACT = (-0.8113104610 - 0.5846155453j, 0.3284581115 + 0.9445185382j, 0.8397465743 + 0.5429785364j)
bar = {"mass": 1.0, "inertia": (1e-3, 1 / 12, 1 / 12), "points": {"a": (-0.5, 0, 0), "b": (0.5, 0, 0)}}
bodies = []
for k in range(3):  # all upright at first, the pins at 1 m/s
    up, crank = (0, 0, np.pi / 2), fd.rigid_body(f"crank{k}", **bar)
    bodies.append(
        fd.Body(crank.name, crank, position=(k, 0.5, 0), rotation=up, velocity=(0.5, 0, 0), omega_bar=(0, 0, -1))
    )
for k, coupler in enumerate(fd.rigid_body(f"bar{k}", **bar) for k in range(2)):
    bodies.append(fd.Body(coupler.name, coupler, position=(k + 0.5, 1, 0), velocity=(1, 0, 0)))
joints = [fd.Joint(f"foot{k}", "revolute", f"ground.O{k}", f"crank{k}.a") for k in range(3)]
joints += [fd.Joint(f"near{k}", "revolute", f"crank{k}.b", f"bar{k}.a") for k in range(2)]
joints += [fd.Joint(f"far{k}", "revolute", f"crank{k + 1}.b", f"bar{k}.b") for k in range(2)]
scene = fd.Scene(bodies, joints, ground={f"O{k}": (k, 0, 0) for k in range(3)}, gravity=(0, -9.81, 0))
result = fd.forward(scene, end=20.0, output_step=0.02, method=fd.RK4(2e-3))
pin = result["crank0.b.position"] @ (1, 1j, 0)
plt.plot(result.time, pin.real, result.time, pin.imag, linewidth=1)
plt.plot([5, 10, 20], np.real(EXACT), "ko", [5, 10, 20], np.imag(EXACT), "ks")
plt.gca().set(xlabel="time [s]", ylabel="first pin [m]")
plt.legend(["x", "y", "x, published", "y"], loc="lower center", bbox_to_anchor=(0.5, 1), ncols=4)
fd.animate(result, colour="body")

# %%
assert np.abs(pin[[250, 500, 1000]] - EXACT).max() < 1e-5
