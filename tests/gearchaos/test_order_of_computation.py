"""Lanes that share flow maps are computed next to each other."""

import numpy as np
import pytest

import gearchaos
from gearchaos.engine.lanes import Lanes

from .commands import run_module, same_data
from .short_sweeps import PAN2021, SHORT

FREQUENCIES = "parameter='mesh_frequency',values=[0.8,0.85,0.9]"
ERRORS = "parameter='pitch_error',from=3.0,to=12.0,count=5"
MAPS = (*SHORT[:4], "integration.method='flow_map'", "integration.steps_per_period=24")
MIXED = (*MAPS, f"sweep={{{FREQUENCIES}}}", f"second_sweep={{{ERRORS}}}")
SORTED = (*MAPS, f"sweep={{{ERRORS}}}", f"second_sweep={{{FREQUENCIES}}}")


def lanes(*overrides):
    return Lanes(gearchaos.load_config(PAN2021, overrides))


def test_lanes_of_one_frequency_are_neighbours_whatever_the_order_of_the_axes():
    for overrides in (MIXED, SORTED):
        sweep = lanes(*overrides)
        places = sweep.computed_at(np.arange(15))
        assert sorted(places) == list(range(15))
        frequency = sweep.values_of(places)["mesh_frequency"]
        np.testing.assert_array_equal(frequency, np.repeat([0.8, 0.85, 0.9], 5))
    assert lanes(*MIXED).reordered and not lanes(*SORTED).reordered


def test_starts_of_one_frequency_are_neighbours_too():
    sweep = lanes(*MIXED, "start={kind='random',count=4}")
    places = sweep.computed_at(np.arange(60))
    frequency = sweep.values_of(places)["mesh_frequency"]
    np.testing.assert_array_equal(frequency, np.repeat([0.8, 0.85, 0.9], 20))


@pytest.mark.parametrize("overrides", [(*MIXED, "integration.method='rk4'"), (*MAPS,)])
def test_the_order_of_the_list_is_kept_where_nothing_is_gained(overrides):
    sweep = lanes(*overrides)
    assert not sweep.reordered
    every = np.arange(len(sweep))
    np.testing.assert_array_equal(sweep.computed_at(every), every)


def test_results_do_not_depend_on_the_order_of_the_axes():
    mixed, ordered = (gearchaos.run(gearchaos.load_config(PAN2021, one)) for one in (MIXED, SORTED))
    for name in ("section_delta_5", "lyapunov_exponent", "motion"):
        np.testing.assert_array_equal(mixed[name], np.swapaxes(ordered[name], 0, 1))


def test_files_and_shards_have_the_order_of_the_list(tmp_path):
    overrides = [f"--set={one}" for one in MIXED]
    expected = gearchaos.run(gearchaos.load_config(PAN2021, MIXED))
    run_module("gearchaos.sweep", str(PAN2021), *overrides, "-o", "whole.h5", cwd=tmp_path)
    for shard in ("2/2", "1/2"):
        given = *overrides, "-o", "shards.h5", f"--shard={shard}"
        run_module("gearchaos.sweep", str(PAN2021), *given, cwd=tmp_path)
    run_module("gearchaos.merge", "shards.h5", cwd=tmp_path)
    for name in ("whole.h5", "shards.h5"):
        assert same_data(gearchaos.open_result(tmp_path / name), expected)
