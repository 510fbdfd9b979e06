"""
Crank mechanism of an engine
============================

A connecting rod is meshed from its geometry, reduced, and runs at 4000 rev/min between a crank and a piston. The film
colours it by its stress.

At the top dead centre the inertia of the piston pulls at the pin with m r ω² (1 + r/l), by the kinematics of the rigid
mechanism: 4619 N. The elastic rod gives that within a thousandth.

Source: C. B. Biezeno, R. Grammel, *Technische Dynamik*, 1953; closed form.
"""

import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

r, L, speed, mass = 0.045, 0.150, 4000 * np.pi / 30, 0.45  # of the crank, rod, engine and piston
mesh = fp.read_mesh("meshes/connecting_rod.geo", unit="mm", size=14)
ends = [fp.InterfaceRegion("big_eye"), fp.InterfaceRegion("small_eye")]
held = fp.SimplySupported("big_eye", "small_eye")
request = fp.Request(name="rod", reference=held, reduction=fp.CraigBampton(4), stress=True)
rod = fp.reduce(fp.from_mesh(mesh, fp.material("steel"), ends), request)
crank = fd.rigid_body("crank", mass=1.2, inertia=(1e-3, 1e-3, 2e-3), points={"hub": (0, 0, 0), "pin": (r, 0, 0)})
piston = fd.rigid_body("piston", mass=mass, inertia=(3e-4,) * 3, points={"c": (0, 0, 0)})
bodies = [
    fd.Body("crank", crank),
    fd.Body("rod", rod, position=(r, 0, 0), damping=0.01),
    fd.Body("piston", piston, position=(r + L, 0, 0)),
]
pairs = {"bearing": "ground.O crank.hub", "crank_pin": "crank.pin rod.big_eye", "piston_pin": "rod.small_eye piston.c"}
joints = [fd.Joint(name, "revolute", *pair.split()) for name, pair in pairs.items()]
joints.append(fd.Joint("cylinder", "translational", "ground.O", "piston.c", axis=(1, 0, 0)))
motor = fd.Driver("motor", "bearing", fd.polynomial(0, speed))
scene = fd.Scene(bodies, joints, [motor], ground={"O": (0, 0, 0)}, plane="z")

# %%
# A turn that comes back to itself.
turn = fd.periodic(scene)
drawing = fd.plot(turn, ["piston_pin.force", "bearing.force"])
fd.animate(turn, colour="von-mises", scale="auto", plots=["piston_pin.force"])

# %%
assert abs(turn["piston_pin.force.x"][0] / (mass * r * speed**2 * (1 + r / L)) + 1) < 1e-3
