"""Machines given by matrices: valid configurations, and messages for invalid ones."""

import json
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import gearchaos
from gearchaos import figures
from gearchaos.engine.run_plan import plan_run

from .commands import run_module

TEXT = (Path(__file__).parents[2] / "sweeps" / "two_masses.toml").read_text()
SHORT = {"outputs.section_points": 20, "integration.steps_per_period": 200}
SHORT |= {"integration.transient_periods": 20, "integration.recorded_periods": 20}


def read(text, folder=None):
    return gearchaos.Configuration.from_toml(text, "my.toml", (), folder)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass = [1.0, 1.0]", "mass = [1.0, 0.0]", "model.mass = [1.0, 0.0]: is singular"),
        ("mass = [1.0, 1.0]", "mass = [1.0]", "must have 2 rows and columns"),
        ("mass = [1.0, 1.0]", "mass = [[0.1, 1.0], [1.0, 0.1]]", "is not positive definite"),
        ("[-1.0, 2.0]]", "[-1.0]]", "model.stiffness = [[1.0, -1.0], [-1.0]]: must have 2 rows"),
        ("stiffness = 100.0\n", "", "clearance.stop.stiffness: is missing"),
        ("stiffness = 100.0", "stiffness = 0.0", "must be greater than 0, otherwise"),
        ("gap = { x1", "gap = { x3", "names x3, which is none of model.coordinates"),
        ("gap = { x1 = 1.0 }", "gap = {}", "clearance.stop.gap = {}: needs at least 1 value(s)"),
        (
            "gap = { x1 = 1.0 }",
            "gap = { x1 = 0.0 }",
            "has no coordinate with a factor other than 0",
        ),
        ("stiffness = 100.0", "stiffness = { mean = -1.0 }", "must be at least 0"),
        ("stiffness = 100.0", "stiffness = -1.0", "stiffness = -1.0: must be at least 0"),
        ("stiffness = 100.0", "stiffness = { mean = 1.0, sin = [1.0] }", "did you mean `sine`?"),
        ("stiffness = 100.0", "stiffness = true", "clearance.stop.stiffness = true: must be a num"),
        ("stiffness = 100.0", 'stiffness = { shape = "tabel" }', 'must be "fourier" or "table"'),
        ("on = { x2", "on = { y2", "force.drive.on"),
        ("half_clearance = 1.0", "half_clearance = -1.0", "must be at least 0"),
        ('parameter = "frequency"', 'parameter = "frequenzy"', "did you mean `frequency`?"),
        ('["x1", "x2"]\ncontact', '["x1", "y2"]\ncontact', "the machine has no state `y2`"),
        ('kind = "linear"', 'kind = "liner"', "is the name of no model"),
        ("[clearance.stop]", "[[clearance]]", "entry 1 has no name"),
        ("mass = [1.0, 1.0]", 'mass = "none.csv"', "check the path of the file with a matrix"),
        ("one_sided = true", "onesided = true", "did you mean `one_sided`?"),
        ('coordinates = ["x1", "x2"]', 'coordinates = ["x1", "x1"]', "is listed twice"),
        ("[start]", '[scene]\neffects = ["backlash"]\n[start]', "leave it out"),
        ("[-1.0, 2.0]]", "[-1.0, 1.0]]", None),
    ],
)
def test_a_machine_that_cannot_be_is_refused_in_a_sentence(tmp_path, old, new, message):
    assert TEXT.count(old) >= 1
    if message is None:
        # The stop alone holds the machine, which is sufficient.
        read(TEXT.replace(old, new, 1))
        return
    with pytest.raises(gearchaos.ConfigurationError) as refused:
        read(TEXT.replace(old, new, 1), str(tmp_path))
    assert message in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_a_sweep_over_negative_stiffnesses_is_refused():
    text = TEXT.replace('parameter = "frequency"', 'parameter = "clearance.stop.stiffness"')
    with pytest.raises(gearchaos.ConfigurationError, match=r"clearance\.stop\.stiffness must be"):
        read(text.replace("from = 0.55", "from = -10.0"))


def test_a_machine_that_is_unstable_is_computed_with_a_remark():
    # A follower force makes one of the two modes grow.
    text = TEXT.replace("[[1.0, -1.0], [-1.0, 2.0]]", "[[1.0, -1.0], [1.0, 2.0]]")
    text = text.replace("stiffness = 100.0", "stiffness = 0.01")
    config = read(text.replace("{ stiffness = 0.03 }", "[0.0, 0.0]"))
    notes = plan_run(config.replace("sweep.count", 2)).notes
    assert sum("the machine is unstable in 100% of the lanes" in note for note in notes) == 1
    notes = plan_run(read(TEXT).replace("sweep.count", 2)).notes
    assert not any("unstable" in note for note in notes)


def test_a_machine_that_nothing_holds_is_refused():
    free = TEXT.replace("[-1.0, 2.0]]", "[-1.0, 1.0]]").replace(
        "{ x1 = 1.0 }", "{ x1 = 1.0, x2 = -1.0 }"
    )
    with pytest.raises(gearchaos.ConfigurationError, match="no spring holds x1, x2"):
        read(free)


def test_a_matrix_may_be_a_file_and_an_element_an_entry_of_a_list(tmp_path):
    (tmp_path / "stiffness.csv").write_text("1.0,-1.0\n-1.0,2.0\n")
    text = TEXT.replace("[[1.0, -1.0], [-1.0, 2.0]]", '"stiffness.csv"')
    text = text.replace("[clearance.stop]", '[[clearance]]\nname = "stop"')
    config, given = read(text, str(tmp_path)), read(TEXT)
    assert config.model == given.model and config.clearance == given.clearance
    # A result keeps the content of the file, so that reading the result does not need the file.
    assert read(config.text).model == given.model


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """Return the folder of a short sweep of the machine in both directions."""
    folder = tmp_path_factory.mktemp("machine")
    (folder / "machine.toml").write_text(TEXT)
    short = [f"--set={path}={value}" for path, value in SHORT.items()]
    options = ["--set=sweep.count=3", "--set=outputs.loads=true", "--quiet", *short]
    ended = run_module("gearchaos.sweep", "machine.toml", *options, cwd=folder)
    assert ended.code == 0, ended.err
    return folder


def test_a_result_names_coordinates_and_elements(swept):
    result = gearchaos.open_result(swept / "machine.h5")
    assert result.axes == ("frequency", "direction")
    wanted = {"section_x1", "section_x2", "force_largest_stop", "gap_mean_stop"}
    assert wanted | {"contact_state_stop"} <= {*result}
    ended = run_module(
        "gearchaos.response",
        "machine.h5",
        "--at=frequency=0.8",
        "--at=direction=upwards",
        "--periods=8",
        "-o",
        "r.h5",
        cwd=swept,
    )
    assert ended.code == 0, ended.err
    motion = gearchaos.open_result(swept / "r.h5")
    assert {"x1", "x1_rate", "x1_acceleration", "force_stop", "contact_stop"} <= {*motion}
    ended = run_module("gearchaos.plot", "r.h5", "-o", "r.png", cwd=swept)
    assert ended.code == 0, ended.err
    # By default the first coordinate is drawn.
    axes = Figure().add_subplot()
    for draw in (figures.time_history, figures.phase_portrait, figures.amplitude_spectrum):
        draw(axes, motion, 0)
        assert r"x_{\mathrm{1}}" in axes.get_ylabel()


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (["stages", "machine.h5"], "stages over frequency"),
        (["info", "machine.h5", "--verify"], "force_largest_stop (frequency, direction) float64"),
        (["plot", "machine.h5", "--variable=force_largest_stop", "-o", "f.png"], "f.png"),
        (["plot", "machine.h5", "--stages", "--at=direction=upwards", "-o", "t.png"], "t.png"),
        (["export", "machine.h5", "machine.csv"], "machine.csv"),
        (
            ["sweep", "machine.toml", "--set=sweep.count=3", "--dry-run"],
            "resonances with the excitation",
        ),
    ],
    ids=lambda one: " ".join(one) if isinstance(one, list) else "",
)
def test_commands_know_a_machine(swept, command, said):
    ended = run_module(f"gearchaos.{command[0]}", *command[1:], cwd=swept)
    assert ended.code == 0, ended.err
    assert said in ended.out + ended.err
    assert "mesh frequency" not in ended.out + ended.err


def test_a_dry_run_of_a_machine_is_json(swept):
    asked = ["machine.toml", "--set=sweep.count=3", "--dry-run", "--json"]
    ended = run_module("gearchaos.sweep", *asked, cwd=swept)
    assert "NaN" not in ended.out
    assert json.loads(ended.out)["eigenfrequencies"][0][0] == pytest.approx(1.41, abs=0.01)


def test_the_spectrum_of_a_machine_is_that_of_its_first_coordinate():
    config = read(TEXT).replace("start", {"kind": "rest"})
    system = gearchaos.System(config.replace("integration.steps_per_period", 200), frequency=0.7)
    lines = system.spectrum(periods=8)
    assert lines.order[np.argmax(lines.amplitude)] == 1.0
    assert np.array_equal(lines.amplitude, system.spectrum("x1", periods=8).amplitude)


def test_any_number_of_a_machine_can_be_swept():
    config = read(TEXT)
    assert {"frequency", "clearance.stop.half_clearance", "force.drive.amplitude"} <= {
        *config.parameters
    }
    for path, value in SHORT.items():
        config = config.replace(path, value)
    config = config.replace("start.carry", "none").replace("outputs.lyapunov", False)
    stop = {"parameter": "clearance.stop.half_clearance", "values": [0.5, 1e9]}
    drive = {"parameter": "force.drive.amplitude", "values": [0.05, 0.1]}
    config = config.replace("sweep", stop).replace("second_sweep", drive)
    result = gearchaos.run(config.replace("model.frequency", 0.5))
    section = result["section_x1"]
    assert section.shape[:2] == (2, 2)
    # Without contact with the stop the machine is linear: the motion is proportional to the force.
    np.testing.assert_allclose(section[1, 1], 2.0 * section[0, 1], rtol=1e-9)


def test_threads_that_share_a_configuration_get_the_machines_of_their_own_values(request):
    request.addfinalizer(partial(sys.setswitchinterval, sys.getswitchinterval()))
    sys.setswitchinterval(1e-6)
    config = read(TEXT)
    path = "clearance.stop.half_clearance"

    def right(value):
        found = [config.machine({path: value}).half_clearance[0] for _ in range(2000)]
        return set(found) == {value}

    with ThreadPoolExecutor(4) as threads:
        assert all(threads.map(right, (0.5, 1.0, 1.5, 2.0)))
