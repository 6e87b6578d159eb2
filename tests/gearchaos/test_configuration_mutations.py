"""Any configuration is either sound or refused with a message."""

import copy
import datetime
import tomllib
from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gearchaos.configuration.base import configuration_keys
from gearchaos.errors import GearchaosError
from gearchaos.models import Configuration, GearPairConfiguration, axis_values
from gearchaos.models.gear_pair.tables import groups_at

SWEEP = Path(__file__).resolve().parents[2] / "sweeps" / "pan2021_full.toml"
TABLES = tomllib.loads(SWEEP.read_text(encoding="utf-8"))
DEVIATIONS = {"cumulative_um": [0.0, 3.0, -1.0] * 7, "flank": "left"}
PITCH_ERRORS = [
    TABLES.get("pitch_error"),
    {"kind": "teeth", "driving": DEVIATIONS},
    {"kind": "grade", "grade": 7, "realisations": 3},
]
PATHS = sorted(configuration_keys(GearPairConfiguration))
WORDS = ["load", "teeth", "grade", "axial", "delta_5", "random", "trapezoid", *PATHS]

scalars = st.one_of(
    st.floats(),
    st.integers(-(10**20), 10**20),
    st.booleans(),
    st.text(max_size=8),
    st.sampled_from(WORDS),
    st.just(datetime.date(2021, 1, 1)),
    st.sampled_from([0, 1, -1, 5e-324, 1e308, 10**400]),
)
values = st.recursive(
    scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.dictionaries(st.sampled_from(["shape", "kind", "values", "x"]), inner, max_size=2),
    ),
    max_leaves=4,
)
positive = st.floats(min_value=1e-3, max_value=1e3)
mutations = st.lists(
    st.tuples(st.sampled_from(PATHS), st.one_of(values, positive, st.none())), max_size=3
)


def problems_of(make, *arguments):
    try:
        make(*arguments)
    except GearchaosError as error:
        return error.problems
    return None


def mutated(changes, pitch_error):
    tables = copy.deepcopy(TABLES)
    if pitch_error is not None:
        tables["pitch_error"] = copy.deepcopy(pitch_error)
        del tables["groups"]["pitch_error_amplitude"]
        tables["mesh"]["length_scale_um"] = 25.0
    for path, value in changes:
        *way, name = path.split(".")
        node = tables
        for step in way:
            node = node.setdefault(step, {})
            if not isinstance(node, dict):
                break
        else:
            if value is None:
                node.pop(name, None)
            else:
                node[name] = value
    return tables


@settings(max_examples=300, deadline=None, suppress_health_check=list(HealthCheck))
@given(mutations, st.sampled_from(PITCH_ERRORS))
def test_a_mutated_configuration_is_sound_or_refused(changes, pitch_error):
    tables = mutated(changes, pitch_error)
    problems = problems_of(Configuration.from_tables, tables, "mutated.toml")
    if problems is not None:
        assert problems
        assert all(problem.startswith("mutated.toml: ") for problem in problems)
        return
    config = Configuration.from_tables(tables, "mutated.toml")
    assert Configuration.from_toml(config.resolved_toml()) == config
    if all(sweep.size < 10_000 for sweep in config.sweeps.values()):
        axes = axis_values(config)
        groups = groups_at(config, dict(zip(axes, np.ix_(*axes.values()), strict=True)))
        assert groups.missing(config.scene.effects) == []


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=60), st.lists(st.text(max_size=30), max_size=2))
def test_any_text_and_any_override_are_refused_in_words(text, overrides):
    assert problems_of(Configuration.from_toml, text, "text.toml", overrides)
