"""Every message of ffr_prep has a remedy that works: what raises it, and the same mended as it says, which runs."""

from __future__ import annotations

import re
from functools import cache

import prep_command_cases
import prep_exchange_cases
import prep_matrix_cases
import prep_mesh_cases
import prep_model_cases
import prep_structure_cases
import pytest
from said import texts_of

from ffr_prep.common.errors import ComputationError, InputError

# What is a part of a message, or one made elsewhere.
PARTS: dict[str, tuple[str, ...]] = {
    "common/outputs.py": ("not_written", "_in_use"),
    "common/reading.py": ("not_of_its_ending",),
}
CASES = (
    prep_command_cases.CASES
    + prep_model_cases.CASES
    + prep_mesh_cases.CASES
    + prep_structure_cases.CASES
    + prep_matrix_cases.CASES
    + prep_exchange_cases.CASES
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


@pytest.mark.parametrize("number", range(len(CASES)))
def test_a_text_is_raised_and_its_remedy_works(number):
    assert message(number)
    CASES[number].mended()


# Texts without a case, by module: a list that may only become shorter. New texts are written with a case.
UNCOVERED = {
    "body/constructors.py": 1,
    "body/file.py": 1,
    "body/mean_axis.py": 2,
    "body/planar.py": 1,
    "body/reduced.py": 6,
    "cli/matrices.py": 1,
    "cli/options.py": 1,
    "common/command.py": 1,
    "common/hdf5.py": 1,
    "common/outputs.py": 3,
    "common/process_memory.py": 1,
    "common/reading.py": 4,
    "interchange/common_format.py": 4,
    "interchange/formats.py": 2,
    "interchange/mbdyn_records.py": 1,
    "interchange/sid_moments.py": 1,
    "matrices/abaqus.py": 2,
    "matrices/checks.py": 6,
    "matrices/model.py": 1,
    "matrices/nastran.py": 10,
    "matrices/npz.py": 1,
    "matrices/part.py": 1,
    "matrices/skfem_model.py": 7,
    "mesh/geometry/region_words.py": 1,
    "mesh/geometry/regions.py": 1,
    "mesh/gmsh_files.py": 6,
    "mesh/mesh.py": 4,
    "mesh/meshio_files.py": 2,
    "model/cuts.py": 2,
    "model/reactions.py": 1,
    "pipelines/reduce.py": 3,
    "pipelines/tied.py": 4,
    "reduction/basis.py": 4,
    "reduction/methods/krylov.py": 2,
    "reduction/modes.py": 1,
    "reduction/receptance.py": 1,
    "reduction/responses.py": 1,
    "reduction/second_order.py": 1,
    "reduction/selected_modes.py": 1,
    "reduction/turned_stiffening.py": 1,
    "report/integrals.py": 1,
    "report/mode_pictures.py": 2,
    "solids/assembly.py": 1,
    "solids/interfaces.py": 1,
    "solids/reference_regions.py": 1,
    "solids/surface_regions.py": 1,
    "solvers/factor.py": 4,
    "solvers/lanczos.py": 1,
    "solvers/slepc.py": 4,
    "solvers/verification.py": 3,
    "structures/frame_geometry.py": 2,
}


def test_every_other_text_has_a_case():
    said = [message(k) for k in range(len(CASES))]
    missing = {m: [t.pattern for t in found if not any(map(t.search, said))] for m, found in texts().items()}
    assert {m: without for m, without in missing.items() if len(without) != UNCOVERED.get(m, 0)} == {}
