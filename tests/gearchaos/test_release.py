"""Version, paper and supported systems of a release are the same in every file."""

import re
import subprocess
import tomllib
from pathlib import Path

CLONE = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((CLONE / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def read(name: str) -> str:
    """Return the text of a file of the clone."""
    return (CLONE / name).read_text(encoding="utf-8")


def test_the_version_is_the_same_everywhere():
    (cited,) = re.findall(r"^version: (.*)$", read("CITATION.cff"), re.MULTILINE)
    newest = re.findall(r"^## (\S+)", read("CHANGELOG.md"), re.MULTILINE)[0]
    assert PROJECT["version"] == cited == newest


def test_the_paper_is_the_same_everywhere():
    (doi,) = re.findall(r"doi: (\S+)", read("CITATION.cff"))
    assert PROJECT["urls"]["Paper"] == f"https://doi.org/{doi}"
    assert f"https://doi.org/{doi}" in read("docs/tutorials/paper.ipynb")


def test_the_workflows_test_every_python_and_system_that_is_declared():
    workflow = read(".github/workflows/tests.yml")
    classifiers = PROJECT["classifiers"]
    declared = [one.split()[-1] for one in classifiers if re.search(r"Python :: 3\.\d+$", one)]
    assert f"python: {declared}".replace("'", '"') in workflow
    systems = {one.split()[-1].lower() for one in classifiers if one.startswith("Operating")}
    named = {"linux": "ubuntu", "macos": "macos", "windows": "windows"}
    assert all(f"{named[system]}-latest" in workflow for system in systems) and len(systems) == 3
    assert PROJECT["requires-python"] == f">={declared[0]}"


def test_the_script_of_all_checks_is_a_script():
    subprocess.run(["bash", "-n", CLONE / ".ci" / "run"], check=True)
