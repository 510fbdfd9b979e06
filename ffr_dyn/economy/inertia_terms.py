"""The effect of inertia terms and geometric stiffening on the outputs, without a run: their forces, and what follows.

All forces of a term are linear in its integrals; those of stiffening come load by load. Each drives the modes one-way as
passive oscillators, and the outputs change in proportion. What a term does to the large motion of a free body by way of its
rigid coordinates is not seen; the model without the terms is run beside the full model before it is believed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ffr_dyn.economy.contributions import Contributions
from ffr_dyn.economy.model_choice import Choice, Part
from ffr_dyn.economy.policy import DEFAULT, Policy
from ffr_dyn.economy.residual_estimate import Samples, elastic_columns, followed, responses
from ffr_dyn.variants.variant import STIFFENING
from ffr_prep.body import FlexibleBody, axial
from ffr_prep.common.arrays import Array

DROPPED = ("I9", "I5", "I8")  # terms that may be left out; I3 and I4 are what couples a mode to anything


@dataclass(frozen=True, eq=False)
class TermEffect:
    """The effect of a term of a body on each output.

    body : number;  term : of `DROPPED`, or `STIFFENING` by one load, its number in `load`;  effect : (outputs,)
    """

    body: int
    term: str
    load: int | None
    effect: Array


def term_effects(seen: Samples, sensitivity: Contributions, policy: Policy = DEFAULT) -> tuple[TermEffect, ...]:
    """Effects along a motion that its own model sees, where `sensitivity` tells what each of its modes does."""
    listed = [*_inertial(seen), *_stiffening(seen)]
    if not listed or not len(sensitivity.body):
        return ()
    D = np.eye(seen.system.layout.v_size)[:, elastic_columns(seen.system.layout)]
    forces = np.stack([force for _, _, _, force in listed], axis=2)
    largest = np.abs(responses(seen, D, followed(seen, D, policy), forces)).max(axis=0)
    per_size = sensitivity.effect / np.maximum(sensitivity.amplitude, 1e-300)[:, None]
    effects = largest.T @ per_size
    return tuple(TermEffect(b, term, load, e) for (b, term, load, _), e in zip(listed, effects, strict=True))


def without_minor(choice: Choice, effects: tuple[TermEffect, ...], limit: Array) -> Choice:
    """The model without the terms that do least, which together stay below a limit (outputs,)."""
    flexible = [e for e in effects if choice.parts[e.body].count]
    if not flexible:
        return choice
    order = sorted(flexible, key=lambda e: float((e.effect / limit).max(initial=0.0)))
    together = np.cumsum([e.effect for e in order], axis=0)
    dropped = [e for e, done in zip(order, together, strict=True) if (done <= limit).all()]
    return _dropping(choice, flexible, dropped)


def _dropping(choice: Choice, flexible: list[TermEffect], dropped: list[TermEffect]) -> Choice:
    parts = []
    for b, part in enumerate(choice.parts):
        names = [e.term for e in dropped if e.body == b and e.load is None]
        loads = sorted(e.load for e in flexible if e.body == b and e.load is not None and e not in dropped)
        parts.append(_with_terms(part, names, tuple(loads), any(e.body == b and e.load is not None for e in dropped)))
    return Choice(tuple(parts), choice.plane, choice.method, choice.divisions, choice.accuracy)


def _with_terms(part: Part, names: list[str], loads: tuple[int, ...], fewer: bool) -> Part:
    without = tuple(sorted({*part.dropped, *names}))
    if not fewer:
        return Part(part.modes, without, part.shapes, part.loads)
    if not loads:
        return Part(part.modes, (*without, STIFFENING), part.shapes)
    return Part(part.modes, without, part.shapes, loads)


# ---- forces of terms --------------------------------------------------------------------------------------------------

_Force = tuple[int, str, int | None, Array]


def _stiffening(seen: Samples) -> Iterator[_Force]:
    for k, (b, number) in enumerate(seen.loads):
        yield b, STIFFENING, number, seen.stiffening[:, :, k]


def _inertial(seen: Samples) -> Iterator[_Force]:
    for b, body in enumerate(seen.system.scene.bodies):
        if body.model.n:
            for term in DROPPED:
                if term not in body.dropped:
                    yield b, term, None, _force(seen, b, *_integrals(body.model, term))


def _integrals(model: FlexibleBody, term: str) -> tuple[Array, Array]:
    """The part of a term in int u phi^T dm, undeformed (3, 3, n) and per mode (3, 3, n, n); zeros for the rest."""
    rP, PP = (0.5 * (t + np.swapaxes(t, 0, 1)) for t in (model.rP_dm, model.PP_dm))
    parts = {"I8": (rP, 0 * PP), "I9": (0 * rP, PP), "I5": (0 * rP, model.PP_dm - PP)}
    return parts[term]


def _force(seen: Samples, b: int, rP: Array, PP: Array) -> Array:
    """(T, V) Q_v - M a of one body (see `ffr_dyn.equations.inertia`) with these integrals alone."""
    place = seen.system.layout
    q, q_dot, q_ddot = seen.x[:, place.q(b)], seen.v[:, place.q_dot(b)], seen.acceleration[:, place.q_dot(b)]
    omega, alpha = seen.v[:, place.omega(b)], seen.acceleration[:, place.omega(b)]
    G = rP + np.einsum("klij,ti->tklj", PP, q)
    W = np.einsum("klj,tj->tlk", rP, q) + np.einsum("tklj,tj->tkl", G, q)
    J = np.einsum("tkk,lm->tlm", W, np.eye(3)) - W
    D, H = np.einsum("tklj,tj->tkl", G, q_dot), np.moveaxis(axial(np.moveaxis(G, 0, -1)), -1, 0)
    L = np.einsum("cij,ti->tcj", axial(PP), q_dot)
    force = np.zeros_like(seen.v)
    turning = np.einsum("tkk,tl->tl", D, omega) - np.einsum("tkl,tk->tl", D, omega)
    inertia = np.einsum("tkl,tl->tk", J, alpha) + np.einsum("tcj,tj->tc", H, q_ddot)
    force[:, place.omega(b)] = -np.cross(omega, np.einsum("tkl,tl->tk", J, omega)) - 2 * turning - inertia
    centrifugal = np.einsum("tk,tk,tllj->tj", omega, omega, G) - np.einsum("tk,tklj,tl->tj", omega, G, omega)
    force[:, place.q_dot(b)] = centrifugal - 2 * np.einsum("tc,tcj->tj", omega, L) - np.einsum("tcj,tc->tj", H, alpha)
    return force
