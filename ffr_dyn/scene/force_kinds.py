"""The kinds of force that are known, and what all forces of a scene have in common.

A kind is a class derived from `ffr_dyn.scene.forces.force.Force`; this module, which scenes need, knows none of them by name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any, TypeVar, get_type_hints

from ffr_dyn.scene.fields import PerMode
from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError

AnyScene = Any  # a `ffr_dyn.scene.scene.Scene`, whose module imports this one

FORCES: list[Any] = []

Kind = TypeVar("Kind", bound=type)


def register_force(kind: Kind) -> Kind:
    """Make a kind of force known to scenes, scene files and documentation; a decorator of its class.

    Raises InputError for a word that another kind has.

    >>> fd.register_force(CubicSpring)
    """
    new: Any = kind
    for other in FORCES:
        if (other.table, other.word) == (new.table, new.word):
            raise InputError(f"{kind.__name__}: {other.__name__} has the word {new.word!r} already; give it another")
    FORCES.append(new)
    return kind


def kinds_in(table: str) -> tuple[Any, ...]:
    """The kinds that a field of `Scene` holds."""
    return tuple(kind for kind in FORCES if kind.table == table)


# ---- of a scene ---------------------------------------------------------------------------------------------------


def forces_of(scene: AnyScene) -> list[Any]:
    """All applied loads but gravity, in the order in which they are applied and their powers are recorded: by rank."""
    every = [*scene.loads, *scene.springs, *scene.forces]
    return sorted(every, key=lambda force: force.place.rank) if len(every) > 1 else every


def kernels_of(scene: AnyScene) -> list[Any]:
    """The kernels that a scene needs, as its forces name them, in the order of their numbers in its tables."""
    return list(dict.fromkeys(force.kernel for force in forces_of(scene)))


def loaded_markers(scene: AnyScene) -> list[str]:
    """The markers on which applied loads act, in any order."""
    return [name for force in forces_of(scene) for name in force.place.markers(scene)]


def modal_fields(force: Any) -> list[str]:
    """Fields with a number for each elastic coordinate of the body."""
    kind: Any = type(force)
    return list(_modal_fields(kind))


@cache
def _modal_fields(kind: Any) -> tuple[str, ...]:
    hints = get_type_hints(kind, include_extras=True)
    return tuple(name for name, hint in hints.items() if any(isinstance(m, PerMode) for m in _said(hint)))


def in_bases(forces: tuple[Any, ...], bases: Mapping[str, Array]) -> tuple[Any, ...]:
    """Forces with those on elastic coordinates expressed in others: V (n, m) by name of a body, q = V p.

    Raises InputError for a force on modes that the body does not have.
    """

    def changed(force: Any) -> Any:
        for name in modal_fields(force):
            if force.body in bases:
                values, V = getattr(force, name), bases[force.body]
                if len(values) != len(V):
                    raise InputError(
                        f"force {force.name!r} acts on modes of {force.body!r}, which another body file does not have: put "
                        "that body into the scene itself, with values for its modes"
                    )
                force = replace(force, **{name: values @ V})
        return force

    return tuple(map(changed, forces))


def _said(hint: Any) -> tuple[Any, ...]:
    return getattr(hint, "__metadata__", ())
