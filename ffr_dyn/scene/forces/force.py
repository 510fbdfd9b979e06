"""The protocol of a force, which all kinds of applied load keep.

A kind is a frozen dataclass in a file of its own here, with a compiled kernel in another (`ffr_dyn.kernels.forces`). It says
where it acts (a `Place`) and by which law; scenes, scene files, tables, equations, results and documentation ask it for what
they need, and know no kind by name.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from ffr_dyn.functions.time_functions import TimeFunction
from ffr_dyn.scene.forces.places import Place
from ffr_dyn.scene.scene import Scene
from ffr_prep.body import FlexibleBody
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError


class Moment(Protocol):
    """Time [s] and state (a `ffr_dyn.equations.state_view.StateView`) at which a law is evaluated."""

    @property
    def t(self) -> float: ...
    @property
    def state(self) -> Any: ...
    def value(self, function: Any) -> tuple[float, float, float]:
        """A number or function of time now, and two derivatives."""


class LoadTable(Protocol):
    """The collector of the numbers of forces while a scene is compiled; each method says where what it is given is kept."""

    @property
    def scene(self) -> Scene: ...
    def function(self, value: Any, *, derivatives: int = 0) -> int:
        """A number or function of time: the number of the function. A Python function must tell so many derivatives."""

    def callback(self, function: Callable[..., Any] | None, *sizes: int) -> int:
        """A Python function of (t, state) that returns as many numbers: its first among the user's values; -1 for None."""

    def curve(self, value: Any) -> int:
        """Where a curve begins; -1 for what is none."""


@dataclass(frozen=True)
class LawNumbers:
    """The numbers of a law in compiled code: constants, its function of time and its first among the user's values, or -1."""

    numbers: Sequence[float] | Array
    function: int = -1
    user: int = -1


class Kink(NamedTuple):
    """Where a law has a kink: a + b coordinate + c rate + d coordinate rate = 0, of the coordinate of this number."""

    a: float
    b: float = 1.0
    c: float = 0.0
    d: float = 0.0
    number: int = 0


class Force(ABC):
    """One applied load. Kinds are final; what follows here holds unless a kind says otherwise.

    table    : the field of `Scene`, and the table of a scene file, that holds it;  word : its `kind` there
    kernel   : its compiled form (see `ffr_dyn.kernels.simd.force_kernel`), or "package.module:name", imported when it is used
    acts, positive : what it is and which way it counts, for the table in docs/forces.md
    stores_energy  : it has an `energy`
    sudden         : the motion may change it by all of itself within a step, as where a stop is met
    throws_back    : bodies come to it and leave it again, and it has a `rebound`
    given    : how many components are given from outside, so that analyses can size them, 0 where the state makes the force;
               the numbers of its law begin with a factor for each, then their functions of time or -1

    >>> fd.register_force(CubicSpring)  # a frozen dataclass derived from fd.Force: CONTRIBUTING.md shows one
    """

    name: str
    table: ClassVar[str] = "forces"
    word: ClassVar[str]
    kernel: ClassVar[Any]
    acts: ClassVar[str]
    positive: ClassVar[str]
    stores_energy: ClassVar[bool] = False
    sudden: ClassVar[bool] = False
    throws_back: ClassVar[bool] = False
    given: ClassVar[int] = 0

    @property
    @abstractmethod
    def place(self) -> Place:
        """Where it acts."""

    @abstractmethod
    def law(self, now: Moment, c: Any, rate: Any) -> Any:
        """The readable form: force on the coordinates c of the place at these rates (see `ffr_dyn.scene.forces.places`)."""

    @abstractmethod
    def compiled(self, table: LoadTable) -> LawNumbers:
        """The numbers of the law that the kernel reads."""

    @property
    def deaf(self) -> bool:
        """Whether there are states in which the motion changes it no more: a stop that is not met, friction that slides,
        a spring within its backlash."""
        return self.sudden or bool(self.kinks)

    @property
    def kinks(self) -> tuple[Kink, ...]:
        """Where the law has a kink; steps of a fixed length end there."""
        return ()

    @property
    def damps_unevenly(self) -> bool:
        """Whether it may hold a light end back faster than a step is, and a moment later not, so that steps over that lose
        the order of their method. Limited servos lose it by little."""
        return False

    @property
    def stiff_coordinates(self) -> tuple[int, ...]:
        """Numbers of the place's coordinates along which implicit methods take it so; none: it is explicit everywhere."""
        return ()

    def slopes(self, now: Moment, c: Any, rate: Any) -> tuple[Any, Any]:
        """The slopes for implicit methods: how much the force falls with each of those coordinates and with its
        rate. Stability asks that they are no less than what the law does; negative ones count as zero."""
        return 0.0, 0.0

    def energy(self, c: Array) -> Array:
        """(T,) [J] stored at recorded coordinates (T,) or (T, 6)."""
        return np.zeros(len(c))

    def rebound(self, mass: float, rate: float) -> tuple[float, float]:
        """How long [s] a mass that comes along its coordinate at this rate is in touch with it, and the energy [J] with
        which it leaves."""
        return np.inf, 0.0

    @property
    def holds_turning(self) -> bool:
        """Whether it is stiff against the turning of its markers against each other, for less than half a turn."""
        return False

    def varied(self, share: TimeFunction) -> Force:
        """The same times a function of time. Raises InputError for a force that is not given."""
        raise InputError(f"input {self.name!r}: only a force and a moment on a marker can be varied")

    def check(self, scene: Scene) -> None:
        """InputError when the scene has not what the force needs."""
        self.place.check(scene)

    def doubts(self, scene: Scene) -> tuple[str, ...]:
        """What it does not do in the scene, and may be meant to, in sentences."""
        return ()

    def at_rest(self, rate: float) -> str | None:
        """What it does otherwise than what it stands for where its coordinate hardly moves, in a sentence."""
        return None

    def beyond(self, turned: float) -> str | None:
        """What is wrong with it, in a sentence, where the axes of its markers are turned by so much [rad] at most."""
        return None

    def drawn(self, scene: Scene) -> dict[str, Any]:
        """What a picture of it needs beside its markers, in JSON values (`ffr_dyn.scene.forces.places.Place.drawn`)."""
        return self.place.drawn(scene)

    def on_parts(self, whole: FlexibleBody, parts: Mapping[str, FlexibleBody]) -> tuple[Force, ...]:
        """The forces on the parts, by name, in place of a force on the body that they make up."""
        return (self,)

    def stays_in_plane(self, scene: Scene, normal: int) -> bool:
        """Whether it moves bodies only in the plane across the global axis `normal`."""
        return self.place.stays_in_plane(scene, normal)
