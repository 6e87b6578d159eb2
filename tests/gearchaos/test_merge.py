"""The merge command joins complete sweeps and names missing or damaged blocks."""

import json

import gearchaos

from .commands import DIVERGING, LINEAR, SMALL, names_in, run_module, same_data, sweep

BLOCKS = "gears.h5.blocks"
COUNT = (*LINEAR, "--set", "sweep.count=1000", "--quiet")


def shards(folder, *numbers, total=3, flags=COUNT):
    for number in numbers:
        assert sweep(folder, *flags, "--shard", f"{number}/{total}").code == 0


def merge(folder, *arguments):
    return run_module("gearchaos.merge", *arguments, cwd=folder)


def test_missing_and_damaged_blocks_are_named_with_the_shards_to_run(tmp_path):
    shards(tmp_path, 1, 2)
    before = names_in(tmp_path / BLOCKS)
    ended = merge(tmp_path, "gears.h5")
    assert (ended.code, ended.out) == (4, "")
    (line,) = ended.err.splitlines()
    assert "lanes 512 to 767 are missing; run the sweep with --shard 3/3 and --resume" in line
    assert names_in(tmp_path / BLOCKS) == before
    # The fourth block is the second of shard 1.
    damaged = max((tmp_path / BLOCKS).glob("*.block"))
    content = bytearray(damaged.read_bytes())
    content[-1] ^= 1
    damaged.write_bytes(content)
    ended = merge(tmp_path, "gears.h5")
    assert ended.code == 4
    assert f"{damaged.name}: is damaged or of another sweep; its checksum does not fit" in ended.err
    assert "lanes 512 to 999 are missing; run the sweep with --shard 1/3, --shard 3/3" in ended.err
    assert names_in(tmp_path) == [BLOCKS, "gears.toml"]


def test_the_result_carries_the_configuration_as_it_was_written(tmp_path):
    shards(tmp_path, 1, total=1)
    ended = merge(tmp_path, "gears.h5")
    assert (ended.code, ended.out) == (0, "gears.h5\n")
    assert ended.err == "gearchaos merge: 1000 lanes, 0 diverged\n"
    result = gearchaos.open_result(tmp_path / "gears.h5")
    assert result.metadata["configuration"] == SMALL
    assert "count = 1000" in result.metadata["configuration_resolved"]


def test_a_chosen_number_of_steps_is_chosen_again(tmp_path):
    flags = (
        "--set",
        "pitch_error.phase_deg=0.0",
        "--set",
        "integration.tolerance=1e-4",
        "--set",
        "groups.damping_ratio=0.3",
        "--quiet",
    )
    flags += ("--set", "integration.transient_periods=300", "--set", "outputs.section_points=10")
    shards(tmp_path, 1, total=1, flags=flags)
    assert merge(tmp_path, "gears.h5").code == 0
    assert sweep(tmp_path, *flags, "--output", "one.h5").code == 0
    one, joined = (gearchaos.open_result(tmp_path / name) for name in ("one.h5", "gears.h5"))
    assert same_data(one, joined)
    assert one.metadata["steps_per_period"] == joined.metadata["steps_per_period"]


def test_an_existing_file_is_kept_unless_it_may_be_replaced(tmp_path):
    shards(tmp_path, 1, total=1)
    (tmp_path / "gears.h5").write_bytes(b"precious")
    ended = merge(tmp_path, "gears.h5")
    assert ended.code == 4
    assert "gears.h5: exists already; replace it with --overwrite" in ended.err
    assert (tmp_path / "gears.h5").read_bytes() == b"precious"
    assert merge(tmp_path, "gears.h5", "--overwrite").code == 0
    # A job that is started again merges again.
    assert merge(tmp_path, "gears.h5", "--quiet") == (0, "gears.h5\n", "")


def test_diverged_lanes_make_the_exit_code_that_of_the_sweep(tmp_path):
    shards(tmp_path, 1, total=1, flags=(*LINEAR, *DIVERGING, "--quiet"))
    ended = merge(tmp_path, "gears.h5")
    assert (ended.code, ended.out) == (3, "gears.h5\n")
    assert "gearchaos merge: 40 of 40 lanes diverged, more than" in ended.err


def test_where_no_blocks_are_nothing_is_joined_and_nothing_made(tmp_path):
    ended = merge(tmp_path, "none.h5")
    assert (ended.code, ended.out) == (4, "")
    assert "none.h5.blocks: no such folder; name the result file to be" in ended.err
    assert names_in(tmp_path) == []


def test_a_damaged_manifest_is_named(tmp_path):
    (tmp_path / BLOCKS).mkdir()
    for content in ("{", "[]", '{"configuration": 3}', '{"configuration": "= 3", "text": ""}'):
        (tmp_path / BLOCKS / "manifest.json").write_text(content)
        ended = merge(tmp_path, "gears.h5")
        assert ended.code in (2, 4)
        assert BLOCKS in ended.err
        assert (tmp_path / BLOCKS / "manifest.json").read_text() == content


def test_a_manifest_that_declares_millions_of_lanes_is_refused_before_they_are_looked_at(tmp_path):
    shards(tmp_path, 1)
    path = tmp_path / BLOCKS / "manifest.json"
    manifest = json.loads(path.read_text())
    text = manifest["configuration"].replace("sweep.count = 1000", "sweep.count = 9999999")
    path.write_text(json.dumps({**manifest, "configuration": text}))
    ended = merge(tmp_path, "gears.h5")
    assert ended.code == 4
    assert "bytes for 9999999 lanes, so nearly all are missing; continue the sweep" in ended.err
