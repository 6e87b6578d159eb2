import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from gearchaos.figures.page import letter, page
from gearchaos.figures.style import style
from gearchaos.figures.ticks import FineTicks


def picture(how) -> np.ndarray:
    with mpl.rc_context(style()):
        figure = Figure(figsize=(3.0, 2.0), dpi=100)
        canvas = FigureCanvasAgg(figure)
        axes = figure.subplots()
        axes.plot([0.3, 12.1], [-2.0, 7.7])
        axes.tick_params(axis="y", which="minor", right=False)
        how(axes)
        canvas.draw()
        return np.array(canvas.buffer_rgba())


def test_fine_ticks_are_the_picture_of_those_of_matplotlib():
    def fine(axes):
        for axis in (axes.xaxis, axes.yaxis):
            axes.add_artist(FineTicks(axis))

    expected = picture(lambda _: None)
    assert np.array_equal(picture(fine), expected)
    assert not np.array_equal(picture(lambda axes: axes.minorticks_off()), expected)


@pytest.mark.parametrize(("scale", "power"), [(1.0, ""), (1e-5, "10^{\N{MINUS SIGN}5}")])
def test_numbers_at_ticks_are_text_and_letters_stand_above_their_power_of_ten(scale, power):
    with page(85.0, 60.0) as figure:
        axes = figure.subplots()
        axes.plot([0.0, 1.0], [-2.0 * scale, 3.0 * scale])
        letter([axes])
    figure.canvas.draw()
    offset = axes.yaxis.get_offset_text()
    assert power in offset.get_text() and bool(offset.get_text()) == bool(power)
    assert "\N{MINUS SIGN}2" in [label.get_text() for label in axes.get_yticklabels()]
    (title,) = [text for text in axes.get_children() if getattr(text, "_text", "") == "(a)"]
    boxes = [text.get_window_extent() for text in (title, offset)]
    assert not power or boxes[0].y0 >= boxes[1].y1 - 1.0


def test_titles_keep_the_distance_that_they_were_given():
    with page(85.0, 60.0) as figure:
        axes = figure.subplots()
        axes.set_title("far", loc="left", pad=20.0)
    figure.canvas.draw()
    (title,) = [text for text in axes.get_children() if getattr(text, "_text", "") == "far"]
    above = title.get_window_extent().y0 - axes.bbox.y1
    assert above == pytest.approx(20.0 / 72.0 * figure.dpi, abs=12.0)
