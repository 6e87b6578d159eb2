"""Systems whose pitch errors differ from tooth to tooth: periods, orbits, exponents, lengths."""

import numpy as np
import pytest
from gearchaos_kernels import integrate

import gearchaos
from gearchaos.dynamics.plans import plan_of
from gearchaos.engine.excitation import remarks, whole_lengths
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.recomputing import computable
from gearchaos.models import Configuration
from gearchaos.models.gear_pair.contact_lines import TrapezoidalStiffness, line_shares
from gearchaos.models.registry import system_of
from gearchaos.records.branch import EDGE, GRAZING

DEVIATIONS = np.round(12.0 * np.sin(2.0 * np.pi * np.arange(21) / 21), 2) + [0, 5, -4] * 7

TABLES = {
    "pair": {
        "teeth": [21, 38],
        "normal_module_mm": 2.166,
        "normal_pressure_angle_deg": 20.0,
        "helix_angle_deg": 20.0,
        "face_width_mm": 15.0,
    },
    "mesh": {
        "length_scale_um": 50.0,
        "stiffness": {"shape": "trapezoid"},
        "half_backlash_um": 50.0,
    },
    "groups": {"mesh_frequency": 0.9, "load": 0.3, "damping_ratio": 0.05},
    "pitch_error": {"kind": "teeth", "driving": {"cumulative_um": DEVIATIONS.tolist()}},
    "scene": {"effects": ["pitch_error", "stiffness_variation", "backlash"]},
    "sweep": {"parameter": "pitch_error", "values": [0.5, 1.0, 2.0]},
    "integration": {"transient_periods": 400, "recorded_periods": 200},
}


def configured(**changes) -> Configuration:
    return Configuration.from_tables({**TABLES, **changes})


GRADES = {"kind": "grade", "grade": 9, "realisations": 4, "seed": 5}


@pytest.fixture(scope="module")
def result():
    return gearchaos.run(configured())


def test_a_motion_that_repeats_with_the_teeth_has_period_one(result):
    assert result.metadata["excitation_period"] == 21
    assert result["period"].tolist() == [1, 1, 1]
    section = result["section_delta_5"]
    assert section[:, -1] == pytest.approx(section[:, -22], abs=1e-9)
    assert np.ptp(section[:, -21:], axis=1).min() > 0.01


def test_lengths_are_whole_excitation_periods_and_said_to_be_so(result):
    assert result.metadata["transient_periods"] == 420
    assert result.metadata["recorded_periods"] == 210
    assert "repeat after 21 mesh periods" in result.metadata["notes"]
    assert "recorded_periods raised from 200 to 210" in result.metadata["notes"]


def test_floquet_multipliers_over_21_mesh_periods_are_the_exponents_of_tangent_vectors():
    lengths = {"transient_periods": 630, "recorded_periods": 1260}
    system = gearchaos.System(configured(integration=lengths), pitch_error=2.0)
    orbit = system.orbit()
    assert system.repeats_after == 21
    assert orbit.residual < 1e-12
    by_multipliers = np.log(np.abs(orbit.multipliers)) / (21 * system.mesh_period)
    assert by_multipliers == pytest.approx(system.exponents().values, rel=0, abs=1e-6)
    assert by_multipliers.sum() == pytest.approx(system.sum_of_exponents(), rel=0, abs=1e-8)


def test_the_exponent_of_a_sweep_is_that_of_the_orbit(result):
    system = gearchaos.System.of_lane(result, pitch_error=1.0)
    assert result["lyapunov_exponent"][1] == pytest.approx(system.orbit().exponent, rel=1e-9)


def test_a_carried_sweep_hands_its_states_on_in_phase(result):
    carried = gearchaos.run(configured(start={"kind": "rest", "carry": "upwards"}))
    assert carried["section_delta_5"] == pytest.approx(result["section_delta_5"], abs=1e-9)


def test_an_excitation_period_of_both_gears_is_their_least_common_multiple():
    config = configured(pitch_error=GRADES, sweep={"parameter": "pitch_error", "values": [1.0]})
    result = gearchaos.run(config)
    assert result.metadata["excitation_period"] == 798
    assert result.metadata["recorded_periods"] == 3 * 798
    assert result["period"].tolist() == [[1, 1, 1, 1]]
    assert np.unique(result["end_state"][..., 0]).size == 4


def test_a_drawn_pair_moves_as_it_does_alone():
    config = configured(pitch_error=GRADES, sweep={"parameter": "pitch_error", "values": [1.0]})
    all_pairs = gearchaos.run(config)
    alone = gearchaos.run(config.at({"realisation": 2.0}))
    for name in ("section_delta_5", "end_state", "lyapunov_exponent"):
        assert np.array_equal(alone[name][0], all_pairs[name][0, 2]), name


def test_the_error_in_a_response_is_that_of_the_teeth_in_mesh():
    system = gearchaos.System(configured(), pitch_error=1.0)
    response = system.response(periods=42)
    error = response["mesh_error"][0]
    steps = response.metadata["steps_per_period"]
    assert error[: 21 * steps] == pytest.approx(error[21 * steps : 42 * steps], abs=1e-15)
    # A driving tooth that lies ahead has a negative error along the line of action.
    alpha_t = np.arctan(np.tan(np.radians(20.0)) / np.cos(np.radians(20.0)))
    deviations = DEVIATIONS - DEVIATIONS[0]
    assert -error.max() * 50.0 > deviations.min() * np.cos(alpha_t)
    assert -error.min() * 50.0 < deviations.max() * np.cos(alpha_t)
    mean = np.mean(error[: 21 * steps]) * 50.0
    assert mean == pytest.approx(-np.mean(deviations) * np.cos(alpha_t), rel=1e-9)


def test_forces_after_a_transient_are_those_of_the_teeth_that_it_has_come_to():
    system = gearchaos.System(configured(), pitch_error=1.0)
    whole, later = (system.mesh_motion(system.integrate(6 - n, n)) for n in (0, 4))
    steps = whole.pitch_error.size // 6
    assert np.array_equal(later.pitch_error, whole.pitch_error[4 * steps :])
    assert later.force_tangential == pytest.approx(whole.force_tangential[4 * steps :], abs=1e-11)


@pytest.mark.parametrize("helix_angle", [0.0, 15.0, 20.0, 30.0])
def test_rigid_slow_teeth_transmit_what_an_eccentric_pinion_does(helix_angle):
    teeth, range_um = 63, 40.0
    pair = {**TABLES["pair"], "teeth": [teeth, 38], "helix_angle_deg": helix_angle}
    around = 2.0 * np.pi * np.arange(teeth) / teeth
    deviations = (0.5 * range_um * np.sin(around)).tolist()
    # The load bends the teeth by a thousandth of the range; varying stiffness changes this by less.
    rigid = {"mesh_frequency": 0.1, "load": 0.001 * range_um / 50.0, "damping_ratio": 0.3}
    config = configured(
        pair=pair,
        groups=rigid,
        pitch_error={"kind": "teeth", "driving": {"cumulative_um": deviations}},
        start={"kind": "contact"},
        sweep={"parameter": "pitch_error", "values": [1.0]},
        integration={"transient_periods": 63, "recorded_periods": 189},
    )
    response = gearchaos.System(config).response(periods=teeth)
    error_um = 50.0 * (response["delta_5"] + response["mesh_error"])[0]
    # The line of action has the angle alpha_t in the transverse plane.
    alpha_t = np.arctan(np.tan(np.radians(20.0)) / np.cos(np.radians(helix_angle)))
    assert np.ptp(error_um) == pytest.approx(range_um * np.cos(alpha_t), rel=0.01)


def noted(**changes) -> str:
    """Return the remarks before a sweep of one lane."""
    lanes = Lanes(configured(sweep={"parameter": "pitch_error", "values": [1.0]}, **changes))
    return " ".join(remarks(lanes, whole_lengths(lanes)))


def with_errors(deviations, load: float) -> dict:
    """Return the tables of a load and of a pinion whose first teeth have these deviations."""
    listed = [*deviations, *[0.0] * (21 - len(deviations))]
    return {
        "pitch_error": {"kind": "teeth", "driving": {"cumulative_um": listed}},
        "groups": {**TABLES["groups"], "load": load},
    }


def test_pairs_that_share_the_load_part_where_they_differ_by_more_than_it_bends_them():
    # Three pairs share the load at once: neighbours differ by 10 um, the first and third by 20 um.
    slope = with_errors([0.0, 10.0, 20.0, 10.0], load=0.3)
    along, cosine = np.cos(np.radians(21.1728)) / 50.0, np.cos(np.radians(18.7472))
    told = "of the lanes tooth pairs that share the load differ by up to"
    for times, parts in ((19.9, True), (20.1, False)):
        slope["groups"] = {**slope["groups"], "load": times * along * cosine}
        said = noted(**slope)
        assert (told in said) == parts
        # The length scale is 50 um; 20 um between the first and third tooth are 18.6 um along the
        # line of action.
        assert ("by up to 18.6 um, and the static deflection there is 18.6 um" in said) == parts
        assert ("a high enough operation.torque_Nm or groups.load" in said) == parts


def test_the_printed_form_says_what_it_makes_of_errors_of_teeth():
    assert 'formulation = "published" enters the mean' in noted(formulation="published")
    assert "published" not in noted()


@pytest.mark.parametrize("turned", [-1e-12, 0.0, 1e-12])
def test_a_pair_that_comes_into_mesh_with_the_period_does_so_but_for_rounding(turned):
    for ratio in (1.3, 1.5, 1.7):
        stiffness = TrapezoidalStiffness.from_contact_ratios(ratio, 0.0).coefficients(1)[0]
        _, _, entry = line_shares(ratio, 0.0, 0.1, complex(stiffness * np.exp(1j * turned)))
        assert entry < 1e-9


def test_a_contact_ratio_that_no_pair_of_gears_can_have_is_refused():
    wide = {**TABLES["pair"], "face_width_mm": 150.0}
    with pytest.raises(gearchaos.ConfigurationError, match="total contact ratio"):
        gearchaos.run(configured(pair=wide))


def test_what_goes_on_from_a_result_begins_where_the_same_teeth_meet(result):
    config = computable(result, "the result")
    assert config.integration.transient_periods == 420
    assert config.integration.recorded_periods == 210
    once = plan_of(config, transient_periods=0)._replace(tangent=True)
    system = system_of(config, {"pitch_error": result["pitch_error"]})
    again = integrate(system, result["end_state"], once).end_state
    assert again == pytest.approx(result["end_state"], abs=1e-9)


def test_an_excitation_that_hardly_ever_repeats_is_refused():
    many = {**TABLES["pair"], "teeth": [1999, 2000]}
    with pytest.raises(gearchaos.ConfigurationError, match="after 3998000 mesh periods only"):
        gearchaos.run(configured(pair=many, pitch_error=GRADES))


def test_a_response_may_keep_every_period_of_a_record_that_the_teeth_raised():
    lengths = {"transient_periods": 1, "recorded_periods": 50}
    config = configured(
        integration=lengths,
        sweep={"parameter": "pitch_error", "values": [0.5]},
        outputs={"section_points": 5},
    )
    motion = gearchaos.respond(config, periods=60)
    # 50 periods are raised to three turns of the 21 teeth.
    assert motion["time"][-1] == 60.0 and motion.metadata["recorded_periods"] == 63
    assert motion["section_point"].size == 63
    assert "integration.recorded_periods raised from 50 to 63" in motion.metadata["notes"]


@pytest.fixture(scope="module")
def branch():
    system = gearchaos.System(configured(), pitch_error=3.0)
    return system.branch(system.orbit(), "pitch_error", 2.5, 3.3)


def test_a_branch_closes_after_the_teeth_meet_again(branch):
    assert branch.period == 1
    assert branch.ends == (EDGE, EDGE)
    system = gearchaos.System(configured(), pitch_error=3.0)
    for at in range(0, branch.value.size, 5):
        there = gearchaos.System(configured(), pitch_error=branch.value[at])
        states = there.integrate(21, start=branch.section[at, -1]).states
        assert states[-1] == pytest.approx(states[0], rel=0, abs=1e-11)
        # The trace of the equations does not depend on the pitch error.
        exponents = np.log(np.abs(branch.multipliers[at])) / (21 * system.mesh_period)
        assert exponents.sum() == pytest.approx(system.sum_of_exponents(), rel=0, abs=1e-8)


def test_a_branch_is_a_straight_line_while_all_teeth_stay_in_contact(branch):
    (grazing,) = branch.specials
    before = branch.value < grazing.value
    assert before.sum() > 3
    states = branch.section[before, -1]
    line = np.column_stack([branch.value[before], np.ones(before.sum())])
    fitted, *_ = np.linalg.lstsq(line, states)
    assert states == pytest.approx(line @ fitted, rel=0, abs=1e-10)
    multipliers = branch.multipliers[before]
    assert multipliers == pytest.approx(np.tile(multipliers[:1], (before.sum(), 1)), abs=1e-9)


def test_teeth_part_beyond_the_grazing_point_of_a_branch(branch):
    (grazing,) = branch.specials
    assert grazing.kind == GRAZING
    for aside, contact in (-1e-4, 1.0), (1e-4, 0.0):
        system = gearchaos.System(configured(), pitch_error=grazing.value + aside)
        assert system.response(periods=21)["contact_tangential"].min() == contact
