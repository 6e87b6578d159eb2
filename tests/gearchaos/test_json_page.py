"""The page on JSON lists the keys that the commands print."""

import inspect
import json
import re
from pathlib import Path

import pytest

from gearchaos.controlling.trial import facts_of
from gearchaos.engine.recomputing import Survival
from gearchaos.engine.refinement import Boundary
from gearchaos.results.reading.contact_stretches import ContactStretch
from gearchaos.results.reading.jumps import Apart, Crisis, Jump

from .commands import run_module, small_config

PAGE = (Path(__file__).parents[2] / "docs" / "json.md").read_text(encoding="utf-8")
OPTIONAL = {"directions_apart", "boundaries", "contact", "zero_one"}
OPTIONAL |= {"free_eigenfrequencies", "free_eigenfrequencies_Hz"}
"""Keys of options and models that the sweep below does not use."""


def listed(heading: str) -> set[str]:
    """Return the keys that the page lists for a command, as paths."""
    _, _, text = PAGE.partition(f"\n## {heading}\n")
    rows = re.findall(r"^\| (`.*?) \|", text.partition("\n## ")[0], re.MULTILINE)
    return {key for row in rows for key in re.findall(r"`([\w.\[\]]+)`", row)}


def printed(facts: dict, listed_keys: set[str]) -> set[str]:
    """Return the keys of an object as paths, with keys of list entries if the page lists them."""
    found = set()
    for key, value in facts.items():
        below = {one for one in listed_keys if re.match(rf"{key}(\[\])?\.[a-z]", one)}
        if below and isinstance(value, list) and value:
            found |= {f"{key}[].{name}" for name in value[0]}
        elif below:
            found |= below
        else:
            found.add(key)
    return found


def plain(keys: set[str]) -> set[str]:
    """Return keys without their placeholders for names, values or entries."""
    return {re.sub(r"(?<!\])\.[A-Z]+.*$|\[\]$|(?<=\w)\.NAME$", "", key) for key in keys}


@pytest.fixture(scope="module")
def answers(tmp_path_factory):
    """Return every kind of JSON output of a small sweep from three starts, by heading."""
    folder = tmp_path_factory.mktemp("json")
    config = str(small_config(folder))
    keys = ("start.kind=random", "start.count=3", "sweep.count=3")
    words = [word for key in keys for word in ("--set", key)]
    calls = {
        "sweep": ("sweep", config, *words),
        "sweep --dry-run": ("sweep", config, *words, "--dry-run"),
        **{name: (name, f"{Path(config).stem}.h5") for name in ("stages", "shares", "basins")},
        "info": ("info", f"{Path(config).stem}.h5"),
    }
    found = {}
    for heading, (name, *more) in calls.items():
        ended = run_module(f"gearchaos.{name}", *more, "--json", cwd=folder)
        assert ended.code == 0, ended.err
        found[heading] = json.loads(ended.out)
    return found


@pytest.mark.parametrize(
    "heading", ["sweep", "sweep --dry-run", "stages", "shares", "basins", "info"]
)
def test_the_page_lists_the_keys_that_are_printed(answers, heading):
    known = listed(heading)
    needed = {one for one in plain(known) if re.split(r"\W", one)[0] not in OPTIONAL}
    assert plain(printed(answers[heading], known)) == needed


@pytest.mark.parametrize(
    ("key", "kind"),
    [
        ("jumps[]", Jump),
        ("crises[]", Crisis),
        ("contact[]", ContactStretch),
        ("survival", Survival),
        ("directions_apart[]", Apart),
        ("boundaries[]", Boundary),
    ],
)
def test_the_page_lists_the_parts_of_entries_of_stages(key, kind):
    parts = {one.removeprefix(f"{key}.") for one in listed("stages") if one.startswith(f"{key}.")}
    assert parts == set(kind._fields)


def test_the_page_lists_the_keys_of_a_trial_of_control():
    named = set(re.findall(r'^        "(\w+)":', inspect.getsource(facts_of), re.MULTILINE))
    assert plain(listed("control")) == named
