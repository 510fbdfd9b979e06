"""Stress of results: laws of the measures, sums of modes, hot spots, section forces, references, files and the command."""

from __future__ import annotations

import csv
import json
import re
from dataclasses import replace

import h5netcdf
import numpy as np
import pytest
from boxes import STEEL, box_mesh
from click.testing import CliRunner
from PIL import Image
from scipy.spatial.transform import Rotation
from test_animate import rotating_box

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.static import static
from ffr_dyn.cli import cli
from ffr_dyn.functions.time_functions import harmonic, polynomial
from ffr_dyn.integrators import ROS2
from ffr_dyn.pictures.animate import animate
from ffr_dyn.pictures.film import film
from ffr_dyn.pictures.stress_report import StressReport, behind, report_lines, stress_report
from ffr_dyn.results.file import load_result, save_result
from ffr_dyn.results.result import Quantity, Result, mode_axis
from ffr_dyn.results.stress import (
    hot_spots,
    peaks,
    section_forces,
    section_histories,
    section_peaks,
    stress_histories,
    tensors,
    values_at,
)
from ffr_dyn.results.stress_error import stress_error
from ffr_dyn.scene.described import described
from ffr_dyn.scene.drivers import Driver
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_dyn.scene.stress_sensors import (
    MEASURES,
    nearest_element,
    principal_values,
    signed_max_principal,
    strain_of,
    von_mises,
)
from ffr_dyn.variants.variant import with_basis
from ffr_prep.body import SECTION_FORCES, BeamForces, Surface, left_out_stress, steady_stress_doubt, truncated
from ffr_prep.common.errors import InputError
from ffr_prep.mesh.mesh import Block
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.material import Material
from ffr_prep.model.reference import FixedTo, MeanAxis
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes
from ffr_prep.reduction.methods.inertia_relief import InertiaRelief
from ffr_prep.reduction.methods.union import Union
from ffr_prep.structures.frame import Member, named, polyline
from ffr_prep.structures.sections import circle, rectangle

PAIRS = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])


def matrices(six):
    return six[..., [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(*six.shape[:-1], 3, 3)


def random_surface(rng, points=7, n=3):
    """Modes of no particular body, for what is linear algebra."""
    return Surface(
        rng.normal(size=(points, 3)),
        [[0, 1, 2]],
        rng.normal(size=(points, 3, n)),
        stress=1e9 * rng.normal(size=(points, 6, n)),
        moduli=np.stack([rng.uniform(1e9, 3e11, points), rng.uniform(0.0, 0.45, points)], axis=1),
        beams=BeamForces(rng.normal(size=(4, 3, 3)), np.tile(np.eye(3), (4, 1, 1)), rng.normal(size=(4, 3, 6, n))),
    )


def random_result(rows=50, **bodies):
    rng = np.random.default_rng(11)
    surfaces = bodies or {"rod": random_surface(rng)}
    t = np.linspace(0.0, 1.0, rows)
    quantities = {}
    for name, surface in surfaces.items():
        n = surface.Phi.shape[2]
        q = 1e-3 * rng.normal(size=(rows, n))
        if n == 0:
            continue
        quantities[f"{name}.q"] = Quantity(q, "m sqrt(kg)", (mode_axis(name, n),))
    return Result(t, quantities, surfaces)


def stressed_box(amplitude=0.01):
    """The turning box of the animations; its stress is bending: E times the curvature of its sine, times y."""
    result = rotating_box(amplitude=amplitude)
    surface = result.geometry["rod"]
    x, y, _ = surface.points.T
    stress = np.zeros((len(x), 6, 1))
    stress[:, 0, 0] = STEEL.E * np.pi**2 * np.sin(np.pi * x) * y
    moduli = np.tile([STEEL.E, STEEL.nu], (len(x), 1))
    return replace(result, geometry={"rod": replace(surface, stress=stress, moduli=moduli)})


# ---- measures -----------------------------------------------------------------------------------------------------


def test_principal_values_are_those_a_rotated_state_was_made_of():
    rng = np.random.default_rng(0)
    turns = Rotation.random(500, random_state=1).as_matrix()
    uniaxial, compressed, hydrostatic = [2.0, 0, 0], [0, 0, -2.0], [-3.0, -3.0, -3.0]
    for values in (
        rng.normal(size=(500, 3)),
        uniaxial,
        compressed,
        hydrostatic,
        [0, 0, 0],
        1e8 * rng.normal(size=(500, 3)),
    ):
        made = np.broadcast_to(-np.sort(-np.asarray(values, dtype=float), axis=-1), (500, 3))
        full = np.einsum("pik,pk,pjk->pij", turns, made, turns)
        six = np.stack([full[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))], axis=1)
        np.testing.assert_allclose(principal_values(six), made, rtol=0, atol=1e-14 * max(np.abs(made).max(), 1e-300))


def test_von_mises_and_tresca_of_known_states():
    tension, shear, pressure = np.eye(6)[0], np.eye(6)[4], np.array([1.0, 1, 1, 0, 0, 0])
    assert von_mises(tension) == pytest.approx(1.0)
    assert von_mises(shear) == pytest.approx(np.sqrt(3))
    assert von_mises(pressure) == 0.0
    assert MEASURES["tresca"].of(tension) == pytest.approx(1.0)
    assert MEASURES["tresca"].of(shear) == pytest.approx(2.0)
    assert MEASURES["tresca"].of(pressure) == pytest.approx(0.0)


def test_measures_of_a_turned_tensor_stay():
    rng = np.random.default_rng(1)
    six = rng.normal(size=(20, 6))
    R = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turned = (R @ matrices(six) @ R.T)[:, *PAIRS]
    for name in ("von-mises", "tresca", "max-principal", "min-principal", "signed-max-principal"):
        np.testing.assert_allclose(MEASURES[name].of(turned), MEASURES[name].of(six), atol=1e-7)


def test_the_signed_principal_value_tells_tension_from_compression():
    states = np.array([[3.0, -1, 0, 0, 0, 0], [1.0, -3, 0, 0, 0, 0], [-2.0, -2, -2, 0, 0, 0]])
    np.testing.assert_allclose(signed_max_principal(states), [3.0, -3.0, -2.0], atol=1e-12)


def test_strain_is_that_of_hooke():
    rng = np.random.default_rng(2)
    strain, E, nu = rng.normal(size=(5, 6)), 2e11, 0.3
    lam, mu = E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 + 2 * nu)
    stress = 2 * mu * strain
    stress[:, :3] += lam * strain[:, :3].sum(axis=1, keepdims=True)
    np.testing.assert_allclose(strain_of(stress, np.tile([E, nu], (5, 1))), strain, rtol=1e-12)


# ---- sums of modes --------------------------------------------------------------------------------------------------


def test_tensors_are_sums_over_the_modes():
    result = random_result()
    surface, q = result.geometry["rod"], result["rod.q"]
    found = tensors(surface, q)
    np.testing.assert_allclose(found, np.einsum("pcj,tj->ptc", surface.stress, q), rtol=1e-9, atol=1e-3)
    some = tensors(surface, q[3:5], np.array([4, 1]))
    np.testing.assert_allclose(some, found[[4, 1], 3:5], rtol=1e-9, atol=1e-3)
    strain = tensors(surface, q, strain=True)
    for point in range(len(found)):
        np.testing.assert_allclose(strain[point], strain_of(found[point], surface.moduli[point]), rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("quantity", ["von-mises", "signed-max-principal", "strain-xy"])
@pytest.mark.parametrize("chunk", [1, 700, 10**7])
def test_peaks_are_those_of_the_whole_history(quantity, chunk, monkeypatch):
    monkeypatch.setattr("ffr_dyn.results.stress._CHUNK", chunk)
    result = random_result()
    whole = values_at(result.geometry["rod"], result["rod.q"], MEASURES[quantity])
    values, rows = peaks(result, "rod", quantity)
    np.testing.assert_array_equal(rows, np.abs(whole).argmax(axis=1))
    np.testing.assert_allclose(values, whole[np.arange(len(whole)), rows], rtol=1e-12)


def test_hot_spots_are_the_largest_and_apart():
    result = stressed_box()
    surface = result.geometry["rod"]
    spots = hot_spots(result, count=4)
    values, _ = peaks(result, "rod")
    row = int(np.abs(result["rod.q"][:, 0]).argmax())
    first = spots[0]
    assert abs(first.value) == values.max()
    assert (first.row, first.time) == (row, result.time[row])
    assert first.position == tuple(surface.points[first.point])
    assert first.position[0] == pytest.approx(0.5)
    exact = STEEL.E * np.pi**2 * 0.05 * abs(result["rod.q"][row, 0])
    assert first.value == pytest.approx(exact, rel=1e-12)
    places = np.array([spot.position for spot in spots])
    distance = np.linalg.norm(places[:, None] - places, axis=-1) + np.eye(len(places))
    assert distance.min() > 0.1
    assert [s.value for s in spots] == sorted((s.value for s in spots), reverse=True)


def test_the_place_of_a_hot_spot_holds_no_rounding():
    result = stressed_box()
    surface = result.geometry["rod"]
    first = hot_spots(result, count=1)[0].point

    def hottest_at(y, z):
        points = surface.points.copy()
        points[first, 1:] = y, z
        return hot_spots(replace(result, geometry={"rod": replace(surface, points=points)}), count=1)[0]

    spot = hottest_at(2.1431e-17, -2.1431e-17)
    assert (spot.point, spot.position) == (first, (surface.points[first, 0], 0.0, 0.0))
    told = list(report_lines(StressReport("von-mises", (spot,), {}, ())))
    assert "(      0.5,         0,         0)" in told[1]
    assert hottest_at(2e-9, -3e-9).position == (surface.points[first, 0], 2e-9, -3e-9)


def test_hot_spots_of_several_bodies_are_one_list():
    rng = np.random.default_rng(5)
    weak, strong = random_surface(rng), random_surface(rng)
    result = random_result(
        weak=weak,
        strong=replace(strong, stress=50 * strong.stress),
        rigid=random_surface(rng, n=0),
    )
    assert {spot.body for spot in hot_spots(result, count=3)} == {"strong"}
    assert {spot.body for spot in hot_spots(result, bodies=("weak",), count=2)} == {"weak"}


def test_histories_are_taken_at_the_nearest_point():
    result = random_result()
    surface, q = result.geometry["rod"], result["rod.q"]
    found = stress_histories(result, "rod", {"eye": surface.points[2] + 1e-6}, "strain-max-principal")
    np.testing.assert_allclose(found["rod.eye.stress"], tensors(surface, q)[2], rtol=1e-9, atol=1e-3)
    np.testing.assert_allclose(
        found["rod.eye.strain.xz"], tensors(surface, q, strain=True)[2, :, 4], rtol=1e-9, atol=1e-15
    )
    exact = principal_values(found["rod.eye.strain"])[:, 0]
    np.testing.assert_allclose(found["rod.eye.strain-max-principal"], exact, rtol=1e-9)
    assert found.quantity("rod.eye.stress").unit == "Pa"


# ---- section forces -------------------------------------------------------------------------------------------------


def test_section_forces_are_sums_over_the_modes():
    result = random_result()
    beams, q = result.geometry["rod"].beams, result["rod.q"]
    np.testing.assert_allclose(section_forces(result, "rod", 2)[7], beams.modes[2] @ q[7], rtol=1e-9)
    histories = section_histories(result, "rod", 2)
    exact = beams.modes[2, 1] @ q.T
    np.testing.assert_allclose(histories["rod.element_2.middle.force.Qz"], exact[2], rtol=1e-9)
    np.testing.assert_allclose(histories["rod.element_2.middle.moment.My"], exact[4], rtol=1e-9)
    assert histories.quantity("rod.element_2.last.moment").unit == "N m"
    whole = np.abs(np.einsum("esfj,tj->fest", beams.modes, q))
    for k, peak in enumerate(section_peaks(result, "rod")):
        assert peak.force == SECTION_FORCES[k]
        assert abs(peak.value) == pytest.approx(whole[k].max(), rel=1e-12)
        place = ("first", "middle", "last").index(peak.place)
        assert whole[k, peak.element, place, peak.row] == pytest.approx(abs(peak.value), rel=1e-12)


def test_the_nearest_element_is_the_one_whose_line_is_nearest():
    ends = np.array([[[0.0, 0, 0], [4.0, 0, 0]], [[4.0, 0, 0], [5.0, 0, 0]], [[5.0, 0, 0], [5.0, 3.0, 0]]])
    positions = np.stack([ends[:, 0], ends.mean(axis=1), ends[:, 1]], axis=1)
    beams = BeamForces(positions, np.tile(np.eye(3), (3, 1, 1)), np.zeros((3, 3, 6, 1)))
    for point, element in (((3.7, 0.1, 0.2), 0), ((4.4, 0, 0), 1), ((5.5, 2.0, 0), 2), ((-1.0, 0, 0), 0)):
        assert nearest_element(beams, np.array(point)) == element


# ---- references: stress by inertia --------------------------------------------------------------------------------


SPIN = 30.0  # [rad/s], well below the first bending frequency of both bodies


def settled(body, *parts):
    """The result of a body that has turned about the z axis until its vibration was damped out."""
    scene = Scene((Body("body", body, omega_bar=(0, 0, SPIN), damping=1.0),), *parts, ground={"O": (0, 0, 0)})
    return integrate(scene, end=0.2, output_step=0.2, method=ROS2(1e-4))


@pytest.mark.parametrize(("relief", "smallest", "largest"), [(True, 0.0, 0.003), (False, 0.5, 1.1)])
def test_a_rotating_bar_has_the_tension_of_the_mass_beyond(relief, smallest, largest, tmp_path):
    """sigma = E (cos kx / cos kL - 1), k^2 = rho Omega^2 / E, or nearly rho Omega^2 (L^2 - x^2) / 2.

    Fixed-interface modes alone, the first ones being bending, carry none of it: inertia needs shapes of its own.
    """
    material = replace(STEEL, nu=0.0)
    bar = fp.reduce(
        fp.from_mesh(
            box_mesh("hex20", (1.0, 0.02, 0.02), (10, 1, 1), origin=(0, -0.01, -0.01)),
            material,
            [InterfaceRegion("left")],
        ),
        fp.Request(
            name="bar",
            reference=FixedTo("left"),
            reduction=Union((CraigBampton(2), InertiaRelief())) if relief else CraigBampton(2),
            stress=True,
            linear=True,
        ),
    )
    hinge = (Joint("hinge", "revolute", "ground.O", "body.left"),)
    result = settled(bar, hinge, (Driver("motor", "hinge", polynomial(0, SPIN)),))
    found = tensors(bar.surface, result["body.q"][-1:])[:, 0]
    k = np.sqrt(material.rho / material.E) * SPIN
    exact = np.zeros_like(found)
    exact[:, 0] = material.E * (np.cos(k * bar.surface.points[:, 0]) / np.cos(k) - 1)
    assert exact.max() == pytest.approx(material.rho * SPIN**2 / 2, rel=1e-4)
    missing = np.abs(found - exact).max()
    assert smallest <= missing / exact.max() < largest
    told = stress_error(result, "body")
    assert missing - 0.003 * exact.max() <= told <= 1.05 * missing
    assert bool(steady_stress_doubt(bar.provenance)) is not relief
    written = [line for line in report_lines(stress_report(result, tmp_path)) if line.startswith("accuracy")]
    assert ("--method inertia-relief" in written[0]) is not relief


def relieved_bar():
    """A clamped bar along x, with bending shapes and those of its own inertia."""
    model = fp.from_mesh(
        box_mesh("hex20", (1.0, 0.02, 0.02), (10, 1, 1), origin=(0, -0.01, -0.01)),
        Material("metal", 7e10, 0.0, 2700.0),
        [InterfaceRegion("left")],
    )
    return fp.reduce(
        model,
        fp.Request(
            name="bar",
            reference=FixedTo("left"),
            reduction=Union((CraigBampton(2), InertiaRelief())),
            stress=True,
            linear=True,
        ),
    )


@pytest.mark.parametrize("few", [lambda bar: truncated(bar, 2), lambda bar: with_basis(bar, np.eye(bar.n)[:, :2])])
def test_what_fewer_shapes_leave_out_is_told_by_the_body_that_has_them(few):
    """Bending shows nothing of rho Omega^2 L^2 / 2 of a bar that turns across its axis; all shapes do."""
    whole = relieved_bar()
    bar = few(whole)
    tension = 2700.0 / 2
    for spin in (7, 8):  # products yy and zz
        assert left_out_stress(whole.provenance)[spin] < 0.02 * tension
        assert left_out_stress(bar.provenance)[spin] == pytest.approx(tension, rel=0.03)
    assert steady_stress_doubt(whole.provenance) is None
    assert "leave out stress of its own inertia" in steady_stress_doubt(bar.provenance)
    assert not left_out_stress(truncated(whole, 0).provenance)


@pytest.mark.parametrize("relief", [False, True])
def test_what_shapes_leave_out_of_a_slender_bar_is_told_by_each_load(relief):
    """Tension is a thousandth of the stress of bending under loads of the same size, and all there is of a bar that spins."""
    member = Member(rectangle(0.001, 0.001), Material("steel", 2.1e11, 0.3, 7850.0), (0, 1, 0))
    line = named(polyline([(0, 0, 0), (1.0, 0, 0)], member, elements=20), root=(0, 0, 0), tip=(1.0, 0, 0))
    model = fp.from_frame(line, [InterfaceRegion("root"), InterfaceRegion("tip")])
    shapes = Union((CraigBampton(6), InertiaRelief())) if relief else CraigBampton(6)
    bar = fp.reduce(model, fp.Request(name="bar", reference=FixedTo("root"), reduction=shapes, stress=True))
    told = steady_stress_doubt(bar.provenance) or ""
    assert ("62 % under spin about y, 62 % under spin about z, 49 % under weight" in told) is not relief
    assert "and z together" not in told


def test_on_an_accelerated_base_what_is_missing_is_not_known():
    """A result does not keep the acceleration of its base, which loads the shapes as gravity does."""
    bar, hinge = relieved_bar(), (Joint("hinge", "revolute", "ground.O", "body.left"),)
    known = []
    for base in ((0, 0, 0), (0, harmonic(amplitude=5.0, frequency=2.0), 0)):
        scene = Scene((Body("body", bar),), hinge, ground={"O": (0, 0, 0)}, base_acceleration=base)
        known.append("left_out_stress" in described(scene))
    assert known == [True, False]


def ring(elements, radius, thickness):
    """A closed ring of hex20 about the z axis: a box bent round, its two ends made one."""
    box = box_mesh("hex20", (1.0, 1.0, 1.0), (elements, 1, 1))
    lattice = np.round(box.points * [4 * elements, 4, 4]).astype(int) % [4 * elements, 8, 8]
    _, kept, new = np.unique(lattice, axis=0, return_index=True, return_inverse=True)
    turn, outward, across = box.points[kept].T
    r = radius + thickness * (0.5 - outward)
    points = np.stack([r * np.cos(2 * np.pi * turn), r * np.sin(2 * np.pi * turn), thickness * (across - 0.5)], axis=1)
    return replace(box, points=points, blocks=(Block("hex20", new.ravel()[box.blocks[0].nodes]),), face_groups={})


def test_a_spinning_ring_has_its_hoop_stress():
    """sigma = rho Omega^2 R^2 of a thin ring, within 1 % at every node; free, with inertia relief."""
    radius = 0.5
    body = fp.reduce(
        fp.from_mesh(ring(60, radius, 0.005), STEEL, []),
        fp.Request(name="ring", reference=MeanAxis(), reduction=Union((Eigenmodes(2), InertiaRelief())), stress=True),
    )
    result = settled(body)
    stress = tensors(body.surface, result["body.q"][-1:])[:, 0]
    x, y, _ = body.surface.points.T
    along = np.stack([-y, x, 0 * x], axis=1) / np.hypot(x, y)[:, None]
    hoop = np.einsum("pk,pkl,pl->p", along, matrices(stress), along)
    np.testing.assert_allclose(hoop, STEEL.rho * SPIN**2 * radius**2, rtol=0.01)


def test_the_shear_of_a_rod_that_is_bent_and_twisted_is_the_force_in_turned_axes():
    """A force F across the end of a rod under the torque T: its sections turn by T x / GJ, and away from the force."""
    section, length, elements, force, torque = circle(0.012), 1.0, 16, 1.0, 0.4
    frame = polyline([(0, 0, 0), (length, 0, 0)], Member(section, STEEL), elements=elements)
    rod = fp.reduce(
        fp.from_frame(
            named(frame, root=(0, 0, 0), tip=(length, 0, 0)), [InterfaceRegion("root"), InterfaceRegion("tip")]
        ),
        fp.Request(name="rod", reference=FixedTo("root"), reduction=CraigBampton(20), stress=True),
    )
    load = Load("l", "rod.tip", force=(0, force, 0), moment=(torque, 0, 0))
    clamp = (Joint("clamp", "fixed", "ground.O", "rod.root"),)
    result = static(Scene((Body("rod", rod),), clamp, loads=(load,), ground={"O": (0, 0, 0)}))
    shear = np.array([section_forces(result, "rod", k)[-1, 1, 1:3] for k in range(elements)])
    twist = torque * (np.arange(elements) + 0.5) / elements * length / (STEEL.E / (2 + 2 * STEEL.nu) * section.J)
    np.testing.assert_allclose(shear[:, 0], force, rtol=1e-4)
    np.testing.assert_allclose(shear[:, 1], -force * twist, atol=0.03 * force * twist[-1])


def test_section_forces_of_a_sagging_cantilever_and_the_reaction_of_its_joint(tmp_path):
    """Weight p per length on n elements of length l: root shear p (L - l / 2), root moment p (L^2 / 2 - l^2 / 12)."""
    section, length, elements = rectangle(0.02, 0.04), 2.0, 5
    frame = polyline([(0, 0, 0), (length, 0, 0)], Member(section, STEEL, (0, 1, 0)), elements=elements)
    beam = fp.reduce(
        fp.from_frame(named(frame, root=(0, 0, 0)), [InterfaceRegion("root")]),
        fp.Request(
            name="beam",
            reference=FixedTo("root"),
            reduction=Union((CraigBampton(0), InertiaRelief())),
            stress=True,
            linear=True,
        ),
    )
    clamp = (Joint("clamp", "fixed", "ground.O", "beam.root"),)
    scene = Scene((Body("beam", beam, damping=1.0),), clamp, ground={"O": (0, 0, 0)}, gravity=(0, -9.81, 0))
    path = tmp_path / "run.nc"
    result = integrate(scene, end=2.0, output_step=0.5, method=ROS2(1e-3), path=path)
    p, l = STEEL.rho * section.A * 9.81, length / elements  # noqa: E741
    at_root = section_forces(result, "beam", 0)[-1, 0]
    expected = [0, -p * (length - l / 2), 0, 0, 0, -p * (length**2 / 2 - l**2 / 12)]
    np.testing.assert_allclose(at_root, expected, atol=1e-5 * p)
    assert np.abs(result["clamp.force.y"][-1]) == pytest.approx(p * length, rel=1e-6)
    middle = section_forces(result, "beam", 2)[-1, 1]
    np.testing.assert_allclose(middle[[1, 5]], [-p * length / 2, -p * (length**2 / 8 + l**2 / 24)], rtol=1e-5)
    hottest = hot_spots(result, count=1)[0]
    assert hottest.position[0] == pytest.approx(0.0, abs=1e-12)
    assert hot_spots(load_result(path), count=1)[0] == hottest
    np.testing.assert_array_equal(section_forces(load_result(path), "beam", 0)[-1, 0], at_root)


# ---- what is refused ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda r: hot_spots(r, "misses"), "quantity 'misses' is not known; there are: von-mises"),
        (lambda r: hot_spots(r, bodies=("arm",)), "body 'arm' has no stress modes in the result; those that have: rod"),
        (lambda r: hot_spots(r, count=0), "asked for 0 hot spots"),
        (lambda r: hot_spots(rotating_box()), "no body of the result has stress modes; reduce it again with them"),
        (lambda r: tensors(rotating_box().geometry["rod"], np.zeros((1, 1))), "no stress modes; reduce the body with"),
        (lambda r: stress_histories(r, "rod", {"a": np.array([900.0, 0, 0])}), "m from body 'rod', which lies between"),
        (lambda r: section_forces(r, "arm", 0), "body 'arm' has no section forces in the result; those that have: rod"),
        (lambda r: section_forces(r, "rod", 4), "has no beam element 4; it has 4, counted from 0"),
        (lambda r: peaks(spoiled(r), "rod"), "not all finite; run the analysis again"),
        (lambda r: stress_report(r, "x", since=2.0), "the result ends at 1 s; nothing is left from 2 s on"),
        (lambda r: film(rotating_box(), 3, colour="von-mises"), "no body can be coloured by von Mises stress"),
        (lambda r: film(stressed_box(), 3, colour="red"), "colour is 'red'; it must be one of: deformation, body, von"),
        (lambda r: film(stressed_box(), 3, limit=-1.0), "end of the colour bar is -1.0; it must be a positive"),
    ],
)
def test_what_cannot_be_told_is_named(call, message):
    with pytest.raises(InputError, match=message):
        call(random_result())


def spoiled(result):
    q = np.array(result["rod.q"])
    q[3] = np.nan
    return replace(result, quantities={"rod.q": Quantity(q, "m sqrt(kg)", (mode_axis("rod", q.shape[1]),))})


def test_points_need_a_body_where_there_are_several(tmp_path):
    rng = np.random.default_rng(6)
    result = random_result(one=random_surface(rng), two=random_surface(rng))
    with pytest.raises(InputError, match="say which: one, two"):
        stress_report(result, tmp_path, points=[(0, 0, 0)])


# ---- colours --------------------------------------------------------------------------------------------------------


def test_the_colours_of_a_film_are_the_measure_at_its_times():
    result = stressed_box()
    shown = film(result, result.time.size, colour="von-mises")
    (solid,) = shown.solids
    whole = values_at(solid.surface, result["rod.q"], MEASURES["von-mises"])
    for k in (0, 7, 20):
        np.testing.assert_allclose(shown.colouring.values(solid, k), whole[:, k], rtol=1e-9)
    assert (shown.colouring.low, shown.colouring.high) == (0.0, pytest.approx(whole.max()))
    assert shown.colouring.title("|").startswith("von Mises|stress|[")
    signed = film(result, 5, colour="xx", limit=1e8).colouring
    assert (signed.low, signed.high) == (-1e8, 1e8)
    assert film(result, 5, colour="body").colouring is None
    assert film(stressed_box(amplitude=0.0), 5, colour="von-mises").colouring is None


def test_bodies_without_stress_modes_stay_plain_beside_those_with():
    result = stressed_box()
    other = {key.replace("rod", "arm"): of for key, of in result.quantities.items()}
    plain = rotating_box().geometry["rod"]
    q = Quantity(result["rod.q"], "m sqrt(kg)", (mode_axis("arm", 1),))
    both = replace(
        result,
        quantities={**result.quantities, **other, "arm.q": q},
        geometry={**result.geometry, "arm": plain},
    )
    assert film(both, 3, colour="von-mises").colouring.bodies == {"rod"}
    assert film(both, 3).colouring.bodies == {"rod", "arm"}


def test_a_film_by_stress_shows_the_bar_and_differs_from_the_deformation(tmp_path):
    settings = {"size": (240, 160), "duration": 0.4, "fps": 5}
    animate(stressed_box(), tmp_path / "a.gif", colour="von-mises", **settings)
    animate(stressed_box(), tmp_path / "b.gif", **settings)
    by_stress, by_motion = Image.open(tmp_path / "a.gif"), Image.open(tmp_path / "b.gif")
    assert by_stress.n_frames == by_motion.n_frames == 2
    assert np.asarray(by_stress.convert("RGB")).tobytes() != np.asarray(by_motion.convert("RGB")).tobytes()


def test_a_page_by_stress_holds_range_and_title():
    text = animate(stressed_box(), colour="xx", limit=2e9, duration=0.5).text
    about = json.loads(re.search(r'id="about">(.*?)</script>', text, re.DOTALL).group(1))
    first = about["colours"][0]
    assert (first["words"], first["unit"]) == ("stress xx", "GPa")
    assert (first["low"], first["high"]) == (-2e9, 2e9)


def test_a_simplified_surface_keeps_its_stress():
    from ffr_dyn.pictures import page

    surface = stressed_box().geometry["rod"]
    coarse, _ = page.decimated(surface, 0.5)
    own = {tuple(point): k for k, point in enumerate(surface.points)}
    np.testing.assert_array_equal(coarse.stress, surface.stress[[own[tuple(point)] for point in coarse.points]])


# ---- files and the command ------------------------------------------------------------------------------------------


def test_the_result_file_keeps_stress_modes_and_section_forces(tmp_path):
    result = random_result()
    path = save_result(result, tmp_path / "run.nc")
    again = load_result(path).geometry["rod"]
    one = result.geometry["rod"]
    for key in ("points", "triangles", "Phi", "stress", "moduli"):
        np.testing.assert_array_equal(getattr(again, key), getattr(one, key))
    for key in ("positions", "axes", "modes"):
        np.testing.assert_array_equal(getattr(again.beams, key), getattr(one.beams, key))
    with h5netcdf.File(path, "r") as file:
        assert file["geometry/rod/stress"].dimensions == ("point", "component", "mode")
        assert file["geometry/rod/beams/modes"].dimensions == ("element", "place", "force", "mode")
        assert file["geometry/rod/stress"].attrs["units"] == "Pa m-1 kg-0.5"


def test_places_that_the_body_hides_are_told_from_those_that_are_seen():
    surface = stressed_box().geometry["rod"]
    middle = surface.points.mean(axis=0)
    for axis in range(3):
        towards = np.array([0.31, 0.17, 0.23])
        towards[axis] = 1.0
        towards /= np.linalg.norm(towards)
        near, far = middle.copy(), middle.copy()
        near[axis], far[axis] = surface.points[:, axis].max(), surface.points[:, axis].min()
        assert not behind(surface, near, towards)
        assert behind(surface, far, towards)
        assert behind(surface, near, -towards)
        assert not behind(surface, far, -towards)


def test_the_report_is_written_in_full(tmp_path):
    result = stressed_box()
    surface = result.geometry["rod"]
    beams = BeamForces(np.full((1, 3, 3), 0.5), np.eye(3)[None], np.ones((1, 3, 6, 1)))
    result = replace(result, geometry={"rod": replace(surface, beams=beams)})
    report = stress_report(result, tmp_path / "new", count=3)
    made = {path.name for path in (tmp_path / "new").iterdir()}
    sections = {"rod_section_forces.csv", "rod_section_forces.png"}
    assert made == {"hot_spots.csv", "history.csv", "history.png", "rod.png"} | sections
    assert {path.name for path in report.files} == made
    with open(tmp_path / "new" / "hot_spots.csv", newline="") as stream:
        heading, *rows = csv.reader(stream)
    assert heading[-1] == "von-mises [Pa]"
    assert [float(row[-1]) for row in rows] == [spot.value for spot in report.spots]
    picture = np.asarray(Image.open(tmp_path / "new" / "rod.png"))
    assert picture.shape == (800, 1200, 3)
    assert ((np.ptp(picture.astype(int), axis=-1)) > 80).sum() > 5000
    lines = list(report_lines(report))
    assert "von Mises stress" in lines[0]
    assert sum(line.startswith("file") for line in lines) == len(made)
    assert any("element 0" in line for line in lines)


def test_the_command_prints_hot_spots_and_takes_points(tmp_path):
    path = save_result(stressed_box(), tmp_path / "run.nc")
    arguments = ["stress", str(path), "-o", str(tmp_path / "s"), "--body", "rod", "--point", "0.5,0.05,0.05"]
    done = CliRunner().invoke(cli, [*arguments, "--quantity", "xx", "--count", "2", "--from", "0.2"])
    assert done.exit_code == 0, done.output
    assert "stress xx [GPa]" in done.output
    with open(tmp_path / "s" / "history.csv") as stream:
        heading = next(csv.reader(stream))
    assert heading[0] == "time [s]"
    assert "rod.point 1.xx [Pa]" in heading
    wrong = CliRunner().invoke(cli, ["stress", str(path), "-o", str(tmp_path / "s"), "--point", "1,2"])
    assert isinstance(wrong.exception, InputError)
    assert "write three numbers" in str(wrong.exception)
