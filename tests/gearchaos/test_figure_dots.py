"""Very many points are counted instead of drawn one by one: the same picture in little memory."""

import tracemalloc

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from gearchaos.figures import bifurcation, lyapunov
from gearchaos.figures.lanes import COLUMNS, MOST_DOTS, DenseDots, ShownLanes, counts, dots
from gearchaos.outputs.variable import coordinate
from gearchaos.results.reading.result import Result

from .listed_variables import sweep_variables

RANDOM = np.random.default_rng(7)


def panel(dpi: int = 100):
    figure = Figure(figsize=(3.0, 2.0), dpi=dpi)
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.set(xlim=(0.1, 0.9), ylim=(0.2, 1.0))
    return axes


def lanes_of(count: int, diverged: tuple[int, ...] = ()) -> ShownLanes:
    out = np.zeros(count, bool)
    out[list(diverged)] = True
    # The order of the lanes of a result may differ from the order of the parameter.
    return ShownLanes(np.arange(count)[::-1], np.linspace(0.0, 1.0, count), out, (0.0, 1.0))


def picture(axes) -> np.ndarray:
    axes.figure.canvas.draw()
    return np.array(axes.figure.canvas.buffer_rgba())[..., :3].astype(int)


def wide_sweep(count: int, points: int, *, exponent=None) -> Result:
    """Return a sweep whose section is a line up to the middle and a filled band beyond it."""
    load = np.linspace(0.0, 1.0, count)
    section = np.where(load < 0.5, 0.5 * load, 1.0)[:, np.newaxis] * RANDOM.random((count, points))
    section[load < 0.5] = load[load < 0.5, np.newaxis]
    variables = sweep_variables(
        [coordinate("load", "1", "static load", "", load)],
        states=["delta_5"],
        section=["delta_5"],
        section_points=points,
        lyapunov=exponent is not None,
        status_meanings=["ok", "diverged"],
    )
    data = {"section_delta_5": section, "status": np.zeros(count)}
    data |= {"start_state": section[:, :1], "end_state": section[:, :1]}
    data["diverged_period"] = np.full(count, -1)
    if exponent is not None:
        data |= {"lyapunov_exponent": exponent, "status": np.isnan(exponent)}
        data["lyapunov_exponent_standard_error"] = np.full(count, 0.01)
    return Result(["load"], variables, data, {}, {})


@pytest.mark.parametrize("look", [{"markersize": 0.8, "alpha": 0.5}, {"markersize": 3.0}])
@pytest.mark.parametrize("dpi", [100, 300])
def test_counted_dots_are_the_picture_of_the_dots(dpi, look, monkeypatch):
    rows = RANDOM.random((300, 40))
    rows[100:200] = 0.4 + 0.001 * np.arange(100)[:, np.newaxis]
    rows[3, :9], rows[5, :3], rows[7] = np.nan, np.inf, 1e300
    pictures = []
    for most in (rows.size, 1000):
        monkeypatch.setattr("gearchaos.figures.lanes.MOST_DOTS", most)
        axes = panel(dpi)
        drawn = dots(axes, lanes_of(300, (50, 51)), rows, color="#0072B2", rasterized=True, **look)
        assert isinstance(drawn, DenseDots) == (most < rows.size)
        pictures.append(picture(axes))
    one_by_one, counted = pictures
    np.testing.assert_array_equal((counted < 255).any(axis=2), (one_by_one < 255).any(axis=2))
    # When dots are drawn one over the other, the colour is rounded to eight bits each time.
    apart = np.abs(counted - one_by_one)
    assert apart.mean() < 0.25
    assert np.quantile(apart, 0.99) <= 8


def test_every_point_within_the_limits_is_counted_once():
    rows = np.concatenate([RANDOM.random((5000, 60)), RANDOM.random((5000, 60)) - 50.0])
    rows[::7, 3] = np.nan
    lanes = lanes_of(10_000, (0, 2000, 9000))
    axes = panel()
    axes.set(xlim=(-0.1, 1.1), ylim=(-1.0, 2.0))
    assert rows.size > 2 * MOST_DOTS
    shown = np.isfinite(rows) & (rows > -1.0)
    shown[lanes.numbers[lanes.diverged]] = False
    counted = counts(axes, lanes, rows)
    assert counted.sum() == np.count_nonzero(shown)
    # The parameter rises while the number of the lane falls: the points are in the right half.
    assert counted[:, : counted.shape[1] // 2 - 1].sum() == 0


def test_a_diagram_of_very_many_points_keeps_lines_black_and_chaos_grey():
    axes = panel(200)
    points = bifurcation(axes, wide_sweep(30_000, 60)).points
    assert isinstance(points, DenseDots)
    shades = picture(axes)[..., 0][::-1]
    (left, bottom), (right, top) = (
        axes.transData.transform(place).astype(int) for place in ((0.6, 0.2), (0.9, 0.8))
    )
    chaos = shades[bottom:top, left:right]
    assert 60 < chaos.mean() < 220
    x, y = axes.transData.transform((0.25, 0.25)).astype(int)
    assert shades[y - 3 : y + 4, x].min() < 20
    assert 1 <= np.count_nonzero(shades[:, x - 4 : x + 5].min(axis=1)[y - 40 : y + 40] < 128) < 20


def test_drawing_takes_far_less_memory_than_the_points():
    result = wide_sweep(31_250, 64)
    axes = panel()
    tracemalloc.start()
    bifurcation(axes, result)
    picture(axes)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # In the result, every point takes 8 bytes.
    assert peak < 20 * 2_000_000


def test_of_very_many_lanes_the_outermost_of_each_column_are_drawn():
    exponent = RANDOM.random(50_000) / 2.0
    exponent[20_000:30_000] = np.nan
    exponent[777], exponent[40_001] = -0.75, 0.75
    result = wide_sweep(50_000, 1, exponent=exponent)
    axes = panel()
    chart = lyapunov(axes, result)
    x, y = chart.points.get_data()
    assert x.size <= 2 * COLUMNS + 2
    assert (np.nanmin(y), np.nanmax(y)) == (-0.75, 0.75)
    np.testing.assert_array_equal(y, exponent[np.searchsorted(result["load"], x)])
    for low in np.arange(0.0, 1.0, 0.05):
        inside, all_inside = (x >= low) & (x < low + 0.05), result["load"] >= low
        all_inside &= result["load"] < low + 0.05
        if np.isfinite(exponent[all_inside]).any():
            ends = exponent[all_inside]
            assert np.nanmin(y[inside]) == np.nanmin(ends)
            assert np.nanmax(y[inside]) == np.nanmax(ends)
        else:
            assert np.isnan(y[inside]).all()
    ticks = chart.diverged.get_xdata()
    assert ticks.size <= COLUMNS
    assert (ticks.min(), ticks.max()) == pytest.approx((0.4, 0.6), abs=1.5 / COLUMNS)
    # The marks of points off the scale consider all lanes, also those that are not drawn.
    beyond = [mark.get_xdata().tolist() for mark in chart.off_scale]
    assert beyond == [[result["load"][777]], [result["load"][40_001]]]
