"""The links of the manual work, its commands exist, and its pages run.

Sweeps of thousands of lanes are run with few lanes and short records.
"""

import importlib
import json
import re
import shlex
import tomllib
from pathlib import Path
from runpy import run_path
from types import SimpleNamespace

import pytest

import gearchaos
from gearchaos.command_list import COMMANDS
from gearchaos.configuration.schema import key_tables
from gearchaos.models import GearPairConfiguration, LinearConfiguration, TrainConfiguration
from gearchaos.models.gear_pair.outputs import CATALOGUE

from .commands import run_module

CLONE = Path(__file__).resolve().parents[2]
ROOT_PAGES = [CLONE / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
NOTEBOOKS = sorted((CLONE / "docs" / "tutorials").glob("*.ipynb"))
PAGES = [*ROOT_PAGES, *sorted((CLONE / "docs").rglob("*.md"))]
NAMES = [str(page.relative_to(CLONE)) for page in PAGES]
SITE = run_path(str(CLONE / "docs" / "site" / "generated.py"))
GENERATED = {*SITE["PAGES"]}
"""Pages that exist only on the site, which generates them from the program."""

SHORT = ("integration.transient_periods=40", "integration.recorded_periods=32")
SHORT += ("outputs.section_points=8",)
ALSO = {
    # The record has whole cycles of a third of the mesh order, and of both gears.
    "orders.h5": ("integration.recorded_periods=30",),
    "sweeps/grades.toml": (
        *(
            "pitch_error.realisations=2",
            "second_sweep.values=[4.0]",
            "sweep.count=2",
            "sweep.from=7",
            "sweep.to=8",
        ),
        "integration.recorded_periods=798",
    ),
    "sweeps/basins.toml": ("start.count=4",),
    "sweeps/speed_and_error.toml": ("sweep.count=3", "second_sweep.count=3"),
}
"""Settings of single sweeps, by configuration or output file; other sweeps have five lanes."""

TOO_LONG = {"reproduce", "identify", "control", "explore", "accuracy", "merge"}
"""Commands that are only parsed here; their own tests run them on small cases."""

RUN = ("docs/getting-started.md", "docs/gallery/README.md")
RUN += tuple(name for name in NAMES if re.match("docs/how-to/(?!index|read)", name))
"""Pages whose commands and Python blocks are run in order, each page in its own folder.

`test_api_page` runs the Python blocks of the other pages.
"""


def words_of(page: Path) -> str:
    """Return the text of a page; of a notebook, the text of its Markdown cells."""
    text = page.read_text(encoding="utf-8")
    if page.suffix != ".ipynb":
        return text
    cells = json.loads(text)["cells"]
    return "\n\n".join("".join(one["source"]) for one in cells if one["cell_type"] == "markdown")


def blocks(name: str) -> list[tuple[str, str, str]]:
    """Return language, text and preceding line of every code block of a page."""
    text = (CLONE / name).read_text(encoding="utf-8")
    found = re.finditer(r"^([^\n]*)\n\n```(\w*)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    return [(one[2], one[3], one[1]) for one in found]


def commands(text: str) -> list[list[str]]:
    """Return the words of every gearchaos command in a shell block."""
    lines = text.replace("\\\n", " ").splitlines()
    parts = [part for line in lines for part in line.split(" && ")]
    found = []
    for part in parts:
        called = re.search(r"(?:python -m gearchaos\.|^\s*gearchaos )(\w[^|]*)", part)
        if called:
            found.append(shlex.split(called[1].split('"')[0] if "--wrap" in part else called[1]))
    return found


def anchors(page: Path) -> set[str]:
    """Return the anchors of the headings of a page."""
    text = re.sub(r"```.*?```", "", words_of(page), flags=re.DOTALL)
    heads = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", one.lower()).strip().replace(" ", "-") for one in heads}


def broken(page: Path) -> list[str]:
    """Return the links and pictures of a page whose file or heading does not exist."""
    text = re.sub(r"```.*?```|`[^`\n]*`", "", words_of(page), flags=re.DOTALL)
    wrong = []
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        path, _, anchor = target.partition("#")
        if re.match(r"\w+:", target):
            continue
        found = page if not path else (page.parent / path).resolve()
        in_docs = found.is_relative_to(CLONE / "docs") and not found.exists()
        if in_docs and str(found.relative_to(CLONE / "docs")) in GENERATED:
            continue
        if not found.exists() or (anchor and anchor not in anchors(found)):
            wrong.append(target)
    return wrong


def test_the_readme_is_short_and_keeps_its_two_commands():
    text = (CLONE / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 150
    found = dict(re.findall(r"<!-- (\w+) -->\n```\n(.*)\n```", text))
    assert found["main"].startswith("pip install -e . && python -m gearchaos.sweep sweeps/pan2021")
    assert found["tests"] == 'pip install -e ".[test]" && pytest'


@pytest.mark.parametrize("page", [*PAGES, *NOTEBOOKS], ids=lambda page: page.name)
def test_every_link_leads_somewhere(page):
    assert broken(page) == []


def test_a_broken_link_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# Two words\n\n[a](b.md) [c](#two-words) [d](#three) `[e](f)` [g](page.md#h)")
    assert broken(page) == ["b.md", "#three", "page.md#h"]


def test_every_page_can_be_reached_from_the_navigation():
    listed = set(re.findall(r"[\w./-]+\.(?:md|ipynb)\b", (CLONE / "mkdocs.yml").read_text()))
    there = {str(page.relative_to(CLONE / "docs")) for page in (CLONE / "docs").rglob("*.md")}
    assert listed == there | GENERATED | {f"tutorials/{one.stem}.md" for one in NOTEBOOKS}


def test_the_tutorial_and_the_readme_have_the_same_pair():
    cells = json.loads(NOTEBOOKS[[one.stem for one in NOTEBOOKS].index("own-pair")].read_text())
    written = "".join(cells["cells"][2]["source"]).removeprefix("%%writefile pair.toml\n")
    assert [own_pair().strip()] == [written]


def test_the_reference_of_the_site_has_all_that_the_program_has():
    made = {name: page() for name, page in SITE["PAGES"].items()}
    for kind in (GearPairConfiguration, LinearConfiguration, TrainConfiguration):
        assert key_tables(kind) in made["reference/keys.md"]
    for name in COMMANDS:
        assert f"\n## {name}\n" in made["reference/commands.md"]
        assert f"usage: gearchaos {name} " in made["reference/commands.md"]
    assert "  130  interrupted" in made["reference/commands.md"]
    for output in (output for part in CATALOGUE.parts for output in part.outputs):
        assert f"`{output.name.replace('@', 'STATE')}`" in made["reference/outputs.md"] or (
            "@" in output.name
        )
    codes = (
        "| `motion` | 0 `periodic`, 1 `quasi_periodic`, 2 `chaotic`, 3 `unresolved`, 4 `diverged`"
    )
    assert codes in made["reference/outputs.md"]
    for name in {*gearchaos.__all__} - {"iso1328"}:
        assert f".{name}\n" in made["reference/python.md"]


def test_links_to_files_that_are_no_pages_become_paths():
    page = SimpleNamespace(file=SimpleNamespace(src_uri="how-to/one.md"))
    config = SimpleNamespace(docs_dir=str(CLONE / "docs"))
    text = "[a](../model.md) [b](../../benchmarks/README.md#c) ![d](../../x.png)"
    text += " [e](../tutorials/f.ipynb#g)"
    shown = SITE["on_page_markdown"](text, page, config, None)
    assert (
        shown
        == "[a](../model.md) b (`benchmarks/README.md`) ![d](../../x.png) [e](../tutorials/f.md#g)"
    )


@pytest.mark.parametrize("name", NAMES)
def test_extras_are_quoted_for_every_shell(name):
    text = (CLONE / name).read_text(encoding="utf-8")
    assert re.findall(r"pip install [\w.-]*(?: -e)? ?\.?\w*\[", text) == []


@pytest.mark.parametrize("name", NAMES)
def test_the_commands_of_a_page_are_those_of_the_program(name):
    for language, text, _ in blocks(name):
        for command, *words in commands(text) if language in ("", "bash", "sh") else ():
            assert command in COMMANDS
            if "--help" in words:
                continue
            main = importlib.import_module(f"gearchaos.{command}").main
            options, _ = main.parser().read(words)  # Unknown options are refused.
            ready = [CLONE / word for word in words if word.startswith("sweeps/")]
            assert all(path.is_file() for path in ready)
            if ready and hasattr(options, "settings") and command != "identify":
                gearchaos.load_config(ready[0], options.settings)


@pytest.mark.parametrize("name", NAMES)
def test_the_toml_of_a_page_is_a_configuration(name):
    for language, text, _ in blocks(name):
        if language != "toml":
            continue
        tables = tomllib.loads(text)
        whole = {"sweep", "configuration"} & {*tables} and {"scene", "model"} & {*tables}
        if whole and "file =" not in text:
            gearchaos.Configuration.from_toml(text)


def run_command(command: str, words: list[str], folder: Path) -> None:
    """Run one command of a page in a folder; sweeps have few lanes."""
    if command in TOO_LONG:
        return
    own = [one for key, more in ALSO.items() if key in words for one in more]
    if command == "sweep":
        chosen = [*SHORT, *(own or ["sweep.count=5"])]
    else:
        chosen = SHORT if command == "response" and words[0].endswith(".toml") else ()
    words = [*words, *(word for key in chosen for word in ("--set", key))]
    if command == "sweep" and "--resume" not in words:
        words.append("--overwrite")
    ended = run_module(f"gearchaos.{command}", *words, cwd=folder)
    assert ended.code == 0, (command, words, ended.err)


def own_pair() -> str:
    """Return the configuration of the user's own pair in the README."""
    return next(text for language, text, _ in blocks("README.md") if language == "toml")


def saved_under(line: str) -> str | None:
    """Return the file name under which the line before a block says to save the block."""
    found = re.search(r"[Ss]ave (?:this|it) as `([\w.]+)`", line)
    return found[1] if found else None


@pytest.mark.slow
@pytest.mark.parametrize("name", RUN)
def test_the_commands_and_the_python_of_a_page_run(name, tmp_path, monkeypatch):
    (tmp_path / "sweeps").symlink_to(CLONE / "sweeps")
    monkeypatch.chdir(tmp_path)
    Path("pair.toml").write_text(own_pair(), encoding="utf-8")
    names: dict = {}
    text = (CLONE / name).read_text(encoding="utf-8")
    for language, block, before in blocks(name):
        if file := saved_under(before) or saved_under(text.partition(block)[0][-250:]):
            Path(file).write_text(block, encoding="utf-8")
        elif language == "python":
            exec(compile(block, name, "exec"), names)
        elif language in ("", "bash", "sh"):
            for command, *words in commands(block):
                run_command(command, words, tmp_path)
