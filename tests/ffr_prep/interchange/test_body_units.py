"""Bodies in other units: the same motion, frequencies and forces, whatever the numbers of the file are in."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic import cloud

from ffr_prep.body import load_body
from ffr_prep.cli import main
from ffr_prep.interchange.body_units import in_si_units
from ffr_prep.interchange.formats import import_body
from ffr_prep.interchange.sid import write_sid
from ffr_prep.matrices.unit_systems import UNIT_SYSTEMS, UnitSystem


def in_units(body, name):
    """The numbers that a file in these units would have."""
    of = UNIT_SYSTEMS[name]
    return in_si_units(body, UnitSystem(1 / of.length, 1 / of.mass, 1 / of.time))


def rich():
    half = np.random.default_rng(4).normal(size=(12 + 18, 3, 3))
    body = replace(cloud(3), stiffening=half + half.transpose(0, 2, 1), damping=np.diag([1.0, 2.0, 3.0]))
    return replace(body, surface=None)


@pytest.mark.parametrize("name", UNIT_SYSTEMS)
def test_a_body_in_other_units_is_the_same_in_si(tmp_path, name):
    body = replace(rich(), stiffening=None)
    back = import_body(write_sid(in_units(body, name), tmp_path / "b.SID_FEM"), units=name)
    for key in ("r_dm", "rr_dm", "P_dm", "rP_dm", "PP_dm", "omega2", "damping"):
        np.testing.assert_allclose(getattr(back, key), getattr(body, key), rtol=1e-9, atol=1e-12, err_msg=key)
    for one, other in zip(back.interfaces, body.interfaces, strict=True):
        np.testing.assert_allclose(one.phi_r, other.phi_r, rtol=1e-9)


@pytest.mark.parametrize("name", UNIT_SYSTEMS)
def test_energies_of_loads_are_the_same(name):
    """q K q per unit load, of a load and a displacement in the units of the file, is the energy in its unit."""
    body, of = rich(), UNIT_SYSTEMS[name]
    given = in_units(body, name)
    q = np.array([0.1, -0.2, 0.3])
    q_file = q / (np.sqrt(of.mass) * of.length)
    energy = of.mass * of.length**2 / of.time**2
    acceleration, turning, force = of.length / of.time**2, 1 / of.time**2, of.mass * of.length / of.time**2
    size = np.array([acceleration] * 3 + [turning] * 9 + ([force] * 3 + [force * of.length] * 3) * 3)
    in_file = np.einsum("lij,i,j->l", given.stiffening, q_file, q_file) * energy
    np.testing.assert_allclose(in_file, np.einsum("lij,i,j->l", body.stiffening, q, q) * size, rtol=1e-9)


def test_lengths_in_millimetres_are_asked_about(tmp_path, capsys):
    path = write_sid(in_units(replace(rich(), stiffening=None), "mm-t-s"), tmp_path / "b.SID_FEM")
    main(["import", str(path), "-o", str(tmp_path / "a.ffr")])
    assert "are its lengths millimetres? Then import it with --units" in capsys.readouterr().out
    main(["import", str(path), "-o", str(tmp_path / "b.ffr"), "--units", "mm-t-s"])
    assert "are its lengths" not in capsys.readouterr().out
    assert load_body(tmp_path / "b.ffr").mass == pytest.approx(cloud(3).mass)
