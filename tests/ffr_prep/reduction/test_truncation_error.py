"""How much too high frequencies are by the shapes that a reduction leaves out: against all modes of the same model."""

from __future__ import annotations

import numpy as np
import pytest

import ffr_prep as fp
from ffr_prep.body import TRUNCATION_ERROR, errors_of_modes
from ffr_prep.report.text import body_lines

LENGTH = 0.4


def bar(reduction, reference=None, elements: int = 16) -> fp.FlexibleBody:
    member = fp.Member(fp.rectangle(0.02, 0.03), fp.material("steel"), (0, 1, 0))
    line = fp.polyline([(0, 0, 0), (LENGTH, 0, 0)], member, elements=elements)
    ends = [fp.InterfaceRegion("root"), fp.InterfaceRegion("end")]
    model = fp.from_frame(fp.named(line, root=(0, 0, 0), end=(LENGTH, 0, 0)), ends)
    conditions = fp.FixedTo("root") if reference is None else reference
    return fp.reduce(model, fp.Request(name="bar", reference=conditions, reduction=reduction, linear=True))


def told(body: fp.FlexibleBody) -> dict[int, float]:
    return errors_of_modes(body.provenance, TRUNCATION_ERROR)


@pytest.mark.parametrize("reference", [fp.FixedTo("root"), fp.MeanAxis(), fp.SimplySupported("root", "end")])
@pytest.mark.parametrize(
    "reduction", [fp.CraigBampton(1), fp.CraigBampton(4), fp.Rubin(4), fp.Krylov(2), fp.Guyan(), fp.CraigBampton(12)]
)
def test_it_is_the_difference_from_the_modes_of_the_whole_model(reference, reduction):
    """To a fiftieth up to a tenth of the frequency; what is more is told to be more, and seldom to be too much."""
    body, whole = bar(reduction, reference), bar(fp.Eigenmodes(40), reference)
    found = told(body)
    assert list(found) == [2**k for k in range(body.n.bit_length())]
    for mode, error in found.items():
        true = body.frequencies[mode - 1] / whole.frequencies[mode - 1] - 1
        if true <= 0.1:
            assert error == pytest.approx(true, rel=0.02, abs=1e-6)
        else:
            assert 0.05 < error <= 1.001 * true


def test_what_the_steps_have_in_common_is_no_new_shape():
    """A skew bar of eight elements, simply supported: the steps of two modes add one shape, but for rounding; as one of no
    stiffness it made the lowest frequency a million times too high."""
    end = (-0.052431627616548585, -0.12665712347290606, 0.06409289924958332)
    member = fp.Member(fp.rectangle(0.03909776, 0.02548206), fp.material("steel"), (0.31, 0.52, 0.8))
    line = fp.polyline([(0, 0, 0), end], member, elements=8)
    model = fp.from_frame(
        fp.named(line, root=(0, 0, 0), end=end), [fp.InterfaceRegion("root"), fp.InterfaceRegion("end")]
    )
    asked = {"name": "bar", "reference": fp.SimplySupported("root", "end"), "linear": True}
    body, whole = (
        fp.reduce(model, fp.Request(reduction=of, **asked)) for of in (fp.CraigBampton(2), fp.Eigenmodes(20))
    )
    for mode in (1, 2):
        true = body.frequencies[mode - 1] / whole.frequencies[mode - 1] - 1
        assert told(body)[mode] == pytest.approx(true, rel=0.02, abs=1e-8)


@pytest.mark.parametrize("reference", [fp.FixedTo("root"), fp.MeanAxis()])
@pytest.mark.parametrize("reduction", [fp.CharacteristicModes(0, 4), fp.CharacteristicModes(2, 3)])
def test_a_mode_that_no_shape_takes_part_in_is_missed(reference, reduction):
    """The lowest motions of the ends bend a bar and do not twist it: a mode of torsion is told to be missing by the
    numbers of those beyond, though these are nearly the model's own. Without, 0.39 and 0.10 were told of 0.97 and 0.44."""
    body, whole = bar(reduction, reference), bar(fp.Eigenmodes(40), reference)
    mode, error = max(told(body).items())
    assert mode == 4
    assert error == pytest.approx(body.frequencies[3] / whole.frequencies[3] - 1, rel=0.02)


def test_modes_of_the_model_have_none():
    assert max(told(bar(fp.Eigenmodes(12))).values()) == 0.0
    assert max(told(bar(fp.CraigBampton(6), elements=2)).values()) < 1e-9  # as many as there are
    assert told(bar(fp.Guyan(), elements=1)).keys() == {1, 2, 4}


def test_a_body_tells_it_and_keeps_it(tmp_path):
    body = fp.load_body(fp.save_body(bar(fp.CraigBampton(1)), tmp_path / "bar.ffr"))
    (line,) = (line for line in body_lines(body) if line.startswith("modes error"))
    assert line.startswith("modes error frequencies too high by about 0.0")
    assert line.endswith(" 60 % (4); in brackets the mode")
    few = fp.truncated(body, np.array([3, 0]))
    assert told(few) == {1: told(body)[4], 2: told(body)[1]}
    assert not any(line.startswith("modes error") for line in body_lines(bar(fp.Eigenmodes(4))))


def test_a_lowest_frequency_that_is_off_is_a_warning():
    """The free bar has 22.37 for its unit of bending; the static shapes of its ends bend as 26.8."""
    body = bar(fp.Guyan(), fp.MeanAxis())
    (warning,) = (one for one in body.provenance["warnings"] if "too few" in one)
    assert "the lowest frequency under its reference conditions is about 20 % too high; keep more modes" in warning
    assert not any("too few" in one for one in bar(fp.CraigBampton(4), fp.MeanAxis()).provenance["warnings"])
