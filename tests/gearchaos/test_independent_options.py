"""Recorded outputs, and the steps of exact methods, do not change the results of a sweep."""

from functools import cache

import numpy as np
import pytest

import gearchaos

from .short_sweeps import MASSES

SHORT = (
    "sweep={parameter='frequency',values=[0.6,0.62,0.63,0.645,0.66,0.8]}",
    "start.carry='none'",
    "integration.transient_periods=20",
    "integration.recorded_periods=24",
    "outputs.section_points=24",
)
CONTACT = ("outputs.contact=true",)
LOADS = ("outputs.loads=true",)
EVERYTHING = (
    *CONTACT,
    *LOADS,
    "outputs.states=['x1','x1_rate']",
    "outputs.orders=['1/2',1,2,30]",
    "outputs.exponents=true",
)
ROUNDING = 1e-9
"""Tolerance relative to the largest value: one lane is chaotic and amplifies rounding errors."""
SAMPLED = ("force_", "gap_", "x1_", "orbit_", "amplitude_")
"""Prefixes of loads, extremes and amplitudes: samples along a step only approximate them."""


@cache
def result(method: str, *overrides: str):
    """Return a sweep of the two masses over motions with many contacts."""
    given = [f"integration.method='{method}'", *SHORT, *overrides]
    return gearchaos.run(gearchaos.load_config(MASSES, given))


def assert_alike(found, wanted, but: tuple[str, ...] = ()) -> None:
    """Compare all numbers that two results have in common, up to rounding."""
    common = [name for name in found if name in wanted and found[name].dtype.kind in "fiu"]
    assert len(common) >= 20
    for name in common:
        if not name.startswith(but):
            close = ROUNDING * np.nanmax(np.abs(wanted[name]), initial=1.0)
            np.testing.assert_allclose(found[name], wanted[name], 0.0, close, err_msg=name)


@pytest.mark.parametrize("method", ["rk4", "flow_map", "taylor"])
@pytest.mark.parametrize("outputs", [(), LOADS, EVERYTHING], ids=["none", "loads", "everything"])
def test_what_is_recorded_does_not_change_what_is_found(method, outputs):
    assert_alike(result(method, *outputs), result(method, *CONTACT))


@pytest.mark.parametrize("method", ["flow_map", "taylor"])
@pytest.mark.parametrize("steps", [1, 2, 3, 7, 60])
def test_exact_methods_find_the_same_with_any_steps(method, steps):
    found = result(method, *CONTACT, f"integration.steps_per_period={steps}")
    assert_alike(found, result(method, *CONTACT))
    # Crossings are exact: the record of a long sweep depends on the contact, not on the steps.
    assert found["crossings_per_period"].max() > 1.0


@pytest.mark.parametrize("method", ["flow_map", "taylor"])
@pytest.mark.parametrize("steps", [7, 60])
def test_loads_of_exact_methods_depend_on_steps_by_their_sampling_only(method, steps):
    found = result(method, *EVERYTHING, f"integration.steps_per_period={steps}")
    wanted = result(method, *EVERYTHING)
    assert_alike(found, wanted, SAMPLED)
    for name in wanted:
        if name.startswith(SAMPLED) and wanted[name].dtype.kind == "f":
            size = np.nanmax(np.abs(wanted[name]))
            np.testing.assert_allclose(found[name], wanted[name], 0.0, 5e-3 * size, err_msg=name)


@pytest.mark.parametrize("steps", [1, 7, 60])
def test_loads_of_flow_maps_alone_are_exact(steps):
    found = result("flow_map", *LOADS, f"integration.steps_per_period={steps}")
    assert_alike(found, result("flow_map", *LOADS))


def test_exact_methods_find_the_same_motions():
    for name in ("section_x1", "lyapunov_exponent", "time_driving_stop", "impacts_driving_stop"):
        one, other = (result(method, *CONTACT)[name] for method in ("flow_map", "taylor"))
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-10, err_msg=name)
