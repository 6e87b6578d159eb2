"""Stages are shaded behind the lanes of a diagram and named in a legend."""

from itertools import combinations

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure

from gearchaos.errors import FileError
from gearchaos.figures.panel import mark_values
from gearchaos.figures.stages import HATCHES, SHADES, shade_stages
from gearchaos.outputs.variable import coordinate
from gearchaos.records.label import MOTION_MEANINGS
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import labelled_lanes

from .listed_variables import sweep_variables

KINDS = {str(n): (0, n) for n in (1, 2, 3, 5)}
KINDS |= {letter: (kind, 0) for kind, letter in enumerate("qcudg", 1)}


def result_of(labels: str, *, labelled: bool = True) -> Result:
    """Return a sweep over 0, 1, 2, ...; each letter is the label of a lane."""
    variables = sweep_variables(
        [coordinate("load", "1", "static load", "", np.arange(float(len(labels))))],
        states=["delta_5", "delta_5_rate"],
        section=[],
        section_points=0,
        lyapunov=False,
        status_meanings=["ok", "diverged"],
        motion_meanings=MOTION_MEANINGS if labelled else (),
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
    shades = shade_stages(axes, result_of(labels), **options)
    assert axes.get_xlim() == limits
    spans = [(shade.get_x(), shade.get_width()) for shade in shades]
    colours = [to_hex(shade.get_facecolor()).upper() for shade in shades]
    return figure, spans, colours


def named_by(figure) -> list[str]:
    (legend,) = figure.legends
    return [text.get_text() for text in legend.get_texts()]


def test_shades_meet_halfway_between_lanes_and_fill_the_axis():
    _, spans, colours = shaded("112cc", (-0.5, 4.5))
    assert spans == [(-0.5, 2.0), (1.5, 1.0), (2.5, 2.0)]
    assert colours == [SHADES[kind] for kind in ("period 1", "period 2", "chaotic")]


def test_only_what_the_axis_shows_is_shaded_and_named():
    figure, spans, _ = shaded("11112222cccc", (5.0, 9.0))
    assert spans == [(5.0, 2.5), (7.5, 1.5)]
    assert named_by(figure) == ["period 2", "chaotic"]
    figure.draw_without_rendering()


def test_every_label_has_a_shade_of_its_own():
    letters = "1235bqcmudg"
    known = letters.replace("b", "q").replace("m", "q")
    labelled = labelled_lanes(result_of(known))
    named = np.where(np.array([*letters]) == "b", "two bands", labelled.labels)
    named = np.where(np.array([*letters]) == "m", "several motions", named)
    lanes = labelled._replace(labels=named)
    figure, _, colours = shaded(known, (0.0, 10.0), lanes=lanes)
    assert colours == list(SHADES.values())
    assert len({*colours}) == len(SHADES)
    assert named_by(figure) == list(SHADES)


def test_what_is_too_narrow_to_be_seen_is_left_out():
    labels = "1" * 150 + "c" + "1" * 150
    assert len(shaded(labels, (0.0, 300.0))[1]) == 1
    assert len(shaded(labels, (145.0, 155.0))[1]) == 3
    assert not shaded(labels, (0.0, 300.0), legend=False)[0].legends


@pytest.mark.parametrize(("labels", "kind"), [("1c11", "period 1"), ("1c1c1", "several motions")])
def test_a_stage_that_hides_too_many_others_says_so(labels, kind):
    """Three of four lanes make a stage; three of five lanes make a stage of several motions."""
    figure, _, _ = shaded(labels, (0.0, 600.0))
    assert named_by(figure) == [kind]


# Machado, Oliveira, Fernandes 2009, severity 1: linear RGB of normal vision, and of vision without
# the cones for long, middle and short waves.
COLOUR_BLIND = np.fromstring(
    """
    1 0 0  0 1 0  0 0 1
    0.152286 1.052583 -0.204868  0.114503 0.786281 0.099216  -0.003882 -0.048116 1.051998
    0.367322 0.860646 -0.227968  0.280085 0.672501 0.047413  -0.011820 0.042940 0.968881
    1.255528 -0.076749 -0.178779  -0.078411 0.930809 0.147602  0.004733 0.691367 0.303900
    """,
    sep=" ",
).reshape(4, 3, 3)


def lab(colour: str, seen_through: np.ndarray) -> np.ndarray:
    """Return CIE L*a*b* of a colour, with the white point D65."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    x, y, z = np.cbrt(to_xyz @ np.clip(seen_through @ linear, 0.0, 1.0) / [0.9505, 1.0, 1.089])
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


def test_shades_without_the_same_hatching_are_distinguished_in_grey_and_by_the_colour_blind():
    """A difference of 2.3 is just visible side by side, three times as much across a page."""
    hatches = [HATCHES.get(kind) for kind in SHADES]
    assert len({*hatches}) == len(HATCHES) + 1
    plain = [colour for kind, colour in SHADES.items() if kind not in HATCHES]
    for one, other in combinations(plain, 2):
        for eyes in COLOUR_BLIND:
            assert np.linalg.norm(lab(one, eyes) - lab(other, eyes)) > 3 * 2.3
        grey = [lab(colour, COLOUR_BLIND[0])[0] for colour in (one, other)]
        assert abs(grey[0] - grey[1]) > 2.3
    assert min(lab(colour, COLOUR_BLIND[0])[0] for colour in SHADES.values()) > 60.0


def test_a_result_without_labels_cannot_be_shaded():
    with pytest.raises(FileError, match=r"outputs\.motion = true"):
        shade_stages(Figure().subplots(), result_of("11", labelled=False))


def test_values_of_somebody_else_are_ticked_and_named():
    """Marks lie at the values of a paper, at the upper edge; the legend keeps its entries."""
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
