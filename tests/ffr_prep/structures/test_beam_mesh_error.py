"""How much too high frequencies are by the length of beam elements: against much shorter ones, and in closed form."""

from __future__ import annotations

import numpy as np
import pytest

import ffr_prep as fp
from ffr_prep.body import mesh_doubt, mesh_errors_of

LENGTH = 0.4
STEEL = fp.Material("steel", E=2.1e11, nu=0.3, rho=7850.0)


def bar(elements: int, section: fp.Section, modes: int, reference=None, path=((0, 0, 0), (LENGTH, 0, 0))):
    line = fp.polyline(list(path), fp.Member(section, STEEL, (0, 1, 0.3)), elements=elements)
    model = fp.from_frame(fp.named(line, root=path[0], end=path[-1]), [fp.InterfaceRegion(e) for e in ("root", "end")])
    conditions = fp.FixedTo("root") if reference is None else reference
    return fp.reduce(model, fp.Request(name="bar", reference=conditions, reduction=fp.Eigenmodes(modes), linear=True))


@pytest.mark.parametrize("reference", [fp.FixedTo("root"), fp.MeanAxis()])
@pytest.mark.parametrize("section", [fp.rectangle(0.02, 0.03), fp.rectangle(0.1, 0.12), fp.circle(0.004)])
@pytest.mark.parametrize("elements", [1, 2, 4])
def test_it_is_the_difference_from_short_elements(elements, section, reference):
    """Of the same kind of vibration: to a third up to a tenth of the frequency, and seldom more than there is."""
    body = bar(elements, section, min(8, 6 * elements), reference)
    fine = bar(16 * elements, section, 40, reference)
    of_kind, kinds = kinds_of(fine), kinds_of(body)
    for mode, error in mesh_errors_of(body.provenance).items():
        rank = np.count_nonzero(kinds[: mode - 1] == kinds[mode - 1])
        true = body.frequencies[mode - 1] / fine.frequencies[of_kind == kinds[mode - 1]][rank] - 1
        assert error == pytest.approx(true, rel=0.33, abs=2e-4) or 0.06 < error < true


def kinds_of(body: fp.FlexibleBody) -> np.ndarray:
    """(n,) along which axis the end of each mode moves or turns most."""
    end = body.interface("end")
    return np.abs(np.vstack([end.phi_t[0], end.phi_r * LENGTH / 2])).argmax(axis=0)


def test_a_rod_of_one_element_in_closed_form():
    """Stretch x / l sqrt(3 / m) of a clamped rod has omega^2 = 3 E / rho l^2. Its inertia makes a force that is off its mean
    by E A / l sqrt(3 / m) (1 - 3 x^2 / l^2) / 2, and g = 1/5: 9.5 % of 10.3."""
    body = bar(1, fp.rectangle(0.3, 0.3), 6)
    (k,) = np.flatnonzero(kinds_of(body) == 0)
    assert body.omega2[k] == pytest.approx(3 * STEEL.E / STEEL.rho / LENGTH**2, rel=1e-9)
    assert np.sqrt(3) / (np.pi / 2) - 1 == pytest.approx(0.1027, abs=1e-4)
    told = {mode: error for mode, error in mesh_errors_of(body.provenance).items() if mode == k + 1}
    assert told == {k + 1: pytest.approx(np.sqrt(1 + 1 / 5) - 1, rel=1e-9)}


def test_coarse_members_are_a_warning():
    """A bent frame in one element to a side."""
    body = bar(1, fp.rectangle(0.02, 0.03), 2, fp.MeanAxis())
    assert "its mesh is too coarse: the lowest frequency is about" in mesh_doubt(body.provenance)
    assert "give its members more elements (`elements`)" in mesh_doubt(body.provenance)
    assert mesh_doubt(bar(4, fp.rectangle(0.02, 0.03), 2).provenance) is None
