"""Whirls: what is integrated over a body is its kinetic energy, direction by direction."""

from __future__ import annotations

import numpy as np
from test_quasi_static import rotor

from ffr_dyn.consistency.assemble import assemble, in_space
from ffr_dyn.consistency.evaluation import total_mass_matrix
from ffr_dyn.linear.whirl import _integral


def test_the_integrals_in_three_directions_are_those_of_the_mass_matrix():
    """|u|^2 dm of complex motions, with the body undeformed."""
    assembled = assemble(in_space(rotor(0.0, stiffening=True)))
    scene, place = assembled.system.scene, assembled.system.layout
    M = total_mass_matrix(scene, place, assembled.x)
    random = np.random.default_rng(0)
    modes = random.normal(size=(place.v_size, 4)) + 1j * random.normal(size=(place.v_size, 4))
    total = np.zeros(4)
    for b, body in enumerate(scene.bodies):
        shift, turn, q = modes[place.R_dot(b)], modes[place.omega(b)], modes[place.q_dot(b)]
        total += sum(_integral(body.model, along, shift, turn, q) for along in np.eye(3))
    np.testing.assert_allclose(total, np.einsum("vm,vw,wm->m", modes.conj(), M, modes).real, rtol=1e-10)
