"""Cheaper variants of a scene: fewer modes, fewer inertia terms, rigid bodies, other meshes.

    from ffr_dyn.variant import vary
    cheap = vary(scene, modes={"rod": 4}, drop={"rod": ("I5", "I9")}, rigid=("crank",))

The equations with a term left out are those of a kinetic energy without it: energy is still conserved. With the deformed
inertia J(q) = I7 - sum_j (I8_j + I8_j^T) q_j - sum_ij I9_ij q_i q_j and the coupling H_j = I4_j + sum_i I5_ij q_i of
rotation and deformation, the terms that can be dropped are (`INERTIA_TERMS`)

    I3  momentum of the modes, and with it gravity on them       I4  coupling of undeformed rotation and deformation
    I5  coupling that deformation adds; Coriolis among modes     I8  inertia and centrifugal force linear in q
    I9  inertia and centrifugal force quadratic in q

I3 and I4 belong together: with one of them alone the mass matrix is not positive. Of the others assembly tells how far the
body may deform without them (`ffr_dyn.consistency.dropped_terms`). One more
term is "stiffening", the second-order displacement, and with it geometric stiffening and foreshortening.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ffr_dyn.scene.force_kinds import in_bases, modal_fields
from ffr_dyn.scene.parts import owner
from ffr_dyn.scene.scene import INERTIA_TERMS, Body, Scene, used_interfaces
from ffr_dyn.variants.condensation import cut_of_shapes, statically_complete
from ffr_prep.body import FlexibleBody, in_fewer_shapes, of_fewer_shapes, recombined, truncated, with_cut
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

STIFFENING = "stiffening"
TERMS = (*INERTIA_TERMS, STIFFENING)

Modes = int | Sequence[int]


# ---- bodies -------------------------------------------------------------------------------------------------------


def basis_of(model: FlexibleBody, keep: Modes, interfaces: Iterable[str] | None = None) -> Array:
    """(n, m) how the elastic coordinates of a body follow from those of its smaller variant: q = V p, V^T V = I.

    keep : how many, statically complete at the interfaces (see `ffr_dyn.variants.condensation`), or the numbers, from 0, of
           the modes that stay as they are. All of them, where that many are not there
    interfaces : those whose statics count, all by default
    """
    if isinstance(keep, (int, np.integer)):
        if keep < 0:
            raise InputError(f"body {model.name!r}: cannot keep {keep} modes; give a number from 0")
        return (
            np.eye(model.n)
            if keep >= model.n
            else statically_complete(model, int(keep), interfaces)
            if keep
            else _none(model)
        )
    return np.eye(model.n)[:, list(keep)] if len(keep) else _none(model)


def _none(model: FlexibleBody) -> Array:
    return np.zeros((model.n, 0))


def with_basis(model: FlexibleBody, V: Array) -> FlexibleBody:
    """The body in the elastic coordinates p, q = V p, for V (n, m) with V^T V = I and V^T Omega^2 V diagonal."""
    stiffening, omega2 = model.stiffening, np.einsum("ia,i,ia->a", V, model.omega2, V)
    return replace(
        model,
        P_dm=model.P_dm @ V,
        rP_dm=model.rP_dm @ V,
        PP_dm=np.einsum("ia,klij,jb->klab", V, model.PP_dm, V, optimize=True),
        omega2=omega2,
        interfaces=tuple(replace(i, phi_t=i.phi_t @ V, phi_r=i.phi_r @ V) for i in model.interfaces),
        surface=model.surface and recombined(model.surface, V, model.surface.Phi @ V),
        stiffening=None if stiffening is None else np.einsum("ia,lij,jb->lab", V, stiffening, V, optimize=True),
        damping=None if model.damping is None else V.T @ model.damping @ V,
        provenance=in_fewer_shapes(of_fewer_shapes(model, V), model.omega2, omega2),
    )


def with_modes(body: Body, keep: Modes, interfaces: Iterable[str] | None = None) -> Body:
    """The body with fewer elastic coordinates, chosen as in `basis_of`; it starts in the nearest state (least mass).

    Damping ratios become those of the damping matrix in the new coordinates, without what couples these. A number that
    leaves out the twin of a shape that it keeps, as of a round bar in two planes, is told by the runs of a scene in space.

    Raises InputError for a scene, of which `vary` makes one with fewer modes, and for a body in parts.

    >>> rod = fd.with_modes(rod, 4)
    """
    if not isinstance(body, Body):
        raise InputError(
            f"with_modes takes a body of a scene, fd.Body(...), not a {type(body).__name__}: of a whole scene "
            "fd.vary(scene, modes=4) keeps 4 modes of every body"
        )
    if body.model.parts:
        raise InputError(
            f"body {body.name!r} is in {len(body.model.parts)} parts, which have modes of their own: "
            "fd.vary(scene, modes=4) keeps 4 modes of each part"
        )
    if not isinstance(keep, (int, np.integer)):
        at = np.asarray(keep, int)
        model, frame = truncated(body.model, at), body.frame and body.frame.combined(np.eye(body.model.n)[:, at])
        return replace(body, model=model, frame=frame, q=body.q[at], q_dot=body.q_dot[at], damping=body.damping[at])
    if keep >= body.model.n:
        return body
    V = basis_of(body.model, keep, interfaces)
    told = cut_of_shapes(body.model, int(keep), interfaces)
    model = with_basis(body.model, V)
    model, frame = replace(model, provenance=with_cut(model.provenance, told)), body.frame and body.frame.combined(V)
    damping = _damping(body, model, V)
    return replace(body, model=model, frame=frame, q=body.q @ V, q_dot=body.q_dot @ V, damping=damping)


def _damping(body: Body, model: FlexibleBody, V: Array) -> Array:
    rates = np.einsum("ia,i,ia->a", V, body.damping * np.sqrt(body.model.omega2), V)
    return rates / np.where(model.omega2 > 0, np.sqrt(model.omega2), 1.0)


def without_terms(body: Body, terms: Iterable[str]) -> Body:
    """The body whose equations leave out the named `TERMS`, beside those that they leave out already.

    Raises InputError for a term that does not exist.

    >>> rod = fd.without_terms(rod, ("I5", "I9"))
    """
    names = tuple(terms)
    for name in names:
        if name not in TERMS:
            raise InputError(f"there is no term {name!r} to drop; there are: {', '.join(TERMS)}")
    dropped = (*body.dropped, *(name for name in names if name != STIFFENING))
    return replace(body, dropped=dropped, stiffening=body.stiffening and STIFFENING not in names)


def stiffening_by(body: Body, loads: Iterable[int]) -> Body:
    """The body with the geometric stiffening of some loads only, by number: 0 to 2 accelerations, 3 to 5 angular ones, 6 to
    11 the products of rates xx, yy, zz, xy, xz, yz, then a force and a moment at each interface (body axes)."""
    model, kept = body.model, sorted(loads)
    if model.stiffening is None:
        return body
    if kept and not 0 <= kept[0] <= kept[-1] < len(model.stiffening):
        raise InputError(
            f"body {body.name!r}: stiffening by load {kept[-1] if kept[0] >= 0 else kept[0]}: it has the loads 0 to "
            f"{len(model.stiffening) - 1}"
        )
    stiffening = np.zeros_like(model.stiffening)
    stiffening[kept] = model.stiffening[kept]
    return replace(body, model=replace(model, stiffening=stiffening))


def with_model(body: Body, model: FlexibleBody) -> Body:
    """The body made otherwise, from another mesh say; undeformed at the start unless it has as many modes as before.

    Raises InputError when an interface of the old model is missing.
    """
    missing = {i.name for i in body.model.interfaces} - {i.name for i in model.interfaces}
    if missing:
        raise InputError(f"body {body.name!r}: the other body file has no interface {sorted(missing)[0]!r}")
    if np.ptp(body.damping) > 0 and model.n != body.model.n:
        raise InputError(
            f"body {body.name!r} has a damping ratio for each of {body.model.n} modes, the other body file {model.n} "
            "modes; give one ratio for all"
        )
    if model.n == body.model.n:
        return replace(body, model=model)
    return replace(body, model=model, q=None, q_dot=None, damping=body.damping[0] if body.model.n else 0.0)


# ---- scenes -------------------------------------------------------------------------------------------------------


def vary(
    scene: Scene,
    *,
    modes: Modes | Mapping[str, Modes] | None = None,
    drop: Iterable[str] | Mapping[str, Iterable[str]] = (),
    rigid: Iterable[str] = (),
    models: Mapping[str, FlexibleBody] = {},
) -> Scene:
    """The scene with variants of its bodies.

    modes  : how many to keep of each body, or which; for all flexible bodies, or by body name (see `with_modes`). The statics
             are kept of the interfaces at which something acts
    drop   : `TERMS` to leave out of all bodies, or by body name
    rigid  : names of bodies that become rigid
    models : by body name, another body for it (see `with_model`); modes are kept of that one, or of each of its parts

    Forces on elastic coordinates are expressed in the new ones. Raises InputError for names that do not exist.

    >>> cheaper = fd.vary(scene, modes=4, drop=("I9",))
    """
    scene, rigid = _remade(scene, models), tuple(rigid)
    names = [body.name for body in scene.bodies]
    wanted: dict[str, Modes] = _by_name(
        {} if modes is None else modes, [b.name for b in scene.bodies if b.model.n], scene
    )
    wanted |= _by_name(dict.fromkeys(rigid, 0), (), scene)
    without = _by_name(drop, names, scene)
    bodies = []
    for body in scene.bodies:
        used = used_interfaces(scene, body)
        kept = with_modes(body, wanted[body.name], used) if body.name in wanted else body
        bodies.append(without_terms(kept, without.get(body.name, ())))
    modal = {force.body for force in scene.forces if modal_fields(force)}
    bases = {
        body.name: basis_of(body.model, wanted.get(body.name, body.model.n), used_interfaces(scene, body))
        for body in scene.bodies
        if body.name in modal
    }
    return replace(scene, bodies=tuple(bodies), forces=in_bases(scene.forces, bases))


def _remade(scene: Scene, models: Mapping[str, FlexibleBody]) -> Scene:
    """The scene with other bodies for some, in their parts where they have parts."""
    _check_known(models, [body.name for body in scene.bodies])
    made = (with_model(body, models[body.name]) if body.name in models else body for body in scene.bodies)
    forces = in_bases(scene.forces, {name: np.eye(model.n) for name, model in models.items()})
    return replace(scene, bodies=tuple(made), forces=forces) if models else scene


def _by_name(given: Any, everywhere: Iterable[str], scene: Scene) -> dict[str, Any]:
    """The values by name of a setting that is given by name, of a whole for its parts, or once for all that it concerns."""
    if not isinstance(given, Mapping):
        return dict.fromkeys(everywhere, given)
    _check_known(given, dict.fromkeys(name for body in scene.bodies for name in (body.name, owner(body))))
    values = ((body.name, given.get(body.name, given.get(owner(body)))) for body in scene.bodies)
    return {name: value for name, value in values if value is not None}


def _check_known(given: Iterable[str], names: Collection[str]) -> None:
    for name in given:
        if name not in names:
            raise InputError(f"there is no body {name!r} to vary; there are: {', '.join(names)}")
