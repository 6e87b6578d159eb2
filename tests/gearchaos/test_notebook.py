"""The tutorials are notebooks; they run and print the output that they contain."""

import json
import os
import re
import sys
from pathlib import Path

import pytest

from .commands import HANGS

NOTEBOOKS = sorted((Path(__file__).parents[2] / "docs" / "tutorials").glob("*.ipynb"))
ANY_TEXT = "nbval-ignore-output"
"""Tag of cells whose text depends on the machine: estimates of time, long transients."""


def printed(notebook):
    """Return the printed text of each cell and the kinds of its pictures."""
    shown = []
    for cell in notebook.cells:
        outputs = cell.get("outputs", [])
        # A terminal also ends lines with a carriage return.
        text = "".join(output.get("text", "").replace("\r", "") for output in outputs)
        kinds = [sorted(output["data"]) for output in outputs if "data" in output]
        shown.append((bool(text) if ANY_TEXT in cell.metadata.get("tags", ()) else text, kinds))
    return shown


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_prints_what_it_shows(path, tmp_path, monkeypatch):
    # Imported here: processes that only collect this test do not need these packages.
    import nbformat
    from nbclient import NotebookClient

    # The notebook runs the commands of this environment.
    scripts = str(Path(sys.executable).parent)
    monkeypatch.setenv("PATH", os.pathsep.join((scripts, os.environ["PATH"])))
    notebook = nbformat.read(path, as_version=4)
    shown = printed(notebook)
    resources = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(notebook, timeout=HANGS, resources=resources).execute()
    assert printed(notebook) == shown


def test_the_notebooks_have_pictures_and_are_small():
    kinds = {path.stem: json.dumps(json.loads(path.read_text("utf-8"))) for path in NOTEBOOKS}
    assert len(kinds) == 6
    assert {name for name, text in kinds.items() if "image/png" not in text} == {"many-machines"}
    assert sum(path.stat().st_size for path in NOTEBOOKS) < 2e6


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_outputs_of_a_notebook_are_of_no_machine_and_no_hour(path):
    for cell in json.loads(path.read_text("utf-8"))["cells"]:
        text = json.dumps([output.get("text", "") for output in cell.get("outputs", [])])
        assert not re.search(r"/(tmp|root|home|usr)/|[A-Z]:\\\\|\d\d:\d\d|\d{4}-\d\d-\d\d", text)
        assert "execution" not in cell["metadata"]  # The times at which cells ran.
