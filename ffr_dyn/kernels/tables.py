"""What the kernels read (`Model`, constant) and write (`Work`, scratch). Made by `ffr_dyn.equations`; no objects inside.

Bodies are numbered 0 ... B-1; number B is the ground (identity rotation, no coordinates). Positions of a body are
x = [R (3), p (4), q (n)], velocities v = [R_dot (3, global), omega_bar (3), q_dot (n)]; accelerations and generalised
forces are [a (3, body axes: a = A^T R_ddot), omega_bar_dot (3), q_ddot (n)].

Symmetric 3 x 3 tensors are stored as xx, yy, zz, xy, xz, yz; six of them and the axial vector make nine numbers.
Tables are grouped so that a kernel is handed only the group it works on (which also keeps compilation short).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

Array = np.ndarray

COINCIDENCE, DOT_1, DOT_2, DRIVEN_ANGLE, DISTANCE, RELATION = 0, 1, 2, 3, 4, 5
ANGLE, STROKE, LENGTH = 0, 1, 2
SPRING, FRICTION, ACTUATOR, SERVO, STOP = 0, 1, 2, 3, 4
AFFINE, GLOBAL = 0, 1

OK, SINGULAR_BODY, SINGULAR_CONSTRAINT, NOT_FINITE, USER_FAILED = 0, 1, 2, 3, 4


class Bodies(NamedTuple):
    """B bodies, E elastic coordinates in all."""

    where: (
        Array  # (B + 1, 8) n, first of the body in: x, v, elastic coordinates, PP_dm, stiffening; its number of loads;
        # the body axis along the normal of a planar scene, or -1
    )
    mass: Array  # (B,)
    moments: Array  # (B, 9) first moment r_dm (3), second moment rr_dm (6)
    P_dm: Array  # (3 E,) per body 3 rows of n
    rP_dm: Array  # (9 E,) per body 9 rows of n: six symmetric parts, three axial components (I4)
    PP_dm: Array  # pooled; per body n rows of 9 n: for q_i the same nine rows over j (last three: I5)
    omega2: Array  # (E,)
    two_zeta_omega: Array  # (E,)
    stiffening: Array  # pooled; per body loads x n x n, empty without geometric stiffening


class Markers(NamedTuple):
    """M markers: all interfaces of all bodies, then the ground's points."""

    body: Array  # (M,)
    u: Array  # (M, 3) undeformed position in the body frame (ground: global)
    phi: Array  # pooled; per marker 6 rows of n: phi_t, phi_r
    start: Array  # (M,) in phi
    load: Array  # (M,) number of the marker's first load in its body's stiffening, or -1
    active: Array  # markers that joints or loads use, updated at every evaluation
    joint: Array  # markers of bodies that joints use


class Rows(NamedTuple):
    """C constraint rows in K blocks (joints, drivers), blocks in elimination order."""

    kind: Array  # (C,)
    axes: Array  # (C, 6, 3) axis on i, second axis on i of an angle, axis on j; coincidence: component in [0, 0];
    # a relation has three such axes for each of its two joint coordinates
    relation: Array  # (C, 5) of a relation: factor and kind of both coordinates, spacing of equivalent values or 0
    function: Array  # (C,) time function or -1
    start: Array  # (K + 1,) first row of each block
    marker: Array  # (K, 2 or 4) markers i, j of a joint, or of both joints of a relation; -1 where there is none


class Pattern(NamedTuple):
    """Assembly and factorisation of the multiplier matrix, fixed per topology."""

    pair_body: Array  # (P,) the body that couples two block sides
    pair: Array  # (P, 5) later block, its side, earlier block, its side, start of the target block
    diagonal: Array  # (K,) start of the diagonal block
    column_start: Array  # (K + 1,)
    column: Array  # (L, 2) row block of each off-diagonal block and its start
    update_start: Array  # (K + 1,)
    update: Array  # (U,) targets of the updates by column, in loop order


class Functions(NamedTuple):
    """F time functions: kind and numbers (see `functions`)."""

    kind: Array  # (F,)
    start: Array  # (F + 1,)
    data: Array  # pooled


class Loads(NamedTuple):
    """W wrenches on markers, Z actions on coordinates, Y bushings, U spread loads."""

    wrench: Array  # (W, 3) marker, axes (0 global, 1 body), start in the user's values or -1
    value: Array  # (W, 6) force and moment
    function: Array  # (W, 6) factor by time function or -1
    action: Array  # (Z, 6) coordinate, marker i, marker j, law, start in data, time function or -1
    action_axes: Array  # (Z, 3, 3) f_i, g_i, f_j of an angle, or h_i of a stroke
    turn: Array  # (Z,) whole turns at the start [rad]
    bushing: Array  # (Y, 3) marker i, marker j, start in data
    frames: Array  # (Y, 2, 3, 3) axes on i and j, one a row
    spread: Array  # (U, 4) body, kind, start in data, time function
    data: Array  # pooled numbers of laws, curves, bushings and spread loads


class Model(NamedTuple):
    """Constant tables of a scene."""

    gravity: Array  # (3,) [m/s^2]
    base: Array  # (3,) time function of the base's acceleration or -1
    relaxation: float  # relative, added to the diagonal of the multiplier matrix where rows depend on others; or 0
    bodies: Bodies
    markers: Markers
    rows: Rows
    pattern: Pattern
    functions: Functions
    loads: Loads
    user_address: int  # C callback that evaluates the user's Python functions
    user_count: int


class BodyWork(NamedTuple):
    """Per body, filled by `inertia` and `factorise`."""

    A: Array  # (B + 1, 3, 3)
    omega: Array  # (B + 1, 3) body axes
    s: Array  # (B, 3) integral of u_bar dm
    J: Array  # (B, 3, 3)
    g: Array  # (9 E,) G_j: six symmetric rows, three axial rows H
    l: Array  # (3 E,) integral of u_dot x phi_j dm  # noqa: E741
    Cd: Array  # (6 E,) rows P_dm and H, times dinv
    L: Array  # (B, 6, 6) Cholesky factor of the Schur complement, reciprocal diagonal
    f: Array  # (V,) right-hand side in body axes
    acc: Array  # (V,) solution in body axes
    dinv: Array  # (E,) 1 / (1 + implicit terms); ones for explicit methods
    rigid: Array  # (B, 6) scratch
    elastic: Array  # (E,) scratch
    unstiffened: Array  # (E,) elastic right-hand side without geometric stiffening
    shift: Array  # (V,) part of acc that is no acceleration (corrections of an integrator's stage), body axes
    stiff: Array  # pooled like stiffening, n per load: K_load q
    load: Array  # (longest,) loads of one body


class MarkerWork(NamedTuple):
    """Per marker, filled by `update_marker`."""

    A: Array  # (M, 3, 3) of its body
    omega: Array  # (M, 3) of its body
    r: Array  # (M, 3) global position
    rd: Array  # (M, 3) global velocity
    rb: Array  # (M, 3) quadratic velocity part of the global acceleration
    u: Array  # (M, 3) position in body axes
    theta: Array  # (M, 3) elastic rotation phi_r q
    thetad: Array  # (M, 3)
    load: Array  # (M, 6) applied force and moment, body axes


class LoadWork(NamedTuple):
    """Per applied load, filled by `apply_loads`."""

    reference: Array  # (Z,) coordinates at the last accepted state, from which angles count their turns
    action: Array  # (Z, 3) coordinate, rate, force
    bushing: Array  # (Y, 18) displacement and rotation, their rates, force and moment
    axes: Array  # (2, 3, 3, 3) scratch of a bushing
    turn: Array  # (3, 3, 3) scratch of a bushing
    f: Array  # (V,) scratch of the powers
    load: Array  # (M, 6) scratch of the powers


class RowWork(NamedTuple):
    """Per constraint row; D = 2 sides (marker i, marker j), or 4 where there are relations."""

    Phi: Array  # (C,)
    nu: Array  # (C,) time derivative of Phi
    gamma: Array  # (C,)
    lam: Array  # (C,)
    step: Array  # (C,) change of lam
    scale: Array  # (C,) what the entry of S on the diagonal is at least
    jac: Array  # (C, D, 9) coefficients of point velocity, omega_bar, elastic rotation rate
    rr: Array  # (C, D, 6) rigid part after elimination of the elastic coordinates
    ww: Array  # (C, D, 6) L^-1 rr
    P: Array  # (M, 6, 6) [P_dm; H] dinv phi^T
    phiphi: Array  # (pairs, 6, 6) phi dinv phi'^T
    S: Array  # pooled blocks


class Work(NamedTuple):
    """Scratch of one evaluation; nothing in it is read before it is written, except `dinv` and what `prepare` makes."""

    bodies: BodyWork
    markers: MarkerWork
    rows: RowWork
    loads: LoadWork
    field: Array  # (3,) gravity as the base feels it
    vd: Array  # (V,)
    y: Array  # (2, longest body)
    functions: Array  # (F, 3) value, first and second time derivative
    user: Array  # (user_count,)
    info: Array  # (4,) integers: body or row that failed, evaluations, projections, step that failed
    drift: Array  # (2,) largest |Phi| and |Phi_dot| met
    independence: Array  # (3,) least share of a row that others do not contain: now, least so far, and when


class Stages(NamedTuple):
    """Scratch of an integrator."""

    x: Array  # (stages, X)
    v: Array  # (stages, V)
    target: Array  # (C,)


class Record(NamedTuple):
    """What is kept of a run, one row per output time."""

    time: Array  # (T,)
    x: Array  # (T, X)
    v: Array  # (T, V)
    vd: Array  # (T, V) d/dt of v
    r: Array  # (T, M, 3) marker positions
    rd: Array  # (T, M, 3) marker velocities
    reaction: Array  # (T, K, 6) by block: force, moment
    action: Array  # (T, Z, 3) coordinate, rate, force
    bushing: Array  # (T, Y, 18) displacement and rotation, their rates, force and moment
    power: Array  # (T, W + Z + Y + U)
    energy: Array  # (T, 3) kinetic, strain, gravity
    violation: Array  # (T, 2) largest |Phi|, |Phi_dot|
