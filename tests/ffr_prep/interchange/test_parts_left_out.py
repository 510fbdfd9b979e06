"""What a format of another program cannot hold of a body is told."""

from __future__ import annotations

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp
from ffr_prep.interchange.formats import export_body, import_body

LINE = fp.polyline(
    [(0, 0, 0), (2, 0, 0)], fp.Member(fp.rectangle(0.02, 0.03), fp.material("steel"), (0, 1, 0)), elements=8
)
MODEL = fp.from_frame(fp.named(LINE, a=(0, 0, 0), b=(2, 0, 0)), [fp.InterfaceRegion("a"), fp.InterfaceRegion("b")])


def rod(parts: int | None) -> fp.FlexibleBody:
    request = fp.Request(name="rod", reference=fp.FixedTo("a"), reduction=fp.CraigBampton(2), parts=parts)
    return fp.reduce(MODEL, request)


@pytest.mark.parametrize("ending", ["fem", "SID_FEM"])
def test_an_export_tells_that_it_leaves_out_the_parts(tmp_path, ending):
    path = tmp_path / f"rod.{ending}"
    assert any(
        "the format has no parts: the body is written in one piece" in one
        for one in export_body(rod(2), path, False, {})
    )
    assert not any("parts" in one for one in export_body(rod(None), path, False, {}))


def test_displacements_of_a_body_in_parts_tell_from_where_they_are_seen():
    clamp = fd.Joint("clamp", "fixed", "ground.wall", "rod.a")
    texts = [
        fd.assembly(fd.Scene([fd.Body("rod", body)], [clamp], ground={"wall": (0, 0, 0)}))
        .quantity("rod.b.displacement")
        .description
        for body in (rod(2), rod(None))
    ]
    assert texts[0].endswith("seen from the part 'rod_2'")
    assert texts[1].endswith("body axes")


@pytest.mark.parametrize(("ending", "told"), [("fem", False), ("SID_FEM", True)])
def test_an_export_tells_that_the_second_moments_are_not_apart_from_the_geometric_stiffness(tmp_path, ending, told):
    """What a round trip through SID changes: I9, which `.fem` keeps."""
    body, path = rod(None), tmp_path / f"rod.{ending}"
    assert any("Oe.m1" in one for one in export_body(body, path, False, {})) is told
    back = import_body(path)
    assert bool(np.abs(back.I9 - body.I9).max() > 0.01 * np.abs(body.I9).max()) is told
    linear = fp.reduce(
        MODEL, fp.Request(name="rod", reference=fp.FixedTo("a"), reduction=fp.CraigBampton(2), linear=True)
    )
    assert export_body(linear, path, False, {}) == ()
    np.testing.assert_allclose(import_body(path).I9, linear.I9, atol=1e-9)


@pytest.mark.parametrize("ending", ["fem", "SID_FEM"])
def test_an_export_tells_that_it_leaves_out_the_stress(tmp_path, ending):
    request = fp.Request(name="rod", reference=fp.FixedTo("a"), reduction=fp.CraigBampton(2), stress=True)
    said = export_body(fp.reduce(MODEL, request), tmp_path / f"rod.{ending}", False, {})
    assert any("the format has no stress" in one for one in said)
