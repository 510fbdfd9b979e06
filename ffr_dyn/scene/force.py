"""What a force is: the one protocol that all kinds of applied load keep, and the list of the kinds.

A kind is a frozen dataclass in a file of its own (`ffr_dyn.scene.forces`), with a compiled kernel in another
(`ffr_dyn.kernels.forces`). It says where it acts (a `Place`) and by which law; scenes, scene files, tables, equations,
results and documentation ask it for what they need, and know no kind by name.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Protocol, TypeVar, get_type_hints

import numpy as np

from ffr_dyn.scene.fields import PerMode
from ffr_prep.common.errors import InputError

Array = np.ndarray
AnyScene = Any  # a `ffr_dyn.scene.scene.Scene`, whose module imports this one


@dataclass(frozen=True)
class Measured:
    """A number, or three, that a result keeps of a force: `sign` times the recorded ones from `column` on."""

    name: str
    unit: str
    text: str
    column: int
    size: int = 1
    sign: float = 1.0


class Place(Protocol):
    """Where a force acts: what its law is a function of, and what it works on.

    way      : which of several such coordinates or axes, a word of `ffr_dyn.kernels.tables.WAYS`
    rank     : forces of lower rank are applied first, equal ones as declared
    initial  : what is recorded of a force there, as it is before the start
    measured : how a result names it
    """

    @property
    def way(self) -> str: ...
    @property
    def rank(self) -> int: ...
    @property
    def initial(self) -> tuple[float, ...]: ...
    @property
    def measured(self) -> tuple[Measured, ...]: ...
    def check(self, scene: AnyScene) -> None:
        """InputError when the scene has no such place."""

    def markers(self, scene: AnyScene) -> tuple[str, ...]:
        """Names of the markers on which it acts."""

    def ends(self, scene: AnyScene) -> tuple[int, int]:
        """Numbers of its markers, -1 for what is none; or the number of its body."""

    def numbers(self, scene: AnyScene) -> Sequence[float]:
        """What compiled code knows of it, such as axes."""

    def stays_in_plane(self, scene: AnyScene, normal: int) -> bool:
        """Whether what acts there, whatever its size, moves bodies only in the plane across the global axis `normal`."""


class Moment(Protocol):
    """Time [s] and state (a `ffr_dyn.equations.state_view.StateView`) at which a law is evaluated."""

    @property
    def t(self) -> float: ...
    @property
    def state(self) -> Any: ...
    def value(self, function: Any) -> tuple[float, float, float]:
        """A number or function of time now, and two derivatives."""


class LoadTable(Protocol):
    """What collects the numbers of forces while a scene is compiled; each method says where what it is given is kept."""

    @property
    def scene(self) -> AnyScene: ...
    def function(self, value: Any) -> int:
        """A number or function of time: the number of the function."""

    def callback(self, function: Callable[..., Any] | None, *sizes: int) -> int:
        """A Python function of (t, state) that returns as many numbers: its first among the user's values; -1 for None."""

    def curve(self, value: Any) -> int:
        """Where a curve begins; -1 for what is none."""


@dataclass(frozen=True)
class LawNumbers:
    """What compiled code knows of a law: numbers, its function of time and its first among the user's values, or -1."""

    numbers: Sequence[float] | Array
    function: int = -1
    user: int = -1


class Force(ABC):
    """One applied load. Kinds are final; what follows here holds unless a kind says otherwise.

    table    : the field of `Scene`, and the table of a scene file, that holds it;  word : its `kind` there
    kernel   : "module:name" of its compiled form, which takes (tables, number of the force, x, f, load)
    acts, positive : what it is and which way it counts, for the table in docs/forces.md
    stores_energy  : it has an `energy`
    given    : how many components are given from outside, so that analyses can size them, 0 where the state makes the force;
               the numbers of its law begin with a factor for each, then their functions of time or -1
    """

    name: str
    table: ClassVar[str] = "forces"
    word: ClassVar[str]
    kernel: ClassVar[str]
    acts: ClassVar[str]
    positive: ClassVar[str]
    stores_energy: ClassVar[bool] = False
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
        """What the kernel reads of the law."""

    def energy(self, c: Array) -> Array:
        """(T,) [J] stored at recorded coordinates (T,) or (T, 6)."""
        return np.zeros(len(c))

    def check(self, scene: AnyScene) -> None:
        """InputError when the scene has not what the force needs."""
        self.place.check(scene)

    def stays_in_plane(self, scene: AnyScene, normal: int) -> bool:
        """Whether it moves bodies only in the plane across the global axis `normal`."""
        return self.place.stays_in_plane(scene, normal)


# ---- the kinds ----------------------------------------------------------------------------------------------------

FORCES: list[type[Force]] = []

Kind = TypeVar("Kind", bound=type[Force])


def register(kind: Kind) -> Kind:
    """Make a kind of force known to scenes, scene files and documentation; a decorator of its class.

    Raises InputError for a word that another kind has.
    """
    for other in FORCES:
        if (other.table, other.word) == (kind.table, kind.word) and other.__qualname__ != kind.__qualname__:
            raise InputError(f"{kind.__name__}: {other.__name__} has the word {kind.word!r} already; give it another")
    FORCES[:] = [other for other in FORCES if (other.table, other.word) != (kind.table, kind.word)] + [kind]
    return kind


def kinds_in(table: str) -> tuple[type[Force], ...]:
    """The kinds that a field of `Scene` holds."""
    return tuple(kind for kind in FORCES if kind.table == table)


# ---- of a scene ---------------------------------------------------------------------------------------------------


def forces_of(scene: AnyScene) -> list[Force]:
    """All applied loads but gravity, in the order in which they are applied and their powers are recorded: by rank."""
    return sorted([*scene.loads, *scene.springs, *scene.forces], key=lambda force: force.place.rank)


def kernels_of(scene: AnyScene) -> list[str]:
    """The kernels that a scene needs, in the order of their numbers in its tables."""
    return list(dict.fromkeys(force.kernel for force in forces_of(scene)))


def loaded_markers(scene: AnyScene) -> list[str]:
    """The markers on which applied loads act, in any order."""
    return [name for force in forces_of(scene) for name in force.place.markers(scene)]


def modal_fields(force: Force) -> list[str]:
    """Fields with a number for each elastic coordinate of the body."""
    hints = get_type_hints(type(force), include_extras=True)
    return [name for name, hint in hints.items() if any(isinstance(m, PerMode) for m in _said(hint))]


def in_bases(scene: AnyScene, bases: Mapping[str, Array]) -> AnyScene:
    """The scene with forces on elastic coordinates expressed in others: V (n, m) by name of a body, q = V p.

    Raises InputError for a force on modes that the body does not have.
    """

    def changed(force: Any) -> Any:
        for name in modal_fields(force):
            if force.body in bases:
                values, V = getattr(force, name), bases[force.body]
                if len(values) != len(V):
                    raise InputError(
                        f"force {force.name!r} acts on modes of {force.body!r}, which another body file does not have"
                    )
                force = replace(force, **{name: values @ V})
        return force

    return replace(scene, forces=tuple(map(changed, scene.forces)))


def _said(hint: Any) -> tuple[Any, ...]:
    return getattr(hint, "__metadata__", ())
