"""Flow maps that are interpolated between values of one parameter."""

import os
import subprocess
import sys

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate
from gearchaos_kernels.batch import scene_of
from gearchaos_kernels.methods.flow_map import interpolation, store
from gearchaos_kernels.methods.flow_map.interpolation import ACCURACY, NODES, interpolated

from .reference import NO_AXIAL, assert_same_bits, lanes_out_of, pan2021, system_of

PLAN = Plan(12, 0, 4, 4, tangent=True, method="flow_map")


def with_frequencies(frequencies):
    """Return pairs that differ in their mesh frequency."""
    frequencies = np.asarray(frequencies, dtype=float)
    pitch_errors = np.full(frequencies.size, 9.0)
    return system_of(pan2021(pitch_errors, mesh_frequency=frequencies), NO_AXIAL)


def pairs(frequencies):
    """Return pairs that differ in their mesh frequency, and the index of this parameter."""
    (along,) = np.flatnonzero(np.ptp(with_frequencies([0.8, 1.2]).map_parameters(), axis=0))
    return with_frequencies(frequencies), int(along)


def starts(system):
    return np.tile([0.4, 0.1, -0.2, 0.05, 0.9, 0.3], (system.lanes, 1))[:, : len(system.states)]


@pytest.fixture
def made(monkeypatch):
    """Return the pieces that a test makes; the test begins without any pieces and maps."""
    pieces = {}
    monkeypatch.setattr(interpolation, "_pieces", pieces)
    monkeypatch.setattr(store, "_kept", store._Kept(0))
    return pieces


def test_motions_with_interpolated_maps_are_those_with_computed_ones(made):
    system, along = pairs(np.random.default_rng(1).uniform(0.5, 1.6, 60))
    exact = integrate(system, starts(system), PLAN)
    found = integrate(system, starts(system), PLAN._replace(interpolated=along))
    assert sum(piece is not None for piece in made.values()) >= 5
    assert exact.crossings.sum() > 60
    assert found.crossings.tolist() == exact.crossings.tolist()
    assert found.section == pytest.approx(exact.section, abs=1e-11)
    assert found.growth == pytest.approx(exact.growth, abs=1e-11)


def test_a_lane_has_the_same_bits_in_any_batch(made, monkeypatch):
    system, along = pairs(np.linspace(0.7, 1.4, 41))
    plan = PLAN._replace(interpolated=along)
    whole = integrate(system, starts(system), plan)
    chosen = np.array([40, 3, 17])
    made.clear()
    monkeypatch.setattr(store, "_kept", store._Kept(0))
    some = integrate(system.of(chosen), starts(system)[chosen], plan)
    assert_same_bits(some, lanes_out_of(whole, chosen))


def test_a_frequency_at_a_node_has_the_maps_of_the_node(made):
    system, along = pairs([0.9, 1.0])
    integrate(system, starts(system), PLAN._replace(interpolated=along))
    piece = next(one for one in made.values() if one is not None)
    assert piece.nodes.size == NODES
    assert np.array_equal(piece.at(piece.nodes[3]).ravel(), piece.tables[3])


def test_a_piece_whose_maps_are_not_accurate_is_divided_or_refused(made, monkeypatch):
    # Rounding errors exceed this limit.
    monkeypatch.setattr(interpolation, "ACCURACY", ACCURACY * 1e-6)
    system, along = pairs([0.8, 1.1])
    exact = integrate(system, starts(system), PLAN)
    found = integrate(system, starts(system), PLAN._replace(interpolated=along))
    assert made and all(piece is None for piece in made.values())
    assert np.array_equal(found.section, exact.section)


def test_other_parameters_have_pieces_of_their_own(made):
    system, along = pairs([1.0, 1.0])
    changed = system.map_parameters()
    other = next(at for at in range(changed.shape[1]) if at != along and changed[0, at] > 0.0)
    varied = system.with_map_parameter(other, changed[:, other] * np.array([1.0, 1.01]))
    plan = PLAN._replace(interpolated=along)
    found = integrate(varied, starts(varied), plan)
    exact = integrate(varied, starts(varied), PLAN)
    assert len(made) == 2
    assert found.section == pytest.approx(exact.section, abs=1e-11)
    assert not np.array_equal(found.section[0], found.section[1])


def test_values_that_are_not_positive_have_computed_maps(made):
    system, along = pairs([1.0])
    backwards = system.with_map_parameter(along, np.array([-1.0]))
    assert interpolated(backwards, 12, scene_of(backwards, PLAN), along, "name") == [None]
    assert not made


INTERPOLATED = """
import hashlib
import os
import subprocess
import sys

import numpy as np
from gearchaos_kernels.methods.flow_map.interpolation import NODES, Piece
random = np.random.default_rng(0)
nodes, tables = 1.0 + np.arange(NODES) / NODES, random.normal(size=(NODES, 58_997))
found = [Piece(nodes, tables, (1, 58_997)).at(1.0 + share).tobytes() for share in random.random(9)]
print(hashlib.sha256(b"".join(found)).hexdigest())
"""
"""Interpolate maps that are so large that a product of matrices would have several threads."""


def test_interpolated_maps_have_the_same_bits_for_any_number_of_threads_of_linear_algebra():
    found = set()
    for threads in ("1", "2", "4"):
        names = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
        environment = os.environ | dict.fromkeys(names, threads)
        command = [sys.executable, "-c", INTERPOLATED]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        found.add(done.stdout)
    assert len(found) == 1
