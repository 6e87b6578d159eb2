"""Shares of gear pairs with the same motion: counts, confidence intervals and figures."""

import csv
import json
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from gearchaos.errors import ConfigurationError, FileError
from gearchaos.figures import shares, shares_page
from gearchaos.models.gear_pair.outputs import CATALOGUE
from gearchaos.outputs.variable import coordinate
from gearchaos.plot import main
from gearchaos.records.label import MOTION_MEANINGS
from gearchaos.records.wilson import wilson_interval
from gearchaos.results.reading.ensembles import motion_shares
from gearchaos.results.reading.result import Result
from gearchaos.shares import main as shares_main

from .listed_variables import sweep_variables

INTERVAL = "not period 1, 95 % confidence"
PAIRS, STARTS, TEETH_MEET = 10, 2, 798
PERIODIC, QUASI_PERIODIC, CHAOTIC, UNRESOLVED, DIVERGED, _ = range(len(MOTION_MEANINGS))


def known_motions(
    grades: Sequence[float] = (5.0, 8.0, 9.0),
    *,
    starts: int = STARTS,
    pairs: int = PAIRS,
    second: int = 1,
    labelled: bool = True,
    contact: bool = True,
) -> Result:
    """Return a result whose pairs lose contact, double their period and become chaotic in turn.

    At value number n, counted from 0, n pairs are chaotic and 2 n pairs lose contact. From the
    second value on, one pair has each of the periods 2, 3, 4 and 5. At the last value, one pair
    diverges.
    """
    values = np.asarray(grades)
    axes = [coordinate("pitch_error_grade", "1", "accuracy grade of both gears", "", values)]
    if second > 1:
        axes.insert(0, coordinate("load", "1", "load", "$f_n$", np.arange(1.0, 1.0 + second)))
    axes += [CATALOGUE.axis("realisation", np.arange(pairs))] if pairs > 1 else []
    axes += [CATALOGUE.axis("start", np.arange(starts))] if starts > 1 else []
    variables = sweep_variables(
        axes,
        states=("delta_5", "delta_5_rate"),
        section=(),
        section_points=0,
        lyapunov=False,
        crossings=contact,
        status_meanings=("ok", "diverged"),
        motion_meanings=MOTION_MEANINGS if labelled else (),
        excitation_period=TEETH_MEET,
    )
    motion = np.full((values.size, pairs), PERIODIC)
    period = np.ones((values.size, pairs), dtype=int)
    crossings = np.zeros((values.size, pairs))
    for number in range(values.size):
        motion[number, :number] = CHAOTIC
        period[number, :number] = 0
        crossings[number, : 2 * number] = 0.5
        if number > 0:
            period[number, -4:] = (2, 3, 4, 5)
    motion[-1, -5], period[-1, -5], crossings[-1, -5] = DIVERGED, 0, np.nan
    shape = tuple(axis.values.size for axis in axes)

    def spread(rows: np.ndarray) -> np.ndarray:
        every = np.repeat(rows[np.newaxis, :, :, np.newaxis], starts, axis=3)
        return np.broadcast_to(every, (second, values.size, pairs, starts)).reshape(shape).copy()

    nothing = np.zeros((*shape, 2))
    data = {
        "motion": spread(motion),
        "period": spread(period),
        "return_distance": spread(0.0 * crossings),
        "bands": spread(0 * period),
        "crossings_per_period": spread(crossings),
        "slowest_crossing": spread(crossings),
        "unsplit_steps": spread(0 * period),
        "status": spread(motion == DIVERGED),
        "diverged_period": spread(np.where(motion == DIVERGED, 3, -1)),
        "start_state": nothing,
        "end_state": nothing,
    }
    facts = {"title": "known", "excitation_period": TEETH_MEET}
    return Result([axis.name for axis in axes], variables, data, {}, facts)


def test_motions_of_all_pairs_and_starts_are_counted_by_value():
    counted = motion_shares(known_motions())
    assert counted.motions == (
        *("period 1", "period 2", "period 3", "period 4 or more"),
        *("chaotic", "diverged"),
    )
    lanes = np.array([[10, 0, 0, 0, 0, 0], [5, 1, 1, 2, 1, 0], [3, 1, 1, 2, 2, 1]])
    np.testing.assert_array_equal(counted.values, [5.0, 8.0, 9.0])
    np.testing.assert_array_equal(counted.counts, STARTS * lanes)
    np.testing.assert_array_equal(counted.other.counts, STARTS * np.array([0, 5, 7]))
    np.testing.assert_array_equal(counted.other.shares, [0.0, 0.5, 0.7])
    np.testing.assert_array_equal(counted.other.intervals, wilson_interval([0, 10, 14], 20))


def test_a_lane_that_diverged_reports_nothing_of_contact():
    counted = motion_shares(known_motions())
    np.testing.assert_array_equal(counted.apart.counts, STARTS * np.array([0, 2, 4]))
    np.testing.assert_array_equal(counted.apart.lanes, STARTS * np.array([10, 10, 9]))
    assert motion_shares(known_motions(contact=False)).apart is None


def test_contact_is_that_of_the_teeth_where_it_was_recorded():
    result = known_motions()
    crossings = result.variables["crossings_per_period"]
    shape = result["crossings_per_period"].shape
    free, axial = np.zeros(shape), np.ones(shape)
    # Lanes that stay between the flanks have no crossings.
    free[0] = 1.0
    times = {"time_apart_tangential": free, "time_apart_axial": axial}
    variables = [*result.variables.values(), *(replace(crossings, name=name) for name in times)]
    data = {name: result[name] for name in result} | times
    counted = motion_shares(Result(result.axes, variables, data, {}, {}))
    np.testing.assert_array_equal(counted.apart.shares, [1.0, 0.0, 0.0])


@pytest.mark.parametrize("kept", [{"starts": 1}, {"pairs": 10, "starts": 3}])
def test_pairs_alone_count_as_pairs_with_starts(kept):
    np.testing.assert_array_equal(
        motion_shares(known_motions(**kept)).other.shares,
        motion_shares(known_motions()).other.shares,
    )


@pytest.mark.parametrize(
    ("made", "fault", "message"),
    [
        ({"labelled": False}, FileError, r"outputs\.motion = true"),
        (
            {"second": 2},
            ConfigurationError,
            "the axes load, pitch_error_grade, realisation, start; fix others",
        ),
        ({"starts": 1, "pairs": 1}, ConfigurationError, r"set pitch_error\.realisations or start"),
    ],
)
def test_what_cannot_be_counted_is_reported(made, fault, message):
    result = (
        known_motions(**made)
        if made.get("pairs") != 1
        else known_motions().sel(realisation=0, start=0)
    )
    with pytest.raises(fault, match=message):
        motion_shares(result)
    with pytest.raises(fault, match=message):
        shares_page(result)


@pytest.fixture
def axes():
    figure = Figure()
    FigureCanvasAgg(figure)
    return figure.add_subplot()


def drawn_by_name(axes: Axes, result: Result) -> dict[str, Artist]:
    return {one.get_label(): one for one in shares(axes, result)}


def test_bars_stand_on_each_other_and_the_interval_on_the_edge_of_period_1(axes):
    drawn = drawn_by_name(axes, known_motions())
    assert [*drawn] == [
        *("period 1", "period 2", "period 3", "period 4 or more", "chaotic", "diverged"),
        INTERVAL,
    ]
    chaotic, regular = drawn["chaotic"], drawn["period 1"]
    np.testing.assert_allclose([bar.get_y() for bar in chaotic], [0.0, 0.0, 0.1])
    np.testing.assert_allclose([bar.get_height() for bar in chaotic], [0.0, 0.1, 0.2])
    np.testing.assert_allclose([bar.get_y() for bar in regular], [0.0, 0.5, 0.7])
    np.testing.assert_allclose([bar.get_y() + bar.get_height() for bar in regular], 1.0)
    assert {round(bar.get_width(), 9) for bar in chaotic} == {0.8}
    (bars,) = drawn[INTERVAL].lines[2]
    ends = np.array(bars.get_segments())
    np.testing.assert_allclose(ends[:, :, 1], wilson_interval([0, 10, 14], 20))
    np.testing.assert_array_equal(ends[:, 0, 0], [5.0, 8.0, 9.0])


def test_many_values_are_steps_with_a_band(axes):
    result = known_motions(np.linspace(0.1, 4.0, 40), pairs=100, starts=1)
    drawn = drawn_by_name(axes, result)
    counted = motion_shares(result)
    top, edges, base = drawn["period 1"].get_data()
    np.testing.assert_allclose(top, 1.0)
    np.testing.assert_allclose(base, counted.other.shares)
    np.testing.assert_allclose(edges, np.linspace(0.05, 4.05, 41))
    corners = drawn[INTERVAL].get_paths()[0].vertices
    assert {*np.round(counted.other.intervals.ravel(), 9)} <= {*np.round(corners[:, 1], 9)}


@pytest.mark.parametrize(("width", "contact"), [(85.0, True), (180.0, False)])
def test_the_page_has_the_share_that_leaves_period_1_and_that_loses_contact(width, contact):
    result = known_motions(contact=contact)
    page = shares_page(result, width_mm=width)
    assert [axes.get_ylabel() for axes in page.axes] == [
        "Share of motions",
        "Share, with 95 %\nconfidence",
    ]
    counted = motion_shares(result)
    expected = [counted.other, *([counted.apart] if contact else [])]
    drawn = page.axes[1].containers
    assert len(drawn) == len(expected)
    for container, one in zip(drawn, expected, strict=True):
        np.testing.assert_allclose(container.lines[0].get_ydata(), one.shares)
        (bars,) = container.lines[2]
        np.testing.assert_allclose(np.array(bars.get_segments())[:, :, 1], one.intervals)
    assert not page.axes[0].lines
    assert page.axes[-1].get_xlabel() == "Accuracy grade of both gears"
    assert page.axes[0].get_title("right") == "10 gear pairs with 2 starts each"
    (legend,) = page.legends
    assert legend.get_title().get_text() == (
        "periods are those of the excitation, 798 mesh periods each"
    )
    assert [text.get_text() for text in legend.get_texts()] == [
        *("period 1", "period 2", "period 3", "period 4 or more", "chaotic", "diverged"),
        *("leaves period 1", "loses contact")[: len(expected)],
    ]
    written = [text for text in page.findobj(Text) if text.get_text()]
    assert min(text.get_fontsize() for text in written) >= 7.0
    drawn, inches = page.get_tightbbox(), page.get_size_inches()
    assert min(drawn.x0, drawn.y0) >= 0.0
    assert (drawn.x1 <= inches[0], drawn.y1 <= inches[1]) == (True, True)


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "grades.h5"
    known_motions(second=2).save(path)
    return path


def test_the_command_draws_a_slice(path, capsys):
    asked = ["--shares", "--at", "load=2", "--to", "8", "--format", "png", "--dpi", "50"]
    assert main([str(path), *asked]) == 0
    out, err = capsys.readouterr()
    assert out == f"{path.parent}/grades_load_2_to_8_shares.png\n"
    assert err == (
        "gearchaos plot: 60 lanes over pitch_error_grade at load = 2, 2 of them diverged, "
        "85 mm x 90 mm at 50 dpi\n"
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "the axes load, pitch_error_grade, realisation, start"),
        (["--at", "load=1", "--stages"], "here is a figure of shares; leave it out"),
        (
            ["--at", "load=1", "--variable", "section_delta_5"],
            "here is a figure of shares; leave it out",
        ),
        (["--at", "load=1", "--from", "10"], "the result has 5 to 9"),
    ],
)
def test_what_the_command_cannot_draw_is_a_usage_error(path, arguments, message, capsys):
    assert main([str(path), "--shares", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert [file.name for file in path.parent.iterdir()] == ["grades.h5"]


def test_two_results_have_no_common_shares(path, capsys):
    assert main([str(path), str(path), "--shares"]) == 2
    assert "and here is a figure of shares" in capsys.readouterr().err


def printed(path, capsys, *arguments: str) -> str:
    assert shares_main([str(path), *arguments]) == 0
    return capsys.readouterr().out


def test_the_command_prints_shares_with_their_intervals(tmp_path, capsys):
    path = tmp_path / "grades.h5"
    result = known_motions()
    result.save(path)
    counted = motion_shares(result)
    lines = printed(path, capsys).splitlines()
    assert lines[0] == "shares over pitch_error_grade"
    # All twenty lanes at the first value have period 1 and keep contact.
    cells = re.split(r"\s\s+", lines[-3].strip())
    assert cells == ["5", "20", *["100.0% (83.9% to 100.0%)"] * 2]
    facts = json.loads(printed(path, capsys, "--json"))
    table = [*csv.DictReader(printed(path, capsys, "--csv").splitlines())]
    assert facts["unit"] == "1" and len(facts["values"]) == len(table) == 3
    for at, (one, row) in enumerate(zip(facts["values"], table, strict=True)):
        assert float(row["pitch_error_grade [1]"]) == one["value"] == counted.values[at]
        assert one["not_period_1"]["share"] == counted.other.shares[at]
        assert one["loses_contact"]["share_95_percent"] == counted.apart.intervals[at].tolist()
        assert float(row["period 1 [1]"]) == pytest.approx(1.0 - counted.other.shares[at])
        kept = 1.0 - counted.apart.intervals[at, ::-1]
        bounds = [float(row[f"keeps contact, 95 % {end} [1]"]) for end in ("from", "to")]
        assert bounds == pytest.approx(kept.tolist())
        assert sum(one["lanes_by_motion"].values()) == PAIRS * STARTS
    assert shares_main([str(path), "--json", "--csv"]) == 2
    assert "--json and --csv: print one of the two" in capsys.readouterr().err


def test_the_command_words_what_has_no_shares(tmp_path, capsys):
    known_motions().sel(realisation=0, start=0).save(tmp_path / "single.h5")
    assert shares_main([str(tmp_path / "single.h5")]) == 2
    assert "set pitch_error.realisations or start.count" in capsys.readouterr().err
