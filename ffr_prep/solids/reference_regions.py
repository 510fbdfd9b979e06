"""Reference conditions at regions of a mesh where no interface was asked for: which one lies there, or one more."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ffr_prep.common.errors import InputError
from ffr_prep.common.registry import choice
from ffr_prep.mesh.geometry.region_words import is_query
from ffr_prep.mesh.geometry.skin import with_regions
from ffr_prep.mesh.mesh import Mesh, region_nodes
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import ReferenceConditions, named_interfaces, renamed
from ffr_prep.solids.model import with_interfaces

_NAME = "support"


def at_regions(
    mesh: Mesh, interfaces: Sequence[InterfaceRegion], reference: ReferenceConditions
) -> tuple[list[InterfaceRegion], ReferenceConditions]:
    """Interfaces and reference conditions, where these may name regions in place of interfaces.

    An interface with the nodes of such a region is what is meant. Where there is none, one is added: a mean one, which
    leaves the stiffness of the body as it is, called "support", "support_2", ...

    Raises InputError for what is neither an interface nor a region.
    """
    known = {interface.name for interface in interfaces}
    every, meant = list(interfaces), {name: name for name in known}
    for name in dict.fromkeys(named_interfaces(reference)):
        if name not in known:
            found = _lying_at(mesh, every, name) or InterfaceRegion(_free_name(every), name, "mean")
            every += [] if found in every else [found]
            meant[name] = found.name
    return every, renamed(reference, meant)


def _lying_at(mesh: Mesh, interfaces: Sequence[InterfaceRegion], region: str) -> InterfaceRegion | None:
    """The interface that has the nodes of a region."""
    try:
        nodes = region_nodes(with_regions(mesh, [region]), region)
    except InputError as error:
        region_told = f". As a region: {error}" if is_query(region) else ", and no region is called so"
        names = choice(region, {interface.name: interface for interface in interfaces})
        raise InputError(f"reference conditions: there is no interface {region!r}; {names}{region_told}") from None
    meshed = with_interfaces(mesh, interfaces)
    same = (one for one in interfaces if np.array_equal(region_nodes(meshed, one.region or one.name), nodes))
    return next(same, None)


def _free_name(interfaces: Sequence[InterfaceRegion]) -> str:
    taken = {interface.name for interface in interfaces}
    return next(name for name in (_NAME, *(f"{_NAME}_{k}" for k in range(2, len(taken) + 3))) if name not in taken)
