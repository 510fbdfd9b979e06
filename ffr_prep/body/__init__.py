"""The reduced flexible body: the one object that passes from `ffr_prep` to `ffr_dyn`.

A body is a small, immutable set of arrays: inertia integrals over the mass, modal frequencies, interfaces with
their mode shapes, and a surface to draw. This package imports numpy and the standard library only, so a simulation
needs neither a mesher nor a finite-element library.

Notation (SI units): the position of a material point in the body frame is  u_bar = u_0 + Phi q,  with the undeformed
position u_0 [m], the mass-orthonormal basis Phi (Phi^T M Phi = I, Phi^T K Phi = diag(omega2)) and the elastic
coordinates q (n,) [m sqrt(kg)]. Integrals over the mass carry the suffix ``_dm``; their integrand is their name.
The numbered invariants I1...I9 and Shabana's S_bar family are read-only views of these integrals.
"""

from ffr_prep.body.accelerations import PRODUCTS
from ffr_prep.body.chain import damping_ratio, free_vibrations
from ffr_prep.body.constructors import check_point, recombined, rigid_body, with_point
from ffr_prep.body.cut_error import CUT_ERROR, cut_doubt, cut_error, cut_errors_of, cut_stress_doubt
from ffr_prep.body.damping import Damping, damped, with_damping
from ffr_prep.body.fewer_modes import CUT_PAIR, KEPT, cut_pair, cut_twins, paired, truncated, with_cut
from ffr_prep.body.file import MAKE_AGAIN, content_hash, load_body, save_arrays, save_body, surface_arrays, surface_of
from ffr_prep.body.frame_change import interface_motions, mass_of_motions
from ffr_prep.body.mean_axis import FrameMarker, MeanAxisForm, idle_loads, mean_axis_form, mean_axis_surface
from ffr_prep.body.mesh_error import (
    CONVERTED_FROM,
    MESH_ERROR,
    TRUNCATION_ERROR,
    errors_of_modes,
    in_fewer_shapes,
    made_of_plates,
    mesh_doubt,
    mesh_errors_of,
    modes_doubt,
)
from ffr_prep.body.movable import immovable, least_inertia
from ffr_prep.body.reduced import (
    SECTION_FORCES,
    TENSOR,
    BeamForces,
    BodyError,
    FlexibleBody,
    Interface,
    QuadraticField,
    Surface,
    axial,
    cut_names,
    remembered,
)
from ffr_prep.body.second_order import (
    at_places,
    compressed,
    compressed_beside,
    displacements,
    linear_surface,
    pair_values,
    reach_of,
    recoordinated,
    some_points,
    values,
)
from ffr_prep.body.steady_stress import (
    STEADY_STRESS,
    WITHOUT_SHEAR,
    largest_von_mises,
    left_out_stress,
    of_fewer_shapes,
    of_plane,
    shear_doubt,
    steady_stress_doubt,
)
from ffr_prep.body.units_doubt import ratio_doubts, units_doubts

__all__ = [
    "CONVERTED_FROM",
    "CUT_ERROR",
    "CUT_PAIR",
    "KEPT",
    "MAKE_AGAIN",
    "MESH_ERROR",
    "PRODUCTS",
    "SECTION_FORCES",
    "STEADY_STRESS",
    "TENSOR",
    "TRUNCATION_ERROR",
    "WITHOUT_SHEAR",
    "BeamForces",
    "BodyError",
    "Damping",
    "FlexibleBody",
    "FrameMarker",
    "Interface",
    "MeanAxisForm",
    "QuadraticField",
    "Surface",
    "at_places",
    "axial",
    "check_point",
    "compressed",
    "compressed_beside",
    "content_hash",
    "cut_doubt",
    "cut_error",
    "cut_errors_of",
    "cut_names",
    "cut_pair",
    "cut_stress_doubt",
    "cut_twins",
    "damped",
    "damping_ratio",
    "displacements",
    "errors_of_modes",
    "free_vibrations",
    "idle_loads",
    "immovable",
    "in_fewer_shapes",
    "interface_motions",
    "largest_von_mises",
    "least_inertia",
    "left_out_stress",
    "linear_surface",
    "load_body",
    "made_of_plates",
    "mass_of_motions",
    "mean_axis_form",
    "mean_axis_surface",
    "mesh_doubt",
    "mesh_errors_of",
    "modes_doubt",
    "of_fewer_shapes",
    "of_plane",
    "pair_values",
    "paired",
    "ratio_doubts",
    "reach_of",
    "recombined",
    "recoordinated",
    "remembered",
    "rigid_body",
    "save_arrays",
    "save_body",
    "shear_doubt",
    "some_points",
    "steady_stress_doubt",
    "surface_arrays",
    "surface_of",
    "truncated",
    "units_doubts",
    "values",
    "with_cut",
    "with_damping",
    "with_point",
]
