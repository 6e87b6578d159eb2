"""Stages are shaded behind a diagram where its lanes lie, and named in a legend."""

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from gearchaos.errors import FileError
from gearchaos.figures.panel import mark_values
from gearchaos.figures.stages import SHADES, shade_stages
from gearchaos.records.label import MEANINGS
from gearchaos.results.result import Result
from gearchaos.results.stage_table import labelled_lanes
from gearchaos.results.variables import Axis, sweep_variables

KINDS = {str(n): (0, n) for n in (1, 2, 3, 5)}
KINDS |= {letter: (kind, 0) for kind, letter in enumerate("qcudg", 1)}


def result_of(labels: str, *, labelled: bool = True) -> Result:
    """A sweep over 0, 1, 2, ... whose lanes have labels of one letter."""
    variables = sweep_variables(
        [Axis("load", "1", "static load", "", np.arange(float(len(labels))))],
        states=["delta_5", "delta_5_rate"],
        section=[],
        section_points=0,
        lyapunov=False,
        status_meanings=["ok", "diverged"],
        motion_meanings=MEANINGS if labelled else (),
    )
    lanes = len(labels)
    data = {
        "motion": [KINDS[letter][0] for letter in labels],
        "period": [KINDS[letter][1] for letter in labels],
        "return_distance": np.zeros(lanes),
        "bands": np.zeros(lanes),
        "status": np.zeros(lanes),
        "diverged_period": np.full(lanes, -1),
        "start_state": np.zeros((lanes, 2)),
        "end_state": np.zeros((lanes, 2)),
    }
    return Result(["load"], variables, data, {}, {})


def shaded(labels: str, limits: tuple[float, float], **options):
    figure = Figure(layout="constrained")
    axes = figure.subplots()
    axes.set_xlim(limits)
    artists = shade_stages(axes, result_of(labels), **options)
    assert axes.get_xlim() == limits
    spans = [(shade.get_x(), shade.get_width()) for shade in artists.shades]
    colours = [to_hex(shade.get_facecolor()).upper() for shade in artists.shades]
    return figure, artists, spans, colours


def test_shades_meet_halfway_between_lanes_and_fill_the_axis():
    _, _, spans, colours = shaded("112cc", (-0.5, 4.5))
    assert spans == [(-0.5, 2.0), (1.5, 1.0), (2.5, 2.0)]
    assert colours == [SHADES[kind] for kind in ("period 1", "period 2", "chaotic")]


def test_only_what_the_axis_shows_is_shaded_and_named():
    figure, artists, spans, _ = shaded("11112222cccc", (5.0, 9.0))
    assert spans == [(5.0, 2.5), (7.5, 1.5)]
    assert [text.get_text() for text in artists.legend.get_texts()] == ["period 2", "chaotic"]
    figure.draw_without_rendering()


def test_every_label_has_a_shade_of_its_own():
    letters = "1235bqcudg"
    labelled = labelled_lanes(result_of(letters.replace("b", "q")))
    named = np.where(np.array([*letters]) == "b", "two bands", labelled.labels)
    lanes = labelled._replace(labels=named)
    _, artists, _, colours = shaded(
        letters.replace("b", "q"), (0.0, 9.0), narrowest=0.0, lanes=lanes
    )
    assert colours == list(SHADES.values())
    assert len({*colours}) == len(SHADES)
    assert [text.get_text() for text in artists.legend.get_texts()] == list(SHADES)


def test_what_is_too_narrow_to_be_seen_is_left_out():
    labels = "1" * 150 + "c" + "1" * 150
    assert len(shaded(labels, (0.0, 300.0))[1].shades) == 1
    assert len(shaded(labels, (145.0, 155.0))[1].shades) == 3
    assert shaded(labels, (0.0, 300.0), legend=False)[1].legend is None


def test_a_result_without_labels_cannot_be_shaded():
    with pytest.raises(FileError, match=r"outputs\.motion = true"):
        shade_stages(Figure().subplots(), result_of("11", labelled=False))


def test_values_of_somebody_else_are_ticked_and_named():
    """Marks of a paper stand at its values at the upper edge, and the legend keeps its entries."""
    figure = Figure(layout="constrained")
    panels = figure.subplots(2)
    for axes in panels:
        axes.set(xlim=(0.0, 10.0), ylim=(-1.0, 2.0))
    panels[0].plot([1.0], [1.0], label="before")
    panels[0].legend()
    mark_values(panels, "changes elsewhere", [1.12, 7.5])
    for axes in panels:
        assert axes.lines[-1].get_xdata().tolist() == [1.12, 7.5]
        assert axes.get_xlim() == (0.0, 10.0) and axes.get_ylim() == (-1.0, 2.0)
        height = axes.lines[-1].get_transform().transform((0.0, 1.0))[1]
        assert height == pytest.approx(axes.bbox.y1)
    names = [text.get_text() for text in panels[0].get_legend().get_texts()]
    assert names == ["changes elsewhere", "before"]
