"""A search recovers known parameters from observations, also after it was stopped."""

import math
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from gearchaos.errors import ConfigurationError, FileError
from gearchaos.identification import evaluation
from gearchaos.identification import search as searching
from gearchaos.identification.evaluation import require_stable
from gearchaos.identification.loading import load_targets
from gearchaos.identification.report import _row, reach
from gearchaos.identification.search import budget_of, decisive_facts, judge, steps_alone
from gearchaos.identification.tried import read_tried, write_tried
from gearchaos.identify import main

from .commands import Ended

DAMPING, AMPLITUDE, FREQUENCY, LOAD = 0.05, 0.02, 0.5, 0.1

PAIR = f"""\
[groups]
mesh_frequency = {FREQUENCY}
load = {LOAD}
damping_ratio = 0.3
base_helix_angle_deg = 0.0
pitch_error_amplitude = 1.0

[scene]
effects = ["pitch_error"]

[sweep]
parameter = "pitch_error"
values = [0.0, 1.0]

[integration]
steps_per_period = 60
transient_periods = 40
recorded_periods = 48
"""


def acceleration(pitch_error: float) -> float:
    """Return the acceleration amplitude of a linear oscillator that the pitch error drives."""
    drive = FREQUENCY**2 * pitch_error * AMPLITUDE
    return FREQUENCY**2 * drive / abs(1.0 - FREQUENCY**2 + 2j * DAMPING * FREQUENCY)


EXPONENT_WIDTH, INCREMENT_WIDTH = 1e-3, 1e-4

TARGETS = f"""\
title = "a linear pair"
configuration = "pair.toml"

[search]
seed = 3
candidates = 360
drawn = 40
runs = 1
population = 12

[[parameter]]
name = "damping_ratio"
low = 0.01
high = 0.5
logarithmic = true

[[parameter]]
name = "pitch_error_amplitude"
low = 0.0
high = 0.1

[[stage]]
motion = "period 1"
from = 0.5
to = 3.0
width = 0.1

[[exponent]]
at = 1.0
value = {-DAMPING}
width = {EXPONENT_WIDTH}

[[increment]]
from = 1.0
to = 3.0
value = {acceleration(3.0) - acceleration(1.0)!r}
width = {INCREMENT_WIDTH}
"""


@dataclass
class Identified:
    folder: Path
    out: str
    err: str

    @property
    def file(self):
        return self.folder / "targets.csv"


def command(folder, *arguments):
    """Run the command in this process, which has already imported its modules."""
    out, err = StringIO(), StringIO()
    with chdir(folder), redirect_stdout(out), redirect_stderr(err):
        code = main(["targets.toml", *arguments])
    return Ended(code, out.getvalue(), err.getvalue())


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    folder = tmp_path_factory.mktemp("identify")
    (folder / "pair.toml").write_text(PAIR)
    (folder / "targets.toml").write_text(TARGETS)
    ended = command(folder)
    assert ended.code == 0, ended.err
    return Identified(folder, ended.out, ended.err)


def numbers(path):
    """Return all lines of a file except the first, which has the time and place of writing."""
    return path.read_text().splitlines()[1:]


def problem_of(identified):
    return load_targets(identified.folder / "targets.toml")


def tried_of(identified):
    return read_tried(identified.file, problem_of(identified))


class TestALinearPair:
    def test_its_damping_and_its_error_are_found_again(self, identified):
        tried, _ = tried_of(identified)
        best = int(np.argmin(tried["misfit"]))
        # The part 2 (sqrt(1 + r^2) - 1) of each observation is at most the misfit.
        widths = math.sqrt((1.0 + tried["misfit"][best] / 2.0) ** 2 - 1.0)
        assert widths < 1.0
        # The length of a tangent vector oscillates by a share that is less than the damping. The
        # weights of the 48 periods rise to at most 2/48 and fall again.
        swinging = DAMPING * 2.0 * (2.0 / 48.0) / (2.0 * math.pi / FREQUENCY)
        off = widths * EXPONENT_WIDTH + swinging
        assert tried["values"][best, 0] == pytest.approx(DAMPING, abs=off)
        # The largest of 240 samples per period is at most this share below the crest. The relative
        # change of the gain is less than that of the damping.
        crest = 1.0 - math.cos(math.pi / 240.0)
        share = crest + off / DAMPING
        share += widths * INCREMENT_WIDTH / (acceleration(3.0) - acceleration(1.0))
        assert tried["values"][best, 1] == pytest.approx(AMPLITUDE, rel=share)

    def test_every_candidate_is_kept(self, identified, monkeypatch):
        # The result does not depend on how many motions are evaluated together.
        monkeypatch.setattr(evaluation, "MOTIONS_AT_ONCE", 3)
        tried, facts = tried_of(identified)
        some = {
            "damping_ratio": tried["values"][:5, 0],
            "pitch_error_amplitude": tried["values"][:5, 1],
        }
        again = judge(problem_of(identified), 0, some)
        assert np.array_equal(again["misfit"], tried["misfit"][:5])
        assert np.array_equal(again["computed"], tried["computed"][:5])
        assert (tried["run"] == 0).sum() == 40
        assert facts["targets"] == TARGETS

    def test_the_report_reports_what_the_targets_determine(self, identified):
        tried, _ = tried_of(identified)
        found = reach(tried, budget_of(problem_of(identified).targets.search, 2).rungs)
        best = tried["values"][np.argmin(tried["misfit"])]
        assert np.all(found.alone[:, 0] < best) and np.all(best < found.alone[:, 1])
        # The misfit is at least the part 2 (sqrt(1 + r^2) - 1) of the exponent; it may grow by one.
        limit = 1.0 + max(found.surroundings, tried["misfit"].min())
        most = EXPONENT_WIDTH * math.sqrt((1.0 + limit / 2.0) ** 2 - 1.0)
        assert found.alone[0, 1] - best[0] < 2.0 * most
        for word in ("damping_ratio", "set 1", "exponent at 1", "groups.pitch_error_amplitude = "):
            assert word in identified.out
        assert identified.out.startswith("3 observations, 2 unknowns\n")
        assert "not determined" not in identified.out and "flat over" not in identified.out
        assert len(tried) <= 360


def test_the_range_of_a_parameter_ends_between_two_steps():
    """The misfit grows by one at a distance of 0.3 from the centre."""
    rungs = 8
    places = np.ravel(steps_alone(np.array([0.5]), rungs))
    tried = np.zeros(places.size, [("run", float), ("values", float, (1,)), ("misfit", float)])
    tried["run"], tried["values"][:, 0] = -1.0, places
    tried["misfit"] = ((places - 0.5) / 0.3) ** 2
    found = reach(tried, rungs)
    assert found.alone[0, 1] - 0.5 == pytest.approx(0.3, rel=0.1)
    assert 0.5 - found.alone[0, 0] == pytest.approx(0.3, rel=0.1)


class TestASearchThatWasStopped:
    def test_goes_on_to_the_same_candidates(self, identified, tmp_path):
        problem, (whole, _) = problem_of(identified), tried_of(identified)
        for name in ("pair.toml", "targets.toml"):
            (tmp_path / name).write_text((identified.folder / name).read_text())
        # A killed process leaves such a file: whole pieces, in the middle of a run.
        first = whole[: 40 + 12 * 7]
        facts = decisive_facts(problem)
        write_tried(tmp_path / "targets.csv", first, problem, facts)
        ended = command(tmp_path, "--resume", "--quiet")
        assert (ended.code, ended.out) == (0, identified.out)
        assert numbers(tmp_path / "targets.csv") == numbers(identified.file)

    def test_keeps_its_candidates_when_it_is_interrupted(self, identified, tmp_path, monkeypatch):
        def check():
            if next(pieces) == 9:
                raise KeyboardInterrupt

        for name in ("pair.toml", "targets.toml"):
            (tmp_path / name).write_text((identified.folder / name).read_text())
        with monkeypatch.context() as interrupted:
            for _ in range(2):
                # The second interrupt comes before the search has reused all known candidates.
                pieces = iter(range(9 if (tmp_path / "targets.csv").exists() else 0, 100))
                interrupted.setattr(searching, "check", check)
                ended = command(tmp_path, "--resume")
                assert ended.code == 130
                assert "candidates in targets.csv are kept; continue with --resume" in ended.err
                assert len(numbers(tmp_path / "targets.csv")) == 1 + 40 + 8 * 12
        ended = command(tmp_path, "--resume")
        assert (ended.code, ended.out) == (0, identified.out)
        assert numbers(tmp_path / "targets.csv") == numbers(identified.file)

    def test_is_complete_where_nothing_is_left(self, identified):
        before = identified.file.stat().st_mtime_ns
        ended = command(identified.folder, "--resume")
        assert (ended.code, ended.out) == (0, identified.out)
        assert identified.file.stat().st_mtime_ns == before

    def test_is_not_replaced_unasked(self, identified):
        ended = command(identified.folder)
        assert ended.code == 4
        assert "exists already; replace it with --overwrite" in ended.err

    def test_is_not_continued_with_other_targets(self, identified):
        ended = command(identified.folder, "--resume", "--set", "search.seed=4")
        assert ended.code == 4
        assert "targets.search.seed (3, now 4)" in ended.err

    @pytest.mark.parametrize("damage", ["cut", "changed", "other"])
    def test_is_not_continued_from_a_damaged_file(self, identified, tmp_path, damage):
        content = bytearray(identified.file.read_bytes())
        if damage == "changed":
            content[len(content) // 2] ^= 1
        file = tmp_path / "damaged.csv"
        file.write_bytes({"cut": content[:-40], "other": b"notes"}.get(damage, content))
        before = file.read_bytes()
        with pytest.raises(FileError, match="damaged"):
            read_tried(file, problem_of(identified))
        assert file.read_bytes() == before


FAULTS = {
    'configuration = "pair.toml"': (
        'configuration = "other.toml"',
        "other.toml: cannot be read: No such file",
    ),
    'name = "damping_ratio"': (
        'name = "dampng_ratio"',
        'parameter[0]: name = "dampng_ratio": is not a parameter that can be swept; did you mean',
    ),
    "low = 0.01": ("low = 0.0", "parameter[0]: low = 0.0 has no logarithm"),
    "high = 0.5": ("high = 0.005", "parameter[0]: high = 0.005 must be greater than low"),
    'name = "pitch_error_amplitude"': (
        'name = "damping_ratio"',
        "parameter: names a parameter twice; name it once",
    ),
    'motion = "period 1"': (
        'motion = "period 0"',
        'stage[0].motion = "period 0": has another form; expected: "period n"',
    ),
    "to = 3.0\nwidth": ("to = 0.5\nwidth", "stage[0]: to = 0.5 must be greater than"),
    f"width = {EXPONENT_WIDTH}": ("width = 0.0", "exponent[0].width = 0.0: must be greater than 0"),
    "drawn = 40": ("drawn = 4", "search: drawn = 4 must be at least population = 12"),
    "[[increment]]": (
        '[[increment]]\ncoordinate = "delta_1"',
        'outputs.section = ["delta_5", "delta_1"]: the scene has no state `delta_1`',
    ),
    "[[exponent]]": (
        "[[jump]]\nat = 1.0\nwithin = [2.0, 3.0]\nwidth = 0.1\n[[exponent]]",
        "jump[0]: within must hold at = 1.0",
    ),
    "seed = 3": ("sed = 3", "search.sed = 3: unknown key; did you mean `seed`?"),
}


@pytest.mark.parametrize("sound", FAULTS)
def test_a_fault_of_the_targets_is_one_clear_message(sound, tmp_path):
    (tmp_path / "pair.toml").write_text(PAIR)
    faulty, message = FAULTS[sound]
    assert TARGETS.count(sound) == 1
    (tmp_path / "targets.toml").write_text(TARGETS.replace(sound, faulty))
    with pytest.raises(Exception) as raised:
        load_targets(tmp_path / "targets.toml")
    (problem,) = raised.value.problems
    assert message in problem
    assert raised.value.exit_code in (2, 4)


def test_errors_of_teeth_are_refused_as_they_do_not_repeat_once_a_mesh_period(tmp_path):
    pair = """\
[pair]
teeth = [21, 38]
normal_module_mm = 2.0
normal_pressure_angle_deg = 20.0
face_width_mm = 15.0

[mesh]
length_scale_um = 20.0

[pitch_error]
kind = "grade"
grade = 7

"""
    (tmp_path / "pair.toml").write_text(pair + PAIR.replace("pitch_error_amplitude = 1.0\n", ""))
    targets = TARGETS.replace('"pitch_error_amplitude"', '"pitch_error_mean"', 1)
    (tmp_path / "targets.toml").write_text(targets)
    with pytest.raises(ConfigurationError) as raised:
        load_targets(tmp_path / "targets.toml")
    (problem,) = raised.value.problems
    assert 'has pitch_error.kind = "grade"; observations have one axis, and a sine' in problem


def test_a_place_off_the_axis_is_refused(tmp_path):
    (tmp_path / "pair.toml").write_text(PAIR.replace("load", "pitch_error = 1.0\nload"))
    swept = 'sweep={parameter="mesh_frequency",values=[1.0]}'
    text = TARGETS.replace("[search]", f"set = ['{swept}']\n[search]", 1)
    (tmp_path / "targets.toml").write_text(text.replace("from = 0.5", "from = -1.0"))
    with pytest.raises(ConfigurationError) as raised:
        load_targets(tmp_path / "targets.toml")
    (problem,) = raised.value.problems
    assert "targets.toml: observed places: sweep.values = -0.97" in problem


def test_bounds_with_which_the_steps_are_unstable_are_refused(identified):
    # Undamped, eq. 13 has the eigenvalues i and -i: RK4 is stable for steps of up to sqrt(8).
    fewest = math.ceil(2.0 * math.pi / FREQUENCY / math.sqrt(8.0))
    few = f'set=["integration.steps_per_period={fewest - 1}"]'
    ended = command(identified.folder, "--overwrite", "--set", few)
    assert (ended.code, ended.out) == (2, "")
    assert f"integration.steps_per_period = {fewest - 1}: RK4 is unstable below" in ended.err
    assert "raise it in `set`" in ended.err
    problem = load_targets(identified.folder / "targets.toml", [few])
    exact = problem.config.replace("integration.method", "flow_map")
    require_stable(exact, np.array([1.0]), problem.targets.corners())
    # Without this key, the steps are those that a search takes by default.
    free = problem.config.replace("integration.steps_per_period", None)
    require_stable(free, np.array([1.0]), problem.targets.corners())


def test_numbers_beside_each_other_stay_apart():
    assert _row("", [-1.2345e-05, -1.2345e-05]).split() == ["-1.2345e-05"] * 2


def test_targets_without_observations_are_refused(tmp_path):
    (tmp_path / "pair.toml").write_text(PAIR)
    (tmp_path / "targets.toml").write_text(TARGETS[: TARGETS.index("[[stage]]")])
    with pytest.raises(ConfigurationError, match="give at least one of stage, jump, crisis"):
        load_targets(tmp_path / "targets.toml")


@pytest.mark.parametrize("name", ["pan2021_targets.toml", "pan2021_axial_targets.toml"])
def test_the_targets_of_the_paper_are_sound(name):
    load_targets(Path(__file__).resolve().parents[2] / "sweeps" / name)
