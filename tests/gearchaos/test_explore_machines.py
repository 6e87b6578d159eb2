"""The page of a machine shows its coordinates, its elements and the motion of a lane."""

import numpy as np
import pytest

import gearchaos
from gearchaos.engine.recomputing import continued
from gearchaos.engine.response import compute_response, prepared
from gearchaos.explorer.text import plain_text

from .commands import PAGE_HANGS, served
from .short_sweeps import MASSES
from .test_explore import CHROMIUM, OPTIONS, PERIODS, look, missing

SHORT = (
    "integration={method='taylor', transient_periods=200, recorded_periods=100}",
    "sweep.count=21",
    "outputs.section_points=20",
    "outputs.exponents=true",
    "start.carry='none'",
)
needs_page = pytest.mark.skipif(bool(missing) or CHROMIUM is None, reason="no page or no chromium")


@pytest.mark.parametrize(
    ("label", "text"),
    [
        (r"$\delta_5'$", "δ₅'"),
        (r"$F_{\mathrm{stop}}$", "Fₛₜₒₚ"),
        (r"$F_{\mathrm{sun\ planet\ 1}}$", "F (sun planet 1)"),
        (r"$x_{\mathrm{1}}''$", "x₁''"),
        (r"$\mathrm{carrier\ u}$", "carrier u"),
        (r"Exponent, $\lambda_{1}$, $10^{-3}$", "Exponent, λ₁, 10⁻³"),
    ],
)
def test_labels_of_machines_are_plain_text(label, text):
    assert plain_text(label) == text


@needs_page
def test_the_page_of_a_machine_shows_the_motion_of_a_lane(tmp_path):
    from playwright.sync_api import sync_playwright

    config = gearchaos.load_config(MASSES, SHORT)
    gearchaos.run(config).save(tmp_path / "masses.h5")
    wrong = []
    with served(tmp_path, "masses.h5") as address, sync_playwright() as driver:
        page = driver.chromium.launch(executable_path=CHROMIUM, args=OPTIONS.split()).new_page()
        page.set_default_timeout(1000.0 * PAGE_HANGS)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        shown = look(page, address, "?frequency=0.7")
    assert wrong == []
    lane = gearchaos.open_result(tmp_path / "masses.h5").sel("nearest", frequency=0.7)
    given = continued(lane, "masses.h5", "end")
    response = compute_response(prepared(given, PERIODS), PERIODS, "")
    (force,) = shown["Force, stop, Fₛₜₒₚ"][:1]
    assert max(force["y"]) == pytest.approx(np.max(response["force_stop"]), rel=0.05)
    assert any(name.startswith("Displacement of x1") for name in shown)
