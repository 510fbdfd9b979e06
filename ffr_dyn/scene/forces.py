"""Applied loads between and on markers: forces and moments, spring-dampers, bushings. Gravity belongs to the scene.

Forces on joint coordinates are in `ffr_dyn.scene.joint_forces`, those on surfaces and modes in `ffr_dyn.scene.surface_loads`.
"""

from __future__ import annotations

from collections.abc import Callable, Sized
from dataclasses import dataclass
from typing import Any

import numpy as np

from ffr_dyn.functions.curves import Curve
from ffr_dyn.functions.rotation import triad
from ffr_dyn.functions.time_functions import as_time_function
from ffr_prep.common.errors import InputError

Array = np.ndarray


@dataclass(frozen=True)
class Load:
    """A force [N] and a moment [N m] on a marker.

    marker : "body.interface"
    force, moment : three components each; a component is a number, a `TimeFunction` (constant, harmonic, table, ...)
        or a Python function of time
    function : instead of these, a Python function (t, state) -> (3,) force or (6,) force and moment; `state` is a
        `ffr_dyn.equations.state_view.StateView`
    axes : "global", or "body" for a follower load
    """

    name: str
    marker: str
    force: Any = (0.0, 0.0, 0.0)
    moment: Any = (0.0, 0.0, 0.0)
    function: Callable[..., Any] | None = None
    axes: str = "global"

    def __post_init__(self) -> None:
        if self.axes not in ("global", "body"):
            raise InputError(f"load {self.name!r}: axes must be 'global' or 'body', not {self.axes!r}")
        for what, value in (("force", self.force), ("moment", self.moment)):
            if not isinstance(value, Sized) or len(value) != 3:
                found = len(value) if isinstance(value, Sized) else value
                whole = "a function (t, state) that gives all of them goes to `function`"
                raise InputError(f"load {self.name!r}: {what} needs three components, not {found}; {whole}")


@dataclass(frozen=True)
class SpringDamper:
    """Force along the line i - j, positive in tension: stiffness (l - free_length) + damping dl/dt + preload.

    stiffness : [N/m], or a `Curve` of the force [N] over l - free_length [m]
    damping   : [N s/m], not negative, or a `Curve` of the force [N] over dl/dt [m/s]
    free_length [m], not negative; preload [N]

    While both points are at one place the force has no direction, and is zero.
    """

    name: str
    i: str
    j: str
    stiffness: float | Curve
    damping: float | Curve = 0.0
    free_length: float = 0.0
    preload: float = 0.0

    def __post_init__(self) -> None:
        who = f"spring {self.name!r}"
        check_number_or_curve(self.stiffness, f"{who}: stiffness")
        check_damping(self.damping, f"{who}: damping")
        check_number(self.free_length, f"{who}: free_length", least=0.0)
        check_number(self.preload, f"{who}: preload")
        if self.i == self.j:
            raise InputError(f"{who} has length zero: both its ends are at {self.i!r}")


@dataclass(frozen=True)
class Bushing:
    """An elastic bearing in six directions between markers i and j; it pushes j back to i.

    Displacement d (3,) [m] of j from i in the axes of i, and the rotation vector psi (3,) [rad] that turns the axes of i
    into those of j (finite: angle times axis, less than half a turn). Force and moment are the generalised forces of
    (d, psi), so that a bushing without damping conserves energy however far it is turned:

        (F, M) = -stiffness (d, psi) - damping (d_dot, psi_dot) + preload

    stiffness : (6, 6) symmetric, its diagonal (6,), or six entries of which each is a number or a `Curve` of the force over
                its displacement [N/m, N m/rad]
    damping   : (6, 6) symmetric without negative eigenvalues, or its diagonal (6,) [N s/m, N m s/rad]
    preload   : (6,) force [N] and moment [N m] on j at rest
    axes, axes_j : the axes on i and on j as (3, 3) frames (columns) or as (3,) third axes, in the axes of their bodies;
                axes_j by default equal to axes
    """

    name: str
    i: str
    j: str
    stiffness: Any
    damping: Any = (0.0,) * 6
    preload: Any = (0.0,) * 6
    axes: Any = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    axes_j: Any = None

    def __post_init__(self) -> None:
        who = f"bushing {self.name!r}"
        check_symmetric(stiffness_matrix(self), f"{who}: stiffness")
        D = damping_matrix(self)
        check_symmetric(D, f"{who}: damping")
        if np.linalg.eigvalsh(D).min() < -1e-12 * np.abs(D).max():
            raise InputError(f"{who}: damping has the negative eigenvalue {np.linalg.eigvalsh(D).min():g}")
        check_array(self.preload, (6,), f"{who}: preload")
        bushing_frames(self)
        if self.i == self.j:
            raise InputError(f"{who} ties {self.i!r} to itself")


def stiffness_matrix(bushing: Bushing) -> Array:
    """(6, 6) linear stiffness; zero where a curve is given."""
    return _six_by_six([0.0 if isinstance(k, Curve) else k for k in bushing.stiffness], bushing, "stiffness")


def damping_matrix(bushing: Bushing) -> Array:
    """(6, 6) damping."""
    return _six_by_six(bushing.damping, bushing, "damping")


def bushing_curves(bushing: Bushing) -> list[Curve | None]:
    """The curve of each of the six directions, None where the stiffness is a number."""
    return [k if isinstance(k, Curve) else None for k in bushing.stiffness]


def bushing_frames(bushing: Bushing) -> tuple[Array, Array]:
    """The axes on i and j, (3, 3) each, columns, in the axes of their bodies."""
    on_i = triad(bushing.axes, f"bushing {bushing.name!r}: axes")
    if bushing.axes_j is None:
        return on_i, on_i
    return on_i, triad(bushing.axes_j, f"bushing {bushing.name!r}: axes_j")


def _six_by_six(value: Any, bushing: Bushing, what: str) -> Array:
    who = f"bushing {bushing.name!r}: {what}"
    shape = (6, 6) if np.ndim(value) == 2 else (6,)
    array = check_array(value, shape, who)
    return array if array.ndim == 2 else np.diag(array)


# ---- guards -------------------------------------------------------------------------------------------------------


def check_number(value: Any, what: str, least: float = -np.inf) -> None:
    """InputError unless the value is a finite number, not below `least`."""
    if not isinstance(value, (int, float, np.floating, np.integer)) or not np.isfinite(value):
        raise InputError(f"{what} must be a finite number, not {value!r}")
    if value < least:
        raise InputError(f"{what} is {value:g}; it must not be below {least:g}")


def check_positive(value: Any, what: str) -> None:
    """InputError unless the value is a finite number above zero."""
    check_number(value, what)
    if value <= 0:
        raise InputError(f"{what} is {value:g}; it must be positive")


def check_function(value: Any, what: str, least: float = -np.inf) -> None:
    """InputError unless the value is a function of time or a finite number, not below `least`."""
    if isinstance(value, (int, float, np.floating, np.integer)):
        check_number(value, what, least)
    else:
        as_time_function(value, what)


def check_number_or_curve(value: Any, what: str) -> None:
    """InputError unless the value is a finite number or a `Curve`."""
    if not isinstance(value, Curve):
        check_number(value, what)


def check_damping(value: Any, what: str) -> None:
    """InputError for damping that feeds energy: a negative number, or a curve whose force is not along the velocity."""
    if not isinstance(value, Curve):
        check_number(value, what, least=0.0)
    elif (value.at * value.values < 0).any():
        at = value.at[np.argmin(value.at * value.values)]
        raise InputError(f"{what}: at the velocity {at:g} the curve has a force of the other sign, which feeds energy")


def check_array(value: Any, shape: tuple[int, ...], what: str) -> Array:
    """The value as an array of this shape; InputError when it is none, or not finite."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{what} must be numbers of shape {shape}, not {value!r}") from None
    if array.shape != shape:
        raise InputError(f"{what} must have the shape {shape}, not {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{what} holds values that are not finite")
    return array


def check_symmetric(matrix: Array, what: str) -> None:
    """InputError unless the matrix is symmetric."""
    off = np.abs(matrix - matrix.T).max()
    if off > 1e-9 * np.abs(matrix).max():
        raise InputError(f"{what} must be symmetric (it is off by {off:g}); other matrices make or lose energy")
