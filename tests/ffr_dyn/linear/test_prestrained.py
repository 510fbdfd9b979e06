"""A swept blade that turns: what bending the stiff way does to its vibrations beyond second order is told, with a cure."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import ffr_dyn as fd
import ffr_prep as fp

HUB, CORNER, OUTER, SWEEP = 0.0635, 0.8001, 0.1524, np.pi / 6


@cache
def blade(parts: int | None) -> fp.FlexibleBody:
    member = fp.Member(fp.rectangle(0.0016, 0.0254), fp.Material("aluminium", 7.31e10, 0.33, 2768.0), (0, 1.0, 0))
    tip = (CORNER + OUTER * np.cos(SWEEP), OUTER * np.sin(SWEEP), 0.0)
    frame = fp.polyline([(0, 0, 0), (CORNER, 0, 0), tip], member, elements=12)
    model = fp.from_frame(
        fp.named(frame, root=(0, 0, 0), tip=tip), [fp.InterfaceRegion("root"), fp.InterfaceRegion("tip")]
    )
    how = fp.Request(name="blade", reference=fp.FixedTo("root"), reduction=fp.CraigBampton(8), parts=parts)
    return fp.reduce(model, how)


def turning(speed: float, parts: int | None = None) -> fd.Scene:
    hub = fd.rigid_body("hub", mass=1.0, inertia=(1.0, 1.0, 1.0), points={"o": (0, 0, 0), "rim": (HUB, 0, 0)})
    joints = (fd.Joint("axis", "revolute", "ground.O", "hub.o"), fd.Joint("clamp", "fixed", "hub.rim", "blade.root"))
    bodies = (fd.Body("hub", hub), fd.Body("blade", blade(parts), position=(HUB, 0, 0)))
    return fd.Scene(bodies, joints, (fd.Driver("motor", "axis", fd.polynomial(0.0, speed)),), ground={"O": (0, 0, 0)})


def doubts(scene: fd.Scene) -> list[str]:
    notes = fd.linearise(fd.scene_at(scene, fd.steady(scene))).notes
    return [note for note in notes if "beyond second order" in note]


@pytest.mark.slow
def test_what_is_missing_of_a_frequency_is_told_where_it_is_much():
    assert doubts(turning(20.0)) == []
    (note,) = doubts(turning(78.5))
    assert note.startswith("body 'blade' is deformed")
    assert "up to 0.009 may be missing" in note
    assert note.endswith("3 parts would do (ffr-prep reduce --parts)")
    assert doubts(turning(78.5, parts=3)) == []
    told = fd.campbell(turning(1.0), speeds=(20.0, 78.5)).attributes["notes"]
    assert [one for one in told if "beyond second order" in one]
