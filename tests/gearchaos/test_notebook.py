"""The notebook in docs/ runs, and still prints what it shows."""

from pathlib import Path

import pytest

from .commands import HANGS

NOTEBOOK = Path(__file__).parents[2] / "docs" / "own_pair.ipynb"


def printed(notebook):
    """Return what each cell has printed, and which kinds of pictures it shows."""
    return [
        [output.get("text") or sorted(output["data"]) for output in cell.get("outputs", [])]
        for cell in notebook.cells
    ]


@pytest.mark.slow
def test_the_notebook_runs_and_prints_what_it_shows(tmp_path):
    # Not imported by the processes that only collect this test.
    import nbformat
    from nbclient import NotebookClient

    notebook = nbformat.read(NOTEBOOK, as_version=4)
    shown = printed(notebook)
    resources = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(notebook, timeout=HANGS, resources=resources).execute()
    assert printed(notebook) == shown
    assert sum(["image/png" in output for cell in shown for output in cell]) == 2
