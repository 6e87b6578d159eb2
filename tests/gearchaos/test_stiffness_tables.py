"""A stiffness from a table over the mesh period: Fourier series, file and faults."""

from pathlib import Path

import numpy as np
import pytest

import gearchaos
from gearchaos.engine.run_plan import plan_run
from gearchaos.models.phase_series import series_of
from gearchaos.models.registry import system_of
from gearchaos.models.stiffness_table import unit_of

SWEEPS = Path(__file__).parents[2] / "sweeps"
COSINE, SINE = (-30.0, 0.0, 4.0), (12.0, -7.0, 0.0)


def stiffness(phase):
    """Return 300 and three harmonics at phases in mesh periods."""
    turns = 2.0 * np.pi * np.outer(phase, [1, 2, 3])
    return 300.0 + np.cos(turns) @ COSINE + np.sin(turns) @ SINE


def uneven(points):
    """Return uneven phases of a mesh period that do not begin at zero."""
    even = np.arange(points) / points
    return even + 0.08 * np.sin(2.0 * np.pi * even) - 0.3


def csv_text(phase, values, headings="phase,k [N/um]", mark=","):
    rows = zip(map(float, phase), map(float, values), strict=True)
    return "\n".join([headings, *(f"{one!r}{mark}{k!r}" for one, k in rows)])


@pytest.mark.parametrize("phase", [np.arange(24) / 24, uneven(40), np.arange(25) / 24])
def test_a_table_of_few_harmonics_gives_these_exactly(phase):
    series = series_of(tuple(phase), tuple(stiffness(phase)), 1e-9, 40)
    assert series.harmonics == 3
    assert series.mean == pytest.approx(300.0, abs=1e-9)
    assert series.cosine == pytest.approx(COSINE, abs=1e-9)
    assert series.sine == pytest.approx(SINE, abs=1e-9)
    assert series.largest_error < 1e-11


def test_the_series_is_the_shortest_one_within_the_bound():
    phase = np.arange(360) / 360
    # One and two pairs of teeth alternate, with transitions of a twelfth of a period.
    values = np.interp(phase, [0, 1 / 12, 0.6, 0.6 + 1 / 12, 1], [1.0, 1.8, 1.8, 1.0, 1.0])
    transform = np.fft.rfft(values) / 360
    squares = 2.0 * np.abs(transform[1:]) ** 2
    for bound in (0.05, 0.01, 0.003):
        series = series_of(tuple(phase), tuple(values), bound, 40)
        # By Parseval's theorem, the omitted harmonics are the deviation.
        left = np.sqrt(squares[series.harmonics :].sum()) / transform[0].real
        assert series.error == pytest.approx(left, rel=0.02)
        shorter = np.sqrt(squares[series.harmonics - 1 :].sum()) / transform[0].real
        assert series.error <= bound < 1.02 * shorter


@pytest.mark.parametrize(
    ("heading", "unit"),
    [
        ("stiffness_N_per_um", "N/um"),
        ("k [N/µm]", "N/um"),
        ("k (N/mm)", "N/mm"),
        ("mesh stiffness in N/m", "N/m"),
        ("k [N/(um mm)]", "N/(um mm)"),
        ("k_N_per_um_mm", "N/(um mm)"),
        ("c_gamma [N/(mm·µm)]", "N/(um mm)"),
        ("c [N/(mm um)]", "N/(um mm)"),
        ("c [N/mm/um]", "N/(um mm)"),
        # Only the beginning of these headings is a known unit.
        ("c [N/(um cm)]", ""),
        ("c [N/(mm mm)]", ""),
        ("c [N/mm^2]", ""),
        ("k_N_per_mm^2", ""),
        ("k_N/mm²", ""),
        ("k_N/mm2", ""),
        ("k N/mm per mm", ""),
        ("k_N_per_mm_per_mm", ""),
        ("k", ""),
    ],
)
def test_the_unit_is_in_the_heading(heading, unit):
    assert unit_of(heading) == unit


def machine(table, folder=None, **rest):
    text = (SWEEPS / "two_masses.toml").read_text()
    text = text.replace("stiffness = 100.0", f"stiffness = {{ shape = 'table', {table} }}")
    return gearchaos.Configuration.from_toml(text, "my.toml", (), folder, **rest)


def test_a_machine_says_that_it_converts_no_unit(tmp_path):
    phase = np.arange(24) / 24
    for heading, told in (("k_N_per_um", True), ("k", False)):
        text = csv_text(360.0 * phase, stiffness(phase), f"angle / deg;{heading}", ";")
        (tmp_path / "k.csv").write_text(text.replace(".", ","))
        config = machine("fit_error = 1e-9, file = 'k.csv'", str(tmp_path))
        notes = " ".join(plan_run(config).notes)
        assert ("clearance.stop.stiffness: the unit N/um is not converted" in notes) == told


def test_a_machine_takes_a_table_and_its_result_keeps_the_file(tmp_path):
    phase = np.arange(24) / 24
    text = csv_text(360.0 * phase, stiffness(phase), "angle / deg;k", ";").replace(".", ",")
    (tmp_path / "k.csv").write_text(f"# from an FE program\n{text}\n")
    config = machine("fit_error = 1e-9, file = 'k.csv'", str(tmp_path))
    waves = config.clearance["stop"].waves
    assert waves.cosine == pytest.approx(COSINE, abs=1e-9)
    # The text that is kept is sufficient: no file is read.
    again = gearchaos.Configuration.from_toml(config.text, "kept.toml")
    assert again.clearance == config.clearance
    listed = machine(
        f"fit_error = 1e-9, phase = {phase.tolist()}, values = {stiffness(phase).tolist()}"
    )
    assert listed.machine({}).contact_stiffness == pytest.approx(
        config.machine({}).contact_stiffness, abs=1e-9
    )
    notes = plan_run(config).notes
    assert any("clearance.stop.stiffness: 3 harmonics fit k.csv" in note for note in notes)
    assert "clearance.stop.stiffness.fit_error" not in config.parameters


ROWS = [f"{n / 24!r},{300.0 + min(n, 24 - n)!r}" for n in range(24)]


@pytest.mark.parametrize(
    ("rows", "more", "message"),
    [
        (ROWS[:6] + ROWS[9:], "", "has a gap: no point between the phases 0.208333 and 0.375"),
        (ROWS[:9], "", "has a gap"),
        ([*ROWS[:5], "0.1,300.0", *ROWS[5:]], "", "point 6 has the phase 0.1 after 0.166667"),
        ([*ROWS[:5], "0.2,-300.0", *ROWS[5:]], "", "at the phase 0.2, is -300, and a stiffness"),
        ([*ROWS[:5], "0.2,", *ROWS[5:]], "", "line 7, column k: must be a finite number"),
        ([*ROWS, "1.0,390.0"], "", "begins with 300 and ends, a mesh period later, with 390"),
        ([*ROWS, "1.2,300.0"], "", "covers 1.2 mesh periods, must be at most 1; set `period`"),
        (ROWS, "fit_error = 1e-4, most_harmonics = 2,", "2 harmonics fit it to"),
        (ROWS, "column = 'c',", 'has no column "c"; name one of its headings'),
        ([], "", "points; give at least 12"),
    ],
)
def test_a_table_that_is_not_sound_is_refused_in_a_sentence(tmp_path, rows, more, message):
    (tmp_path / "k.csv").write_text("\n".join(["phase,k", *rows]))
    with pytest.raises(gearchaos.ConfigurationError) as refused:
        machine(f"{more} file = 'k.csv'", str(tmp_path))
    assert message in str(refused.value) and "k.csv" in str(refused.value)
    assert str(refused.value).startswith("my.toml: clearance.stop.stiffness")
    assert len(str(refused.value).splitlines()) == 1


def test_a_stored_configuration_opens_no_file():
    with pytest.raises(gearchaos.ConfigurationError, match="other files are not read here"):
        machine("file = '/etc/hostname'")


def test_headings_are_needed(tmp_path):
    (tmp_path / "k.csv").write_text("\n".join(ROWS))
    with pytest.raises(gearchaos.ConfigurationError, match="no line with two headings"):
        machine("file = 'k.csv'", str(tmp_path))


def pair(table, *without):
    mesh = {"mean_stiffness_N_per_um_mm": 20.0, "half_backlash_um": 20.0, "damping_ratio": 0.03}
    mesh = {name: value for name, value in mesh.items() if name not in without}
    return gearchaos.Configuration.from_tables(
        {
            "pair": {
                "teeth": [21, 38],
                "normal_module_mm": 2.166,
                "normal_pressure_angle_deg": 20.0,
                "helix_angle_deg": 20.0,
                "face_width_mm": 15.0,
            },
            "operation": {"speed_rpm": 4000.0, "torque_Nm": 20.0},
            "mesh": {**mesh, "stiffness": {"shape": "table", "fit_error": 1e-9, **table}},
            "scene": {"effects": ["stiffness_variation", "backlash"]},
            "sweep": {"parameter": "operation.speed_rpm", "values": [4000.0, 5000.0]},
        }
    )


def test_a_gear_pair_takes_its_mean_and_its_harmonics_from_a_table():
    phase = np.arange(24) / 24
    table = {"phase": phase.tolist(), "values": (1e3 * stiffness(phase)).tolist(), "unit": "N/mm"}
    mean = "mean_stiffness_N_per_um_mm"
    with pytest.raises(gearchaos.ConfigurationError, match=r"beside a table .* in N/mm.*keep one"):
        pair(table)
    config = pair(table, mean)
    found = system_of(config, {"operation.speed_rpm": np.array([4000.0])})
    assert found.stiffness_cosine == pytest.approx(np.divide(COSINE, 300.0), abs=1e-12)
    assert found.stiffness_sine == pytest.approx(np.divide(SINE, 300.0), abs=1e-12)
    width = config.pair.face_width_mm
    same = pair({**table, "unit": "1"}).replace(f"mesh.{mean}", 300.0 / width)
    per_width = pair(
        {**table, "values": (stiffness(phase) / width).tolist(), "unit": "N/(um mm)"}, mean
    )
    for other in (same, per_width):
        expected = system_of(other, {"operation.speed_rpm": np.array([4000.0])})
        assert found.groups.mesh_frequency == pytest.approx(expected.groups.mesh_frequency)
        assert found.groups.load == pytest.approx(expected.groups.load, rel=1e-12)
    del table["unit"]
    with pytest.raises(gearchaos.ConfigurationError, match=r"mesh\.stiffness\.unit: is missing"):
        pair(table, mean)


def train(**mesh):
    tables = gearchaos.load_config(SWEEPS / "two_stage.toml").tables()
    tables["mesh"]["first"].pop("stiffness_N_per_um")
    tables["mesh"]["first"] |= mesh
    return gearchaos.Configuration.from_tables(tables)


def test_a_mesh_of_a_train_takes_a_table():
    usual = gearchaos.load_config(SWEEPS / "two_stage.toml")
    usual = usual.replace("mesh.first.phase_turns", 0.2).replace("mesh.first.harmonics", 4)
    # The table has the series of one and two tooth pairs that alternate.
    number, phase = np.arange(1, 5), np.arange(48) / 48
    waves = np.cos(2.0 * np.pi * np.outer(phase, number)) @ (np.sinc(1.6 * number))
    table = {"phase": phase.tolist(), "values": (350e3 * (1.0 + 2.0 * waves)).tolist()}
    config = train(
        stiffness={"shape": "table", **table, "unit": "N/mm", "fit_error": 1e-9}, phase_turns=0.2
    )
    expected, found = (one.machine({}) for one in (usual, config))
    assert found.contact_stiffness == pytest.approx(expected.contact_stiffness, abs=1e-9)
    assert found.contact_damping == pytest.approx(expected.contact_damping, rel=1e-12)
    assert "mesh.first.stiffness_N_per_um" not in config.parameters


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        ({}, r"mesh\.first\.stiffness_N_per_um: is missing; give it, or stiffness"),
        ({"stiffness_N_per_um": 350.0, "unit": "N/um"}, "keep one of the two"),
        ({"unit": None}, r"mesh\.first\.stiffness\.unit.*must be one of N/um, N/mm, N/m"),
    ],
)
def test_a_mesh_of_a_train_has_one_stiffness(mesh, message):
    phase = np.arange(24) / 24
    table = {"shape": "table", "phase": phase.tolist(), "values": stiffness(phase).tolist()}
    if "unit" in mesh:
        unit = mesh.pop("unit")
        mesh = {**mesh, "stiffness": {**table, **({"unit": unit} if unit else {})}}
    with pytest.raises(gearchaos.ConfigurationError, match=message):
        train(**mesh)
