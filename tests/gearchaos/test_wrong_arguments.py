"""Every wrong argument of the public functions raises a GearchaosError with a sentence."""

from pathlib import Path

import numpy as np
import pytest

import gearchaos
from gearchaos.errors import GearchaosError

from .commands import LINEAR, small_config

NOT_WHOLE = (0, -1, 1.5, "2", None, [3], np.nan, True)
NOT_A_STATE = ("x", [], [1.0], np.zeros((3, 2)), [np.nan, 0.0], [[0.0, "x"]], {"delta_5": 0.0})
NOT_A_NUMBER = ("x", None, [1.0], np.nan, np.inf, 10**400, {})


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    settled = ("sweep.count=3", "integration.transient_periods=300")
    # Other tests have already compiled this scene with two states.
    scene = "scene.effects=['pitch_error', 'stiffness_variation', 'backlash']"
    overrides = (*LINEAR[1::2], *settled, scene)
    return gearchaos.load_config(small_config(tmp_path_factory.mktemp("wrong")), overrides)


@pytest.fixture(scope="module")
def system(config):
    return gearchaos.System(config, pitch_error=1.0)


@pytest.fixture(scope="module")
def result(config):
    return gearchaos.run(config)


def refused(function, *arguments, **named):
    """Check that a call is refused in sentences that say what is wrong."""
    with pytest.raises(GearchaosError) as caught:
        function(*arguments, **named)
    for sentence in caught.value.problems:
        assert ": " in sentence and len(sentence) > 20


@pytest.mark.parametrize("wrong", [3, None, 2.5, [], {"scene": {}}, object(), b"\xff", Path("/")])
def test_what_is_no_path_and_no_configuration(wrong):
    for function in (gearchaos.run, gearchaos.respond, gearchaos.System, gearchaos.load_config):
        refused(function, wrong)
    refused(gearchaos.open_result, wrong)


def test_a_path_of_bytes_is_a_path(tmp_path):
    path = small_config(tmp_path)
    assert gearchaos.load_config(bytes(path)) == gearchaos.load_config(path)


@pytest.mark.parametrize("wrong", ["sweep.count=3", 3, [3], [None], ["sweep.count"], [b"a=1"]])
def test_overrides_that_are_none(wrong, tmp_path):
    refused(gearchaos.load_config, small_config(tmp_path), wrong)


@pytest.mark.parametrize("wrong", NOT_WHOLE)
def test_whole_numbers_that_are_none(wrong, config, system):
    refused(system.integrate, wrong)
    refused(system.spectrum, "delta_5", wrong)
    refused(system.response, wrong)
    refused(system.orbit, wrong)
    refused(gearchaos.respond, config, wrong)
    if wrong is not None:
        refused(gearchaos.run, config, threads=wrong)
        refused(gearchaos.respond, config, threads=wrong)
    if wrong != 0 or wrong is False:
        refused(system.integrate, 1, transient=wrong)


@pytest.mark.parametrize("wrong", NOT_A_STATE)
def test_states_that_are_none(wrong, system):
    refused(system.integrate, 1, start=wrong)
    refused(system.exponents, wrong)
    refused(system.orbit, 1, wrong)


@pytest.mark.parametrize("wrong", ["x", 3, [], "delta_3"])
def test_a_name_that_is_none_is_refused_before_anything_is_integrated(wrong, system, monkeypatch):
    monkeypatch.setattr(type(system), "integrate", None)
    refused(system.spectrum, wrong)


@pytest.mark.parametrize("wrong", NOT_A_NUMBER)
def test_numbers_that_are_none(wrong, config, system, result):
    refused(gearchaos.System, config, pitch_error=wrong)
    refused(gearchaos.System, config, {"pitch_error": wrong})
    refused(result.sel, pitch_error=wrong)
    refused(gearchaos.System.of_lane, result, pitch_error=wrong)
    orbit = system.orbit()
    refused(system.follow, orbit, "pitch_error", wrong, 2.0)
    refused(system.follow, orbit, "pitch_error", 1.0, wrong)
    refused(system.follow, orbit, "pitch_error", 1.0, 2.0, wrong)


@pytest.mark.parametrize("wrong", ["x", 3, None, [], "pair.nonsense"])
def test_other_arguments_of_another_kind(wrong, config, system, result):
    orbit = system.orbit()
    refused(gearchaos.System, config, wrong or {"x": 1.0})
    refused(gearchaos.System.of_lane, wrong)
    refused(system.follow, wrong, "pitch_error", 1.0, 2.0)
    refused(system.follow, orbit, wrong, 1.0, 2.0)
    refused(system.follow, orbit._replace(point=np.zeros(10)), "pitch_error", 1.0, 2.0)
    refused(system.mesh_motion, wrong)
    refused(result.along, wrong)
    refused(result.sel, wrong or "x", pitch_error=0.0)
    refused(result.sel, **{str(wrong): 0.0})
    if not isinstance(wrong, str):
        refused(result.save, wrong)


def test_limits_beyond_the_grades_are_an_error_of_gearchaos():
    refused(gearchaos.iso1328.single_pitch_um, 13, 2.0, 50.0)
    with pytest.raises(ValueError, match="grades 0 to 12"):
        gearchaos.iso1328.cumulative_pitch_um(13, 2.0, 50.0)
