"""Frames from geometry: the curves of a file that gmsh reads, with what each group of them is made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from ffr_prep.errors import InputError
from ffr_prep.frame import Frame, Member
from ffr_prep.gmsh_source import WITH_UNIT, declared_unit, lines_from_gmsh
from ffr_prep.mesh import UNITS, check_request, choice

Array = np.ndarray

SUFFIXES = (".geo", ".msh", ".step", ".stp", ".brep", ".med", ".unv")


def read_frame(
    path: str | Path,
    members: Mapping[str, Member],
    *,
    unit: str | None = None,
    size: float | None = None,
    numbers: Mapping[str, float] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Frame:
    """A frame of beams from the curves of a file, in metres; geometry is meshed by gmsh first.

    members : what each group of curves is made of; curves without groups are named curve_1, curve_2, ...
    unit, size, numbers, progress : as in `ffr_prep.mesh.read_mesh`; a curved bar becomes straight elements

    Groups of points and of curves become groups of nodes, to which interfaces attach.

    Raises InputError for a file or an argument that cannot be used, curves without a member and members without
    curves; ComputationError when meshing fails.
    """
    path, numbers = Path(path), dict(numbers or {})
    check_request(path, unit, size, numbers, 1)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: frames are read from {', '.join(SUFFIXES)}; convert it with gmsh -save to .msh")
    if progress:
        progress("read the frame")
    declared = declared_unit(path) if path.suffix.lower() in WITH_UNIT else "m"
    points, lines, nodes = lines_from_gmsh(path, unit=declared, size=size, numbers=numbers)
    _check_members(path, lines, members)
    return _frame(points * UNITS[unit or declared], lines, nodes, members)


def _frame(
    points: Array, lines: Mapping[str, Array], nodes: Mapping[str, Array], members: Mapping[str, Member]
) -> Frame:
    """Without the nodes that no element uses."""
    elements = np.concatenate([lines[name] for name in members])
    used = np.unique(elements)
    new = np.full(len(points), -1)
    new[used] = np.arange(used.size)
    groups = {name: np.unique(new[of][new[of] >= 0]) for name, of in nodes.items()}
    return Frame(
        points=points[used],
        elements=new[elements],
        members=tuple(members.values()),
        member_of=np.repeat(np.arange(len(members)), [len(lines[name]) for name in members]),
        node_groups={name: of for name, of in groups.items() if of.size},
    )


def _check_members(path: Path, lines: Mapping[str, Array], members: Mapping[str, Member]) -> None:
    filled = [name for name, of in lines.items() if len(of)]
    if not filled:
        raise InputError(f"{path} has no curves with line elements; draw the axes of the beams as curves")
    unknown = [name for name in members if name not in filled]
    if unknown:
        raise InputError(f"{path} has no group of curves {unknown[0]!r}; {choice(unknown[0], dict.fromkeys(filled))}")
    bare = [name for name in filled if name not in members]
    if bare:
        raise InputError(
            f"{path}: the group of curves {bare[0]!r} has no member; say what it is made of, for example "
            f"members={{{bare[0]!r}: Member(tube(0.03, 0.002), material('steel'))}}"
        )
