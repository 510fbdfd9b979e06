"""Measures that a diagram compares: each picks a history out of a result and knows the scale of its errors.

As text (`measure_of`): "position:rod.tip", "deflection:rod" (everywhere), "deflection:rod.tip" (from the body's frame),
"deflection:rod.mid/hinge,tip" (from the chord between two other points), "reaction:hinge", "moment:hinge",
"stress:rod@0.3,0,0.01" (von Mises), "energy", "constraint", or any quantity of the scene: "rod.tip.velocity.x".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Protocol

import numpy as np

from ffr_dyn.results.quantities import Entry
from ffr_dyn.results.result import Result
from ffr_dyn.results.stress import stress_histories
from ffr_dyn.scene.parts import owner
from ffr_dyn.scene.scene import Body, Scene, marker_number, markers
from ffr_dyn.scene.stress_sensors import nearest_point
from ffr_prep.body import BodyError, Interface, displacements, some_points
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

PLACES = 48  # points of the surface at which the deflection of a whole body is looked at


class Measure(Protocol):
    """The protocol of a measure of a diagram."""

    @property
    def name(self) -> str:
        """As the user writes it."""

    @property
    def unit(self) -> str:
        """SI unit of the values."""

    @property
    def words(self) -> str:
        """Its label on an axis."""

    @property
    def outputs(self) -> tuple[str, ...]:
        """Patterns of the quantities that a run has to keep, where it has them."""

    def values(self, result: Result) -> Array:
        """(T, k) history."""

    def scale(self, result: Result) -> float:
        """The scale of errors of the history, in its unit; taken from the reference."""


@dataclass(frozen=True)
class Quantity:
    """Any quantity of a result, or its component `part`; the scale of a position is the extent of its motion, of others the
    largest value. A quantity of deformation that a rigid body does not have is zero."""

    name: str
    of: str
    unit: str
    words: str
    moves: bool = False
    part: str = ""

    @property
    def outputs(self) -> tuple[str, ...]:
        return (self.of,)

    def values(self, result: Result) -> Array:
        if self.of not in result.quantities:
            return np.zeros((result.time.size, 1))
        return result[f"{self.of}.{self.part}" if self.part else self.of].reshape(result.time.size, -1)

    def scale(self, result: Result) -> float:
        values = self.values(result)
        return _largest(values - values.mean(axis=0) if self.moves else values)


@dataclass(frozen=True)
class Deflection:
    """Elastic displacement, in body axes, of a point of a body less that of the chord between two others.

    In linear theory the chord moves with the displacement of its ends: w = u - (1 - s) u_i - s u_j, with s the place of the
    point along the chord. Without a chord it is the displacement from the body's frame.
    """

    name: str
    marker: str
    chord: tuple[str, str] | None = None
    share: float = 0.0
    unit: str = "m"

    @property
    def words(self) -> str:
        return f"deflection of {self.marker}" + (f" from {' - '.join(self.chord)}" if self.chord else "")

    @property
    def outputs(self) -> tuple[str, ...]:
        return tuple(f"{marker}.displacement" for marker in (self.marker, *(self.chord or ())))

    def values(self, result: Result) -> Array:
        u = _displacement(result, self.marker)
        if self.chord is None:
            return u
        start, end = (_displacement(result, marker) for marker in self.chord)
        return u - (1 - self.share) * start - self.share * end

    def scale(self, result: Result) -> float:
        return _largest(self.values(result))


def _displacement(result: Result, marker: str) -> Array:
    """(T, 3); nothing where the body is rigid."""
    name = f"{marker}.displacement"
    return result[name] if name in result.quantities else np.zeros((result.time.size, 3))


@dataclass(frozen=True)
class Shape:
    """Elastic displacement of a whole body, in body axes, at places (P, 3) [m] of its surface, each by 1/sqrt(P).

    The norm of a difference is then its root mean square over the places.
    """

    name: str
    body: str
    places: tuple[tuple[float, float, float], ...]
    unit: str = "m"

    @property
    def words(self) -> str:
        return f"deflection of {self.body} (root mean square)"

    @property
    def outputs(self) -> tuple[str, ...]:
        return f"{self.body}.q", f"{self.body}.*.displacement"

    def values(self, result: Result) -> Array:
        if f"{self.body}.q" not in result.quantities:
            return np.zeros((result.time.size, 3 * len(self.places)))
        surface = result.geometry[self.body]
        near = [nearest_point(surface, np.array(place), self.body) for place in self.places]
        u = displacements(some_points(surface, np.array(near), np.zeros((0, 3))), result[f"{self.body}.q"])
        return u.reshape(result.time.size, -1) / np.sqrt(len(self.places))

    def scale(self, result: Result) -> float:
        return _largest(self.values(result))


@dataclass(frozen=True)
class Stress:
    """Von Mises stress at a place [m] of a body's surface, in its frame."""

    name: str
    body: str
    place: tuple[float, float, float]
    unit: str = "Pa"

    @property
    def words(self) -> str:
        return f"von Mises stress of {self.body} at {self.place}"

    @property
    def outputs(self) -> tuple[str, ...]:
        return (f"{self.body}.q",)

    def values(self, result: Result) -> Array:
        if f"{self.body}.q" not in result.quantities:
            return np.zeros((result.time.size, 1))
        found = stress_histories(result, self.body, {"place": np.array(self.place)})
        return found[f"{self.body}.place.von-mises"][:, None]

    def scale(self, result: Result) -> float:
        return _largest(self.values(result))


@dataclass(frozen=True)
class Energy:
    """Total energy; its errors are measured against the largest kinetic or strain energy."""

    name: str = "energy"
    unit: str = "J"
    words: str = "total energy"
    outputs: tuple[str, ...] = ("energy.*",)

    def values(self, result: Result) -> Array:
        return result["energy.total"][:, None]

    def scale(self, result: Result) -> float:
        return max(_largest(result[f"energy.{kind}"][:, None]) for kind in ("kinetic", "strain"))


@dataclass(frozen=True)
class Violation:
    """Largest violation of a constraint; the reference's counts as an error too, so it is measured from zero."""

    name: str = "constraint"
    unit: str = "m"
    words: str = "constraint violation"
    outputs: tuple[str, ...] = ("constraint.position",)

    def values(self, result: Result) -> Array:
        return result["constraint.position"][:, None]

    def scale(self, result: Result) -> float:
        return 0.0


def _largest(values: Array) -> float:
    return float(np.linalg.norm(values, axis=1).max(initial=0.0))


# ---- from text ----------------------------------------------------------------------------------------------------


def measure_of(text: str, scene: Scene, quantities: Mapping[str, Entry]) -> Measure:
    """The measure that a text means in a scene.

    quantities : every quantity that the scene has, by name

    Raises InputError that names what there is.
    """
    kind, colon, what = text.partition(":")
    if not colon:
        return _plain(text, quantities)
    if kind not in _KINDS:
        raise InputError(f"measure {text!r}: there is no kind {kind!r}; there are: {', '.join(_KINDS)}")
    return _KINDS[kind](text, what, scene, quantities)


def default_measures(scene: Scene, quantities: Mapping[str, Entry]) -> tuple[Measure, ...]:
    """Of the largest flexible body: the position of its last interface and its deflection; else of the last body."""
    body = max(scene.bodies, key=lambda b: b.model.n)
    body = body if body.model.n else scene.bodies[-1]
    texts = (
        [f"position:{owner(body)}.{body.model.interfaces[-1].name}"] if body.model.interfaces else [f"{body.name}.R"]
    )
    if body.model.n and body.model.surface is not None:
        texts.append(f"deflection:{body.name}")
    return tuple(measure_of(text, scene, quantities) for text in texts)


def _plain(text: str, quantities: Mapping[str, Entry]) -> Measure:
    if text == "energy":
        return Energy()
    if text == "constraint":
        return Violation()
    head, _, label = text.rpartition(".")
    owner, part = (text, "") if text in quantities else (head, label)
    if owner not in quantities or part not in ("", *_labels(quantities[owner])):
        parts = (f"{name}.{label}" for name, entry in quantities.items() for label in _labels(entry))
        close = get_close_matches(text, [*quantities, *parts], 3, 0.4)
        hint = f"did you mean {', '.join(close)}?" if close else f"there are: {', '.join(quantities)}"
        raise InputError(f"measure {text!r} is no quantity of the scene and no kind of measure; {hint}")
    return Quantity(text, owner, quantities[owner].unit, text, owner.endswith((".position", ".R")), part)


def _labels(entry: Entry) -> tuple[str, ...]:
    """Of the components of a quantity."""
    return entry.axes[0].labels if entry.axes else ()


def _position(text: str, what: str, scene: Scene, quantities: Mapping[str, Entry]) -> Measure:
    _marker(text, what, scene)
    return Quantity(text, f"{what}.position", "m", f"position of {what}", moves=True)


def _reaction(text: str, what: str, scene: Scene, quantities: Mapping[str, Entry]) -> Measure:
    kind = {"reaction": "force", "moment": "moment"}[text.partition(":")[0]]
    if f"{what}.{kind}" not in quantities:
        known = [name.rpartition(".")[0] for name in quantities if name.endswith(".force") and name.count(".") == 1]
        raise InputError(f"measure {text!r}: there is no joint {what!r}; there are: {', '.join(known) or 'none'}")
    return Quantity(text, f"{what}.{kind}", "N" if kind == "force" else "N m", f"{kind} of {what}")


def _deflection(text: str, what: str, scene: Scene, quantities: Mapping[str, Entry]) -> Measure:
    place, _, ends = what.partition("/")
    name, dot, _ = place.partition(".")
    body = _flexible(text, name, scene)
    if not dot:
        return _shape(text, body)
    point = _marker(text, place, scene)
    if not ends:
        return Deflection(text, place)
    if ends.count(",") != 1:
        raise InputError(
            f"measure {text!r}: write the ends of the chord as two interfaces, deflection:rod.mid/left,right"
        )
    i, j = (_marker(text, f"{name}.{end}", scene) for end in ends.split(","))
    chord = j.position - i.position
    if not chord @ chord > 0:
        raise InputError(f"measure {text!r}: the chord from {i.name!r} to {j.name!r} has no length")
    share = float((point.position - i.position) @ chord / (chord @ chord))
    return Deflection(text, place, (f"{name}.{i.name}", f"{name}.{j.name}"), share)


def _shape(text: str, body: Body) -> Measure:
    surface = body.model.surface
    if surface is None:
        raise InputError(f"measure {text!r}: body {body.name!r} has no surface; name an interface of it")
    some = surface.points[np.unique(np.linspace(0, len(surface.points) - 1, PLACES).astype(int))]
    return Shape(text, body.name, tuple((float(x), float(y), float(z)) for x, y, z in some))


def _stress(text: str, what: str, scene: Scene, quantities: Mapping[str, Entry]) -> Measure:
    name, _, place = what.partition("@")
    surface = _flexible(text, name, scene).model.surface
    if surface is None or surface.stress is None:
        raise InputError(
            f"measure {text!r}: body {name!r} has no stress modes; reduce it again with them (ffr-prep reduce --stress)"
        )
    try:
        x, y, z = (float(part) for part in place.split(","))
    except ValueError:
        raise InputError(f"measure {text!r}: write the place as stress:body@x,y,z in metres, body frame") from None
    nearest_point(surface, np.array([x, y, z]), name)
    return Stress(text, name, (x, y, z))


_KINDS = {
    "position": _position,
    "deflection": _deflection,
    "reaction": _reaction,
    "moment": _reaction,
    "stress": _stress,
}


def _marker(text: str, name: str, scene: Scene) -> Interface:
    """The interface of a marker on a body."""
    try:
        b, _, point = markers(scene)[marker_number(scene, name)]
        return scene.bodies[b].model.interface(point)
    except (InputError, BodyError) as error:
        raise InputError(f"measure {text!r}: {error}") from None
    except IndexError:
        raise InputError(f"measure {text!r}: {name!r} is a point of the ground, which does not move") from None


def _flexible(text: str, name: str, scene: Scene) -> Body:
    flexible = [body for body in scene.bodies if body.model.n]
    for body in flexible:
        if body.name == name:
            return body
    known = ", ".join(body.name for body in flexible) or "none"
    raise InputError(f"measure {text!r}: there is no flexible body {name!r}; there are: {known}")
