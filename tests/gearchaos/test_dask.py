"""Dask workers compute blocks, with real schedulers and processes; tests kill some of them."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress

import numba
import psutil
import pytest

import gearchaos
from gearchaos.progress import SECONDS_BEFORE_NOTICE

from . import commands
from .commands import HANGS, LINEAR, begin, is_running, names_in, same_data, small_config

pytest.importorskip("distributed")

BLOCKS = "gears.h5.blocks"
# Each block of lanes takes a tenth of a second or more. On a machine with a few cores there are
# more than two blocks per worker: after an interrupt, each worker still finishes two.
LONG = ("--set", "sweep.count=8000", "--set", "integration.transient_periods=250")
LONG += ("--set", "outputs.motion=false")
# Many more blocks, for tests that stop the sweep: it must not end before, even on a busy machine.
ENDLESS = ("--set", "sweep.count=100000")
SCHEDULER, WORKER = "distributed.cli.dask_scheduler", "distributed.cli.dask_worker"
# Options of all processes: their imported modules, and that they run beside each other.
TOGETHER = {"imported": (SCHEDULER, WORKER), "beside": True}


def sweep(folder, *arguments, **options):
    """Run the sweep command on the small sweep in a folder."""
    return commands.sweep(folder, *arguments, **TOGETHER, **options)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    assert sweep(folder, *LONG, "--quiet").code == 0
    return gearchaos.open_result(folder / "gears.h5")


@contextmanager
def running(module, *arguments, cwd, **options):
    """Run a module of dask while the context lasts, and yield a function that kills it."""
    process, ended = begin(module, arguments, cwd, **TOGETHER, **options)
    try:
        yield lambda: killed(process)
    finally:
        killed(process)
        # Schedulers may log a traceback when the other end of a connection closes first.
        ended.unjudged()


def killed(process):
    with suppress(ProcessLookupError):
        os.kill(process, signal.SIGKILL)


@contextmanager
def mortal_scheduler(folder):
    """Run a scheduler, and yield its address and a function that kills it."""
    file = folder / "scheduler.json"
    flags = ("--scheduler-file", str(file), "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
    with running(SCHEDULER, *flags, cwd=folder) as kill:
        while not (file.exists() and file.read_text()):
            time.sleep(0.05)
        yield json.loads(file.read_text())["address"], kill


@contextmanager
def scheduler(folder):
    """Run a scheduler and yield its address."""
    with mortal_scheduler(folder) as (address, _):
        yield address


# A worker has no nanny, which would restart a killed worker.
WORKS = ("--no-nanny", "--nthreads", "1", "--no-dashboard")
ALONE = {"NUMBA_NUM_THREADS": "1"}


def worker(address, folder):
    """Run a worker and yield a function that kills it."""
    return running(WORKER, address, *WORKS, cwd=folder, variables=ALONE)


@contextmanager
def odd_worker(address, folder, before):
    """Run a worker that executes a line before it imports anything."""
    code = f"{before}\nfrom {WORKER} import main; main()"
    command = [sys.executable, "-c", code, address, *WORKS]
    silent = dict.fromkeys(("stdout", "stderr"), subprocess.DEVNULL)
    with subprocess.Popen(command, cwd=folder, env=os.environ | ALONE, **silent) as process:
        try:
            yield
        finally:
            process.kill()


def timeout(seconds):
    """Return the environment variable that sets how long dask waits for an answer."""
    return {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": seconds}


@contextmanager
def begun(folder, *arguments):
    """Start the long sweep; after its first block, yield its process and a function that waits."""
    small_config(folder)
    words = ("gears.toml", *LONG, *arguments)
    variables = timeout("60s")
    process, ended = begin("gearchaos.sweep", words, folder, variables=variables, **TOGETHER)
    try:
        while is_running(process) and not list((folder / BLOCKS).glob("*.block")):
            time.sleep(0.005)
        yield process, ended
    finally:
        killed(process)


@pytest.mark.slow
def test_the_blocks_of_a_killed_worker_are_run_again(tmp_path, undisturbed):
    cluster = tmp_path / "cluster"
    cluster.mkdir()
    with (
        scheduler(cluster) as address,
        worker(address, cluster) as kill_one,
        worker(address, cluster),
        begun(tmp_path, "--dask", address) as (_, ended),
    ):
        kill_one()
        code, out, err = ended()
    assert (code, out) == (0, "gears.h5\n"), err
    assert "8000 of 8000 lanes" in err
    assert names_in(tmp_path) == ["cluster", "gears.h5", "gears.toml"]
    result = gearchaos.open_result(tmp_path / "gears.h5")
    assert same_data(result, undisturbed)
    assert result.metadata["workers"] in (1, 2)


@pytest.mark.slow
def test_an_interrupt_keeps_what_local_workers_have_and_any_machine_goes_on(tmp_path, undisturbed):
    # One worker more than there are cores is allowed, with a message.
    cores = numba.config.NUMBA_NUM_THREADS
    with begun(tmp_path, "--dask", f"local:{cores + 1}") as (process, ended):
        # Ctrl-C in a terminal reaches all processes.
        workers = psutil.Process(process).children(recursive=True)
        for each in (psutil.Process(process), *workers):
            each.send_signal(signal.SIGINT)
        code, out, err = ended()
    assert (code, out) == (130, ""), err
    assert f"local:{cores + 1}: the workers share the " in err
    assert 0 < int(re.search(r"(\d+) of 8000 lanes are kept", err)[1]) < 8000
    _, alive = psutil.wait_procs(workers, timeout=HANGS)
    assert alive == []
    assert names_in(tmp_path) == [BLOCKS, "gears.toml"]
    assert sweep(tmp_path, *LONG, "--resume", "--quiet") == (0, "gears.h5\n", "")
    assert same_data(gearchaos.open_result(tmp_path / "gears.h5"), undisturbed)


@pytest.mark.slow
def test_flow_maps_that_workers_make_give_the_bits_of_those_made_here(tmp_path):
    own = (*LINEAR, "--set", "integration.method=flow_map", "--quiet")
    # Every mesh frequency has its own maps; the load does not change them.
    own += ("--set", 'sweep={parameter="mesh_frequency", from=0.2, to=2.0, count=200}')
    own += ("--set", 'second_sweep={parameter="load", values=[0.1, 0.2, 0.3]}')
    assert sweep(tmp_path, *own, "--dask", "local:1") == (0, "gears.h5\n", "")
    assert sweep(tmp_path, *own, "--output", "here.h5").code == 0
    one, other = (gearchaos.open_result(tmp_path / name) for name in ("gears.h5", "here.h5"))
    assert same_data(one, other)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("before", "message"),
    [
        (
            "import gearchaos.version as v; v.software_version = lambda: '0.0.9'",
            r"the worker tcp://\S+ has gearchaos 0\.0\.9 \(kernels \w+\), this process "
            r"gearchaos \S+ \(kernels \w+\): install the same",
        ),
        ("import sys; sys.modules['gearchaos'] = None", "a worker lacks the software"),
    ],
    ids=["other version", "none"],
)
def test_a_worker_with_other_software_is_refused(tmp_path, before, message):
    with scheduler(tmp_path) as address, odd_worker(address, tmp_path, before):
        ended = sweep(tmp_path, "--dask", address)
    assert (ended.code, ended.out) == (4, "")
    assert re.search(message, ended.err)
    assert BLOCKS not in names_in(tmp_path)


@pytest.mark.slow
def test_a_scheduler_that_goes_away_costs_nothing_that_is_finished(tmp_path):
    cluster = tmp_path / "cluster"
    cluster.mkdir()
    with begun_and_lost(cluster, tmp_path) as ended:
        code, out, err = ended()
    assert (code, out) == (4, ""), err
    # A request at this moment waits for an answer; on a busy machine it may time out first.
    assert re.search("the connection to the scheduler was lost|silent for .* alive[?]", err), err
    assert "lanes are kept" in err


@contextmanager
def begun_and_lost(cluster, folder):
    with (
        mortal_scheduler(cluster) as (address, kill),
        worker(address, cluster),
        begun(folder, "--dask", address, *ENDLESS) as (_, ended),
    ):
        kill()
        yield ended


@contextmanager
def port(answer):
    """Listen on a port, send an answer to the first client, or none for None; yield the address."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def speak():
            connection, _ = server.accept()
            with connection:
                connection.recv(1000)
                connection.sendall(answer)

        if answer is not None:
            threading.Thread(target=speak, daemon=True).start()
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"


def test_a_scheduler_that_does_not_answer_is_code_4(tmp_path):
    with port(None) as silent, port(b"HTTP/1.0 400 Bad Request\r\n\r\n") as other:
        # On a busy machine dask is too slow to report the end of its own time limit.
        for address, reason in {
            "tcp://127.0.0.1:9": "Timed out|silent for 1 s",
            silent: "silent for 1 s",
            other: "",
        }.items():
            ended = sweep(tmp_path, "--dask", address, variables=timeout("1s"))
            assert (ended.code, ended.out) == (4, "")
            assert re.search(
                f"error: {address}: no dask scheduler answers [(]({reason})", ended.err
            )
            assert names_in(tmp_path) == ["gears.toml"]


@pytest.mark.parametrize(
    ("address", "reason"),
    [
        ("nonsense://x", "unknown address scheme"),
        ("tls://127.0.0.1:9", "TLS expects a `ssl_context`.* check your TLS configuration"),
    ],
)
def test_an_address_that_can_be_none_is_refused_and_nothing_goes_on_from_it(
    tmp_path, address, reason
):
    ended = sweep(tmp_path, "--dask", address)
    assert (ended.code, ended.out) == (2, "")
    assert re.search(rf"--dask {address}: cannot be .* here \({reason}", ended.err)
    assert "continue with" not in ended.err
    assert names_in(tmp_path) == ["gears.toml"]


def signalled_while_it_waits(folder, address, number):
    small_config(folder)
    words = ("gears.toml", "--dask", address)
    process, ended = begin("gearchaos.sweep", words, folder, **TOGETHER)
    while is_running(process) and "\n" not in ended.said():
        time.sleep(0.005)
    os.kill(process, number)
    code, _, err = ended()
    return code, err.splitlines(keepends=True)[0]


def test_a_port_that_is_silent_is_waited_for_until_a_signal_comes(tmp_path):
    with port(None) as address:
        code, said = signalled_while_it_waits(tmp_path, address, signal.SIGTERM)
    assert (code, said) == (143, f"gearchaos sweep: {address}: waits up to 30 s for an answer\n")


def test_workers_that_do_not_come_are_waited_for_until_a_signal_comes(tmp_path):
    with scheduler(tmp_path) as address:
        code, said = signalled_while_it_waits(tmp_path, address, signal.SIGINT)
    assert code == 130
    assert "for a worker to join" in said or "for an answer" in said


@pytest.mark.slow
def test_an_interrupt_does_not_wait_for_workers_that_are_gone(tmp_path):
    cluster = tmp_path / "cluster"
    cluster.mkdir()
    with (
        scheduler(cluster) as address,
        worker(address, cluster) as kill_the_only_one,
        begun(tmp_path, "--dask", address, *ENDLESS) as (process, ended),
    ):
        kill_the_only_one()
        os.kill(process, signal.SIGINT)
        code, out, err = ended()
    assert (code, out) == (130, ""), err
    assert "lanes are kept" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--dask", "local:0"], "--dask local:0: must be local:N with N from 1 to"),
        (["--dask", f"local:{'9' * 5000}"], "must be local:N with N from 1 to"),
        (["--dask", "local:two"], "--dask local:two: must be local:N"),
        (
            ["--dask", "local:1", "--set", "start.carry=upwards"],
            '--dask: with start.carry = "upwards" one value is computed after the other',
        ),
        (
            ["--dask", "tcp://node:1", "--threads", "1"],
            "--threads 1: has no effect on the workers of",
        ),
    ],
)
def test_what_a_cluster_cannot_do_is_code_2(tmp_path, arguments, message):
    ended = sweep(tmp_path, *arguments)
    assert (ended.code, ended.out) == (2, "")
    assert message in ended.err
    assert "continue with" not in ended.err  # The command would be refused again.
    assert names_in(tmp_path) == ["gears.toml"]


def test_without_the_extra_the_message_names_it(tmp_path):
    small_config(tmp_path)
    code = "import sys; sys.modules['distributed'] = None; from gearchaos.sweep import main; "
    command = [sys.executable, "-c", f"{code}sys.exit(main())", "gears.toml", "--dask", "local:1"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (4, "")
    assert 'pip install "gearchaos[dask]"' in done.stderr


def test_a_worker_that_dies_before_it_has_joined_is_reported(tmp_path):
    small_config(tmp_path)
    # Python runs this file at the start of a process: a worker ends after the message that
    # announces the wait.
    (tmp_path / "sitecustomize.py").write_text(
        "import os, sys, time\n"
        "if any('multiprocessing-fork' in word for word in sys.orig_argv):\n"
        f"    time.sleep({2 * SECONDS_BEFORE_NOTICE})\n"
        "    os._exit(1)\n"
    )
    path = os.pathsep.join([str(tmp_path), *sys.path])
    ended = sweep(tmp_path, "--dask", "local:1", variables={"PYTHONPATH": path})
    assert ended.code == 4
    assert "waits up to 300 s for the workers to start" in ended.err
    assert "local:1: a worker has ended before it could join" in ended.err
