"""Branches and boundaries in the explorer: how they are drawn and hidden, and refused input."""

import json
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import gearchaos
from gearchaos.records.boundary import CUSP, Boundary, BoundaryPoint
from gearchaos.records.branch import (
    EDGE,
    FOLD,
    MEANINGS,
    SPECIAL_KINDS,
    PeriodicBranch,
    SpecialPoint,
)
from gearchaos.results.files.boundary_file import BoundarySet, write_boundaries
from gearchaos.results.files.branch_file import BranchSet, write_branches

from .commands import PAGE_HANGS, run_module, served, small_config, until
from .test_explore import ASKED, CHROMIUM, OPTIONS, needs_browser

pytestmark = pytest.mark.skipif(find_spec("bokeh") is None, reason="without bokeh")
needs_page = pytest.mark.skipif(find_spec("panel") is None, reason="without panel")
LOAD = "second_sweep={parameter='load', values=[0.1, 0.2]}"
TURN, TOP = 4.0, 9.0
"""Value and section of the fold of the parabola P = TURN - (y - TOP)^2."""

SHOWN = """() => [...Bokeh.documents[0]._all_models.values()]
    .filter(one => one.type == "GlyphRenderer" && one.glyph.type == "KIND")
    .filter(one => one.data_source.columns().includes("COLUMN"))
    .map(one => [one.visible, one.glyph.line_dash?.value ?? [], Object.fromEntries(
        one.data_source.columns().map(name =>
            [name, Array.from(one.data_source.get_column(name), at => at)]))])"""


def parabola() -> PeriodicBranch:
    """Return a branch that is stable up to its fold in the middle, and unstable beyond it."""
    y = TOP + np.linspace(-1.0, 1.0, 41)
    section = np.stack([y, 0.0 * y], axis=-1)[:, np.newaxis]
    multipliers = np.stack([1.0 + 0.3 * (y - TOP), 0.0 * y], axis=-1).astype(complex)
    fold = SpecialPoint(FOLD, TURN, 1.0, section[20], multipliers[20], "<b>flank</b>")
    return PeriodicBranch(
        1,
        TURN - (y - TOP) ** 2,
        np.linspace(0.0, 2.0, 41),
        section,
        multipliers,
        0.0 * y,
        (fold,),
        (EDGE, EDGE),
        {},
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """Compute a sweep and a map; write branches and boundaries of known shape."""
    folder = tmp_path_factory.mktemp("overlaid")
    for name, more in {"sweep": (), "map": (LOAD, "start.carry='none'")}.items():
        result = gearchaos.run(gearchaos.load_config(small_config(folder), (*ASKED, *more)))
        result.save(folder / f"{name}.h5")
    section = result.variables["section_delta_5"]
    states = (section, replace(section, name="section_delta_5_rate"))
    swept = [result.variables[name] for name in ("pitch_error", "load")]
    write_branches(folder / "branches.h5", BranchSet(swept[0], states, (parabola(),), {}))
    branch = parabola()
    values = np.stack([branch.value, np.linspace(0.1, 0.2, 41)], axis=-1)
    cusp = BoundaryPoint(CUSP, values[20], 1.0, branch.multipliers[20])
    of = (values, branch.arclength, branch.section, branch.multipliers, (cusp,), (EDGE, EDGE))
    found = BoundarySet(tuple(swept), states, (Boundary(FOLD, 1, "", *of),), {})
    write_boundaries(folder / "boundaries.h5", found)
    speeds = (*ASKED, LOAD.replace("load", "mesh_frequency"), "start.carry='none'")
    result = gearchaos.run(gearchaos.load_config(small_config(folder), speeds))
    result.save(folder / "speeds.h5")
    over = tuple(result.variables[name] for name in ("pitch_error", "mesh_frequency"))
    write_boundaries(folder / "over_speed.h5", found._replace(parameters=over))
    return folder


def test_boundaries_are_drawn_in_physical_units_where_the_axes_keep_theirs(folder):
    words = ("--boundaries", "boundaries.h5", "--units", "physical", "-o", "physical.png")
    done = run_module("gearchaos.plot", "map.h5", *words, cwd=folder)
    assert (done.code, (folder / "physical.png").stat().st_size > 10_000) == (0, True)
    words = ("--boundaries", "over_speed.h5", "--units", "physical", "-o", "refused.png")
    done = run_module("gearchaos.plot", "speeds.h5", *words, cwd=folder)
    assert done.code and not (folder / "refused.png").exists()
    assert "the curves are over mesh_frequency as configured" in done.err


def glyphs(page, kind: str, column: str = "y") -> list:
    """Return visibility, dashes and data of the glyphs of a kind that have a column."""
    return page.evaluate(SHOWN.replace("KIND", kind).replace("COLUMN", column))


def dashed_and_solid(page) -> list:
    """Return the lines of the parabola: the unstable one, then the stable one."""
    found = [one for one in glyphs(page, "Line") if max(map(float, _there(one[2]["y"]))) > 7.0]
    return sorted(found, key=lambda one: not one[1])


def _there(values: list) -> list:
    return [one for one in values if isinstance(one, float | int) and np.isfinite(one)]


def assert_parabola(page, digits: float) -> None:
    """Check that a page draws the stable half solid, the unstable half dashed, and the fold."""
    (_, dashes, unstable), (_, solid, stable) = dashed_and_solid(page)
    assert dashes and not solid
    expected = parabola()
    np.testing.assert_allclose(_there(stable["x"]), expected.value[:21], rtol=digits)
    np.testing.assert_allclose(_there(stable["y"]), expected.section[:21, 0, 0], rtol=digits)
    np.testing.assert_allclose(_there(unstable["x"]), expected.value[20:], rtol=digits)
    ((_, _, fold),) = glyphs(page, "Scatter", "text")
    assert (fold["x"], fold["y"]) == ([TURN], [TOP])
    assert fold["text"] == [f"fold of period 1 at pitch_error = 4: {MEANINGS[FOLD]} (<b>flank</b>)"]


@needs_browser
def test_a_saved_page_draws_branches_and_its_switch_hides_them(folder):
    from playwright.sync_api import sync_playwright

    words = ["sweep.h5", "--branches", "branches.h5", "--save", "sweep.html"]
    done = run_module("gearchaos.explore", *words, cwd=folder, imported=("bokeh",))
    assert (done.code, done.out) == (0, "sweep.html\n"), done.err
    wrong: list[str] = []
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=OPTIONS.split())
        page = browser.new_page()
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.goto((folder / "sweep.html").as_uri())
        page.get_by_text("unstable orbits").wait_for()
        assert_parabola(page, 1e-7)
        ends = page.evaluate(
            """() => [...Bokeh.documents[0]._all_models.values()]
            .filter(one => one.type == "Figure").map(one => one.y_range.end)"""
        )
        assert ends[0] > TOP
        page.locator("input[type=checkbox]").uncheck()
        page.get_by_text("unstable orbits").wait_for(state="hidden")
        assert not any(
            one[0] for one in (*dashed_and_solid(page), *glyphs(page, "Scatter", "text"))
        )
        page.locator("input[type=checkbox]").check()
        page.get_by_text("unstable orbits").wait_for()
        assert all(one[0] for one in dashed_and_solid(page))
        # The page reports a variable that the orbits do not have.
        page.locator("select").select_option(index=1)
        page.locator("text=of the branches >> visible=true").wait_for()
        browser.close()
    assert wrong == []


@needs_browser
def test_a_saved_map_draws_boundaries(folder):
    from playwright.sync_api import sync_playwright

    words = ["map.h5", "--boundaries", "boundaries.h5", "--save", "map.html"]
    done = run_module("gearchaos.explore", *words, cwd=folder, imported=("bokeh",))
    assert done.code == 0, done.err
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=OPTIONS.split())
        page = browser.new_page()
        page.goto((folder / "map.html").as_uri())
        page.get_by_text("cusp").first.wait_for()
        lines, marks = glyphs(page, "Line"), glyphs(page, "Scatter", "text")
        browser.close()
    found = {json.dumps([_there(one[2]["x"]), _there(one[2]["y"])]) for one in lines}
    # The maps of all variables have the same curve.
    ((x, y),) = map(json.loads, found)
    np.testing.assert_allclose(sorted(x), sorted(parabola().value), rtol=1e-6)
    np.testing.assert_allclose(y, np.linspace(0.1, 0.2, 41), rtol=1e-6)
    assert {tuple(one[2]["text"]) for one in marks} == {
        ("cusp of period 1 at pitch_error = 4, load = 0.15: two folds meet and end",)
    }


@needs_page
@needs_browser
def test_the_page_draws_branches_and_a_link_remembers_the_switch(folder):
    from playwright.sync_api import sync_playwright

    words, wrong = ["sweep.h5", "--branches", "branches.h5"], []
    with served(folder, *words) as address, sync_playwright() as driver:
        page = driver.chromium.launch(executable_path=CHROMIUM, args=OPTIONS.split()).new_page()
        page.set_default_timeout(1000.0 * PAGE_HANGS)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.goto(address)
        page.get_by_text("unstable orbits").wait_for()
        assert_parabola(page, 1e-15)
        plot = "--variable section_delta_5 --branches branches.h5"
        page.locator(f"pre:has-text('{plot}')").wait_for()
        page.locator("input[type=checkbox]").uncheck()
        page.wait_for_url("**/?*branches=false*")
        page.get_by_text("unstable orbits").wait_for(state="detached")
        # The legend may disappear before the lines.
        until(page, lambda: not any(one[0] for one in dashed_and_solid(page)))
        assert "--branches" not in page.locator("pre").inner_text()
        link = page.url
        page.goto("about:blank")
        page.goto(link)
        page.locator("pre:has-text('section_delta_5')").wait_for()
        assert not page.locator("input[type=checkbox]").is_checked()
        assert not any(one[0] for one in dashed_and_solid(page))
        page.locator("select").first.select_option(index=1)
        page.locator("input[type=checkbox]").check()
        page.locator("select").filter(has_text="physical").select_option("physical")
        page.get_by_text("branches are drawn in dimensionless units only").wait_for()
    assert wrong == []


@pytest.mark.parametrize(
    "words",
    [
        ("map.h5", "--branches", "branches.h5"),
        ("sweep.h5", "--boundaries", "boundaries.h5"),
        ("sweep.h5", "--branches", "sweep.h5"),
        ("sweep.h5", "--branches", "missing.h5"),
        ("map.h5", "--boundaries", "branches.h5"),
        ("sweep.h5", "--branches", "branches.h5", "--units", "physical"),
        ("speeds.h5", "--boundaries", "over_speed.h5", "--units", "physical"),
        ("other.h5", "--branches", "branches.h5"),
    ],
)
def test_what_does_not_belong_together_is_refused_as_plot_does(folder, words):
    if words[0] == "other.h5" and not (folder / "other.h5").exists():
        asked = (*ASKED, "sweep={parameter='load', from=0.1, to=0.2, count=3}")
        gearchaos.run(gearchaos.load_config(small_config(folder), asked)).save(folder / "other.h5")
    said = []
    for command, more in (("explore", ("--save", "no.html")), ("plot", ("-o", "no.png"))):
        done = run_module(f"gearchaos.{command}", *words, *more, cwd=folder, imported=("bokeh",))
        assert done.code
        said.append(done.err.splitlines()[-1].removeprefix(f"gearchaos {command}: "))
    assert said[0] == said[1]
    assert not [*folder.glob("no.*")]


def test_the_page_does_not_replace_the_branches(folder):
    words = ["sweep.h5", "--branches", "branches.h5", "--save", "branches.h5", "--overwrite"]
    done = run_module("gearchaos.explore", *words, cwd=folder, imported=("bokeh",))
    assert done.code == 4 and "is the input itself" in done.err


def test_thinned_lines_keep_their_ends_and_are_parted_by_gaps():
    from gearchaos.explorer.overlay import _joined
    from gearchaos.figures.overlay import OverlaidLine

    x = np.arange(11.0)
    lines = [OverlaidLine("a", x, np.stack([x, 10.0 * x], axis=1), {})]
    found = _joined([*lines, OverlaidLine("a", x[:2], x[:2, np.newaxis], {})], 4)
    gap = [np.nan]
    np.testing.assert_array_equal(found[0], [0, 4, 8, 10, *gap, 0, 4, 8, 10, *gap, 0, 1, *gap])
    np.testing.assert_array_equal(found[1], [0, 4, 8, 10, *gap, 0, 40, 80, 100, *gap, 0, 1, *gap])


def test_every_kind_has_a_meaning_a_marker_and_a_sign():
    from gearchaos.explorer.overlay import BOKEH_MARKERS, SIGNS
    from gearchaos.figures import boundaries, branches
    from gearchaos.records.boundary import POINT_KINDS, POINT_MEANINGS

    assert {*MEANINGS} == {*SPECIAL_KINDS} and {*POINT_MEANINGS} == {*POINT_KINDS}
    looks = [*branches.MARKERS.values(), *boundaries.MARKERS.values()]
    assert {BOKEH_MARKERS[one["marker"]] for one in looks} <= {*SIGNS}
