"""The interactive page that explore saves loads nothing, is small, and its menu works."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import gearchaos
from gearchaos.explore import main
from gearchaos.outputs.variable import coordinate
from gearchaos.results.reading.result import Result

from .commands import run_module, small_config
from .listed_variables import sweep_variables
from .test_explore import CHROMIUM, HOSTILE, OPTIONS, needs_browser

pytestmark = pytest.mark.skipif(find_spec("bokeh") is None, reason="bokeh is not installed")
LOAD = "second_sweep={parameter='load', values=[0.1, 0.2]}"
WIDE = 4000


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("saved")
    asked = ("pitch_error.phase_deg=0.0", "sweep.count=6", f"title='{HOSTILE}'")
    for name, more in {"sweep": (), "map": (LOAD,), "carried": ("start.carry='both'",)}.items():
        config = gearchaos.load_config(small_config(folder), (*asked, *more))
        gearchaos.run(config).save(folder / f"{name}.h5")
    return folder


@needs_browser
@pytest.mark.parametrize("kind", ["sweep", "map", "carried"])
def test_the_page_loads_nothing_and_every_entry_shows_one_chart(kind, folder):
    from playwright.sync_api import sync_playwright

    page = folder / f"{kind}.html"
    # The process does not import Panel, because Panel adds its own models to every page.
    words = [f"{kind}.h5", "--save", page.name]
    done = run_module("gearchaos.explore", *words, cwd=folder, imported=("bokeh",))
    assert (done.code, done.out) == (0, f"{page.name}\n")
    asked: list[str] = []
    wrong: list[str] = []
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=OPTIONS.split())
        opened = browser.new_page(viewport={"width": 1000, "height": 900})
        opened.on("request", lambda request: asked.append(request.url))
        opened.on("pageerror", lambda error: wrong.append(str(error)))
        opened.goto(page.as_uri())
        menu = opened.locator("select")
        menu.wait_for()
        shown = opened.locator(".bk-Figure:visible")
        # A sweep has the chart of exponents below the chosen chart.
        count = 1 if kind == "map" else 2
        for entry in menu.locator("option").all_inner_texts():
            menu.select_option(label=entry)
            shown.nth(count - 1).wait_for()
            assert shown.count() == count, entry
        assert opened.evaluate("document.hacked") is None
        browser.close()
    assert (asked, wrong) == ([page.as_uri()], [])


def test_a_large_sweep_is_thinned_and_keeps_periodic_points():
    from gearchaos.explorer.static import LARGEST_PAGE, _thinned, static_page

    load = np.linspace(0.0, 1.0, WIDE)
    points = np.tile([-1.0, 1.0], (WIDE, 200)) * load[:, np.newaxis]
    variables = sweep_variables(
        [coordinate("load", "1", "load", "$f_n$", load)],
        states=("delta_5",),
        section=("delta_5",),
        section_points=400,
        lyapunov=False,
        status_meanings=("ok", "diverged"),
    )
    data = {
        "section_delta_5": points,
        "status": np.zeros(WIDE),
        "diverged_period": np.full(WIDE, -1),
        "start_state": points[:, :1],
        "end_state": points[:, :1],
    }
    result = Result(["load"], variables, data, {}, {"title": "wide"})
    assert len(static_page(result).encode()) <= LARGEST_PAGE
    x, y = _thinned(result, "section_delta_5", 20_000)
    assert x.size <= 20_000
    # Every lane has both points of its period 2; in the first lane both points are equal.
    assert np.unique(x).size == WIDE
    assert {*np.sign(y[x == x.max()])} == {-1.0, 1.0}
    assert (np.unique(x[y > 0.0]) == np.unique(x[y < 0.0])).all()


def test_an_existing_file_is_kept(folder, tmp_path, capsys):
    page = tmp_path / "page.html"
    page.write_text("mine")
    assert main([str(folder / "sweep.h5"), "--save", str(page)]) == 4
    assert "--overwrite" in capsys.readouterr().err
    assert page.read_text() == "mine"
    assert main([str(folder / "sweep.h5"), "--save", str(folder / "sweep.h5"), "--overwrite"]) == 4
    assert "is the input itself" in capsys.readouterr().err
