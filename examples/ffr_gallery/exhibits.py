"""A gallery of instability: each exhibit shows a method failing where theory says it does, and a remedy holding.

An exhibit is a module with one function, which computes it and returns an `Exhibit`: predictions and measurements, proofs
of failure and remedy, and diagrams. `SHORT` has the long ones cut to seconds.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from ffr_gallery.aligned_cranks import aligned_cranks
from ffr_gallery.baumgarte import baumgarte
from ffr_gallery.bent_in_parts import bent_in_parts
from ffr_gallery.coarse_rows import coarse_rows
from ffr_gallery.drift import drift
from ffr_gallery.euler_angles import euler_angles
from ffr_gallery.exhibit import Exhibit
from ffr_gallery.explicit_limit import explicit_limit
from ffr_gallery.fast_driver import fast_driver
from ffr_gallery.index3_conditioning import index3_conditioning
from ffr_gallery.joint_damper import joint_damper
from ffr_gallery.joint_friction import joint_friction
from ffr_gallery.large_deformation import large_deformation
from ffr_gallery.long_time_energy import long_time_energy
from ffr_gallery.numerical_damping import numerical_damping
from ffr_gallery.redundant_bricard import redundant_bricard
from ffr_gallery.reference_conditions import reference_conditions
from ffr_gallery.shared_step import shared_step
from ffr_gallery.short_stop import short_stop
from ffr_gallery.singular_four_bar import singular_four_bar
from ffr_gallery.spin_up import spin_up
from ffr_gallery.start_shock import start_shock
from ffr_gallery.stiff_bushing import stiff_bushing
from ffr_gallery.stiffening_by_load import stiffening_by_load

__all__ = ["EXHIBITS", "SHORT", "Exhibit"]

EXHIBITS: dict[str, Callable[[], Exhibit]] = {
    "explicit-limit": explicit_limit,
    "index3-conditioning": index3_conditioning,
    "drift": drift,
    "baumgarte": baumgarte,
    "euler-angles": euler_angles,
    "singular-four-bar": singular_four_bar,
    "redundant-bricard": redundant_bricard,
    "spin-up": spin_up,
    "reference-conditions": reference_conditions,
    "large-deformation": large_deformation,
    "numerical-damping": numerical_damping,
    "long-time-energy": long_time_energy,
    "joint-damper": joint_damper,
    "joint-friction": joint_friction,
    "stiff-bushing": stiff_bushing,
    "short-stop": short_stop,
    "start-shock": start_shock,
    "fast-driver": fast_driver,
    "coarse-rows": coarse_rows,
    "shared-step": shared_step,
    "aligned-cranks": aligned_cranks,
    "stiffening-by-load": stiffening_by_load,
    "bent-in-parts": bent_in_parts,
}
SHORT: dict[str, Callable[[], Exhibit]] = {
    "drift": partial(drift, steps=20_000),
    "long-time-energy": partial(long_time_energy, turns=1_000),
}
