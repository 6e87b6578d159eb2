"""Follow folds, period doublings and grazing of periodic orbits over two parameters.

Curves are started where the motion of the map changes between neighbouring lanes, and from special
points of branches of periodic orbits along some lines across the map. They are folds, period
doublings, Neimark-Sacker points, and grazing of each flank by orbits of up to 100 mesh periods.
Points of codimension 2 are located on them: cusps, resonances 1:1 to 1:4, fold-flip points, and
points where a grazing meets another boundary.

INPUT is the result of a sweep of two parameters with labels, or a configuration. For a
configuration a coarse map is computed first. The curves are written to an HDF5 file; gearchaos plot
draws it over the map. The path of the file goes to stdout, the table of the curves and everything
else to stderr.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

from gearchaos.command_line import Command
from gearchaos.options import Option, Overwrite, Place, placed_coordinates
from gearchaos.progress import count_of, say

if TYPE_CHECKING:
    from gearchaos.results.files.boundary_file import BoundarySet
    from gearchaos.results.reading.result import Result


class BoundariesOptions(NamedTuple):
    """Options of ``gearchaos boundaries``."""

    source: Annotated[
        str,
        Option(
            "result file of a map, or a configuration ending in .toml",
            "INPUT",
            positional=True,
            file=True,
        ),
    ]
    output: Annotated[
        Path | None,
        Option(
            "file to write (default: the name of the input with _boundaries.h5 at its end)",
            "BOUNDARIES.h5",
            ("-o", "--output"),
            file=True,
        ),
    ] = None
    periods: Annotated[
        int,
        Option(
            "longest period of the orbits, in excitation periods (default: %(default)s)",
            "N",
            low=1,
            high=16,
        ),
    ] = 1
    lines: Annotated[
        int,
        Option(
            "lines across the map from which more curves start (default: %(default)s in each "
            "direction, one where every value needs its own flow maps)",
            "N",
            low=0,
            high=1000,
        ),
    ] = 4
    at: Annotated[
        tuple[Place, ...],
        Option("use the nearest value of this axis; may be repeated", "NAME=VALUE"),
    ] = ()
    overwrite: Overwrite = False


def _boundaries(options: BoundariesOptions) -> None:
    from gearchaos.engine.bounding import find_boundaries
    from gearchaos.engine.running import compiling
    from gearchaos.finishing import keep_beside
    from gearchaos.results.files.atomic_file import check_output
    from gearchaos.results.files.boundary_file import write_boundaries

    source = Path(options.source)
    output = options.output or Path(f"{source.stem}_boundaries.h5")
    check_output(output, options.overwrite)

    def keep(some: "BoundarySet") -> None:
        words = count_of(len(some.boundaries), "curve")
        keep_beside(output, words, lambda path: write_boundaries(path, some, overwrite=True))

    with compiling():
        result = _result(source)
        places = placed_coordinates(options.at, result.axes, result.axis)
        result = result.sel("within", **places) if places else result
        found = find_boundaries(result, options.source, options.periods, options.lines, keep)
    for line in table(found):
        say(line)
    write_boundaries(output, found, options.overwrite)
    print(output, flush=True)


def _result(source: Path) -> "Result":
    """Return the map of a file, or a coarse map of a configuration."""
    from gearchaos.results.reading.result import open_result

    if source.suffix != ".toml":
        return open_result(source)
    from gearchaos.engine.bounding import coarse_map
    from gearchaos.models import load_config

    return coarse_map(load_config(source))


def table(found: "BoundarySet") -> list[str]:
    """Return the curves with their points of codimension 2 as lines of a table."""
    from gearchaos.records.branch import notes_of

    names = [one.name for one in found.parameters]
    lines = []
    for number, one in enumerate(found.boundaries):
        ranges = ", ".join(
            f"{name} {low:.6g} to {high:.6g}" if low < high else f"{name} = {low:.6g}"
            for name, low, high in zip(
                names, one.values.min(axis=0), one.values.max(axis=0), strict=True
            )
        )
        kind = f"{one.kind} of {one.flank}" if one.flank else one.kind
        lines.append(
            f"curve {number}, {kind}, period {one.period}: {ranges}, "
            f"{count_of(one.arclength.size, 'point')}; "
            f"ends: {'; '.join(dict.fromkeys(one.ends))}"
        )
        for point in one.points:
            place = ", ".join(
                f"{name} = {value:.10g}" for name, value in zip(names, point.values, strict=True)
            )
            lines.append(f"  {point.kind:35} {place}")
    if not lines:
        return ["no boundary starts from the map or on these lines; give more with --lines"]
    return [*lines, *notes_of(found.metadata)]


main = Command("boundaries", __doc__, BoundariesOptions, _boundaries).start(__name__)
