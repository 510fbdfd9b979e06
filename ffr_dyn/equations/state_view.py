"""What a user's Python force sees of the moving system."""

from __future__ import annotations

from dataclasses import dataclass

from ffr_dyn.equations.kinematics import marker_motion
from ffr_dyn.equations.layout import Layout
from ffr_dyn.scene.scene import Scene
from ffr_prep.common.arrays import Array


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
        return self.x[self.layout.p(self._number(body))]

    def omega_bar(self, body: str) -> Array:
        """(3,) [rad/s] angular velocity of a body, body axes."""
        return self.v[self.layout.omega(self._number(body))]

    def q(self, body: str) -> Array:
        """(n,) elastic coordinates of a body."""
        return self.x[self.layout.q(self._number(body))]

    def q_dot(self, body: str) -> Array:
        """(n,) rates of the elastic coordinates of a body."""
        return self.v[self.layout.q_dot(self._number(body))]

    def _number(self, name: str) -> int:
        return [body.name for body in self.scene.bodies].index(name)
