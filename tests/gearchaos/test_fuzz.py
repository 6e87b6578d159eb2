"""Hundreds of bad inputs cause a message and code 2 or 4, no traceback, hang or lost file."""

from collections import Counter
from pathlib import Path

import h5py
import pytest

from .fuzz_cases import (
    WORDINGS,
    Case,
    Watch,
    configuration_cases,
    forged_cases,
    lacking_cases,
    result_cases,
)
from .fuzz_results import LANES, damaged_result, good_result

DRAWN = ("words of a later version", "forty nested fractions", "an axis to 1.7e308", "long texts")
"""Forgeries that affect the drawing of figures."""


@pytest.fixture(scope="module")
def endings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fuzz")
    with Watch(folder) as watch:
        return [*_some_cases(folder, watch)]


def _some_cases(folder: Path, watch: Watch):
    yield from watch.run(configuration_cases(range(100_000, 100_072), folder))
    yield from watch.run(result_cases(range(100_000, 100_099), folder))
    readers = "info --verify", "plot --stages --output stages.png --dpi 50 --overwrite"
    forged = forged_cases(folder, readers)
    yield from watch.run(case for case in forged if case.command == "info" or case.kind in DRAWN)


@pytest.mark.slow
def test_bad_input_ends_in_a_message_and_code_2_or_4(endings):
    assert [(case[:3], ending.fault) for case, ending in endings if ending.fault] == []


@pytest.mark.slow
def test_most_of_the_bad_input_is_noticed(endings):
    codes = Counter((case.command, ending.code) for case, ending in endings)
    assert codes["load_config", 2] > 18
    assert codes["info", 4] > 25
    assert codes["plot", 4] > 10


@pytest.mark.slow
def test_more_than_half_of_the_configurations_are_computed(endings):
    codes = Counter((case.command, ending.code) for case, ending in endings)
    commands = ("load_config", "run", "sweep")
    computed = sum(codes[command, code] for command in commands[1:] for code in (0, 3))
    assert computed > sum(case.command in commands for case, _ in endings) / 2


@pytest.mark.slow
def test_whatever_a_result_lacks_ends_in_a_sentence(tmp_path):
    with Watch(tmp_path) as watch:
        endings = [*watch.run(lacking_cases(tmp_path))]
    assert [(case[:3], ending.fault) for case, ending in endings if ending.fault] == []
    said = {(case.kind, case.command): ending for case, ending in endings}
    for part, command, words in (
        ("/ configuration", "response", "in its attribute configuration; run the sweep again"),
        ("/ configuration_resolved", "response", "in its attribute configuration_resolved"),
        ("motion flag_meanings", "info", "motion without a meaning in its attribute flag_meanings"),
        ("motion flag_meanings", "stages", "run the sweep again"),
        ("state ", "plot", "lacks the variable state"),
    ):
        assert said[part, command].code == 4, part
        assert words in said[part, command].said, part
    assert said["/ title", "response"].code == 0
    # If a missing wording were an error, the first one would hide the others. A missing origin is
    # an error, but only one of the datasets here has an origin.
    codes = {key: said[f"every {key}", "plot"].code for key in WORDINGS}
    assert codes == {**dict.fromkeys(WORDINGS, 0), "origin": 4}


def test_a_case_is_made_again_by_its_number(tmp_path):
    good_result(tmp_path / "good.h5")
    good = (tmp_path / "good.h5").read_bytes()
    for number in range(4):
        contents = []
        for name in ("one.h5", "other.h5"):
            damaged_result(number, good, tmp_path / name)
            contents.append((tmp_path / name).read_bytes())
        assert contents[0] == contents[1]


def external_link(file):
    file["status"] = h5py.ExternalLink("good.h5", "/status")


def external_storage(file):
    file.create_dataset("status", (LANES,), "u1", external=[("elsewhere.bin", 0, LANES)])


def virtual_dataset(file):
    layout = h5py.VirtualLayout((LANES,), "u1")
    layout[...] = h5py.VirtualSource("good.h5", "status", (LANES,))
    file.create_virtual_dataset("status", layout)


@pytest.mark.parametrize("elsewhere", [external_link, external_storage, virtual_dataset])
def test_numbers_kept_in_another_file_are_not_fetched(elsewhere, tmp_path):
    # The other file has valid numbers: a reader that fetched them would accept the result.
    good_result(tmp_path / "good.h5")
    (tmp_path / "elsewhere.bin").write_bytes(bytes(LANES))
    path = tmp_path / "pointing.h5"
    path.write_bytes((tmp_path / "good.h5").read_bytes())
    with h5py.File(path, "r+") as file:
        notes = dict(file["status"].attrs)
        del file["status"]
        elsewhere(file)
        if elsewhere is not external_link:
            for name in ("dims", "flag_meanings"):
                file["status"].attrs[name] = notes[name]
    with Watch(tmp_path) as watch:
        cases = [Case("", 0, command, [str(path)], path) for command in ("info", "plot", "stages")]
        for _, ending in watch.run(cases):
            assert (ending.code, ending.fault) == (4, "")
            assert "status" in ending.said
