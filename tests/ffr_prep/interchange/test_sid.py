"""Standard input data: every block against sums over mass points, files of others, round trips, guards, damage."""

import os
import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import scipy.linalg
from boxes import STEEL, box_mesh
from nodal_field import Field, field, in_coordinates, integrals, of_body, orthonormal, tilde
from synthetic import cloud

import ffr_prep as fp
from ffr_prep.body import FlexibleBody, axial, load_body, rigid_body, save_body
from ffr_prep.cli import main
from ffr_prep.common.errors import ComputationError, InputError
from ffr_prep.interchange.sid import blocks, read_sid, write_sid
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.model.reference import FixedTo
from ffr_prep.reduction.methods.craig_bampton import CraigBampton

LAYOUTS = ("mode-major", "axis-major")
INTEGRALS = ("mass", "r_dm", "rr_dm", "P_dm", "rP_dm", "PP_dm", "omega2")
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
NODES = (0, 4)


# ---- an independent reading and writing of the text ---------------------------------------------------------------


def number(text):
    return float(text.replace("D", "E"))


def parsed(path):
    """Blocks by name, and nodes as dicts of blocks; a block is (m0, m1) filled from its lines."""
    modal, nodes, here, key, block = {}, [], None, None, None
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:2] == ["new", "node"]:
            nodes.append({})
        elif len(words) == 1 and words[0] not in ("part", "frame", "refmod"):
            key, block = words[0], {}
            here = modal if key not in ("origin", "phi", "psi", "AP") else nodes[-1]
        elif words[0] == "end" and words[1] == key:
            here[key], key = (block["m0"], block["m1"]), None
        elif found := re.match(r"\s*(order|nrow|ncol|nq|nqn|structure)\s*= (\d+)$", line):
            block[found[1]] = int(found[2])
            if found[1] == "structure":
                block["m0"] = np.zeros((block["nrow"], block["ncol"]))
                block["m1"] = np.zeros((block["nrow"], block["nq"], block["ncol"]))
        elif key and (found := re.match(r"\s*(m[01])\(([ \d,]+)\)\s*= +(\S+)$", line)):
            block[found[1]][tuple(int(i) - 1 for i in found[2].split(","))] = number(found[3])
    return modal, nodes


def apart(matrix, layout):
    """(rows, 3n) -> (n, rows, 3), column by column."""
    rows, n = len(matrix), matrix.shape[1] // 3
    out = np.zeros((n, rows, 3))
    for j in range(n):
        for a in range(3):
            out[j, :, a] = matrix[:, 3 * j + a if layout == "mode-major" else a * n + j]
    return out


def together(matrices, layout):
    n, rows, _ = matrices.shape
    out = np.zeros((rows, 3 * n))
    for j in range(n):
        for a in range(3):
            out[:, 3 * j + a if layout == "mode-major" else a * n + j] = matrices[j, :, a]
    return out


def six(tensor):
    return np.array([tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2]])


def centrifugal(a, b):
    """Coefficients of b . (omega x (omega x a)) per product of angular velocities."""
    rows = []
    for k, m in PAIRS:
        e, f = np.eye(3)[k], np.eye(3)[m]
        both = np.cross(e, np.cross(f, a)) + np.cross(f, np.cross(e, a))
        rows.append(b @ both * (0.5 if k == m else 1.0))
    return np.array(rows)


def sums(given: Field):
    """m0 and m1 of every block as sums over the points, Gr and Ge as (n, rows, 3)."""
    modes, total = given.modes, given.total
    turned = [given.rotary[p] @ given.spin[p] for p in given.points]
    Cr1 = np.array([[total(lambda r, phi, k=k, j=j: np.cross(phi[j], phi[k])) for j in modes] for k in modes])
    return {
        "mdCM": (total(lambda r, phi: r)[:, None], total(lambda r, phi: phi.T)[:, :, None]),
        "J": (
            six(total(lambda r, phi: tilde(r).T @ tilde(r)) + given.rotary.sum(axis=0))[:, None],
            np.stack(
                [six(total(lambda r, phi, j=j: -tilde(r) @ tilde(phi[j]) - tilde(phi[j]) @ tilde(r))) for j in modes],
                axis=1,
            )[:, :, None],
        ),
        "Ct": (total(lambda r, phi: phi), np.zeros((given.n, given.n, 3))),
        "Cr": (total(lambda r, phi: np.cross(r, phi)) + sum(turned).T, Cr1),
        "Me": (given.M(), None),
        "Gr": (np.array([total(lambda r, phi, j=j: -2 * tilde(r) @ tilde(phi[j])) for j in modes]), None),
        "Ge": (2 * Cr1.transpose(1, 0, 2), None),
        "Oe": (
            total(lambda r, phi: np.array([centrifugal(r, b) for b in phi])),
            total(lambda r, phi: np.array([[centrifugal(a, b) for a in phi] for b in phi])),
        ),
        "ksigma": (np.zeros((given.n, 1)), None),
        "Ke": (given.K, None),
        "De": (np.zeros((given.n, given.n)), None),
    }


def node_blocks(given: Field, p):
    AP1 = np.array([tilde(psi) for psi in given.spin[p].T]).transpose(1, 0, 2)
    return {
        "origin": (given.at[p][:, None], given.Phi[p][:, :, None]),
        "phi": (given.Phi[p], None),
        "psi": (given.spin[p], None),
        "AP": (np.eye(3), AP1),
    }


def block_lines(name, m0, m1, n, structure=3):
    yield f"\t{name}"
    head = {"order": int(m1 is not None), "nrow": m0.shape[0], "ncol": m0.shape[1], "nq": n, "nqn": 0}
    yield from (f"\t {key} = {value}" for key, value in {**head, "structure": structure}.items())
    if structure in (1, 2, 3):
        keep = {1: np.diag(np.diag(m0)) if structure == 1 else m0, 2: np.triu(m0), 3: m0}[structure]
        yield from (f"\t m0( {i + 1}, {j + 1}) = {value:.11E}".replace("E", "D") for (i, j), value in entries(keep))
    if m1 is not None:
        yield from (
            f"\t m1({i + 1},{q + 1}, {j + 1}) = {value:.11E}".replace("E", "D") for (i, q, j), value in entries(m1)
        )
    yield f"\tend {name}"


def entries(matrix):
    return [(index, value) for index, value in np.ndenumerate(matrix) if value]


def foreign(path, given: Field, *, Gr="axis-major", Ge="axis-major", at=NODES, changes=None, structures=None):
    """A file as other programs write it: 12 digits, tabs, no names; with some blocks changed."""
    found = {**sums(given), **(changes or {})}
    found["Gr"] = (together(found["Gr"][0], Gr), None)
    found["Ge"] = (together(found["Ge"][0], Ge), None)
    lines = [f" {len(at)} {given.n}   :No. nodes, No. modes: someone", "part", "new modal = arm", "refmod"]
    lines += [f"mass = {given.mass.sum():.11E}".replace("E", "D"), f"nelastq = {given.n}"]
    hertz = np.sqrt(scipy.linalg.eigh(given.K, given.M(), eigvals_only=True)) / (2 * np.pi) if given.n else []
    lines += [f"ielastq ( {j + 1}) = Eigen Mode {j + 1} : {f:.3f} Hz" for j, f in enumerate(hertz)]
    lines += ["end refmod", "frame"]
    for p in at:
        lines += [f"new node = {100 + p}", "rframe = body ref"]
        for name, (m0, m1) in node_blocks(given, p).items():
            lines += block_lines(name, m0, m1, given.n)
        lines += ["end node"]
    lines += ["end frame"]
    for name, (m0, m1) in found.items():
        lines += block_lines(name, m0, m1, given.n, (structures or {}).get(name, 3))
    path.write_text("\n".join([*lines, "end modal", "end part"]) + "\n")
    return path


@pytest.fixture(scope="module")
def beam() -> FlexibleBody:
    return fp.reduce(
        fp.from_mesh(
            box_mesh("hex8", (1.0, 0.1, 0.06), (6, 2, 2)),
            STEEL,
            (InterfaceRegion("left"), InterfaceRegion("right", kind="mean")),
        ),
        fp.Request(name="a beam", reference=FixedTo("left"), reduction=CraigBampton(4), linear=True),
    )


@pytest.fixture
def lines(tmp_path):
    """The lines of a small good file."""
    return write_sid(cloud(3), tmp_path / "good.SID_FEM").read_text().splitlines()


def with_lines(tmp_path, lines):
    path = tmp_path / "changed.SID_FEM"
    path.write_text("\n".join(lines))
    return path


def within(lines, name):
    """Indices of the lines of the last block of that name."""
    start = max(k for k, text in enumerate(lines) if text.split() == [name])
    end = next(k for k in range(start, len(lines)) if lines[k].split() == ["end", name])
    return range(start, end + 1)


def changed(lines, name, pattern, replacement):
    """The lines with the first line in the block that matches changed."""
    k = next(k for k in within(lines, name) if re.search(pattern, lines[k]))
    return [*lines[:k], re.sub(pattern, replacement, lines[k]), *lines[k + 1 :]]


def scaled(lines, name, matrix, factor=1.5):
    """The lines with the largest number of m0 or m1 of the block multiplied."""
    spots = [k for k in within(lines, name) if lines[k].split("(")[0].strip() == matrix]
    k = max(spots, key=lambda k: abs(number(lines[k].split("=")[1])))
    head, value = lines[k].split("=")
    return [*lines[:k], f"{head}= {number(value) * factor:.16E}", *lines[k + 1 :]]


def assert_same(given, expected, rtol=1e-12):
    for key in INTEGRALS:
        one, other = getattr(given, key), getattr(expected, key)
        np.testing.assert_allclose(
            one, other, rtol=0, atol=rtol * max(np.abs(other).max(initial=0), 1e-12), err_msg=key
        )


# ---- laws: the numbers in the file --------------------------------------------------------------------------------


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("n", [1, 4])
def test_every_block_of_the_file_is_the_sum_over_the_mass_points(tmp_path, n, layout):
    body = cloud(n)
    modal, _ = parsed(write_sid(body, tmp_path / "b.SID_FEM", layout=layout))
    assert list(modal) == ["mdCM", "J", "Ct", "Cr", "Me", "Gr", "Ge", "Oe", "ksigma", "Ke", "De"]
    for name, (m0, m1) in sums(of_body(body)).items():
        expected = together(m0, layout) if name in ("Gr", "Ge") else m0
        np.testing.assert_allclose(modal[name][0], expected, atol=1e-11, err_msg=name)
        if m1 is not None:
            np.testing.assert_allclose(modal[name][1], m1, atol=1e-11, err_msg=name)


def test_Oe_is_the_centrifugal_force_of_the_deformed_body(tmp_path):
    body, rng = cloud(4), np.random.default_rng(3)
    modal, _ = parsed(write_sid(body, tmp_path / "b.SID_FEM"))
    omega, q = rng.normal(size=3), rng.normal(size=4)
    products = np.array([omega[k] * omega[m] for k, m in PAIRS])
    force = of_body(body).total(lambda r, phi: phi @ np.cross(omega, np.cross(omega, r + q @ phi)))
    Oe = modal["Oe"][0] + np.einsum("kqc,q->kc", modal["Oe"][1], q)
    np.testing.assert_allclose(Oe @ products, force, atol=1e-12)


def test_J_is_the_first_order_of_the_inertia_of_the_deformed_body(tmp_path):
    body, q, step = cloud(4), np.array([0.3, -0.2, 0.5, 0.1]), 1e-6
    modal, _ = parsed(write_sid(body, tmp_path / "b.SID_FEM"))

    def J(amount):
        return of_body(body).total(lambda r, phi: tilde(r + amount * q @ phi).T @ tilde(r + amount * q @ phi))

    np.testing.assert_allclose(modal["J"][0][:, 0], six(J(0)), atol=1e-12)
    np.testing.assert_allclose(modal["J"][1][:, :, 0] @ q, six(J(step) - J(-step)) / (2 * step), atol=1e-8)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("source", ["cloud", "beam"])
def test_the_file_of_a_consistent_mass_satisfies_every_identity(tmp_path, request, source, layout):
    body = cloud(4) if source == "cloud" else request.getfixturevalue("beam")
    modal, nodes = parsed(write_sid(body, tmp_path / "b.SID_FEM", layout=layout, surface=True))
    (Gr, Ge), n = (apart(modal[name][0], layout) for name in ("Gr", "Ge")), body.n
    assert np.abs(Gr).max() > 0.01
    assert np.abs(Ge).max() > 0.01
    for j in range(n):
        xx, yy, zz, xy, xz, yz = modal["J"][1][:, j, 0]
        J_j = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        np.testing.assert_allclose(Gr[j] + Gr[j].T, 2 * J_j, atol=1e-10)
        np.testing.assert_allclose(Gr[j] - Gr[j].T, -2 * tilde(modal["Cr"][0][j]), atol=1e-10)
        np.testing.assert_allclose(Ge[j], 2 * modal["Cr"][1][:, j], atol=1e-10)
    np.testing.assert_allclose(modal["mdCM"][1][:, :, 0], modal["Ct"][0].T, atol=1e-10)
    np.testing.assert_allclose(modal["Oe"][1][:, :, :3].sum(axis=2), -2 * modal["Me"][0], atol=1e-10)
    assert len(nodes) == len(body.interfaces) + len(body.surface.points)
    for node in nodes:
        np.testing.assert_allclose(node["origin"][1][:, :, 0], node["phi"][0], atol=1e-10)
        for j in range(n):
            np.testing.assert_allclose(node["AP"][1][:, j], tilde(node["psi"][0][:, j]), atol=1e-10)


def test_the_wrong_layout_is_far_off(tmp_path):
    modal, _ = parsed(write_sid(cloud(4), tmp_path / "b.SID_FEM", layout="mode-major"))
    Ge = apart(modal["Ge"][0], "axis-major")
    assert np.abs(Ge - 2 * modal["Cr"][1].transpose(1, 0, 2)).max() > 0.1


# ---- round trips --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("n", [0, 1, 5])
def test_a_body_comes_back(tmp_path, n, layout):
    body = cloud(n, seed=n)
    back = read_sid(write_sid(body, tmp_path / "b.SID_FEM", layout=layout))
    assert_same(back, body, 1e-14)
    assert (back.name, [i.name for i in back.interfaces]) == ("cloud", ["a", "b", "c"])
    for one, other in zip(back.interfaces, body.interfaces, strict=True):
        for key in ("position", "phi_t", "phi_r"):
            np.testing.assert_array_equal(getattr(one, key), getattr(other, key))
    assert back.provenance["warnings"] == []
    assert back.surface is None
    if n > 1:
        assert back.provenance["layout"] == {"Gr": layout, "Ge": layout}


@pytest.mark.slow
def test_a_reduced_mesh_comes_back_and_is_written_the_same_again(tmp_path, beam):
    first = write_sid(beam, tmp_path / "1.SID_FEM", surface=True)
    back = read_sid(first)
    assert_same(back, beam)
    assert back.provenance["warnings"] == []
    assert [i.name for i in back.interfaces[:3]] == ["left", "right", "3"]
    np.testing.assert_array_equal(np.array([i.phi_t for i in back.interfaces[2:]]), beam.surface.Phi)
    assert_same(load_body(save_body(back, tmp_path / "b.ffr")), back, 0)
    again = read_sid(write_sid(back, tmp_path / "2.SID_FEM"))
    assert_same(again, back)


def test_the_rotation_of_a_surface_point_is_that_of_a_rigid_motion(tmp_path):
    body = cloud(2)
    turn = np.array([0.3, -0.2, 0.5])
    Phi = np.stack([np.cross(turn, body.surface.points)] * 2, axis=2)
    turned = replace(body, surface=replace(body.surface, Phi=Phi, triangles=[[0, 1, 2], [0, 2, 3], [1, 2, 3]]))
    back = read_sid(write_sid(turned, tmp_path / "b.SID_FEM", surface=True))
    for k in range(4):
        np.testing.assert_allclose(back.interfaces[3 + k].phi_r, np.stack([turn, turn], axis=1), atol=1e-12)


@pytest.mark.parametrize("name", ["big eye", "frame 1", "refmod,2=x", "größe", "50%"])
def test_awkward_names_come_back_and_do_not_disturb_simple_readers(tmp_path, name):
    plain = cloud(1)
    body = replace(plain, name=name, interfaces=(replace(plain.interfaces[0], name=name),))
    path = write_sid(body, tmp_path / "b.SID_FEM")
    first = path.read_text().splitlines()[0]
    assert not re.search(r"frame|refmod|\b(mdCM|J|Ct|Cr|Me|Gr|Ge|Oe|Ke|De) ", first)
    back = read_sid(path)
    assert (back.name, back.interfaces[0].name) == (name, name)


def test_line_1_states_the_layout_and_numbers_fit_a_punched_card(tmp_path):
    text = write_sid(cloud(3), tmp_path / "b.SID_FEM", layout="axis-major").read_text()
    assert text.splitlines()[0].startswith("    3    3   :No. nodes, No. modes: ffr-prep, SI, Gr,Ge=axis-major")
    assert max(len(line) for line in text.splitlines()[1:]) <= 80


# ---- files of others ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("Gr", LAYOUTS)
@pytest.mark.parametrize("Ge", LAYOUTS)
def test_each_block_matrix_has_its_own_layout(tmp_path, Gr, Ge):
    given = orthonormal(field(4))
    body = read_sid(foreign(tmp_path / "b.SID_FEM", given, Gr=Gr, Ge=Ge))
    assert body.provenance["layout"] == {"Gr": Gr, "Ge": Ge}
    assert body.provenance["warnings"] == []
    assert (body.name, [i.name for i in body.interfaces]) == ("arm", ["100", "104"])
    for key, value in integrals(given).items():
        np.testing.assert_allclose(getattr(body, key), value, atol=1e-10, err_msg=key)
    np.testing.assert_allclose(body.omega2, np.diag(given.K), rtol=1e-10)
    np.testing.assert_allclose(body.interface("104").phi_r, given.spin[4], atol=1e-10)


def test_modes_that_are_neither_orthonormal_nor_uncoupled_are_combined(tmp_path):
    given = field(4)
    body = read_sid(foreign(tmp_path / "b.SID_FEM", given))
    assert "combined" in body.provenance["notes"][-1]
    expected = orthonormal(given)
    np.testing.assert_allclose(body.omega2, np.diag(expected.K), rtol=1e-9)
    V = np.linalg.lstsq(given.Phi.reshape(-1, 4), expected.Phi.reshape(-1, 4), rcond=None)[0]
    signs = np.sign(np.einsum("kj,kj->j", body.interface("100").phi_t, (given.Phi @ V)[0]))
    same = integrals(in_coordinates(given, V * signs))
    for key, value in same.items():
        np.testing.assert_allclose(getattr(body, key), value, atol=1e-9, err_msg=key)


def test_modes_with_another_modal_mass_are_scaled(tmp_path):
    given = orthonormal(field(3))
    scale = np.array([2.0, 0.5, 10.0])
    body = read_sid(foreign(tmp_path / "b.SID_FEM", in_coordinates(given, np.diag(scale))))
    assert "scaled" in body.provenance["notes"][-1]
    np.testing.assert_allclose(body.P_dm, integrals(given)["P_dm"], atol=1e-10)
    np.testing.assert_allclose(body.omega2, np.diag(given.K), rtol=1e-10)


def test_diagonal_symmetric_and_unit_blocks_are_completed(tmp_path):
    given = orthonormal(field(4))
    structures = {"Me": 4, "Ke": 1, "De": 0}
    one = read_sid(foreign(tmp_path / "1.SID_FEM", given, structures=structures))
    assert_same(one, read_sid(foreign(tmp_path / "2.SID_FEM", given)), 1e-10)
    coupled = field(4)
    half = read_sid(foreign(tmp_path / "3.SID_FEM", coupled, structures={"Me": 2, "Ke": 2}))
    assert_same(half, read_sid(foreign(tmp_path / "4.SID_FEM", coupled)), 1e-9)


def test_a_lumped_mass_is_noted_and_taken(tmp_path):
    given = field(4, rotary=1e-3)
    body = read_sid(foreign(tmp_path / "b.SID_FEM", given))
    first, second = body.provenance["warnings"]
    assert "antisym(Gr_l) = -skew(Cr_l)" in first
    assert "-2 Me fails by" in second
    plain = read_sid(foreign(tmp_path / "c.SID_FEM", field(4)))
    assert plain.provenance["warnings"] == []


def stiffening(given: Field, amount=1.0):
    """Symmetric matrices as geometric stiffness gives: per acceleration (3), angular acceleration (3), Omega (6)."""
    rng = np.random.default_rng(5)
    half = amount * rng.normal(size=(given.n, given.n, 12))
    return half + half.transpose(1, 0, 2)


def stiffened(given: Field, parts):
    found, extra = sums(given), stiffening(given)
    spans = {"Ct": extra[:, :, :3], "Cr": extra[:, :, 3:6], "Oe": extra[:, :, 6:]}
    return {name: (found[name][0], found[name][1] + spans[name]) for name in parts}


def test_geometric_stiffness_of_accelerations_is_read(tmp_path):
    given = orthonormal(field(4))
    plain = read_sid(foreign(tmp_path / "1.SID_FEM", given))
    body = read_sid(foreign(tmp_path / "2.SID_FEM", given, changes=stiffened(given, ["Ct", "Cr"])))
    assert body.provenance["warnings"] == []
    assert plain.stiffening is None
    np.testing.assert_allclose(body.stiffening[:6], stiffening(given)[:, :, :6].transpose(2, 0, 1), atol=1e-9)
    assert not body.stiffening[6:].any()
    assert_same(replace(body, stiffening=None), plain, 1e-10)


def test_a_stiffened_body_goes_round_with_the_sum_in_Oe_exact(tmp_path):
    """Every node carries mass here, so that mass and stiffness in Oe.m1 are told apart."""
    half = np.random.default_rng(4).normal(size=(12 + 18, 3, 3))
    body = replace(cloud(3), stiffening=half + half.transpose(0, 2, 1))
    path = write_sid(body, tmp_path / "b.SID_FEM", surface=True)
    back = read_sid(path)
    np.testing.assert_allclose(back.stiffening[:30], body.stiffening, atol=1e-7)
    assert not back.stiffening[30:].any()
    few = read_sid(write_sid(body, tmp_path / "c.SID_FEM"))
    again = read_sid(write_sid(few, tmp_path / "d.SID_FEM"))
    loads = [*range(6), *range(12, 30)]
    np.testing.assert_allclose(few.stiffening[loads], body.stiffening[loads], atol=1e-13)
    for one in (back, few, again):
        np.testing.assert_allclose(blocks(one, "mode-major")["Oe"][1], blocks(body, "mode-major")["Oe"][1], atol=1e-12)
    np.testing.assert_allclose(again.stiffening, few.stiffening, atol=1e-12)


def misfit(body: FlexibleBody) -> float:
    """Of the masses at the nodes, as the last warning has it."""
    return float(re.search(r"off by ([\d.e+-]+)", body.provenance["warnings"][-1])[1])


def test_mass_and_stiffness_in_Oe_are_told_apart_by_masses_at_the_nodes(tmp_path):
    given = orthonormal(field(4))
    changes = stiffened(given, ["Ct", "Cr", "Oe"])
    body = read_sid(foreign(tmp_path / "1.SID_FEM", given, at=range(9), changes=changes))
    assert "The inertia alone is that of masses at the nodes, off by" in body.provenance["warnings"][-1]
    for key, value in integrals(given).items():
        np.testing.assert_allclose(getattr(body, key), value, atol=1e-8, err_msg=key)
    assert misfit(body) < 1e-8


@pytest.mark.parametrize("at", [(), NODES])
def test_too_few_nodes_spoil_only_what_Oe_alone_says(tmp_path, at):
    given = orthonormal(field(4))
    changes = stiffened(given, ["Ct", "Cr", "Oe"])
    body = read_sid(foreign(tmp_path / "b.SID_FEM", given, at=at, changes=changes))
    assert misfit(body) > 0.1
    expected = integrals(given)
    for key in ("mass", "r_dm", "rr_dm", "P_dm", "rP_dm"):
        np.testing.assert_allclose(getattr(body, key), expected[key], atol=1e-10, err_msg=key)
    np.testing.assert_allclose(body.I5, axial(expected["PP_dm"]), atol=1e-10)
    np.testing.assert_allclose(body.I6, np.eye(4), atol=1e-10)


def test_what_else_is_lost_is_said(tmp_path):
    given = orthonormal(field(3))
    path = foreign(tmp_path / "b.SID_FEM", given, changes={"ksigma": (np.ones((3, 1)), None), "De": (np.eye(3), None)})
    text = path.read_text()
    node = text.index("\tAP")
    sigma = "\n".join(
        ["\tsigma", *(f"{k} = {v}" for k, v in [("order", 0), ("nrow", 6)]), "m0(1, 1) = 1.0", "\tend sigma"]
    )
    turned = text[node:].replace("m0( 1, 1) = 1.0", "m0( 1, 1) = 0.5", 1)
    turned = re.sub(r"(?s)(\tAP.*?) m1.*?(\tend AP)", r"\1\2", turned, count=1)
    path.write_text(text[:node] + sigma + "\n" + turned)
    body = read_sid(path)
    warnings = body.provenance["warnings"]
    np.testing.assert_array_equal(body.damping, np.eye(3))
    assert [w for w in warnings if "prestress" in w]
    assert [w for w in warnings if "orientation" in w]
    assert [w for w in warnings if "sigma" in w]


def test_higher_terms_of_matrices_are_said_to_be_lost(tmp_path, lines):
    start = within(lines, "Me")
    text = changed(lines, "Me", r"order( +)= 0", r"order\1= 1")
    text = [*text[: start[-1]], "m1(1, 1, 1) = 0.25D+00", *text[start[-1] :]]
    warnings = read_sid(with_lines(tmp_path, text)).provenance["warnings"]
    assert any("terms of order 1 of Me" in warning for warning in warnings)


# ---- guards of the reader -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "matrix", "identity"),
    [
        ("mdCM", "m1", "Ct = transpose of mdCM.m1"),
        ("Ct", "m0", "Ct = transpose of mdCM.m1"),
        ("J", "m1", "Oe.m0 = centrifugal forces from J.m1"),
        ("Oe", "m0", "Oe.m0 = centrifugal forces from J.m1"),
        ("Gr", "m0", r"Gr_l \+ transpose = 2 dJ/dq_l fails in both layouts"),
        ("Ge", "m0", r"Ge = 2 Cr.m1 fails in both layouts"),
        ("Cr", "m1", r"Ge = 2 Cr.m1 fails in both layouts"),
        ("phi", "m0", "origin.m1 = phi fails by"),
        ("psi", "m0", r"AP.m1 = skew\(psi\) AP fails by"),
    ],
)
def test_blocks_that_repeat_each_other_must_agree(tmp_path, lines, name, matrix, identity):
    with pytest.raises(InputError, match=identity + r".*\d"):
        read_sid(with_lines(tmp_path, scaled(lines, name, matrix)))


def test_Oe_must_be_symmetric_in_the_modes(tmp_path, lines):
    text = changed(lines, "Oe", r"(m1\( +1, +2, +1\) +=).*", r"\1 0.9")
    with pytest.raises(InputError, match=r"Oe\.m1\(k,l,c\) = Oe\.m1\(l,k,c\) fails by"):
        read_sid(with_lines(tmp_path, text))


def test_a_trace_that_lumping_does_not_explain_is_refused(tmp_path, lines):
    text = scaled(lines, "Oe", "m1", 100.0)
    with pytest.raises(InputError, match=r"-2 Me fails by .*too much for a lumped mass"):
        read_sid(with_lines(tmp_path, text))


@pytest.mark.parametrize(
    ("name", "pattern", "replacement", "said"),
    [
        ("J", "nrow( +)= 6", r"nrow\1= 5", r"block j \(line \d+\) is 5 x 1; for 3 modes it must be 6 x 1"),
        ("Cr", "order( +)= 1", r"order\1= 2", "order 2; this program reads"),
        ("Cr", "nq( +)= 3", r"nq\1= 4", "nq = 4, but the file has 3 modes"),
        ("Me", "structure( +)= 3", r"structure\1= 5", "structure 5; known are"),
        ("Gr", "structure( +)= 3", r"structure\1= 1", "only a square block"),
        ("Ke", "structure( +)= 3", r"structure\1= 0", "structure 0 says zero"),
        ("Ke", "structure( +)= 3", r"structure\1= 4", "structure 4 says unit"),
        ("Ke", r"m0\( +2, +2\)", "m0(1, 2)", "symmetric"),
        ("Ke", r"m0\( +2, +2\)", "m0(1, 1)", r"m0\(1, 1\) is given twice"),
        ("Ke", r"m0\( +2, +2\)", "m0(2, 0)", r"m0\(2, 0\) is outside"),
        ("Ke", r"m0\( +2, +2\)", "m0(2)", r"m0\(2\) is outside"),
        ("Ke", r"m0\( +2, +2\)", "m1(2, 2, 2)", "whose order is 0"),
        ("Ke", r"(m0.*)= +\S+$", r"\1= 1.0x", "'1.0x' is not a number"),
        ("Ke", r"m0\( +2, +2\)( +)= +\S+$", r"m0(2, 2)\1= 1.0D+999", "is too large"),
        ("Ke", r"m0\( +2, +2\)", "mn(2, 2)", r"mn\(2,2\) = .* is not known"),
        ("Ke", r"m0\( +2, +2\)( +)= +", r"m0(2, 2)\1= -", "negative eigenvalue"),
        ("Ke", "nqn", "nq", "'nq' is given twice"),
        ("Ke", "nqn .*", "", "no line 'nqn = ...'"),
        ("Ke", r"nqn( +)= 0", r"nqn\1= x", "'x' is not a whole number"),
        ("Ke", "end Ke", "end Me", "'end Me' where block ke"),
        ("Ke", "Ke", "Xe", "'end Ke' where block xe"),
        ("Ke", "nqn .*", "what is this", "'what is this' in block ke .* is not standard input data"),
        ("mdCM", r"m1\( +1, +2, +1\)", "m1(1, 1, 2)", r"indices \(row, mode, column\) go up to \(3, 3, 1\)"),
        ("Me", r"m0\( +1, +1\)( +)= +", r"m0(1, 1)\1= -", "modal mass of mode 1 is -1"),
    ],
)
def test_damaged_lines_are_named(tmp_path, lines, name, pattern, replacement, said):
    with pytest.raises(InputError, match=rf"changed\.SID_FEM: .*{said}"):
        read_sid(with_lines(tmp_path, changed(lines, name, pattern, replacement)))


def test_a_diagonal_block_has_no_other_entries(tmp_path, lines):
    text = changed(lines, "Ke", "structure( +)= 3", r"structure\1= 1")
    text = changed(text, "Ke", r"m0\( +2, +2\)", "m0(1, 2)")
    with pytest.raises(InputError, match="structure 1 says diagonal"):
        read_sid(with_lines(tmp_path, text))


def test_the_triangles_of_a_symmetric_block_must_agree(tmp_path):
    given = field(3)
    text = foreign(tmp_path / "b.SID_FEM", given).read_text().splitlines()
    text = changed(text, "Ke", "structure = 3", "structure = 2")
    read_sid(with_lines(tmp_path, text))
    text = changed(text, "Ke", r"m0\( 1, 2\) = .*", "m0( 1, 2) = 1.0")
    with pytest.raises(InputError, match="triangles differ by"):
        read_sid(with_lines(tmp_path, text))


def test_modal_mass_must_be_positive_definite(tmp_path):
    given = field(3)
    M = given.M()
    M[0, 1] = M[1, 0] = 1.01 * np.sqrt(M[0, 0] * M[1, 1])
    changes = {"Me": (M, None)}
    with pytest.raises(InputError, match=r"-2 Me fails|not positive definite"):
        read_sid(foreign(tmp_path / "b.SID_FEM", given, changes=changes))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (" = body ref", " = joint 3", "only 'body ref' can be read"),
        ("nelastq                               = 3", "nelastq = 2", "nelastq = 2, but line 1 announces 3"),
        ("    3    3   :No", "    4    3   :No", "holds 3 nodes, but line 1 announces 4"),
        ("    3    3   :No", "    No", "line 1 must begin with the numbers of nodes and modes"),
        ("interfaces=a,b,c", "interfaces=a,a,c", "interface names repeat"),
        ("mass                                  =  ", "mass = -", "mass is -7.4.* must be positive"),
        ("mass                                  =  ", "mass = +-", "is not a number"),
        ("part \n", "", "where block file"),
        ("    frame \n", "    frame \n  other\n end other\n", "block 'other' is not known"),
        ("    mdCM ", "    psi", "'end mdCM' where block psi"),
    ],
)
def test_damaged_files_are_refused(tmp_path, lines, old, new, said):
    text = "\n".join(lines)
    assert old in text
    with pytest.raises(InputError, match=said):
        read_sid(with_lines(tmp_path, [text.replace(old, new, 1)]))


def test_blocks_must_be_there_once(tmp_path, lines):
    span = within(lines, "Ke")
    with pytest.raises(InputError, match="must hold one block 'Ke'; lines: none"):
        read_sid(with_lines(tmp_path, lines[: span[0]] + lines[span[-1] + 1 :]))
    twice = lines[: span[-1] + 1] + lines[span[0] :]
    with pytest.raises(InputError, match=r"must hold one block 'Ke'; lines: \d+, \d+"):
        read_sid(with_lines(tmp_path, twice))


def test_files_that_are_not_there_or_of_another_kind(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        read_sid(tmp_path / "nothing.SID_FEM")
    with pytest.raises(InputError, match="is a folder"):
        read_sid(tmp_path)
    for content in (b"", b"\x00\xff\x17 4 2", b"** RECORD GROUP 1, HEADER\n", save_bytes(tmp_path)):
        path = tmp_path / "foreign.SID_FEM"
        path.write_bytes(content)
        with pytest.raises(InputError, match="line 1 must begin"):
            read_sid(path)


def save_bytes(tmp_path):
    return save_body(cloud(1), tmp_path / "b.ffr").read_bytes()


# ---- damage of any kind -------------------------------------------------------------------------------------------


def test_truncated_files_are_refused(tmp_path, lines):
    for end in range(0, len(lines) - 1, 50):
        with pytest.raises(InputError, match=r"line 1 must|truncated"):
            read_sid(with_lines(tmp_path, lines[:end]))


@pytest.mark.parametrize("name", ["mdCM", "J", "Ct", "Cr", "Me", "Gr", "Ge", "Oe", "Ke", "origin", "phi", "psi", "AP"])
def test_swapped_numbers_are_refused_noticed_or_harmless(tmp_path, lines, name):
    """Only what no identity reaches may pass: the rigid moments, the stiffness and the position of a node."""
    good = read_sid(with_lines(tmp_path, lines))
    spots = [k for k in within(lines, name) if "(" in lines[k]]
    for one, other in pairwise(spots[:: max(1, len(spots) // 12)]):
        text = list(lines)
        for k, from_ in ((one, other), (other, one)):
            text[k] = lines[k].split("=")[0] + "=" + lines[from_].split("=")[1]
        if number(lines[one].split("=")[1]) == number(lines[other].split("=")[1]):
            continue
        outcome = damaged(with_lines(tmp_path, text))
        if isinstance(outcome, FlexibleBody) and not outcome.provenance["warnings"]:
            np.testing.assert_array_equal(outcome.PP_dm, good.PP_dm)
            np.testing.assert_array_equal(outcome.rP_dm, good.rP_dm)
            np.testing.assert_array_equal(outcome.P_dm, good.P_dm)


def damaged(path):
    try:
        return read_sid(path)
    except InputError as error:
        assert str(error).startswith(str(path))  # noqa: PT017 - either outcome is right
        return error


def test_random_damage_never_crashes(tmp_path, lines):
    rng, text = np.random.default_rng(1), "\n".join(lines)
    refused = 0
    for _ in range(150):
        k, kind = int(rng.integers(len(text))), int(rng.integers(3))
        piece = "".join(rng.choice(list("0123456789.=()DE- \nmx,\x00"), 3))
        broken = (text[:k] + piece + text[k + 3 :], text[:k] + piece + text[k:], text[:k] + text[k + 40 :])[kind]
        refused += isinstance(damaged(with_lines(tmp_path, [broken])), InputError)
    assert refused > 75


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


def test_the_writer_refuses_and_leaves_files_alone(tmp_path):
    path = tmp_path / "b.SID_FEM"
    path.write_text("precious")
    body = cloud(2)
    with pytest.raises(InputError, match="layout 'row-major' is not known"):
        write_sid(body, path, layout="row-major")
    with pytest.raises(InputError, match="has no surface to export"):
        write_sid(replace(body, surface=None), path, surface=True)
    with pytest.raises(InputError, match="neither interfaces nor surface points"):
        write_sid(replace(body, interfaces=()), path)
    taken = replace(body, interfaces=(replace(body.interfaces[0], name="surface-2"),))
    with pytest.raises(InputError, match="rename the interface 'surface-2'; surface points need it"):
        write_sid(taken, path, surface=True)
    assert path.read_text() == "precious"
    assert list(tmp_path.iterdir()) == [path]


def test_a_failed_write_leaves_no_trace(tmp_path, monkeypatch):
    def failing(source, target):
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", failing)
    with pytest.raises(ComputationError, match="disk full"):
        write_sid(cloud(1), tmp_path / "b.SID_FEM")
    assert list(tmp_path.iterdir()) == []


def test_a_rigid_body_is_a_file_without_modes(tmp_path):
    body = rigid_body("hub", mass=2.0, inertia=[1.0, 2.0, 2.5], centre_of_mass=[0.1, 0, 0], points={"pin": [0, 0, 1]})
    back = read_sid(write_sid(body, tmp_path / "b.SID_FEM"))
    assert_same(back, body, 1e-14)
    assert back.n == 0


# ---- the command line ---------------------------------------------------------------------------------------------


def test_export_says_what_it_leaves_out(tmp_path, capsys):
    body = replace(cloud(2), stiffening=np.ones((12 + 18, 2, 2)))
    source = save_body(body, tmp_path / "b.ffr")
    for name, kind, left_out in (
        ("b.SID_FEM", [], False),
        ("b.fem", ["--kind", "full"], False),
        ("c.fem", ["--kind", "legacy"], True),
    ):
        main(["export", str(source), "-o", str(tmp_path / name), *kind, "--surface"])
        assert ("geometric stiffness of the body was left out" in capsys.readouterr().out) is left_out


@pytest.mark.parametrize(("name", "option"), [("b.SID_FEM", ["--kind", "full"]), ("b.fem", ["--layout", "axis-major"])])
def test_an_option_of_another_format_is_refused(tmp_path, capsys, name, option):
    source = save_body(cloud(2), tmp_path / "b.ffr")
    with pytest.raises(SystemExit) as left:
        main(["export", str(source), "-o", str(tmp_path / name), *option])
    assert left.value.code == 2
    assert f"{option[0]} is for {'MBDyn' if name.endswith('FEM') else 'SID'}" in capsys.readouterr().err


def test_export_and_import_commands(tmp_path, capsys):
    source = save_body(cloud(3), tmp_path / "b.ffr")
    sid, out = tmp_path / "b.SID_FEM", tmp_path / "c.ffr"
    main(["export", str(source), "-o", str(sid), "--layout", "axis-major", "--surface"])
    main(["import", str(sid), "-o", str(out)])
    assert "note        every node became an interface" in capsys.readouterr().out
    back = load_body(out)
    assert_same(back, cloud(3), 1e-14)
    assert len(back.interfaces) == 15
    assert back.provenance["layout"]["Gr"] == "axis-major"
    for arguments in (["export", str(source), "-o", "x.mnf"], ["import", "x.mnf", "-o", str(out)]):
        with pytest.raises(SystemExit) as left:
            main(arguments)
        assert left.value.code == 2
        assert "'.mnf' is not known" in capsys.readouterr().err
