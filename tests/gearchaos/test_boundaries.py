"""Curves over two parameters, against exact values, one-parameter branches and closed forms."""

import json
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from gearchaos_kernels import Plan

import gearchaos
from gearchaos.dynamics.arclength import CurvePoint
from gearchaos.dynamics.boundaries import unstarted
from gearchaos.dynamics.boundary_equations import Equations
from gearchaos.dynamics.branch_range import BranchRange
from gearchaos.dynamics.branches import trace
from gearchaos.engine.bounding import find_boundaries
from gearchaos.engine.running import one_thread
from gearchaos.figures.boundaries import boundaries_page
from gearchaos.figures.overlaid_files import boundaries_over
from gearchaos.models.registry import system_of
from gearchaos.records.boundary import BOUNDARY_ENDS, CUSP
from gearchaos.records.branch import FOLD, GRAZING, PERIOD_DOUBLING
from gearchaos.results.files.boundary_file import write_boundaries
from gearchaos.results.files.boundary_reader import read_boundaries

from .commands import interrupted_at, run_module

EXACT = json.loads((Path(__file__).parents[1] / "data" / "continuation.json").read_text())

MAP = """
title = "A spur pair over its speed and its error"

[model]
kind = "linear"
coordinates = ["x"]
mass = [1.0]
stiffness = [0.0]
damping = [0.1]

[clearance.mesh]
gap = { x = 1.0 }
stiffness = 1.0
half_clearance = 1.0

[force.load]
on = { x = 1.0 }
mean = 0.1

[force.error]
on = { x = 1.0 }
amplitude = 0.02
times_frequency_squared = true

[integration]
method = "flow_map"
steps_per_period = 24
transient_periods = 150
recorded_periods = 40

[outputs]
section_points = 4

[sweep]
parameter = "frequency"
from = 0.55
to = 2.0
count = 9

[second_sweep]
parameter = "force.error.amplitude"
from = 0.005
to = 0.11
count = 7
"""
"""The spur pair of Kahraman and Singh; the half clearance is its unit of length."""

LOW, HIGH = np.array([0.55, 0.005]), np.array([2.0, 0.11])
SCALE = np.array([1.5, 1.0])


def run(command, *arguments, cwd):
    """Run one of the commands in a folder."""
    return run_module(f"gearchaos.{command}", *map(str, arguments), cwd=cwd)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Compute a map and its boundaries by the real commands; return their folder and messages."""
    folder = tmp_path_factory.mktemp("boundaries")
    (folder / "map.toml").write_text(MAP)
    swept = run("sweep", "map.toml", cwd=folder)
    assert swept.code == 0, swept.err
    done = run("boundaries", "map.h5", "--lines", "2", cwd=folder)
    assert done.code == 0, done.err
    return folder, done


@pytest.fixture(scope="module")
def found(files):
    """Return the boundaries of the file."""
    return read_boundaries(files[0] / "map_boundaries.h5")


@cache
def config():
    """Return the configuration of the map."""
    return gearchaos.Configuration.from_toml(MAP, "map.toml")


def system_at(shares):
    """Return the systems at shares of both ranges."""
    values = (LOW + shares * (HIGH - LOW)).T
    names = ("frequency", "force.error.amplitude")
    return system_of(config(), dict(zip(names, values, strict=True)), config().needed_effects)


def crossings(found, kind, number, value, method="flow_map", steps=24):
    """Return where curves of a kind meet a line on which parameter ``number`` has a value.

    These are the values of the other parameter, in order. A curve is followed from its stored
    points beside the line to the line.
    """
    plan = Plan(steps, 0, 1, 1, tangent=True, method=method)
    direction = np.zeros(4)
    direction[2 + number] = 1.0
    equations = Equations(system_at, plan, 1, SCALE, kind)
    if kind == GRAZING:
        equations = equations.grazing(0, steps)
    places = []
    for one in found.boundaries:
        if one.kind != kind:
            continue
        side = one.values[:, number] - value
        for at in np.flatnonzero(side[:-1] * side[1:] < 0.0):
            part = side[at] / (side[at] - side[at + 1])
            between = one.values[at] + part * np.diff(one.values[at : at + 2], axis=0)[0]
            state = one.section[at, -1] + part * np.diff(one.section[at : at + 2, -1], axis=0)[0]
            guess = np.concatenate([state / SCALE, (between - LOW) / (HIGH - LOW)])
            with one_thread():
                point = equations.begun(guess, direction)
            assert point is not None
            places.append(float((LOW + point.shares * (HIGH - LOW))[1 - number]))
    return sorted(places)


def specials_on(number, value, method="flow_map", steps=24):
    """Return the special points of the branch on the same line, by kind."""
    other = 1 - number

    def systems(at):
        shares = np.zeros((at.size, 2))
        shares[:, number] = (value - LOW[number]) / (HIGH - LOW)[number]
        shares[:, other] = (at - LOW[other]) / (HIGH - LOW)[other]
        return system_at(shares)

    over = BranchRange(systems, LOW[other], HIGH[other])
    curve = over.curve(Plan(steps, 0, 1, 1, method=method), 1, SCALE)
    # Where the error is small, or far above the resonance, the motion is near rest on the flank.
    guess = np.array([1.1, 0.0, 0.001]) if number == 0 else np.array([1.1 - 1.4 * value, 0.0, 0.99])
    with one_thread():
        start = curve.corrected(guess / np.append(SCALE, 1.0), np.array([0.0, 0.0, 1.0]))
        branch = trace(curve, start)
    found = {kind: [] for kind in (FOLD, PERIOD_DOUBLING, GRAZING)}
    for one in branch.specials:
        found[one.kind].append(float(over.value(one.point.share)))
    return found


def test_curves_meet_exact_special_points(found):
    for exact in EXACT["spur_pair"]:
        for kind, key in (
            (FOLD, "fold"),
            (PERIOD_DOUBLING, "period_doubling"),
            (GRAZING, "grazing"),
        ):
            met = crossings(found, kind, 1, exact["F_ah"])
            for value in exact[key]:
                assert min(abs(one - value) for one in met) < 1e-8, (kind, value, met)


LINES = [(0, value) for value in np.linspace(0.75, 1.97, 17).tolist()]
LINES += [(1, value) for value in (0.015, 0.047, 0.0913)]


@pytest.mark.parametrize(("number", "value"), LINES)
def test_curves_meet_the_special_points_of_branches_on_twenty_lines(found, number, value):
    for kind, expected in specials_on(number, value).items():
        assert crossings(found, kind, number, value) == pytest.approx(sorted(expected), abs=1e-8)


def test_the_motion_that_never_separates_grazes_where_the_linear_response_reaches_the_flank(found):
    zeta, load = EXACT["zeta"], EXACT["F_m"]
    (grazing,) = [one for one in found.boundaries if one.kind == GRAZING]
    frequency, amplitude = grazing.values.T
    square = frequency**2
    response = amplitude * square / np.hypot(1.0 - square, 2.0 * zeta * frequency)
    assert grazing.flank == "mesh, upper side"
    assert frequency.size > 20
    assert response == pytest.approx(load, abs=1e-10)


def test_two_folds_vanish_in_a_cusp(found):
    (cusp,) = [point for one in found.boundaries for point in one.points if point.kind == CUSP]
    assert crossings(found, FOLD, 1, cusp.values[1] - 1e-5) == []
    widths = [
        float(np.diff(crossings(found, FOLD, 1, cusp.values[1] + beyond))[0])
        for beyond in (1e-3, 2e-3)
    ]
    # The width of the horn grows with the power 3/2 of the distance.
    assert widths[1] / widths[0] == pytest.approx(2.0**1.5, rel=0.1)


def test_rk4_is_followed_as_its_step_map(found):
    expected = specials_on(0, 0.75, "rk4", 100)
    for kind in (FOLD, GRAZING):
        met = crossings(found, kind, 0, 0.75, "rk4", 100)
        assert met == pytest.approx(sorted(expected[kind]), abs=1e-8)
        assert met != pytest.approx(crossings(found, kind, 0, 0.75), abs=1e-8)


def test_the_table_lists_every_curve_with_its_ends_and_points(files, found):
    _, done = files
    assert done.out == "map_boundaries.h5\n"
    assert [one.name for one in found.parameters] == ["frequency", "force_error_amplitude"]
    for number, one in enumerate(found.boundaries):
        (line,) = [row for row in done.err.splitlines() if f" curve {number}, {one.kind}" in row]
        for end in one.ends:
            assert end in BOUNDARY_ENDS
            assert end in line
        for point in one.points:
            assert f"{point.kind:35} frequency = {point.values[0]:.10g}" in done.err
        assert (np.diff(one.arclength) > 0.0).all()
        assert one.section.shape == (one.arclength.size, one.period, 2)


def test_lines_between_points_lie_on_the_curve(found):
    (grazing,) = [one for one in found.boundaries if one.kind == GRAZING]
    middle = (grazing.values[:-1] + grazing.values[1:]) / 2.0
    square = middle[:, 0] ** 2
    response = square / np.hypot(1.0 - square, 2.0 * EXACT["zeta"] * middle[:, 0])
    aside = np.abs(middle[:, 1] - EXACT["F_m"] / response) / (HIGH - LOW)[1]
    assert aside.max() < 2.0 / 300.0


def test_xarray_reads_the_file_and_a_copy_is_the_same(files, found):
    import xarray

    with xarray.open_dataset(files[0] / "map_boundaries.h5", engine="h5netcdf") as opened:
        assert opened["frequency"].dims == ("point",)
        assert opened["kind"].dims == ("boundary",)
        assert opened.attrs["schema"] == "gearchaos-boundaries"
    write_boundaries(files[0] / "copy.h5", found)
    again = read_boundaries(files[0] / "copy.h5")
    for one, other in zip(found.boundaries, again.boundaries, strict=True):
        for name, value in one._asdict().items():
            if name != "points":
                assert np.array_equal(value, getattr(other, name)), name
        for point, read in zip(one.points, other.points, strict=True):
            assert (point.kind, point.arclength) == (read.kind, read.arclength)
            assert np.array_equal(point.values, read.values)


def test_the_map_and_the_page_are_drawn(files):
    folder, _ = files
    for arguments, name in (
        (("map.h5", "--boundaries", "map_boundaries.h5"), "map_with_boundaries.png"),
        (("map_boundaries.h5",), "map_boundaries.png"),
    ):
        drawn = run("plot", *arguments, "--format", "png", cwd=folder)
        assert drawn.code == 0, drawn.err
        assert drawn.out == f"{name}\n"
        assert (folder / name).stat().st_size > 10_000


def test_a_report_lists_the_boundaries(files, found):
    folder, _ = files
    done = run("report", "map_boundaries.h5", cwd=folder)
    assert (done.code, done.out) == (0, "map_boundaries.html\n"), done.err
    page = (folder / "map_boundaries.html").read_text()
    assert page.count("<img ") == 1
    for one in found.boundaries:
        assert f">{one.values[:, 0].min():.6g}</td>" in page


def test_each_kind_has_a_line_of_its_own(found):
    from matplotlib.figure import Figure

    from gearchaos.figures import draw_boundaries
    from gearchaos.figures.boundaries import LINES

    axes = Figure().add_subplot()
    axes.set(xlim=(0.55, 2.0), ylim=(0.005, 0.11))
    handles = draw_boundaries(axes, found, ["frequency", "force_error_amplitude"])
    assert [one.get_label() for one in handles] == [FOLD, PERIOD_DOUBLING, GRAZING, CUSP]
    for line, kind in zip(handles[:3], (FOLD, PERIOD_DOUBLING, GRAZING), strict=True):
        assert line.get_color() == LINES[kind]["color"]
    with pytest.raises(gearchaos.GearchaosError, match="give the boundaries of this map"):
        draw_boundaries(axes, found, ["frequency", "pitch_error"])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("boundaries", "missing.h5"), ("missing.h5",)),
        (("boundaries", "map.h5"), ("map_boundaries.h5", "exists", "--overwrite")),
        (("boundaries", "map.h5", "--periods", "0"), ("--periods", "must be between 1 and 16")),
        (("boundaries", "map.h5", "--lines", "1001"), ("--lines", "must be between 0 and 1000")),
        (
            ("boundaries", "map.h5", "-o", "new.h5", "--at", "frequency=0.55"),
            ("map.h5", "two swept parameters", "second_sweep"),
        ),
        (("boundaries", "map_boundaries.h5", "-o", "new.h5"), ("map_boundaries.h5",)),
        (("plot", "map.h5", "--boundaries", "map.h5"), ("map.h5", "holds no boundaries")),
        (
            ("plot", "map.h5", "--at", "frequency=0.55", "--boundaries", "map_boundaries.h5"),
            ("--boundaries", "two parameters"),
        ),
        (("plot", "map_boundaries.h5", "--stages"), ("--stages", "a file of boundaries")),
    ],
)
def test_faults_are_one_sentence(files, arguments, words):
    done = run(*arguments, cwd=files[0])
    assert done.code in (2, 4)
    assert "Traceback" not in done.err
    for word in words:
        assert word in done.err


def test_an_interrupt_keeps_what_was_found_and_leaves_an_earlier_file(files, tmp_path):
    earlier = tmp_path / "earlier.h5"
    earlier.write_bytes(b"earlier")
    words = ("map.h5", "--lines", "40", "-o", str(earlier), "--overwrite")
    log = tmp_path / "log"
    words += ("--log", str(log))
    found = r"branches; [1-9]"
    code, out, err = interrupted_at(found, log, "gearchaos.boundaries", words, files[0])
    assert (code, out) == (130, "")
    assert "gearchaos boundaries: interrupted\n" in err
    assert re.search(r"[1-9]\d* of 80 lines were searched", err)
    assert earlier.read_bytes() == b"earlier"
    kept = tmp_path / "earlier_interrupted.h5"
    (count,) = re.findall(rf"{kept}: (\d+) curves?, found before the interrupt", err)
    assert len(read_boundaries(kept).boundaries) == int(count) > 0


def test_a_configuration_without_a_second_sweep_is_refused(files):
    folder, _ = files
    (folder / "one.toml").write_text(MAP.partition("[second_sweep]")[0])
    done = run("boundaries", "one.toml", cwd=folder)
    assert done.code == 2
    assert "one.toml: has no [second_sweep]" in done.err


def test_a_damaged_file_is_refused(files):
    folder, _ = files
    whole = bytearray((folder / "map_boundaries.h5").read_bytes())
    whole[len(whole) // 2] ^= 0xFF
    (folder / "damaged.h5").write_bytes(whole)
    with pytest.raises(gearchaos.GearchaosError, match="damaged"):
        read_boundaries(folder / "damaged.h5")


DOUBLED_AGAIN = """
[pair]
teeth = [25, 41]
normal_module_mm = 3.0
normal_pressure_angle_deg = 20.0
helix_angle_deg = 0.0
face_width_mm = 20.0
[operation]
torque_Nm = 60.0
[mesh]
mean_stiffness_N_per_um_mm = 14.0
half_backlash_um = 40.0
damping_ratio = 0.05
stiffness = { shape = "fourier", cosine_N_per_um_mm = [-2.5, -0.8], sine_N_per_um_mm = [0.0, 0.0] }
[pitch_error]
amplitude_um = 5.0
phase_deg = 90.0
[scene]
effects = ["pitch_error", "stiffness_variation", "backlash"]
[start]
kind = "contact"
carry = "upwards"
[sweep]
parameter = "operation.speed_rpm"
from = 5500.0
to = 8000.0
count = 11
[second_sweep]
parameter = "operation.torque_Nm"
values = [20.0, 30.0, 40.0, 50.0]
[integration]
steps_per_period = 200
transient_periods = 200
recorded_periods = 60
[outputs]
contact = true
section_points = 16
"""


@pytest.fixture(scope="module")
def doubled_again():
    result = gearchaos.run(gearchaos.models.Configuration.from_toml(DOUBLED_AGAIN))
    return find_boundaries(result, longest=2)


def test_a_doubling_far_from_the_cells_of_its_motion_is_found(doubled_again):
    # Doublings of the orbit of period 2 at 30 N m, from branches along the speed, where shooting by
    # an independent integrator has multipliers of -0.99999.
    across = [
        np.interp(30.0, values[:, 1][order], values[:, 0][order])
        for one in doubled_again.boundaries
        if (one.kind, one.period) == (PERIOD_DOUBLING, 2)
        for at in [int(np.argmax(one.values[:, 1]))]
        for values in (one.values[: at + 1], one.values[at:])
        for order in [np.argsort(values[:, 1])]
        if np.ptp(values[:, 1]) > 5.0
    ]
    for speed in 6713.09, 6939.58:
        assert min(abs(one - speed) for one in across) < 2.0


def test_orbits_on_boundaries_have_no_shorter_period_and_cusps_turn_back(doubled_again):
    for one in doubled_again.boundaries:
        if one.period == 2 and one.values.shape[0] > 1:
            apart = np.abs(one.section[:, 0] - one.section[:, 1]).max(axis=1)
            assert apart.min() > 1e-7
        for point in one.points:
            if point.kind == CUSP:
                at = int(np.argmin(np.abs(one.arclength - point.arclength)))
                sizes = np.ptp(one.values, axis=0)
                before, after = np.diff(one.values[at - 1 : at + 2] / sizes, axis=0)
                assert before @ after < 0.0


def test_a_map_of_one_value_has_no_boundaries():
    given = DOUBLED_AGAIN.replace("values = [20.0, 30.0, 40.0, 50.0]", "values = [20.0]")
    result = gearchaos.run(gearchaos.models.Configuration.from_toml(given))
    with pytest.raises(gearchaos.GearchaosError, match="second_sweep has one value of operation"):
        find_boundaries(result, "one.h5")


def test_curves_of_another_machine_are_not_drawn(files, found, tmp_path):
    metadata = dict(found.metadata)
    text = str(metadata["configuration_resolved"])
    changed = text.replace("clearance.mesh.stiffness = 1.0", "clearance.mesh.stiffness = 1.5")
    assert changed != text
    other = found._replace(metadata=metadata | {"configuration_resolved": changed})
    write_boundaries(tmp_path / "other.h5", other)
    result = gearchaos.open_result(files[0] / "map.h5")
    with pytest.raises(gearchaos.FigureError, match=r"mesh.stiffness = 1\.5, and the figure"):
        boundaries_over(tmp_path / "other.h5", result)


def test_a_curve_at_one_value_is_drawn_as_a_straight_line(found):
    one = next(one for one in found.boundaries if one.kind == FOLD)
    values = np.column_stack([0.65836 + 1e-12 * np.sin(np.arange(20.0)), np.linspace(1.0, 2.0, 20)])
    count = len(values)
    straight = one._replace(
        values=values,
        arclength=np.arange(float(count)),
        section=np.repeat(one.section[:1], count, axis=0),
        multipliers=np.repeat(one.multipliers[:1], count, axis=0),
        points=(),
    )
    page = boundaries_page(found._replace(boundaries=(straight,)))
    low, high = page.axes[0].get_xlim()
    assert high - low > 0.01 and low < values[:, 0].min() and values[:, 0].max() < high


def test_a_boundary_of_one_point_is_known_by_each_section_point_of_its_orbit():
    equations = Equations(None, None, 2, np.array([1.0, 2.0]), PERIOD_DOUBLING)
    section, nothing = np.array([[0.5, 0.1], [0.2, 0.4]]), np.zeros(2)
    place = np.array([0.2, 0.2, 0.3, 0.6])
    special = CurvePoint(place[:3], place[:3], nothing, 0.0, nothing, (), section, nothing)
    one = unstarted(equations, place, special)
    other = np.array([0.5, 0.05, 0.3, 0.6])
    assert one.is_at(place) and one.is_at(other)
    for component in range(4):
        assert not one.is_at(other + 1e-4 * np.eye(4)[component])
