"""A dict with arrays is run, several keys are replaced at once, and messages are log records."""

import logging
import re

import numpy as np
import pytest

import gearchaos
from gearchaos.progress import complain

from .commands import LINEAR, run_module, small_config
from .tiny_sweep import TINY

SPEEDS = np.linspace(0.5, 0.51, 3)


def tables() -> dict:
    """Return the tiny sweep as a user writes it in Python, with NumPy arrays and numbers."""
    return {
        "title": "a spur pair",
        "groups": {
            "mesh_frequency": np.float64(0.9),
            "load": 0.1,
            "damping_ratio": 0.05,
            "base_helix_angle_deg": 0.0,
            "half_backlash": 1.0,
            "pitch_error_amplitude": 0.1,
            "stiffness_cosine": np.array([0.1]),
        },
        "scene": {"effects": ["pitch_error", "stiffness_variation", "backlash"]},
        "start": {"kind": "contact"},
        "sweep": {"parameter": "mesh_frequency", "values": SPEEDS},
        "integration": {
            "method": "flow_map",
            "transient_periods": np.int64(5),
            "recorded_periods": 5,
        },
        "outputs": {"section_points": 5, "motion": False},
    }


def test_a_dict_with_arrays_is_run():
    result = gearchaos.run(tables())
    assert np.array_equal(result["mesh_frequency"], SPEEDS)
    config = gearchaos.Configuration.from_toml(TINY)
    config = config.replace("sweep", {"parameter": "mesh_frequency", "values": SPEEDS})
    assert np.array_equal(gearchaos.run(config)["end_state"], result["end_state"])
    system = gearchaos.System(tables(), mesh_frequency=0.5)
    assert system.mesh_period == pytest.approx(4.0 * np.pi)


@pytest.mark.parametrize(
    "wrong",
    [
        {"groups": {"load": "x"}},
        {"sweep": None},
        {"sweep": [1, 2]},
        {"nothing": {}},
        {1: 2},
        {"model": {"kind": []}},
        {"groups": np.zeros(3)},
        {"sweep": {"parameter": "load", "values": np.array(["a"])}},
    ],
)
def test_wrong_tables_are_a_gearchaos_error(wrong):
    for given in ({**tables(), **wrong}, wrong):
        with pytest.raises(gearchaos.GearchaosError):
            gearchaos.run(given)


def test_several_keys_are_replaced_at_once_and_checked_together():
    config = gearchaos.Configuration.from_toml(TINY)
    # Replaced one by one, these keys would break a rule.
    lists = {"sweep.from": None, "sweep.to": None, "sweep.count": None, "sweep.values": SPEEDS}
    assert config.replace(lists).sweep.values == tuple(SPEEDS.tolist())
    changed = config.replace({"sweep.parameter": "load", "sweep.from": 0.1, "sweep.to": 0.2})
    assert changed.sweep.parameter == "load" and changed.sweep.to == 0.2
    with pytest.raises(gearchaos.GearchaosError, match="a path is a text"):
        config.replace({1: 2})
    with pytest.raises(gearchaos.GearchaosError, match="title is not a table"):
        config.replace({"title.x": 2})


def test_the_package_has_a_version():
    assert gearchaos.__version__ == gearchaos.software_version()


def test_a_log_has_all_messages_with_time_and_level(tmp_path):
    small_config(tmp_path)
    width = ("--set", "pair.face_width_mm=15000", "--set", "integration.unstable=raise")
    given = ("gears.toml", *LINEAR, *width, "--quiet", "--log", "run.log")
    assert run_module("gearchaos.sweep", *given, cwd=tmp_path).code == 0
    # A second run appends.
    assert run_module("gearchaos.sweep", *given, cwd=tmp_path).code == 4
    lines = (tmp_path / "run.log").read_text().splitlines()
    form = r"\d{4}-\d\d-\d\d [\d:,]+ (INFO|WARNING|ERROR) gearchaos\.sweep: \S.*"
    assert all(re.fullmatch(form, line) for line in lines)
    assert any("WARNING" in line and "pair.face_width_mm" in line for line in lines)
    assert any("40 lanes, 0 diverged" in line for line in lines)
    assert "ERROR" in lines[-1] and "gears.h5" in lines[-1]
    nowhere = ("gears.toml", "--log", "no/folder/run.log")
    ended = run_module("gearchaos.sweep", *nowhere, cwd=tmp_path)
    assert ended.code == 4 and "--log no/folder/run.log: cannot be written" in ended.err


def test_messages_are_records_of_the_standard_logging(caplog, capsys, monkeypatch):
    # Another package in this process may have disabled all existing loggers.
    monkeypatch.setattr(logging.getLogger("gearchaos"), "disabled", False)
    monkeypatch.setattr(logging.getLogger("gearchaos"), "propagate", True)
    with caplog.at_level(logging.INFO, "gearchaos"):
        complain("a warning")
    assert ("gearchaos", logging.WARNING, "a warning") in caplog.record_tuples
    # Without a handler, the message is printed only once.
    assert capsys.readouterr().err.count("a warning") == 1
