"""Redundant constraints and singular positions: IFToMM's multibody benchmark problems A02 and A04.

M. Gonzalez, D. Dopico, U. Lugris, J. Cuadrado, A benchmarking system for MBS simulation software, Multibody System
Dynamics 16 (2006) 179-190. The reference positions come from an exact one-degree reduction (A02) and an independent
integration in minimal coordinates (A04), right to ten and eight digits.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ffr_gallery.bodies import tried
from ffr_gallery.singular_four_bar import time_of_alignment
from scipy.integrate import solve_ivp

from ffr_dyn.analyses.integration import integrate
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.integrators import RK4, ROS2, ROS3, DormandPrince, HalfExplicit, Integrator, tolerances
from ffr_dyn.integrators.stabilisation import Drifting
from ffr_dyn.scene.forces import Load
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import Body, Scene
from ffr_prep.body import rigid_body

G = 9.81


def rod(name: str):
    """1 m, 1 kg, slender, along its x axis."""
    ends = {"a": np.zeros(3), "b": np.array([1.0, 0, 0])}
    return rigid_body(name, mass=1.0, inertia=(1e-3, 1 / 12, 1 / 12), centre_of_mass=(0.5, 0, 0), points=ends)


def n_four_bar(count: int) -> Scene:
    """N + 1 rods stand on the ground, N connect their tops; the tops move at 1 m/s along x."""
    up = (0.0, 0.0, np.pi / 2)
    standing = [
        Body(f"s{k}", rod(f"s{k}"), position=(k, 0, 0), rotation=up, omega_bar=(0, 0, -1.0)) for k in range(count + 1)
    ]  # fmt: skip
    lying = [Body(f"c{k}", rod(f"c{k}"), position=(k, 1, 0), velocity=(1.0, 0, 0)) for k in range(count)]
    feet = [Joint(f"foot{k}", "revolute", f"ground.f{k}", f"s{k}.a") for k in range(count + 1)]
    left = [Joint(f"left{k}", "revolute", f"s{k}.b", f"c{k}.a") for k in range(count)]
    right = [Joint(f"right{k}", "revolute", f"c{k}.b", f"s{k + 1}.b") for k in range(count)]
    ground = {f"f{k}": (k, 0, 0) for k in range(count + 1)}
    return Scene((*standing, *lying), (*feet, *left, *right), ground=ground, gravity=(0, -G, 0))


A02 = {
    1: {5.0: (-0.9449081860, -0.3273354853), 10.0: (0.4783850578, 0.8781501788)},
    2: {5.0: (-0.8113104610, -0.5846155453), 10.0: (0.3284581115, 0.9445185382)},
}


@pytest.mark.parametrize("plane", ["auto", "none"])
@pytest.mark.parametrize("count", A02)
def test_the_n_four_bar_passes_its_singular_positions(count, plane):
    """All links align in every half turn; there the mechanism has N + 1 degrees of freedom instead of one."""
    result = integrate(replace(n_four_bar(count), plane=plane), end=10.0, output_step=0.5, method=RK4(5e-4))
    for time, (x, y) in A02[count].items():
        row = int(np.argmin(np.abs(result.time - time)))
        np.testing.assert_allclose(result["s0.b.position"][row, :2], (x, y), rtol=0, atol=1e-4)
    energy = result["energy.total"]
    assert np.abs(energy - energy[0]).max() < 1e-6
    assert result.attributes["degrees_of_freedom"] == 1
    assert sum("redundant" in note for note in result.attributes["notes"]) == (3 * count if plane == "none" else 0)


def height(count: int, time: float) -> float:
    """Of the tops, by the mechanism's one degree of freedom."""
    J, c = (count + 1) / 3 + count, G * ((count + 1) / 2 + count)
    motion = solve_ivp(lambda _, y: (y[1], c * np.sin(y[0]) / J), (0, time), (0, 1.0), "DOP853", rtol=1e-12, atol=1e-12)
    return float(np.cos(motion.y[0, -1]))


def passed(method: Integrator, steps: int, step: float, count: int = 2) -> tuple[float, float]:
    """Largest change of energy, and how far from its branch the mechanism is, after the first singular position."""
    outputs = ("energy.total", "s*.b.position")
    end = round(1.5 * steps) * step
    result = integrate(n_four_bar(count), end=end, output_step=step, method=method, outputs=outputs)
    tops = [result[f"s{k}.b.position"][-1, 1] for k in range(count + 1)]
    change = np.abs(result["energy.total"] - result["energy.total"][0]).max()
    return change, np.abs(np.array(tops) - height(count, end)).max()


BESIDE = [0.0, *np.geomspace(1e-12, 1e-3, 10), *-np.geomspace(3e-12, 3e-4, 9)]


@pytest.mark.parametrize(("kind", "off_branch"), [(RK4, 1e-7), (ROS3, 1e-4), (ROS2, 1e-2), (HalfExplicit, 1e-7)])
@pytest.mark.parametrize("within", [0.0, 0.5])
def test_steps_that_end_or_have_a_stage_beside_a_singular_position_keep_branch_and_energy(kind, off_branch, within):
    """The position at a distance (in lengths of a step) from the end, or the middle, of one: as where it is at a third."""
    aligned, steps = time_of_alignment(2), 200

    def at(fraction: float) -> tuple[float, float]:
        return passed(kind(aligned / (steps + fraction)), steps, aligned / (steps + fraction))

    usual, _ = at(0.33)
    found = np.array([at(within + off) for off in BESIDE])
    assert found[:, 0].max() < 1.5 * usual
    assert found[:, 1].max() < off_branch


@pytest.mark.parametrize("steps", [2000, 6000])
def test_short_steps_pass_a_singular_position_as_well_as_long_ones(steps):
    aligned = time_of_alignment(2)
    for fraction in (0.0, 0.03, 0.11, 0.5, 0.58, 1 - 1e-7):
        change, off = passed(RK4(aligned / (steps + fraction)), steps, aligned / (steps + fraction))
        assert change < 2e-7
        assert off < 1e-7


def test_steps_that_a_method_chooses_do_not_end_beside_a_singular_position():
    """A first step that would end in it by itself."""
    aligned = time_of_alignment(2)
    usual, _ = passed(DormandPrince(tolerances(1e-9)), 100, 1.003 * aligned / 100)
    change, off = passed(DormandPrince(tolerances(1e-9)), 100, aligned / 100)
    assert change < 1.5 * usual
    assert off < 1e-6


def test_without_projection_positions_are_not_stepped_over():
    aligned = time_of_alignment(2)
    step = aligned / 200 * (1 + 1e-8)
    result = tried(n_four_bar(2), end=300 * step, output_step=step, method=RK4(step), stabilisation=Drifting())
    assert result is None or np.ptp(result["energy.total"]) > 1e-3


def bricard() -> Scene:
    """Five rods of 1 m, 1 kg, 0.1 x 0.1 m along a path in space, with six hinges of which each pair is skew."""
    points = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], float)
    axes = np.eye(3)[[1, 2, 0, 1, 2, 0]]
    bodies = []
    for k in range(5):
        along = points[k + 1] - points[k]
        across = np.roll(along, 1)
        A = np.column_stack([along, across, np.cross(along, across)])
        model = rigid_body(
            f"r{k}",
            mass=1.0,
            inertia=(1 / 600, 1 / 1200 + 1 / 12, 1 / 1200 + 1 / 12),
            centre_of_mass=(0.5, 0, 0),
            points={"a": np.zeros(3), "b": np.array([1.0, 0, 0])},
        )
        bodies.append((Body(f"r{k}", model, position=points[k], rotation=A), A))
    names = ["ground.p0", *(f"r{k}.b" for k in range(5))]
    others = [*(f"r{k}.a" for k in range(5)), "ground.p5"]
    frames = [np.eye(3), *(A for _, A in bodies), np.eye(3)]
    joints = [
        Joint(f"h{k}", "revolute", names[k], others[k], axis=frames[k].T @ axes[k], axis_j=frames[k + 1].T @ axes[k])
        for k in range(6)
    ]
    ground = {"p0": points[0], "p5": points[5]}
    return Scene(tuple(body for body, _ in bodies), tuple(joints), ground=ground, gravity=(0, -G, 0))


def test_bricard_moves_as_it_should_and_says_that_one_row_is_redundant():
    scene = bricard()
    assembled = assemble(scene)
    assert assembled.degrees_of_freedom == 1
    assert sum("redundant" in note for note in assembled.notes) == 1
    result = integrate(scene, end=2.0, output_step=0.5, method=RK4(5e-4))
    P3 = result["r2.b.position"]
    np.testing.assert_allclose(P3[2], (0.51050146, -1.64916760, 0.14012311), rtol=0, atol=1e-6)
    np.testing.assert_allclose(P3[4], (-0.96934034, -1.22124689, 0.75427801), rtol=0, atol=1e-6)
    energy = result["energy.total"]
    assert np.abs(energy - energy[0]).max() < 1e-6


@pytest.mark.parametrize("offset", [0.0, 0.2])
def test_of_the_reactions_that_redundant_joints_leave_open_the_smallest_are_given(offset):
    """A bar on two ball joints and a distance along it, at rest: only the split of an axial force is open."""
    points = {"a": np.zeros(3), "b": np.array([1.0, 0, 0]), "c": np.array([0.5 + offset, 0, 0])}
    bar = rigid_body("bar", mass=2.0, inertia=(0.1, 0.2, 0.2), centre_of_mass=(0.5, 0, 0), points=points)
    scene = Scene(
        (Body("bar", bar),),
        (Joint("left", "fixed", "ground.P", "bar.a"), Joint("right", "fixed", "ground.Q", "bar.b")),
        loads=(Load("pull", "bar.c", force=(6.0, 0, 0)),),
        ground={"P": (0, 0, 0), "Q": (1, 0, 0)},
    )
    result = integrate(scene, end=1e-3, output_step=1e-3, method=RK4(1e-3))
    left, right = result["left.force"][-1], result["right.force"][-1]
    np.testing.assert_allclose(left + right, (-6.0, 0, 0), rtol=0, atol=1e-9)
    np.testing.assert_allclose(left, right, rtol=0, atol=1e-6)
    assert np.abs(result["bar.R"]).max() < 1e-15
