"""Files of other writers: their habits change nothing of the body, or are told; what cannot move is said before a run."""

import re
from dataclasses import replace

import numpy as np
import pytest
import sid_habits
from sid_habits import block, rewritten, values
from synthetic import cloud

import ffr_dyn as fd
from ffr_prep.body import FlexibleBody, immovable, load_body, mass_of_motions, save_body
from ffr_prep.cli import main
from ffr_prep.common.errors import InputError
from ffr_prep.interchange.bare_inertia import held
from ffr_prep.interchange.sid import read_sid, write_sid

INTEGRALS = ("r_dm", "rr_dm", "P_dm", "rP_dm", "PP_dm", "omega2")


@pytest.fixture
def lines(tmp_path):
    return write_sid(cloud(3), tmp_path / "good.SID_FEM").read_text().splitlines()


def read(tmp_path, lines) -> FlexibleBody:
    path = tmp_path / "foreign.SID_FEM"
    path.write_text("\n".join(lines) + "\n")
    return read_sid(path)


@pytest.mark.parametrize("habit", sid_habits.HARMLESS)
def test_a_habit_changes_nothing_of_the_body(tmp_path, lines, habit):
    changed = habit(lines)
    assert changed != lines
    given, plain = read(tmp_path, changed), cloud(3)
    for key in INTEGRALS:
        np.testing.assert_allclose(getattr(given, key), getattr(plain, key), atol=1e-10, err_msg=key)
    assert given.stiffening is None


def test_what_a_habit_leaves_out_is_said(tmp_path, lines):
    said = {habit: read(tmp_path, habit(lines)).provenance for habit in sid_habits.HARMLESS}
    assert "symmetric in the modes (3.0e-02" in said[sid_habits.raw_Ge]["warnings"][0]
    assert "columns xy, yz, xz of Oe.m1" in said[sid_habits.one_sided_products]["warnings"][0]
    assert "(row, column, mode)" in said[sid_habits.other_order_of_indices]["notes"][-1]
    for habit in (sid_habits.ones_of_unit_blocks, sid_habits.exponents_without_a_letter, sid_habits.end_of_file_mark):
        assert said[habit]["warnings"] == []


@pytest.mark.parametrize(("name", "says"), [("De", "damping"), ("ksigma", "prestress")])
def test_blocks_of_zeros_may_be_left_out_and_lines_be_blank_before_the_first(tmp_path, lines, name, says):
    start, end = (
        next(k for k, x in enumerate(lines) if x.split() == [name]),
        next(k for k, x in enumerate(lines) if x.split() == ["end", name]),
    )
    body = read(tmp_path, ["", "  ", *lines[:start], *lines[end + 1 :]])
    for key in INTEGRALS:
        np.testing.assert_allclose(getattr(body, key), getattr(cloud(3), key), atol=1e-10, err_msg=key)
    assert f"the file has no block {name}, which says {says}: none is taken" in body.provenance["notes"]


def test_a_mode_of_rotary_inertia_is_read(tmp_path, lines):
    body = read(tmp_path, sid_habits.rotary_inertia(lines))
    assert "-2 Me fails by 2.0e+00" in body.provenance["warnings"][-1]
    np.testing.assert_allclose(body.I6, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(body.PP_dm[:, :, 1, 1], np.eye(3) / 3, atol=0.02)


def test_second_moments_that_are_left_out_are_those_of_nodal_masses(tmp_path):
    body = cloud(3)
    lines = write_sid(body, tmp_path / "a.SID_FEM", surface=True).read_text().splitlines()
    given = read(tmp_path, rewritten(lines, "Oe", "m1", {}))
    np.testing.assert_allclose(given.PP_dm, body.PP_dm, atol=1e-6)  # every node has a mass here
    assert "Oe is of order 0" in given.provenance["warnings"][-1]


# ---- frequencies that are stated -----------------------------------------------------------------------------------


def test_frequencies_that_are_not_those_of_the_matrices_are_told(tmp_path, lines):
    body = cloud(3)
    scaled = rewritten(lines, "Ke", "m0", {at: 1e6 * value for at, value in values(lines, "Ke", "m0").items()})
    (warning,) = read(tmp_path, scaled).provenance["warnings"]
    f = body.frequencies
    assert f"states {f[0]:.6g} Hz, but its Ke and Me have {1e3 * f[0]:.6g} Hz" in warning
    rounded = [re.sub(r": ([\d.]+) Hz", lambda m: f": {float(m[1]):.3f} Hz", text) for text in lines]
    assert read(tmp_path, rounded).provenance["warnings"] == []
    without = [text for text in lines if "ielastq" not in text]
    assert read(tmp_path, without).provenance["warnings"] == []


# ---- planar models -------------------------------------------------------------------------------------------------


def flat(n: int = 2) -> FlexibleBody:
    """A cloud whose masses, and their motions, lie in the plane z = 0."""
    body, keep = cloud(n), np.diag([1.0, 1.0, 0.0])
    L = np.linalg.cholesky(np.einsum("kaij->ij", np.einsum("kl,lmij,ma->kaij", keep, body.PP_dm, keep)[:2, :2] * 0)
                           + np.einsum("kkij->ij", np.einsum("kl,lmij,ma->kaij", keep, body.PP_dm, keep)))  # fmt: skip
    V = np.linalg.inv(L).T
    return replace(
        body,
        r_dm=keep @ body.r_dm,
        rr_dm=keep @ body.rr_dm @ keep,
        P_dm=keep @ body.P_dm @ V,
        rP_dm=np.einsum("kl,lmj,ma->kaj", keep, body.rP_dm, keep) @ V,
        PP_dm=V.T @ np.einsum("kl,lmij,ma->kaij", keep, body.PP_dm, keep) @ V,
        interfaces=tuple(
            replace(i, position=keep @ i.position, phi_t=keep @ i.phi_t @ V, phi_r=(np.eye(3) - keep) @ i.phi_r @ V)
            for i in body.interfaces
        ),
        surface=None,
    )


def planar_file(tmp_path):
    """The blocks of a planar model: of J, Gr and Oe what belongs to z."""
    lines = write_sid(flat(), tmp_path / "flat.SID_FEM", layout="axis-major").read_text().splitlines()
    n = 2
    keep = {
        ("J", "m0"): lambda at: at[0] == 3,
        ("J", "m1"): lambda at: at[0] == 3,
        ("Gr", "m0"): lambda at: at[0] == 3 and at[1] > 2 * n,
        ("Oe", "m0"): lambda at: at[1] == 3,
        ("Oe", "m1"): lambda at: at[2] == 3,
    }
    for (name, matrix), wanted in keep.items():
        entries = {at: value for at, value in values(lines, name, matrix).items() if wanted(at)}
        lines = rewritten(lines, name, matrix, entries)
    return lines


def swinging(body: FlexibleBody, joint: str, **more):
    joint_ = fd.Joint("hinge", joint, "ground.O", "arm.a", **more)
    at = body.interface("a").position
    return fd.Scene((fd.Body("arm", body),), (joint_,), ground={"O": at}, gravity=(0.0, -9.81, 0.0))


def test_a_planar_model_moves_in_its_plane_as_the_whole_one_does(tmp_path):
    whole, given = flat(), read(tmp_path, planar_file(tmp_path))
    assert "a planar model: its inertia is that about z alone" in given.provenance["warnings"][0]
    one, other = (
        fd.forward(swinging(body, "revolute", axis=(0.0, 0.0, 1.0)), end=0.05, output_step=0.01, method=fd.ROS2(1e-4))
        for body in (whole, given)
    )
    for key in ("arm.c.position", "arm.q", "hinge.force"):
        np.testing.assert_allclose(other[key], one[key], atol=1e-9 * np.abs(one[key]).max(), err_msg=key)


def test_a_planar_model_is_refused_in_space(tmp_path):
    given = read(tmp_path, planar_file(tmp_path))
    scene = swinging(load_body(save_body(given, tmp_path / "b.ffr")), "spherical")
    with pytest.raises(InputError, match=r"'arm' is a planar model.* in space: declare plane = \"z\""):
        fd.assemble(scene)
    with pytest.raises(InputError, match="computed in space"):
        fd.assemble(replace(scene, plane="none"))


# ---- no motion -----------------------------------------------------------------------------------------------------


def greedy(body: FlexibleBody) -> FlexibleBody:
    """A body whose modes take up more than its mass."""
    return replace(body, mass=0.1 * body.mass, r_dm=0.1 * body.r_dm, rr_dm=0.1 * body.rr_dm)


def test_what_cannot_move_is_said_on_import_and_before_a_run(tmp_path, capsys):
    path = write_sid(greedy(cloud(3)), tmp_path / "b.SID_FEM")
    main(["import", str(path), "-o", str(tmp_path / "b.ffr")])
    assert re.search(
        r"no free motion is possible: no inertia is left for .*times what the mass gives", capsys.readouterr().out
    )
    body = load_body(tmp_path / "b.ffr")
    for analysis in (fd.assemble, fd.static):
        with pytest.raises(InputError, match=r"body 'arm' cannot move: it has no inertia left for .*--held"):
            analysis(fd.Scene((fd.Body("arm", body),)))


def test_a_body_can_move_where_its_mass_matrix_is_positive():
    body = cloud(3)
    assert immovable(body) == ""
    for factor in (0.5, 0.2, 0.1, 0.05):
        light = replace(body, mass=factor * body.mass, r_dm=factor * body.r_dm, rr_dm=factor * body.rr_dm)
        positive = np.linalg.eigvalsh(mass_of_motions(light)).min() > 0
        assert (immovable(light) == "") == positive
    assert immovable(replace(body, rr_dm=np.outer(body.r_dm, body.r_dm) / body.mass))


def test_a_body_that_cannot_move_is_computed_where_it_is_held(tmp_path, capsys):
    body = cloud(2)
    path = write_sid(greedy(body), tmp_path / "b.SID_FEM")
    main(["import", str(path), "-o", str(tmp_path / "b.ffr"), "--held"])
    assert "to be held fixed only, at its point 'frame': the mass was raised" in capsys.readouterr().out
    given = load_body(tmp_path / "b.ffr")
    weld = fd.Joint("weld", "fixed", "ground.O", "arm.frame")
    scene = fd.Scene((fd.Body("arm", given, q=(1e-3, 0.0)),), (weld,), ground={"O": (0.0, 0.0, 0.0)})
    times = np.linspace(0.0, 0.01, 11)
    q = fd.forward(scene, end=0.01, output_step=1e-3, method=fd.ROS2(1e-5))["arm.q"]
    np.testing.assert_allclose(q[:, 0], 1e-3 * np.cos(np.sqrt(body.omega2[0]) * times), atol=2e-6)
    with pytest.raises(InputError, match="can move with the mass it has"):
        held(body)


def test_rods_and_point_masses_get_a_trace_of_inertia(tmp_path):
    body = cloud(1)
    along = np.array([1.0, 0.0, 0.0])
    rod = replace(
        body,
        r_dm=0.5 * body.mass * along,
        rr_dm=body.mass / 3 * np.outer(along, along),
        P_dm=0.1 * along[:, None],
        rP_dm=np.zeros((3, 3, 1)),
    )
    given = read_sid(write_sid(rod, tmp_path / "b.SID_FEM"))
    assert "no inertia about [1., 0., 0.]" in given.provenance["warnings"][-1]
    assert immovable(given) == ""
    assert immovable(rod) == "turning about x: it has none"
    np.testing.assert_allclose(given.inertia, rod.inertia, atol=1e-6 * rod.mass)
    lines = write_sid(rod, tmp_path / "c.SID_FEM").read_text().splitlines()
    point = rewritten(lines, "J", "m0", {})
    assert immovable(read(tmp_path, point)) == ""


def test_blocks_keep_what_others_say_of_them(lines):
    """The habits act on the blocks that they name."""
    assert values(lines, "Me", "m0") == {(k, k): 1.0 for k in (1, 2, 3)}
    assert lines[block(lines, "Ke")[0]].split() == ["Ke"]
