"""The variants of a scene that a diagram compares: methods, their steps or tolerances, and models."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np

from ffr_dyn.integrators import CONTROLLED, Integrator, method_named, tolerances
from ffr_dyn.scene.scene import Scene
from ffr_dyn.variants.variant import Modes, vary
from ffr_prep.body import FlexibleBody
from ffr_prep.common.errors import InputError

STEP, TOLERANCE = "step", "tolerance"


TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
LEVELS = {True: 7, False: 4}  # steps of a ladder, each half the one before: implicit methods, explicit ones
EXPLICIT_REACH = 1.5  # step times highest circular frequency of a body at which an explicit ladder starts


@dataclass(frozen=True)
class Model:
    """A simplification of a scene: the arguments of `ffr_dyn.variants.variant.vary`, with the words for it.

    >>> model = fd.Model("4 modes", modes=4, drop=("I9",))
    """

    label: str = "full model"
    modes: Modes | Mapping[str, Modes] | None = None
    drop: tuple[str, ...] | Mapping[str, tuple[str, ...]] = ()
    rigid: tuple[str, ...] = ()
    bodies: Mapping[str, FlexibleBody] = field(default_factory=dict, repr=False)

    def of(self, scene: Scene) -> Scene:
        """The scene with these simplifications."""
        return vary(scene, modes=self.modes, drop=self.drop, rigid=self.rigid, models=self.bodies)


FULL = Model()


@dataclass(frozen=True)
class Variant:
    """A method with its number (step [s] or tolerance) on a model."""

    method: str
    number: float
    model: Model = FULL

    @property
    def kind(self) -> str:
        """The meaning of the number: "step" or "tolerance"."""
        return TOLERANCE if self.method in CONTROLLED else STEP

    @property
    def label(self) -> str:
        """Such as "ros2, step 0.0001 s, 4 modes"."""
        number = f"{self.kind} {self.number:.4g}" + (" s" if self.kind == STEP else "")
        return f"{self.method}, {number}, {self.model.label}"

    def integrator(self) -> Integrator:
        """The method, ready for a run."""
        return maker(self.method)(self.number)


def maker(method: str) -> Callable[[float], Integrator]:
    """The constructor of a method from its number. Raises InputError for an unknown one."""
    kind = method_named(method)
    return (lambda relative: kind(tolerances(relative))) if kind.controlled else kind


# ---- the grid -----------------------------------------------------------------------------------------------------


def models_of(
    scene: Scene,
    modes: Iterable[int | None] = (None,),
    drops: Iterable[Sequence[str]] = ((),),
    bodies: Mapping[str, Sequence[tuple[str, FlexibleBody]]] = {},
) -> tuple[Model, ...]:
    """Every combination of numbers of modes (None: all), dropped terms, and body files (body -> (label, body)), each once.

    A number that no body has stands for the largest that one has, and is left out where all modes are asked for as well.
    Raises InputError where modes or terms vary and no body is flexible.

    >>> models = fd.models_of(scene, modes=(2, 4, None))
    """
    numbers, chosen = tuple(modes), tuple(tuple(terms) for terms in drops)
    if not any(body.model.n for body in scene.bodies) and (numbers != (None,) or any(chosen)):
        raise InputError("the scene has no flexible body: there are no modes and no inertia terms to vary")
    meshes = [[(body, label, model) for label, model in choices] for body, choices in bodies.items()]
    own = {body.name: body.model.n for body in scene.bodies}
    found: list[Model] = []
    for picked in product(*meshes):
        most = max((own | {body: _most(model) for body, _, model in picked}).values())
        counts = [number if number is None or number < most else most for number in numbers]
        different = dict.fromkeys(None if None in counts and number == most else number for number in counts)
        found += [_model(number, terms, picked) for number in different for terms in dict.fromkeys(chosen)]
    return tuple(found)


def _most(model: FlexibleBody) -> int:
    return max(part.n for part in model.parts or (model,))


def _model(modes: int | None, drop: tuple[str, ...], meshes: Sequence[tuple[str, str, FlexibleBody]]) -> Model:
    words = [] if modes is None else ["rigid" if modes == 0 else f"{modes} mode{'s' * (modes > 1)}"]
    words += [f"without {' '.join(drop)}"] if drop else []
    words += [label for _, label, _ in meshes]
    bodies = {body: model for body, _, model in meshes}
    return Model(", ".join(words) or FULL.label, modes, drop, (), bodies)


def grid(
    scene: Scene, models: Iterable[Model], methods: Mapping[str, Sequence[float] | None], output_step: float
) -> tuple[Variant, ...]:
    """All methods with all numbers on all models, each once; numbers None stand for a ladder that `ladder` chooses."""
    found: list[Variant] = []
    for model, (method, numbers) in product(models, methods.items()):
        make = maker(method)
        chosen = numbers
        if chosen is None:
            chosen = TOLERANCES if method in CONTROLLED else ladder(model.of(scene), make, output_step)
        found += [Variant(method, number, model) for number in dict.fromkeys(map(float, chosen))]
    return tuple(found)


def ladder(scene: Scene, make: Callable[[float], Any], output_step: float) -> tuple[float, ...]:
    """Steps [s], each half the one before, all parts of the output step: from it down, or from where a method is stable."""
    implicit = make(output_step).implicit
    parts = 1 if implicit else explicit_parts(scene, output_step)
    return tuple(output_step / (parts * 2**k) for k in range(LEVELS[implicit]))


def explicit_parts(scene: Scene, output_step: float) -> int:
    """Into how many steps an output step is cut for an explicit method."""
    fastest = max(float(body.model.omega2.max(initial=0.0)) for body in scene.bodies) ** 0.5
    return max(1, int(np.ceil(output_step * fastest / EXPLICIT_REACH)))
