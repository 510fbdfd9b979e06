"""What is modelled of a scene: modes and terms of every body, the plane, the integrator and its step."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ffr_dyn.analyses.assemble import in_space
from ffr_dyn.errors import InputError
from ffr_dyn.integrators import METHODS, Integrator
from ffr_dyn.plane import AXES, body_normal, planar_forms
from ffr_dyn.result import Result
from ffr_dyn.scene import Scene
from ffr_dyn.variant import STIFFENING, vary

Array = np.ndarray

IN_PLANE = 1e-7  # of the size of the scene and the largest rate: what counts as no motion across the plane
RIGID, QUASI_STATIC, FLEXIBLE = "rigid", "quasi-static", "flexible"


@dataclass(frozen=True)
class Part:
    """What is modelled of one body.

    modes   : numbers of the elastic coordinates that stay, from 0, ascending
    dropped : terms that its equations leave out (see `ffr_dyn.variant.TERMS`)
    """

    modes: tuple[int, ...]
    dropped: tuple[str, ...] = ()

    @property
    def stiffened(self) -> bool:
        """Whether geometric stiffening is kept."""
        return STIFFENING not in self.dropped


@dataclass(frozen=True)
class Choice:
    """A model of a scene.

    parts  : one for each body, in the scene's order
    plane  : "x", "y" or "z", the normal of a planar computation, or "none"
    method : name of the integrator, one of `METHODS`
    divisions : steps from one output row to the next
    """

    parts: tuple[Part, ...]
    plane: str
    method: str
    divisions: int

    def integrator(self, output_step: float) -> Integrator:
        """The method with its step."""
        return METHODS[self.method](output_step / self.divisions)


def full(scene: Scene, method: str, divisions: int) -> Choice:
    """All modes, all terms, in space."""
    parts = tuple(Part(tuple(range(body.model.n)), _without(body.stiffening)) for body in scene.bodies)
    return Choice(parts, "none", method, divisions)


def in_plane(scene: Scene, choice: Choice, moved: Result) -> Choice | None:
    """The choice with in-plane modes only, where symmetry and joints keep the scene to a plane; None where they do not.

    moved : a run in space with states; what is left out is never moved, so results are those in space
    """
    if scene.plane in AXES:
        return replace(choice, plane=scene.plane)
    if scene.plane == "none":
        return None
    for form in planar_forms(scene):
        if not _stays(form, moved):
            continue
        parts = tuple(
            replace(part, modes=tuple(k for k in part.modes if body.kept and k in body.kept[0]))
            for part, body in zip(choice.parts, form.bodies, strict=True)
        )
        return replace(choice, parts=parts, plane=form.plane)
    return None


def _stays(form: Scene, moved: Result) -> bool:
    """Whether every body of a run in space stays in the plane of the form."""
    normal = AXES.index(form.plane)
    size = max(float(np.ptp(moved[f"{body.name}.R"])) for body in form.bodies) or 1.0
    for body in form.bodies:
        height, omega = moved[f"{body.name}.R"][:, normal], moved[f"{body.name}.omega_bar"]
        across = np.delete(omega, body_normal(body, normal), axis=1)
        if np.ptp(height) > IN_PLANE * size or np.abs(across).max() > IN_PLANE * max(np.abs(omega).max(), 1e-3):
            return False
    return True


def applied(scene: Scene, choice: Choice) -> Scene:
    """The scene with this model. Raises InputError for a choice made for another scene."""
    if len(choice.parts) != len(scene.bodies):
        raise InputError(f"the model is of {len(choice.parts)} bodies, the scene has {len(scene.bodies)}")
    modes = {b.name: list(p.modes) for b, p in zip(scene.bodies, choice.parts, strict=True) if len(p.modes) < b.model.n}
    drop = {b.name: p.dropped for b, p in zip(scene.bodies, choice.parts, strict=True) if p.dropped}
    varied = vary(scene, modes=modes, drop=drop)
    return replace(in_space(varied) if choice.plane == "none" else varied, plane=choice.plane)


def kind(scene: Scene, choice: Choice, number: int, output_step: float) -> str:
    """What a body is in a model: rigid, quasi-static (no mode is slow enough for the step to see it vibrate) or flexible."""
    modes = choice.parts[number].modes
    if not modes:
        return RIGID
    lowest = float(np.sqrt(scene.bodies[number].model.omega2[list(modes)].min()))
    implicit = type(choice.integrator(output_step)).implicit
    return QUASI_STATIC if implicit and lowest * output_step / choice.divisions > 1.0 else FLEXIBLE


def _without(stiffening: bool) -> tuple[str, ...]:
    return () if stiffening else (STIFFENING,)
