"""
One mechanism, four analyses
============================

A chain of four bodies, the last of which slides along a line, has two degrees of freedom. *Forward*: two torques and a
force move it. *Mixed*: the motion of the slide is known, its force is not. *Kinematic* and *inverse*: both motions are
known. Each analysis has to give back what the others were given.

Known numbers: the slide after 2 s, 78.44432899 mm by an independent integration in two coordinates, the force 10
sin(πt/2) and the torque −250.

Source: after C. Antonya's example of mixed dynamic analysis, with data made consistent; kg, mm, s.
"""

import numpy as np

import ffr_dyn as fd

bodies, loads, joints = [], [], [fd.Joint("line", "translational", "ground.S", "b5.b", axis=(1, 0, 0))]
push, s = fd.harmonic(amplitude=10.0, frequency=0.25), 50 - 25 * np.sqrt(3)  # force on the slide, height of its line
for name, before, mass, inertia, at, angle, a, b, force, torque in (
    ("b2", "ground.O", 0.1233, 25.786, (12.5, s / 2 - 25, 0), -np.pi / 3, (-25, 0, 0), (25, 0, 0), 0.0, -250.0),
    ("b3", "b2.b", 0.1233, 25.786, (25, s - 25, 0), np.pi / 2, (-25, 0, 0), (25, 0, 0), 0.0, 250.0),
    ("b4", "b3.b", 0.1233, 25.786, (37.5, s - 1.656, 0), 0.0, (-12.5, 1.656, 0), (12.5, 1.656, 0), 0.0, 0.0),
    ("b5", "b4.b", 0.63, 212.0, (75, s, 0), 0.0, (-25, 0, 0), (0, 0, 0), push, 0.0),
):
    model = fd.rigid_body(name, mass=mass, inertia=(inertia,) * 3, points={"a": a, "b": b})
    bodies.append(fd.Body(name, model, position=at, rotation=(0, 0, angle)))
    joints.append(fd.Joint(f"to_{name}", "revolute", before, f"{name}.a"))
    loads.append(fd.Load(f"on_{name}", f"{name}.b", force=(force, 0, 0), moment=(0, 0, torque)))


def chain(loads, *drivers):
    return fd.Scene(bodies, joints, drivers, loads=loads, ground={"O": (0, 0, 0), "S": (0, s, 0)})


# %%
# Forward, and the motion found made the known one.
free = fd.forward(chain(loads), end=2.0, output_step=0.02, method=fd.RK4(1e-3))
slide = fd.Driver("slide", "line", fd.recorded(free.time, free["line.stroke"], degree=7), coordinate="stroke")
motor = fd.Driver("motor", "to_b2", fd.recorded(free.time, free["to_b2.angle"], degree=7))
found = fd.mixed(chain(loads[:3], slide), unknown=[fd.MarkerEffort("F", "b5.b", (1, 0, 0))], end=2.0, output_step=0.02)
drawing = fd.plot(found, ["F.effort", "b5.R.x"])

# %%
for known in (fd.kinematic, fd.inverse):
    assert np.abs(known(chain(loads[1:3], slide, motor), end=1.6, output_step=0.1)["motor.effort"] + 250).max() < 1e-5
assert abs(free["b5.R.x"][-1] - 78.44432899) < 1e-6
assert np.abs(found["F.effort"] - 10 * np.sin(np.pi * free.time / 2)).max() < 1e-6
