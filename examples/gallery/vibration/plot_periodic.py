"""
A pendulum that stands on its head
==================================

A pendulum stands upright on a base that shakes up and down fast enough. Its periodic motion, to stand still on the
base, is stable where the multipliers of the monodromy matrix (Floquet) lie within the unit circle. Small motions obey
Mathieu's equation y'' + (a - 2 q cos 2x) y = 0 with a = -4 g / (l w^2), q = 2 A / l for the amplitude A and the reduced
length l; the pendulum stands from where the characteristic value a0(q) comes down to a.

Sources: A. Stephenson, On induced stability, Philosophical Magazine 15 (1908) 233-236; N. W. McLachlan, Theory and
Application of Mathieu Functions, Oxford 1947.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq
from scipy.special import mathieu_a

import ffr_dyn as fd

g, w, centre, J = 9.81, 2 * np.pi * 20, 0.2, 0.02  # m/s^2, rad/s, m, kg m^2 about the centre of mass
length = centre + J / centre  # m, reduced, of a rod of 1 kg
rod = fd.rigid_body("rod", mass=1.0, inertia=(J, 1e-3, J), centre_of_mass=(0, centre, 0), points={"foot": (0, 0, 0)})
pivot, ground = fd.Joint("pivot", "revolute", "ground.O", "rod.foot"), {"ground": {"O": (0, 0, 0)}}


def largest(amplitude: float) -> float:
    """Largest multiplier of the upright pendulum on a base that shakes by so much."""
    shaking = fd.harmonic(amplitude=amplitude * w**2, frequency=w / (2 * np.pi))
    scene = fd.Scene([fd.Body("rod", rod)], [pivot], gravity=(0, -g, 0), base_acceleration=(0, shaking, 0), **ground)
    found = fd.periodic(scene, period=2 * np.pi / w, method=fd.RK4(1e-4), floquet=True)
    return max(abs(complex(*one)) for one in found.attributes["multipliers"])


amplitudes = np.linspace(0.015, 0.025, 21)
sizes = [largest(A) for A in amplitudes]
exact = brentq(lambda A: mathieu_a(0, 2 * A / length) + 4 * g / (length * w**2), 0.01, 0.03)  # m
plt.plot(1e3 * amplitudes, sizes, "o-")
plt.axvline(1e3 * exact, color="k", linestyle=":", label=f"Mathieu: {1e3 * exact:.3f} mm")
plt.gca().set(xlabel="amplitude of the base [mm]", ylabel="largest multiplier")
plt.legend()
found = brentq(lambda A: largest(A) - 1 - 1e-6, 0.015, 0.025, xtol=1e-6)
assert abs(found / exact - 1) < 1e-3, (found, exact)
