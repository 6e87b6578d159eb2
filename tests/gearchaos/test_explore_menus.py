"""A real browser draws every entry of every menu of the page, for each kind of result."""

from pathlib import Path

import pytest

import gearchaos
from gearchaos.explorer.text import plain_text
from gearchaos.figures.diagrams import diagram_variables
from gearchaos.figures.labels import axis_label
from gearchaos.figures.lanes import swept_axes
from gearchaos.figures.style import VERMILION

from .commands import served, small_config
from .test_explore import CHROMIUM, OPTIONS, missing

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(missing), reason=f"without {', '.join(missing)}"),
    pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here"),
]
SWEEPS = Path(__file__).resolve().parents[2] / "sweeps"
SHORT = ("integration.transient_periods=5", "integration.recorded_periods=10")
SHORT += ("outputs.section_points=5",)
WITHOUT_PHASE = "pitch_error.phase_deg=0.0"
LOAD = "second_sweep={parameter='load', values=[0.1, 0.2]}"
KINDS = {
    "diagram": ("gears", (WITHOUT_PHASE, "sweep.count=4", "outputs.orders=[1, 2]")),
    "carried": ("gears", (WITHOUT_PHASE, "sweep.count=4", "start.carry='both'")),
    "map": ("gears", (WITHOUT_PHASE, "sweep.count=3", LOAD)),
    "grades": (
        "grades",
        (*SHORT, "sweep.count=2", "pitch_error.realisations=2", "integration.steps_per_period=40"),
    ),
}
AT_MOST = 60_000  # Milliseconds, far above the time of a change on a busy machine.
MENUS = """all => all.map(menu => [menu.getRootNode().querySelector("label").textContent,
    [...menu.options].map(one => [one.value, one.textContent])])"""
"""Script that returns the title of every menu, and value and text of its entries."""
LABELS = """[...Bokeh.documents[0]._all_models.values()]
    .filter(one => one.type == "Figure").map(one => one.left[0].axis_label)"""
"""Script that returns the labels at the vertical axes of all drawn charts."""
BELOW = LABELS.replace("left", "below")
FAULT = f"b[style*='{VERMILION}']"


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        yield driver.chromium.launch(executable_path=CHROMIUM, args=OPTIONS.split())


def saved(kind: str, folder: Path) -> Path:
    """Compute and save a result of a kind."""
    name, changes = KINDS[kind]
    file = small_config(folder) if name == "gears" else SWEEPS / f"{name}.toml"
    result = gearchaos.run(gearchaos.load_config(file, changes))
    result.save(folder / f"{kind}.h5")
    return folder / f"{kind}.h5"


@pytest.mark.parametrize("kind", KINDS)
def test_every_entry_of_every_menu_is_drawn(kind, browser, tmp_path):
    path = saved(kind, tmp_path)
    with (
        (tmp_path / "said").open("w+") as said,
        served(tmp_path, path.name, stderr=said) as address,
    ):
        page = browser.new_page(viewport={"width": 800, "height": 600})
        page.set_default_timeout(AT_MOST)
        page.goto(f"{address}?units=dimensionless")
        # The page has a chart and the four panels of the motion.
        page.locator(".bk-Figure >> nth=4").wait_for()
        page.locator("pre:has-text('response')").wait_for()
        result = gearchaos.open_result(path)
        seen = entries_drawn(page, result)
        # With errors of single teeth, the spectrum has orders of the driving shaft.
        below = page.evaluate(BELOW)
        assert ("Order of the driving shaft (mesh: 21)" in below) == (kind == "grades")
        page.close()
    assert "Traceback" not in (tmp_path / "said").read_text()
    assert {"section_delta_5", "lyapunov_exponent"} & {*seen}
    assert ("amplitude_transmission_error" in seen) == (kind == "diagram")


def variables_of(result: gearchaos.Result) -> list[str]:
    """Return the variables of the menu in their order."""
    if len(swept_axes(result)) == 1:
        over_orders = [name for name in result if result.dims(name) == (*result.axes, "order")]
        return [*diagram_variables(result), *over_orders]
    of_lanes = [name for name in result if result.dims(name) == result.axes]
    return sorted(of_lanes, key=lambda name: name != "motion")


def entries_drawn(page, result: gearchaos.Result) -> list[str]:
    """Choose every entry of every menu, check that it is drawn, and return the variables."""
    drawn: list[str] = []
    menus = page.locator("select")
    for place, (title, entries) in enumerate(menus.evaluate_all(MENUS)):
        names = variables_of(result) if title == "Variable" else [text for _, text in entries]
        for (value, label), text in zip(entries, names, strict=True):
            if title == "Variable":
                assert label.startswith(plain_text(axis_label(result, text, 200)))
            menus.nth(place).select_option(value)
            words = {"Variable": f"--variable {text}", "Motion from": f"--begin {text}"}
            words["Units"] = "--units physical" if text == "physical" else "plot"
            page.locator(f"pre:has-text('{words.get(title, text)}')").wait_for()
            assert page.locator(FAULT).all_inner_texts() == [], (title, text)
            if title == "Variable":
                drawn.append(text)
                shown = text if len(swept_axes(result)) == 1 else result.axes[0]
                label = " ".join(plain_text(axis_label(result, shown)).split())
                label = "Mesh order" if result.dims(text)[-1] == "order" else label
                page.wait_for_function(
                    f"label => {LABELS}.some(one => one.split(/\\s+/).join(' ') == label)",
                    arg=label,
                )
    return drawn
