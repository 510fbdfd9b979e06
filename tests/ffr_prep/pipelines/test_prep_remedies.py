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
