"""A disc at the end of a clamped shaft over its speed, drawn to out/rotor.png, and its critical speeds."""

import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

END = (0.5, 0, 0)  # m
BEAM = {"backward": 153.02, "forward": 173.86}  # rad/s, of a beam in inertial axes (benchmarks/rotating.py)

shaft = fp.Member(fp.circle(0.05), fp.Material("steel", 211e9, 0.3, 7810.0))
line = fp.named(fp.polyline([(0, 0, 0), END], shaft, elements=64), root=(0, 0, 0), tip=END)
ends = [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")]
request = fp.Request(name="shaft", reference=fp.MeanAxis(), reduction=fp.CraigBampton(16))
disc = fd.rigid_body("disc", mass=52.6, inertia=(0.8054, 0.4242, 0.4242), points={"c": (0, 0, 0)})
bodies = (fd.Body("shaft", fp.reduce(fp.from_frame(line, ends), request)), fd.Body("disc", disc, position=END))
bearing = fd.Joint("bearing", "revolute", "ground.O", "shaft.root", axis=(1, 0, 0))
joints = (bearing, fd.Joint("hub", "fixed", "shaft.tip", "disc.c"))
motor = fd.Driver("motor", "bearing", fd.polynomial(0.0, 1.0))
scene = fd.Scene(bodies, joints, (motor,), ground={"O": (0, 0, 0)})
found = fd.campbell(scene, speeds=np.linspace(0.0, 400.0, 17), modes=5)
fd.draw_campbell(found, "out/rotor.png")
for one in found.attributes["critical"]:
    beam = BEAM.get(one["mode"].split()[-1])
    print(f"{one['mode']}: {one['speed']:.2f} rad/s" + (f", a beam {beam} rad/s" if beam else ""))
