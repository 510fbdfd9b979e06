"""The triangles of a body's surface that a region of its mesh has, and the pressure on them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from places import REFERENCE

import ffr_dyn as fd
import ffr_prep as fp

HOLES = 4 * np.pi * 6.0**2 + (4 - np.pi) * 8.0**2  # [mm²] four bores and four rounded corners


@pytest.fixture(scope="module")
def mesh():
    return fp.read_mesh(REFERENCE / "plate.step", size=15.0)


@pytest.fixture(scope="module", params=[False, True], ids=["plain", "stress"])
def plate(request, mesh):
    model = fp.from_mesh(mesh, fp.material("steel"), [fp.InterfaceRegion("pin", "bore r=6 near 45,25,0")])
    how = fp.Request(
        name="plate",
        reference=fp.FixedTo("pin"),
        reduction=fp.CraigBampton(modes=1),
        linear=True,
        stress=request.param,
    )
    return fp.reduce(model, how)


def areas(body, numbers):
    """(m, 3) areas times outward normals of triangles."""
    a, b, c = body.surface.points[body.surface.triangles[numbers]].transpose(1, 0, 2)
    return np.cross(b - a, c - a) / 2


@pytest.mark.parametrize(("region", "normal"), [("plane z=10", (0, 0, 1)), ("surface_5", (0, 0, -1))])
def test_a_plane_has_its_area_and_normal(mesh, plate, region, normal):
    found = areas(plate, fp.region_triangles(mesh, plate, region))
    np.testing.assert_allclose(
        found / np.linalg.norm(found, axis=1)[:, None], np.tile(normal, (len(found), 1)), atol=1e-9
    )
    assert np.linalg.norm(found, axis=1).sum() == pytest.approx(1e-6 * (120 * 80 - HOLES), rel=2e-3)


def test_all_faces_together_are_the_surface_each_once(mesh, plate):
    parts = [fp.region_triangles(mesh, plate, f"surface_{k}") for k in range(1, 15)]
    assert sorted(np.concatenate(parts)) == list(range(len(plate.surface.triangles)))


@pytest.mark.slow
def test_a_pressure_on_a_region_that_the_body_keeps(mesh, plate):
    top = fp.region_triangles(mesh, plate, "plane z=10")
    kept = replace(plate, provenance={**plate.provenance, "regions": {"top": top.tolist()}})
    clamp = fd.Joint("clamp", "fixed", "ground.wall", "plate.pin")

    def held(body, triangles):
        wind = fd.Pressure("wind", "plate", 1e3, triangles=triangles)
        scene = fd.Scene([fd.Body("plate", body)], [clamp], forces=[wind], ground={"wall": (0, 0, 0)})
        return fd.static(scene)["clamp.force"][0]

    force = held(kept, "top")
    np.testing.assert_array_equal(force, held(plate, top))
    np.testing.assert_allclose(force, 1e3 * areas(plate, top).sum(axis=0), atol=2e-3)


def test_what_has_no_triangles_is_told(mesh, plate):
    with pytest.raises(fp.InputError, match="finds no face"):
        fp.region_triangles(mesh, plate, "plane z=11")
    with pytest.raises(fp.InputError, match="has no surface"):
        fp.region_triangles(mesh, replace(plate, surface=None), "plane z=10")
    with pytest.raises(fp.InputError, match="not made of this mesh"):
        fp.region_triangles(fp.read_mesh(REFERENCE / "plate.step", size=9.0), plate, "plane z=10")
