"""
Work and precision
==================

Speed without an error says nothing, so the chart draws the error of every run over its work: a flexible pendulum, three
methods, falling steps. Down and left is better. The slopes are the orders of the methods.

Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed. 1996, section IV.10 (work-precision
diagrams); orders 2, 3 and 4 are those of ROS2, ROS3 and the classical Runge-Kutta method.
"""

import matplotlib.pyplot as plt
import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

line = fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(fp.circle(0.02), fp.material("steel")), elements=12)
ends = [fp.InterfaceRegion("a"), fp.InterfaceRegion("b")]
request = fp.Request(name="rod", reference=fp.SimplySupported("a", "b"), reduction=fp.Eigenmodes(4))
rod = fp.reduce(fp.from_frame(fp.named(line, a=(0, 0, 0), b=(1, 0, 0)), ends), request)
hinge = fd.Joint("hinge", "revolute", "ground.O", "rod.a")
scene = fd.Scene([fd.Body("rod", rod)], [hinge], ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0))

span, measures = fd.Span(end=0.5, output_step=0.01), fd.measures_of(scene, ["deflection:rod"])
ladders = {name: [5e-4, 2.5e-4, 1.25e-4, 6.25e-5] for name in ("ros2", "ros3", "rk4")}  # steps in s
with fd.pool(workers=0) as here:
    chart = fd.work_precision(scene, span, here, measures=measures, methods=ladders, repeats=1)
scale = chart.scale("deflection:rod")
for name in ladders:
    points = [point for point in chart.points if point.series == name]
    plt.loglog([p.evaluations for p in points], [p.errors["deflection:rod"] / scale for p in points], "o-", label=name)
plt.gca().set(xlabel="evaluations of the equations", ylabel="error of the deflection, relative to its largest")
plt.gca().xaxis.set_minor_formatter("")
plt.legend()
found = fd.orders(chart, "deflection:rod")
print(found)
assert np.allclose([found[name, "full model"] for name in ladders], (2, 3, 4), atol=0.25)
