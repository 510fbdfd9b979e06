"""The notebook runs from end to end, and its cells show what they are to show."""

from __future__ import annotations

import sys

import pytest
from places import ROOT

NOTEBOOK = ROOT / "examples" / "pendulum.ipynb"


@pytest.fixture(scope="module")
def cells():
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

    notebook = nbformat.read(NOTEBOOK, as_version=4)
    manager = AsyncKernelManager(kernel_spec_manager=ThisPython())
    nbclient.NotebookClient(notebook, timeout=600, km=manager, resources={"metadata": {"path": str(ROOT)}}).execute()
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def shown(cells, start):
    """What the cell that contains these words shows, by kind; and what it prints."""
    (cell,) = (cell for cell in cells if start in cell.source)
    kinds = {kind: text for output in cell.outputs for kind, text in output.get("data", {}).items()}
    return kinds, "".join(output.get("text", "") for output in cell.outputs)


def test_bodies_scenes_and_results_are_tables(cells):
    for words in ("rod = fp.reduce", "scene = fd.Scene", "result = fd.forward"):
        kinds, _ = shown(cells, words)
        assert kinds["text/html"].startswith("<table>")
        assert len(kinds["text/plain"]) < 1200


def test_scenes_and_films_are_viewers_and_plots_are_pictures(cells):
    for words in ("fd.show", "fd.animate"):
        kinds, _ = shown(cells, words)
        assert kinds["text/html"].startswith("<iframe srcdoc=")
        assert len(kinds["text/html"]) < 500_000
        assert len(kinds["text/plain"]) < 200
    assert "image/png" in shown(cells, "fd.plot")[0]


def test_runs_tell_how_far_they_are(cells):
    assert "pendulum: 100 %" in shown(cells, "fd.progress")[1]


def test_the_notebook_is_kept_without_what_it_shows():
    nbformat = pytest.importorskip("nbformat")
    assert all(not cell.get("outputs") for cell in nbformat.read(NOTEBOOK, as_version=4).cells)
