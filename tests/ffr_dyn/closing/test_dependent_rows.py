"""Rows that rigid bodies leave dependent, and that modes move by next to nothing: redundant.

A slider-crank has its motion in a plane, and three rows too many in space. A rod with modes of the plane alone, of a mesh
that is not quite symmetric about it, moves them by 1e-5 or so of what a mode across it would. Taken for all that gives way
there, it made reactions across the plane of 1e4 times those in it, and held the rod against its own modes in the plane.
"""

from dataclasses import replace

import numpy as np
import pytest
from test_dyn_plane import slider_crank

import ffr_dyn as fd
from ffr_dyn.closing.dependent_rows import YIELDS
from ffr_dyn.integrators import ROS3

END = 0.02


def crooked(scene: fd.Scene, by: float) -> fd.Scene:
    """In space, the rod with its modes in the plane, which move its ends across it by so much of what they do in it."""
    crank, rod, block = scene.bodies
    stays = [j for j in range(rod.model.n) if max(np.abs(i.phi_t[:2, j]).max() for i in rod.model.interfaces) > 1e-6]
    stays += [
        j for j in range(rod.model.n) if j not in stays and max(abs(i.phi_r[2, j]) for i in rod.model.interfaces) > 1e-6
    ]
    rod = fd.with_modes(rod, sorted(stays))
    rng, size = np.random.default_rng(3), max(np.abs(i.phi_t).max() for i in rod.model.interfaces)
    turn = max(np.abs(i.phi_r).max() for i in rod.model.interfaces)
    ends = []
    for i in rod.model.interfaces:
        phi_t, phi_r = i.phi_t.copy(), i.phi_r.copy()
        phi_t[2] += by * size * rng.uniform(-1, 1, rod.model.n)
        phi_r[:2] += by * turn * rng.uniform(-1, 1, (2, rod.model.n))
        ends.append(replace(i, phi_t=phi_t, phi_r=phi_r))
    rod = replace(rod, model=replace(rod.model, interfaces=tuple(ends)))
    return replace(scene, bodies=(crank, rod, block), plane="none")


def forces(scene: fd.Scene) -> tuple[fd.Result, np.ndarray]:
    result = fd.forward(scene, end=END, output_step=1e-3, method=ROS3(2e-5))
    return result, result["big.force"]


@pytest.mark.parametrize("by", [1e-7, 1e-6, 1e-5, 1e-4])
def test_modes_that_move_next_to_nothing_across_leave_reactions_as_they_are(by):
    exact, wanted = forces(crooked(slider_crank(), 0.0))
    found, got = forces(crooked(slider_crank(), by))
    size = np.abs(wanted).max()
    np.testing.assert_allclose(got[:, :2], wanted[:, :2], atol=10 * by * size)
    assert np.abs(got[:, 2]).max() < max(10 * by, 1e-6) * size
    np.testing.assert_allclose(found["rod.q"], exact["rod.q"], atol=10 * by * np.abs(exact["rod.q"]).max())


def test_joints_that_hold_one_another_by_next_to_nothing_are_told():
    for by, told in ((0.0, False), (1e-5, True)):
        assembled = fd.assemble(crooked(slider_crank(), by))
        assert len(assembled.redundant) == 3
        assert any("hold one another" in note for note in assembled.notes) == told
    assert YIELDS == 1e-2


def test_bodies_with_modes_across_the_plane_have_no_redundant_rows():
    assembled = fd.assemble(replace(slider_crank(), plane="none"))
    assert assembled.redundant == ()


def test_light_bodies_do_not_make_deformation_small():
    """A crank and a block of a milligram beside a rod of a quarter of a kilogram: with modes across the plane nothing is
    redundant, as with heavy ones."""
    crank, rod, block = slider_crank().bodies
    light = (
        replace(one, model=replace(one.model, mass=1e-6, rr_dm=1e-10 * np.eye(3), r_dm=0 * one.model.r_dm))
        for one in (crank, block)
    )
    first, last = light
    assembled = fd.assemble(replace(slider_crank(), bodies=(first, rod, last), plane="none"))
    assert assembled.redundant == ()
