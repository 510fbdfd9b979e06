"""What is seen of an object in a terminal and a notebook: a few lines that say what one wants to know."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from boxes import STEEL, box_mesh
from matrix_models import of_frame, space_frame
from synthetic import cloud

import ffr_prep as fp

ENDS = [fp.InterfaceRegion("a"), fp.InterfaceRegion("b")]


@pytest.fixture(scope="module")
def things():
    mesh, frame = box_mesh("tet10", (1.0, 0.1, 0.1), (4, 1, 1)), space_frame()
    matrices = of_frame(frame)
    solid = fp.from_mesh(mesh, STEEL, [fp.InterfaceRegion("left"), fp.InterfaceRegion("end", "right", "mean")])
    model = fp.from_frame(frame, ENDS)
    request = fp.Request(name="space frame", reference=fp.FixedTo("a"), reduction=fp.CraigBampton(3), stress=True)
    body = fp.reduce(model, request)
    return {
        "mesh": mesh,
        "block": mesh.blocks[0],
        "frame": frame,
        "matrices": matrices,
        "solid": solid,
        "coupled": solid.coupled,
        "model": model,
        "of matrices": fp.from_matrices(matrices, ENDS),
        "tied": fp.tied({"one": model, "two": solid}, [("one.b", "two.left")]),
        "request": request,
        "body": body,
        "rigid": fp.rigid_body("ball", mass=2.0, inertia=(1.0, 1.0, 1.0)),
        "interface": body.interfaces[0],
        "surface": body.surface,
        "beams": body.surface.beams,
    }


THINGS = (
    "mesh", "block", "frame", "matrices", "solid", "coupled", "model", "of matrices", "tied", "request", "body", "rigid",
    "interface", "surface", "beams",
)  # fmt: skip


@pytest.mark.parametrize("name", THINGS)
def test_a_few_lines_say_it(things, name):
    text = repr(things[name])
    assert type(things[name]).__name__ in text
    assert len(text.splitlines()) <= 10
    assert len(text) <= 1000


def test_many_and_long_names_are_cut(things):
    mesh = replace(things["mesh"], node_groups={f"a rather long name of a group {k}": np.arange(2) for k in range(500)})
    body = cloud(7)
    at = body.interfaces[0]
    many = tuple(replace(at, name=f"an interface with a long name {k}") for k in range(200))
    for thing in (mesh, replace(body, name="b" * 500, interfaces=many, stiffening=None)):
        assert len(repr(thing).splitlines()) <= 10
        assert len(repr(thing)) <= 1000


def test_a_body_says_what_one_wants_to_know(things):
    body = things["body"]
    for text in (repr(body), body._repr_html_()):
        for fact in (
            "space frame",
            f"{body.mass:.6g} kg",
            "a (node)",
            "FixedTo",
            "CraigBampton",
            "geometric stiffening",
        ):
            assert fact in text
        assert f"{body.n}: {body.frequencies[0]:.4g}" in text
        assert "section forces" in text
    assert body._repr_html_().startswith("<table>")
    assert "none: rigid" in repr(things["rigid"])


def test_a_model_says_of_what_it_is(things):
    assert "left (rigid), end (mean)" in repr(things["solid"])
    assert "tet10" in repr(things["mesh"])
    assert "one, two" in repr(things["tied"])
    assert "9 beams" in repr(things["frame"])


def test_names_are_escaped_in_notebooks():
    assert "<b>" not in fp.rigid_body("<b>", mass=1.0, inertia=(1.0, 1.0, 1.0))._repr_html_()
