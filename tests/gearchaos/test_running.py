"""The Python interface takes a configuration and returns the arrays of the command's file."""

import numpy as np
import pytest

import gearchaos

from .commands import SMALL, run_module, same_data, small_config, sweep


@pytest.fixture
def config(tmp_path):
    path = small_config(tmp_path)
    return lambda *overrides: gearchaos.load_config(path, overrides)


@pytest.mark.parametrize(
    "overrides",
    [
        ["sweep.count=200"],
        ["sweep.count=9", "start.kind=random", "start.count=7", "start.seed=3"],
        ["sweep.count=9", "start.kind=random", "start.count=7", "start.carry=downwards"],
        ["start.carry=upwards", "outputs.section=[]"],
    ],
    ids=["plain", "random", "random, carried", "carried, no section"],
)
def test_python_and_the_command_give_the_same_bits(tmp_path, config, overrides):
    flags = [word for override in overrides for word in ("--set", override)]
    assert sweep(tmp_path, *flags, "--quiet").code == 0
    in_memory = gearchaos.run(config(*overrides))
    if overrides == ["sweep.count=200"]:
        (tmp_path / "longer.toml").write_text(SMALL.replace("count = 40", "count = 200"))
        assert same_data(gearchaos.run(tmp_path / "longer.toml"), in_memory)
    assert same_data(gearchaos.open_result(tmp_path / "gears.h5"), in_memory)


def test_the_number_of_threads_changes_no_bit(tmp_path, config):
    for threads in (1, 2):
        flags = ["--set", "sweep.count=300", "--threads", str(threads), "--output", f"{threads}.h5"]
        ended = sweep(tmp_path, *flags, "--quiet")
        if ended.code == 2:
            pytest.skip("the machine has a single core")
        assert ended.code == 0
    one, two = (gearchaos.open_result(tmp_path / f"{threads}.h5") for threads in (1, 2))
    assert (one.metadata["threads"], two.metadata["threads"]) == (1, 2)
    assert same_data(one, two)
    assert same_data(one, gearchaos.run(config("sweep.count=300"), threads=1))


def test_more_threads_than_cores_are_refused(config):
    with pytest.raises(gearchaos.ConfigurationError, match="threads = 9999: must be between 1"):
        gearchaos.run(config(), threads=9999)


def test_a_run_says_nothing_unless_it_is_asked_to(config, capfd):
    gearchaos.run(config())
    assert capfd.readouterr() == ("", "")
    gearchaos.run(config(), progress=True)
    out, err = capfd.readouterr()
    assert out == ""
    assert "40 of 40 lanes" in err


def test_what_a_silent_run_has_to_note_is_reported_by_its_result(tmp_path, config, capfd):
    overrides = ["groups.stiffness_variation_scale=9.0", "integration.steps_per_period=24"]
    result = gearchaos.run(config(*overrides, 'integration.unstable="raise"'))
    assert capfd.readouterr() == ("", "")
    notes = result.metadata["notes"].splitlines()
    assert [note for note in notes if "the mesh stiffness falls to" in note]
    result.save(tmp_path / "noted.h5")
    told = " ".join(run_module("gearchaos.info", "noted.h5", cwd=tmp_path).out.split())
    for note in notes:
        assert note in told


def test_a_saved_run_is_read_back_as_it_was(tmp_path, config):
    result = gearchaos.run(config())
    result.save(tmp_path / "saved.h5")
    read = gearchaos.open_result(tmp_path / "saved.h5")
    assert same_data(result, read)
    assert read.metadata["title"] == "a small sweep"
    assert read.metadata["configuration"] == SMALL


def test_random_starts_depend_on_the_seed_and_on_nothing_else(config):
    random = ("start.kind=random", "start.count=4", "integration.transient_periods=1")
    one = gearchaos.run(config(*random))
    assert same_data(one, gearchaos.run(config(*random)))
    other = gearchaos.run(config(*random, "start.seed=1"))
    assert not (one["end_state"] == other["end_state"]).any()
    assert one.axes == ("pitch_error", "start")
    assert one["start"].tolist() == [0, 1, 2, 3]
    assert one["pitch_error"] == pytest.approx(np.linspace(0.0, 5.0, 40))
    longer = gearchaos.run(config(*random, "sweep={parameter='pitch_error', values=[0.0, 9.0]}"))
    assert np.array_equal(longer["end_state"][0], one["end_state"][0])


def test_a_carried_sweep_begins_where_its_neighbour_ended(config):
    upwards = gearchaos.run(config("start.carry=upwards"))
    alone = gearchaos.run(config())
    assert np.array_equal(upwards["end_state"][0], alone["end_state"][0])
    assert not np.array_equal(upwards["end_state"][1], alone["end_state"][1])
    names = list(upwards.variables["state"].flags)
    ended = dict(zip(names, upwards["end_state"][0].tolist(), strict=True))
    given = "{" + ", ".join(f"{name}={value!r}" for name, value in ended.items()) + "}"
    value = float(upwards["pitch_error"][1])
    second = gearchaos.run(
        config(f"sweep.from={value!r}", "sweep.count=1", "start.kind=given", f"start.state={given}")
    )
    assert np.array_equal(second["end_state"][0], upwards["end_state"][1])
    assert np.array_equal(second["section_delta_5"][0], upwards["section_delta_5"][1])


def test_a_diverged_lane_leaves_its_neighbours_untouched(config):
    # The first load drives its lane beyond every length scale.
    mixed, tame = (
        gearchaos.run(config(f"sweep={{parameter='load', values={values}}}"))
        for values in ([-1e150, 0.4, 0.5], [0.4, 0.5])
    )
    assert mixed["status"].tolist() == [1, 0, 0]
    for name in ("end_state", "section_delta_5", "lyapunov_exponent"):
        assert np.array_equal(mixed[name][1:], tame[name])
