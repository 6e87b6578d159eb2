"""Packages import only lower layers; results and figures work without the engine."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from importlinter.cli import lint_imports

import gearchaos
from gearchaos.__main__ import COMMANDS

ROOT = Path(__file__).resolve().parents[2]

ENGINE = {"numba", "llvmlite", "gearchaos_kernels"}
# Importing importlib.metadata imports email. Slow imports are made where an interrupt is caught.
HEAVY = ENGINE | {"numpy", "h5py", "matplotlib", "pydantic", "tqdm", "email", "inspect"}


def imported_by(statement: str) -> set[str]:
    """List the top-level packages that a statement imports into a new process."""
    code = f"import sys\n{statement}\nprint(*{{name.split('.')[0] for name in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_the_import_contracts_of_the_project_are_kept(capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    code = lint_imports(config_filename=str(ROOT / "pyproject.toml"), no_cache=True)
    assert code == 0, capsys.readouterr().out


@pytest.mark.parametrize(
    "statement",
    [
        "import gearchaos.results.reading.result",
        "import gearchaos.figures",
        "import gearchaos.plot",
        "import gearchaos.info",
        "from gearchaos import open_result, load_config, GearchaosError",
    ],
)
def test_results_figures_and_configurations_need_no_engine(statement):
    assert not imported_by(statement) & ENGINE


@pytest.mark.parametrize(
    "statement",
    [
        "import gearchaos",
        "import gearchaos.__main__",
        "dir(gearchaos)",
        *(f"import gearchaos.{name}" for name in COMMANDS),
    ],
)
def test_commands_start_light(statement):
    assert not imported_by(f"import gearchaos; {statement}") & HEAVY


@pytest.mark.parametrize(
    "arguments",
    [["--help"], ["swep"], ["sweep", "--help"], ["plot", "a.h5", "--dpi", "x"], ["info", "--al"]],
)
def test_help_and_wrong_arguments_import_nothing_heavy(arguments):
    statement = f"""
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from gearchaos.__main__ import main
with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
    main({arguments})
"""
    assert not imported_by(statement) & HEAVY


def test_the_kernels_know_nothing_of_the_layers_above():
    above = {"gearchaos", "h5py", "matplotlib", "pydantic", "tqdm"}
    assert not imported_by("import gearchaos_kernels") & above


def test_running_needs_the_kernels_but_no_figures():
    packages = imported_by("from gearchaos import run")
    assert packages >= ENGINE
    assert "matplotlib" not in packages


def test_editors_see_the_names_of_the_package():
    stub = (ROOT / "gearchaos" / "__init__.pyi").read_text(encoding="utf-8")
    assert sorted(re.findall(r"import \w+ as (\w+)$", stub, re.MULTILINE)) == gearchaos.__all__
    assert all(hasattr(gearchaos, name) for name in gearchaos.__all__)
