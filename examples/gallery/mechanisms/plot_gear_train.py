"""
Planetary gear
==============

A sun, three planets and a ring that stands still. Gears are couplings of joint angles, measured from the carrier: a sun
of 20 teeth, planets of 20 and a ring of 60.

With the ring held the sun turns 1 + z_ring/z_sun = 4 times as fast as the carrier. A torque M on the sun then
accelerates the carrier by 4 M / J, with J the inertia of all gears seen from the carrier.

Source: R. Willis, *Principles of Mechanism*, 1841; closed form.
"""

import numpy as np

import ffr_dyn as fd

sun, planet, ring, module, torque = 20, 20, 60, 0.004, 5.0
arm = module * (sun + planet) / 2


def gear(name, teeth, mass):
    J = mass * (module * teeth / 2) ** 2 / 2
    return fd.rigid_body(name, mass=mass, inertia=(J / 2, J / 2, J), points={"c": (0, 0, 0)})


places = {f"p{k}": (arm * np.cos(2 * np.pi * k / 3), arm * np.sin(2 * np.pi * k / 3), 0) for k in range(3)}
carrier = fd.rigid_body("carrier", mass=1.0, inertia=(2e-3, 2e-3, 4e-3), points={"c": (0, 0, 0), **places})
bodies = [fd.Body("carrier", carrier), fd.Body("sun", gear("sun", sun, 0.5))]
bodies += [fd.Body(name, gear(name, planet, 0.4), position=at) for name, at in places.items()]
joints = [fd.Joint("out", "revolute", "ground.O", "carrier.c"), fd.Joint("sun_axis", "revolute", "carrier.c", "sun.c")]
joints += [fd.Joint(f"{name}_axis", "revolute", f"carrier.{name}", f"{name}.c") for name in places]
gears = [fd.Coupling("inner", "out.angle", "sun_axis.angle", ring / sun)]
gears += [fd.Coupling(f"outer_{name}", "out.angle", f"{name}_axis.angle", -ring / planet) for name in places]
motor = fd.Load("motor", "sun.c", moment=(0, 0, torque))
scene = fd.Scene(bodies, joints, couplings=gears, loads=[motor], ground={"O": (0, 0, 0)})

# %%
result = fd.forward(scene, end=0.1, output_step=1e-3, method=fd.RK4(1e-4))
drawing = fd.plot(result, ["carrier.omega_bar.z", "sun.omega_bar.z", "p0.omega_bar.z"])
speeds = [result[f"{name}.omega_bar.z"][-1] for name in ("carrier", "sun", "p0")]

J_sun, J_planet = 0.5 * (module * sun / 2) ** 2 / 2, 0.4 * (module * planet / 2) ** 2 / 2
J = 4e-3 + (1 + ring / sun) ** 2 * J_sun + 3 * (0.4 * arm**2 + (1 - ring / planet) ** 2 * J_planet)
assert np.allclose(speeds / speeds[0], (1, 1 + ring / sun, 1 - ring / planet))
assert abs(speeds[0] - 0.1 * (1 + ring / sun) * torque / J) < 1e-9 * speeds[0]
