"""How `ffr-prep info` tells what a body was made of: labels apart from values, one line each, no tables of drawings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from boxes import STEEL

import ffr_prep as fp
from ffr_prep.report.text import body_lines

LINES = [
    fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(fp.box(0.08, 0.12, 0.005), STEEL, (0, 1, 0))),
    fp.polyline([(1, 0, 0), (1, 1, 0)], fp.Member(fp.shear_rigid(fp.circle(0.02)), STEEL)),
]


def told(**provenance: object) -> list[str]:
    body = fp.rigid_body("boom", mass=1.0, inertia=np.eye(3))
    return list(body_lines(replace(body, provenance=provenance)))


def test_a_label_stands_apart_from_its_value():
    assert "dropped vectors 1" in told(dropped_vectors=1)
    assert "source      file a.toml" in told(source={"file": "a.toml"})


def test_a_member_is_told_by_its_section_and_material():
    record = fp.from_frame(fp.joined(*LINES)).record
    lines = [line for line in told(**record) if "Member" in line]
    assert [line[:19] for line in lines] == ["members     Member ", f"{'':12}Member "]
    for line, section in zip(
        lines, ("box 0.08 x 0.12 x 0.005 m (A 0.0019,", "circle 0.02 m (A 0.000314159,"), strict=True
    ):
        assert f"section {section}" in line
        assert "material steel (E 2.1e+11, nu 0.3, rho 7850)" in line
    assert "orientation (0, 1, 0)" in lines[0]
    assert "ky inf" in lines[1]
    assert max(map(len, lines)) < 300
    parts = told(parts={"frame": record, "rod": {"mesh": {"nodes": 8}}})
    (of_frame,) = (line for line in parts if line.startswith("parts       frame frame "))
    assert "outline" not in of_frame
    assert f"{'':12}rod mesh nodes 8" in parts
