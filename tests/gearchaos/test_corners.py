"""Branches and boundaries that have corners, because a contact begins or ends at mesh phase 0.

A phase of the only force shifts the time: motions and multipliers stay the same. The damper of the
stop acts in contact only; its force therefore jumps.
"""

import numpy as np
import pytest

import gearchaos
from gearchaos.engine.bounding import find_boundaries
from gearchaos.records.branch import EDGE, GRAZING

from .test_hard_branches import BASE, MASS, branches

JUMPING = {"stop_damping": 3.0, "acts": "in_contact", "mean": 0.5}
PHASE = "force.one.phase_deg"


def test_a_branch_continues_beyond_its_corners():
    """The motions of the branch are the same at all phases."""
    (whole,) = branches(1, PHASE, 0.0, 360.0, **JUMPING, first=2.5)
    assert whole.ends == (EDGE, EDGE)
    assert whole.value[[0, -1]].tolist() == [0.0, 360.0]
    assert np.ptp(whole.multipliers, axis=0) == pytest.approx(0.0, abs=1e-11)
    assert whole.section[-1] == pytest.approx(whole.section[0], abs=1e-11)


def test_a_boundary_continues_beyond_its_corners():
    """Motions graze each flank at the same amplitude for every phase."""
    second = """
[second_sweep]
parameter = "force.one.amplitude"
from = 0.2
to = 3.0
count = 12
"""
    text = MASS.format(**dict(BASE, **JUMPING, count=9), swept=PHASE, low=0.0, high=360.0)
    text = text.replace('carry = "both"', "") + second
    config = gearchaos.Configuration.from_toml(text, "mass.toml")
    upper, lower = find_boundaries(gearchaos.run(config), lines=2).boundaries
    for curve in (upper, lower):
        assert curve.kind == GRAZING
        assert curve.ends == (EDGE, EDGE)
        assert sorted(curve.values[[0, -1], 0].tolist()) == [0.0, 360.0]
        assert np.ptp(curve.values[:, 1]) < 1e-10
    assert upper.values[0, 1] < lower.values[0, 1]
