"""The choice of a model of a scene: modes and terms of every body, the plane, the integrator and its step."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag, eigh, null_space

from ffr_dyn.consistency.assemble import in_space
from ffr_dyn.economy.policy import DEFAULT, Policy
from ffr_dyn.integrators import CONTROLLED, METHODS, Integrator, tolerances
from ffr_dyn.results.result import Result
from ffr_dyn.scene.force_kinds import in_bases
from ffr_dyn.scene.scene import Body, Scene, body_normal
from ffr_dyn.variants.plane import AXES, planar_forms
from ffr_dyn.variants.variant import STIFFENING, stiffening_by, vary, with_basis
from ffr_prep.body import FlexibleBody, interface_motions, mass_of_motions
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

RIGID, QUASI_STATIC, FLEXIBLE = "rigid", "quasi-static", "flexible"


@dataclass(frozen=True)
class Part:
    """The choice of a model of one body.

    modes   : numbers of the elastic coordinates that are used, from 0, ascending
    dropped : terms that its equations leave out (see `ffr_dyn.variants.variant.TERMS`)
    shapes  : None where these coordinates stay as they are; or shapes made of them, each with a number per mode
    loads   : numbers of the loads whose geometric stiffening is kept (see `ffr_dyn.variants.variant.stiffening_by`), None
              for all
    """

    modes: tuple[int, ...]
    dropped: tuple[str, ...] = ()
    shapes: tuple[tuple[float, ...], ...] | None = None
    loads: tuple[int, ...] | None = None

    @property
    def count(self) -> int:
        """How many elastic coordinates the body has in the model."""
        return len(self.modes) if self.shapes is None else len(self.shapes)

    def basis(self, n: int) -> Array:
        """(n, count) V of q = V p, for the n elastic coordinates of the body."""
        V = np.zeros((n, self.count))
        V[list(self.modes)] = np.eye(len(self.modes)) if self.shapes is None else np.array(self.shapes).T
        return V

    @property
    def stiffened(self) -> bool:
        """Whether geometric stiffening is kept."""
        return STIFFENING not in self.dropped


@dataclass(frozen=True)
class Choice:
    """A model of a scene.

    parts  : one for each body, in the scene's order
    plane  : "x", "y" or "z", the normal of a planar computation, or "none"
    method : name of the integrator, one of `METHODS` or `CONTROLLED`
    divisions : steps from one output row to the next
    accuracy : relative tolerance of a step, of a method that chooses its steps; `divisions` mean nothing then
    """

    parts: tuple[Part, ...]
    plane: str
    method: str
    divisions: int
    accuracy: float = 0.0

    @property
    def count(self) -> int:
        """How many elastic coordinates the model has."""
        return sum(part.count for part in self.parts)

    def stepped_as(self, other: Choice) -> Choice:
        """The model with the method and the step of another."""
        return replace(self, method=other.method, divisions=other.divisions, accuracy=other.accuracy)

    @property
    def controlled(self) -> bool:
        """Whether the integrator chooses its steps."""
        return self.method in CONTROLLED

    def integrator(self, output_step: float) -> Integrator:
        """The method with its step or its tolerances."""
        made: Integrator
        if self.controlled:
            made = CONTROLLED[self.method](tolerances(self.accuracy))
        else:
            made = METHODS[self.method](output_step / self.divisions)
        return made


def full(scene: Scene, method: str, divisions: int) -> Choice:
    """All modes, all terms, in space."""
    parts = tuple(Part(tuple(range(body.model.n)), _without(body.stiffening)) for body in scene.bodies)
    return Choice(parts, "none", method, divisions)


def rigid(choice: Choice) -> Choice:
    """The choice with all bodies rigid."""
    return replace(choice, parts=tuple(Part(()) for _ in choice.parts))


def held_in_plane(choice: Choice, flat: Scene) -> Choice | None:
    """The choice with in-plane modes only, for the scene as it is assembled, where its joints keep it to a plane; None where
    they do not, or where modes are in-plane only when they are combined."""
    if flat.plane not in AXES or any(body.frame for body in flat.bodies):
        return None
    parts = tuple(
        replace(part, modes=body.kept[0]) if body.kept else part
        for part, body in zip(choice.parts, flat.bodies, strict=True)
    )
    return replace(choice, parts=parts, plane=flat.plane)


def in_plane(scene: Scene, choice: Choice, moved: Result, policy: Policy = DEFAULT) -> Choice | None:
    """The choice with in-plane modes only, where symmetry and joints keep the scene to a plane; None where they do not.

    moved : a run in space with states; what is left out is never moved, so results are those in space
    """
    if scene.plane in AXES:
        return replace(choice, plane=scene.plane)
    if scene.plane == "none":
        return None
    for form in planar_forms(scene):
        if any(body.frame for body in form.bodies) or not _stays(form, moved, policy.in_plane):
            continue
        parts = tuple(
            replace(part, modes=tuple(k for k in part.modes if body.kept and k in body.kept[0]))
            for part, body in zip(choice.parts, form.bodies, strict=True)
        )
        return replace(choice, parts=parts, plane=form.plane)
    return None


def _stays(form: Scene, moved: Result, share: float) -> bool:
    """Whether every body of a run in space stays in the plane of the form."""
    normal = AXES.index(form.plane)
    size = max(float(np.ptp(moved[f"{body.name}.R"])) for body in form.bodies) or 1.0
    for body in form.bodies:
        height, omega = moved[f"{body.name}.R"][:, normal], moved[f"{body.name}.omega_bar"]
        across = np.delete(omega, body_normal(body, normal), axis=1)
        if np.ptp(height) > share * size or np.abs(across).max() > share * max(np.abs(omega).max(), 1e-3):
            return False
    return True


def bases_between(scene: Scene, few: Choice, many: Choice) -> tuple[Array, ...]:
    """Of each body the coordinates of one model in those of another, (count of many, count of few)."""
    return tuple(
        large.basis(body.model.n).T @ small.basis(body.model.n)
        for body, small, large in zip(scene.bodies, few.parts, many.parts, strict=True)
    )


def applied(scene: Scene, choice: Choice) -> Scene:
    """The scene with this model. Raises InputError for a choice made for another scene."""
    if len(choice.parts) != len(scene.bodies):
        raise InputError(f"the model is of {len(choice.parts)} bodies, the scene has {len(scene.bodies)}")
    pairs = list(zip(scene.bodies, choice.parts, strict=True))
    modes = {b.name: list(p.modes) for b, p in pairs if p.shapes is None and p.count < b.model.n}
    loads = {b.name: p.loads for b, p in pairs if p.count and p.loads is not None}
    stiffened = replace(
        scene, bodies=tuple(stiffening_by(b, loads[b.name]) if b.name in loads else b for b in scene.bodies)
    )
    varied = vary(_in_shapes(stiffened, choice), modes=modes, drop={b.name: p.dropped for b, p in pairs if p.dropped})
    return replace(in_space(varied) if choice.plane == "none" else varied, plane=choice.plane)


def _in_shapes(scene: Scene, choice: Choice) -> Scene:
    """The scene with the bodies in shapes where the choice has them, and forces on modes with them."""
    bases = {
        b.name: p.basis(b.model.n) for b, p in zip(scene.bodies, choice.parts, strict=True) if p.shapes is not None
    }
    if not bases:
        return scene
    bodies = tuple(in_basis(body, bases[body.name]) if body.name in bases else body for body in scene.bodies)
    return replace(scene, bodies=bodies, forces=in_bases(scene.forces, bases))


def in_basis(body: Body, V: Array) -> Body:
    """The body in elastic coordinates p, q = V p (see `ffr_dyn.variants.variant.with_basis`), from the nearest state."""
    model = with_basis(body.model, V)
    rates = np.einsum("ia,i,ia->a", V, body.damping * np.sqrt(body.model.omega2), V)
    damping = rates / np.where(model.omega2 > 0, np.sqrt(model.omega2), 1.0)
    return replace(body, model=model, q=body.q @ V, q_dot=body.q_dot @ V, damping=damping)


def orthonormal(shapes: Array, omega2: Array) -> Array:
    """(n, m) the span of shapes (n, m) with V^T V = I and V^T Omega^2 V diagonal, ascending; without dependent ones."""
    left, values, _ = np.linalg.svd(shapes / np.linalg.norm(shapes, axis=0), full_matrices=False)
    Q = left[:, values > 1e-9 * values.max()]
    _, vectors = np.linalg.eigh(Q.T @ (omega2[:, None] * Q))
    V: Array = Q @ vectors
    V *= np.sign(V[np.abs(V).argmax(axis=0), np.arange(V.shape[1])])
    return V


def kind(scene: Scene, choice: Choice, number: int, output_step: float) -> str:
    """The kind of a body in a model: rigid, quasi-static (no mode is slow enough for the step to resolve it) or flexible."""
    part, model = choice.parts[number], scene.bodies[number].model
    if not part.count:
        return RIGID
    lowest = lowest_frequency(model, part.basis(model.n))
    implicit = type(choice.integrator(output_step)).implicit
    return QUASI_STATIC if implicit and lowest * output_step / choice.divisions > 1.0 else FLEXIBLE


def lowest_frequency(model: FlexibleBody, V: Array) -> float:
    """[rad/s] the lowest of a body in the shapes V (n, m), free or held at any one of its interfaces: joints are between."""
    T = block_diag(np.eye(6), V)
    M = T.T @ mass_of_motions(model) @ T
    K = T.T @ np.diag(np.concatenate([np.zeros(6), model.omega2])) @ T
    found = []
    for rows in (np.zeros((0, 6 + model.n)), *interface_motions(model).reshape(-1, 6, 6 + model.n)):
        Z = null_space(rows @ T) if len(rows) else np.eye(len(T.T))
        squares = eigh(Z.T @ K @ Z, Z.T @ M @ Z, eigvals_only=True)
        found.append(float(np.sqrt(squares[0 if len(rows) else 6])))  # a free body has six motions without deformation
    return min(found)


def _without(stiffening: bool) -> tuple[str, ...]:
    return () if stiffening else (STIFFENING,)
