"""How long is it from a zoom to the new picture in `explore`, and does it grow with the points?

Ten thousand, a hundred thousand and a million section points of the pair of Pan 2021 are opened in
a headless Chromium, and a box is drawn into the diagram. It prints medians: of the time from the
moment at which the mouse is let go to the one at which the picture has come (0.1 s of it
HoloViews waits for another movement), of the processor time of the server, the pointer's way
included, and of the bytes that were sent. Needs gearchaos[explore], playwright and chromium.
"""

import shutil
import subprocess
import sys
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import psutil
from machine import print_machine
from playwright.sync_api import Page, sync_playwright

import gearchaos

CONFIG = Path(__file__).parents[1] / "sweeps" / "pan2021.toml"
QUICK = ["integration.method='flow_map'", "integration.steps_per_period=24"]
QUICK += ["integration.transient_periods=100"]
ROUNDS = 9
PICTURE = """() => {
    window.pictures = []
    for (const one of Bokeh.documents[0]._all_models.values())
        if (one.type == "ColumnDataSource" && one.columns().includes("image"))
            one.properties.data.change.connect(() => pictures.push(performance.now()))
}"""


def main() -> None:
    """Print the table."""
    print_machine()
    print(f"{'points':>9} {'until drawn':>12} {'processor':>10} {'sent':>8}")
    with TemporaryDirectory() as folder, sync_playwright() as driver:
        chromium = shutil.which("chromium") or shutil.which("chromium-browser")
        options = ["--headless", "--no-sandbox", "--disable-gpu"]
        page = driver.chromium.launch(executable_path=chromium, args=options).new_page()
        for count in (20, 200, 2000):
            path = Path(folder, f"{count}.h5")
            gearchaos.run(gearchaos.load_config(CONFIG, [*QUICK, f"sweep.count={count}"])).save(
                path
            )
            waited, worked, sent = zooms(page, path)
            print(f"{count * 500:9d} {waited:10.2f} s {worked:8.2f} s {sent / 1e6:5.2f} MB")


def zooms(page: Page, path: Path) -> tuple[float, float, float]:
    """Zoom into the chaotic half of a diagram, and return the medians."""
    command = [sys.executable, "-m", "gearchaos.explore", str(path), "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        address, process = server.stdout.readline().strip(), psutil.Process(server.pid)
        received: list[int] = []
        page.once("websocket", lambda w: w.on("framereceived", lambda f: received.append(len(f))))
        rows = []
        page.goto(address)
        page.locator(".bk-Figure >> nth=5").wait_for()
        for _ in range(ROUNDS):
            page.get_by_title("Reset").first.click()
            page.wait_for_timeout(2000)
            page.evaluate(PICTURE)
            before = sum(process.cpu_times()[:2])
            received.clear()
            box = page.locator(".bk-Figure").first.bounding_box()
            page.mouse.move(box["x"] + 0.7 * box["width"], box["y"] + 0.2 * box["height"])
            page.mouse.down()
            page.mouse.move(box["x"] + 0.9 * box["width"], box["y"] + 0.6 * box["height"])
            page.wait_for_timeout(500)
            begun = page.evaluate("performance.now()")
            page.mouse.up()
            page.wait_for_function("pictures.length > 0")
            drawn = page.evaluate("pictures[0]")
            page.wait_for_timeout(1000)
            worked = sum(process.cpu_times()[:2]) - before
            rows.append(((drawn - begun) / 1000.0, worked, sum(received)))
        server.terminate()
    waited, worked, sent = map(median, zip(*rows, strict=True))
    return waited, worked, sent


if __name__ == "__main__":
    main()
