"""Values that are probably in another unit are reported with that unit, and accepted."""

from pathlib import Path

import pytest

import gearchaos
from gearchaos.configuration.plausible import PLAUSIBLE, implausible
from gearchaos.engine.run_plan import plan_run

from .commands import LINEAR, run_module, small_config

SWEEPS = Path(__file__).resolve().parents[2] / "sweeps"


def warned(folder: Path, *overrides: str) -> list[str]:
    """Return the notes or the problems of the small sweep with some values."""
    given = ("integration.unstable=raise", *overrides)
    try:
        notes = plan_run(gearchaos.load_config(small_config(folder), given)).notes
    except gearchaos.GearchaosError as error:
        return error.problems
    return [note for note in notes if "usual" in note or "unlikely" in note]


@pytest.mark.parametrize(
    ("key", "value", "unit", "meant"),
    [
        ("mesh.half_backlash_um", "0.06", "mm", "60.0"),
        ("pair.normal_pressure_angle_deg", "0.349066", "radians", "20.0"),
        ("pair.helix_angle_deg", "0.349066", "radians", "20.0"),
        ("pair.normal_module_mm", "0.002166", "m", "2.166"),
        ("mesh.mean_stiffness_N_per_um_mm", "14e9", "N/m^2", "14.0"),
        ("pair.face_width_mm", "15000", "um", "15.0"),
        ("groups.damping_ratio", "3", "percent", "0.03"),
        ("pair.density_kg_m3", "7.85", "g/cm^3", "7850.0"),
        ("bearings.axial_stiffness_N_per_m", "[300, 400]", "N/um", "[300000000.0, 400000000.0]"),
    ],
)
def test_the_probable_unit_is_named(tmp_path, key, value, unit, meant):
    (text,) = [one for one in warned(tmp_path, f"{key}={value}") if one.startswith(key)]
    assert f"probably it is in {unit}: then write {meant};" in text
    assert warned(tmp_path, f"{key}={value}", f"unusual=['{key}']") == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["operation.speed_rpm=1e12"], "usually 0.1 to 1000000 rpm"),
        (["start.kind=given", "start.state={delta_5=1e300}"], "start.state"),
        (["sweep={parameter='operation.speed_rpm',from=1,to=1e9,count=3}"], "= 1000000000.0: is"),
        (["mesh.half_backlash_um=2000"], "half backlash 2000 um: unlikely"),
        (["pair.face_width_mm=2000"], "face width 2000 mm: unlikely"),
        (
            ["pair.masses_kg=[150, 150]", "pair.inertias_kg_m2=[500, 500]"],
            "(6.9e+02 and 2.1e+02 times those of solid discs), inertias 500 and 500 kg m^2",
        ),
    ],
)
def test_a_value_that_does_not_suit_is_reported(tmp_path, changes, words):
    assert words in " ".join(warned(tmp_path, *changes))


def test_what_stops_a_run_is_followed_by_its_probable_cause(tmp_path):
    small_config(tmp_path)
    width = "mesh.mean_stiffness_N_per_um_mm=14e9"
    ended = run_module("gearchaos.sweep", "gears.toml", *LINEAR, "--set", width, cwd=tmp_path)
    unstable, cause = ended.err.splitlines()
    assert ended.code == 2 and "raise it to" in unstable
    assert "gears.toml: mesh.mean_stiffness_N_per_um_mm = 14000000000.0: is unusual" in cause


@pytest.mark.parametrize("path", sorted(SWEEPS.glob("*.toml")), ids=lambda path: path.stem)
def test_no_configuration_of_the_project_is_unusual(path):
    if "targets" not in path.stem:
        assert [*implausible(gearchaos.load_config(path))] == []


def test_every_plausible_key_exists():
    kinds = gearchaos.Configuration.kinds.values()
    from gearchaos.configuration.base import configuration_keys

    names = {path.rpartition(".")[2] for kind in kinds for path in configuration_keys(kind)}
    assert {*PLAUSIBLE} <= names


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("mesh.half_backlash_um=0.06", "probably it is in mm: then write 60.0"),
        ("sweep={parameter='load', from=0.1, to=0.3, count=1}", "to = 0.3 is not"),
    ],
)
def test_a_quiet_run_prints_warnings(tmp_path, override, words):
    small_config(tmp_path)
    given = ("gears.toml", "--dry-run", "--quiet", "--set", override)
    ended = run_module("gearchaos.sweep", *given, cwd=tmp_path)
    assert ended.code == 0
    assert words in ended.err
    assert "preparing" not in ended.err


def test_a_stiffness_of_the_whole_face_is_told_what_to_do(tmp_path):
    (text,) = warned(tmp_path, "mesh.mean_stiffness_N_per_um_mm=420.0")
    assert "the stiffness of the whole face is divided by its width in mm" in text
