"""The page of a sweep from a grid of starts shows basins over two states and motions of starts."""

import shlex
import shutil
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_hex

import gearchaos
from gearchaos.engine.basins import find_basins
from gearchaos.explore import main
from gearchaos.figures.ensembles import COLORS
from gearchaos.figures.style import VERMILION
from gearchaos.results.reading.result import Result

from .commands import PAGE_HANGS, served, small_config

missing = [name for name in ("panel", "datashader", "playwright") if find_spec(name) is None]
pytestmark = pytest.mark.skipif(bool(missing), reason=f"without {', '.join(missing)}")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
OPTIONS = "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking"
SIDE = 6
DISPLACEMENT, RATE = "delta_5=[-3, 3]", "delta_5_rate=[-3, 3]"
KINDS = {
    "plane": (f"start={{kind='grid', count={SIDE}, box={{{DISPLACEMENT}, {RATE}}}}}",),
    "space": (f"start={{kind='grid', count=3, box={{{DISPLACEMENT}, {RATE}, delta_3=[-1, 1]}}}}",),
    "line": (f"start={{kind='grid', count=20, box={{{DISPLACEMENT}}}}}", "sweep.count=1"),
    "random": ("start={kind='random', count=65}",),
}
PICTURE = """() => {
    const [first] = [...Bokeh.documents[0]._all_models.values()]
        .filter(one => one.type == "Figure")
    const data = first.renderers.map(one => one.data_source)
        .find(one => one.columns().includes("image"))
    const image = data.get_column("image")[0], [height, width] = image.shape
    const cell = (x, y) => image[Math.floor((y + 0.5) * height / 6) * width
        + Math.floor((x + 0.5) * width / 6)]
    const six = [...Array(6).keys()]
    const circles = first.center.filter(one => one.type == "GlyphRenderer")
        .map(one => [one.data_source.get_column("x")[0], one.data_source.get_column("y")[0]])
    return {cells: six.map(x => six.map(y => cell(x, y))), circles,
        lines: first.center.filter(one => one.type == "Span").map(one => one.location)}
}"""
"""Script that returns the attractor in the middle of every cell of the picture, the sections, and
the lines at the lane."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("basins")
    few = ("pitch_error.phase_deg=0.0", "sweep.count=2", "outputs.section_points=1")
    for kind, changes in KINDS.items():
        config = gearchaos.load_config(small_config(folder), (*few, *changes))
        gearchaos.run(config).save(folder / f"{kind}.h5")
    return folder


@pytest.fixture(scope="module")
def plane(folder) -> gearchaos.Result:
    return gearchaos.open_result(folder / "plane.h5")


def grid_of(folder: Path, kind: str):
    from gearchaos.explorer.starts import start_grid

    path = folder / f"{kind}.h5"
    return start_grid(gearchaos.open_result(path), str(path))


@pytest.mark.parametrize("kind", ["plane", "space", "line"])
def test_every_place_of_the_grid_is_the_start_of_the_file_with_these_states(kind, folder):
    grid = grid_of(folder, kind)
    whole, result = grid.whole, grid.result
    states = [axis.removeprefix("start_") for axis in grid.axes]
    columns = [whole.variables["state"].flags.index(state) for state in states]
    assert result.axes == ("pitch_error", *grid.axes[::-1])
    for at in np.ndindex(*(result[axis].size for axis in result.axes)):
        place = {axis: float(result[axis][n]) for axis, n in zip(result.axes, at, strict=True)}
        lane = whole.sel(**grid.start(place))
        np.testing.assert_allclose(
            lane["start_state"][columns], [place[axis] for axis in grid.axes], atol=1e-14
        )
        assert (result["end_state"][at] == lane["end_state"]).all()


def test_axes_of_the_grid_have_physical_units(folder):
    grid = grid_of(folder, "plane")
    part = grid.result.sel(pitch_error=0.0)
    shown, scale = part.physical(), 25.0
    assert shown.attributes("start_delta_5")["units"] == "um"
    np.testing.assert_allclose(shown["start_delta_5"], scale * part["start_delta_5"])
    found = grid.basins({"pitch_error": 0.0}, "physical")
    np.testing.assert_allclose(found.grid["delta_5"], shown["start_delta_5"])


def test_of_further_states_one_value_is_drawn(folder):
    grid = grid_of(folder, "space")
    whole = find_basins(grid.whole.sel(pitch_error=0.0)).numbers.reshape(3, 3, 3)
    for number, value in enumerate(grid.result["start_delta_3"].tolist()):
        found = grid.basins({"pitch_error": 0.0, "start_delta_3": value}, "dimensionless")
        assert list(found.grid) == ["delta_5", "delta_5_rate"]
        assert (found.numbers.reshape(3, 3) == whole[:, :, number]).all()


def test_over_one_state_the_attractors_are_boxes_behind_the_diagram(folder):
    from gearchaos.explorer.shades import basin_boxes

    found = grid_of(folder, "line").basins({"pitch_error": 0.0}, "dimensionless")
    # Let the middle starts lead to another attractor of the same kind.
    numbers, (first, *others) = found.numbers.copy(), found.basins
    numbers[0, 8:12] = 7
    found = found._replace(numbers=numbers, basins=[first, first._replace(number=7), *others])
    boxes, kinds = basin_boxes(found)
    starts = found.grid["delta_5"]
    at_starts = [
        next(box.fill_color for box in boxes if box.left < start < box.right) for start in starts
    ]
    assert at_starts[8:12] == 4 * [to_hex(COLORS[0])]
    assert {*at_starts} <= {*kinds.values()}
    assert boxes[0].left < starts[0] and boxes[-1].right > starts[-1]


# In some versions of panel that the extra allows, only the name of a switch sets its title.
@pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")
def test_many_starts_are_chosen_by_a_number_and_few_values_from_a_menu(folder):
    import panel

    from gearchaos.explorer.page import MOST_ENTRIES, ExplorerPage

    for kind in KINDS:
        path = folder / f"{kind}.h5"
        page = ExplorerPage(gearchaos.open_result(path), str(path), lambda _: None)
        menus = {
            name: one
            for name, one in page._switches.items()
            if isinstance(one, panel.widgets.Select)
        }
        assert all(len(one.options) <= MOST_ENTRIES for one in menus.values())
        assert ("start" in page._switches) == (kind == "random")
        assert ("attractor" in menus["variable"].values) == (kind in ("plane", "space"))
        assert ("pitch_error" in menus) == (kind != "random")


def test_a_saved_page_has_the_basins_first(folder, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    assert main(["plane.h5", "--save", "both.html"]) == 0
    assert "one value of each parameter, such as with --at pitch_error=0" in capsys.readouterr().err
    assert main(["plane.h5", "--save", "one.html", "--at", "pitch_error=5"]) == 0
    both, one = (Path(name).read_text() for name in ("both.html", "one.html"))
    assert '["attractor","Attractor"]' in one.replace(", ", ",")
    assert "1: period 1, 100 %" in one and "1: period 1" not in both
    for kind in ("space", "line", "random"):
        assert main([f"{kind}.h5", "--save", f"{kind}.html"]) == 0


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    if CHROMIUM is None:
        pytest.skip("there is no chromium here")
    with sync_playwright() as driver:
        yield driver.chromium.launch(executable_path=CHROMIUM, args=OPTIONS.split())


@contextmanager
def opened(browser, folder: Path, file: str, link: str):
    """Serve a file as a user does, and open a link to its page."""
    with served(folder, file) as address:
        page = browser.new_page(viewport={"width": 1200, "height": 900})
        page.set_default_timeout(1000.0 * PAGE_HANGS)
        page.goto(address + link)
        page.locator(".bk-Figure >> nth=4").wait_for()
        page.locator("pre:has-text('mesh_force')").wait_for()
        yield page
        page.close()


@pytest.fixture(scope="module")
def page(folder, browser):
    with opened(browser, folder, "plane.h5", "?units=dimensionless") as page:
        yield page


def click(page, start: int) -> None:
    """Click into the basins, and wait for the commands of the start at this place."""
    box = page.locator(".bk-Figure").first.bounding_box()
    place = box["x"] + 0.4 * box["width"], box["y"] + 0.3 * box["height"]
    page.mouse.move(*place)
    page.mouse.click(*place)
    page.locator(f"pre:has-text('--at=start={start}')").wait_for()


def test_a_click_on_a_start_shows_its_motion_and_names_its_lane(page, plane, folder, monkeypatch):
    numbers = find_basins(plane.sel(pitch_error=0.0)).numbers.reshape(SIDE, SIDE)
    shown = page.evaluate(PICTURE)
    # Basins without an attractor have negative numbers, and therefore the first colours.
    assert (np.array(shown["cells"]) == np.searchsorted(np.unique(numbers), numbers)).all()
    section = find_basins(plane.sel(pitch_error=0.0)).basins[0].section[0]
    states = plane.variables["state"].flags
    columns = [states.index(state) for state in ("delta_5", "delta_5_rate")]
    np.testing.assert_allclose(shown["circles"][0], section[columns])
    legend = page.locator(".bk-panel-models-markup-HTML div").all_inner_texts()
    assert any("1: period 1" in text and "unresolved" in text for text in legend)

    start = 1 * SIDE + 4
    click(page, start)
    x, y = plane["start_state"][0, start, columns]
    np.testing.assert_allclose(sorted(page.evaluate(PICTURE)["lines"][:2]), sorted([x, y]))
    page.locator("pre:has-text('mesh_force')").wait_for()
    basins, response, _, figure = page.locator("pre").inner_text().splitlines()
    assert "gearchaos.basins plane.h5 --at=pitch_error=0 --output plane_basins.png" in basins
    with page.expect_download() as download:
        page.get_by_text("Sweep as PNG").click()
    saved = Path(download.value.path()).read_bytes()
    monkeypatch.chdir(folder)
    for line in (basins, response, figure):
        module, *arguments = shlex.split(line.removeprefix("python -m "))
        assert import_module(module).main(arguments) == 0
    assert saved == Path("plane_basins.png").read_bytes()


def test_other_values_and_variables_are_drawn(page):
    fault = f"b[style*='{VERMILION}']"
    variable, parameter = page.locator("select").nth(0), page.locator("select").nth(1)
    parameter.select_option(label="5")
    page.locator("pre:has-text('--at=pitch_error=5 --output')").wait_for()
    variable.select_option(label="Kind of motion")
    page.locator("pre:not(:has-text('--output'))").wait_for()
    assert page.locator(fault).all_inner_texts() == []
    page.get_by_text("Sweep as PNG").click()
    page.get_by_text("only the attractors over two states").wait_for()


def test_a_link_to_units_that_a_pair_lacks_is_refused_and_clicks_work(browser, plane, folder):
    known = {name: one for name, one in plane.parameters.items() if name != "length_scale"}
    variables = list(plane.variables.values())
    pure = Result(plane.axes, variables, {n: plane[n] for n in plane}, known, plane.metadata)
    pure.save(folder / "pure.h5")
    with opened(browser, folder, "pure.h5", "?units=physical") as page:
        page.get_by_text("does not give the length_scale").wait_for()
        page.wait_for_url("**units=dimensionless*")
        # Below the message, the page works as without it.
        click(page, 1 * SIDE + 4)
