"""
One mechanism, four analyses
============================

A chain of four bodies, the last of which slides along a line, has two degrees of freedom. *Forward*: two torques and a
force move it. *Mixed*: the motion of the slide is known, its force is not. *Kinematic* and *inverse*: both motions are
known. Each analysis has to give back what the others were given.

Known numbers: the slide after 2 s, 78.44432899 mm by an independent integration in two coordinates, the force 10
sin(πt/2) mN and the torque −0.25 mN m.

Source: after C. Antonya's example of mixed dynamic analysis, with data made consistent.
"""

import numpy as np

import ffr_dyn as fd

# m, kg m², N m, m, N
a, J, M, s, push = 0.025, 2.5786e-5, 2.5e-4, 0.05 - 0.025 * np.sqrt(3), fd.harmonic(amplitude=0.01, frequency=0.25)
bodies, loads, joints = [], [], [fd.Joint("line", "translational", "ground.S", "b5.b", axis=(1, 0, 0))]
for name, before, mass, inertia, at, angle, near, far, force, torque in (
    ("b2", "ground.O", 0.1233, J, (a / 2, s / 2 - a, 0), -np.pi / 3, (-a, 0, 0), (a, 0, 0), 0.0, -M),
    ("b3", "b2.b", 0.1233, J, (a, s - a, 0), np.pi / 2, (-a, 0, 0), (a, 0, 0), 0.0, M),
    ("b4", "b3.b", 0.1233, J, (1.5 * a, s - 1.656e-3, 0), 0.0, (-a / 2, 1.656e-3, 0), (a / 2, 1.656e-3, 0), 0.0, 0.0),
    ("b5", "b4.b", 0.63, 2.12e-4, (3 * a, s, 0), 0.0, (-a, 0, 0), (0, 0, 0), push, 0.0),
):
    model = fd.rigid_body(name, mass=mass, inertia=(inertia,) * 3, points={"a": near, "b": far})
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
    assert np.abs(known(chain(loads[1:3], slide, motor), end=1.6, output_step=0.1)["motor.effort"] + M).max() < 1e-11
assert abs(free["b5.R.x"][-1] - 0.07844432899) < 1e-9
assert np.abs(found["F.effort"] - 0.01 * np.sin(np.pi * free.time / 2)).max() < 1e-9
