"""The command that draws a result file: ``python -m gearchaos.plot RESULT.h5``."""

from __future__ import annotations

import argparse
import math
import os
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from gearchaos.command_line import OK, run_command, version_text
from gearchaos.errors import ConfigurationError, FileError

if TYPE_CHECKING:
    from gearchaos.results.result import Result

NAME = "gearchaos plot"
RESULT_ENDINGS = (".h5", ".hdf5", ".nc")

DESCRIPTION = """\
Draw the bifurcation diagram over the Lyapunov chart of a result file, as PNG and PDF beside it."""

EPILOG = """\
A figure that this command drew before is replaced, so that it can be run again and again; any
other file of that name is kept unless --overwrite is given. The paths of the figures go to
stdout. Exit codes: 0 done, 2 the command line asks for what cannot be, 4 a file cannot be read
or written."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run_command(NAME, partial(_run, argv))


def _run(argv: Sequence[str] | None) -> int:
    options = _parser().parse_args(argv)
    # Matplotlib is imported only now: --help and --version answer at once, and an interrupt is
    # caught. It would refuse to be imported where the environment names an unknown backend.
    os.environ["MPLBACKEND"] = "agg"
    from gearchaos.figures import bifurcation_page, save_figure
    from gearchaos.results.result import open_result

    targets = _targets(options)
    _check_targets(targets, options.result, options.overwrite)
    result = open_result(options.result)
    figure = bifurcation_page(
        result,
        options.variable,
        between=(options.low, options.high),
        full_range=options.full_range,
        width_mm=options.width,
        height_mm=options.height,
    )
    title = str(result.metadata.get("title", "")) or options.result.stem
    for target in targets:
        save_figure(figure, target, title=title, dpi=options.dpi)
        print(target, flush=True)
    if not options.quiet:
        width, height = (25.4 * inches for inches in figure.get_size_inches())
        size = f"{width:.0f} mm x {height:.0f} mm at {options.dpi} dpi"
        print(f"{NAME}: {_lanes_in_words(result)}, {size}", file=sys.stderr)
    return OK


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=NAME,
        description=DESCRIPTION,
        epilog=EPILOG,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("result", type=Path, metavar="RESULT.h5", help="result file of a sweep")
    add(
        "-o",
        "--output",
        metavar="PATH",
        help="folder for the figures, their name without its ending, or one file .png or .pdf",
    )
    add("--format", metavar="FORMATS", help="png, pdf or both (default: png,pdf)")
    add("--variable", metavar="NAME", help="section variable (default: section_delta_5)")
    add("--from", dest="low", type=_number, metavar="VALUE", help="lowest parameter to show")
    add("--to", dest="high", type=_number, metavar="VALUE", help="highest parameter to show")
    add("--full-range", action="store_true", help="show every lane, however few lie far out")
    add(
        "--width",
        type=_width,
        default=85.0,
        metavar="MM",
        help="width of the page (default: 85, one column of a journal; two: 180)",
    )
    add("--height", type=_height, metavar="MM", help="height of the page (default: by the width)")
    add("--dpi", type=_dpi, default=300, help="pixels per inch (default: 300)")
    add("--overwrite", action="store_true", help="replace files that this command did not draw")
    add("-q", "--quiet", action="store_true", help="say nothing on stderr unless something fails")
    add("--version", action="version", version=version_text())
    return parser


def _targets(options: argparse.Namespace) -> list[Path]:
    from gearchaos.figures.files import FORMATS

    formats = FORMATS
    if options.format is not None:
        formats = tuple(dict.fromkeys(kind.strip().lower() for kind in options.format.split(",")))
        unknown = [repr(kind) for kind in formats if kind not in FORMATS]
        if unknown:
            raise ConfigurationError(
                f"--format: {', '.join(unknown)} is none of {', '.join(FORMATS)}"
            )
    name = _default_name(options)
    if options.output is None:
        return [options.result.parent / f"{name}.{kind}" for kind in formats]
    output = Path(options.output)
    if output.is_dir() or options.output.endswith(("/", "\\")):
        return [output / f"{name}.{kind}" for kind in formats]
    ending = output.suffix.lower().removeprefix(".")
    if ending in FORMATS:
        if options.format is not None and formats != (ending,):
            raise ConfigurationError(
                f"--output {output} is one {ending} file, but --format asks for "
                f"{','.join(formats)}; leave the ending off"
            )
        return [output]
    return [output.with_name(f"{output.name}.{kind}") for kind in formats]


def _default_name(options: argparse.Namespace) -> str:
    """Name what is drawn, so that a detail does not take the place of the whole."""
    from gearchaos.figures.bifurcation import DEFAULT_VARIABLE

    path: Path = options.result
    name = path.stem if path.suffix.lower() in RESULT_ENDINGS else path.name
    if options.variable not in (None, DEFAULT_VARIABLE):
        name += f"_{options.variable}"
    if options.low is not None:
        name += f"_from_{options.low:g}"
    if options.high is not None:
        name += f"_to_{options.high:g}"
    return name


def _check_targets(targets: Sequence[Path], result: Path, overwrite: bool) -> None:
    from gearchaos.figures.files import is_own_figure
    from gearchaos.results.atomic_file import check_output

    problems: list[str] = []
    for target in targets:
        try:
            if target.exists() and result.exists() and target.samefile(result):
                raise FileError(f"{target}: is the result file itself; choose another --output")
            check_output(target, overwrite=overwrite or is_own_figure(target))
        except FileError as error:
            problems += error.problems
    if problems:
        raise FileError(problems)


def _lanes_in_words(result: Result) -> str:
    lanes = result[result.axis].size
    words = f"{lanes} lane{'s' if lanes != 1 else ''} over {result.axis}"
    diverged = int((result["status"] != 0).sum()) if "status" in result else 0
    return f"{words}, {diverged} of them diverged" if diverged else words


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not a finite number")
    return value


def _within(text: str, low: float, high: float) -> float:
    value = _number(text)
    if not low <= value <= high:
        raise argparse.ArgumentTypeError(f"{text} is not between {low:g} and {high:g}")
    return value


def _width(text: str) -> float:
    return _within(text, 60.0, 1000.0)


def _height(text: str) -> float:
    return _within(text, 70.0, 1000.0)


def _dpi(text: str) -> int:
    value = _within(text, 50.0, 1200.0)
    if value != int(value):
        raise argparse.ArgumentTypeError(f"{text} is not a whole number")
    return int(value)


if __name__ == "__main__":
    sys.exit(main())
