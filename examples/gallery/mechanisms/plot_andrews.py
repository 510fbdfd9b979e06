"""
Andrews' squeezing mechanism
============================

Seven bodies in a plane, ten revolute joints and one spring. A constant moment of 0.033 N m turns the crank two times
and a half in 0.03 s. The mechanism is closed three times over: the classic test of programs
for mechanisms.

Source of the data and of the angle of the crank after 0.03 s: F. Mazzia, C. Magherini, *Test Set for Initial Value
Problem Solvers*, University of Bari; W. Schiehlen (ed.), *Multibody Systems Handbook*, 1990; IFToMM benchmark A03.
"""

import numpy as np

import ffr_dyn as fd

A, B, C, beta = -0.06934 - 0.00227j, -0.03635 + 0.03273j, (0.014, 0.072, 0), -0.0617138900142764
parts = [  # origin [m], angle [rad], mass [kg], inertia [kg m²], centre of mass and points [m]
    (0, beta, 0.04325, 2.194e-6, 0.00092, {"o": 0, "b": 0.007}),
    (0.007 * np.exp(1j * beta), beta, 0.00365, 4.41e-7, -0.0115, {"b": 0, "p": -0.028}),
    (B, 0.455279819163070, 0.02373, 5.255e-6, 0.01043 - 0.01874j, {"b": 0, "p": -0.035j, "d": 0.02 - 0.018j}),
    (A + 0.04 * np.exp(0.487364979543842j), 0.710033369709727, 0.00706, 5.667e-7, -0.00579j, {"e": 0, "p": -0.02j}),
    (A, 0.487364979543842, 0.0705, 1.169e-5, 0.02308 + 0.00916j, {"a": 0, "e": 0.04}),
    (A - 0.04j * np.exp(1.23054744454982j), 1.007879054383935, 0.00706, 5.667e-7, 0.00579, {"f": 0, "p": 0.02}),
    (A, 1.23054744454982, 0.05498, 1.912e-5, -0.00449 - 0.01228j, {"a": 0, "f": -0.04j}),
]
xyz, bodies = lambda z: (np.real(z), np.imag(z), 0.0), []
for k, (origin, angle, m, J, centre, at) in enumerate(parts, 1):
    points = {name: xyz(z) for name, z in at.items()}
    body = fd.rigid_body(f"k{k}", mass=m, inertia=(J,) * 3, centre_of_mass=xyz(centre), points=points)
    bodies.append(fd.Body(f"k{k}", body, position=xyz(origin), rotation=(0, 0, angle)))
pairs = "ground.O-k1.o k1.b-k2.b ground.B-k3.b k5.e-k4.e ground.A-k5.a k7.f-k6.f ground.A-k7.a k2.p-k3.p k2.p-k4.p k2.p-k6.p"
joints = [fd.Joint(f"hinge{k}", "revolute", *pair.split("-")) for k, pair in enumerate(pairs.split())]
spring = fd.SpringDamper("spring", "ground.C", "k3.d", 4530.0, free_length=0.07785)
motor, ground = fd.Load("motor", "k1.o", moment=(0, 0, 0.033)), {"O": (0, 0, 0), "A": xyz(A), "B": xyz(B), "C": C}

# %%
scene = fd.Scene(bodies, joints, loads=[motor], springs=[spring], ground=ground)
result = fd.forward(scene, end=0.03, output_step=1e-4, method=fd.RK4(5e-6))
drawing = fd.plot(result, ["hinge0.angle", "hinge2.angle", "hinge4.angle", "hinge6.angle"])

assert abs(result["hinge0.angle"][-1] - 15.8107711951537) < 1e-6
