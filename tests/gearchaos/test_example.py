"""The ready configurations are listed, copied and loaded."""

from pathlib import Path

from gearchaos.example import main
from gearchaos.models import load_config

SWEEPS = Path(__file__).resolve().parents[2] / "sweeps"


def test_every_ready_configuration_is_listed_with_what_it_is(capsys):
    assert main([]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == sorted(
        path.stem for path in SWEEPS.glob("*.toml")
    )
    assert all(len(line) > 30 for line in lines)


def test_one_is_copied_as_it_is_and_nothing_is_replaced(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["spur_pair"]) == 0
    assert capsys.readouterr().out == "spur_pair.toml\n"
    copied = tmp_path / "spur_pair.toml"
    assert copied.read_bytes() == (SWEEPS / "spur_pair.toml").read_bytes()
    assert load_config(copied).sweep
    copied.write_text("mine")
    assert main(["spur_pair"]) == 4
    assert copied.read_text() == "mine" and "--overwrite" in capsys.readouterr().err
    assert main(["spur_pair.toml", "--overwrite"]) == 0
    assert main(["spurpair"]) == 2
    assert "inspection, mesh_frequency, pan2021," in capsys.readouterr().err


def test_measured_deviations_are_copied_along(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "inspection.csv").write_text("mine")
    assert main(["inspection"]) == 4
    assert [path.name for path in tmp_path.iterdir()] == ["inspection.csv"]
    assert "inspection.csv" in capsys.readouterr().err
    assert main(["inspection", "--overwrite"]) == 0
    assert capsys.readouterr().out == "inspection.toml\ninspection.csv\n"
    error = load_config(tmp_path / "inspection.toml").pitch_error
    assert [len(gear.cumulative_um) for gear in (error.driving, error.driven)] == [21, 38]
