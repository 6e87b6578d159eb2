"""The whole program runs an unknown model: sweeps, labels, orbits, files."""

import numpy as np
import pytest

import gearchaos
from gearchaos.dynamics.orbits import polish
from gearchaos.dynamics.plans import plan_of
from gearchaos.engine.resonances import resonances
from gearchaos.engine.run_plan import plan_run
from gearchaos.models.declared import declare_model
from gearchaos.models.registry import system_of

from ..kernels.oscillator import Oscillators

METHODS = ("rk4", "flow_map")
DEFAULTS = {"damping": 0.05, "half_clearance": 1.0, "load": 0.1, "amplitude": 0.1}
OscillatorConfiguration = declare_model("oscillator", Oscillators, ("stop",), **DEFAULTS)
SWEEP = {"parameter": "frequency", "from": 0.4, "to": 1.9, "count": 16}


def configured(method, **more):
    """Return a sweep of the oscillator over its frequency."""
    tables = {
        "sweep": SWEEP,
        "integration": {"method": method, "transient_periods": 300, "recorded_periods": 300},
        "outputs": {"section": ["x", "x_rate"], "contact": True},
    }
    return OscillatorConfiguration.from_tables({**tables, **more})


@pytest.fixture(scope="module", params=METHODS)
def result(request):
    return gearchaos.run(configured(request.param))


def linear_response(frequency):
    """Return x and x' at tau = 0 and the amplitude of a motion on the flank, in closed form."""
    wave = 0.1 / (1.0 - frequency**2 + 0.1j * frequency)
    return np.stack([1.1 + wave.real, -frequency * wave.imag], axis=1), np.abs(wave)


def test_what_stays_on_the_flank_is_periodic_and_the_linear_response(result):
    section, size = linear_response(result["frequency"])
    held = (size < 0.1) & (result["contact_state_stop"] == 0)
    assert np.count_nonzero(held) >= 3
    assert (result["period"][held] == 1).all()
    found = np.stack([result["section_x"], result["section_x_rate"]], axis=2)[held, -1]
    assert found == pytest.approx(section[held], abs=2e-6)
    assert result["lyapunov_exponent"][held] == pytest.approx(-0.05, abs=1e-4)
    assert result["time_driving_stop"][held] == pytest.approx(1.0)


def test_the_mass_leaves_the_flank_near_the_resonance(result):
    loose = result["time_apart_stop"] > 0.0
    assert loose.any() and (result["impacts_driving_stop"][loose] > 0.0).any()


def test_both_methods_find_the_same_periods():
    one, other = (gearchaos.run(configured(method)) for method in METHODS)
    alike = (one["period"] > 0) & (one["period"] == other["period"])
    assert np.count_nonzero(alike) >= 12


@pytest.mark.parametrize("method", METHODS)
def test_an_orbit_closes_and_has_the_multipliers_of_its_damping(method):
    config = configured(method)
    frequency = np.array([1.6, 1.9])
    system = system_of(config, {"frequency": frequency})
    section, _ = linear_response(frequency)
    orbits = polish(system, 1.001 * section, np.array([1, 1], dtype=np.int32), plan_of(config))
    assert orbits.converged.all() and orbits.stable.all()
    assert orbits.points == pytest.approx(section, abs=1e-6)
    assert np.abs(orbits.multipliers[:, 0]) == pytest.approx(
        np.exp(-0.05 * 2.0 * np.pi / frequency), rel=1e-6
    )


def test_a_file_of_it_has_its_own_names(tmp_path):
    result = gearchaos.run(configured("rk4"))
    result.save(tmp_path / "oscillator.h5")
    again = gearchaos.open_result(tmp_path / "oscillator.h5")
    assert again.variables["section_x"].long_name == "displacement of x at the stroboscopic section"
    assert np.array_equal(again["section_x"], result["section_x"])


def test_its_eigenfrequency_is_reported_before_a_run():
    (found,) = resonances(plan_run(configured("rk4")).lanes).frequencies
    assert found == pytest.approx(np.sqrt(1.0 - 0.05**2))


def test_an_unknown_parameter_names_those_of_the_model():
    with pytest.raises(gearchaos.ConfigurationError, match="did you mean `damping`"):
        configured("rk4", sweep={**SWEEP, "parameter": "dampingg"})


@pytest.mark.parametrize(
    ("elements", "defaults", "said"),
    [(("stop",), {"mass": 1.0}, "mass"), (("one", "other"), {}, "number of elements")],
)
def test_a_declaration_that_does_not_fit_the_lanes_is_refused(elements, defaults, said):
    with pytest.raises(ValueError, match=said):
        declare_model("other_oscillator", Oscillators, elements, **defaults)
    with pytest.raises(gearchaos.ConfigurationError, match="is the name of no model"):
        gearchaos.run({"model": {"kind": "other_oscillator"}, "sweep": SWEEP})
