"""Finished blocks survive any end of a sweep, are verified, and are merged into one file."""

import errno
import json
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gearchaos.errors import FileError
from gearchaos.models.gear_pair.outputs import CATALOGUE
from gearchaos.outputs import catalogue
from gearchaos.outputs.listing import Details
from gearchaos.outputs.variable import Variable, coordinate
from gearchaos.results.files.block_folder import StoreLock, read_manifest, require_same
from gearchaos.results.files.block_store import BlockStore, OwnBlocks
from gearchaos.results.reading.result import Result, open_result
from gearchaos.version import Software

LANES = 100
POINTS = 7
CONFIGURATION = """\
title = "t"
[integration]
steps_per_period = 288
[sweep]
values = [1.0, 2.0]
"""


def of_a_sweep(axes: Sequence[Variable]) -> list[Variable]:
    parts = {
        catalogue.SECTION_POINTS_PART: True,
        catalogue.SECTION_PART: ["delta_5"],
        catalogue.LYAPUNOV_PART: True,
        catalogue.EVERY_SWEEP_PART: True,
    }
    values = {"section_point": np.arange(POINTS), "state": np.arange(2)}
    meanings = {"status": ["ok", "diverged"], "state": ["delta_5", "delta_5_rate"]}
    return CATALOGUE.variables(axes, parts, Details(values, meanings))


def variables(lanes: int = LANES) -> list[Variable]:
    values = np.arange(float(lanes))
    return of_a_sweep([coordinate("load", "1", "static load", "$f_n$", values)])


VARIABLES = variables()
SOFTWARE = Software("gearchaos 1.2.3", "0123456789abcdef")
DAMPING = Variable(
    "damping_ratio", (), "float64", "1", "damping", "$d$", values=0.1, origin="given"
)
PARAMETERS = {"damping_ratio": DAMPING}
BLOCKS = [(0, 30), (30, 60), (60, 90), (90, 100)]


def sweep(lanes: int = LANES) -> dict[str, np.ndarray]:
    sizes = {"section_point": POINTS, "state": 2}
    random = np.random.default_rng(4)
    numbers = {
        v.name: random.normal(size=(lanes, *(sizes[dim] for dim in v.dims[1:])))
        for v in VARIABLES
        if v.values is None
    }
    numbers["status"] = np.zeros(lanes, np.uint8)
    numbers["diverged_period"] = np.full(lanes, -1, np.int32)
    return numbers


DATA = sweep()


def block(first: int, last: int) -> dict[str, np.ndarray]:
    return {name: values[first:last] for name, values in DATA.items()}


def open_store(
    output: Path,
    *,
    resume: bool = False,
    configuration: str = CONFIGURATION,
    lanes: int = LANES,
    software: Software = SOFTWARE,
) -> BlockStore:
    return BlockStore(output, variables(lanes), configuration, software, resume=resume)


def fill(store: BlockStore, blocks: Sequence[tuple[int, int]] = BLOCKS) -> None:
    for first, last in blocks:
        store.write(first, last, block(first, last))


def assert_whole(path: Path) -> None:
    result = open_result(path)
    for name, values in DATA.items():
        np.testing.assert_array_equal(result[name], values)
    assert result.variables["state"].flags == ("delta_5", "delta_5_rate")


@pytest.fixture
def output(tmp_path: Path) -> Path:
    return tmp_path / "sweep.h5"


def test_blocks_in_any_order_become_the_file_of_the_whole_sweep(output: Path) -> None:
    with open_store(output) as store:
        fill(store, BLOCKS[::-1])
        assert not output.exists()
        assert store.merge(VARIABLES, PARAMETERS, {"title": "t"}) == output
    assert list(output.parent.iterdir()) == [output]
    whole = output.with_name("whole.h5")
    Result(["load"], VARIABLES, DATA, PARAMETERS, {"title": "t"}).save(whole)
    merged, saved = open_result(output), open_result(whole)
    assert merged.metadata == saved.metadata
    assert list(merged) == list(saved)
    for name in saved:
        np.testing.assert_array_equal(merged[name], saved[name], strict=True)


def test_a_later_run_goes_on_from_what_is_finished(output: Path) -> None:
    with open_store(output) as store:
        fill(store, BLOCKS[:1] + BLOCKS[2:3])
    with open_store(output, resume=True) as store:
        bounds, problems = store.finished()
        assert (bounds, problems) == ([(0, 30), (60, 90)], [])
        missing = store.missing(bounds, block=20)
        assert missing == [(30, 50), (50, 60), (90, 100)]
        np.testing.assert_array_equal(store.read(0, 30)["end_state"], DATA["end_state"][:30])
        fill(store, missing)
        store.merge(VARIABLES, PARAMETERS, {})
    assert_whole(output)


def test_resuming_what_was_never_begun_begins_it(output: Path) -> None:
    with open_store(output, resume=True) as store:
        assert store.finished() == ([], [])
        assert store.missing([], block=60) == [(0, 60), (60, 100)]


def test_a_sweep_that_finished_no_block_leaves_no_folder(output: Path) -> None:
    with open_store(output):
        pass
    assert not list(output.parent.iterdir())


def test_files_of_the_user_in_the_folder_stay(output: Path) -> None:
    folder = output.with_name("sweep.h5.blocks")
    folder.mkdir()
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    with open_store(output) as store:
        fill(store)
        store.merge(VARIABLES, PARAMETERS, {})
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]


def test_finished_blocks_are_not_thrown_away_without_a_message(output: Path) -> None:
    with open_store(output) as store:
        fill(store)
    with pytest.raises(FileError, match=r"holds 4 finished blocks .* --resume, or delete"):
        open_store(output)
    with open_store(output, resume=True) as store:
        assert store.finished().bounds == BLOCKS


def test_a_store_of_another_configuration_is_refused_with_the_keys(output: Path) -> None:
    with open_store(output) as store:
        fill(store)
    other = CONFIGURATION.replace("288", "400").replace('title = "t"', "seed = 1")
    with pytest.raises(FileError) as caught:
        open_store(output, resume=True, configuration=other)
    (message,) = caught.value.problems
    assert "title (t, now absent)" in message
    assert "integration.steps_per_period (288, now 400)" in message
    assert "seed (absent, now 1)" in message
    assert "sweep.values" not in message
    with pytest.raises(FileError, match="differs in lanes"):
        open_store(output, resume=True, lanes=LANES + 1)
    with open_store(output, resume=True) as store:
        assert store.finished().bounds == BLOCKS


def test_a_store_of_another_gearchaos_is_refused_with_both_values(output: Path) -> None:
    with open_store(output) as store:
        fill(store)
    newer = SOFTWARE._replace(software="gearchaos 2.0.0")
    other = newer._replace(kernels="fedcba9876543210")
    for software, resume, configuration, words in (
        (
            newer,
            True,
            CONFIGURATION,
            r"differs in software \(gearchaos 1\.2\.3, now \S+ 2\.0\.0\); go",
        ),
        (
            other,
            False,
            CONFIGURATION,
            r"kernels \(0123456789abcdef, now fedcba9876543210\); go back",
        ),
        (newer, True, "title = 't'", r"2\.0\.0\), integration\.steps_per_period \(288, now absent"),
    ):
        with pytest.raises(
            FileError, match=f"blocks of another gearchaos or configuration, .*{words}"
        ):
            open_store(output, software=software, resume=resume, configuration=configuration)
    with open_store(output, resume=True) as store:
        assert store.finished().bounds == BLOCKS


def test_types_and_nans_are_distinguished_where_they_matter() -> None:
    earlier, now = ({"configuration": f"a = nan\nb = {b}"} for b in ("1", "1.0"))
    require_same("this", earlier, earlier)
    with pytest.raises(FileError, match=r"differs in b \(1, now 1\.0\); go back"):
        require_same("this", earlier, now)


@pytest.mark.parametrize(
    "content",
    ["", "{", "[]", '{"schema_version": "3.0", "configuration": 3}', "[" * 100_000],
)
def test_a_damaged_manifest_is_named(content: str, output: Path) -> None:
    with open_store(output) as store:
        fill(store)
    manifest = output.with_name("sweep.h5.blocks") / "manifest.json"
    manifest.write_text(content, encoding="utf-8")
    with pytest.raises(FileError, match=r"manifest.json: is damaged or missing"):
        open_store(output, resume=True)
    assert len(list(manifest.parent.glob("*.block"))) == len(BLOCKS)


def test_blocks_of_a_newer_format_are_refused_in_a_clear_sentence(output: Path) -> None:
    with open_store(output) as store:
        fill(store)
    manifest = output.with_name("sweep.h5.blocks") / "manifest.json"
    newer = manifest.read_text(encoding="utf-8").replace('"5.0"', '"6.0"')
    manifest.write_text(newer, encoding="utf-8")
    with pytest.raises(FileError, match=r"differs in schema_version \(6\.0, now 5\.0\); go back"):
        open_store(output, resume=True)


def test_bad_blocks_are_named_and_left_out(output: Path, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    another = tmp_path / "other" / "sweep.h5"
    with open_store(another, configuration="title = 'other'") as store:
        fill(store)
    with open_store(output) as store:
        fill(store)
    names = [f"{first:012d}-{last:012d}.block" for first, last in BLOCKS]
    folder = output.with_name("sweep.h5.blocks")
    flipped = bytearray((folder / names[0]).read_bytes())
    flipped[-5] ^= 4
    (folder / names[0]).write_bytes(flipped)
    (folder / names[1]).write_bytes((folder / names[1]).read_bytes()[:-1])
    os.replace(another.with_name("sweep.h5.blocks") / names[2], folder / names[2])
    (folder / f"{95:012d}-{105:012d}.block").write_bytes(b"")
    (folder / f"{91:012d}-{92:012d}.block").write_bytes(b"x" * 1000)
    with open_store(output, resume=True) as store:
        bounds, problems = store.finished()
        assert bounds == [(90, 100)]
        reasons = ["checksum", "bytes", "another sweep", "overlaps", "overlaps"]
        assert len(problems) == len(reasons)
        for problem, word in zip(problems, reasons, strict=True):
            assert problem.startswith(str(folder))
            assert word in problem
        with pytest.raises(FileError, match="lanes 0 to 89 are missing") as caught:
            store.merge(VARIABLES, PARAMETERS, {})
        assert len(caught.value.problems) == len(reasons) + 1
        fill(store, store.missing(bounds, block=30))
        store.merge(VARIABLES, PARAMETERS, {})
    assert_whole(output)


@pytest.mark.parametrize("position", [0, 20, 100, 200, 250, 300, 1000])
def test_any_changed_byte_of_a_block_is_noticed(position: int, output: Path) -> None:
    with open_store(output) as store:
        fill(store)
        (path, *_) = sorted(store.folder.glob("*.block"))
        content = bytearray(path.read_bytes())
        content[position] ^= 0x20
        path.write_bytes(content)
        assert store.finished().bounds == BLOCKS[1:]


def test_a_second_sweep_on_the_same_output_is_refused_at_once(output: Path) -> None:
    link = output.with_name("link.h5")
    link.symlink_to(output)
    with open_store(output) as store:
        for path in (output, link):
            with pytest.raises(FileError, match="another sweep is writing to it"):
                open_store(path, resume=True)
        fill(store)
        store.merge(VARIABLES, PARAMETERS, {})
    assert_whole(output)


PROGRAM = """
import sys
sys.path.insert(0, sys.argv[2])
from pathlib import Path
from test_block_store import BLOCKS, PARAMETERS, VARIABLES, FileError, fill, open_store
output = Path(sys.argv[1])
"""


def start(program: str, output: Path, limit: int | None = None) -> subprocess.Popen[str]:
    def restrict() -> None:
        if limit is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    here = str(Path(__file__).parent)
    command = [sys.executable, "-c", PROGRAM + program, str(output), here]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True, preexec_fn=restrict)


def test_a_killed_sweep_neither_blocks_nor_loses_anything(output: Path) -> None:
    program = (
        "store = open_store(output); fill(store, BLOCKS[:2]); print('go', flush=True); input()"
    )
    with start(program, output) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "go\n"
        with pytest.raises(FileError, match="another sweep"):
            open_store(output, resume=True)
        process.kill()
    partial = output.with_name("sweep.h5.blocks") / ".sweep.h5.0.partial"
    partial.write_bytes(b"half a file")
    with open_store(output, resume=True) as store:
        assert not partial.exists()
        bounds, problems = store.finished()
        assert (bounds, problems) == (BLOCKS[:2], [])
        fill(store, store.missing(bounds, block=50))
        store.merge(VARIABLES, PARAMETERS, {})
    assert_whole(output)


def test_a_full_disk_keeps_what_is_finished(output: Path) -> None:
    program = """
with open_store(output) as store:
    try:
        fill(store)
        store.merge(VARIABLES, PARAMETERS, {})
    except FileError as error:
        print(error)
"""
    with start(program, output, limit=4000) as process:
        text, _ = process.communicate()
    assert os.strerror(errno.EFBIG) in text
    assert not output.exists()
    output.write_bytes(b"earlier")
    with open_store(output, resume=True) as store:
        fill(store, store.missing(store.finished().bounds, block=30))
        with pytest.raises(FileError, match="exists already"):
            store.merge(VARIABLES, PARAMETERS, {})
        assert output.read_bytes() == b"earlier"
        assert store.finished().bounds == BLOCKS
        store.merge(VARIABLES, PARAMETERS, {}, overwrite=True)
    assert_whole(output)


def test_a_merge_on_a_full_disk_can_be_repeated(output: Path) -> None:
    with open_store(output) as store:
        fill(store)
    program = """
with open_store(output, resume=True) as store:
    try:
        store.merge(VARIABLES, PARAMETERS, {})
    except FileError as error:
        print(error)
"""
    with start(program, output, limit=8000) as process:
        text, _ = process.communicate()
    assert f"{output}: cannot be written: {os.strerror(errno.EFBIG)}" in text
    assert process.returncode == 0
    assert not output.exists()
    with open_store(output, resume=True) as store:
        store.merge(VARIABLES, PARAMETERS, {})
    assert_whole(output)


def test_a_folder_that_vanishes_is_reported(output: Path) -> None:
    with open_store(output) as store:
        fill(store, BLOCKS[:1])
        for path in store.folder.iterdir():
            path.unlink()
        store.folder.rmdir()
        with pytest.raises(FileError, match="No such file or directory"):
            fill(store, BLOCKS[1:])


def test_an_output_whose_folder_cannot_be_made_is_reported(tmp_path: Path) -> None:
    for output in (tmp_path / "missing" / "sweep.h5", Path("/proc/sweep.h5")):
        with pytest.raises(FileError, match=r"\.blocks: cannot be written: No such file"):
            open_store(output)


def test_arrays_of_another_shape_are_refused(output: Path) -> None:
    with open_store(output) as store, pytest.raises(ValueError, match="of lanes 0 to 29"):
        store.write(0, 30, block(0, 29))


@pytest.mark.slow
def test_merging_takes_the_memory_of_a_block(output: Path) -> None:
    program = """
import numpy as np
from test_block_store import CONFIGURATION, POINTS, SOFTWARE
from gearchaos.results.files.block_store import BlockStore
from gearchaos.models.gear_pair.outputs import CATALOGUE
from gearchaos.outputs import catalogue
from gearchaos.outputs.listing import Details
from gearchaos.outputs.variable import coordinate
points, size, count = 500, 250, 80
every, section = catalogue.EVERY_SWEEP_PART, catalogue.SECTION_PART
values = {"section_point": np.arange(points), "state": np.arange(1)}
variables = CATALOGUE.variables(
    [coordinate("load", "1", "load", "", np.arange(float(size * count)))],
    {catalogue.SECTION_POINTS_PART: True, section: ["delta_5"], every: True},
    Details(values, {"status": ["ok"], "state": ["delta_5"]}),
)
random = np.random.default_rng(0)
one = {
    "section_delta_5": random.integers(0, 9, (size, points)), "status": np.zeros(size),
    "diverged_period": np.zeros(size), "start_state": np.zeros((size, 1)),
    "end_state": np.zeros((size, 1)),
}
memory = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
import resource
with BlockStore(output, variables, CONFIGURATION, SOFTWARE) as store:
    for number in range(count):
        store.write(number * size, (number + 1) * size, one)
    before = memory()
    store.merge(variables, {}, {})
print(memory() - before)
"""
    with start(program, output) as process:
        text, _ = process.communicate()
    numbers = 80 * 250 * 500 * 8
    assert int(text) * 1024 < numbers / 4


HALVES = [[(0, 30), (60, 90)], [(30, 60), (90, 100)]]
OWN = OwnBlocks(HALVES[0], 2)


def open_shard(output: Path, number: int, **options: Any) -> BlockStore:
    return BlockStore(
        output, VARIABLES, CONFIGURATION, SOFTWARE, own=OwnBlocks(HALVES[number], 2), resume=True,
        **options,
    )  # fmt: skip


def test_shards_share_the_folder_and_a_whole_sweep_does_not(output: Path) -> None:
    with (
        open_shard(output, 0) as one,
        open_shard(output, 1) as other,
        open_shard(output, 0) as same,
    ):
        fill(one, HALVES[0])
        assert (one.own_lanes, other.own_lanes) == (60, 40)
        assert read_manifest(one.folder)["shards"] == 2
        assert other.finished() == ([], [])
        # A second process with the same work writes the same bits.
        before = sorted((path.name, path.read_bytes()) for path in one.folder.glob("*.block"))
        fill(same, HALVES[0])
        assert before == sorted((p.name, p.read_bytes()) for p in one.folder.glob("*.block"))
        with pytest.raises(FileError, match="another sweep is writing to it"):
            open_store(output, resume=True)
        fill(other, HALVES[1])
    with open_store(output, resume=True) as store:
        with pytest.raises(FileError, match="another sweep is writing to it"):
            open_shard(output, 0)
        assert read_manifest(store.folder)["shards"] == 2
        store.merge(VARIABLES, PARAMETERS, {})
    assert_whole(output)
    assert list(output.parent.iterdir()) == [output]


def test_a_refused_shard_leaves_nothing_behind(output: Path) -> None:
    def names() -> list[str]:
        return sorted(path.name for path in output.with_name("sweep.h5.blocks").iterdir())

    with open_store(output) as store:
        before = names()
        with pytest.raises(FileError, match="another sweep is writing to it"):
            open_shard(output, 1)
        fill(store, BLOCKS[:1])
        assert names() == sorted([*before, "000000000000-000000000030.block"])
    (output.with_name("sweep.h5.blocks") / "lock").unlink()
    before = names()
    for options in ({"configuration": "title = 'other'"}, {"resume": False}):
        given = {"configuration": CONFIGURATION, "resume": True, **options}
        with pytest.raises(FileError):
            BlockStore(output, VARIABLES, software=SOFTWARE, **given, own=OWN)
        assert names() == before


def test_the_folder_is_its_owners_alone(output: Path) -> None:
    with open_store(output) as store:
        assert store.folder.stat().st_mode & 0o777 == 0o700


def test_links_in_the_folder_are_not_followed(output: Path, tmp_path: Path) -> None:
    victim = tmp_path / "victim"
    victim.write_text("precious", encoding="utf-8")
    with open_store(output) as store:
        (store.folder / "000000000000-000000000030.block").symlink_to(victim)
        bounds, (problem,) = store.finished()
        assert bounds == []
        assert "000000000000-000000000030.block: cannot be read: " in problem
        fill(store)
        assert victim.read_text(encoding="utf-8") == "precious"
        manifest = store.folder / "manifest.json"
        victim.write_bytes(manifest.read_bytes())
        manifest.unlink()
        manifest.symlink_to(victim)
    with pytest.raises(FileError, match=r"manifest\.json: is damaged or missing"):
        open_store(output, resume=True)


def test_a_folder_that_is_a_link_or_of_another_user_is_refused(output: Path) -> None:
    folder, elsewhere = output.with_name("sweep.h5.blocks"), output.with_name("elsewhere")
    folder.symlink_to(elsewhere)
    for make in (lambda: None, elsewhere.mkdir):
        make()
        with pytest.raises(FileError, match=r"blocks: is a link or not your folder"):
            open_store(output)
    assert list(elsewhere.iterdir()) == []
    folder.unlink()
    folder.mkdir()
    try:
        os.chown(folder, 12_345, -1)
    except PermissionError:
        pytest.skip("only root can change the owner of a folder")
    with pytest.raises(FileError, match=r"blocks: is a link or not your folder"):
        open_store(output)
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("name", ["lock", "manifest.json"])
@pytest.mark.parametrize("kind", ["pipe", "link"])
def test_a_shard_refuses_what_is_no_file_and_leaves_it(name: str, kind: str, output: Path) -> None:
    path = output.with_name("sweep.h5.blocks") / name
    path.parent.mkdir()
    if kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to("nowhere")
    with pytest.raises(FileError, match=r"regular file; delete it|symbolic links|is damaged or"):
        open_shard(output, 0)
    assert list(path.parent.iterdir()) == [path]
    assert not path.is_file()


@pytest.mark.parametrize("target", ["nowhere/lock", "victim"])
def test_a_link_in_the_place_of_the_lock_is_refused(target: str, output: Path) -> None:
    folder = output.with_name("sweep.h5.blocks")
    folder.mkdir()
    (folder / "lock").symlink_to(output.parent / target)
    with pytest.raises(FileError, match="cannot be written: Too many levels of symbolic links"):
        StoreLock(folder, output)
    assert not (output.parent / target).exists()


def test_what_is_no_file_in_the_place_of_a_block_is_not_waited_for(output: Path) -> None:
    with open_store(output) as store:
        os.mkfifo(store.folder / "000000000000-000000000030.block")
        (store.folder / "000000000030-000000000060.block").mkdir()
        bounds, problems = store.finished()
        assert bounds == []
        assert ["has not the" in problem for problem in problems] == [True, False]


def test_several_axes_become_one_file_from_blocks_that_cut_them(output: Path) -> None:
    axes = [
        coordinate("load", "1", "load", "", np.arange(4.0)),
        coordinate("pitch_error", "1", "pitch error", "", np.arange(5.0)),
        CATALOGUE.axis("start", np.arange(5)),
    ]
    several = of_a_sweep(axes)
    with BlockStore(output, several, CONFIGURATION, SOFTWARE) as store:
        assert store.lanes == LANES
        fill(store)
        store.merge(several, PARAMETERS, {})
    result = open_result(output)
    assert result["status"].shape == (4, 5, 5)
    for name, values in DATA.items():
        np.testing.assert_array_equal(result.lanes(name), values)


def test_what_was_merged_leaves_the_next_sweep_alone(output: Path) -> None:
    with open_store(output) as store:
        fill(store)
        store.merge(VARIABLES, PARAMETERS, {})
        following = open_store(output)
    with following:
        assert following.folder.is_dir()
        with pytest.raises(FileError, match="another sweep is writing to it"):
            open_store(output)
        fill(following)
    with open_store(output, resume=True) as store:
        assert store.finished().bounds == BLOCKS


def test_of_a_file_that_differs_only_the_beginning_is_shown() -> None:
    files = ("tooth,Fp\n" + f"0,{n}\n" * 100 for n in range(2))
    earlier, now = ({"configuration": f"[files]\ngear = {json.dumps(text)}"} for text in files)
    with pytest.raises(FileError) as raised:
        require_same("this", earlier, now)
    assert r"files.gear ('tooth,Fp\n0,0\n" in str(raised.value)
    assert len(str(raised.value)) < 400
    assert "\n" not in str(raised.value)
