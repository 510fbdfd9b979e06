"""Archives of Ansys Mechanical APDL: blocks in columns, collapsed bricks, components, what is left out.

The format is that of the Programmer's Reference, section 3; which nodes of a brick coincide in a wedge, a pyramid and a
tetrahedron is that of the Element Reference, SOLID185 and SOLID186.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from boxes import box_mesh

from ffr_prep.common.errors import InputError
from ffr_prep.mesh.mesh import Mesh, check_mesh, read_mesh

TYPES = {"tet4": 285, "tet10": 187, "hex8": 185, "hex20": 186, "wedge6": 185, "wedge15": 186, "pyramid5": 185}
TYPES |= {"pyramid13": 186, "collapsed tet4": 185, "collapsed tet10": 186}
# Of each node of the brick the one of the element: corners, edges below, above, between.
BRICKS = {
    "wedge6": [0, 1, 2, 2, 3, 4, 5, 5],
    "wedge15": [0, 1, 2, 2, 3, 4, 5, 5, 6, 7, 2, 8, 9, 10, 5, 11, 12, 13, 14, 14],
    "pyramid5": [0, 1, 2, 3, 4, 4, 4, 4],
    "pyramid13": [0, 1, 2, 3, 4, 4, 4, 4, 5, 6, 7, 8, 4, 4, 4, 4, 9, 10, 11, 12],
    "collapsed tet4": [0, 1, 2, 2, 3, 3, 3, 3],
    "collapsed tet10": [0, 1, 2, 2, 3, 3, 3, 3, 4, 5, 2, 6, 3, 3, 3, 3, 7, 8, 9, 9],
}
END = "N,UNBL,LOC,       -1,\n"


def columns(numbers: Sequence[int], width: int) -> str:
    return "".join(f"{n:{width}d}" for n in numbers)


def archive(kind: str, mesh: Mesh, *, width: int = 9, more: str = "", unit: str = "MPA") -> str:
    """The text of a mesh, lengths in millimetres; trailing zeros of coordinates are left out, as Ansys does."""
    lines = [
        f"/UNITS,{unit}",
        "/PREP7",
        "ETBLOCK,        1,        1",
        "(2i9,19a9)",
        columns([1, TYPES[kind]], 9),
        "       -1",
    ]
    lines += [f"NBLOCK,6,SOLID,{len(mesh.points):9d},{len(mesh.points):9d}", f"(3i{width},6e21.13e3)"]
    for k, point in enumerate(1000 * mesh.points):
        kept = point[: max(np.flatnonzero(point), default=-1) + 1]
        lines.append(columns([k + 1, 0, 0], width) + "".join(f"{x:21.13E}" for x in kept))
    count = len(mesh.blocks[0].nodes)
    lines += [END.strip(), f"EBLOCK,19,SOLID,{count:9d},{count:9d}", f"(19i{width})"]
    for k, nodes in enumerate(mesh.blocks[0].nodes + 1):
        own = nodes[BRICKS[kind]] if kind in BRICKS else nodes
        lines.append(columns([3, 1, 1, 1, 0, 0, 0, 0, len(own), 0, 10 + k, *own[:8]], width))
        lines += [columns(own[8:], width)] * (len(own) > 8)
    return "\n".join([*lines, "       -1", more, "FINISH", ""])


def written(folder: Path, text: str) -> Path:
    (folder / "part.cdb").write_text(text)
    return folder / "part.cdb"


@pytest.mark.parametrize("width", [8, 10])
@pytest.mark.parametrize("kind", TYPES)
def test_elements_are_what_their_nodes_mean(tmp_path, kind, width):
    ours = kind.removeprefix("collapsed ")
    mesh = box_mesh(ours, (0.4, 0.2, 0.1), (2, 1, 1))
    read = read_mesh(written(tmp_path, archive(kind, mesh, width=width)))
    check_mesh(read)
    assert [block.kind for block in read.blocks] == [ours]
    np.testing.assert_array_equal(read.blocks[0].nodes, mesh.blocks[0].nodes)
    np.testing.assert_allclose(read.points, mesh.points, atol=1e-15)
    np.testing.assert_array_equal(read.volume_groups["material_3"], np.arange(len(mesh.blocks[0].nodes)))


def test_components_are_groups_and_negative_numbers_close_ranges(tmp_path):
    more = "CMBLOCK,ENDS,NODE,       4  ! users node component definition\n(8i10)\n" + columns([2, -5, 9, 4711], 10)
    more += "\nCMBLOCK,HALF,ELEM,       1\n(8i10)\n" + columns([11], 10)
    mesh = box_mesh("hex8", (0.4, 0.2, 0.1), (2, 1, 1))
    read = read_mesh(written(tmp_path, archive("hex8", mesh, more=more)))
    np.testing.assert_array_equal(read.node_groups["ENDS"], [1, 2, 3, 4, 8])
    np.testing.assert_array_equal(read.volume_groups["HALF"], [1])


def test_what_is_no_solid_is_told(tmp_path):
    """A mass, springs and shells among the solids; contact in a block of its own; constraint equations and supports."""
    text = archive("hex8", box_mesh("hex8", (0.4, 0.2, 0.1), (2, 1, 1)))
    others = "ET,2,21\nET,3,COMBIN14\nET,4,181\nET,5,200\nET,6,174\n"
    rows = [[1, 2, 1, 1, 0, 0, 0, 0, 1, 0, 90, 1], [1, 3, 1, 1, 0, 0, 0, 0, 2, 0, 91, 1, 2]]
    rows += [[1, kind, 1, 1, 0, 0, 0, 0, 4, 0, 90 + kind, 1, 2, 3, 4] for kind in (4, 5)]
    more = "".join(columns(row, 9) + "\n" for row in rows)
    text = text.replace("NBLOCK", others + "NBLOCK").replace("       -1\n\nFINISH", more + "       -1\n")
    contact = "TYPE,6\nEBLOCK,10,,,1\n(15i9)\n" + columns([95, 1, 1, 1, 0, 1, 2, 3, 4], 9) + "\n       -1\n"
    read = read_mesh(written(tmp_path, text + contact + "CE,R5.0,DEFI,2,1,0.\nD,1,UX,0.\nFINISH\n"))
    assert [note.partition(";")[0] for note in read.notes] == [
        "1 of type 14 left out: springs and dashpots",
        "1 of type 21 left out: masses",
        "1 of type 181 left out: shells and membranes",
        "1 CE left out: rigid and averaging connections",
        "1 of type 174 left out: connections of parts",
        "1 D left out: supports",
    ]
    assert len(read.blocks[0].nodes) == 2


@pytest.mark.parametrize(("unit", "length"), [("MPA", 0.4), ("SI", 400.0), ("CGS", 4.0), ("BIN", 400 * 0.0254)])
def test_the_unit_is_the_declared_one(tmp_path, unit, length):
    mesh = box_mesh("hex8", (0.4, 0.2, 0.1), (2, 1, 1))
    read = read_mesh(written(tmp_path, archive("hex8", mesh, unit=unit)))
    assert np.ptp(read.points[:, 0]) == pytest.approx(length, rel=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("NBLOCK,6", "NODES,6", "it has no NBLOCK"),
        ("ETBLOCK", "ETBLOK", "element 10 is of type 1, which no ET or ETBLOCK defines"),
        ("(3i9,6e21.13e3)", "(free)", "is damaged: what begins on line 7 does not end, or lacks numbers"),
        ("       -1\n\nFINISH", "", "what begins on line 22 does not end"),
        ("        8        0       11        5", "        8        0       11     4711", "refers to node 4711"),
        ("       11        5        9", "       11        5        5", "make no wedge, pyramid or tetrahedron"),
        ("        8        0       11        5", "        8        0       11        0", "lacks some of the nodes"),
    ],
)
def test_archives_that_cannot_be_used(tmp_path, old, new, said):
    text = archive("hex8", box_mesh("hex8", (0.4, 0.2, 0.1), (2, 1, 1)))
    assert old in text
    with pytest.raises(InputError, match=said):
        read_mesh(written(tmp_path, text.replace(old, new, 1)))


def test_bricks_whose_nodes_in_the_middle_are_all_dropped_are_of_first_order(tmp_path):
    mesh = box_mesh("hex20", (0.4, 0.2, 0.1), (1, 1, 1))
    text = archive("hex20", mesh)
    middle = columns(mesh.blocks[0].nodes[0, 8:] + 1, 9)
    read = read_mesh(written(tmp_path, text.replace(middle, columns([0] * 12, 9))))
    assert read.blocks[0].kind == "hex8"
    with pytest.raises(InputError, match="element 10 lacks some of the nodes in the middle"):
        read_mesh(written(tmp_path, text.replace(middle, columns([0, *mesh.blocks[0].nodes[0, 9:] + 1], 9))))
