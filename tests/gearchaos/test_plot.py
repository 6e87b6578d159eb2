"""The plot command on real files: its pictures, messages and exit codes."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from gearchaos.outputs.variable import coordinate
from gearchaos.plot import main
from gearchaos.results.reading.result import Result

from .listed_variables import sweep_variables

PICTURES = {"png": b"\x89PNG", "pdf": b"%PDF", "svg": b"<?xml", "eps": b"%!PS", "tiff": b"II*\0"}


@pytest.fixture
def result_file(tmp_path) -> Path:
    """Write a result of 50 lanes; one lane diverged."""
    load = np.linspace(0.0, 1.0, 50)
    points = np.sqrt(load)[:, np.newaxis] * [-1.0, 1.0]
    status = np.zeros(50)
    status[20] = 1
    points[20] = np.nan
    variables = sweep_variables(
        [coordinate("load", "1", "load", "$f_n$", load)],
        states=("delta_5",),
        section=("delta_5", "delta_1"),
        section_points=2,
        lyapunov=True,
        status_meanings=("ok", "diverged"),
    )
    data = {
        "section_delta_5": points,
        "section_delta_1": -points,
        "lyapunov_exponent": points[:, 0],
        "lyapunov_exponent_standard_error": np.full(50, 0.01),
        "status": status,
        "diverged_period": np.where(status == 1, 9, -1),
        "start_state": points[:, :1],
        "end_state": points[:, 1:],
    }
    path = tmp_path / "pair.h5"
    Result(["load"], variables, data, {}, {"title": "a pair"}).save(path)
    return path


def run(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-W", "error", "-m", "gearchaos.plot", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **environment},
    )


def test_png_and_pdf_appear_beside_the_result_and_their_paths_on_stdout(result_file):
    done = run(result_file)
    written = [result_file.with_suffix(ending) for ending in (".png", ".pdf")]
    assert done.returncode == 0
    assert done.stdout.splitlines() == [str(path) for path in written]
    assert done.stderr == (
        "gearchaos plot: 50 lanes over load, 1 of them diverged, 85 mm x 85 mm at 300 dpi\n"
    )
    assert written[0].read_bytes().startswith(b"\x89PNG")
    assert written[1].read_bytes().startswith(b"%PDF")
    assert {path.name for path in result_file.parent.iterdir()} == {
        "pair.h5",
        "pair.png",
        "pair.pdf",
    }


@pytest.mark.parametrize("backend", ["nonsense", "tkagg"])
def test_no_display_is_needed_whatever_the_backend(result_file, backend):
    done = run(result_file, "--quiet", "--format", "png", MPLBACKEND=backend, DISPLAY="")
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(("ending", "begins"), PICTURES.items())
def test_every_format_says_whose_it_is_and_gives_the_same_bits(result_file, ending, begins):
    drawn = []
    for _ in range(2):
        assert main([str(result_file), "--format", ending, "--dpi", "60"]) == 0
        drawn.append(result_file.with_suffix(f".{ending}").read_bytes())
    assert drawn[0] == drawn[1] and drawn[0].startswith(begins)
    assert b"gearchaos " in drawn[0] and b"Date" not in drawn[0]
    if ending == "eps":
        # EPS has no transparency: a picture with only translucent dots would be a black box.
        pictures = re.findall(rb"false 3 colorimage\n([0-9a-f\n]+)", drawn[0])
        assert len(pictures) == 2
        for picture in pictures:
            shades = np.frombuffer(bytes.fromhex(picture.decode()), np.uint8)
            assert np.mean(shades > 250) > 0.8


@pytest.mark.parametrize("ending", [".png", ".pdf", ".svg", ".tiff"])
def test_a_file_that_the_command_did_not_draw_is_kept(result_file, ending, capsys):
    foreign = result_file.with_suffix(ending)
    foreign.write_text("a photograph of gearchaos")
    kinds = ["--format", f"png,pdf,{ending[1:]}"]
    assert main([str(result_file), *kinds]) == 4
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"gearchaos plot: error: {foreign}: ")
    assert "--overwrite" in err
    assert foreign.read_text() == "a photograph of gearchaos"
    assert len(list(result_file.parent.iterdir())) == 2
    assert main([str(result_file), "--format", ending[1:], "--overwrite"]) == 0
    assert foreign.stat().st_size > 5000


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (["--format", "pdf"], ["pair.pdf"]),
        (["--output", "{}/fig.7"], ["fig.7.png", "fig.7.pdf"]),
        (["--output", "{}/fig7.pdf"], ["fig7.pdf"]),
        (["--output", "{}/fig7.pdf", "--format", "png"], ["fig7.png"]),
        (["--output", "{}", "--format", "png"], ["pair.png"]),
        (["--variable", "section_delta_5", "--format", "png"], ["pair.png"]),
        (["--variable", "section_delta_1", "--format", "png"], ["pair_section_delta_1.png"]),
        (["--from", "0.25", "--to", "1", "--format", "png"], ["pair_from_0.25_to_1.png"]),
    ],
)
def test_names_say_what_is_drawn(result_file, arguments, names, capsys):
    folder = result_file.parent
    assert main([str(result_file), *(text.format(folder) for text in arguments)]) == 0
    assert capsys.readouterr().out.splitlines() == [str(folder / name) for name in names]
    assert all((folder / name).is_file() for name in names)


def test_several_sweeps_are_drawn_over_each_other(result_file, capsys):
    other = result_file.with_name("other.h5")
    other.write_bytes(result_file.read_bytes())
    assert main([str(result_file), str(other), "--format", "svg"]) == 0
    out, err = capsys.readouterr()
    assert out == f"{result_file.with_name('pair_and_other.svg')}\n"
    assert err.count("50 lanes over load") == 2
    assert main([str(result_file), str(other), "-o", str(other), "--overwrite"]) == 0
    assert main([str(result_file), str(other), "--stages"]) == 2
    assert "stages are drawn of one result" in capsys.readouterr().err


def test_an_odd_name_comes_out_as_it_went_in(result_file):
    # The name has characters of formulas and formats, non-ASCII letters, and invalid UTF-8.
    path = os.fsencode(result_file.parent) + b"/pair $ 50 % gr\xc3\xb6\xc3\x9fe \xff.h5"
    with h5py.File(result_file, "r+") as file:
        file.attrs["title"] = ""
    result_file.rename(os.fsdecode(path))
    done = subprocess.run(
        [sys.executable, "-m", "gearchaos.plot", path, "--quiet"],
        capture_output=True,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout == path[:-3] + b".png\n" + path[:-3] + b".pdf\n"


def test_width_height_and_dpi_decide_the_pixels(result_file):
    sizes = ["--width", "127", "--height", "101.6", "--dpi", "100", "--format", "png"]
    assert main([str(result_file), *sizes]) == 0
    header = result_file.with_suffix(".png").read_bytes()[16:24]
    assert (int.from_bytes(header[:4]), int.from_bytes(header[4:])) == (500, 400)


def test_figures_name_their_software_but_no_date(result_file):
    assert main([str(result_file)]) == 0
    png, pdf = (result_file.with_suffix(ending).read_bytes() for ending in (".png", ".pdf"))
    assert b"Software\0gearchaos " in png
    assert b"/Creator (gearchaos " in pdf
    assert b"Date" not in pdf


@pytest.mark.parametrize("kind", ["missing", "truncated", "text", "folder", "other HDF5"])
def test_a_file_that_is_no_result_is_named_and_nothing_is_written(result_file, kind, capsys):
    if kind == "missing":
        result_file.unlink()
    elif kind == "truncated":
        result_file.write_bytes(result_file.read_bytes()[:3000])
    elif kind == "text":
        result_file.write_text("load = 1\n")
    elif kind == "folder":
        result_file.unlink()
        result_file.mkdir()
    else:
        with h5py.File(result_file, "w") as file:
            file["load"] = [1.0]
    before = list(result_file.parent.iterdir())
    assert main([str(result_file)]) == 4
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("gearchaos plot: error: ")
    assert str(result_file) in err
    assert err.count("\n") == 1
    assert list(result_file.parent.iterdir()) == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--variable", "section_delta_9"], "it has section_delta_5, section_delta_1"),
        (["--variable", "section_delta5"], "did you mean section_delta_5?"),
        (["--from", "5"], "the result has 0 to 1"),
        (["--from", "nan"], "not a finite number"),
        (["--width", "1"], "1 must be between 60 and 1000"),
        (["--dpi", "99.5"], "not a whole number"),
        (["--format", "png,gif"], "'gif': a figure is written as png, pdf, svg, eps, tiff"),
        (["--output", "fig.jpg"], "'jpg': a figure is written as png, pdf, svg, eps, tiff"),
        (["--colour"], "unrecognized arguments"),
    ],
)
def test_what_cannot_be_drawn_is_a_usage_error(result_file, arguments, message, capsys):
    assert main([str(result_file), *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert len(list(result_file.parent.iterdir())) == 1


@pytest.mark.parametrize("output", ["nowhere/fig", "nowhere/", "pair.h5/fig"])
def test_a_place_that_cannot_be_written_to_is_an_error(result_file, output, capsys):
    assert main([str(result_file), "--output", f"{result_file.parent}/{output}"]) == 4
    out, err = capsys.readouterr()
    assert out == ""
    assert [line[:23] for line in err.splitlines()] == ["gearchaos plot: error: "]


def test_the_result_itself_is_never_replaced(result_file, capsys):
    disguised = result_file.rename(result_file.with_suffix(".png"))
    before = disguised.read_bytes()
    assert main([str(disguised), "--output", str(disguised), "--overwrite"]) == 4
    assert "is a result file itself" in capsys.readouterr().err
    assert disguised.read_bytes() == before


def test_version_and_help_answer_on_stdout(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("gearchaos ")
    assert main(["--help"]) == 0
    assert "RESULT.h5" in capsys.readouterr().out


def test_every_variable_has_a_figure_of_its_own(result_file, tmp_path, capsys):
    names = ("section_delta_5", "lyapunov_exponent")
    asked = [word for name in names for word in ("--variable", name)]
    assert main([str(result_file), *asked, "--output", str(tmp_path / "all.png")]) == 0
    written = capsys.readouterr().out.splitlines()
    assert written == [str(tmp_path / name) for name in ("all.png", "all_lyapunov_exponent.png")]
    assert len({Path(name).read_bytes() for name in written}) == 2


def test_title_labels_and_font_are_chosen_and_a_drawing_keeps_its_text(
    result_file, tmp_path, capsys
):
    shutil.copy(result_file, tmp_path / "other.h5")
    target = tmp_path / "both.svg"
    words = ("--label", "my first", "--label", "my second", "--title", "Pair $ 7")
    asked = (str(tmp_path / "other.h5"), *words, "--font", "DejaVu Sans", "-o", str(target))
    assert main([str(result_file), *asked]) == 0
    drawing = target.read_text(encoding="utf-8")
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", drawing)
    assert {"my first", "my second", "Pair $ 7"} <= {*texts}
    (style,) = re.findall(r'<text style="([^"]*)"[^>]*>my first<', drawing)
    assert "DejaVu Sans" in style
    for wrong, message in {
        ("--font", "No Such Font"): "--font No Such Font: is no font that matplotlib finds",
        ("--label", "one", "--label", "two"): "--label: is given 2 times for 1 results",
    }.items():
        assert main([str(result_file), *wrong]) == 2
        assert message in capsys.readouterr().err
