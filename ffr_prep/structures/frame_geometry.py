"""Frames from geometry: the curves and surfaces of a file that gmsh reads, with what each group of them is made of."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ffr_prep.common.arrays import Array
from ffr_prep.common.errors import InputError, require_kind
from ffr_prep.common.progress import Stages, no_stages
from ffr_prep.common.registry import choice
from ffr_prep.mesh.geometry.face import METRES
from ffr_prep.mesh.gmsh_files import LinesAndFaces, lines_and_faces
from ffr_prep.mesh.mesh import check_request
from ffr_prep.structures.frame import Frame, Member, Shell

SUFFIXES = (".geo", ".msh", ".step", ".stp", ".brep", ".med", ".unv")


def read_frame(
    path: str | Path,
    members: Mapping[str, Member] | None = None,
    *,
    shells: Mapping[str, Shell] | None = None,
    unit: str | None = None,
    size: float | None = None,
    numbers: Mapping[str, float] | None = None,
    progress: Stages = no_stages,
) -> Frame:
    """A frame of beams and plates from the curves and surfaces of a file, in metres; geometry is meshed by gmsh first.

    members : what each group of curves is made of; curves without groups are named curve_1, curve_2, ... Where there are
              shells, curves without a member are only edges. A group of curves that are in groups with a member needs none
    shells  : what each group of surfaces is made of, named likewise; without shells, surfaces count for nothing
    unit, size, numbers, progress : as in `ffr_prep.mesh.mesh.read_mesh`; a curved bar becomes straight elements, a curved
              surface flat ones

    Groups of points, of curves and of surfaces become groups of nodes, to which interfaces attach.

    Raises InputError for a file or an argument that cannot be used, curves without a member, surfaces without a shell,
    and members and shells without anything; ComputationError when meshing fails.

    >>> frame = fp.read_frame("tower.geo", {"legs": fp.Member(fp.tube(0.1, 0.005), fp.material("steel"))})
    """
    path, numbers = Path(path), dict(numbers or {})
    for given, kind in ((members, Member), (shells, Shell)):
        what = f"{kind.__name__.lower()}s"
        require_kind(given, Mapping | None, what, f"each group its {kind.__name__}, as in {what}={{'legs': ...}}")
        for name, one in (given or {}).items():
            require_kind(one, kind, f"{what}: {name!r}", f"a {kind.__name__}")
    members, shells = dict(members or {}), dict(shells or {})
    check_request(path, unit, size, numbers, None)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: frames are read from {', '.join(SUFFIXES)}; convert it with gmsh -save to .msh")
    progress("read the frame")
    found = lines_and_faces(path, faces=bool(shells), unit=unit, size=size, numbers=numbers)
    if shells:
        _check_shells(path, found, shells)
    _check_members(path, found.lines, members, needed=not shells)
    return _frame(found, METRES[found.unit or "m"], members, shells)


def _frame(found: LinesAndFaces, scale: float, members: Mapping[str, Member], shells: Mapping[str, Shell]) -> Frame:
    """Without the nodes that no element uses."""
    elements = np.concatenate([np.zeros((0, 2), np.int64), *(found.lines[name] for name in members)])
    triangles, quadrilaterals = (
        np.concatenate([np.zeros((0, k + 3), np.int64), *(found.faces[name][k] for name in shells)]) for k in (0, 1)
    )
    used = np.unique(np.concatenate([elements.ravel(), triangles.ravel(), quadrilaterals.ravel()]))
    new = np.full(len(found.points), -1)
    new[used] = np.arange(used.size)
    groups = {name: np.unique(new[of][new[of] >= 0]) for name, of in found.nodes.items()}
    return Frame(
        points=found.points[used] * scale,
        elements=new[elements],
        members=tuple(members.values()),
        member_of=np.repeat(np.arange(len(members)), [len(found.lines[name]) for name in members]),
        node_groups={name: of for name, of in groups.items() if of.size},
        triangles=new[triangles],
        quadrilaterals=new[quadrilaterals],
        shells=tuple(shells.values()),
        shell_of=np.concatenate(
            [np.repeat(np.arange(len(shells)), [len(found.faces[name][k]) for name in shells]) for k in (0, 1)]
        ),
    )


def _check_shells(path: Path, found: LinesAndFaces, shells: Mapping[str, Shell]) -> None:
    filled = [name for name, parts in found.faces.items() if sum(map(len, parts))]
    if not filled:
        raise InputError(f"{path} has no surfaces with elements; draw the middle planes of the plates as surfaces")
    unknown = [name for name in shells if name not in filled]
    if unknown:
        raise InputError(f"{path} has no group of surfaces {unknown[0]!r}; {choice(unknown[0], dict.fromkeys(filled))}")
    bare = _bare({name: found.faces[name] for name in filled}, shells)
    if bare:
        raise InputError(
            f"{path}: the group of surfaces {bare[0]!r} has no shell; say what it is made of, for example "
            f"shells={{{bare[0]!r}: Shell(0.002, material('steel'))}}"
        )


def _check_members(path: Path, lines: Mapping[str, Array], members: Mapping[str, Member], *, needed: bool) -> None:
    filled = [name for name, of in lines.items() if len(of)]
    if needed and not filled:
        raise InputError(f"{path} has no curves with line elements; draw the axes of the beams as curves")
    unknown = [name for name in members if name not in filled]
    if unknown:
        raise InputError(f"{path} has no group of curves {unknown[0]!r}; {choice(unknown[0], dict.fromkeys(filled))}")
    bare = _bare({name: (lines[name],) for name in filled}, members)
    if needed and bare:
        raise InputError(
            f"{path}: the group of curves {bare[0]!r} has no member; say what it is made of, for example "
            f"members={{{bare[0]!r}: Member(tube(0.03, 0.002), material('steel'))}}"
        )


def _bare(groups: Mapping[str, Sequence[Array]], made: Container[str]) -> list[str]:
    """Groups with elements that nothing says what they are made of; a group of elements of other groups is one of nodes."""
    known = {element for name, parts in groups.items() if name in made for element in _elements(parts)}
    return [name for name, parts in groups.items() if name not in made and not known.issuperset(_elements(parts))]


def _elements(parts: Sequence[Array]) -> Iterator[tuple[int, ...]]:
    """The elements by their nodes, ascending."""
    return (tuple(sorted(nodes)) for part in parts for nodes in part.tolist())
