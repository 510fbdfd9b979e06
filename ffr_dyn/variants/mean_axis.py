"""Second-order bodies of a scene in their mean-axis form, and the state of a scene in its own frames brought into it.

With the elastic coordinates q of the form, R and A its frame, and its own frame a marker at rho(q) that turns by
exp(theta(q)) (`ffr_prep.body.mean_axis`), x_c the pivot in the own frame:

    q_own = C q,   A_own = A exp(theta~),   R_own = R + A rho - A_own x_c.

What a scene declares is in its own frames; here it is taken into the other, velocities included. The way back, of results,
is `ffr_dyn.results.recorded_motion.View`, of a single state `ffr_dyn.equations.state_view`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ffr_dyn.functions.rotation import cross, from_vector, product, rotation_matrix, tangent
from ffr_dyn.scene.force_kinds import in_bases
from ffr_dyn.scene.forces.distributed import moving_model
from ffr_dyn.scene.forces.places import OnBody
from ffr_dyn.scene.own_frame import OwnFrame
from ffr_dyn.scene.scene import Body, Scene, altered, used_interfaces
from ffr_dyn.variants.families import by_family
from ffr_dyn.variants.variant import with_basis
from ffr_prep.body import FlexibleBody, idle_loads, mean_axis_form, remembered
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

HELD = 1e-9  # of a unit mode: what rounding moves a held place by


def in_mean_axis_frames(scene: Scene) -> Scene:
    """The scene with every second-order body in its mean-axis form; those that are in it stay as they are. Damping ratios
    are those of its modes there, by frequency.

    Raises InputError for joints and forces at a point whose loads have no matrices.
    """
    bodies = tuple(_converted(scene, body) for body in scene.bodies)
    bases = {
        new.name: new.frame.C for old, new in zip(scene.bodies, bodies, strict=True) if new is not old and new.frame
    }
    return altered(scene, bodies=bodies, forces=in_bases(scene.forces, bases)) if bases else scene


def _converted(scene: Scene, body: Body) -> Body:
    if body.frame or not (body.model.n and body.stiffening and body.model.stiffening is not None):
        return body
    _check_known(scene, body)
    form = remembered(body.model, "mean-axis form by family", lambda: _form(body.model))
    if form is None:
        return body
    model, frame, by_frequency = form
    return _moved(altered(body, model=model, frame=frame, damping=body.damping[by_frequency]))


def _form(model: FlexibleBody) -> tuple[FlexibleBody, OwnFrame, Array] | None:
    """The mean-axis form with its coordinates family by family, in which products are found soonest, and their numbers by
    frequency; None of a body that is in its form already."""
    if _is_mean_axis(model):
        return None
    form = mean_axis_form(model)
    V = np.eye(form.body.n)[:, by_family(form.body)]
    made = with_basis(form.body, V)
    by_frequency = np.argsort(np.argsort(made.omega2, kind="stable"))
    return made, OwnFrame(model, form.frame, form.C).combined(V), by_frequency


def _moved(body: Body) -> Body:
    """A body whose state is still that in its own frame, in the state that belongs to the mean-axis form."""
    assert body.frame
    if not (body.q.any() or body.q_dot.any()):
        return body
    at, C = body.frame.marker, body.frame.C
    q, q_dot = np.linalg.solve(C, body.q), np.linalg.solve(C, body.q_dot)
    bent = at.K @ q
    phi = np.concatenate([at.phi_t, at.phi_r])
    place, rates = (phi - 0.5 * bent) @ q, (phi - bent) @ q_dot
    rho, theta = at.pivot + place[:3], place[3:]
    turn = from_vector(theta)
    rotation = product(body.rotation, turn * [1.0, -1.0, -1.0, -1.0])
    own, A = rotation_matrix(body.rotation), rotation_matrix(rotation)
    omega = rotation_matrix(turn) @ body.omega_bar - tangent(theta) @ rates[3:]
    shift = own @ cross(body.omega_bar, at.pivot) - A @ (cross(omega, rho) + rates[:3])
    return replace(
        body,
        position=body.position + (own @ at.pivot - A @ rho),
        rotation=rotation,
        velocity=body.velocity + shift,
        omega_bar=omega,
        q=q,
        q_dot=q_dot,
    )


def _check_known(scene: Scene, body: Body) -> None:
    """InputError where something acts at a point that has no second-order displacement."""
    unknown = remembered(body.model, "points without second order", lambda: _unknown(body.model))
    for name in used_interfaces(scene, body):
        if name in unknown:
            raise InputError(
                f"body {body.name!r} does not know the second-order displacement of its point {name!r}, at which something "
                "acts (a point that was added to an older file?): make it an interface of the reduction, or compute the "
                "body without load matrices (stiffening = false)"
            )


def _unknown(model: FlexibleBody) -> frozenset[str]:
    """The points that have no second-order displacement, and are not held."""
    idle = idle_loads(model).tolist()[::6]
    # A held place may turn, and moments on slender bodies have no matrix.
    moved = [np.sqrt(model.mass) * np.abs(i.phi_t).max() > HELD for i in model.interfaces]
    return frozenset(i.name for i, none, moves in zip(model.interfaces, idle, moved, strict=True) if none and moves)


def with_mean_axis_bodies(scene: Scene) -> Scene:
    """The scene with second-order bodies that are theirs in the mean-axis form: its frame and modes are those of its results.

    The surfaces on which loads act keep their second-order displacement. Raises InputError as `in_mean_axis_frames`.
    """
    converted = in_mean_axis_frames(scene)
    loaded = {force.place.body for force in converted.forces if isinstance(force.place, OnBody)}
    models = [moving_model(body) if body.name in loaded else body.model for body in converted.bodies]
    bodies = zip(converted.bodies, models, strict=True)
    return replace(converted, bodies=tuple(replace(body, model=model, frame=None) for body, model in bodies))


def in_new_frames(scene: Scene) -> tuple[Scene, list[str]]:
    """`with_mean_axis_bodies`, and the names of the bodies whose frame is another one there.

    Raises InputError as `in_mean_axis_frames`.
    """
    made = with_mean_axis_bodies(scene)
    pairs = zip(scene.bodies, made.bodies, strict=True)
    return made, [new.name for old, new in pairs if new.model is not old.model]


def _is_mean_axis(model: FlexibleBody) -> bool:
    """Whether a body is in its mean-axis form already: what vanishes there is zero, and no rounding."""
    assert model.stiffening is not None
    skew = model.rP_dm - model.rP_dm.transpose(1, 0, 2)
    return not (model.P_dm.any() or model.stiffening[:6].any() or skew.any())
