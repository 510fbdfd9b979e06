"""
Where methods fail: the explicit limit
======================================

The classical Runge-Kutta method is stable up to steps of 2.828 / w, w the fastest vibration of the *assembled* scene.
With a step beyond it the vibration grows until the run stops with a sentence; linearly implicit methods bear any step.
One of the twenty-three exhibits that `ffr-dyn stability` computes: drift, Baumgarte's gains, singular positions, stiff
joints, start shocks ...

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed. 1996, section IV.2: the stability function
R(i y) is at most 1 in size up to y = 2 sqrt(2).
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

line = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(fp.circle(0.02), fp.material("steel")), elements=12)
ends = [fp.InterfaceRegion("a"), fp.InterfaceRegion("b")]
request = fp.Request(name="rod", reference=fp.FixedTo("a"), reduction=fp.Eigenmodes(4))
rod = fp.reduce(fp.from_frame(fp.named(line, a=(0, 0, 0), b=(1, 0, 0)), ends), request)
scene = fd.Scene([fd.Body("rod", rod, q=1e-5 * np.ones(4))])  # free: faster than held at its end
fastest = np.abs(fd.linearise(scene).eigenvalues).max()  # rad/s


def growth(method: fd.Integrator) -> float:
    """Of the energy over 400 steps; a thousand stands for a run that stops."""
    try:
        run = fd.forward(scene, end=400 * method.step, output_step=40 * method.step, method=method, check=False)
    except fd.ComputationError:
        return 1e3
    return run["energy.total"][-1] / run["energy.total"][0]


x = np.array([2.0, 2.4, 2.8, 2.82, 2.84, 2.9, 3.0])  # steps times the fastest frequency
rk4, ros2 = ([min(growth(method(one / fastest)), 1e3) for one in x] for method in (fd.RK4, fd.ROS2))
plt.semilogy(x, rk4, "o-", x, ros2, "s-", [np.sqrt(8)] * 2, [0.5, 1e3], "k:")
plt.gca().set(xlabel="step times the fastest frequency", ylabel="energy after 400 steps, of the start's")
plt.legend(["RK4", "ROS2", "2 √2"])
assert max(ros2) <= 1
assert max(np.array(rk4)[x < 2.828]) <= 1 < min(np.array(rk4)[x > 2.828])
