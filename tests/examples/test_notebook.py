"""The notebooks run from end to end, and their cells show what they are to show."""

from __future__ import annotations

import sys

import pytest
from places import ROOT

NOTEBOOKS = sorted((ROOT / "examples").glob("*.ipynb"))


def run(path):
    """The cells of a notebook with code, after they have run."""
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    from jupyter_client.kernelspec import KernelSpec, KernelSpecManager
    from jupyter_client.manager import AsyncKernelManager

    class ThisPython(KernelSpecManager):
        """The kernel of the interpreter that runs the tests."""

        def get_kernel_spec(self, kernel_name):
            return KernelSpec(
                argv=[sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"], language="python"
            )

    notebook = nbformat.read(path, as_version=4)
    manager = AsyncKernelManager(kernel_spec_manager=ThisPython())
    nbclient.NotebookClient(notebook, timeout=600, km=manager, resources={"metadata": {"path": str(ROOT)}}).execute()
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


@pytest.fixture(scope="module")
def cells():
    return run(ROOT / "examples" / "pendulum.ipynb")


def shown(cells, start):
    """What the cell that contains these words shows, by kind; and what it prints."""
    (cell,) = (cell for cell in cells if start in cell.source)
    kinds = {kind: text for output in cell.outputs for kind, text in output.get("data", {}).items()}
    return kinds, "".join(output.get("text", "") for output in cell.outputs)


@pytest.mark.slow
def test_bodies_scenes_and_results_are_tables(cells):
    for words in ("rod = fp.reduce", "scene = fd.Scene", "result = fd.forward"):
        kinds, _ = shown(cells, words)
        assert kinds["text/html"].startswith("<table>")
        assert len(kinds["text/plain"]) < 1200


@pytest.mark.slow
def test_scenes_and_films_are_viewers_and_plots_are_pictures(cells):
    for words in ("fd.show", "fd.animate"):
        kinds, _ = shown(cells, words)
        assert kinds["text/html"].startswith("<iframe srcdoc=")
        assert len(kinds["text/html"]) < 500_000
        assert len(kinds["text/plain"]) < 200
    assert "image/png" in shown(cells, "fd.plot")[0]


def test_runs_tell_how_far_they_are(cells):
    assert "pendulum: 100 %" in shown(cells, "fd.progress")[1]


@pytest.mark.slow
def test_a_part_shows_its_faces_an_error_bar_and_its_stress():
    cells = run(ROOT / "examples" / "part.ipynb")
    assert "bore r 6, axis (0, 0, 1), centre (45, 25, 5) mm" in shown(cells, "fp.faces")[0]["text/html"]
    assert "surface_14" in shown(cells, "fp.found_faces")[0]["text/plain"]
    assert "largest reaction 6.79" in shown(cells, "largest reaction")[1]
    assert shown(cells, "fd.hot_spots")[1].count("MPa") == 3
    assert shown(cells, "fd.animate")[0]["text/html"].startswith("<iframe srcdoc=")


@pytest.mark.slow
def test_a_rotor_shows_its_diagram_and_a_whirl():
    cells = run(ROOT / "examples" / "rotor.ipynb")
    assert "image/png" in shown(cells, "fd.campbell")[0]
    assert "critical: 173.4 rad/s, shaft: first bending, forward" in shown(cells, "critical:")[1]
    assert shown(cells, "fd.animate")[0]["text/html"].startswith("<iframe srcdoc=")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_use_the_front_doors_and_are_kept_without_what_they_show(path):
    nbformat = pytest.importorskip("nbformat")
    cells = nbformat.read(path, as_version=4).cells
    assert all(not cell.get("outputs") for cell in cells)
    imported = {line for cell in cells for line in cell.source.splitlines() if line.startswith(("import", "from"))}
    assert imported <= {"import ffr_dyn as fd", "import ffr_prep as fp", "import numpy as np"}
