"""Every message of ffr_prep has a remedy that works: what raises it, and the same mended as it says, which runs."""

from __future__ import annotations

import re
from functools import cache

import prep_body_cases
import prep_command_cases
import prep_exchange_cases
import prep_matrix_cases
import prep_mesh_cases
import prep_model_cases
import prep_numerics_cases
import prep_source_cases
import prep_structure_cases
import pytest
from said import numbered, texts_of

import ffr_prep as fp
from ffr_prep.common.errors import ComputationError, InputError

# What is a part of a message, or one made elsewhere.
PARTS: dict[str, tuple[str, ...]] = {
    "common/outputs.py": ("not_written", "_in_use"),
    "common/reading.py": ("not_of_its_ending",),
}
CASES, NAMES = numbered(
    {
        "command": prep_command_cases.CASES,
        "model": prep_model_cases.CASES,
        "mesh": prep_mesh_cases.CASES,
        "structure": prep_structure_cases.CASES,
        "matrix": prep_matrix_cases.CASES,
        "exchange": prep_exchange_cases.CASES,
        "source": prep_source_cases.CASES,
        "numerics": prep_numerics_cases.CASES,
        "body": prep_body_cases.CASES,
    }
)


@cache
def texts() -> dict[str, tuple[re.Pattern[str], ...]]:
    return texts_of("ffr_prep", PARTS)


@cache
def message(number: int) -> str:
    """What a case raises."""
    with pytest.raises((InputError, ComputationError)) as caught:
        CASES[number].raised()
    return str(caught.value)


@pytest.mark.parametrize("number", range(len(CASES)), ids=NAMES)
def test_a_text_is_raised_and_its_remedy_works(number):
    assert message(number)
    CASES[number].mended()


@pytest.mark.slow
def test_every_text_has_a_case():
    said = [message(k) for k in range(len(CASES))]
    missing = {m: [t.pattern for t in found if not any(map(t.search, said))] for m, found in texts().items()}
    assert {m: without for m, without in missing.items() if without} == {}


STEEL_BAR = fp.Member(fp.circle(0.02), fp.material("steel"))
BAR = fp.named(fp.polyline([(0, 0, 0), (1, 0, 0)], STEEL_BAR), root=(0, 0, 0))
ROOT_END = fp.InterfaceRegion("root")
SHEET = fp.Shell(0.01, fp.material("steel"))
REQUEST = fp.Request(name="bar", reference=fp.FixedTo("root"), reduction=fp.Guyan())
SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: fp.Member("tube", STEEL_BAR.material),
        lambda: fp.Member(STEEL_BAR.section, "steel"),
        lambda: fp.Shell(0.01, "steel"),
        lambda: fp.polyline([(0, 0, 0), (1, 0, 0)], STEEL_BAR.section),
        lambda: fp.panel(SQUARE, STEEL_BAR, elements=(2, 2)),
        lambda: fp.panel(SQUARE, SHEET, elements=2),
        lambda: fp.from_frame(BAR, ROOT_END),
        lambda: fp.from_mesh(BAR, STEEL_BAR.material, [ROOT_END]),
        lambda: fp.reduce(BAR, REQUEST),
        lambda: fp.Request(name="bar", reference=fp.FixedTo("root"), reduction=4),
        lambda: fp.with_reference(fp.rigid_body("a", mass=1.0, inertia=(1, 1, 1)), "mean-axis"),
    ],
)
def test_what_is_of_another_type_is_refused_in_a_sentence(wrong):
    with pytest.raises(InputError, match="; give "):
        wrong()
