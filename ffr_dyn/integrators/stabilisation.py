"""How index-1 equations are kept on their constraints.

Twin: none, data.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ffr_prep.common.errors import InputError

LARGE_GAIN = 1.0  # Baumgarte's, times the step: RK4 bears 2.79, ROS2 and ROS3 0.9


@dataclass(frozen=True)
class Projection:
    """Positions and velocities are projected, in the norm of the mass matrix, whenever Phi exceeds `tolerance`
    (or its rate a hundred times that). Costs nothing while the constraints hold. (Eich 1993.) Singular positions are stepped
    over (see `ffr_dyn.kernels.singular_positions`).

    tolerance : of Phi [m, -], positive. What a projection moves a stiff body by appears in its reactions, as stiffness times
                tolerance: 1e-9 m moved forces by up to 1e-3 of their range. So `forward` closes to 1e-11, unless another
                tolerance than this default is given, and to 1e-8 of the accuracy where it finds the step

    Raises InputError for a tolerance that is not positive.

    >>> result = fd.forward(scene, end=1.0, output_step=0.01, stabilisation=fd.Projection(1e-12))
    """

    tolerance: float = 1e-9

    def __post_init__(self) -> None:
        if not 0 < self.tolerance < math.inf:
            raise InputError(f"the tolerance of the projection is {self.tolerance:g}; it must be positive")


@dataclass(frozen=True)
class Baumgarte:
    """Phi_ddot + 2 alpha Phi_dot + beta^2 Phi = 0 in place of Phi_ddot = 0 (Baumgarte 1972).

    alpha, beta : [1/s], positive; beta = alpha is critical damping. Gains near 1 / step make any method unstable.

    Raises InputError for gains that are not positive.

    >>> result = fd.forward(scene, end=1.0, output_step=0.01, method=fd.RK4(1e-4), stabilisation=fd.Baumgarte(20.0, 20.0))
    """

    alpha: float
    beta: float

    def __post_init__(self) -> None:
        for name, gain in (("alpha", self.alpha), ("beta", self.beta)):
            if not 0 < gain < math.inf:
                raise InputError(
                    f"Baumgarte's gain {name} is {gain:g} 1/s; it must be positive: alpha = beta = 0.1 / step serves"
                )


@dataclass(frozen=True)
class Drifting:
    """No stabilisation: the drift is reported, not held.

    >>> result = fd.forward(scene, end=1.0, output_step=0.01, method=fd.RK4(1e-4), stabilisation=fd.Drifting())
    """


Stabilisation = Projection | Baumgarte | Drifting


def gains(stabilisation: Stabilisation) -> tuple[float, float, float]:
    """(alpha, beta, tolerance) as the kernels take them."""
    if isinstance(stabilisation, Projection):
        return 0.0, 0.0, stabilisation.tolerance
    if isinstance(stabilisation, Baumgarte):
        return stabilisation.alpha, stabilisation.beta, 0.0
    return 0.0, 0.0, 0.0


def excess_of_gains(given: tuple[float, float, float], step: float) -> str:
    """Why gains (alpha, beta, tolerance) lose a run of this step [s], and what gains would do; empty where they would."""
    gain = max(given[:2])
    if not gain * step > LARGE_GAIN:
        return ""
    return (
        f"Baumgarte's gains of {gain:.3g} 1/s are too large for a step of {step:.3g} s: keep them below "
        f"{LARGE_GAIN / step:.3g} 1/s, or use projection"
    )
