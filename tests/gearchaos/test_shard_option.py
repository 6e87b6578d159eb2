"""Several jobs share a sweep: each job computes its shard of the blocks of one output."""

import numpy as np
import pytest

import gearchaos
from gearchaos.engine.store_filling import Shard, shared_blocks
from gearchaos.errors import ConfigurationError
from gearchaos.results.files.block_folder import StoreLock, folder_of

from .commands import LINEAR, names_in, run_module, same_data, sweep
from .short_sweeps import METHODS

BLOCKS = "gears.h5.blocks"
# Four blocks of lanes.
LANES = (*LINEAR, "--set", "sweep.count=1000")
COUNT = (*LANES, "--quiet")


@pytest.mark.parametrize("lanes", [1, 255, 256, 1000, 123_456, 1_000_000])
@pytest.mark.parametrize("shards", [1, 2, 7, 1000])
def test_the_shards_cover_a_sweep_once_and_evenly(lanes, shards):
    blocks = [Shard(number, shards).blocks(lanes) for number in range(1, shards + 1)]
    together = sorted(bounds for own in blocks for bounds in own)
    assert together == shared_blocks(lanes, shards)
    edges = [0, *(last for _, last in together)]
    assert [first for first, _ in together] == edges[:-1]
    assert edges[-1] == lanes
    assert max(np.diff(edges)) <= 4096
    sizes = [sum(last - first for first, last in own) for own in blocks]
    assert max(sizes) - min(sizes) <= max(np.diff(edges))


def test_a_million_lanes_are_few_files():
    assert len(shared_blocks(1_000_000, 1)) == 245


@pytest.mark.parametrize("text", ["0/4", "5/4", "4", "1/0", "-1/4", "1/4/2", "one/4", "", "٣/٤"])
def test_what_is_no_shard_is_refused(text):
    with pytest.raises(ConfigurationError, match="must be i/N with i from 1 to N"):
        Shard.from_text(text)


@pytest.mark.parametrize("method", METHODS)
def test_shards_computed_with_other_threads_join_to_the_undisturbed_result(tmp_path, method):
    asked = (*COUNT, "--set", f"integration.method={method}")
    for number, threads in ((2, "2"), (3, "1"), (1, "1")):
        shard = f"{number}/3"
        ended = sweep(tmp_path, *asked, "--shard", shard, "--threads", threads)
        if ended.code == 2:
            pytest.skip("the machine has a single core")
        assert ended == (0, f"{tmp_path / BLOCKS}\n", "")
        assert names_in(tmp_path) == [BLOCKS, "gears.toml"]
    assert run_module("gearchaos.merge", "gears.h5", "-q", cwd=tmp_path) == (0, "gears.h5\n", "")
    assert names_in(tmp_path) == ["gears.h5", "gears.toml"]
    assert sweep(tmp_path, *asked, "--output", "one.h5").code == 0
    one, joined = (gearchaos.open_result(tmp_path / name) for name in ("one.h5", "gears.h5"))
    assert same_data(joined, one)
    assert list(joined) == list(one)
    differing = {k for k in one.metadata if joined.metadata.get(k) != one.metadata[k]}
    assert differing <= {"created", "threads", "wall_time_seconds"}


def test_a_shard_says_what_is_next_and_is_not_computed_twice(tmp_path):
    told = (*LANES, "--shard", "2/2")
    first = sweep(tmp_path, *told)
    assert first.code == 0
    assert "488 lanes, 0 diverged" in first.err
    assert "this was shard 2/2; when all are computed, join them with: " in first.err
    assert first.err.endswith("-m gearchaos.merge gears.h5\n")
    refused = sweep(tmp_path, *told)
    assert refused.code == 4
    assert "holds 2 finished blocks of an earlier run; continue it with --resume" in refused.err
    block = max((tmp_path / BLOCKS).glob("*.block"))
    block.write_bytes(block.read_bytes()[:-1])
    again = sweep(tmp_path, *told, "--resume")
    assert again.code == 0
    assert f"{block.name}: has not the " in again.err
    assert "488 of 488 lanes" in again.err
    kept = sweep(tmp_path, *told, "--resume")
    assert kept.code == 0
    assert "lanes/s" not in kept.err  # No lanes were left to compute.
    # A sweep of all shards uses the finished blocks.
    assert sweep(tmp_path, *COUNT, "--resume") == (0, "gears.h5\n", "")
    assert names_in(tmp_path) == ["gears.h5", "gears.toml"]


def test_a_shard_without_lanes_says_so_and_the_others_join(tmp_path):
    few = ("--set", "sweep.count=4")
    empty = sweep(tmp_path, *few, "--shard", "2/2")
    assert empty.code == 0
    assert "shard 2/2 has no lanes: 4 lanes make 1 block, and a shard needs one" in empty.err
    assert "kernel" not in empty.err
    assert sweep(tmp_path, *few, "--shard", "1/2").code == 0
    assert run_module("gearchaos.merge", "gears.h5", cwd=tmp_path).code == 0


def test_shards_of_another_configuration_are_refused_with_the_key(tmp_path):
    assert sweep(tmp_path, *COUNT, "--shard", "1/2").code == 0
    other = sweep(tmp_path, *COUNT, "--shard", "2/2", "--set", "groups.damping_ratio=0.06")
    assert other.code == 4
    assert "which differs in groups.damping_ratio (0.05, now 0.06)" in other.err


def test_shards_may_run_at_once_the_same_one_too_the_whole_sweep_and_merge_may_not(tmp_path):
    output = tmp_path / "gears.h5"
    other = StoreLock(folder_of(output), output, shared=True)
    try:
        assert sweep(tmp_path, *COUNT, "--shard", "4/4").code == 0
        before = names_in(tmp_path / BLOCKS)
        assert sweep(tmp_path, *COUNT, "--shard", "4/4", "--resume").code == 0
        refused = sweep(tmp_path, *COUNT, "--resume")
        assert refused.code == 4
        assert "gears.h5: another sweep is writing to it; wait for its end" in refused.err
        merged = run_module("gearchaos.merge", "gears.h5", cwd=tmp_path)
        assert merged.code == 4
        assert "gears.h5: another sweep is writing to it" in merged.err
        assert names_in(tmp_path / BLOCKS) == before
    finally:
        other.release()


def test_a_shard_is_refused_while_a_whole_sweep_is_writing(tmp_path):
    output = tmp_path / "gears.h5"
    whole = StoreLock(folder_of(output), output)
    try:
        refused = sweep(tmp_path, *COUNT, "--shard", "1/4")
        assert refused.code == 4
        assert "gears.h5: another sweep is writing to it; wait for its end" in refused.err
    finally:
        whole.release()


def test_a_carried_sweep_cannot_be_shared(tmp_path):
    ended = sweep(tmp_path, "--shard", "1/2", "--set", "start.carry=upwards")
    assert (ended.code, ended.out) == (2, "")
    assert '--shard: with start.carry = "upwards"' in ended.err
    assert names_in(tmp_path) == ["gears.toml"]
