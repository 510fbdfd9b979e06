"""The machine near a steady motion, in minimal coordinates: y along the free motions, seen from axes that move with
the bodies.

    y_ddot + C y_dot + K y = forces,    C = Z^T (G + D) Z,  K = Z^T K Z,  Z^T M Z = 1

with the matrices of `ffr_dyn.linear.steady_state`, all of them exact but for forces that see velocities. Where they change
with the angle of the turning bodies they are the means of a turn, and the modes Hill's (`ffr_dyn.linear.hill`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.consistency.evaluation import evaluate
from ffr_dyn.consistency.tangent import STEP, Chart, at_rest, matrices_at_rest, sizes
from ffr_dyn.equations.layout import to_body_axes
from ffr_dyn.functions.rotation import skew
from ffr_dyn.linear.eigen import NULL, SLOWEST, Eigen, eigen
from ffr_dyn.linear.hill import Varying, hill
from ffr_dyn.linear.steady_state import Steady, turning_freely
from ffr_dyn.linear.whirl import parted
from ffr_prep.common.arrays import Array

SKEW = 1e-3  # of a stiffness: what has no potential, beside which its motions are still those of an energy
# Of the speed: what it drifts by at most while it grows or decays, for that to be told. The drag of an unbalance, which
# something beside the scene balances, is as slight beside its slope as a resonance is narrow.
STEADILY = 1e-6
ALIKE = 0.9  # of a mode: what is along the turning, of a change of the speed
TOLD = 1e-4  # of frequencies that more harmonics would change, relative
CUT = (
    "what turns and its supports change so much with the angle, and turn so slowly, that modes take more harmonics than "
    "there is room for: their frequencies may be off by up to {:.2g} of their size. Turn faster, take bodies with fewer "
    "modes, or linearise the scene at rest at several angles"
)


@dataclass(frozen=True)
class Reduced:
    """K, C (d, d) of a steady motion in its free motions."""

    K: Array
    C: Array


@dataclass(frozen=True)
class Modes:
    """values (2 d,) [1/s] of the modes of a steady motion, `free` zeros first, the others by rising modulus.

    parts : (2 h + 1, d, 2 d) of y = exp(value t) sum_k parts[h + k] exp(i k shift t)
    shift : [rad/s], 0 where nothing varies
    left  : of the equations of what varies beyond the last harmonic, relative
    """

    values: Array
    parts: Array
    free: int
    shift: float
    left: float = 0.0

    @property
    def notes(self) -> list[str]:
        """Of modes that take more harmonics than there is room for."""
        return [CUT.format(self.left)] if self.left > TOLD else []


def graded(near: Chart, plain: Chart) -> tuple[Chart, Array | None]:
    """The chart of a scene at rest with free motions of rising stiffness, each right to its own size, and (d,) the rounding
    of each, per mass: what is slow and bends no stiff body has none of the rounding of that body's stiffness. `plain` is the
    same of the scene without inputs.

    As it is, and None, where something moves, or where forces without a potential are no small part of the stiffness.
    """
    if not at_rest(near):
        return near, None
    K, _ = matrices_at_rest(plain)
    free = near.Z.T @ K @ near.Z
    if np.abs(free - free.T).max(initial=0.0) > SKEW * np.abs(free + free.T).max(initial=0.0):
        return near, None
    Z, size = near.Z @ np.linalg.eigh(0.5 * (free + free.T))[1], sizes(near.at)
    movement = np.abs(Z / size[:, None]).max(axis=0, initial=0.0)
    forces = evaluate(plain.at, near.time, near.x, np.zeros(near.V.size)).force
    applied = np.abs(np.linalg.solve(near.M, forces) / size).max(initial=0.0)
    rounding = NULL * (np.einsum("ik,ij,jk->k", np.abs(Z), np.abs(K), np.abs(Z), optimize=True) + applied + SLOWEST)
    return replace(near, Z=Z, W=near.M @ Z, steps=STEP / np.maximum(movement, 1e-300)), rounding


def reduced(found: Steady) -> Reduced:
    """The matrices of the free motions."""
    Z, about = found.Z, found.about
    return Reduced(Z.T @ about.K @ Z, Z.T @ (about.G + about.D) @ Z)


def modes_of(found: Steady) -> Modes:
    """The modes of a steady motion in its free motions.

    What turns on by itself keeps its speed where the speed is given, as nothing in the scene balances what would change it:
    the drag of an unbalance falls beyond a critical speed, and would make it grow; bent far there, a shaft would shake it.
    What nothing drives or brakes keeps it, too, where matrices vary over a turn: about the mean of that, which leaves open
    what goes around, such as a weight across the axis, it would be held or driven by what is left.
    """
    g, complete = turning_freely(found)
    loose, of = complete[:, :g], reduced(found)
    mean = eigen(of.K, of.C, loose=loose)
    left_alone = g > 0 and mean.free >= 2 * g and _varies(found, of)
    if not (left_alone or _speed_is_given(found, loose, mean)):
        return _modes_with(found, of, mean)
    others = _without_spin(found, loose)
    held = replace(found, Z=found.Z @ others)
    of = reduced(held)
    rest = _modes_with(held, of, eigen(of.K, of.C))
    free, h = 2 * g + rest.free, len(rest.parts) // 2
    parts = np.concatenate([np.zeros((2 * h + 1, len(complete), 2 * g)), others @ rest.parts], axis=2)
    parts[h, :, : 2 * g] = np.tile(loose, 2)
    return replace(rest, values=np.concatenate([np.zeros(2 * g), rest.values]), parts=parts, free=free)


def _speed_is_given(found: Steady, loose: Array, mean: Eigen) -> bool:
    """Whether what turns on, by motions (d, g), is out of balance, and its speed grows or decays no faster than that drives
    it."""
    if not loose.size:
        return False
    turning = found.Z @ loose
    momentum = turning.T @ found.about.M @ to_body_axes(found.machine.place, found.x, found.v)
    drift = np.abs(turning.T @ found.about.forces).max() / np.abs(momentum).max()
    along, size = np.linalg.norm(loose.T @ mean.vectors, axis=0), np.linalg.norm(mean.vectors, axis=0)
    slow = (along >= ALIKE * size) & (np.abs(mean.values) <= drift / STEADILY)
    return bool(slow[mean.free :].any())


def _without_spin(found: Steady, loose: Array) -> Array:
    """(d, d - g) orthonormal motions that change no angular momentum of the bodies' own turning in the motions (d, g)."""
    place, turning = found.machine.place, found.Z @ loose
    spins = np.zeros_like(turning)
    for b in range(len(place.n)):
        spins[place.omega(b)] = turning[place.omega(b)]
    others: Array = np.linalg.qr(found.Z.T @ found.about.M @ spins, mode="complete")[0][:, loose.shape[1] :]
    return others


def _modes_with(found: Steady, of: Reduced, mean: Eigen) -> Modes:
    """Those of the mean, or Hill's where stiffness and damping vary."""
    if not _varies(found, of):
        return Modes(mean.values, _parted(found, mean)[None], mean.free, 0.0)
    varying = _varying(found, of)
    all_of = hill(varying)
    order = np.lexsort((np.sign(all_of.values.imag), np.round(np.abs(all_of.values), 9)))
    values, parts, h = all_of.values[order], all_of.parts[..., order], len(all_of.parts) // 2
    values[: mean.free], parts[..., : mean.free] = 0.0, 0.0
    parts[h, :, : mean.free] = mean.vectors[:, : mean.free]
    return Modes(values, parts, mean.free, varying.step * varying.rate, all_of.left)


def _varies(found: Steady, of: Reduced) -> bool:
    """Whether stiffness or damping varies over a turn at the one speed of what turns."""
    varying = _varying(found, of)
    return bool(varying.rate and varying.step)


def _parted(found: Steady, of: Eigen) -> Array:
    """(d, 2 d) vectors, forward and backward whirls of one eigenvalue apart."""
    machine, Z = found.machine, found.Z
    shapes = parted(machine.system.scene, machine.place, machine.screws, found.x, of.values, Z @ of.vectors)
    vectors: Array = Z.T @ found.about.M @ shapes
    return vectors


def over_turn(found: Steady, H: int) -> Array:
    """(H + 1, 2 d, 2 d) harmonics of the state matrix over a turn; zero beyond the first where nothing varies."""
    of = reduced(found)
    varying = _varying(found, of)
    A = np.zeros((H + 1, 2 * len(of.K), 2 * len(of.K)), complex)
    A[0] = state_matrix(found, of)
    none = state_matrix(found, Reduced(np.zeros_like(of.K), np.zeros_like(of.C)))
    for k in range(1, min(H + 1, len(varying.K)) if varying.step else 1):
        A[k] = state_matrix(found, Reduced(varying.K[k], varying.C[k])) - none
    return A


def _varying(found: Steady, mean: Reduced) -> Varying:
    """K and C by their harmonics over a turn, where all that turns does so at one speed."""
    Z = found.Z
    K, C = (Z.T @ one @ Z for one in (found.about.over_turn))
    return Varying(
        np.concatenate([mean.K[None], K[1:]]), np.concatenate([mean.C[None], C[1:]]), found.machine.screws.rate
    )


def state_matrix(found: Steady, of: Reduced) -> Array:
    """(2 d, 2 d) A of (y, z), z the changes of the velocities in body axes along the free motions: y_dot, and what
    the turning of the axes makes of y."""
    d, turning = len(of.K), np.zeros_like(found.about.M)
    place = found.machine.place
    inside = to_body_axes(place, found.x, found.v)
    for b in range(len(place.n)):
        at, turn = place.R_dot(b), place.omega(b)
        turning[at, at] = turning[turn, turn] = skew(inside[turn])
        turning[at, turn] = skew(inside[at])
    one, none = np.eye(d), np.zeros((d, d))
    S = found.Z.T @ found.about.M @ turning @ found.Z
    there, back = np.block([[one, none], [S, one]]), np.block([[one, none], [-S, one]])
    return there @ np.block([[none, one], [-of.K, -of.C]]) @ back
