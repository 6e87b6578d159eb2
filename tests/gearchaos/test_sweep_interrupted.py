"""An interrupted sweep keeps its finished blocks, reports how to continue, and can be resumed."""

import os
import random
import re
import shlex
import shutil
import signal
import sys
import time
from pathlib import Path

import gearchaos_kernels
import pytest
from gearchaos_kernels import source_hash

import gearchaos
from gearchaos.results.files.block_folder import LOCK, folder_of

from .commands import (
    LINEAR,
    begin,
    is_running,
    names_in,
    run_module,
    same_data,
    signalled,
    small_config,
    sweep,
)

HELD_LOCKS = Path("/proc/locks")

# Four blocks of lanes that take a second in total.
LONG = (
    *("--threads", "1"),
    *LINEAR,
    *("--set", "sweep.count=1000"),
    *("--set", "integration.transient_periods=2500"),
)
BLOCKS = "gears.h5.blocks"


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    assert sweep(folder, *LONG, "--quiet").code == 0
    return gearchaos.open_result(folder / "gears.h5")


def stop_half_way(folder, number, *arguments):
    """Start the long sweep, signal it after its first block, and return exit code and stderr."""
    small_config(folder)
    code, out, err = signalled(folder, BLOCKS, number, "gears.toml", *LONG, *arguments)
    assert "Traceback" not in err
    assert out == ""
    assert names_in(folder) == [BLOCKS, "gears.toml"]
    return code, err


@pytest.mark.parametrize(
    ("number", "code", "word"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")],
)
def test_the_command_printed_after_an_interrupt_gives_the_undisturbed_result(
    tmp_path, undisturbed, number, code, word
):
    ended, err = stop_half_way(tmp_path, number, "--resume")
    assert ended == code
    known = re.compile("kernel of this scene|lanes/s")
    said = [line for line in err.splitlines() if line and not known.search(line)]
    ending, stopped, kept, how = said
    assert ending == "gearchaos: ending what is running; interrupt again to stop at once"
    assert stopped == f"gearchaos sweep: {word}"
    lanes = int(re.fullmatch(r"gearchaos sweep: (\d+) of 1000 lanes are kept", kept)[1])
    assert 0 < lanes < 1000
    command = shlex.split(how.removeprefix("gearchaos sweep: continue with: "))
    assert command.count("--resume") == 1
    assert command[:2] == [sys.executable, "-m"]
    done = run_module(*command[2:], cwd=tmp_path)
    assert (done.code, done.out) == (0, "gears.h5\n")
    assert names_in(tmp_path) == ["gears.h5", "gears.toml"]
    assert same_data(gearchaos.open_result(tmp_path / "gears.h5"), undisturbed)


def test_a_killed_sweep_leaves_nothing_that_looks_like_a_result_and_can_be_resumed(
    tmp_path, undisturbed
):
    ended, _ = stop_half_way(tmp_path, signal.SIGKILL)
    assert ended == -signal.SIGKILL
    for path in (tmp_path / BLOCKS).iterdir():
        with pytest.raises(gearchaos.GearchaosError):
            gearchaos.open_result(path)
    # Finished blocks are neither lost by accident nor mixed with another sweep.
    refused = sweep(tmp_path, *LONG)
    assert refused.code == 4
    assert "continue with: " not in refused.err
    assert re.search(r"holds \d finished blocks? of an earlier run; continue it with", refused.err)
    other = sweep(tmp_path, *LONG, "--resume", "--set", "groups.damping_ratio=0.06")
    assert other.code == 4
    assert (
        "another gearchaos or configuration, which differs in groups.damping_ratio (0.05, now 0.06)"
        in (other.err)
    )
    assert names_in(tmp_path) == [BLOCKS, "gears.toml"]
    # A damaged block is reported and computed again.
    block = min((tmp_path / BLOCKS).glob("*.block"))
    block.write_bytes(block.read_bytes()[:-100])
    resumed = sweep(tmp_path, *LONG, "--resume")
    assert (resumed.code, resumed.out) == (0, "gears.h5\n")
    assert f"{block.name}: " in resumed.err
    assert "; it is computed again\n" in resumed.err
    assert same_data(gearchaos.open_result(tmp_path / "gears.h5"), undisturbed)


@pytest.mark.parametrize(
    ("direction", "method"), [("upwards", "rk4"), ("both", "rk4"), ("downwards", "flow_map")]
)
def test_a_carried_sweep_goes_on_from_the_end_states_of_the_finished_blocks(
    tmp_path, direction, method
):
    carried = ("--set", f"start.carry={direction}", "--set", "sweep.count=130")
    carried += ("--set", f"integration.method={method}")
    carried += ("--set", "start.kind=random", "--set", "start.count=3")
    carried += ("--set", "integration.transient_periods=400")
    ended, _ = stop_half_way(tmp_path, signal.SIGINT, *carried)
    assert ended == 130
    assert sweep(tmp_path, *LONG, *carried, "--resume", "--quiet") == (0, "gears.h5\n", "")
    pieces = gearchaos.open_result(tmp_path / "gears.h5")
    overrides = [*LONG[3::2], *carried[1::2]]  # Without --threads.
    at_once = gearchaos.run(gearchaos.load_config(tmp_path / "gears.toml", overrides))
    assert same_data(pieces, at_once)


def test_lanes_with_flow_maps_of_their_own_go_on_with_the_same_bits(tmp_path):
    own = ("--set", "integration.method=flow_map", "--set", 'sweep.parameter="mesh_frequency"')
    own += ("--set", "sweep.from=0.2", "--set", "integration.transient_periods=500")
    ended, _ = stop_half_way(tmp_path, signal.SIGINT, *own)
    assert ended == 130
    assert sweep(tmp_path, *LONG, *own, "--resume", "--quiet") == (0, "gears.h5\n", "")
    overrides = [*LONG[3::2], *own[1::2]]  # Without --threads.
    at_once = gearchaos.run(gearchaos.load_config(tmp_path / "gears.toml", overrides))
    assert same_data(gearchaos.open_result(tmp_path / "gears.h5"), at_once)


def test_resume_without_an_earlier_run_simply_computes(tmp_path):
    assert sweep(tmp_path, *LINEAR, "--resume", "--quiet") == (0, "gears.h5\n", "")


def test_two_sweeps_do_not_write_to_the_same_output(tmp_path):
    small_config(tmp_path)
    first, ended = begin("gearchaos.sweep", ("gears.toml", *LONG), tmp_path)
    while is_running(first) and not list((tmp_path / BLOCKS).glob("*.block")):
        time.sleep(0.005)
    os.kill(first, signal.SIGSTOP)  # The first sweep must not end before the second.
    second = sweep(tmp_path, *LONG, "--resume", beside=True)
    os.kill(first, signal.SIGTERM)
    os.kill(first, signal.SIGCONT)
    assert second.code == 4
    assert "gears.h5: another sweep is writing to it; wait for its end" in second.err
    assert ended().code == 143
    assert names_in(tmp_path) == [BLOCKS, "gears.toml"]


def is_locked(output):
    """Return whether a sweep holds its lock, without taking it: that would block the sweep."""
    lock = folder_of(output) / LOCK
    return lock.exists() and f":{lock.stat().st_ino} " in HELD_LOCKS.read_text()


@pytest.mark.slow
@pytest.mark.skipif(not HELD_LOCKS.exists(), reason="the system does not list held locks")
def test_twenty_kills_at_random_moments_cost_no_bit(tmp_path):
    # There are 63 blocks. Every attempt finishes a few; the last ones are killed while merging.
    wide = ("--threads", "1", *LINEAR, "--set", "sweep.count=32000", "--quiet")
    wide += ("--set", "integration.transient_periods=100")
    (tmp_path / "undisturbed").mkdir()
    assert sweep(tmp_path / "undisturbed", *wide).code == 0
    output, moments = tmp_path / "gears.h5", random.Random(20)
    small_config(tmp_path)
    finished = []
    for _ in range(20):
        process, ended = begin("gearchaos.sweep", ("gears.toml", *wide, "--resume"), tmp_path)
        while not is_locked(output) and is_running(process):
            time.sleep(0.005)
        before = blocks_in(tmp_path)
        enough = min(before + moments.randint(1, 7), 63)
        while is_running(process) and blocks_in(tmp_path) < enough:
            time.sleep(0.001)
        # The new result is begun next to the blocks.
        while (
            is_running(process) and enough == 63 and not list((tmp_path / BLOCKS).glob(".gears*"))
        ):
            time.sleep(0.001)
        time.sleep(moments.uniform(0.0, 0.03))
        os.kill(process, signal.SIGKILL)
        assert ended().code == -signal.SIGKILL
        finished.append(blocks_in(tmp_path))
        # Blocks of earlier attempts are kept.
        assert finished[-1] >= before
        assert not output.exists()
    assert len({count for count in finished if 0 < count < 63}) > 5, finished
    assert finished.count(63) > 1, finished
    assert sweep(tmp_path, *wide, "--resume") == (0, "gears.h5\n", "")
    assert names_in(tmp_path) == ["gears.h5", "gears.toml", "undisturbed"]
    undisturbed = gearchaos.open_result(tmp_path / "undisturbed" / "gears.h5")
    assert same_data(gearchaos.open_result(tmp_path / "gears.h5"), undisturbed)


def blocks_in(folder):
    return len(list((folder / BLOCKS).glob("*.block")))


def test_damaged_foreign_and_ill_dated_blocks_are_reported_and_computed_again(
    tmp_path, undisturbed
):
    (tmp_path / "other").mkdir()
    all_blocks = (*LONG, "--shard", "1/1", "--quiet")
    assert sweep(tmp_path, *all_blocks).code == 0
    other = (*all_blocks, "--set", "integration.transient_periods=1")
    assert sweep(tmp_path / "other", *other).code == 0
    cut, foreign, flipped, sound = sorted((tmp_path / BLOCKS).glob("*.block"))
    cut.write_bytes(cut.read_bytes()[:1000])
    foreign.write_bytes((tmp_path / "other" / BLOCKS / foreign.name).read_bytes())
    content = bytearray(flipped.read_bytes())
    content[len(content) // 2] ^= 0x10
    flipped.write_bytes(content)
    # The blocks are from tomorrow, as if the clock had been set back.
    tomorrow = time.time() + 86_400
    for path in (tmp_path / BLOCKS).iterdir():
        os.utime(path, (tomorrow, tomorrow))
    resumed = sweep(tmp_path, *LONG, "--resume")
    assert resumed.code == 0
    for path, problem in (
        (cut, r"has not the \d+ bytes of its lanes"),
        (foreign, "another sweep"),
        (flipped, "checksum"),
    ):
        assert re.search(f"{path.name}: .*{problem}.*; it is computed again\n", resumed.err)
    assert sound.name not in resumed.err
    assert same_data(gearchaos.open_result(tmp_path / "gears.h5"), undisturbed)


def test_an_output_folder_that_is_removed_meanwhile_is_code_4(tmp_path):
    small_config(tmp_path)
    (tmp_path / "results").mkdir()
    words = ("gears.toml", *LONG, "--output", "results/gears.h5")
    process, ended = begin("gearchaos.sweep", words, tmp_path)
    while is_running(process) and not list((tmp_path / "results" / BLOCKS).glob("*.block")):
        time.sleep(0.005)
    while (tmp_path / "results").exists():
        shutil.rmtree(tmp_path / "results", ignore_errors=True)
    code, _, err = ended()
    assert code == 4
    assert "cannot be written: No such file or directory; create the folder first" in err


def other_kernels(folder):
    """Copy the kernels, change a source, and return an environment that uses the copy."""
    original = Path(gearchaos_kernels.__file__).parent
    copy = Path(shutil.copytree(original, folder / "other" / original.name))
    with (copy / "rk4.py").open("a") as source:
        source.write("# changed\n")
    path = os.pathsep.join([str(copy.parent), *filter(None, [os.environ.get("PYTHONPATH")])])
    return {**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(folder / "other")}


def test_neither_blocks_nor_a_result_of_other_kernels_are_gone_on_with(tmp_path):
    kernels = rf"differs in kernels \({source_hash()}, now \w+\); go back "
    differs = f"another gearchaos or configuration, which {kernels}"
    changed = {"env": other_kernels(tmp_path)}
    assert sweep(tmp_path, *LINEAR, "--shard", "1/1", "--quiet").code == 0
    before = names_in(tmp_path / BLOCKS)
    for ended in (
        sweep(tmp_path, *LINEAR, "--resume", **changed),
        run_module("gearchaos.merge", "gears.h5", cwd=tmp_path, **changed),
    ):
        assert (ended.code, ended.out) == (4, "")
        assert re.search(f"{BLOCKS}: holds blocks of {differs}.* delete the folder", ended.err)
        # Nothing is compiled before the refusal.
        assert len(ended.err.splitlines()) == 1
        assert names_in(tmp_path / BLOCKS) == before
    assert sweep(tmp_path, *LINEAR, "--resume", "--quiet").code == 0
    ended = sweep(tmp_path, *LINEAR, "--resume", **changed)
    assert (ended.code, ended.out) == (4, "")
    assert re.search(f"gears.h5: is the result of {differs}.* with --overwrite", ended.err)


def test_a_pipe_in_the_place_of_the_result_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "gears.h5")
    ended = sweep(tmp_path, *LINEAR, "--resume")
    assert ended.code == 4
    assert "gears.h5: is not a regular file" in ended.err


def test_the_same_command_is_not_recommended_where_it_must_fail_again(tmp_path):
    small_config(tmp_path)
    process, ended = begin("gearchaos.sweep", ("gears.toml", *LONG), tmp_path)
    while is_running(process) and not (tmp_path / BLOCKS / "manifest.json").exists():
        time.sleep(0.005)
    (tmp_path / "gears.h5").write_bytes(b"precious")
    code, _, err = ended()
    assert code == 4
    assert "gears.h5: exists already; replace it with --overwrite" in err
    assert "1000 of 1000 lanes are kept" in err
    assert "continue with" not in err
    assert (tmp_path / "gears.h5").read_bytes() == b"precious"


def test_resuming_a_complete_sweep_succeeds_and_says_so(tmp_path):
    assert sweep(tmp_path, *LINEAR, "--quiet").code == 0
    before = (tmp_path / "gears.h5").read_bytes()
    # A process that is killed during its cleanup leaves such blocks.
    assert sweep(tmp_path, *LINEAR, "--shard", "1/1", "--output", "again.h5").code == 0
    (tmp_path / "again.h5.blocks").rename(tmp_path / BLOCKS)
    for arguments in ([], ["--shard", "1/2"]):
        again = sweep(tmp_path, *LINEAR, "--resume", *arguments)
        assert (again.code, again.out) == (0, "gears.h5\n")
        assert "complete already: 40 lanes, 0 diverged" in again.err
        assert names_in(tmp_path) == ["gears.h5", "gears.toml"]
    assert (tmp_path / "gears.h5").read_bytes() == before


def test_resuming_into_the_result_of_another_configuration_is_refused_with_the_key(tmp_path):
    assert sweep(tmp_path, *LINEAR, "--quiet").code == 0
    before = (tmp_path / "gears.h5").read_bytes()
    other = sweep(tmp_path, *LINEAR, "--resume", "--set", "groups.damping_ratio=0.06")
    assert other.code == 4
    assert "which differs in groups.damping_ratio (0.05, now 0.06); go back" in other.err
    assert (tmp_path / "gears.h5").read_bytes() == before
