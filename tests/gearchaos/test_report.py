"""The report of a result is complete, self-contained, and has the numbers of the other commands."""

import csv
import json
import re
from base64 import b64decode
from html.parser import HTMLParser
from io import StringIO
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import gearchaos
from gearchaos.basins import main as basins_main
from gearchaos.report import main
from gearchaos.reporting.glossary import GLOSSARY
from gearchaos.shares import main as shares_main
from gearchaos.stages import main as stages_main

from .commands import small_config
from .test_shares import known_motions

HOSTILE = '<img src="http://example.org/x" onerror="alert(1)"> & "quoted" $title'
PLAIN = ("pitch_error.phase_deg=0.0", "sweep.count=6")
LOAD = "second_sweep={parameter='load', values=[0.1, 0.2]}"
GRID = (
    "sweep={parameter='pitch_error', values=[1.0]}",
    "start={kind='grid', count=3, box={delta_5=[0, 2], delta_5_rate=[-1, 1]}}",
)
KINDS = {
    "sweep": (*PLAIN, f"title='{HOSTILE}'"),
    "carried": (*PLAIN, "start.carry='both'", "outputs.loads=true"),
    "map": (*PLAIN, LOAD),
    "basins": (PLAIN[0], *GRID),
}


class Reader(HTMLParser):
    """Parse a page: attributes of all tags, rows of tables, captions, headings and other texts."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict]] = []
        self.rows: list[list[str]] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_data(self, data):
        self.text += data
        if self.tags and self.tags[-1][0] in ("td", "th") and data.strip():
            self.rows[-1][-1] += data

    @property
    def pictures(self) -> list[ElementTree.Element]:
        """All pictures as parsed XML."""
        sources = [one["src"] for tag, one in self.tags if tag == "img"]
        begin = "data:image/svg+xml;base64,"
        assert all(one.startswith(begin) for one in sources)
        return [ElementTree.fromstring(b64decode(one.removeprefix(begin))) for one in sources]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Compute a small result of each kind."""
    folder = tmp_path_factory.mktemp("report")
    file = small_config(folder)
    for kind, changes in KINDS.items():
        gearchaos.run(gearchaos.load_config(file, changes)).save(folder / f"{kind}.h5")
    config = gearchaos.load_config(file, (PLAIN[0], "sweep.count=2"))
    gearchaos.respond(config, periods=4).save(folder / "response.h5")
    known_motions(second=2).save(folder / "shares.h5")
    return folder


def report(path: Path, capsys, *arguments: str) -> Reader:
    output = path.with_suffix(".html")
    assert main([str(path), "-o", str(output), "--overwrite", *arguments]) == 0
    assert capsys.readouterr().out.splitlines() == [str(output)]
    return Reader(output.read_text(encoding="utf-8"))


def printed(command, capsys, *arguments: object) -> str:
    assert command([*map(str, arguments)]) == 0
    return capsys.readouterr().out


def shown(text: str) -> str:
    """Return a cell of CSV as a report shows it."""
    try:
        return f"{float(text):.6g}"
    except ValueError:
        return text


@pytest.mark.parametrize("kind", [*KINDS, "response", "shares"])
def test_a_page_loads_nothing_and_has_figures_configuration_and_versions(kind, folder, capsys):
    page = report(folder / f"{kind}.h5", capsys)
    # The carried sweep also has a picture of the load factor and one of each force.
    assert len(page.pictures) == {"response": 2, "shares": 2, "carried": 4}.get(kind, 1)
    for tag, given in page.tags:
        assert tag not in ("script", "link", "iframe", "object", "base"), tag
        assert not {name for name in given if name.startswith("on")}
        for value in (given.get("href"), given.get("src")):
            assert value is None or value.startswith(("#", "data:"))
    for picture in page.pictures:
        for part in picture.iter():
            assert not part.tag.endswith(("script", "foreignObject"))
            for name, value in part.attrib.items():
                assert not name.endswith("href") or value.startswith(("#", "data:"))
    metadata = gearchaos.open_result(folder / f"{kind}.h5").metadata
    cells = [tuple(row[:2]) for row in page.rows]
    if kind != "shares":
        assert ("software", metadata["software"]) in cells
        assert ("integration.steps_per_period", "40") in cells
        assert ["pitch_error.phase_deg", "0.0", "set for this run"] in page.rows
    anchors = {f"#{given['id']}" for _, given in page.tags if "id" in given}
    assert anchors == {given["href"] for tag, given in page.tags if tag == "a"}


def test_the_title_is_a_text_and_no_markup(folder, capsys):
    page = report(folder / "sweep.h5", capsys)
    assert HOSTILE in page.text
    assert "onerror" not in {name for _, given in page.tags for name in given}


def test_stages_are_those_of_the_command(folder, capsys):
    page = report(folder / "sweep.h5", capsys)
    text = printed(stages_main, capsys, folder / "sweep.h5", "--csv")
    head, *rows = csv.reader(StringIO(text))
    assert [one.removesuffix(" [1]") for one in head] in page.rows
    assert rows
    assert all([*map(shown, row)] in page.rows for row in rows)


def test_each_value_of_a_second_parameter_has_its_shares(folder, capsys):
    page = report(folder / "shares.h5", capsys)
    for load in (1, 2):
        text = printed(shares_main, capsys, folder / "shares.h5", "--csv", "--at", f"load={load}")
        _, *rows = csv.reader(StringIO(text))
        assert rows
        assert all([*map(shown, row)] in page.rows for row in rows)
    one = report(folder / "shares.h5", capsys, "--at", "load=2")
    assert len(one.pictures) == 1
    assert "load = 2" in one.text and "load = 1" not in one.text


def test_basins_are_those_of_the_command(folder, capsys):
    page = report(folder / "basins.h5", capsys)
    found = json.loads(printed(basins_main, capsys, folder / "basins.h5", "--json"))
    shares = {shown(str(one["share"])) for one in found["basins"]}
    at = next(row.index("share") for row in page.rows if "multiplier" in row)
    assert shares == {row[at] for row in page.rows if len(row) == 10 and row[0] == "1"}


def test_errors_have_the_unit_of_the_report(tmp_path, capsys):
    chaotic = ("sweep={parameter='pitch_error', values=[14.0]}", "integration.error_check=1.0")
    file = Path(__file__).parents[2] / "sweeps" / "pan2021.toml"
    short = ("mesh.length_scale_um=25.0", "outputs.section_points=100")
    result = gearchaos.run(gearchaos.load_config(file, (*chaotic, *short)))
    result.save(tmp_path / "one.h5")
    assert result["motion"].tolist() == [2]
    page = report(tmp_path / "one.h5", capsys, "--units", "physical")
    assert "was not measured in this run" not in page.text
    (row,) = [row for row in page.rows if row[:2] == ["exponent error", "from the step"]]
    rate = float(result.parameters["scaling_frequency"].values)
    assert row[2] == "s^-1"
    assert float(row[-1]) == pytest.approx(rate * result["exponent_step_error"][0], rel=1e-4)
    (row,) = [row for row in page.rows if row[0] == "axis pitch_error"]
    assert row[1].endswith("1 value, 14")


def test_a_carried_sweep_has_stages_of_both_directions(folder, capsys):
    captions = report(folder / "carried.h5", capsys).text
    assert "Stages over pitch_error, upwards" in captions
    assert "Stages over pitch_error, downwards" in captions


def test_loads_are_drawn_and_the_largest_of_each_is_listed(folder, capsys):
    result = gearchaos.open_result(folder / "carried.h5")
    page = report(folder / "carried.h5", capsys)
    loads = [
        name
        for name in result.variables
        if name.startswith(("load_factor_largest", "mesh_force_largest"))
    ]
    assert len(loads) == 3
    for name in loads:
        values, wording = result[name], result.variables[name].long_name
        place = result["pitch_error"][np.unravel_index(np.argmax(values), values.shape)[0]]
        (row,) = [one for one in page.rows if one and one[0] == wording]
        assert [float(one) for one in row[2:]] == pytest.approx([values.max(), place], rel=1e-5)
        assert wording[1:] in page.text


def test_the_glossary_has_the_words_of_the_page(folder, capsys):
    page = report(folder / "basins.h5", capsys)
    section = page.text[page.text.rindex("Glossary") :]
    assert GLOSSARY["basin"] in section and GLOSSARY["Floquet multiplier"] not in section
    assert all(one.endswith((".", "?")) for one in GLOSSARY.values())


def test_letters_of_figures_are_outlines(folder, capsys):
    for picture in report(folder / "sweep.h5", capsys).pictures:
        assert not [part for part in picture.iter() if part.tag.endswith("}text")]


def test_an_existing_file_and_the_result_are_kept(folder, tmp_path, capsys):
    result, page = folder / "sweep.h5", tmp_path / "page.html"
    page.write_text("mine")
    assert main([str(result), "-o", str(page)]) == 4
    assert "--overwrite" in capsys.readouterr().err
    assert page.read_text() == "mine"
    before = result.read_bytes()
    assert main([str(result), "-o", str(result), "--overwrite"]) == 4
    assert "is the input itself" in capsys.readouterr().err
    assert result.read_bytes() == before
    assert main([str(result), "-o", str(tmp_path / "no" / "page.html")]) == 4
    assert "create the folder first" in capsys.readouterr().err


@pytest.mark.parametrize("content", [None, b"", b"load = 1\n"])
def test_a_file_that_is_no_result_is_named(content, tmp_path, capsys):
    path = tmp_path / "none.h5"
    if content is not None:
        path.write_bytes(content)
    assert main([str(path), "-o", str(tmp_path / "page.html")]) == 4
    out, err = capsys.readouterr()
    assert out == "" and re.match(f"gearchaos report: error: {path}: ", err)
    assert not (tmp_path / "page.html").exists()
