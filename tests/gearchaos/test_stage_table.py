"""Stages are the stretches of equal labels; narrow ones go into what surrounds them."""

import numpy as np
import pytest

from gearchaos.results.stage_table import LabelledLanes, Stage, label_text, stage_table


def lanes(labels: str, values: list[float] | None = None) -> LabelledLanes:
    """Lanes with labels of one letter: a digit is a period, c is chaotic."""
    words = [label_text("chaotic", int(letter) if letter.isdigit() else 0) for letter in labels]
    return LabelledLanes(
        np.arange(float(len(labels))) if values is None else np.array(values),
        np.array(words),
        np.array([int(letter) if letter.isdigit() else 0 for letter in labels], dtype=np.int32),
        np.arange(float(len(labels))) - 3.0,
    )


def shown(stages: list[Stage]) -> list[tuple[str, float, float, int]]:
    return [(stage.label, stage.start, stage.end, stage.narrower) for stage in stages]


def test_equal_neighbours_form_a_stage():
    stages = stage_table(lanes("111ccc22"))
    assert shown(stages) == [
        ("period 1", 0.0, 2.0, 0),
        ("chaotic", 3.0, 5.0, 0),
        ("period 2", 6.0, 7.0, 0),
    ]
    assert [stage.lanes for stage in stages] == [3, 3, 2]
    assert [stage.period for stage in stages] == [1, 0, 2]
    assert (stages[1].lowest_exponent, stages[1].highest_exponent) == (0.0, 2.0)


def test_one_lane_is_one_stage():
    (stage,) = stage_table(lanes("3"), narrowest=5.0)
    assert (stage.label, stage.lanes, stage.start, stage.end) == ("period 3", 1, 0.0, 0.0)


def test_a_window_goes_into_the_chaos_on_both_sides_and_is_counted():
    (before, chaos) = stage_table(lanes("1111ccc3ccc6cccc"), narrowest=1.5)
    assert shown([before, chaos]) == [("period 1", 0.0, 3.0, 0), ("chaotic", 4.0, 15.0, 2)]
    # The windows at 4 and 8 lanes after the first do not count as exponents of the chaos.
    assert chaos.lowest_exponent == 1.0
    assert chaos.lanes == 12


def test_a_stage_between_two_others_goes_into_the_wider_one():
    assert shown(stage_table(lanes("111122cc"), narrowest=2.0)) == [
        ("period 1", 0.0, 3.0, 0),
        ("period 2", 4.0, 7.0, 1),
    ]
    assert shown(stage_table(lanes("11112cccc"), narrowest=1.5))[0][2] == 4.0


def test_a_cascade_of_narrow_stages_ends_where_it_belongs():
    stages = stage_table(lanes("1111111122224888cccccc3c6ccccc"), narrowest=6.5)
    assert [stage.label for stage in stages] == ["period 1", "chaotic"]
    assert sum(stage.narrower for stage in stages) == 5
    assert sum(stage.lanes for stage in stages) == 30


def test_the_width_is_that_of_the_axis_and_reaches_halfway_to_the_neighbours():
    values = [0.0, 1.0, 10.0, 11.0, 12.0]
    uneven = lanes("11c22", values)
    # From 5.5 to 10.5.
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
