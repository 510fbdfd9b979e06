"""A face of a body: what surface it lies on, where, how large."""

from __future__ import annotations

from dataclasses import dataclass

from ffr_prep.common.arrays import Array
from ffr_prep.common.brief import Brief

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
HALF_TURN = 3.1  # [rad], a little less: a cylinder that goes as far around its axis from inside is a bore
KINDS = ("plane", "cylinder", "cone", "sphere", "torus", "other")


@dataclass(frozen=True, repr=False)
class Face(Brief):
    """A face of a body, in metres.

    name   : such as surface_5, by which it is a region
    kind   : "plane", "cylinder", "cone", "sphere", "torus" or "other"
    centre : (3,) centroid of its area [m]; area [m^2]
    point  : (3,) [m] on a plane or an axis, the centre of a sphere or torus, the tip of a cone
    axis   : (3,) the normal of a plane, which points outside, or the axis of what has one
    radius : of cylinder, sphere, torus [m]; half the angle of a cone [rad];  minor : the second radius of a torus [m]
    hollow : whether material lies outside of a curved face, as around a bore; None where that is not known
    label, colour : that the file has for it, or "": the colour as #rrggbb
    groups, solids : that it belongs to
    exact  : whether centre and area are those of the geometry, and not of its mesh

    >>> fp.faces("plate.step").faces[0].area  # [m^2]
    """

    name: str
    kind: str
    centre: Array
    area: float
    point: Array | None = None
    axis: Array | None = None
    radius: float | None = None
    minor: float | None = None
    hollow: bool | None = None
    label: str = ""
    colour: str = ""
    groups: tuple[str, ...] = ()
    solids: tuple[str, ...] = ()
    exact: bool = False

    @property
    def inner(self) -> bool:
        """Whether it lies between two solids, which no query means."""
        return len(self.solids) > 1
