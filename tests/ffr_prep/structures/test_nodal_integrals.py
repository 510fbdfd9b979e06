"""Inertia shape integrals in nodal coordinates: the book's element, rigid motions, and those of a body by q_n = B_2 q_f."""

from __future__ import annotations

import numpy as np
import pytest

import ffr_prep as fp
from ffr_prep.cli import main
from ffr_prep.common.errors import InputError
from ffr_prep.model.coupled import InterfaceRegion
from ffr_prep.report.integrals import NAMES, in_full, integral, integral_lines
from ffr_prep.structures.interfaces import tie
from ffr_prep.structures.nodal_integrals import nodal_integrals

STEEL = fp.material("steel")
TURN = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
TURN *= np.linalg.det(TURN)


def structure() -> fp.Frame:
    """A plate of triangles and quadrilaterals with an eccentric spar, in no particular direction."""
    at = [
        tuple(TURN @ corner + (0.3, -0.2, 0.5)) for corner in np.array([(0, 0, 0), (1, 0, 0), (1, 0.3, 0), (0, 0.3, 0)])
    ]
    beyond = [tuple(2 * np.array(at[1]) - at[0]), tuple(2 * np.array(at[2]) - at[3])]
    wing = fp.panel(at, fp.Shell(0.003, STEEL), elements=(2, 1))
    outer = fp.triangulated(fp.panel([at[1], *beyond, at[2]], fp.Shell(0.002, STEEL), elements=(1, 1)))
    section = fp.shifted(fp.rectangle(0.01, 0.03), 0.02, -0.01)
    spar = fp.polyline(at[:2], fp.Member(section, STEEL, tuple(TURN[:, 2])), elements=2)
    return fp.named(fp.joined(wing, outer, spar), root=at[0], tip=at[2])


def test_the_planar_element_of_the_book():
    """Consistent integrals of S = [1-x, 0, x; 0, 1-3x^2+2x^3, ...] per mass: Shabana 2013, sec. 6."""
    length = 0.8
    section = fp.with_mass_moments(fp.shear_rigid(fp.rectangle(0.02, 0.02)), 1e-12, 0.0)
    found = nodal_integrals(fp.polyline([(0, 0, 0), (length, 0, 0)], fp.Member(section, STEEL, (0, 1, 0)), elements=1))
    along, across = [0, 6], [1, 5, 7, 11]
    scale = np.diag([1, length, 1, length])
    cubic = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420
    mixed = np.array([[21, 3, 9, -2], [9, 2, 21, -3]]) / 60

    def per_mass(k: int, l: int, rows: list[int], columns: list[int]) -> np.ndarray:  # noqa: E741
        return found.S_bar_kl(k, l).toarray()[np.ix_(rows, columns)] / found.mass

    np.testing.assert_allclose(per_mass(0, 0, along, along), np.array([[2, 1], [1, 2]]) / 6, atol=1e-14)
    np.testing.assert_allclose(per_mass(1, 1, across, across), scale @ cubic @ scale, atol=1e-14)
    np.testing.assert_allclose(per_mass(0, 1, along, across), mixed @ scale, atol=1e-14)
    np.testing.assert_allclose(found.S_bar[1, across] / found.mass, np.array([6, length, 6, -length]) / 12, atol=1e-14)
    np.testing.assert_allclose(found.S_bar @ found.q_0, found.r_dm, rtol=1e-13)
    np.testing.assert_allclose(found.q_0 @ (found.S_bar_kl(0, 0) @ found.q_0), found.rr_dm[0, 0], rtol=1e-13)


def test_rigid_motions_have_the_mass_and_inertia_of_the_frame():
    frame, found = structure(), nodal_integrals(structure())
    motions = np.zeros((len(frame.points), 6, 6))
    motions[:, :3, :3] = motions[:, 3:, 3:] = np.eye(3)
    motions[:, :3, 3:] = -np.cross(np.eye(3), frame.points[:, None])
    T = motions.reshape(-1, 6)
    s = found.I2
    coupling = np.array([[0, -s[2], s[1]], [s[2], 0, -s[0]], [-s[1], s[0], 0]])
    rigid = np.block([[found.I1 * np.eye(3), -coupling], [coupling, found.I7]])
    np.testing.assert_allclose(T.T @ (found.I6 @ T), rigid, atol=1e-12 * np.abs(rigid).max())
    np.testing.assert_allclose(found.I4 @ T[:, 3:], found.I7, atol=1e-12 * np.abs(rigid).max())


@pytest.mark.parametrize("name", NAMES)
def test_the_integrals_of_a_body_follow(name):
    """With q_n = B q_f each integral of the body is that of the nodal coordinates, contracted with B."""
    frame, regions = structure(), [InterfaceRegion("root"), InterfaceRegion("tip")]
    model = fp.from_frame(frame, regions)
    Z = np.random.default_rng(1).normal(size=(model.coupled.K.shape[0], 3))
    B = tie(frame, regions) @ Z
    own = model.inertia(Z)
    expected = integral(_view(own), name)
    nodal = in_full(nodal_integrals(frame), name)
    per_node = {"I9": "ia,jb,ijkl->abkl", "I8": "ia,ikl->akl"}
    pairs = name in ("I5", "I6") or name[:6] in ("S_bar_", "N_bar_")
    if name in per_node:
        found = np.einsum(per_node[name], *([B] * (1 + (name == "I9"))), nodal)
    elif pairs:
        found = B.T @ nodal @ B
    else:
        found = nodal @ B if nodal.shape[-1:] == (len(B),) else nodal
    np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())


def _view(own):
    """The integrals of any basis under the names of a body, whose constructor asks for an orthonormal one."""
    body = object.__new__(fp.FlexibleBody)
    for key, value in vars(own).items():
        object.__setattr__(body, key, value)
    return body


def test_a_table_of_all_and_each_in_full(tmp_path, capsys):
    (tmp_path / "rod.toml").write_text(
        """
        reference = {kind = "simply-supported", pin = "A", roller = "B"}
        reduction = {method = "craig-bampton", modes = 1}
        [[polylines]]
        member = "rod"
        corners = [[0, 0, 0], [0.4, 0, 0]]
        elements = 2
        [members.rod]
        section = {shape = "circle", d = 0.01}
        material = "steel"
        [nodes]
        A = [0, 0, 0]
        B = [0.4, 0, 0]
        [interfaces.A]
        [interfaces.B]
        """
    )
    main(["info", str(tmp_path / "rod.toml")])
    table = capsys.readouterr().out
    assert "18 degrees of freedom" in table
    assert all(f" {name} " in table for name in NAMES)
    main(["reduce-structure", str(tmp_path / "rod.toml"), "-o", str(tmp_path / "rod.ffr")])
    body = fp.load_body(tmp_path / "rod.ffr")
    capsys.readouterr()
    main(["info", str(tmp_path / "rod.ffr")])
    assert list(integral_lines(body))[-1] in capsys.readouterr().out
    main(["info", str(tmp_path / "rod.ffr"), "--terms", "N_bar_xy", "--terms", "I2", "-o", str(tmp_path / "kept.npz")])
    lines = capsys.readouterr().out.splitlines()
    shown = np.array([line.split() for line in lines[1 : 1 + body.n]], float)
    np.testing.assert_allclose(shown, body.N_bar_kl(0, 1), atol=1e-5)
    kept = np.load(tmp_path / "kept.npz")
    np.testing.assert_array_equal(kept["N_bar_xy"], body.N_bar_kl(0, 1))
    assert sorted(kept) == ["I2", "N_bar_xy"]


def test_what_is_not_there_is_told(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["info", str(tmp_path / "no.ffr"), "--terms", "I10"])
    assert "there is no integral 'I10'" in capsys.readouterr().err
    large = nodal_integrals(fp.polyline([(0, 0, 0), (1, 0, 0)], fp.Member(fp.circle(0.01), STEEL), elements=300))
    with pytest.raises(InputError, match="S_bar_xx has 1806 rows and columns; take the sparse matrices"):
        in_full(large, "S_bar_xx")
    with pytest.raises(InputError, match="no integral 'S_bar_xw'"):
        integral(large, "S_bar_xw")
