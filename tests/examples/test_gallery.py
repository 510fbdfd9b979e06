"""The gallery of instability: what an exhibit is, and that each one fails and holds as it claims."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from ffr_gallery.bodies import beam
from ffr_gallery.exhibit import Claim, Curve, Exhibit, Panel, Proof, boundary, draw, lines
from ffr_gallery.exhibits import EXHIBITS, SHORT
from ffr_gallery.index3_conditioning import index3_conditioning

from ffr_dyn import cli

QUICK = ("index3-conditioning", "redundant-bricard", "reference-conditions", "numerical-damping", "euler-angles",
         "joint-friction", "start-shock", "coarse-rows", "aligned-cranks", "stiffening-by-load", "fast-driver")  # fmt: skip

MADE = Exhibit(
    "Title", "it fails", "it holds", (Claim("a number", 2.0, 2.1, 1.1, "m"),),
    (Proof("too much", 5.0, 1.0, True), Proof("little", 0.5, 1.0, False)),
    (Panel("panel", "x", "y", (Curve("c", np.arange(1, 4), np.arange(1, 4)),), log=(True, True)),),
)  # fmt: skip


def test_what_holds_and_what_does_not(tmp_path):
    assert MADE.holds
    assert not replace(MADE, claims=(Claim("a", 2.0, 2.3, 1.1),)).holds
    assert not replace(MADE, claims=(Claim("a", 2.0, np.nan, 1.1),)).holds
    assert not replace(MADE, claims=(Claim("a", 2.0, -2.0, 1.1),)).holds
    assert not replace(MADE, proofs=(Proof("p", 0.5, 1.0, True),)).holds
    assert not replace(MADE, proofs=(Proof("p", 1.5, 1.0, False),)).holds
    assert not replace(MADE, proofs=(Proof("p", np.nan, 1.0, False),)).holds
    assert replace(MADE, proofs=(Proof("p", np.nan, 1.0, True),)).holds
    text = "\n".join(lines(MADE))
    for words in ("fails   it fails", "predicted 2, measured 2.1 m", "fails: too much: 5", "holds: little: 0.5"):
        assert words in text
    assert draw(MADE, tmp_path / "a.png").stat().st_size > 5000


def test_boundaries_are_found_by_bisection():
    assert boundary(lambda h: h < 0.3, 0.01, 10.0, 30) == pytest.approx(0.3, rel=1e-6)
    assert np.isnan(boundary(lambda h: True, 0.01, 10.0))
    assert np.isnan(boundary(lambda h: False, 0.01, 10.0))


def test_beams_have_the_frequencies_of_the_textbooks():
    """Clamped-free 1.8751^2, 4.6941^2, 7.8548^2; supported pi^2, 4 pi^2, 9 pi^2."""
    clamped, held = beam("b", 1.0, 1.0, 1.0, 3), beam("b", 1.0, 1.0, 1.0, 3, held="ends")
    np.testing.assert_allclose(clamped.omega2**0.25, (1.87510407, 4.69409113, 7.85475744), rtol=1e-3)
    np.testing.assert_allclose(held.omega2**0.25 / np.pi, (1, 2, 3), rtol=1e-3)
    np.testing.assert_allclose(np.einsum("kkij->ij", clamped.PP_dm), np.eye(3), atol=1e-10)


@pytest.mark.parametrize("name", QUICK)
def test_quick_exhibits_show_what_they_claim(name):
    exhibit = EXHIBITS[name]()
    assert exhibit.holds, "\n".join(lines(exhibit))
    assert exhibit.claims
    assert {proof.fails for proof in exhibit.proofs} == {True, False}


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in EXHIBITS if name not in QUICK])
def test_exhibits_show_what_they_claim(name, tmp_path):
    exhibit = EXHIBITS[name]()
    assert exhibit.holds, "\n".join(lines(exhibit))
    assert exhibit.claims
    assert {proof.fails for proof in exhibit.proofs} == {True, False}
    assert draw(exhibit, tmp_path / "a.png").exists()


def run(monkeypatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["ffr-dyn", "stability", *map(str, arguments)])
    try:
        cli.main()
    except SystemExit as left:
        return int(left.code or 0)
    return 0


@pytest.mark.slow
def test_the_command(tmp_path, monkeypatch, capsys):
    assert set(SHORT) <= set(EXHIBITS)
    assert run(monkeypatch, "index3-conditioning", "--quick", "-o", tmp_path) == 0
    out = capsys.readouterr().out
    assert index3_conditioning().title in out
    assert (tmp_path / "index3-conditioning.png").exists()
    assert run(monkeypatch, "idnex", "-o", tmp_path) == 2
    assert "no exhibit 'idnex'; there are explicit-limit" in capsys.readouterr().err
    monkeypatch.setitem(EXHIBITS, "drift", lambda: replace(MADE, claims=(Claim("a", 1.0, 3.0, 1.1),)))
    assert run(monkeypatch, "drift", "-o", tmp_path) == 1
    assert "do not show what they claim: drift" in capsys.readouterr().err
