"""An elastic bearing in six directions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from ffr_dyn.functions.curves import Curve, corners, curve_slope, curve_value
from ffr_dyn.functions.rotation import triad
from ffr_dyn.scene.fields import Direction, Six
from ffr_dyn.scene.force_kinds import register_force
from ffr_dyn.scene.forces.checks import check_array, check_symmetric
from ffr_dyn.scene.forces.force import Force, Kink, LawNumbers, LoadTable, Moment
from ffr_dyn.scene.forces.places import BetweenAxes
from ffr_dyn.scene.forces.spring_law import elastic_energy
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

_HALF_A_TURN = 0.95 * np.pi  # rad, from where on the ends may come out turned the other way


@register_force
@dataclass(frozen=True)
class Bushing(Force):
    """An elastic bearing in six directions between markers i and j; it pushes j back to i.

    Displacement d (3,) [m] of j from i in the axes of i, and the rotation vector psi (3,) [rad] that turns the axes of i
    into those of j (finite: angle times axis, less than half a turn). Force and moment are the generalised forces of
    (d, psi), so that a bushing without damping conserves energy however far it is turned:

        (F, M) = -stiffness (d, psi) - damping (d_dot, psi_dot) + preload

    i, j : its two markers
    stiffness : (6, 6) symmetric, its diagonal (6,), or six entries of which each is a number or a `Curve` of the force over
                its displacement [N/m, N m/rad]
    damping   : (6, 6) symmetric without negative eigenvalues, or its diagonal (6,) [N s/m, N m s/rad]
    preload   : (6,) force [N] and moment [N m] on j at rest
    axes, axes_j : the axes on i and on j as (3, 3) frames (columns) or as (3,) third axes, in the axes of their bodies;
                axes_j by default equal to axes

    Raises InputError for damping that is not positive semidefinite, for a bushing between a marker and itself,
    and for numbers of another form.

    >>> mount = fd.Bushing("mount", "ground.wall", "rod.hinge", stiffness=[1e6, 1e6, 1e6, 500, 500, 500])
    """

    word = "bushing"
    kernel = "ffr_dyn.kernels.forces.bushing:bushing"
    acts = "six directions between two markers: −K (d, ψ) − D (ḋ, ψ̇) + preload"
    positive = "pushes j along the axes of i"
    stores_energy = True

    name: str
    i: str
    j: str
    stiffness: Annotated[Any, Six("N/m", "N m/rad or N m", "N or N/rad", ("m", "rad"), ("N", "N m"))]
    damping: Annotated[Any, Six("N s/m", "N m s/rad or N m s", "N s or N s/rad")] = (0.0,) * 6
    preload: Annotated[Any, Six("N", "N m")] = (0.0,) * 6
    axes: Annotated[Any, Direction()] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    axes_j: Annotated[Any, Direction()] = None

    def __post_init__(self) -> None:
        who, D = f"bushing {self.name!r}", self.damping_matrix
        check_symmetric(self.stiffness_matrix, f"{who}: stiffness")
        check_symmetric(D, f"{who}: damping")
        if np.linalg.eigvalsh(D).min() < -1e-12 * np.abs(D).max():
            raise InputError(f"{who}: damping has the negative eigenvalue {np.linalg.eigvalsh(D).min():g}")
        check_array(self.preload, (6,), f"{who}: preload")
        _ = self.place
        if self.i == self.j:
            raise InputError(f"{who} ties {self.i!r} to itself")

    @cached_property
    def place(self) -> BetweenAxes:
        who = f"bushing {self.name!r}"
        on_i = triad(self.axes, f"{who}: axes")
        return BetweenAxes(
            who, self.i, self.j, on_i, on_i if self.axes_j is None else triad(self.axes_j, f"{who}: axes_j")
        )

    @cached_property
    def stiffness_matrix(self) -> Array:
        """(6, 6) linear stiffness; zero where a curve is given."""
        given = self.stiffness
        numbers = [0.0 if isinstance(k, Curve) else k for k in given] if np.ndim(given) == 1 else given
        return self._six_by_six(numbers, "stiffness")

    @cached_property
    def damping_matrix(self) -> Array:
        """(6, 6) damping."""
        return self._six_by_six(self.damping, "damping")

    @cached_property
    def curves(self) -> list[Curve | None]:
        """The curve of each of the six directions, None where the stiffness is a number."""
        return [k if isinstance(k, Curve) else None for k in self.stiffness]

    @property
    def holds_turning(self) -> bool:
        return bool(self.stiffness_matrix[3:].any() or any(self.curves[3:]))

    def _six_by_six(self, value: Any, what: str) -> Array:
        array = check_array(value, (6, 6) if np.ndim(value) == 2 else (6,), f"bushing {self.name!r}: {what}")
        return array if array.ndim == 2 else np.diag(array)

    def law(self, now: Moment, c: Array, rate: Array) -> Array:
        curves = [0.0 if curve is None else curve_value(curve, x) for curve, x in zip(self.curves, c, strict=True)]
        force: Array = np.array(self.preload) - self.stiffness_matrix @ c - self.damping_matrix @ rate - curves
        return force

    @cached_property
    def kinks(self) -> tuple[Kink, ...]:
        return tuple(
            Kink(-at, number=k) for k, curve in enumerate(self.curves) if curve is not None for at in corners(curve)
        )

    @property
    def stiff_coordinates(self) -> tuple[int, ...]:
        found = dominating(self.stiffness_matrix) + dominating(self.damping_matrix)
        return tuple(c for c in range(6) if found[c] > 0 or self.curves[c] is not None)

    def slopes(self, now: Moment, c: Array, rate: Array) -> tuple[Array, Array]:
        """By direction, whatever couples them."""
        own, stiffness = list(self.stiff_coordinates), dominating(self.stiffness_matrix)
        curves = [0.0 if curve is None else curve_slope(curve, x) for curve, x in zip(self.curves, c, strict=True)]
        return (stiffness + curves)[own], dominating(self.damping_matrix)[own]

    def compiled(self, table: LoadTable) -> LawNumbers:
        """Stiffness (36), damping (36), preload (6), start of the curve of each direction or -1 (6), slopes (12)."""
        curves = [table.curve(curve) for curve in self.curves]
        slopes = [dominating(self.stiffness_matrix), dominating(self.damping_matrix)]
        parts = [self.stiffness_matrix, self.damping_matrix, np.array(self.preload, float), np.array(curves), *slopes]
        return LawNumbers(np.concatenate([np.ravel(part) for part in parts]))

    def beyond(self, turned: float) -> str | None:
        tilting = any(k is not None for k in self.curves[3:]) or bool(self.stiffness_matrix[3:].any())
        if turned < _HALF_A_TURN or not tilting:
            return None
        return (
            f"bushing {self.name!r}: its ends are turned by {turned:.3g} rad against each other, and at half a turn its "
            "moment reverses: it knows no further turns; give it no stiffness against rotation, or hold the turn with a "
            "joint and a spring on its angle"
        )

    def energy(self, c: Array) -> Array:
        total, K = np.zeros(len(c)), self.stiffness_matrix
        for row, (curve, preload) in enumerate(zip(self.curves, self.preload, strict=True)):
            for column in range(6):
                total += 0.5 * K[row, column] * c[:, row] * c[:, column]
            total += (0.0 if curve is None else elastic_energy(curve, c[:, row])) - preload * c[:, row]
        return total


def dominating(matrix: Array) -> Array:
    """(6,) a diagonal that exceeds a symmetric matrix (their difference has no negative eigenvalue), whatever the units."""
    unit = np.sqrt(np.abs(np.diag(matrix)))
    unit[unit == 0] = 1.0
    found: Array = unit * (np.abs(matrix) @ (1 / unit))
    return found
