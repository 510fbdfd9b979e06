"""Tables that the kernels read (`Model`, constant, made by `ffr_dyn.compile.scene_tables`) and write (`Work` and others, by
`ffr_dyn.compile.workspace`); no objects inside.

Bodies are numbered 0 ... B-1; number B is the ground (identity rotation, no coordinates). Positions of a body are
x = [R (3), p (4), q (n)], velocities v = [R_dot (3, global), omega_bar (3), q_dot (n)]; accelerations and generalised
forces are [a (3, body axes: a = A^T R_ddot), omega_bar_dot (3), q_ddot (n)].

Symmetric 3 x 3 tensors are stored as xx, yy, zz, xy, xz, yz; six of them and the axial vector make nine numbers.
Tables are grouped so that a kernel is handed only the group it works on (which also keeps compilation short).

Twin: none, data.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from ffr_prep.common.brief import brief_tuple

Vector = np.ndarray  # of numbers, as an argument of an entry point: its size follows from the tables
# Arrays of numbers and of integers by their number of axes: compiled code is told here what it finds at an address.
F1 = Annotated[np.ndarray, ("float64", 1)]
F2 = Annotated[np.ndarray, ("float64", 2)]
F3 = Annotated[np.ndarray, ("float64", 3)]
F4 = Annotated[np.ndarray, ("float64", 4)]
I1 = Annotated[np.ndarray, ("int64", 1)]
I2 = Annotated[np.ndarray, ("int64", 2)]

# The words of constraints, in the order of their numbers in `Rows.kind` (see `ffr_dyn.kernels.rows`).
WORDS = ("coincidence", "dot-1", "dot-2", "driven-angle", "distance", "relation")
# In place of one: the coordinate of a stiff force (see `ffr_dyn.kernels.forces.implicit`).
FORCED = len(WORDS)
ANGLE, STROKE, LENGTH = 0, 1, 2
BODY, GLOBAL, SIX = 3, 4, 5
# The places of forces by the words of `ffr_dyn.scene.forces.places`: coordinates, and axes.
WAYS = {"angle": ANGLE, "stroke": STROKE, "length": LENGTH, "body": BODY, "global": GLOBAL, "six": SIX}

# Columns of `Loads.row`: number of the kernel in `Tables.forces`; where the numbers of the place and of the law begin in
# `data`, and what is measured in `LoadWork.measured`; markers i and j, or the body; one of `WAYS`; time function or -1; first
# of the user's values or -1; block and first lane of its rows where it is implicit, or -1.
KERNEL, PLACE, LAW, MEASURED, END_I, END_J, WAY, FUNCTION, USER, BLOCK, LANE = range(11)

OK, SINGULAR_BODY, SINGULAR_CONSTRAINT, NOT_FINITE, USER_FAILED, NOT_CONVERGED, STEP_TOO_SMALL = range(7)

LANES = 8  # rows of a joint side by side (see `ffr_dyn.kernels.simd.lanes`)
STRIPS = 4  # rows of eight that products of a body are found in at a time

# What the plan of a table in blocks begins with (see `ffr_dyn.compile.symmetry_blocks`): how many blocks; how the products
# are found; the first sum that is multiplied by q_dot, too; how many sums, runs, and runs of what is multiplied by q_dot.
BLOCKS, HOW, EARLY, SUMS, RUNS, LATE_RUNS, HEAD = range(7)
# Sums are the products, in their order; are brought to their places; coordinates are brought together, too.
WHOLE, SORTED, MIXED = range(3)

# Which markers are brought up to date: those that joints or loads use, those of joints, all.
IN_USE, OF_JOINTS, ALL = 0, 1, 2

EVERY_LOAD = -1  # in place of the number of one

# Near a singular position (`ffr_dyn.kernels.singular_positions`) the rows become dependent, and a violation eta of the
# constraints throws the motion from its branch when it comes closer than about eta^(1/3). So on the approach (`independence`
# below NEAR) the violation is held far lower, and at the position itself (below AT) it is left alone: along the direction
# that is about to be free a correction would be the violation divided by the distance.
NEAR, AT = 1e-2, 1e-6
TIGHTER = 1e-4


# Columns of `Bodies.where`.
N = 0  # number of elastic coordinates
IN_X, IN_V, IN_Q = 1, 2, 3  # first of the body in x, in v, among all elastic coordinates
IN_PP_DM = 4  # in PP_dm, or -1 where that vanishes
NORMAL = 5  # the body axis along the normal of a planar scene, or -1
IN_SHARED = (
    6  # in omega2 and the other rows by coordinate, which equal bodies share: many stay in the processor's cache
)
PP_PLAN = 7  # in `blocks`
IN_DAMPING = 8  # in coupled_damping, or -1 where damping is diagonal


class Bodies(NamedTuple):
    """B bodies, E elastic coordinates in all."""

    where: I2  # (B + 1, 9) sizes of a body and where its parts begin, by the columns above
    mass: F1  # (B,)
    moments: F2  # (B, 9) first moment r_dm (3), second moment rr_dm (6)
    P_dm: F1  # pooled; per body 3 rows of n
    rP_dm: F1  # pooled; per body 9 rows of n: six symmetric parts, three axial components (I4)
    # pooled; per body n x 9 x n: for q_i the same nine rows over j (last three: I5), second-order moments among them, in
    # blocks; in the plane n x 3 x n: two symmetric parts in it, and the axial component across
    PP_dm: F1
    omega2: F1  # pooled, n of all bodies that differ
    two_zeta_omega: F1  # likewise: the diagonal of the damping matrix and, with it, the sums over what is beside it
    coupled_damping: F1  # pooled; per body n x n of what that diagonal has too much, where damping couples coordinates
    blocks: I1  # pooled; how PP_dm is stored (see `ffr_dyn.compile.symmetry_blocks`)


# Columns of `Markers.second`: whether the axes of the marker are asked for; how many of its six rows are of second order;
# where they begin in `bending`, or -1; where their plan begins in `blocks`.
TURNS, COUNT, IN_BENDING, BEND_PLAN = range(4)


class Markers(NamedTuple):
    """M markers: all interfaces of all bodies, then the ground's points."""

    body: I1  # (M,)
    u: F2  # (M, 3) undeformed position in the body frame (ground: global)
    phi: F1  # pooled, shared by equal linear bodies; per marker 6 rows of n: phi_t, phi_r
    start: I1  # (M,) in phi
    second: I2  # (M, 4) by the columns above
    # pooled; per marker of a second-order body the rows of phi that bend, and over q_i those of -K, in blocks: in space the
    # first COUNT of the six, in the plane displacements in it and the rotation across
    bending: F1
    blocks: I1  # pooled; how they are stored
    active: I1  # markers that joints or loads use, updated at every evaluation
    joint: I1  # markers of bodies that joints use


class Rows(NamedTuple):
    """C constraint rows in K blocks (joints, drivers), blocks in elimination order."""

    kind: I1  # (C,)
    axes: F3  # (C, 6, 3) axis on i, second axis on i of an angle, axis on j; coincidence: component in [0, 0];
    # a relation has three such axes for each of its two joint coordinates
    relation: F2  # (C, 5) of a relation: factor and kind of both coordinates, spacing of equivalent values or 0
    function: I1  # (C,) time function or -1
    start: I1  # (K + 1,) first row of each block
    forced: I1  # (K,) the first row of stiff forces in each block, which are its last, or the start of the next block
    reaction: I1  # (K,) place of each block among the reactions of results, -1 for one of forces alone
    marker: I2  # (K, 2 or 4) markers i, j of a joint, or of both joints of a relation; -1 where there is none
    first: I2  # likewise: whether no block before has the marker


# Columns of `Pattern.pair`: a block and its side, an earlier block and its side, the start of the block of S that they make,
# and the number in `phiphi` of what elastic coordinates couple.
LATER, LATER_SIDE, EARLIER, EARLIER_SIDE, TARGET, PHIPHI = range(6)


class Pattern(NamedTuple):
    """Assembly and factorisation of the multiplier matrix, fixed per topology."""

    pair_body: I1  # (P,) the body that couples two block sides
    pair: I2  # (P, 6) in order of the later block
    sample: I1  # a pair of each number in `phiphi`, which equal pairs share
    pair_start: I1  # (K + 1,) the first pair of each later block
    reach: I1  # (K,) last block that the columns of a block and of those before it reach
    diagonal: I1  # (K,) start of the diagonal block in S
    column_start: I1  # (K + 1,)
    column: I2  # (L, 2) row block of each off-diagonal block and its start
    update_start: I1  # (K + 1,)
    update: I1  # (U,) targets of the updates by column, in loop order


# Of a break of functions of time [s]: the last time before it, the first behind it, and that at which a row there looks.
UNTIL, SINCE, SEEN = range(3)
# Of a step (`again`): functions of time break nearby, what the method keeps from earlier steps is worth nothing; or no step,
# but the state at a time within the last one.
RESTART, WITHIN = 2, 3


class Functions(NamedTuple):
    """F time functions: kind and numbers (see `functions`)."""

    kind: I1  # (F,)
    start: I1  # (F + 1,)
    data: F1  # pooled
    breaks: F2  # (K, 3) of functions that are given in pieces, in order, see `UNTIL` and what follows it
    switches: I2  # (J, 2) functions a, b: something breaks where a - b changes sign; where a does, where b is -1


class Loads(NamedTuple):
    """F applied loads, in the order in which they are applied, with O measured numbers in all."""

    row: I2  # (F, 11) see `KERNEL` and what follows it
    data: F1  # pooled numbers of places, laws and curves
    initial: F1  # (O,) what is measured, before the start: angles count their turns from there
    kinked: (
        I2  # (K, 2) the force of each kink (see `ffr_dyn.kernels.forces.kinks`), and which of its coordinates has it
    )
    kinks: F2  # (K, 4) a, b, c, d: it is where a + b coordinate + c rate + d coordinate rate is zero


class Model(NamedTuple):
    """Constant tables of a scene."""

    gravity: F1  # (3,) [m/s^2]
    base: I1  # (3,) time function of the base's acceleration or -1
    relaxation: float  # relative, added to the diagonal of the multiplier matrix where rows depend on others; or 0
    bodies: Bodies
    markers: Markers
    rows: Rows
    pattern: Pattern
    functions: Functions
    loads: Loads
    user_address: int  # C callback that evaluates the user's Python functions
    user_count: int
    stiff_count: int  # rows of stiff forces


class BodyWork(NamedTuple):
    """Per body, filled by `inertia` and `factorise`."""

    A: F3  # (B + 1, 3, 3)
    omega: F2  # (B + 1, 3) body axes
    s: F2  # (B, 3) integral of u_bar dm
    J: F3  # (B, 3, 3)
    inverse: F2  # (B, 2) 1 / mass, 1 / trace of J
    # First column of a body in g and l: bodies share the space, so that many of them stay in the processor's cache, but for
    # methods that need the terms of all bodies after an evaluation.
    terms: I1  # (B,)
    g: F1  # pooled; G_j: six symmetric rows of n, three axial ones; in the plane two and one
    l: F1  # pooled; three rows of n, integral of u_dot x phi_j dm; in the plane one  # noqa: E741
    sorted: F1  # scratch of products: sums, q and q_dot by family; in the plane, undeformed moments
    H: F1  # (3 E,) the axial rows of G_j
    # (B, 6, 6) Cholesky factor of the Schur complement, reciprocal diagonal; with s and J it is constant for a rigid body,
    # and not positive in [0, 0] where that has none
    L: F3
    f: F1  # (V,) right-hand side in body axes
    acc: F1  # (V,) solution in body axes
    dinv: F1  # as omega2: 1 / (1 + implicit terms); ones for explicit methods
    T: F3  # (B, 3, 3) the part of L that depends on dinv alone: the factor of m I - P_dm dinv P_dm^T
    # (B, 6) reduced forces L^-1 (f_rigid - C dinv f_elastic), C = [P_dm; H], less those of the reactions; dinv f_elastic,
    # likewise, is where the elastic accelerations will be
    rigid: F2
    more: F1  # (V,) scratch
    settled: F1  # (V,) scratch where damping couples elastic coordinates
    solved: F1  # (V,) scratch where rows depend on one another
    search: F2  # (2, V) likewise


class MarkerWork(NamedTuple):
    """Per marker, filled by `update_marker`."""

    body: I1  # (M,)
    A: F3  # (B + 1, 3, 3) of the bodies
    omega: F2  # (B + 1, 3) of the bodies
    r: F2  # (M, 3) global position
    rd: F2  # (M, 3) global velocity
    rb: F2  # (M, 3) quadratic velocity part of the global acceleration
    u: F2  # (M, 3) position in body axes
    phi: F1  # as Markers.phi, at q: d(displacement) / dq and d(rotation vector) / dq
    kept: F1  # those of another moment, for methods that need both
    R: F3  # (M, 3, 3) elastic rotation
    T: F3  # (M, 3, 3) angular velocity per rate of the rotation vector, body axes
    spin: F2  # (M, 3) angular velocity, body axes
    turning: F2  # (M, 3) quadratic velocity part of the angular acceleration, body axes
    six: F2  # (3, 6) scratch: elastic motion, rate, quadratic velocity part of the second derivative
    bent: F1  # scratch of one marker: rows at q, and their rates
    sorted: F1  # scratch of products by blocks


class LoadWork(NamedTuple):
    """The measurements of the kernels of forces, and their scratch."""

    reference: F1  # (O,) what was measured at the last accepted state, from which angles count their turns
    measured: F1  # (O,) of a coordinate: value, rate, force; of a bushing: six of each
    axes: F4  # (2, 4, 3, 3) scratch of a bushing
    turn: F3  # (3, 3, 3) scratch of a bushing
    curved: F1  # (6,) scratch of a bushing
    f: F1  # (V,) scratch of the powers
    passing: F2  # (K, 4) coordinate and rate at the start and the end of a step, of the force of each kink
    x: F1  # (X,) the state at the start of that step; no numbers where no force has a kink
    v: F1  # (V,)


class RowWork(NamedTuple):
    """Per constraint row; D = 2 sides (marker i, marker j), or 4 where there are relations."""

    Phi: F1  # (C,)
    nu: F1  # (C,) time derivative of Phi
    gamma: F1  # (C,)
    lam: F1  # (C,)
    left: F1  # (C,) scratch
    reacted: F1  # (C,) scratch where rows depend on one another
    search: F2  # (5, C) likewise
    scale: F1  # (8 K,) what the entry of S on the diagonal is at least
    least: F1  # (8 K,) what it is taken for where it is less
    compliance: F1  # (8 K,) of the rows of stiff forces 1 / (gamma h d + (gamma h)^2 k)
    pull: F1  # (8 K,) likewise gamma h k / (gamma h d + (gamma h)^2 k)
    relief: F1  # (8 K,) what rows of stiff forces before have taken from the diagonal of S
    along: (
        F2  # (4, C) of stiff forces: coordinate, rate, quadratic velocity part of its second derivative, 1 of a length
    )
    begun: F2  # (2, C) coordinate and rate at the start of the step
    grown: F3  # (3, 2, C) rates of both by the stages before
    held: F2  # (3, C) scratch
    # (K D, 9, 8) per side of a block: coefficients of point velocity, omega_bar, elastic rotation rate, its rows in lanes
    jac: F3
    kept: F3  # those of another moment, for methods that need both
    X: F1  # per block and side twelve rows of lanes: rigid part after elimination times L^-1, elastic part
    Y: F1  # (12 * 8,) scratch
    pivots: F1  # (8 K,) reciprocal pivots of S
    step: F1  # (8 K,) multipliers, the rows of each block in a row of lanes
    wrench: F1  # (6,) scratch
    P: F2  # (M, 36) [P_dm; H] dinv phi^T; of a planar body nine numbers
    phiphi: F2  # (pairs that differ, 36) phi dinv phi'^T; of a planar body nine numbers
    S: F1  # pooled blocks, rows of lanes (see `ffr_dyn.kernels.multiplier_solver`)


# Numbers of `Work.info`.
FAILED, EVALUATIONS, PROJECTIONS = range(3)
# Numbers of `Work.implicit`: what a rate and a displacement add to the coordinate of a stiff force, per change of the
# acceleration; how far ahead a one-sided force looks [s]; whether its slopes belong to this state, or to one before; the time
# that a stage of a W-method goes on by, as by its displacements.
BY_RATE, BY_PLACE, AHEAD, FRESH, BY_TIME = range(5)
# Numbers of `Work.drift`.
PHI, PHI_DOT, OPENED, MOMENT = range(4)
# Numbers of `Work.independence` (see `ffr_dyn.kernels.singular_positions`).
HERE, LEAST, WHEN, START, END, AT_START, CLOSEST, AT_LAST, LOW, LOW_AT, HIGH, PASSED, FIRST_PASSED = range(13)
MOST_PASSED = 64


class Work(NamedTuple):
    """Scratch of one evaluation; nothing in it is read before it is written, except what `prepare` makes."""

    bodies: BodyWork
    markers: MarkerWork
    rows: RowWork
    loads: LoadWork
    field: F1  # (3,) gravity as the base feels it
    vd: F1  # (V,)
    y: F2  # (2, longest body)
    functions: F2  # (F, 3) value, first and second time derivative
    earlier: F2  # (F, 3) the same where the search for a break begins
    user: F1  # (user_count,)
    diagonal: F1  # (1,) gamma h of the elastic diagonal that is in place (see `entry_points.set_diagonal`), or -1
    implicit: F1  # (5,) by the names above
    info: I1  # (3,) body or row that failed, how many evaluations, how many projections
    drift: F1  # (4,) largest |Phi| and |Phi_dot| met; the row of the first, and when it was [s]
    # (76,) least share of a row that others do not contain: now, least so far, and when; of a step its start and end [s],
    # the share at its start, the least of its stages, that at the start of the step before (`kernels.singular_positions`);
    # the least since it was high, when, and the largest since it was low; how many singular positions were passed, and when
    independence: F1
    # (65, X) positions closest to the singular ones that were passed, the last of what may become one; no rows where it
    # takes no positions to tell them from those where only the rows that were kept depend on one another
    passed: F2


class Stages(NamedTuple):
    """The memory of an integrator: within a step, and from step to step."""

    x: F2  # (stages, X)
    v: F2  # (stages, V)
    rows: F2  # (row stages, C)
    target: F1  # (C,)
    kept_x: F2  # (2, X) states at the starts of this step and of the one before; no rows where none is done again
    kept_v: F2  # (2, V)
    numbers: F1  # the method's own settings, and what it keeps in single numbers


# Numbers of `Clock.time`, `Clock.steps`, `Clock.gains`.
H, SPACING, FROM, UP_TO = range(4)
NEXT, PER_ROW, FILLED = range(3)
ALPHA, BETA, TOLERANCE = range(3)


class Clock(NamedTuple):
    """Which steps are to be done; step number k begins at the start of the run + k h."""

    time: F1  # (4,) step h [s]; spacing of the numbered steps, which is h unless the method chooses its steps; times within
    # which functions of time are looked at, so that a step sees none of what lies behind a break
    found: F1  # (3,) the last break that was looked for, infinite where there was none
    steps: I1  # (3,) number of the next step, steps from row to row, rows filled
    gains: F1  # (3,) Baumgarte's alpha and beta, tolerance of the projection


class Control(NamedTuple):
    """Of a method that chooses its steps; empty arrays for the others.

    The state runs ahead of the rows: `x`, `v` are where the last step began, and rows between are interpolated.
    """

    numbers: F1  # step to be tried, time of the state, time where the last step began, last error, relative tolerance,
    # order of the error estimate, least step, longest step
    counts: I1  # (2,) steps accepted, steps tried again
    weight_x: F1  # (X,) absolute tolerances of positions
    weight_v: F1  # (V,) of velocities; negative where the velocity times the step counts
    x: F1  # (X,)
    v: F1  # (V,)
    held_x: F1  # (X,) scratch
    held_v: F1  # (V,)


# Numbers of `Control.numbers`.
STEP, NOW, BEFORE, ERROR, RELATIVE, ORDER, SHORTEST, LONGEST = range(8)


class Tables(NamedTuple):
    """All that entry points read and write while a scene is integrated; they are given its address."""

    address: int  # of these tables, packed (see `ffr_dyn.kernels.simd.table_address`)
    entry_points: I1  # their addresses, by number (see `ffr_dyn.kernels.simd.entry_point`)
    forces: I1  # addresses of the compiled kernels of forces, by number
    model: Model
    work: Work
    stages: Stages
    clock: Clock
    control: Control
    x: F1  # the state that is integrated
    v: F1


class Record(NamedTuple):
    """The rows kept of a run, one per output time."""

    time: F1  # (T,)
    x: F2  # (T, X)
    v: F2  # (T, V)
    vd: F2  # (T, V) d/dt of v
    r: F3  # (T, M, 3) marker positions
    rd: F3  # (T, M, 3) marker velocities
    reaction: F3  # (T, K, 6) by block: force, moment
    forces: F2  # (T, O) what is measured of forces
    functions: F3  # (T, F, 3) time functions and two derivatives
    power: F2  # (T, F)
    energy: F2  # (T, 3) kinetic, strain, gravity
    violation: F2  # (T, 2) largest |Phi|, |Phi_dot|


for _table in [value for value in vars().values() if isinstance(value, type) and hasattr(value, "_fields")]:
    _table.__repr__ = brief_tuple  # type: ignore[method-assign, assignment]  # instead of every number
