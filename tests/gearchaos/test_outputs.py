"""The catalogue of outputs is complete: arrays without an entry are refused, not left out."""

import doctest
import re
from pathlib import Path

import h5py
import numpy as np
import pytest

from gearchaos.engine.computing import EndStates, compute_block
from gearchaos.engine.running import result_of
from gearchaos.errors import ConfigurationError
from gearchaos.models.gear_pair.outputs import CATALOGUE, FORCES_PART, LOADS_PART
from gearchaos.outputs import catalogue, listing
from gearchaos.outputs.entries import Kind, Output, Part, Subject, motion_subjects, rearranged
from gearchaos.outputs.listing import Catalogue, Details
from gearchaos.outputs.scales import PURE, BaseScale, Quantity, scales_of
from gearchaos.outputs.variable import coordinate, require_listed
from gearchaos.results.files.block_store import BlockStore
from gearchaos.results.files.result_file import write_result
from gearchaos.results.reading.result import Result, open_result

from .listed_variables import parameter
from .short_sweeps import unlabelled
from .test_block_store import CONFIGURATION, LANES, PARAMETERS, SOFTWARE, VARIABLES, sweep

EVERY = {catalogue.EVERY_SWEEP_PART: True}
AXIS = coordinate("force", "1", "amplitude of the force", "$F$", np.array([1.0, 2.0]))
X = motion_subjects("x", "x", "{} of the mass")
PUSH = Part(
    "with pushes", (Output("push_@", "push on the @", scale=Quantity.FORCE),), (Kind.ELEMENT,)
)
OSCILLATOR = Catalogue(
    parts=rearranged(catalogue.PARTS, {catalogue.CONTACT_PART: (catalogue.CONTACT_PART, PUSH)}),
    subjects={
        Kind.STATE: X[:2],
        Kind.ACCELERATION: X[2:],
        Kind.ELEMENT: (Subject("stop", "stop", "$F_s$"),),
    },
    scales=scales_of(
        BaseScale("gap", "g"), BaseScale("frequency", r"\omega"), BaseScale("spring", "k"), "help"
    ),
)
"""A mass against a stop; only this file describes its outputs."""


def oscillator_result() -> Result:
    parts = {
        **EVERY,
        catalogue.SECTION_POINTS_PART: True,
        catalogue.SECTION_PART: ["x", "x_rate"],
        catalogue.LYAPUNOV_PART: True,
        catalogue.CONTACT_PART: ["stop"],
        PUSH: ["stop"],
        catalogue.EXTREMES_PART: ["x"],
        catalogue.MOTION_IN_TIME_PART: ["x_acceleration"],
        catalogue.TIME_PART: True,
        catalogue.CONTACT_IN_TIME_PART: ["stop"],
    }
    values = {"section_point": np.arange(3), "state": [0, 1], "time": np.arange(4) / 2.0}
    meanings = {
        "status": ["ok"],
        "state": ["x", "x_rate"],
        "contact_state_@": ["held", "free"],
    }
    variables = OSCILLATOR.variables([AXIS], parts, Details(values, meanings))
    sizes = {"force": 2, "section_point": 3, "state": 2, "time": 4}
    data = {
        one.name: np.ones([sizes[dim] for dim in one.dims], dtype=one.dtype)
        for one in variables
        if one.values is None
    }
    data["status"] *= 0
    scales = {"gap": 20.0, "frequency": 300.0, "spring": 1e6}
    known = {name: parameter(name, value, "given") for name, value in scales.items()}
    return Result(["force"], variables, data, known, {})


def names_of(part, *subjects, **details):
    found = CATALOGUE.variables((), {part: subjects or True}, Details(**details))
    return [one.name for one in found]


@pytest.mark.parametrize(
    ("details", "unknown"),
    [
        (Details(values={"section_points": np.arange(3)}), "section_points"),
        # This is the name of one variable; the entry of all sections has another name.
        (Details(values={"section_delta_5": [1.0]}), "section_delta_5"),
        (Details(meanings={"statuses": ["ok"], "motions": ["chaotic"]}), "motions, statuses"),
        (Details(wordings={"periods": "mesh periods"}), "periods"),
    ],
)
def test_details_of_an_unknown_output_are_refused(details, unknown):
    with pytest.raises(ValueError, match=rf"^{unknown}: has no entry in the catalogue"):
        CATALOGUE.variables((), EVERY, details)


def test_details_of_outputs_that_a_result_lacks_are_ignored():
    details = Details({"order": np.arange(2)}, {"motion": ["chaotic"]}, {"period": "periods"})
    found = CATALOGUE.variables((), EVERY, details)
    assert [one.name for one in found] == [one.name for one in catalogue.EVERY_SWEEP_PART.outputs]


def test_a_part_of_another_model_is_refused():
    with pytest.raises(ValueError, match=r"^push_@: has no entry"):
        CATALOGUE.variables((), {PUSH: ["tangential"]})
    with pytest.raises(ValueError, match=r"^load_factor_largest: has no entry"):
        OSCILLATOR.variables((), {LOADS_PART: True})


@pytest.mark.parametrize(
    ("part", "subjects", "said"),
    [
        (
            catalogue.SECTION_PART,
            ["delta_5", "delta_9"],
            "delta_9 is not the name of a known state",
        ),
        (catalogue.SECTION_PART, ["tangential"], "tangential is not the name of a known state"),
        (FORCES_PART, ["delta_5"], "delta_5 is not .* element; there are tangential, axial"),
        (catalogue.AMPLITUDES_PART, ["x"], "x is not the name of a known state or signal"),
        (catalogue.CONTACT_PART, True, "True is not the name of a known element"),
    ],
)
def test_a_subject_that_the_model_lacks_is_refused(part, subjects, said):
    with pytest.raises(ValueError, match=rf"^{part.outputs[0].name}: {said}"):
        CATALOGUE.variables((), {part: subjects})


def test_a_long_name_without_its_wording_is_refused():
    assert names_of(catalogue.MOTION_PART, wordings={"period": "mesh periods"})[1] == "period"
    with pytest.raises(ValueError, match=r"^period: lacks the wording"):
        names_of(catalogue.MOTION_PART)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (
            {"parts": (*catalogue.PARTS, catalogue.ORDERS_PART)},
            "^order: is the name of two outputs",
        ),
        # In a response, the motion of a state has the name of the state.
        (
            {"subjects": {Kind.STATE: (Subject("time", "time"),)}},
            "^time: is the name of two outputs",
        ),
        ({"long_names": {"statuses": "status of the lane"}}, "^statuses: has no entry"),
        (
            {"parts": (Part("always", (Output("a", "a", errors=("b",)),)),)},
            "^b: has no entry",
        ),
    ],
)
def test_a_catalogue_that_contradicts_itself_is_refused(wrong, message):
    with pytest.raises(ValueError, match=message):
        Catalogue(**{"parts": catalogue.PARTS, "subjects": {}, **wrong})


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Output("a", "a", dtype="int32"), "a: fill_value = nan is no int32"),
        (lambda: Output("a", "a", dtype="uint8", fill_value=256), "256 is no uint8"),
        (lambda: Part("always", (Output("a_@", "a"),)), "a_@: must name its subject by @ if"),
        (lambda: Part("always", (Output("a", "a"),), (Kind.STATE,)), "a: must name its subject"),
        (lambda: Part("always", (Output("a", "a", scale=None),)), "a: has no subject whose"),
    ],
)
def test_an_entry_that_contradicts_itself_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_arrays_without_a_variable_are_refused_and_no_others():
    require_listed({"status": 0}, ["status", "motion"])
    with pytest.raises(ValueError, match=r"^noise: would not be written"):
        require_listed({"status": 0, "noise": 1}, ["status", "motion"])


def test_a_block_with_an_array_too_many_is_not_kept(tmp_path):
    arrays = sweep() | {"noise": np.zeros(LANES)}
    with BlockStore(tmp_path / "a.h5", VARIABLES, CONFIGURATION, SOFTWARE) as store:
        with pytest.raises(ValueError, match=r"^noise: would not be written"):
            store.write(0, LANES, arrays)
        assert not store.finished()[0]


def test_a_file_with_an_array_too_many_is_not_written(tmp_path):
    blocks = [(0, LANES, sweep() | {"noise": np.zeros(LANES)})]
    with pytest.raises(ValueError, match=r"^noise: would not be written"):
        write_result(tmp_path / "a.h5", VARIABLES, blocks, PARAMETERS, {"title": "t"})
    assert not list(tmp_path.iterdir())


def test_a_result_with_an_array_too_many_is_not_made():
    found = unlabelled("sweep.count=2")
    arrays = compute_block(found, (0, 2), EndStates(found).before(0))
    assert result_of(found, [arrays], {}).axes == ("pitch_error",)
    with pytest.raises(ValueError, match=r"^noise: would not be written"):
        result_of(found, [{**arrays, "noise": np.zeros(2)}], {})


UNITS = {
    "um": "delta_5 section_delta_5 amplitude_delta_1 delta_3_peak_to_peak mesh_error "
    "amplitude_transmission_error transmission_error_mean transmission_error_peak_to_peak "
    "transmission_error_rms transmission_error",
    "m/s": "delta_5_rate section_delta_2_rate delta_4_rate_largest approach_mean_tangential "
    "approach_largest_axial slowest_crossing",
    "m/s^2": "delta_5_acceleration delta_4_acceleration",
    "N": "mesh_force_tangential mesh_force_largest_axial mesh_force_smallest_axial "
    "mesh_force_mean_tangential mesh_force_rms_tangential",
    "s^-1": "lyapunov_exponent lyapunov_exponent_standard_error lyapunov_exponents lyapunov_sum "
    "lyapunov_exponents_standard_error exponent_step_error",
    "Hz": "mesh_frequency",
    "s": "mesh_period",
    "1": "status period time return_distance section_error start_state end_state "
    "crossings_per_period time_driving_axial impacts_back_axial load_factor_rms order exponent "
    "kaplan_yorke_dimension load_factor_largest contact_tangential damping_ratio "
    "nothing_of_the_kind",
}
"""Some outputs and parameters of each physical unit, separated by spaces."""


@pytest.mark.parametrize("units", UNITS)
def test_outputs_of_a_gear_pair_have_the_units_of_what_they_measure(units):
    found = {name: CATALOGUE.scale_of(name).units for name in UNITS[units].split()}
    assert set(found.values()) == {units}, found


def test_another_model_uses_the_generic_outputs():
    result = oscillator_result()
    assert [name for name in result if name.endswith("_stop")] == [
        "time_driving_stop",
        "time_back_stop",
        "time_apart_stop",
        "impacts_driving_stop",
        "impacts_back_stop",
        "approach_mean_stop",
        "approach_largest_stop",
        "contact_state_stop",
        "push_stop",
        "contact_stop",
    ]
    wording = result.attributes("section_x_rate")
    assert wording["long_name"] == "velocity of the mass at the stroboscopic section"
    assert wording["symbol"] == "$x'$"
    assert (
        result.attributes("x_peak_to_peak")["long_name"] == "peak to peak displacement of the mass"
    )
    assert result.variables["contact_stop"].flags == ("apart", "driving_flank", "back_flank")
    assert not [name for name in result if "mesh_force" in name or "delta" in name]


def test_the_scales_of_another_model_give_its_physical_units():
    physical = oscillator_result().physical()
    found = {name: (physical[name].ravel()[0], physical.variables[name].units) for name in physical}
    assert found["section_x"] == (20.0, "um")
    assert found["approach_mean_stop"] == (pytest.approx(6e-3), "m/s")
    assert found["x_acceleration"] == (pytest.approx(1.8), "m/s^2")
    assert found["push_stop"] == (pytest.approx(20.0), "N")
    assert found["lyapunov_exponent"] == (300.0, "s^-1")
    assert found["time_apart_stop"] == (1.0, "1")


def test_a_file_of_an_unknown_model_is_read_with_the_units_that_it_names(tmp_path):
    oscillator_result().save(tmp_path / "raw.h5")
    raw = open_result(tmp_path / "raw.h5")
    assert set(raw) == set(oscillator_result())
    # Exponents have known entries, states of the oscillator have none.
    assert raw.variables["section_x"].scale == PURE
    with pytest.raises(
        ConfigurationError, match=r"^lyapunov_exponent: .*does not give the scaling"
    ):
        raw.physical("lyapunov_exponent")
    with h5py.File(tmp_path / "raw.h5", "r+") as file:
        file["section_x"].attrs["units"] = "mm"
        file["lyapunov_exponent"].attrs["units"] = "h^-1"
    names = "section_x", "lyapunov_exponent"
    changed = open_result(tmp_path / "raw.h5").physical(*names)
    assert [changed.variables[name].units for name in names] == ["mm", "h^-1"]
    assert (changed["section_x"] == 1.0).all()
    assert (changed["lyapunov_exponent"] == 1.0).all()


def test_the_page_on_the_file_format_names_every_output():
    page = (Path(__file__).parents[2] / "docs" / "file-format.md").read_text(encoding="utf-8")
    documented = {name.replace("COORDINATE", "STATE") for name in re.findall(r"`(\w+)`", page)}
    subjects = {Kind.STATE: "STATE", Kind.ACCELERATION: "STATE_acceleration"}
    subjects |= {Kind.ELEMENT: "tangential", Kind.SIGNAL: "transmission_error"}
    for part in CATALOGUE.parts:
        for subject in [subjects[kind] for kind in part.repeated_for] or [""]:
            named = {output.name.replace("@", subject) for output in part.outputs}
            assert named <= documented


def test_the_example_of_the_catalogue_is_true():
    found = doctest.testmod(listing)
    assert found.attempted > 0 and found.failed == 0
