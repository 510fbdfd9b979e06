"""The view that a user's Python force has of the moving system: bodies in their own frames, however they are computed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ffr_dyn.equations.kinematics import Turn, body_state, marker_motion, turning
from ffr_dyn.equations.layout import Layout
from ffr_dyn.functions.rotation import from_matrix, product, rotation_matrix
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError


@dataclass(frozen=True)
class StateView:
    """The state at one moment, by name.

    x, v : the state vectors (see `Layout`); valid during the call only
    """

    scene: Scene
    layout: Layout
    x: Array
    v: Array

    def position(self, marker: str) -> Array:
        """(3,) [m] global position of a marker "body.interface"."""
        return marker_motion(self.scene, self.layout, self.x, self.v, marker).r

    def velocity(self, marker: str) -> Array:
        """(3,) [m/s] global velocity of a marker."""
        return marker_motion(self.scene, self.layout, self.x, self.v, marker).r_dot

    def rotation(self, body: str) -> Array:
        """(4,) Euler parameters of a body."""
        b = self._number(body)
        own = self._own_turn(b)
        return self.x[self.layout.p(b)] if own is None else product(self.x[self.layout.p(b)], from_matrix(own.rotation))

    def omega_bar(self, body: str) -> Array:
        """(3,) [rad/s] angular velocity of a body, body axes."""
        b = self._number(body)
        own = self._own_turn(b)
        return self.v[self.layout.omega(b)] if own is None else own.rotation.T @ own.omega

    def q(self, body: str) -> Array:
        """(n,) elastic coordinates of a body."""
        b = self._number(body)
        return self._own(b, self.x[self.layout.q(b)])

    def q_dot(self, body: str) -> Array:
        """(n,) rates of the elastic coordinates of a body."""
        b = self._number(body)
        return self._own(b, self.v[self.layout.q_dot(b)])

    def axes(self, body: str) -> Array:
        """(3, 3) of the frame in which a body is computed, to global: its mean-axis frame if it is of second order."""
        return rotation_matrix(self.x[self.layout.p(self._number(body))])

    def _own(self, b: int, values: Array) -> Array:
        """Of a body's own coordinates, among them those that a planar scene leaves out, which rest."""
        body = self.scene.bodies[b]
        if body.frame:
            return body.frame.C @ values
        if not body.kept:
            return values
        numbers, count = body.kept
        own = np.zeros(count)
        own[list(numbers)] = values
        return own

    def _own_turn(self, b: int) -> Turn | None:
        """How the own frame of a body stands in that in which it is computed; None where they are one."""
        frame = self.scene.bodies[b].frame
        if not frame:
            return None
        return turning(body_state(self.layout, self.x, self.v, b), frame.marker.phi_r, frame.marker.K[3:])

    def _number(self, name: str) -> int:
        names = [body.name for body in self.scene.bodies]
        if name not in names:
            raise InputError(f"there is no body {name!r}; there are: {', '.join(names)}")
        return names.index(name)
