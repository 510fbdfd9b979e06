"""FEM data of MBDyn: every record against sums over mass points, files of others, round trips, guards, damage."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import scipy.optimize
from boxes import STEEL, box_mesh
from nodal_field import Field, field, in_coordinates, integrals, of_body, orthonormal, tilde
from synthetic import cloud

import ffr_prep as fp
import ffr_prep.interchange.common_format
from ffr_prep.body import FlexibleBody, axial, load_body, rigid_body, save_body
from ffr_prep.cli import main
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.interchange.mbdyn import read_fem, write_fem
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo, MeanAxis
from ffr_prep.reduction.methods.craig_bampton import CraigBampton
from ffr_prep.reduction.methods.eigenmodes import Eigenmodes

INTEGRALS = ("mass", "r_dm", "rr_dm", "P_dm", "rP_dm", "PP_dm", "omega2")
FULL = (1, 2, 5, 6, 7, 8, 9, 10, 12, 14, 15, 16, 17, 18)
LEGACY = (1, 2, 5, 6, 7, 8, 9, 10, 11, 12)


# ---- an independent reading and writing of the text ---------------------------------------------------------------


def parsed(path):
    """The numbers of each record, flat, in the order of the file."""
    found, group = {}, None
    for line in path.read_text().splitlines():
        if match := re.match(r"\*\* RECORD GROUP (\d+),", line):
            group = int(match[1])
            found[group] = []
        elif not line.startswith("**"):
            found[group] += [float(word) for word in line.replace("REV", "").split()]
    return {group: np.array(values) for group, values in found.items()}


def sums(given: Field):
    """Records 14 to 18 as sums over the points, flat."""
    modes, total = given.modes, given.total
    turned = sum(given.rotary[p] @ given.spin[p] for p in given.points)
    U = [tilde(e) for e in np.eye(3)]
    assert np.array_equal(U[0] @ np.eye(3)[1], np.eye(3)[2])
    I8 = [total(lambda r, phi, j=j: tilde(r) @ tilde(phi[j]).T) for j in modes]
    I5 = np.array([[total(lambda r, phi, j=j, k=k: np.cross(phi[j], phi[k])) for k in modes] for j in modes])
    I9 = np.array([[total(lambda r, phi, j=j, k=k: tilde(phi[j]) @ tilde(phi[k])) for k in modes] for j in modes])
    return {
        14: total(lambda r, phi: phi.T).ravel(),
        15: (total(lambda r, phi: np.cross(r, phi).T) + turned).ravel(),
        16: np.concatenate([I8[j][row] for row in range(3) for j in modes]),
        17: np.array([I5[j, k, row] for row in range(3) for j in modes for k in modes]),
        18: np.concatenate([I9[j, k, row] for row in range(3) for j in modes for k in modes]),
    }


def lumps(given: Field):
    return np.hstack([np.repeat(given.mass[:, None], 3, axis=1), np.einsum("pkk->pk", given.rotary)])


def rigid_record(given: Field):
    mass, centre = given.mass.sum(), given.mass @ given.at / given.mass.sum()
    J = given.total(lambda r, phi: tilde(r - centre).T @ tilde(r - centre)) + given.rotary.sum(axis=0)
    return np.concatenate([[mass], centre, J.ravel()])


def foreign(path, given: Field, records, *, changes=None, modes=None):
    """A file as other programs write it: five numbers a line, D exponents, comments without asterisks in record 8."""
    content = {
        5: given.at[:, 0],
        6: given.at[:, 1],
        7: given.at[:, 2],
        9: given.M(),
        10: given.K,
        11: lumps(given),
        12: rigid_record(given),
        **sums(given),
        **(changes or {}),
    }
    lines = ["** RECORD GROUP 1, HEADER", "**   words", f"REV0 {len(given.mass)} {modes or f'{given.n} 0 0 0'}"]
    lines += ["** anything", "** RECORD GROUP 2, LABELS", " ".join(f"n{p}" for p in given.points)]
    for group in sorted({8, *records}):
        lines.append(f"** RECORD GROUP {group}, OF SOMEONE")
        if group == 8:
            for j in given.modes:
                lines.append(f"{j} 1.0 2.0" if j == 1 else f"NORMAL MODE {j}")
                motions = np.hstack([given.Phi[:, :, j], given.spin[:, :, j]])
                lines += [" ".join(f"{x:.15E}".replace("E", "D") for x in motion) for motion in motions]
        else:
            flat = np.ravel(content[group])
            lines += [" ".join(f"{x:.15E}" for x in flat[k : k + 5]) for k in range(0, len(flat), 5)]
    path.write_text("\n".join([*lines, "** END OF FILE"]) + "\n")
    return path


OWN = (5, 6, 7, 9, 10)
MODAL = (14, 15, 16, 17, 18)


def beam_with(reference, reduction):
    return fp.reduce(
        fp.from_mesh(
            box_mesh("hex8", (1.0, 0.1, 0.06), (6, 2, 2)),
            STEEL,
            (InterfaceRegion("left"), InterfaceRegion("right", kind="mean")),
        ),
        fp.Request(name="a beam", reference=reference, reduction=reduction),
    )


@pytest.fixture(scope="module")
def beam() -> FlexibleBody:
    return beam_with(FixedTo("left"), CraigBampton(4))


@pytest.fixture
def lines(tmp_path):
    """The lines of a small good file."""
    return write_fem(cloud(3), tmp_path / "good.fem", kind="full").read_text().splitlines()


def with_lines(tmp_path, lines):
    path = tmp_path / "changed.fem"
    path.write_text("\n".join(lines))
    return path


def within(lines, group):
    """Indices of the lines of a record that hold numbers."""
    start = next(k for k, text in enumerate(lines) if text.startswith(f"** RECORD GROUP {group},"))
    ends = [k for k, text in enumerate(lines) if k > start and "RECORD GROUP" in text]
    return [k for k in range(start + 1, min(ends, default=len(lines))) if not lines[k].startswith("**")]


def without(lines, group):
    start = next(k for k, text in enumerate(lines) if text.startswith(f"** RECORD GROUP {group},"))
    ends = [k for k, text in enumerate(lines) if k > start and "RECORD GROUP" in text]
    return [*lines[:start], *lines[min(ends, default=len(lines)) :]]


def scaled(lines, group, factor=1.5):
    """The lines with the largest number of the record multiplied."""
    spots = [(k, w) for k in within(lines, group) for w in range(len(lines[k].split()))]
    k, w = max(spots, key=lambda spot: abs(float(lines[spot[0]].split()[spot[1]])))
    words = lines[k].split()
    words[w] = f"{float(words[w]) * factor:.16E}"
    return [*lines[:k], " ".join(words), *lines[k + 1 :]]


def assert_same(given, expected, rtol=1e-12):
    for key in INTEGRALS:
        one, other = getattr(given, key), getattr(expected, key)
        np.testing.assert_allclose(
            one, other, rtol=0, atol=rtol * max(np.abs(other).max(initial=0), 1e-12), err_msg=key
        )


# ---- laws: the numbers in the file --------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [1, 4])
def test_every_record_of_a_full_file_is_the_sum_over_the_mass_points(tmp_path, n):
    body = cloud(n)
    given, found = of_body(body), parsed(write_fem(body, tmp_path / "b.fem", kind="full"))
    assert tuple(found) == FULL
    np.testing.assert_array_equal(found[1], [0, 3, n, 0, 0, 0])
    np.testing.assert_array_equal(found[2], [1, 2, 3])
    np.testing.assert_array_equal(np.stack([found[5], found[6], found[7]], axis=1), given.at[:3])
    motions = [[*body.interfaces[p].phi_t[:, j], *body.interfaces[p].phi_r[:, j]] for j in range(n) for p in range(3)]
    np.testing.assert_array_equal(found[8], np.ravel(motions))
    np.testing.assert_allclose(found[9].reshape(n, n), given.M(), atol=1e-12)
    np.testing.assert_allclose(found[10].reshape(n, n), given.K, atol=1e-12)
    np.testing.assert_allclose(found[12], rigid_record(given), atol=1e-12)
    for group, values in sums(given).items():
        np.testing.assert_allclose(found[group], values, atol=1e-12, err_msg=str(group))


def test_the_inertia_of_the_deformed_body_is_that_of_MBDyn(tmp_path):
    body, q = cloud(4), np.array([0.3, -0.2, 0.5, 0.1])
    found = parsed(write_fem(body, tmp_path / "b.fem", kind="full"))
    mass, centre, central = found[12][0], found[12][1:4], found[12][4:].reshape(3, 3)
    I7 = central + mass * tilde(centre).T @ tilde(centre)
    I8 = np.einsum("rjc,j->rc", found[16].reshape(3, 4, 3), q)
    I9 = np.einsum("rjkc,j,k->rc", found[18].reshape(3, 4, 4, 3), q, q)
    direct = of_body(body).total(lambda r, phi: tilde(r + q @ phi).T @ tilde(r + q @ phi))
    np.testing.assert_allclose(I7 + I8 + I8.T - I9, direct, atol=1e-12)


def test_the_records_of_a_reduced_mesh_repeat_each_other(tmp_path, beam):
    found, n = parsed(write_fem(beam, tmp_path / "b.fem", kind="full")), beam.n
    I9 = found[18].reshape(3, n, n, 3)
    np.testing.assert_allclose(-0.5 * np.einsum("rjkr->jk", I9), found[9].reshape(n, n), atol=1e-10)
    np.testing.assert_allclose(axial(I9.transpose(3, 0, 1, 2)), found[17].reshape(3, n, n), atol=1e-10)
    I8 = found[16].reshape(3, n, 3)
    np.testing.assert_allclose(axial(-I8.transpose(2, 0, 1)), found[15].reshape(3, n), atol=1e-10)
    assert np.abs(found[15]).max() > 0.01


def test_lumped_masses_have_the_integrals_of_the_body(tmp_path):
    body = cloud(4)
    found = parsed(write_fem(body, tmp_path / "b.fem", kind="legacy", surface=True))
    assert tuple(found) == LEGACY
    masses = found[11].reshape(-1, 6)
    assert masses.min() >= 0
    np.testing.assert_array_equal(masses[:, 3:], 0)
    np.testing.assert_array_equal(masses[:, 0], masses[:, 1])
    given = of_body(body)
    at = np.stack([found[5], found[6], found[7]], axis=1)
    shapes = found[8].reshape(4, -1, 6)[:, :, :3].transpose(1, 2, 0)
    lumped = replace(given, mass=masses[:, 0], at=at, Phi=shapes, spin=0 * shapes, rotary=np.zeros((len(at), 3, 3)))
    for key in ("P_dm", "rP_dm", "PP_dm"):
        np.testing.assert_allclose(integrals(lumped)[key], integrals(given)[key], atol=1e-10, err_msg=key)


# ---- round trips --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [0, 1, 5])
def test_a_body_comes_back(tmp_path, n):
    body = cloud(n, seed=n, name="a cloud")
    back = read_fem(write_fem(body, tmp_path / "b.fem", kind="full"))
    assert_same(back, body, 1e-14)
    assert (back.name, [i.name for i in back.interfaces]) == ("a cloud", ["a", "b", "c"])
    for one, other in zip(back.interfaces, body.interfaces, strict=True):
        for key in ("position", "phi_t", "phi_r"):
            np.testing.assert_array_equal(getattr(one, key), getattr(other, key))
    assert back.provenance["warnings"] == []
    assert set(back.provenance["inertia"].values()) == {"record"}


def test_a_reduced_mesh_comes_back(tmp_path, beam):
    back = read_fem(write_fem(beam, tmp_path / "b.fem", kind="full", surface=True))
    assert_same(back, beam)
    assert len(back.interfaces) == 2 + len(beam.surface.points)
    np.testing.assert_array_equal(back.interfaces[2].phi_t, beam.surface.Phi[0])
    assert_same(load_body(save_body(back, tmp_path / "b.ffr")), back, 0)


def test_a_legacy_file_comes_back_as_near_as_its_masses_allow(tmp_path):
    exact = read_fem(write_fem(cloud(4), tmp_path / "1.fem", kind="legacy", surface=True))
    assert_same(exact, cloud(4), 1e-9)
    body = beam_with(MeanAxis(), Eigenmodes(4))
    near = read_fem(write_fem(body, tmp_path / "2.fem", kind="legacy", surface=True))
    for key, scale in (("P_dm", body.mass), ("rP_dm", np.trace(body.rr_dm)), ("PP_dm", 1.0)):
        np.testing.assert_allclose(getattr(near, key), getattr(body, key), rtol=0, atol=0.02 * np.sqrt(scale))
    np.testing.assert_allclose(near.rr_dm, body.rr_dm, rtol=1e-12)
    assert near.provenance["inertia"] == {
        "12": "record",
        "14": "lumped masses",
        "16": "lumped masses",
        "18": "lumped masses",
    }


def test_a_rigid_body_is_a_file_without_modes(tmp_path):
    body = rigid_body("hub", mass=2.0, inertia=[1.0, 2.0, 2.5], centre_of_mass=[0.1, 0, 0], points={"pin": [0, 0, 1]})
    for kind in ("legacy", "full"):
        assert_same(read_fem(write_fem(body, tmp_path / "b.fem", kind=kind)), body, 1e-14)


# ---- files of others ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("records", [(11,), (11, 12), (12, *MODAL), (12, 14, 16, 18), (11, 14, 15)])
def test_integrals_come_from_what_the_file_has(tmp_path, records):
    given = orthonormal(field(4))
    body = read_fem(foreign(tmp_path / "b.fem", given, OWN + records))
    for key, value in integrals(given).items():
        np.testing.assert_allclose(getattr(body, key), value, atol=1e-12, err_msg=key)
    np.testing.assert_allclose(body.omega2, np.diag(given.K), rtol=1e-12)
    assert body.provenance["warnings"] == []
    assert (body.name, body.interfaces[8].name) == ("b", "n8")
    np.testing.assert_allclose(body.interfaces[8].phi_r, given.spin[8], atol=1e-12)


def test_modes_that_are_neither_orthonormal_nor_uncoupled_are_combined(tmp_path):
    given = field(4)
    body = read_fem(foreign(tmp_path / "b.fem", given, (*OWN, 12, *MODAL), modes="3 2 1 2"))
    assert "combined" in body.provenance["notes"][-1]
    V = np.linalg.lstsq(given.Phi.reshape(-1, 4), np.array([i.phi_t for i in body.interfaces]).reshape(-1, 4))[0]
    same = in_coordinates(given, V)
    np.testing.assert_allclose(same.K, np.diag(body.omega2), atol=1e-9 * body.omega2.max())
    for key, value in integrals(same).items():
        np.testing.assert_allclose(getattr(body, key), value, atol=1e-9, err_msg=key)


@pytest.mark.parametrize("records", [(11,), (12, *MODAL)])
def test_a_lumped_mass_is_noted_and_taken(tmp_path, records):
    given = orthonormal(field(4, rotary=1e-3))
    body = read_fem(foreign(tmp_path / "b.fem", given, OWN + records))
    assert "trace of I9 = -2 M" in body.provenance["warnings"][-1]
    np.testing.assert_allclose(body.I4.ravel(), sums(given)[15], atol=1e-12)
    np.testing.assert_allclose(body.inertia, rotary_inertia(given), atol=1e-12)
    if 15 in records:
        assert "I4 = axial part of I8 fails by" in body.provenance["warnings"][0]


def rotary_inertia(given):
    return given.total(lambda r, phi: tilde(r).T @ tilde(r)) + given.rotary.sum(axis=0)


def test_what_is_lost_is_said(tmp_path):
    given = orthonormal(field(2))
    changes = {3: np.ones(2), 4: np.ones(2), 13: np.eye(2)}
    body = read_fem(foreign(tmp_path / "b.fem", given, (*OWN, 3, 4, 11, 13), changes=changes))
    assert [re.findall(r"record \d+", warning)[0] for warning in body.provenance["warnings"]] == [
        "record 3",
        "record 4",
    ]
    np.testing.assert_allclose(body.damping, np.eye(2), atol=1e-12)
    zeros = {3: np.zeros(2), 4: np.zeros(2), 13: np.zeros((2, 2))}
    quiet = read_fem(foreign(tmp_path / "b.fem", given, (*OWN, 3, 4, 11, 13), changes=zeros))
    assert quiet.provenance["warnings"] == []


def stiffened(n: int) -> FlexibleBody:
    """A body with a different symmetric matrix for every load."""
    half = np.random.default_rng(4).normal(size=(12 + 18, n, n))
    return replace(cloud(n), stiffening=half + half.transpose(0, 2, 1))


def test_geometric_stiffness_goes_round_exactly(tmp_path):
    body = stiffened(3)
    back = read_fem(write_fem(body, tmp_path / "b.fem", kind="full"))
    np.testing.assert_allclose(back.stiffening, body.stiffening, rtol=1e-15)
    with_surface = read_fem(write_fem(body, tmp_path / "c.fem", kind="full", surface=True))
    np.testing.assert_allclose(with_surface.stiffening[:30], body.stiffening, rtol=1e-15)
    assert not with_surface.stiffening[30:].any()


def test_record_19_has_the_loads_in_the_order_of_the_format(tmp_path):
    """1-6 the products xx, yy, zz, xy, yz, zx, 7-9 angular and 10-12 linear acceleration, then the interfaces."""
    body = stiffened(1)
    text = write_fem(body, tmp_path / "b.fem", kind="full").read_text().partition("RECORD GROUP 19")[2]
    words = text.split("\n", 1)[1].split()
    assert words[0] == "30"
    found = dict(zip(map(int, words[1::2]), map(float, words[2::2]), strict=True))
    ours = body.stiffening[:, 0, 0]
    expected = [*ours[[6, 7, 8, 9, 11, 10]], *ours[3:6], *ours[:3], *ours[12:]]
    np.testing.assert_allclose([found[k] for k in range(1, 31)], expected, rtol=1e-15)


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("\n30\n", "\n31\n", "numbers; 31 matrices need"),
        ("\n2\n", "\n1\n", "index 1 is there twice"),
        ("\n30\n1\n", "\n30\n77\n", "index 77 .* not among 1 to 30"),
    ],
)
def test_damaged_records_of_stiffness_are_refused(tmp_path, before, after, said):
    path = write_fem(stiffened(2), tmp_path / "b.fem", kind="full")
    head, title, rest = path.read_text().partition("GROUP 19")
    assert before in rest
    path.write_text(head + title + rest.replace(before, after, 1))
    with pytest.raises(InputError, match=said):
        read_fem(path)


def test_stiffness_that_is_not_symmetric_is_refused(tmp_path):
    K = np.zeros((30, 2, 2))
    K[0] = [[1.0, 2.0], [3.0, 4.0]]
    path = write_fem(replace(cloud(2), stiffening=K), tmp_path / "b.fem", kind="full")
    with pytest.raises(InputError, match="matrix 10 of record 19 is symmetric fails by"):
        read_fem(path)


# ---- guards of the reader -----------------------------------------------------------------------------------------


def test_records_that_repeat_each_other_must_agree(tmp_path, lines):
    with pytest.raises(InputError, match=r"changed\.fem: the identity I5 = axial part of I9 .records 17, 18. fails by"):
        read_fem(with_lines(tmp_path, scaled(lines, 17)))
    for group, identity in ((15, "I4 = axial part of I8"), (18, "trace of I9 = -2 M")):
        assert identity in read_fem(with_lines(tmp_path, scaled(lines, group, 1.1))).provenance["warnings"][0]


def test_I9_must_be_symmetric_under_exchange_of_modes(tmp_path):
    given = orthonormal(field(2))
    I9 = sums(given)[18].reshape(3, 2, 2, 3).copy()
    I9[0, 0, 1, 0] += 0.1
    with pytest.raises(InputError, match=r"I9_jk = transpose of I9_kj \(record 18\) fails by \d"):
        read_fem(foreign(tmp_path / "b.fem", given, (*OWN, 12, *MODAL), changes={18: I9}))


def test_a_trace_that_lumping_does_not_explain_is_refused(tmp_path):
    given = orthonormal(field(3))
    changes = {18: 3 * sums(given)[18]}
    with pytest.raises(InputError, match=r"trace of I9 = -2 M \(record 9\) fails by 2.0e\+00"):
        read_fem(foreign(tmp_path / "b.fem", given, (*OWN, 12, 14, 16, 18), changes=changes))


def test_inertia_must_be_there(tmp_path):
    given = orthonormal(field(3))
    with pytest.raises(InputError, match="neither record 11 nor record 12"):
        read_fem(foreign(tmp_path / "b.fem", given, OWN))
    for left_out in (14, 16, 18):
        records = tuple({12, 14, 16, 18} - {left_out})
        with pytest.raises(InputError, match=f"neither record 11 nor record {left_out}"):
            read_fem(foreign(tmp_path / "b.fem", given, OWN + records))


def test_lumped_masses_must_not_depend_on_the_axis(tmp_path):
    given = orthonormal(field(3))
    masses = lumps(given)
    masses[4, 1] *= 2
    with pytest.raises(InputError, match=r"record 11: node 5 has the masses"):
        read_fem(foreign(tmp_path / "b.fem", given, (*OWN, 11), changes={11: masses}))


@pytest.mark.parametrize(
    ("group", "change", "said"),
    [
        (9, lambda M: M - 2 * np.eye(3), "modal mass of mode 1 is -1"),
        (9, lambda M: M + 1.0 - np.eye(3), "modal mass is not positive definite"),
        (9, lambda M: M + np.triu(np.full((3, 3), 0.1), 1), "modal mass is not symmetric"),
        (10, lambda K: K + np.triu(np.full((3, 3), 1e3), 1), "modal stiffness is not symmetric .off by"),
        (10, lambda K: -K, "negative eigenvalue"),
        (12, lambda rigid: -rigid, "mass is -.* must be positive"),
        (12, lambda rigid: rigid + np.eye(13)[5], "inertia tensor is not symmetric .off by"),
        (12, lambda rigid: rigid + 9e3 * np.eye(13)[4], "no mass distribution has the principal moments"),
    ],
)
def test_matrices_that_no_body_has_are_refused(tmp_path, group, change, said):
    given = orthonormal(field(3))
    value = {9: np.eye(3), 10: given.K, 12: rigid_record(given)}[group]
    path = foreign(tmp_path / "b.fem", given, (*OWN, 12, 14, 16, 18), changes={group: change(value), **explained(said)})
    with pytest.raises(InputError, match=said):
        read_fem(path)


def explained(said):
    """With a modal mass of ones, a record 18 whose trace is as large: the mass itself is to be refused."""
    if "definite" not in said:
        return {}
    ones = np.ones((3, 3))
    return {18: np.einsum("rc,jk->rjkc", -2 * np.eye(3) / 3, ones)}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("RECORD GROUP 1,", "RECORD GROUP 2,", "first record group is not 1"),
        ("RECORD GROUP 5,", "RECORD GROUP 20,", r"line \d+: record group 20 is not known"),
        ("RECORD GROUP 5,", "RECORD GROUP 6,", r"line \d+: record group 6 is there twice"),
        ("RECORD GROUP 10,", "RECORD SOUP 10,", "without record group 10"),
        ("REV0 3 3 0 0 0", "REV0 3 3 0 0", "record 1 must hold one line"),
        ("REV0 3 3 0 0 0", "3 3 0 0 0", "record 1 must hold one line"),
        ("REV0 3 3 0 0 0", "REV0 3 x 0 0 0", r"line \d+: record 1: 'x' is not a whole number"),
        ("REV0 3 3 0 0 0", "REV0 3 3 0 0 4", "3 nodes and -1 modes"),
        ("REV0 3 3 0 0 0", "REV0 0 3 0 0 0", "0 nodes and 3 modes"),
        ("REV0 3 3 0 0 0", "REV0 4 3 0 0 0", "3 labels; record 1 announces 4"),
        ("REV0 3 3 0 0 0", "REV0 3 4 0 0 0", r"record \d+ ends at line \d+ with \d+ numbers instead of"),
        ("REV0 3 3 0 0 0", "REV0 3 99999 0 0 0", r"record \d+ ends at line \d+ with \d+ numbers instead of"),
        ("E-01 ", "E-01x ", r"line \d+: record 5: '.*x' is not a number"),
        ("E-01 ", "E+999 ", r"line \d+: record 5: .* is too large"),
        ("E-01 ", "E-01 7 ", r"record 5 ends at line \d+ with 4 numbers instead of 3"),
        (
            "MODE SHAPE # 3\n",
            "MODE SHAPE # 3\n1 2 3 4 5 6\n",
            r"record 8 ends at line \d+ with 60 numbers instead of 54",
        ),
        ("** node 2 = b", "** node 2 = a", "interface names repeat"),
    ],
)
def test_damaged_files_are_refused(tmp_path, lines, old, new, said):
    text = "\n".join(lines)
    assert old in text
    with pytest.raises(InputError, match=said):
        read_fem(with_lines(tmp_path, [text.replace(old, new, 1)]))


def test_files_that_are_not_there_or_of_another_kind(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        read_fem(tmp_path / "nothing.fem")
    with pytest.raises(InputError, match="is a folder"):
        read_fem(tmp_path)
    for content in (b"", b"\x00\xff\x17 4 2", b" 3 3 :No. nodes, No. modes\n"):
        path = tmp_path / "foreign.fem"
        path.write_bytes(content)
        with pytest.raises(InputError, match="first record group is not 1"):
            read_fem(path)


# ---- damage of any kind -------------------------------------------------------------------------------------------


def test_truncated_files_are_refused(tmp_path, lines):
    for end in [*range(0, len(lines) - 40, 10), len(lines) - 1]:
        with pytest.raises(InputError, match=r"first record group|truncated|ends at line|nor record|REV0"):
            read_fem(with_lines(tmp_path, lines[:end]))


def damaged(path):
    try:
        return read_fem(path)
    except InputError as error:
        assert str(error).startswith(str(path))  # noqa: PT017 - either outcome is right
        return error


@pytest.mark.parametrize("group", [5, 8, 9, 10, 12, 14, 15, 16, 17, 18])
def test_swapped_numbers_never_crash(tmp_path, lines, group):
    spots = [(k, w) for k in within(lines, group) for w in range(len(lines[k].split()))]
    outcomes = []
    for (k, w), (i, j) in pairwise(spots):
        words = [line.split() for line in lines]
        if abs(float(words[k][w]) - float(words[i][j])) < 1e-12:
            continue
        words[k][w], words[i][j] = words[i][j], words[k][w]
        text = [
            " ".join(row) if number in (k, i) else line
            for number, (row, line) in enumerate(zip(words, lines, strict=True))
        ]
        outcomes.append(damaged(with_lines(tmp_path, text)))
    if group in (15, 16, 17):
        assert all(isinstance(o, InputError) or o.provenance["warnings"] for o in outcomes)


def test_random_damage_never_crashes(tmp_path, lines):
    rng, text = np.random.default_rng(1), "\n".join(lines)
    refused = 0
    for _ in range(200):
        k, kind = int(rng.integers(len(text))), int(rng.integers(3))
        piece = "".join(rng.choice(list("0123456789.*DE- \nR,\x00"), 3))
        broken = (text[:k] + piece + text[k + 3 :], text[:k] + piece + text[k:], text[:k] + text[k + 40 :])[kind]
        refused += isinstance(damaged(with_lines(tmp_path, [broken])), InputError)
    assert refused > 100


def test_absurd_magnitudes_never_crash(tmp_path, lines):
    rng, text, outcomes = np.random.default_rng(2), "\n".join(lines), []
    spots = list(re.finditer(r"-?\d\.\d+[DE][+-]\d+", text))
    for value in ("0.0", "-1.0", "1.0E-308", "1.0E-30", "1.0E+30", "1.0E+200", "-1.0E+308"):
        for spot in rng.choice(len(spots), 12, replace=False):
            broken = text[: spots[spot].start()] + value + text[spots[spot].end() :]
            outcomes.append(damaged(with_lines(tmp_path, [broken])))
            if value.endswith(("200", "308")) and "-308" not in value:
                assert "is too large" in str(outcomes[-1])
    assert any(isinstance(outcome, FlexibleBody) for outcome in outcomes)


# ---- guards of the writer -----------------------------------------------------------------------------------------


def test_the_writer_refuses_and_leaves_files_alone(tmp_path, monkeypatch):
    path = tmp_path / "b.fem"
    path.write_text("precious")
    body = cloud(4)
    with pytest.raises(InputError, match="kind 'new' is not known"):
        write_fem(body, path, kind="new")
    with pytest.raises(InputError, match=r"masses at the 3 nodes miss its inertia integrals by .*surface points"):
        write_fem(body, path, kind="legacy")
    away = replace(body, surface=replace(body.surface, Phi=0.1 * body.surface.Phi))
    with pytest.raises(InputError, match=r"its inertia integrals by .*: take the kind 'full'"):  # the surface is there
        write_fem(away, path, kind="legacy", surface=True)
    with pytest.raises(InputError, match="has no surface to export"):
        write_fem(replace(body, surface=None), path, surface=True)
    with pytest.raises(InputError, match="neither interfaces nor surface points"):
        write_fem(replace(body, interfaces=()), path)
    with monkeypatch.context() as patch:
        patch.setattr(ffr_prep.interchange.common_format, "MANY_MOMENTS", 100)
        with pytest.raises(InputError, match="15 nodes with 4 modes are too many to lump the mass at"):
            write_fem(body, path, kind="legacy", surface=True)

    def failing(rows, target):
        raise RuntimeError("too many iterations")

    with monkeypatch.context() as patch:
        patch.setattr(scipy.optimize, "nnls", failing)
        with pytest.raises(ComputationError, match="nodal masses: too many iterations"):
            write_fem(body, path, kind="legacy", surface=True)
    assert path.read_text() == "precious"
    assert list(tmp_path.iterdir()) == [path]


# ---- the command line ---------------------------------------------------------------------------------------------


def test_export_and_import_commands(tmp_path, capsys):
    source, out = save_body(cloud(3), tmp_path / "b.ffr"), tmp_path / "c.ffr"
    for options in ([], ["--kind", "full"], ["--kind", "legacy", "--surface"]):
        main(["export", str(source), "-o", str(tmp_path / "b.fem"), *options])
        main(["import", str(tmp_path / "b.fem"), "-o", str(out)])
        assert_same(load_body(out), cloud(3), 1e-9)
    with pytest.raises(SystemExit) as left:
        main(["export", str(source), "-o", str(tmp_path / "b.fem"), "--kind", "legacy"])
    assert left.value.code == 2
    assert "miss its inertia integrals" in capsys.readouterr().err


# ---- bodies without mass ------------------------------------------------------------------------------------------


def test_a_body_of_modal_mass_alone_gets_one_that_changes_nothing_where_it_is_held(tmp_path):
    given = orthonormal(field(3))
    none = {11: np.zeros((9, 6)), 12: np.zeros(13), **{k: np.zeros_like(v) for k, v in sums(given).items()}}
    body = read_fem(foreign(tmp_path / "b.fem", given, (*OWN, 11), changes=none))
    assert "the file has no mass" in body.provenance["warnings"][0]
    np.testing.assert_allclose(body.omega2, np.diag(given.K), rtol=1e-9)
    np.testing.assert_array_equal(body.P_dm, 0.0)
    assert body.mass > 0


def test_modes_without_mass_are_refused_with_the_reason(tmp_path):
    given = orthonormal(field(3))
    with pytest.raises(InputError, match=r"modal mass of mode 1 is 0; .*static elements are not computed.*bushing"):
        read_fem(foreign(tmp_path / "b.fem", given, (*OWN, 11), changes={9: np.zeros((3, 3))}))
    with pytest.raises(InputError, match="the mass is 0 kg"):
        read_fem(foreign(tmp_path / "c.fem", given, (*OWN, 11), changes={9: np.zeros((3, 3)), 11: np.zeros((9, 6))}))
