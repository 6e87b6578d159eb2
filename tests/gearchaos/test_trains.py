"""Gear trains and planetary sets: natural frequencies, equilibrium, symmetry, and bad input."""

import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from gearchaos_kernels import Plan, integrate
from scipy.linalg import eigh

import gearchaos
from gearchaos.engine.lanes import Lanes
from gearchaos.engine.resonances import resonances
from gearchaos.models.registry import model_of
from gearchaos.models.train import planetary
from gearchaos.models.train.waves import common_orders

ROOT = Path(__file__).parents[2]
EXACT = json.loads((ROOT / "tests" / "data" / "planetary.json").read_text())
SHORT = {"outputs.section_points": 20}
SHORT |= {"integration.transient_periods": 60, "integration.recorded_periods": 20}


def configured(name, changes):
    """Return an example with some keys changed."""
    config = gearchaos.load_config(ROOT / "sweeps" / f"{name}.toml")
    for path, value in changes.items():
        config = config.replace(path, value)
    return config


@pytest.mark.parametrize("planets", [3, 5])
def test_natural_frequencies_of_a_planetary_set(planets):
    exact = EXACT[str(planets)]
    given = configured("planetary", {}).planetary.model_copy(update={"planets": planets})
    machine = planetary.assembled(given, ("translation",), free=True).machine(1.0)
    squares = eigh(machine.held, machine.mass, eigvals_only=True)
    # Angular frequencies are in rad/ms.
    found = np.sort(np.sqrt(np.abs(squares)) * 1e3 / (2.0 * np.pi))
    expected = np.sort(
        [*exact["rotational"], *(2 * exact["translational"]), *(2 * exact.get("planet", []))]
    )
    assert found == pytest.approx(expected, abs=0.3)


def test_the_torque_is_shared_by_the_planets_at_rest():
    config = configured("planetary", {"scene.effects": ["translation"], **SHORT})
    config = config.replace("sweep", {"parameter": "operation.speed_rpm", "values": [3000.0]})
    result = gearchaos.run(config)
    given = config.planetary
    share = 1e3 * given.torque_Nm / given.sun_base_radius_mm / given.planets
    for gear in ("sun", "ring"):
        for number in range(1, 4):
            force = result[f"force_mean_{gear}_planet_{number}"]
            assert force == pytest.approx(share, rel=1e-6)


def test_a_symmetric_set_stays_symmetric():
    # 27 and 99 teeth are multiples of 3: all planets mesh in phase.
    speeds = {"parameter": "operation.speed_rpm", "values": [1400.0, 2500.0, 3500.0]}
    result = gearchaos.run(configured("planetary", {"sweep": speeds, **SHORT}))
    state = dict(zip(result.variables["state"].flags, result["end_state"].T, strict=True))
    for name in ("carrier_x", "ring_y", "sun_x"):
        assert np.abs(state[name]).max() < 1e-8
    for gear in ("sun", "ring"):
        forces = [result[f"force_rms_{gear}_planet_{number}"] for number in (1, 2, 3)]
        assert forces[1] == pytest.approx(forces[0], rel=1e-9)
        assert forces[2] == pytest.approx(forces[0], rel=1e-9)


def test_flow_maps_of_a_planetary_set_agree_with_fine_steps():
    # With backlash in six meshes, maps are made only for the sets of branches that a motion enters.
    speeds = {"parameter": "operation.speed_rpm", "values": [5000.0, 6000.0]}
    system = Lanes(configured("planetary", {"sweep": speeds})).system_of(np.arange(2))
    start = system.contact_state()
    exact, fine = (
        integrate(system, start, Plan(steps, 0, 3, 3, tangent=True, method=method))
        for steps, method in ((12, "flow_map"), (12_800, "rk4"))
    )
    assert exact.crossings.tolist() == fine.crossings.tolist()
    assert exact.crossings.min() > 20 and not exact.status.any()
    for kind in (slice(0, None, 2), slice(1, None, 2)):
        found, expected = exact.section[..., kind], fine.section[..., kind]
        assert found == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())


def relabelled(names, planets):
    """Return the map of coordinates to those of a set whose planet numbers are shifted by one.

    Planet 1 of the new set is planet 2 of the old one. The axes therefore turn by one planet.
    """
    turn = 2.0 * np.pi / planets
    matrix = np.zeros((len(names), len(names)))
    for row, name in enumerate(names):
        kind, _, rest = name.partition("_")
        if kind == "planet":
            old, _, what = rest.partition("_")
            matrix[row, names.index(f"planet_{int(old) % planets + 1}_{what}")] = 1.0
        elif rest in ("x", "y"):
            along, across = names.index(f"{kind}_x"), names.index(f"{kind}_y")
            sine = np.sin(turn) if rest == "x" else -np.sin(turn)
            matrix[row, along if rest == "x" else across] = np.cos(turn)
            matrix[row, across if rest == "x" else along] = sine
        else:
            matrix[row, row] = 1.0
    return matrix


@pytest.mark.parametrize("teeth", [(27, 99), (28, 98)])
def test_numbering_the_planets_from_another_one_changes_their_names_only(teeth):
    # With 28 and 98 teeth the planets mesh one third of a period after each other.
    sun, ring = teeth
    changes = {"sun_teeth": sun, "ring_teeth": ring, "planet_teeth": (ring - sun) // 2}
    config = configured("planetary", {})
    table = config.planetary.model_copy(update=changes)
    machine = planetary.assembled(table, config.scene.effects).machine(1.0)
    kinds = planetary.assembled(table, config.scene.effects).kinds()
    matrix = relabelled(list(kinds.coordinates), table.planets)
    assert matrix @ matrix.T == pytest.approx(np.eye(len(matrix)), abs=1e-15)
    for name in ("mass", "damping", "stiffness"):
        given = getattr(machine, name)
        assert matrix @ given @ matrix.T == pytest.approx(given, abs=1e-11 * np.abs(given).max())
    names = list(kinds.elements)
    order = [
        names.index(f"{one.split('_')[0]}_planet_{int(one[-1]) % table.planets + 1}")
        for one in names
    ]
    # A gap in the new numbering is the gap of the next planet in the old numbering.
    assert machine.gap @ matrix == pytest.approx(machine.gap[order], abs=1e-14)
    # The next planet meshes later by the same share of a period, which is a shift in time.
    shift = 2.0 * np.pi * (sun % table.planets) / table.planets
    turned = np.exp(-1j * shift * np.array(kinds.orders))
    for name in ("contact_stiffness", "motion"):
        waves = getattr(machine, name)
        complex_waves = waves[:, 1::2] - 1j * waves[:, 2::2]
        assert waves[order, 0] == pytest.approx(waves[:, 0])
        assert complex_waves[order] == pytest.approx(complex_waves * turned, abs=1e-10)


def test_the_motion_of_a_set_that_is_numbered_on_is_the_same_motion():
    config = configured("planetary", {**SHORT, "integration.transient_periods": 0})
    config = config.replace(
        "sweep", {"parameter": "operation.speed_rpm", "values": [1400.0, 2500.0, 3500.0]}
    )
    names = list(config.kinds_of_elements.coordinates)
    matrix = relabelled(names, 3)
    # One planet and the sun are displaced, so that the motion begins without symmetry.
    displaced = np.zeros(len(names))
    displaced[[names.index("planet_1_u"), names.index("sun_x")]] = 4.0, 2.0
    results = [
        gearchaos.run(config.replace("start", {"kind": "given", "state": state}))
        for state in (
            {name: float(one) for name, one in zip(names, start, strict=True) if one}
            for start in (displaced, matrix @ displaced)
        )
    ]
    first, second = (results[0][f"force_rms_sun_planet_{number}"] for number in (1, 2))
    assert np.abs(first / second - 1.0).min() > 1e-4
    for gear in ("sun", "ring"):
        for number in (1, 2, 3):
            before = results[0][f"force_rms_{gear}_planet_{number % 3 + 1}"]
            after = results[1][f"force_rms_{gear}_planet_{number}"]
            assert after == pytest.approx(before, rel=1e-8)


def test_a_planetary_set_can_be_purely_torsional():
    effects = ["stiffness_variation", "backlash", "transmission_error"]
    config = configured("planetary", {"scene.effects": effects, **SHORT})
    names = config.kinds_of_elements.coordinates
    assert [name for name in names if name.endswith(("_x", "_y", "_radial"))] == []
    assert len(names) == 8


LOOP = {"gears": ["pinion_1", "wheel_2"], "stiffness_N_per_um": 400.0, "contact_ratio": 1.7}
TWICE = {**LOOP, "gears": ["wheel_1", "pinion_1"]}
RADII = {"parameter": "gear.pinion_1.base_radius_mm", "values": [33.8, 40.0]}
DRIVES = [
    ("sun", "ring", "carrier"),
    ("sun", "carrier", "ring"),
    ("carrier", "ring", "sun"),
    ("carrier", "sun", "ring"),
    ("ring", "sun", "carrier"),
    ("ring", "carrier", "sun"),
]
"""Input, fixed and loaded member."""


def set_with(drive, torque):
    """Return a set whose planets mesh one third of a period after each other."""
    roles = dict(zip(("input", "fixed", "loaded"), drive, strict=True))
    teeth = {"sun_teeth": 28, "planet_teeth": 35, "ring_teeth": 98}
    given = configured("planetary", {}).planetary
    return given.model_copy(update=roles | teeth | {"torque_Nm": torque})


@pytest.mark.parametrize("torque", [150.0, -150.0])
@pytest.mark.parametrize("drive", DRIVES, ids="-".join)
def test_meshes_follow_each_other_as_the_teeth_pass_the_planets(drive, torque):
    given = set_with(drive, torque)
    teeth = {"sun": 28, "ring": 98, "carrier": -126}
    # Turns per unit of time, positive in the direction in which the planets are numbered.
    turns = {drive[0]: np.sign(torque), drive[1]: 0.0}
    turns[drive[2]] = -sum(teeth[name] * turns[name] for name in drive[:2]) / teeth[drive[2]]
    for number in range(3):
        for gear, phase in zip(("sun", "ring"), planetary.mesh_phases(given, number), strict=True):
            passing = teeth[gear] * (turns[gear] - turns["carrier"])
            # Mesh periods in which the teeth between planet 1 and this planet pass.
            later = teeth[gear] * number / 3 / passing * abs(passing)
            first = planetary.mesh_phases(given, 0)[("sun", "ring").index(gear)]
            behind = (first - phase - later) % 1.0
            assert min(behind, 1.0 - behind) == pytest.approx(0.0, abs=1e-9), (gear, number)


@pytest.mark.parametrize("torque", [150.0, -150.0])
@pytest.mark.parametrize("drive", DRIVES, ids="-".join)
def test_the_force_of_a_loaded_mesh_pushes_the_gears_apart(drive, torque):
    given = set_with(drive, torque)
    across = planetary.mesh_rows(given, 0)
    for gear, outward in (("sun", -1.0), ("ring", 1.0)):
        row = across[f"{gear}_planet_1"]
        # The mesh force balances the torque on its gear.
        force = -np.sign(planetary.torques(given)[gear]) * row[f"{gear}_x"]
        assert outward * force == pytest.approx(np.sin(np.radians(24.6)))
        assert force + np.sign(planetary.torques(given)[gear]) * -row["planet_1_radial"] < 1e-12


def test_a_set_that_turns_the_other_way_moves_as_its_mirror_image():
    ways = []
    for torque in (150.0, -150.0):
        config = configured("planetary", {**SHORT, "planetary.torque_Nm": torque})
        teeth = {"sun_teeth": 28, "planet_teeth": 35, "ring_teeth": 98}
        changed = {f"planetary.{name}": value for name, value in teeth.items()}
        # An error of the flanks has a sign, and therefore no mirror image.
        changed["scene.effects"] = ["translation", "stiffness_variation", "backlash"]
        changed["sweep"] = {"parameter": "operation.speed_rpm", "values": [1000.0, 2000.0, 2600.0]}
        config = config.replace(changed)
        ways.append(gearchaos.run(config))
    for gear in ("sun", "ring"):
        # Planets 2 and 3 of one set are planets 3 and 2 of the other set.
        for one, other in ((1, 1), (2, 3), (3, 2)):
            names = f"force_rms_{gear}_planet_{one}", f"force_rms_{gear}_planet_{other}"
            assert ways[1][names[1]] == pytest.approx(ways[0][names[0]], rel=1e-8)


def test_mesh_frequency_follows_from_the_teeth():
    given = configured("planetary", {}).planetary
    # With a fixed ring: f_m = n_s z_s z_r / (z_s + z_r).
    assert planetary.mesh_rate(given) == pytest.approx(27 * 99 / 126)
    held = given.model_copy(update={"fixed": "carrier", "loaded": "ring"})
    assert planetary.mesh_rate(held) == pytest.approx(27)


def test_numbers_of_meshes_of_different_frequency_are_those_of_their_common_period():
    model = model_of(configured("two_stage", {}))
    assert model.catalogue.worded("impacts per mesh period") == "impacts per common mesh period"
    config = configured("two_stage", {"sweep.count": 2})
    found = resonances(Lanes(config))
    # The first mesh, with 24 teeth on the input shaft, has two periods in the common one.
    assert found.rpm == pytest.approx(found.hertz * 60.0 / 12.0)
    assert "common period" in found.texts["orders"]
    one = model_of(configured("planetary", {}))
    assert one.catalogue.worded("impacts per mesh period") == "impacts per mesh period"


def test_meshes_of_different_frequency_repeat_after_their_common_period():
    assert common_orders([Fraction(24), Fraction(12)]) == (2, 1)
    assert common_orders([Fraction(24), Fraction(24 * 23, 48)]) == (48, 23)
    config = configured("two_stage", {})
    assert config.orders() == {"first": 2, "second": 1}
    # 24 teeth mesh at 1200 Hz at 3000 rpm; the common period is the period of the second mesh.
    frequency = config.machine({}).frequency
    assert frequency == pytest.approx(2.0 * np.pi * 0.6)


def test_a_train_at_rest_carries_its_load():
    changes = {"scene.effects": ["translation"], "start.carry": "none", **SHORT}
    speeds = {"parameter": "operation.speed_rpm", "values": [2000.0]}
    result = gearchaos.run(configured("two_stage", {"sweep": speeds, **changes}))
    assert result["force_mean_second"] == pytest.approx(900e3 / 101.5, rel=1e-6)
    assert result["force_mean_first"] == pytest.approx(900e3 / 101.5 * 33.8 / 67.7, rel=1e-6)
    assert result.variables["force_mean_first"].units == "N"
    assert result.variables["section_output_angle"].units == "mrad"


@pytest.mark.parametrize(
    ("name", "path", "value", "message"),
    [
        ("planetary", "planetary.planets", 4, "choose 2, 3, 6, 7, 9 planets, or other teeth"),
        ("planetary", "planetary.fixed", "sun", "three different members"),
        ("planetary", "planetary.planet_teeth", 30, r"no common axis of sun and ring.* = 36"),
        ("planetary", "planetary.planets", 7, "equally spaced planets overlap"),
        ("planetary", "planetary.sun_mesh.half_backlash_um", -1.0, "must be at least 0"),
        ("two_stage", "gear.wheel_2.shaft", "outptu", "did you mean `output`"),
        ("two_stage", "mesh.second", None, "no mesh connects output with the other shafts"),
        ("two_stage", "mesh.first.gears", ["pinion_1", "wheel"], "names wheel, which is no gear"),
        ("two_stage", "gear.wheel_1.teeth", 4801, "the meshes repeat together only after"),
        ("two_stage", "mesh.third", LOOP, "cannot turn with the other meshes"),
        ("two_stage", "sweep", RADII, "has its own tooth data; give normal_module_mm in place"),
        ("two_stage", "mesh.first.half_backlash_um", -1.0, "must be at least 0"),
        ("two_stage", "mesh.first.gears", ["wheel_1", "wheel_1"], "names one gear twice"),
        ("two_stage", "mesh.third", TWICE, "names the gears of mesh.first; remove one of the two"),
        ("two_stage", "shaft.middle.uniform", True, "given for input, middle, and one shaft is"),
        ("two_stage", "operation.speed_rpm", -1.0, "speed_rpm = -1.0: must be greater than 0"),
        ("two_stage", "operation.speed", 1.0, "unknown key"),
        ("two_stage", "operation", {}, "operation.speed_rpm: is missing"),
        ("two_stage", "shaft.input.uniform", False, "nothing holds input_angle"),
        ("two_stage", "shaft.middle.mass_kg", None, "is missing for a shaft with a bearing"),
        ("two_stage", "outputs.section", ["output"], "the machine has no state `output`"),
    ],
)
def test_a_train_that_cannot_be_is_refused_in_a_sentence(name, path, value, message):
    with pytest.raises(gearchaos.ConfigurationError, match=message):
        configured(name, {path: value})
