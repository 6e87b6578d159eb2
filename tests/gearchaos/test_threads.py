"""Several threads or processes give the results of one, or a message with the remedy."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event, Thread

import matplotlib as mpl
import numpy as np
import pytest
from gearchaos_kernels.methods.flow_map import store

import gearchaos
from gearchaos.figures import bifurcation_page, map_page, save_figure
from gearchaos.figures.labels import axis_label
from gearchaos.figures.page import column
from gearchaos.figures.style import DRAWING, styled
from gearchaos.interrupts import check, heeded

from .commands import same_data
from .test_figures import logistic_sweep
from .test_maps import RESULT as MAP
from .tiny_sweep import configuration

SWEEPS = 24
THREADS = (4, 8)


@pytest.fixture(autouse=True)
def _quick_switches() -> Iterator[None]:
    """Let the interpreter switch threads as often as possible."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    yield
    sys.setswitchinterval(interval)


def forget_maps(monkeypatch) -> None:
    monkeypatch.setattr(store, "_kept", store._Kept(0))


@pytest.mark.parametrize("threads", THREADS)
def test_results_of_threads_are_those_of_one_bit_for_bit(threads, monkeypatch):
    configs = [configuration(number) for number in range(SWEEPS)]
    serial = []
    for config in configs:
        forget_maps(monkeypatch)
        serial.append(gearchaos.run(config))
    forget_maps(monkeypatch)
    # The second pass uses the maps that the first pass has stored.
    for _ in range(2):
        with ThreadPoolExecutor(threads) as pool:
            assert all(map(same_data, pool.map(gearchaos.run, configs), serial))


def in_a_process(layer: str, *ways: str) -> dict:
    """Return the findings of the script `tiny_sweep` in a new process."""
    script = Path(__file__).with_name("tiny_sweep.py")
    variables = {"NUMBA_THREADING_LAYER": layer, "NUMBA_NUM_THREADS": "2"}
    done = subprocess.run(
        [sys.executable, "-W", "ignore", str(script), *ways],
        env=os.environ | variables,
        capture_output=True,
        text=True,
        timeout=300,
    )
    if "threading layer could be loaded" in done.stderr:
        pytest.skip(f"the threading layer {layer} is not available")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="os.fork is not available")
class TestProcesses:
    def test_threads_and_forks_work_without_openmp(self):
        # Numba ends a process if two of its threads enter this layer at once.
        found = in_a_process("workqueue", "fork")
        assert found == {"forked in a turn": True, "threads": True, "fork": True}

    @pytest.mark.skipif(sys.platform != "linux", reason="elsewhere OpenMP survives a fork")
    def test_openmp_works_in_spawned_processes_and_forked_ones_get_a_message(self):
        found = in_a_process("omp", "fork", "spawn")
        assert found["threads"] and found["spawn"] is True
        wanted = r"process \d+ was forked from .* had computed before.* the method 'spawn', such as"
        assert re.match(wanted, found["fork"])

    def test_a_fork_waits_for_a_page_and_draws_in_its_own_style(self):
        before, begun = dict(mpl.rcParams), Event()

        def draw() -> None:
            with column(40.0) as figure:
                begun.set()
                figure.subplots()

        thread = Thread(target=draw)
        thread.start()
        begun.wait()
        child = os.fork()
        if child == 0:
            free = DRAWING.acquire(blocking=False)
            os._exit(0 if free and dict(mpl.rcParams) == before else 1)
        thread.join()
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def pictures() -> list[Callable]:
    """Return functions that draw different pages."""
    sweeps = [logistic_sweep(np.linspace(low, 3.9, 21)) for low in (2.8, 3.2, 3.5)]
    pages = [lambda one=one: bifurcation_page(one, width_mm=60.0) for one in sweeps]
    return [*pages, lambda: map_page(MAP, "lyapunov_exponent"), lambda: map_page(MAP, "motion")]


def test_pictures_of_threads_are_those_of_one_bit_for_bit(tmp_path):
    before, draw = dict(mpl.rcParams), pictures()

    def drawn(number: int) -> tuple[bytes, bytes]:
        page, path = draw[number % len(draw)](), tmp_path / f"{number}.png"
        save_figure(page, path, dpi=60)
        page.canvas.draw()
        return path.read_bytes(), bytes(page.canvas.buffer_rgba())

    serial = [drawn(number) for number in range(len(draw))]
    assert len(set(serial)) == len(draw)
    for threads in THREADS:
        with ThreadPoolExecutor(threads) as pool:
            found = [*pool.map(drawn, range(threads))]
        assert found == [serial[number % len(draw)] for number in range(threads)]
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize(
    "use",
    [
        lambda page, _: page.savefig(os.devnull, format="png"),
        lambda page, _: page.canvas.draw(),
        lambda page, _: page._repr_png_(),
        lambda page, folder: save_figure(page, folder / "page.png"),
        lambda *_: bifurcation_page(logistic_sweep([2.8, 2.9])),
        lambda *_: axis_label(logistic_sweep([2.8, 2.9], symbol="$r_{new}$"), "growth"),
    ],
    ids=["savefig", "draw", "notebook", "save_figure", "page", "formula"],
)
def test_whoever_draws_waits_for_the_page_of_another_thread(use, tmp_path):
    with column(40.0) as page:
        page.subplots()
    with ThreadPoolExecutor(1) as pool:
        with styled():
            waiting = pool.submit(use, page, tmp_path)
            with pytest.raises(TimeoutError):
                waiting.result(timeout=0.5)
        waiting.result()


def test_only_one_place_changes_the_settings_of_matplotlib():
    package = Path(gearchaos.__file__).parent
    found = [p.name for p in package.rglob("*.py") if "rc_context" in p.read_text(encoding="utf-8")]
    assert found == ["style.py"]


@pytest.fixture
def heard():
    """Let Ctrl-C have an effect: in a shell, background processes ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heard")
def test_a_signal_is_for_the_main_thread_and_other_threads_leave_it_alone():
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def elsewhere() -> dict:
        with heeded(at_once=True):
            check()
            return {number: signal.getsignal(number) for number in handlers}

    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(elsewhere).result() == handlers
        with heeded(at_once=False):
            noting = {number: signal.getsignal(number) for number in handlers}
            assert pool.submit(elsewhere).result() == noting
            # The signal is raised in this thread: another thread that waits for a core could
            # receive it later.
            signal.raise_signal(signal.SIGINT)
            # The end of the block in the other thread must not discard the signal or restore the
            # handlers.
            after = pool.submit(elsewhere).result()
            assert after[signal.SIGTERM] == noting[signal.SIGTERM]
            with pytest.raises(KeyboardInterrupt):
                check()
    assert {number: signal.getsignal(number) for number in handlers} == handlers
