"""Whole branches of periodic orbits, against independent exact values and from the command line."""

import json
import re
import signal
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import gearchaos
from gearchaos.engine.branching import find_branches
from gearchaos.figures import branches_page
from gearchaos.interrupts import heeded
from gearchaos.records.branch import (
    CLOSED_CURVE,
    EDGE,
    FOLD,
    GRAZING,
    IN_ERRORS,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
)
from gearchaos.results.files.branch_reader import read_branches

from .commands import interrupted_at, run_module
from .short_sweeps import PUMP


def run(command, *arguments, cwd):
    """Run one of the commands in a folder."""
    return run_module(f"gearchaos.{command}", *map(str, arguments), cwd=cwd)


EXACT = json.loads((Path(__file__).parents[1] / "data" / "continuation.json").read_text())
SWEEPS = Path(__file__).parents[2] / "sweeps"

SPUR_PAIR = """
[model]
kind = "linear"
coordinates = ["x"]
mass = [1.0]
stiffness = [0.0]
damping = [{damping}]

[clearance.mesh]
gap = {{ x = 1.0 }}
stiffness = 1.0
half_clearance = 1.0

[force.load]
on = {{ x = 1.0 }}
mean = {load}

[force.error]
on = {{ x = 1.0 }}
amplitude = {amplitude}
times_frequency_squared = true

[integration]
method = "flow_map"

[sweep]
parameter = "frequency"
from = 0.35
to = 2.2
count = 3
"""
"""The spur pair of Kahraman and Singh; the half clearance is its unit of length."""


@cache
def spur_branch(amplitude, frequency, low, high, damping=0.1):
    """Return the branch of the spur pair over a range, through its motion at a frequency."""
    text = SPUR_PAIR.format(load=EXACT["F_m"], amplitude=amplitude, damping=damping)
    config = gearchaos.Configuration.from_toml(text, "spur.toml")
    system = gearchaos.System(config, frequency=frequency)
    return system.branch(system.orbit(), "frequency", low, high)


WEAK, STRONG = (0.02, 1.14, 0.88, 1.15), (0.1, 2.15, 0.57, 2.2)
"""Amplitude of the error, frequency of the first orbit, and range; beyond it nothing is special."""


def of_kind(branch, kind):
    """Return the values of the special points of one kind, in order."""
    return sorted(one.value for one in branch.specials if one.kind == kind)


@pytest.mark.parametrize(
    ("way", "exact"),
    [*zip((WEAK, STRONG), EXACT["spur_pair"], strict=True)],
    ids=("weak", "strong"),
)
def test_special_points_of_a_spur_pair_are_exact(way, exact):
    branch = spur_branch(*way)
    assert way[0] == exact["F_ah"]
    assert of_kind(branch, FOLD) == pytest.approx(exact["fold"], abs=1e-9)
    assert of_kind(branch, PERIOD_DOUBLING) == pytest.approx(exact["period_doubling"], abs=1e-9)
    for value in exact["grazing"]:
        assert min(abs(one - value) for one in of_kind(branch, GRAZING)) < 1e-9


def test_the_motion_that_never_separates_grazes_where_the_linear_response_reaches_the_flank():
    zeta, load = EXACT["zeta"], EXACT["F_m"]
    grazing = [one for one in of_kind(spur_branch(*WEAK), GRAZING) if one > 1.0]
    assert len(grazing) == 1
    square = grazing[0] ** 2
    response = 0.02 * square / np.hypot(1.0 - square, 2.0 * zeta * grazing[0])
    assert response == pytest.approx(load, abs=1e-10)


@pytest.mark.parametrize("frequency", (1.0, 2.0))
@pytest.mark.parametrize("excess", (1e-8, 1e-7))
def test_two_grazings_between_the_same_points_are_both_found(excess, frequency):
    zeta = 0.2
    # The linear response at resonance exceeds the distance of the flank by very little.
    amplitude = 2.0 * zeta * np.sqrt(1.0 - zeta**2) * EXACT["F_m"] * (1.0 + excess)
    ratio = (amplitude / EXACT["F_m"]) ** 2
    squares = np.roots([ratio - 1.0, 2.0 - 4.0 * zeta**2, -1.0])
    branch = spur_branch(amplitude, frequency, 0.5, 4.0, 2.0 * zeta)
    grazing = of_kind(branch, GRAZING)
    assert grazing == pytest.approx(sorted(np.sqrt(squares)), abs=1e-8)
    assert 1e-5 < grazing[1] - grazing[0] < 1e-3


def test_a_branch_does_not_depend_on_where_it_was_begun():
    amplitude, _, low, high = WEAK
    one, other = spur_branch(*WEAK), spur_branch(amplitude, 0.885, low, high)
    for kind in (FOLD, GRAZING):
        assert of_kind(one, kind) == pytest.approx(of_kind(other, kind), abs=1e-9)


@cache
def two_masses():
    """Return the branch of the two masses through their impacting orbit at 0.7."""
    config = gearchaos.load_config(SWEEPS / "two_masses.toml", ['integration.method="flow_map"'])
    config = config.replace("start", {"kind": "given", "state": {"x1_rate": 1.0, "x2": 0.5}})
    system = gearchaos.System(config, frequency=0.7)
    orbit = system.orbit()
    assert orbit.stable
    return system.branch(orbit, "frequency", 0.55, 0.8)


def test_special_points_of_two_masses_are_exact():
    branch, exact = two_masses(), EXACT["two_masses"]
    for kind, key in (
        (PERIOD_DOUBLING, "period_doubling"),
        (GRAZING, "grazing"),
        (FOLD, "fold"),
        (NEIMARK_SACKER, "neimark_sacker"),
    ):
        for value in exact[key]:
            assert min(abs(one - value) for one in of_kind(branch, kind)) < 1e-9, (kind, value)


def test_a_fold_next_to_a_grazing_point_is_told_from_it():
    fold, grazing = (
        max(one for one in of_kind(two_masses(), kind) if one < 0.7) for kind in (FOLD, GRAZING)
    )
    assert 0.0 < abs(fold - grazing) < 1e-7


@cache
def isolated(frequency, state, period=4):
    """Return the branch of a period through the motion at a frequency, beginning at a state."""
    config = gearchaos.load_config(SWEEPS / "two_masses.toml", ['integration.method="flow_map"'])
    named = dict(zip(("x1", "x1_rate", "x2", "x2_rate"), state, strict=True))
    config = config.replace("start", {"kind": "given", "state": named})
    system = gearchaos.System(config, frequency=frequency)
    return system.branch(system.orbit(period), "frequency", 0.55, 0.8)


ONE = 0.618, (0.909, 0.326, 0.612, 0.223)
OTHER = 0.6155, (0.9234, 0.2171, 0.6416, 0.1733)


def test_an_isolated_branch_is_followed_until_it_closes_on_itself():
    branch = isolated(*ONE)
    assert branch.ends == (CLOSED_CURVE, CLOSED_CURVE)
    # Nowhere does it reach an edge of the range, or the orbit of half its period.
    assert branch.value.min() > 0.6
    assert branch.value.max() < 0.63
    # Its first orbit is its last one, perhaps from another of its section points on.
    phase = np.argmin(np.linalg.norm(branch.section[-1] - branch.section[0, -1], axis=1))
    before, last = (np.append(branch.section[at, phase], branch.value[at]) for at in (-2, -1))
    first, second = (np.append(branch.section[at, -1], branch.value[at]) for at in (0, 1))
    assert last == pytest.approx(first, abs=1e-11)
    assert (last - before) @ (second - first) > 0.0
    # No point lies beside it.
    assert branch.arclength[-1] - branch.arclength[-2] > 1e-7
    # A closed curve turns back as often as it turns forth.
    assert len(of_kind(branch, FOLD)) % 2 == 0


def test_an_isolated_branch_does_not_depend_on_where_it_was_begun():
    one, other = isolated(*ONE), isolated(*OTHER)
    assert other.ends == one.ends
    for kind in (FOLD, PERIOD_DOUBLING, GRAZING):
        assert len(of_kind(one, kind)) >= 2
        assert of_kind(one, kind) == pytest.approx(of_kind(other, kind), abs=1e-9)


def test_a_branch_that_bends_at_grazing_points_is_passed_through_once():
    # Within 1e-6 of two of them the curve turns by a large angle.
    branch = isolated(0.5885, (1.00942842, -0.16202727, 0.61905147, 0.00197754), 7)
    assert branch.ends == (CLOSED_CURVE, CLOSED_CURVE)
    assert [len(of_kind(branch, kind)) for kind in (FOLD, PERIOD_DOUBLING, GRAZING)] == [2, 2, 4]


def test_a_branch_of_rk4_reaches_the_edges_of_the_range_as_that_of_flow_maps_does():
    # At 1.66 the motion touches a flank for less than a step, which RK4 does not see at first.
    branches = []
    for method in ("rk4", "flow_map"):
        setting = f'integration.method="{method}"'
        config = gearchaos.load_config(SWEEPS / "pan2021_first.toml", [setting])
        system = gearchaos.System(config, pitch_error=2.0)
        branches.append(system.branch(system.orbit(), "pitch_error", 0.0, 15.0))
    rk4, exact = branches
    assert rk4.ends == exact.ends == (EDGE, EDGE)
    for kind, error in ((FOLD, 1e-4), (PERIOD_DOUBLING, 1e-4)):
        assert of_kind(rk4, kind) == pytest.approx(of_kind(exact, kind), abs=error)


def test_where_errors_hide_a_branch_its_end_says_so():
    # A step takes 0.4 of the time in which the stop pushes the mass back.
    setting = 'integration={ method="rk4", steps_per_period=70 }'
    config = gearchaos.load_config(SWEEPS / "two_masses.toml", [setting])
    config = config.replace("start", {"kind": "given", "state": {"x1_rate": 1.0, "x2": 0.5}})
    system = gearchaos.System(config, frequency=0.7)
    branch = system.branch(system.orbit(), "frequency", 0.55, 0.8)
    assert branch.ends == (IN_ERRORS, IN_ERRORS)


UP_AND_DOWN = """
[sweep]
parameter = "pitch_error.amplitude_um"
from = 0.0
to = 60.0
count = 61

[start]
carry = "both"
"""


def test_a_doubled_branch_of_rk4_does_not_fold_where_it_begins():
    config = gearchaos.Configuration.from_toml(PUMP + UP_AND_DOWN, "pump.toml")
    result = gearchaos.run(config.replace("pair.profile_shift", [0.3, 0.0]))
    found = find_branches(result, longest=2)
    doubled = [one for one in found.branches if one.period == 2]
    assert doubled
    for branch in doubled:
        begin = min(branch.value[0], branch.value[-1])
        assert all(abs(one - begin) > 0.1 for one in of_kind(branch, FOLD))


def test_stability_changes_at_special_points_only():
    branch = two_masses()
    special = {round(one.arclength, 12) for one in branch.specials}
    unstable = np.abs(branch.multipliers[:, 0]) > 1.0 + 1e-6
    for number in range(1, unstable.size):
        if unstable[number] != unstable[number - 1]:
            ends = branch.arclength[[number - 1, number]]
            assert any(round(end, 12) in special for end in ends.tolist())


def test_every_point_of_a_branch_is_closed():
    branch = two_masses()
    config = gearchaos.load_config(SWEEPS / "two_masses.toml", ['integration.method="flow_map"'])
    for number in range(0, branch.value.size, 25):
        system = gearchaos.System(config, frequency=float(branch.value[number]))
        point = branch.section[number, -1]
        returned = system.integrate(1, start=point).states[-1]
        assert returned == pytest.approx(point, abs=1e-11)


TORSION = (
    'scene.effects=["pitch_error", "stiffness_variation", "backlash"]',
    'integration.method="flow_map"',
    "integration.steps_per_period=12",
    "integration.transient_periods=300",
    "integration.recorded_periods=100",
    "outputs.section_points=16",
    "sweep.count=16",
)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Compute a sweep and its branches by the real commands; return their paths and messages."""
    folder = tmp_path_factory.mktemp("branches")
    sets = [word for one in TORSION for word in ("--set", one)]
    swept = run("sweep", SWEEPS / "pan2021_first.toml", "-o", "sweep.h5", *sets, cwd=folder)
    assert swept.code == 0, swept.err
    done = run("branches", "sweep.h5", "--periods", "2", cwd=folder)
    assert done.code == 0, done.err
    return folder, done


def test_the_command_writes_branches_and_lists_special_points(files):
    folder, done = files
    assert done.out == "sweep_branches.h5\n"
    found = read_branches(folder / "sweep_branches.h5")
    assert found.parameter.name == "pitch_error"
    assert found.state_names == ("delta_5", "delta_5_rate")
    assert {one.period for one in found.branches} <= {1, 2}
    for one in found.branches:
        assert one.section.shape == (one.value.size, one.period, 2)
        assert (np.diff(one.arclength) > 0.0).all()
        for special in one.specials:
            assert f"pitch_error = {special.value:.10g}" in done.err
            (place,) = np.nonzero(one.arclength == special.arclength)
            assert one.value[place] == pytest.approx([special.value])


def test_an_interrupt_keeps_the_branches_that_were_found(files, tmp_path):
    earlier, log = tmp_path / "earlier.h5", tmp_path / "log"
    earlier.write_bytes(b"earlier")
    words = ("sweep.h5", "--periods", "16", "-o", str(earlier), "--overwrite", "--log", str(log))
    found = r"period \d+: \d+ orbits"
    code, out, err = interrupted_at(found, log, "gearchaos.branches", words, files[0])
    assert (code, out) == (130, "")
    assert earlier.read_bytes() == b"earlier"
    kept = tmp_path / "earlier_interrupted.h5"
    (count,) = re.findall(rf"{kept}: (\d+) branch(?:es)?, found before the interrupt", err)
    assert len(read_branches(kept).branches) == int(count) > 0


def test_an_interrupt_before_the_first_branch_says_that_nothing_is_kept(files):
    result, kept = gearchaos.open_result(files[0] / "sweep.h5"), []
    with heeded(at_once=False):
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt) as interrupted:
            find_branches(result, keep=kept.append)
    assert kept == []
    assert interrupted.value.__notes__ == ["no branch was complete, and nothing is kept"]


def test_branches_meet_where_a_period_doubles(files):
    found = read_branches(files[0] / "sweep_branches.h5").branches
    doublings = [
        one.value
        for branch in found
        for one in branch.specials
        if branch.period == 1 and one.kind == PERIOD_DOUBLING
    ]
    beginnings = [
        branch.value[at]
        for branch in found
        if branch.period == 2
        for at, end in zip((0, -1), branch.ends, strict=True)
        if end.startswith("meets")
    ]
    assert doublings
    for value in beginnings:
        assert min(abs(value - one) for one in doublings) < 1e-3


def test_xarray_reads_the_file(files):
    import xarray

    with xarray.open_dataset(files[0] / "sweep_branches.h5", engine="h5netcdf") as opened:
        assert opened["multiplier_real"].dims == ("point", "state")
        assert set(opened["stable"].values.tolist()) <= {0, 1}


def test_the_diagram_and_the_page_are_drawn(files):
    folder, _ = files
    for arguments, name in (
        (("sweep.h5", "--branches", "sweep_branches.h5"), "sweep_with_branches.png"),
        (("sweep_branches.h5",), "sweep_branches.png"),
    ):
        drawn = run("plot", *arguments, "--format", "png", cwd=folder)
        assert drawn.code == 0, drawn.err
        assert drawn.out == f"{name}\n"
        assert (folder / name).stat().st_size > 10_000


def test_branches_of_one_period_share_a_label(files):
    found = read_branches(files[0] / "sweep_branches.h5")
    lower = branches_page(found).axes[1]
    periods = sorted({one.period for one in found.branches})
    assert periods == [1, 2]
    assert [one.get_text() for one in lower.get_xticklabels()] == ["1", "2"]
    assert (np.diff(lower.get_xticks()) > 0.0).all()


def test_a_report_lists_branches_and_special_points(files):
    folder, _ = files
    done = run("report", "sweep_branches.h5", cwd=folder)
    assert (done.code, done.out) == (0, "sweep_branches.html\n"), done.err
    page = (folder / "sweep_branches.html").read_text()
    assert page.count("<img ") == 1 and "period doubling" in page
    for one in read_branches(folder / "sweep_branches.h5").branches:
        for special in one.specials:
            assert f">{special.value:.6g}</td>" in page


def test_stable_orbits_are_solid_and_unstable_ones_dashed(files):
    from matplotlib.figure import Figure

    from gearchaos.figures import draw_branches

    found = read_branches(files[0] / "sweep_branches.h5")
    axes = Figure().add_subplot()
    draw_branches(axes, found)
    solid = [line for line in axes.lines if line.get_linestyle() == "-"]
    dashed = [line for line in axes.lines if line.get_linestyle() == "--"]
    assert solid
    assert dashed
    stable = {value for one in found.branches for value in one.value[one.stable].tolist()}
    for line in solid:
        assert set(line.get_xdata()[1:-1].tolist()) <= stable
    for line in dashed:
        assert not set(line.get_xdata()[1:-1].tolist()) & stable


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("branches", "missing.h5"), ("missing.h5",)),
        (("branches", "sweep.h5"), ("sweep_branches.h5", "exists", "--overwrite")),
        (("branches", "sweep.h5", "--periods", "0"), ("--periods", "must be between 1 and 64")),
        (("plot", "sweep.h5", "--branches", "sweep.h5"), ("sweep.h5", "holds no branches")),
        (("plot", "sweep_branches.h5", "--stages"), ("--stages", "a file of branches")),
        (("info", "sweep_branches.h5"), ("sweep_branches.h5",)),
    ],
)
def test_faults_are_one_sentence(files, arguments, words):
    done = run(*arguments, cwd=files[0])
    assert done.code in (2, 4)
    assert "Traceback" not in done.err
    for word in words:
        assert word in done.err


def test_branches_are_not_drawn_into_the_chart_of_exponents(files):
    folder, _ = files
    sets = [*TORSION, "sweep.count=3", "outputs.section=[]"]
    words = [word for one in sets for word in ("--set", one)]
    swept = run("sweep", SWEEPS / "pan2021_first.toml", "-o", "bare.h5", *words, cwd=folder)
    assert swept.code == 0, swept.err
    done = run("plot", "bare.h5", "--branches", "sweep_branches.h5", cwd=folder)
    assert done.code == 2
    assert "bare.h5 does not hold; name states in outputs.section" in done.err
    assert not (folder / "bare.png").exists()


def test_other_commands_name_what_the_file_holds(files):
    for command in ("info", "stages"):
        done = run(command, "sweep_branches.h5", cwd=files[0])
        assert done.code == 4
        assert "holds branches, and is no result of a sweep" in done.err


def test_a_damaged_file_is_refused(files):
    folder, _ = files
    whole = bytearray((folder / "sweep_branches.h5").read_bytes())
    whole[len(whole) // 2] ^= 0xFF
    (folder / "damaged.h5").write_bytes(whole)
    with pytest.raises(gearchaos.GearchaosError, match="damaged"):
        read_branches(folder / "damaged.h5")


def test_orbits_within_chaos_are_found_each_once():
    config = gearchaos.load_config(
        SWEEPS / "pan2021.toml",
        ['integration.method="flow_map"', "integration.steps_per_period=12"],
    )
    system = gearchaos.System(config, pitch_error=12.47)
    (orbit,) = system.orbits(1)
    # Computed independently.
    expected = [-1.6976, 0.4626 + 0.7956j, 0.4626 - 0.7956j, -0.381]
    assert orbit.multipliers[:4] == pytest.approx(expected, abs=1e-4)
    points = [one.point for period in (2, 3) for one in system.orbits(period)]
    assert len(points) >= 3
    for one, other in pairwise(points):
        assert np.max(np.abs(one - other)) > 1e-3
