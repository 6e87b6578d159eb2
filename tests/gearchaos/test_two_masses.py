"""Bifurcations of two masses and a stop agree with an independent computation.

The stored values come from event-located matrix exponentials, shooting and arclength continuation.
"""

import json
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import gearchaos

from .commands import run_module

CONFIG = Path(__file__).parents[2] / "sweeps" / "two_masses.toml"
EXACT = json.loads((Path(__file__).parents[1] / "data" / "continuation.json").read_text())
POINTS = EXACT["two_masses"]
STEPS = 1600
"""Steps per period; the errors of the points below are those of RK4 with these steps."""


def system(frequency, state=None):
    """Return the masses at one frequency, starting at a state of x1, x1', x2, x2'."""
    config = gearchaos.load_config(CONFIG).replace("integration.steps_per_period", STEPS)
    config = config.replace("start", {"kind": "rest"})
    if state is not None:
        named = dict(zip(("x1", "x1_rate", "x2", "x2_rate"), map(float, state), strict=True))
        config = config.replace("start", {"kind": "given", "state": named})
    return gearchaos.System(config, frequency=frequency)


@cache
def impacting(frequency):
    """Return the orbit that meets the stop, reached from 0.64 in small steps of the frequency."""
    guess = system(0.64).orbit().point
    for passed in (*np.arange(0.66, frequency, 0.02), frequency):
        found = system(float(passed), guess).orbit()
        guess = found.point
    return found


@pytest.mark.parametrize(
    ("begin", "end", "kind", "exact"),
    [
        (0.70, 0.75, "period doubling", POINTS["period_doubling"][1]),
        (0.70, 0.61, "Neimark-Sacker", POINTS["neimark_sacker"][0]),
    ],
)
def test_the_impacting_orbit_loses_stability_where_it_should(begin, end, kind, exact):
    lost = system(begin).follow(impacting(begin), "frequency", begin, end, width=1e-9)
    assert lost.text.startswith(kind)
    assert lost.value == pytest.approx(exact, abs=1e-8)


@pytest.mark.parametrize("exact", POINTS["grazing"])
def test_the_linear_motion_reaches_the_stop_at_the_grazing_points(exact):
    for frequency, meets in ((exact - 1e-8, exact < 0.62), (exact + 1e-8, exact > 0.62)):
        stiffness, mass = np.array([[1.0, -1.0], [-1.0, 2.0]]), np.eye(2)
        response = np.linalg.solve(
            stiffness * (1.0 + 0.03j * frequency) - frequency**2 * mass, [0.0, 0.1]
        )
        start = np.stack([response.real, -frequency * response.imag], axis=1).ravel()
        motion = system(frequency, start).integrate(1)
        assert (np.abs(response[0]) > 1.0) == (not meets)
        assert np.ptp(motion.states[:, 0]) / 2.0 == pytest.approx(1.0, abs=1e-4)


@pytest.mark.slow
def test_what_it_prints_and_draws_has_no_words_of_gears(tmp_path):
    few = ("sweep.count=3", "integration.transient_periods=60", "integration.recorded_periods=100")
    words = [word for one in (*few, "start.carry=none") for word in ("--set", one)]
    calls = (
        ("sweep", str(CONFIG), *words),
        ("response", "two_masses.h5", "--at", "0.7", "-o", "lane.h5"),
        ("plot", "lane.h5", "--format", "svg"),
        ("plot", "two_masses.h5", "--format", "svg"),
        ("branches", "two_masses.h5", "--periods", "1"),
        ("info", "two_masses.h5", "--json"),
        ("info", "lane.h5", "--json"),
    )
    said = [run_module(f"gearchaos.{name}", *words, cwd=tmp_path) for name, *words in calls]
    assert [one.code for one in said] == [0] * len(said)
    written = [path.read_text(encoding="utf-8") for path in tmp_path.glob("*.svg")]
    assert len(written) == 2
    for text in (*(one.out + one.err for one in said), *written):
        # The name of the variable mesh_period belongs to the file format.
        assert not re.findall(r"mesh (?:period|freq)|flank|\bgears?\b|omega_h|scaling freq", text)
    every = "".join(one.out + one.err for one in said)
    assert "(stop, upper side)" in every and '"time in excitation periods"' in every
