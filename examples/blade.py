"""Flap of a blade on its hub at rest, 500 and 750 rev/min (measures: Epps and Chandra 1996), and of a fine beam."""

import numpy as np

import ffr_dyn as fd
import ffr_prep as fp

HUB, END = (0.0635, 0, 0), (0.9525, 0, 0)  # m: the rim, and the tip from there
BEAM = {0: "1.464  9.175  25.69", 500: "9.184  23.78  44.30", 750: "13.54  33.96  59.28"}  # Hz, benchmarks/rotating.py
section, aluminium = fp.rectangle(0.0016, 0.0254), fp.Material("aluminium", 7.31e10, 0.33, 2768.0)
line = fp.polyline([(0, 0, 0), END], fp.Member(section, aluminium, (0, 1.0, 0)), elements=36)
ends = [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")]
request = fp.Request(name="blade", reference=fp.FixedTo("root"), reduction=fp.CraigBampton(14))
blade = fp.reduce(fp.from_frame(fp.named(line, root=(0, 0, 0), tip=END), ends), request)
hub = fd.rigid_body("hub", mass=1.0, inertia=(1.0, 1.0, 1.0), points={"o": (0, 0, 0), "rim": HUB})
joints = (fd.Joint("axis", "revolute", "ground.O", "hub.o"), fd.Joint("clamp", "fixed", "hub.rim", "blade.root"))
bodies, tip = (fd.Body("hub", hub), fd.Body("blade", blade, position=HUB)), "blade.tip.position"
for rpm, beam in BEAM.items():
    motor = fd.Driver("motor", "axis", fd.polynomial(0.0, rpm * np.pi / 30))
    scene = fd.Scene(bodies, joints, (motor,), ground={"O": (0, 0, 0)})
    found = fd.linearise(fd.scene_at(scene, fd.steady(scene)), outputs=(f"{tip}.z", f"{tip}.y"))
    values, vectors = np.linalg.eig(found.A)
    out, along = np.abs(found.C @ vectors)  # of the plane of rotation, and in it
    flap = np.sort(values.imag[(values.imag > 0) & (out > along)])[:3] / (2 * np.pi)
    print(f"{rpm} rev/min: {'  '.join(f'{f:#.4g}' for f in flap)} Hz, a fine beam {beam} Hz")
