"""Transient chaos is distinguished from lasting chaos by longer integration."""

import json

import pytest

import gearchaos
from gearchaos.engine.recomputing import Survival
from gearchaos.records.label import CHAOTIC

from .commands import run_module
from .short_sweeps import PAN2021

LASTING = 13.4
FADING = (14.82, 14.87, 14.9)
"""Values at which chaos lasts about a thousand periods: within 6000 it settles on period 1."""

SHORT = (
    "integration.transient_periods=100",
    "integration.recorded_periods=200",
    "outputs.section_points=100",
)


def saved(folder, values):
    result = gearchaos.run(
        gearchaos.load_config(
            PAN2021, [f"sweep={{parameter='pitch_error', values={[*values]}}}", *SHORT]
        )
    )
    result.save(folder / "chaos.h5")
    return int((result["motion"] == CHAOTIC).sum())


def stages(folder, *arguments: str):
    return run_module("gearchaos.stages", "chaos.h5", "--quiet", *arguments, cwd=folder)


def test_the_share_of_chaotic_lanes_that_outlast_many_records_is_reported(tmp_path):
    chaotic = saved(tmp_path, [LASTING, *FADING])
    assert chaotic > 1
    told = json.loads(stages(tmp_path, "--survival", "30", "--json").out)["survival"]
    assert told == {"records": 30, "lanes": chaotic, "outlasting": 1}


def test_the_share_is_worded_in_one_line():
    assert Survival(10, 25, 22).text == "chaotic: 22 of 25 lanes that were tried outlast 10 records"


def test_without_chaos_there_is_nothing_to_outlast(tmp_path):
    assert saved(tmp_path, [5.86]) == 0
    assert "chaotic: 0 of 0 lanes that were tried" in stages(tmp_path, "--survival", "2").out
    assert json.loads(stages(tmp_path, "--json").out)["survival"] is None


@pytest.mark.parametrize("records", ["0", "1.5", "-1", "x", "1e9"])
def test_a_number_of_records_that_is_none_is_refused(tmp_path, records):
    ended = stages(tmp_path, "--survival", records)
    assert (ended.code, ended.out) == (2, "")
    assert "--survival" in ended.err
