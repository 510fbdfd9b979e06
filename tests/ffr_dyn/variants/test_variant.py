"""Cheaper variants of bodies and scenes: what they keep, what they leave out, what they refuse."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from boxes import STEEL, box_mesh
from synthetic import cloud

import ffr_prep as fp
from ffr_dyn.analyses.integration import integrate
from ffr_dyn.analyses.settings import Settings
from ffr_dyn.consistency.assemble import assemble
from ffr_dyn.equations.inertia import mass_matrix, quadratic_velocity
from ffr_dyn.integrators import RK4
from ffr_dyn.integrators.stabilisation import Projection
from ffr_dyn.scene.forces import ModalForce
from ffr_dyn.scene.joints import Joint
from ffr_dyn.scene.scene import INERTIA_TERMS, Body, Scene
from ffr_dyn.scene_file.read import load_scene
from ffr_dyn.scene_file.write import save_scene
from ffr_dyn.variants.variant import vary, with_basis, with_model, with_modes, without_terms
from ffr_prep.body import BodyError, axial, rigid_body
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import SimplySupported
from ffr_prep.reduction.methods.craig_bampton import CraigBampton


def two_interfaces(n: int = 16):
    body = cloud(n)
    return replace(body, interfaces=body.interfaces[:2])


def flexibility(body) -> np.ndarray:
    """(6 I, 6 I) static motion of the interfaces per unit load on them."""
    shapes = np.concatenate([part for i in body.interfaces for part in (i.phi_t, i.phi_r)])
    return shapes / body.omega2 @ shapes.T


def parts(tensor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Symmetric and skew part in the first two indices."""
    other = np.swapaxes(tensor, 0, 1)
    return 0.5 * (tensor + other), 0.5 * (tensor - other)


# ---- fewer modes ----------------------------------------------------------------------------------------------------


def test_a_statically_complete_choice_keeps_the_flexibility_of_the_interfaces():
    body = two_interfaces()
    whole = flexibility(body)
    np.testing.assert_allclose(flexibility(with_modes(Body("b", body), 12).model), whole, rtol=1e-9, atol=1e-12)
    lowest = with_modes(Body("b", body), range(12)).model
    assert np.abs(flexibility(lowest) - whole).max() > 1e-3 * np.abs(whole).max()


def test_beside_the_static_shapes_come_the_lowest_modes_with_the_interfaces_held():
    body = two_interfaces()
    shapes = np.concatenate([part for i in body.interfaces for part in (i.phi_t, i.phi_r)])
    held = np.linalg.svd(shapes)[2][12:].T
    lowest = np.linalg.eigvalsh(held.T @ (body.omega2[:, None] * held))[0]
    small = with_modes(Body("b", body), 13).model
    rows = np.concatenate([part for i in small.interfaces for part in (i.phi_t, i.phi_r)])
    free = np.linalg.svd(rows)[2][12:].T
    assert free.T @ (small.omega2[:, None] * free) == pytest.approx(np.array([[lowest]]), rel=1e-9)


@pytest.mark.parametrize("keep", [1, 5, 12, 15])
def test_a_smaller_body_is_a_body(keep):
    """The constructor checks that the basis is orthonormal; frequencies ascend and lie above those of the larger body."""
    body = two_interfaces()
    small = with_modes(Body("b", body), keep).model
    assert small.n == keep
    assert (np.diff(small.omega2) >= 0).all()
    assert (small.omega2 >= body.omega2[:keep] * (1 - 1e-12)).all()
    assert small.surface.Phi.shape[-1] == keep


def test_modes_that_are_listed_stay_as_they_are():
    body = Body("b", cloud(5), q=np.arange(5.0), damping=[0.1, 0.2, 0.3, 0.4, 0.5])
    small = with_modes(body, [3, 1])
    np.testing.assert_array_equal(small.model.omega2, body.model.omega2[[3, 1]])
    np.testing.assert_array_equal(small.q, [3, 1])
    np.testing.assert_array_equal(small.damping, [0.4, 0.2])


def test_more_modes_than_there_are_change_nothing():
    body = Body("b", cloud(5))
    assert with_modes(body, 9) is body


def test_the_start_and_the_damping_come_along():
    body = Body("b", two_interfaces(), q=np.linspace(1, 2, 16), q_dot=np.linspace(-1, 1, 16), damping=0.05)
    V = np.linalg.qr(np.random.default_rng(1).normal(size=(16, 16)))[0]
    assert with_basis(body.model, V).surface.Phi @ (V.T @ body.q) == pytest.approx(body.model.surface.Phi @ body.q)
    small = with_modes(body, 15)
    assert small.q @ small.q < body.q @ body.q
    assert small.damping @ small.damping > 0


def test_bending_in_two_planes_stays_apart():
    """A planar scene with fewer modes is planar still."""
    mesh = box_mesh("hex20", (0.4, 0.02, 0.03), (4, 1, 1), origin=(0, -0.01, -0.015))
    rod = fp.reduce(
        fp.from_mesh(mesh, STEEL, [InterfaceRegion("left"), InterfaceRegion("right")]),
        fp.Request(name="rod", reference=SimplySupported("left", "right"), reduction=CraigBampton(6)),
    )
    place = tuple(rod.interface("left").position)
    hinge = Joint("hinge", "revolute", "ground.O", "rod.left")
    scene = Scene((Body("rod", rod),), (hinge,), ground={"O": place}, gravity=(0, -9.81, 0))
    kept = [assemble(vary(scene, modes=k)).system.scene for k in (rod.n, 10, 6)]
    assert [s.plane for s in kept] == ["z"] * 3
    assert kept[0].bodies[0].model.n > kept[1].bodies[0].model.n > kept[2].bodies[0].model.n > 0


def test_a_body_without_modes_is_rigid():
    body = with_modes(Body("b", cloud(4), q=[1.0, 2, 3, 4]), 0)
    assert body.model.n == body.q.size == 0
    assert with_modes(Body("b", rigid_body("b", mass=1.0, inertia=np.ones(3))), 0).model.n == 0


# ---- dropped terms --------------------------------------------------------------------------------------------------


def paper_form(body, dropped: tuple[str, ...]) -> SimpleNamespace:
    """What `ffr_dyn.equations.inertia` needs of a body, with terms left out."""
    (UP, I4), (PP, I5) = parts(body.rP_dm), parts(body.PP_dm)
    keep = {name: name not in dropped for name in INERTIA_TERMS}
    PP = keep["I9"] * PP + keep["I5"] * I5
    return SimpleNamespace(
        mass=body.mass, r_dm=body.r_dm, rr_dm=body.rr_dm, P_dm=keep["I3"] * body.P_dm,
        rP_dm=keep["I8"] * UP + keep["I4"] * I4, PP_dm=PP, I5=axial(PP), I6=np.eye(body.n),
    )  # fmt: skip


CHOICES = [("I3", "I4"), ("I5",), ("I8",), ("I9",), ("I5", "I9")]


@pytest.mark.parametrize("dropped", [(), *CHOICES])
def test_the_compiled_equations_are_those_of_the_remaining_integrals(dropped):
    model = cloud(4, stiffness=3.0)
    rng = np.random.default_rng(3)
    q, qd, w = 0.05 * rng.normal(size=4), rng.normal(size=4), np.array([1.0, -2, 0.5])
    scene = Scene((without_terms(Body("b", model, omega_bar=w, q=q, q_dot=qd), dropped),))
    found = integrate(scene, end=1e-6, output_step=1e-6, method=RK4(1e-6), outputs=("b.a", "b.alpha_bar", "b.q_ddot"))
    left = paper_form(model, dropped)
    force = quadratic_velocity(left, q, w, qd)
    force[6:] -= model.omega2 * q
    expected = np.linalg.solve(mass_matrix(left, q), force)
    computed = np.concatenate([found[f"b.{name}"][0] for name in ("a", "alpha_bar", "q_ddot")])
    np.testing.assert_allclose(computed, expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("dropped", CHOICES)
def test_energy_is_conserved_whatever_is_left_out(dropped):
    body = without_terms(Body("b", cloud(4, stiffness=10.0), velocity=(1, 0, 0), omega_bar=(1, 2, 3)), dropped)

    def drift(step: float) -> float:
        energy = integrate(Scene((body,)), end=0.5, output_step=0.05, method=RK4(step), outputs=("energy.*",))
        return float(np.abs(np.ptp(energy["energy.total"])))

    coarse, fine = drift(0.01), drift(0.005)
    assert coarse / fine > 8
    assert fine < 1e-3


def test_dropping_the_stiffening_is_the_body_without_it():
    body = Body("b", replace(cloud(2), stiffening=np.ones((30, 2, 2))))
    left = without_terms(body, ("stiffening", "I5"))
    assert (left.stiffening, left.dropped) == (False, ("I5",))
    assert without_terms(left, ("I9",)).dropped == ("I5", "I9")


def test_a_scene_file_says_what_is_dropped(tmp_path):
    scene = vary(Scene((Body("b", cloud(3)),)), drop=("I9", "I5"))
    save_scene(
        scene,
        Settings(start=0.0, end=1.0, output_step=0.1, method=RK4(0.01), stabilisation=Projection()),
        tmp_path / "s.toml",
    )
    assert load_scene(tmp_path / "s.toml")[0].bodies[0].dropped == ("I5", "I9")


# ---- scenes ---------------------------------------------------------------------------------------------------------


def two_bodies() -> Scene:
    force = ModalForce("push", "one", np.arange(1.0, 9.0))
    return Scene((Body("one", cloud(8)), Body("two", cloud(4, seed=2), position=(2, 0, 0))), forces=(force,))


def test_vary_reaches_every_flexible_body_or_those_named():
    scene = two_bodies()
    assert [b.model.n for b in vary(scene, modes=3).bodies] == [3, 3]
    assert [b.model.n for b in vary(scene, modes={"one": 3}, rigid=("two",)).bodies] == [3, 0]
    assert [b.dropped for b in vary(scene, drop={"two": ("I5",)}).bodies] == [(), ("I5",)]
    other = vary(scene, models={"two": cloud(6)}, modes={"two": 5})
    assert [b.model.n for b in other.bodies] == [8, 5]


def test_forces_on_modes_do_the_same_virtual_work():
    scene = two_bodies()
    small = vary(scene, modes={"one": 5})
    model, force = small.bodies[0].model, small.forces[0]
    full = scene.bodies[0].model
    V = np.linalg.lstsq(full.surface.Phi.reshape(-1, 8), model.surface.Phi.reshape(-1, 5), rcond=None)[0]
    np.testing.assert_allclose(force.values, scene.forces[0].values @ V, rtol=1e-9)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"modes": {"three": 2}}, "no body 'three' to vary; there are: one, two"),
        ({"rigid": ("three",)}, "no body 'three'"),
        ({"models": {"three": cloud(2)}}, "no body 'three'"),
        ({"modes": -1}, "cannot keep -1 modes"),
        ({"drop": ("I7",)}, "no term 'I7' to drop; there are: I3, I4, I5, I8, I9, stiffening"),
        ({"models": {"one": cloud(3)}}, "force 'push' acts on modes of 'one'"),
        ({"models": {"two": rigid_body("r", mass=1.0, inertia=np.ones(3))}}, "has no interface 'a'"),
    ],
)
def test_what_cannot_be_varied_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        vary(two_bodies(), **change)


def test_more_refusals():
    with pytest.raises(InputError, match="no inertia term 'I6' to drop"):
        Body("b", cloud(2), dropped=("I6",))
    with pytest.raises(InputError, match="a damping ratio for each of 2 modes"):
        with_model(Body("b", cloud(2), damping=[0.1, 0.2]), cloud(3))
    with pytest.raises(BodyError, match="each must exist"):
        with_modes(Body("b", cloud(2)), [0, 2])
