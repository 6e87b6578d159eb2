"""The page of a result in a real browser shows the contents of the file."""

import json
import re
import shlex
import shutil
import socket
import subprocess
import sys
from contextlib import suppress
from http.client import HTTPConnection
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from urllib.error import HTTPError
from urllib.parse import parse_qs, urlsplit
from urllib.request import Request, urlopen

import h5py
import numpy as np
import pytest
from gearchaos_kernels import Status

import gearchaos
from gearchaos.engine.recomputing import continued
from gearchaos.engine.response import compute_response, prepared
from gearchaos.explore import PORTS, _free_port, main

from .commands import PAGE_HANGS, served, small_config

# Not imported here: every test process collects this file, but only one runs its tests.
missing = [name for name in ("panel", "datashader", "playwright") if find_spec(name) is None]
pytestmark = pytest.mark.skipif(bool(missing), reason=f"without {', '.join(missing)}")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium here")

OPTIONS = "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking"
OPTIONS += " --disable-component-update --disable-sync"
ASKED = ("start.carry='both'", "sweep.count=20", "outputs.section_points=10")
# Without a phase; with a phase, other loops would have to be compiled.
ASKED += ("pitch_error.phase_deg=0.0",)
HOSTILE = '<img src="x" onerror="document.hacked = 1"> $$\\href{javascript:0}{x}$$'
PERIODS = 10
LINES = "one => one.center.filter(line => line.type == 'Span').map(line => line.location)"
FIGURES = """() => [...Bokeh.documents[0]._all_models.values()]
    .filter(one => one.type == "Figure")"""
PANELS = (
    f"""() => ({FIGURES})()"""
    + """
    .map(one => [one.left[0].axis_label, one.renderers.map(shown => shown.data_source?.data)
        .map(data => Object.fromEntries(Object.entries(data instanceof Map ?
            Object.fromEntries(data) : data ?? {}).map(([name, row]) => [name, Array.from(row)])))
        .filter(data => !("image" in data))])"""
)

PICTURE = (
    f"""() => {{ const first = ({FIGURES})()[0]"""
    + """
    const source = first.renderers.map(shown => shown.data_source)
        .find(source => source.columns().includes("image"))
    const [x, y, dw, dh, image] = ["x", "y", "dw", "dh", "image"]
        .map(name => source.get_column(name)[0])
    return {frame: [x, y, dw, dh], shape: image.shape,
        drawn: Array.from(image.keys()).filter(place => image[place] > 0),
        size: [first.inner_height, first.inner_width],
        seen: [first.x_range.start, first.y_range.start, first.x_range.end, first.y_range.end]}
}"""
)


@pytest.fixture(scope="module")
def path(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("explore")
    config = gearchaos.load_config(small_config(folder), (*ASKED, f"title='{HOSTILE}'"))
    gearchaos.run(config).save(folder / "pair.h5")
    with h5py.File(folder / "pair.h5", "a") as file:
        # The first lane of the downward sweep has no end state.
        file["end_state"][0, 1], file["status"][0, 1] = np.nan, Status.DIVERGED
    return folder / "pair.h5"


@pytest.fixture(scope="module")
def address(path):
    """Serve the file to all tests as a user does, then remove it: the open file stays readable."""
    copy = path.parent / "served" / path.name
    copy.parent.mkdir()
    shutil.copy(path, copy)
    with served(copy.parent, "pair.h5") as address:
        copy.unlink()
        yield address


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        yield driver.chromium.launch(executable_path=CHROMIUM, args=OPTIONS.split())


@pytest.fixture
def page(browser, address):
    """Open the page; check that it requests nothing from other hosts and that no error occurs."""
    opened, wrong = browser.new_page(viewport={"width": 1400, "height": 900}), []
    opened.set_default_timeout(1000.0 * PAGE_HANGS)
    opened.on("pageerror", lambda error: wrong.append(str(error)))
    opened.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
    opened.on("request", lambda asked: wrong.append(asked.url) if foreign(asked.url) else None)

    def foreign(url: str) -> bool:
        return not url.startswith((address, "data:", "blob:"))

    yield opened
    opened.close()
    assert wrong == []


def look(page, address: str, view: str = "") -> dict[str, list]:
    """Open a view, wait for the motion, and read its panels."""
    page.goto(address + view)
    page.locator(".bk-Figure >> nth=5").wait_for()
    return panels(page)


def panels(page) -> dict[str, list]:
    """Return the data in the panels of the motion, by the labels of their vertical axes."""
    return {" ".join(name.split()): shown for name, shown in page.evaluate(PANELS) if shown}


def lane_of(path: Path, begin: str = "end", **at):
    """Return the lane of a file, and its motion as the command computes it."""
    lane = gearchaos.open_result(path).sel("nearest", **at)
    config = continued(lane, str(path), begin)
    return lane, compute_response(prepared(config, PERIODS), PERIODS, "")


def texts(page) -> str:
    """Return all texts of the page."""
    return "\n".join(page.locator(".bk-panel-models-markup-HTML div").all_inner_texts())


def lane_in(link: str) -> str:
    return parse_qs(urlsplit(link).query).get("pitch_error", [""])[0]


def click(page, across: float) -> float:
    """Click into the diagram, and return the value of the lane that the page then shows."""
    from playwright.sync_api import Error as PlaywrightError

    before = lane_in(page.url)
    # A second is enough unless the machine is busy; another click does no harm.
    for _ in range(int(PAGE_HANGS)):
        # While panels appear, the diagram moves, and a click may miss it.
        box = page.locator(".bk-Figure").first.bounding_box()
        place = box["x"] + across * box["width"], box["y"] + 0.5 * box["height"]
        page.mouse.move(*place)
        page.mouse.click(*place)
        with suppress(PlaywrightError):
            page.wait_for_url(lambda url: lane_in(url) != before, timeout=1000)
            break
    value = lane_in(page.url)
    page.locator(f"pre:has-text('pitch_error={float(value):.12g}')").wait_for()
    return float(value)


def wait_for(page, panel: str, values: np.ndarray) -> list:
    """Wait until a panel shows these values on its vertical axis, and return all its data."""
    for _ in range(int(10 * PAGE_HANGS)):
        shown = panels(page).get(panel, [{}])
        if np.array_equal(shown[0].get("y", ()), values):
            return shown
        page.wait_for_timeout(100)
    raise AssertionError(f"{panel}: {shown[0]}")


@needs_browser
def test_a_click_shows_the_motion_of_the_lane_with_the_values_of_the_file(page, path, address):
    look(page, address, "?direction=1.0&units=dimensionless")
    value = float(click(page, 0.8))
    assert value in gearchaos.open_result(path)["pitch_error"] and value > 3.0
    lane, motion = lane_of(path, pitch_error=value, direction="downwards")
    wait_for(page, "Relative torsional displacement, δ₅ (unit b′)", motion["delta_5"][0])
    shown = panels(page)
    (exponents,) = shown["Largest Lyapunov exponent, λ₁ (per unit of τ)"]
    downwards = gearchaos.open_result(path).sel(direction="downwards")["lyapunov_exponent"]
    assert exponents["lyapunov_exponent"][1:] == downwards[1:].tolist()
    curve, strobe, section = shown["Relative torsional velocity, δ₅' (unit b′ωₕ)"]
    assert curve["y"] == motion["delta_5_rate"][0].tolist()
    assert strobe["x"] == motion["delta_5"][0, ::40].tolist()
    assert section["x"] == motion["section_delta_5"][0].tolist()
    # The motion continues from the end of the lane: its first point is the last one of the file.
    assert curve["x"][0] == lane["end_state"][0] == lane["section_delta_5"][-1]
    # Both charts have a line at the lane; the exponents also have a line at zero.
    lines = page.evaluate(f"({FIGURES})().slice(0, 2).map({LINES})")
    assert [sorted(at) for at in lines] == [[value], [0.0, value]]
    force, *strips = shown[
        "Tangential mesh force, N\N{GREEK SUBSCRIPT SMALL LETTER GAMMA} (unit kₘb′)"
    ]
    assert force["y"] == motion["mesh_force_tangential"][0].tolist()
    assert sum(len(strip["left"]) for strip in strips) > 0
    text = texts(page)
    exponent = f"λ₁ = {lane['lyapunov_exponent']:.4g} per unit of τ"
    # Once above the diagram, for the lane under the pointer, and once above the panels.
    assert text.count(f"P = {value:.6g} period {lane['period']}, {exponent}") == 2
    assert "python -m gearchaos.plot pair.h5 --at=direction=downwards" in text
    command = f"response pair.h5 --at=pitch_error={value:.12g} --at=direction=downwards --begin end"
    assert f"python -m gearchaos.{command} --periods 10" in text


def zoom(page) -> None:
    """Draw a box into the diagram, and wait for the link to its contents."""
    before, box = page.url, page.locator(".bk-Figure").first.bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 0.4 * box["height"])
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 0.6 * box["height"], steps=4)
    page.mouse.up()
    page.wait_for_url(lambda url: url != before)


def assert_counted_anew(page, path: Path, sizes: list[int]) -> None:
    """Check that the picture after a zoom counts the points in view for each pixel."""
    for _ in range(int(10 * PAGE_HANGS)):
        drawn = page.evaluate(PICTURE)
        left, low, *_ = drawn["seen"]
        if np.allclose(drawn["frame"][:2], (left, low)):
            break
        page.wait_for_timeout(100)
    np.testing.assert_allclose(drawn["frame"][2:], np.subtract(drawn["seen"][2:], (left, low)))
    assert drawn["shape"] == drawn["size"]
    # The server sends a picture with four bytes per pixel, for any number of points. On a busy
    # machine the zoom may arrive in several steps, with a picture for each step.
    pictures, rest = divmod(sum(sizes), 4 * int(np.prod(drawn["shape"])))
    assert 1 <= pictures <= 5
    assert rest < 100_000
    result = gearchaos.open_result(path).sel(direction="upwards")
    y = result["section_delta_5"]
    x = np.repeat(result["pitch_error"], y.shape[1]).reshape(y.shape)
    parts = [(x - left) / drawn["frame"][2], (y - low) / drawn["frame"][3]]
    inside = np.all([(part >= 0.0) & (part < 1.0) for part in parts], axis=0)
    column, row = (
        (part[inside] * size).astype(int)
        for part, size in zip(parts, drawn["shape"][::-1], strict=True)
    )
    places = np.unique(row * drawn["shape"][1] + column)
    assert 0 < inside.sum() < y.size
    assert np.isin(places, drawn["drawn"]).all()
    # With few points, a dot also fills the pixels beside it; all other pixels are empty.
    assert len(drawn["drawn"]) <= 9 * places.size


@needs_browser
def test_a_zoom_is_drawn_anew_a_link_brings_it_back_and_a_command_its_figure(
    page, path, address, monkeypatch, capsys
):
    sizes: list[int] = []
    page.on("websocket", lambda one: one.on("framereceived", lambda sent: sizes.append(len(sent))))
    look(page, address, "?units=dimensionless")
    # On a busy machine a picture may take longer than a second to arrive.
    shown = -1
    while shown != len(sizes):
        shown = len(sizes)
        page.wait_for_timeout(1000)
    sizes.clear()
    zoom(page)
    assert_counted_anew(page, path, sizes)
    page.locator("select").nth(2).select_option("physical")
    page.locator("select").nth(3).select_option("start")
    page.wait_for_url(re.compile("units=physical.*motion_from=start"))
    value = float(click(page, 0.4))
    zoom(page)
    link = page.url
    left, right, *_ = json.loads(parse_qs(urlsplit(link).query)["window"][0])
    assert 0.0 < left < value < right < 5.0
    page.goto("about:blank")
    shown = look(page, link)
    _, motion = lane_of(path, "start", pitch_error=value, direction="upwards")
    history = shown["Relative torsional displacement, δ₅ (µm)"][0]
    # The length scale of the pair is 25 um.
    np.testing.assert_allclose(history["y"], 25.0 * motion["delta_5"][0], rtol=1e-14)
    assert page.url == link
    for end, wanted in (("start", left), ("end", right)):
        seen = page.evaluate(f"({FIGURES})().slice(0, 2).map(one => one.x_range.{end})")
        np.testing.assert_allclose(seen, wanted, rtol=1e-5)
    saved = {}
    for name in ("sweep", "force"):
        with page.expect_download() as download:
            page.get_by_text(f"{name.replace('_', ' ').capitalize()} as PNG").click()
        assert download.value.suggested_filename == f"pair_{name}.png"
        saved[name] = Path(download.value.path()).read_bytes()
    sweep, response, _, figure = page.locator("pre").inner_text().splitlines()
    assert f"--from {left} --to {right} --variable section_delta_5 --units physical" in sweep
    monkeypatch.chdir(path.parent)
    for line in (sweep, response, figure):
        module, *arguments = shlex.split(line.removeprefix("python -m "))
        assert import_module(module).main(arguments) == 0
    of_sweep, _, _, of_force, _ = map(Path, capsys.readouterr().out.splitlines())
    assert saved == {"sweep": of_sweep.read_bytes(), "force": of_force.read_bytes()}


@needs_browser
def test_a_lane_that_cannot_be_computed_says_so_and_the_page_goes_on(page, address):
    page.goto(f"{address}?direction=1.0&pitch_error=0.0")
    page.get_by_text("choose another with --at").wait_for()
    page.get_by_text("Motion as PNG").click()
    page.get_by_text("there is no motion to draw").wait_for()
    assert click(page, 0.5) > 0.0
    for said in ("choose another", "there is no motion"):
        page.get_by_text(said).wait_for(state="detached")


@needs_browser
def test_what_a_file_or_a_link_says_is_shown_but_not_executed(page, address):
    look(page, address, "?units=furlongs&pitch_error=x&window=[1]&direction=1.0")
    page.get_by_text("the link names what does not exist").wait_for()
    assert HOSTILE in texts(page) and page.evaluate("document.hacked") is None
    assert "--at=direction=downwards" in texts(page)


@needs_browser
def test_no_other_origin_is_served(address):
    port = address.split(":")[-1].strip("/")
    with urlopen(address) as answer:
        assert answer.status == 200
    with pytest.raises(HTTPError, match="403"):
        urlopen(Request(address, headers={"Host": f"evil.example:{port}"}))
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}
    upgrade |= {"Sec-WebSocket-Key": 22 * "A" + "==", "Sec-WebSocket-Protocol": "bokeh, x"}
    for origin in ("http://evil.example", f"http://evil.example:{port}", "null"):
        asked = HTTPConnection("127.0.0.1", int(port))
        asked.request("GET", "/ws", headers={**upgrade, "Origin": origin})
        assert asked.getresponse().status == 403
        asked.close()
    # The server listens on the address 127.0.0.1 only, on no other one of this machine.
    with socket.socket() as other, pytest.raises(OSError):
        other.connect(("127.0.0.2", int(port)))


def test_what_is_wrong_is_reported_in_a_sentence(path, tmp_path, monkeypatch, capsys):
    def said(*arguments: str) -> tuple[int, str]:
        return main([*arguments, "--no-browser"]), capsys.readouterr().err

    code, text = said(str(tmp_path / "none.h5"))
    assert code == 4 and "none.h5: cannot be read" in text
    with socket.create_server(("127.0.0.1", 65535)):
        code, text = said(str(path), "--port", "65535")
    assert code == 2 and "--port 65535: Address already in use; choose another port" in text
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert port < _free_port("127.0.0.1", port) < port + PORTS
    assert f"port {port} is in use" not in capsys.readouterr().err
    lane_of(path, pitch_error=1.0, direction="upwards")[1].save(tmp_path / "response.h5")
    code, text = said(str(tmp_path / "response.h5"))
    assert code == 2 and "is a response; python -m gearchaos.plot draws it" in text
    # If Numba is missing or does not fit, no command can compute anything.
    without = "import sys; sys.modules['numba'] = None; import gearchaos.explore as command; "
    command = [sys.executable, "-c", f"{without} sys.exit(command.main())", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 4 and "import of numba" in done.stderr
    assert "does not fit, install gearchaos again" in done.stderr.splitlines()[0]
    monkeypatch.setitem(sys.modules, "panel", None)
    code, text = said(str(path), "--port", "0")
    assert code == 4 and 'panel is not installed; pip install "gearchaos[explore]"' in text


def test_the_page_runs_the_code_that_other_commands_have_compiled(path):
    # The first module that prepares Numba decides on the processor: it must be the kernels.
    code = """if True:
        import sys
        from gearchaos.explore import main
        sys.modules["panel"] = None
        main([sys.argv[1], "--no-browser", "--port", "0"])
        from numba.core.registry import cpu_target
        made_for = cpu_target.target_context.codegen().magic_tuple()
        sys.exit("-prefer-256-bit" not in made_for[-1])"""
    command = [sys.executable, "-c", code, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "panel is not installed" in done.stderr
    assert done.returncode == 0


def answer_to(address: str, path: str = "", **headers: str) -> tuple[int, dict[str, str], str]:
    """Return code, headers and text of an answer to a program that is not a browser."""
    asked = HTTPConnection("127.0.0.1", int(address.split(":")[-1].strip("/")), timeout=PAGE_HANGS)
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    asked.request("GET", f"/{path}", headers=named)
    answer = asked.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read().decode(errors="replace")
    asked.close()
    return found


SCRIPT = "autoload.js?bokeh-autoload-element=x"


@pytest.mark.parametrize("place", ["", SCRIPT, "static/js/bokeh.min.js", "nothing"])
def test_every_answer_forbids_frames_other_types_and_other_sites(address, place):
    code, headers, _ = answer_to(address, place)
    assert code == (404 if place == "nothing" else 200)
    policy = headers["Content-Security-Policy"]
    assert "default-src 'self';" in policy and "frame-ancestors 'none'" in policy
    assert headers["X-Frame-Options"] == "DENY"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert not [name for name in headers if name.startswith("Access-Control")]


def test_a_request_of_another_site_is_refused_and_a_link_in_it_is_not(address):
    port, own = address.split(":")[-1].strip("/"), address.strip("/")
    for path in ("", SCRIPT):
        assert answer_to(address, path, Origin=own)[0] == 200
        assert answer_to(address, path, Origin=f"http://localhost:{port}")[0] == 200
        others = "http://evil.example", f"http://evil.example:{port}", "null", f"https://{own[7:]}"
        for origin in (*others, "http://127.0.0.1:1"):
            code, headers, _ = answer_to(address, path, Origin=origin)
            assert code == 403 and "Access-Control-Allow-Origin" not in headers
    # A request for a script or a picture in another page has no origin.
    for site in ("cross-site", "same-site"):
        script = {"Sec_Fetch_Site": site, "Sec_Fetch_Mode": "no-cors", "Sec_Fetch_Dest": "script"}
        frame = {"Sec_Fetch_Site": site, "Sec_Fetch_Mode": "navigate", "Sec_Fetch_Dest": "iframe"}
        assert answer_to(address, SCRIPT, **script)[0] == 403
        assert answer_to(address, **frame)[0] == 403
        assert answer_to(address, **{**frame, "Sec_Fetch_Dest": "document"})[0] == 200


def test_a_link_that_cannot_be_read_is_code_400(address):
    for query in ("?pitch_error=" + "1" * 5000, "?other=" + "1" * 5000, "?units=%C2%B2"):
        code, _, text = answer_to(address, query)
        assert code == 400 and "open the address without it" in text
    for query in ("?pitch_error=" + "1" * 400, "?window=[" + "1" * 5000 + "]", "?window=[1e999]"):
        assert answer_to(address, query)[0] == 200


def test_axes_with_the_same_label_stay_two_axes(path, monkeypatch):
    import holoviews

    from gearchaos.explorer import charts

    config = gearchaos.load_config(
        path.parent / "gears.toml",
        ("sweep.count=3", "second_sweep={parameter='damping_ratio', values=[0.05, 0.1]}"),
    )
    result = gearchaos.run(config)
    holoviews.extension("bokeh")
    for label in ("P", "damping_ratio", "z"):
        monkeypatch.setattr(charts, "axis_label", lambda *_, label=label: label)
        (chart,), _ = charts.two_parameter_map(result, "lyapunov_exponent")
        image = chart[()]
        assert sorted(np.unique(image.dimension_values(2))) == sorted(
            np.unique(result["lyapunov_exponent"].astype(image.dimension_values(2).dtype))
        )


@needs_browser
def test_a_link_to_a_number_that_no_sweep_reaches_is_reported(page, address):
    look(page, address, "?pitch_error=1e999&window=[1,2,3,1e999]&direction=1.0")
    page.get_by_text("the link names what does not exist: pitch_error").wait_for()
    page.wait_for_url(lambda url: lane_in(url) == "0.0")


@needs_browser
def test_no_frame_of_another_page_shows_the_page(browser, address):
    opened = browser.new_page()
    opened.set_content(f"<iframe src='{address}'></iframe>")
    opened.wait_for_timeout(1000)
    assert not any(frame.url == address for frame in opened.frames)
    opened.close()


def test_the_port_of_http_need_not_be_named():
    policy = import_module("gearchaos.explorer.policy")
    assert policy.origins(8080) == ["127.0.0.1:8080", "localhost:8080"]
    assert {"127.0.0.1", "localhost", "127.0.0.1:80"} <= {*policy.origins(80)}
