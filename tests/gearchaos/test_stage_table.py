"""Stages are runs of equal labels; narrow stages are merged into their neighbours."""

from heapq import heappop
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gearchaos.errors import ConfigurationError, FileError
from gearchaos.results.reading import stage_table as table_module
from gearchaos.results.reading.overview import slice_lines
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import (
    LabelledLanes,
    Stage,
    label_text,
    labelled_lanes,
    one_axis,
    slice_facts,
    stage_table,
)
from gearchaos.stages import band_lines

from .test_result_axes import AXES, ERRORS, LOADS, result_over


def lanes(labels: str, values: list[float] | None = None) -> LabelledLanes:
    """Return lanes with labels of one letter: a digit is a period, c is chaotic."""
    words = [label_text("chaotic", int(letter) if letter.isdigit() else 0) for letter in labels]
    return LabelledLanes(
        np.arange(float(len(labels))) if values is None else np.array(values),
        np.array(words),
        np.array([int(letter) if letter.isdigit() else 0 for letter in labels], dtype=np.int32),
        np.arange(float(len(labels))) - 3.0,
        np.zeros(len(labels), dtype=np.int32),
    )


def shown(stages: list[Stage]) -> list[tuple[str, float, float]]:
    return [(stage.label, stage.start, stage.end) for stage in stages]


def test_equal_neighbours_form_a_stage():
    stages = stage_table(lanes("111ccc22"))
    assert shown(stages) == [
        ("period 1", 0.0, 2.0),
        ("chaotic", 3.0, 5.0),
        ("period 2", 6.0, 7.0),
    ]
    assert [stage.lanes for stage in stages] == [3, 3, 2]
    assert [stage.period for stage in stages] == [1, 0, 2]
    assert (stages[1].lowest_exponent, stages[1].highest_exponent) == (0.0, 2.0)


@pytest.mark.parametrize(
    ("bands", "text"),
    [
        ({12: 1}, "the only chaotic lane is on 12 bands"),
        ({2: 3}, "all 3 chaotic lanes on 2 bands"),
        ({1: 4, 2: 3}, "of 7 chaotic lanes 3 on 2 bands"),
        ({1: 4}, None),
    ],
)
def test_bands_are_counted_in_a_sentence(bands, text):
    stage = Stage(0, 1, 2.0, 3.0, "chaotic", 0, 0.1, 0.2, sum(bands.values()), bands)
    assert [*band_lines([stage])] == ([f"2 to 3: {text}"] if text else [])


def test_one_lane_is_one_stage():
    (stage,) = stage_table(lanes("3"), narrowest=5.0)
    assert (stage.label, stage.lanes, stage.start, stage.end) == ("period 3", 1, 0.0, 0.0)


def test_a_window_goes_into_the_chaos_on_both_sides():
    (before, chaos) = stage_table(lanes("1111ccc3ccc6cccc"), narrowest=1.5)
    assert shown([before, chaos]) == [("period 1", 0.0, 3.0), ("chaotic", 4.0, 15.0)]
    # The windows, with the exponents 4 and 8, do not count as exponents of the chaos.
    assert chaos.lowest_exponent == 1.0
    assert chaos.lanes == 12


def test_a_stage_between_two_others_goes_into_the_wider_one():
    assert shown(stage_table(lanes("111122cc"), narrowest=2.0)) == [
        ("period 1", 0.0, 3.0),
        ("period 2", 4.0, 7.0),
    ]
    assert shown(stage_table(lanes("11112cccc"), narrowest=1.5))[0][2] == 4.0


def test_a_cascade_of_narrow_stages_ends_where_it_belongs():
    stages = stage_table(lanes("1111111122224888cccccc3c6ccccc"), narrowest=6.5)
    assert [stage.label for stage in stages] == ["period 1", "chaotic"]
    assert sum(stage.lanes for stage in stages) == 30


def test_the_width_is_that_of_the_axis_and_reaches_halfway_to_the_neighbours():
    values = [0.0, 1.0, 10.0, 11.0, 12.0]
    uneven = lanes("11c22", values)
    # The chaotic stage extends from 5.5 to 10.5.
    assert len(stage_table(uneven, narrowest=4.9)) == 2
    assert [s.label for s in stage_table(uneven, narrowest=1.6)] == ["period 1", "chaotic"]


def test_an_unknown_exponent_is_not_a_number():
    silent = lanes("11cc")._replace(exponent=np.array([np.nan, -1.0, np.nan, np.nan]))
    one, chaos = stage_table(silent)
    assert (one.lowest_exponent, one.highest_exponent) == (-1.0, -1.0)
    assert np.isnan([chaos.lowest_exponent, chaos.highest_exponent]).all()


@pytest.mark.parametrize(
    ("meaning", "period", "text"),
    [("periodic", 12, "period 12"), ("quasi_periodic", 0, "quasi-periodic"), ("diverged", 0, None)],
)
def test_labels_are_worded(meaning, period, text):
    assert label_text(meaning, period) == (text or meaning)


def slow_twin(lanes: LabelledLanes, narrowest: float) -> list[list[int]]:
    """Return the first lane, the lane after the last and the lane with the label of each stage.

    The rule is applied step by step.
    """
    changes = np.flatnonzero(lanes.labels[1:] != lanes.labels[:-1]) + 1
    edges = [0, *changes.tolist(), lanes.values.size]
    parts = [[a, b, a] for a, b in pairwise(edges)]
    middles = (lanes.values[1:] + lanes.values[:-1]) / 2.0
    borders = np.concatenate([lanes.values[:1], middles, lanes.values[-1:]])

    def width(part: list[int]) -> float:
        return float(borders[part[1]] - borders[part[0]])

    while len(parts) > 1:
        at = min(range(len(parts)), key=lambda number: width(parts[number]))
        if width(parts[at]) >= narrowest:
            break
        beside = parts[max(at - 1, 0) : at] + parts[at + 1 : at + 2]
        label = lanes.labels[max(beside, key=width)[2]]
        merged = [part for part in beside if lanes.labels[part[2]] == label] + [parts[at]]
        whole = [
            min(part[0] for part in merged),
            max(part[1] for part in merged),
            merged[0][2],
        ]
        here = parts.index(min(merged))
        parts[here : here + len(merged)] = [whole]
    return parts


@given(
    st.text("12c", min_size=1, max_size=40),
    st.lists(st.integers(1, 4), min_size=40, max_size=40),
    st.sampled_from([0.0, 0.6, 1.0, 1.5, 2.5, 4.0, 9.0, 1e9]),
)
def test_the_stages_are_those_of_the_rule_taken_step_by_step(labels, steps, narrowest):
    some = lanes(labels, np.cumsum(steps[: len(labels)]).astype(float).tolist())
    told = [(stage.first, stage.last + 1, stage.label) for stage in stage_table(some, narrowest)]
    assert told == [
        (first, after, some.labels[own]) for first, after, own in slow_twin(some, narrowest)
    ]


@pytest.mark.parametrize("narrowest", [0.0, 1.5, 40.0, 1e9])
def test_each_lane_is_looked_at_a_few_times_however_many_stages_alternate(narrowest, monkeypatch):
    looked_at = 0

    class Counting(np.ndarray):
        def __getitem__(self, key):
            nonlocal looked_at
            part = super().__getitem__(key)
            looked_at += np.size(part)
            return part

    pops = 0

    def counting_pop(heap):
        nonlocal pops
        pops += 1
        return heappop(heap)

    monkeypatch.setattr(table_module, "heappop", counting_pop)
    some = lanes("1c" * 10_000)
    stages = stage_table(some._replace(labels=some.labels.view(Counting)), narrowest)
    assert sum(stage.lanes for stage in stages) == 20_000
    assert looked_at <= 5 * 20_000
    # Each merger removes at least one run and puts one back.
    assert pops <= 2 * 20_000


def test_stages_lie_along_one_axis_only():
    result = result_over(AXES["two parameters, several starts"])
    with pytest.raises(ConfigurationError, match=r"r\.h5: has 3 axes \(load, pitch_error, start\)"):
        labelled_lanes(result, name="r.h5")
    part = one_axis(result, load=0.31)
    taken = labelled_lanes(part)
    np.testing.assert_array_equal(taken.values, ERRORS.values)
    np.testing.assert_array_equal(taken.period, result["period"][1, :, 0])
    facts = slice_facts(result, part)
    assert facts == {
        "load": LOADS.values[1],
        "start": 0.0,
    }
    assert slice_lines(facts) == [
        "slice load = 0.3; others with --at load=VALUE",
        "slice start = 0; others with --at start=VALUE",
    ]


def test_the_other_parameter_can_be_listed_but_not_starts():
    result = result_over(AXES["two parameters, several starts"])
    assert one_axis(result, pitch_error=1.0, start=1.0).axes == ("load",)
    for fixed in ({"load": 0.1, "pitch_error": 0.0}, {"load": 0.1, "pitch_error": 0.0, "start": 0}):
        with pytest.raises(ConfigurationError, match="no swept parameter is left"):
            one_axis(result, **fixed)


def test_exponents_and_lanes_are_those_of_all_starts():
    one = lanes("111")
    exponents = one.exponent[:, np.newaxis] + np.array([0.0, 0.25, -0.5])
    several = one._replace(repeats=(exponents, np.zeros((3, 3), dtype=np.int32)))
    (stage,) = stage_table(several)
    assert stage.lanes == 9
    assert (stage.lowest_exponent, stage.highest_exponent) == (-3.5, -0.75)


def test_a_result_without_labels_has_no_stages():
    full = result_over(AXES["one start"])
    variables = [variable for name, variable in full.variables.items() if name != "motion"]
    result = Result(full.axes, variables, {name: full[name] for name in full}, {}, {})
    with pytest.raises(FileError, match="holds no labels of the motion"):
        labelled_lanes(result)
