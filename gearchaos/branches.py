"""Follow the periodic orbits of a sweep as whole branches, stable and unstable.

Every periodic motion that the sweep found is continued in both directions over the swept range,
around folds and through losses of stability. At period doublings the branch of twice the period is
followed as well. Special points are located: folds, branch points, period doublings, Neimark-Sacker
points, and grazing of each flank by orbits of up to 100 mesh periods.

INPUT is the result of a sweep of one parameter with labels, or a configuration, which is computed
first. The branches are written to an HDF5 file; gearchaos plot draws it, alone or into the diagram
of the sweep. The path of the file goes to stdout, the list of special points and everything else to
stderr.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

from gearchaos.command_line import Command
from gearchaos.options import Option, Overwrite, Place, placed_coordinates
from gearchaos.progress import count_of, say

if TYPE_CHECKING:
    from gearchaos.results.files.branch_file import BranchSet
    from gearchaos.results.reading.result import Result


class BranchesOptions(NamedTuple):
    """Options of ``gearchaos branches``."""

    source: Annotated[
        str,
        Option(
            "result file of a sweep, or a configuration ending in .toml",
            "INPUT",
            positional=True,
            file=True,
        ),
    ]
    output: Annotated[
        Path | None,
        Option(
            "file to write (default: the name of the input with _branches.h5 at its end)",
            "BRANCHES.h5",
            ("-o", "--output"),
            file=True,
        ),
    ] = None
    periods: Annotated[
        int,
        Option(
            "longest period that is followed, in excitation periods (default: %(default)s)",
            "N",
            low=1,
            high=64,
        ),
    ] = 8
    at: Annotated[
        tuple[Place, ...],
        Option("use the nearest value of this axis; may be repeated", "NAME=VALUE"),
    ] = ()
    overwrite: Overwrite = False


def _branches(options: BranchesOptions) -> None:
    from gearchaos.engine.branching import find_branches
    from gearchaos.engine.running import compiling
    from gearchaos.finishing import keep_beside
    from gearchaos.results.files.atomic_file import check_output
    from gearchaos.results.files.branch_file import write_branches

    source = Path(options.source)
    output = options.output or Path(f"{source.stem}_branches.h5")
    check_output(output, options.overwrite)
    result = _result(source)
    places = placed_coordinates(options.at, result.axes, result.axis)
    result = result.sel("within", **places) if places else result

    def keep(some: "BranchSet") -> None:
        words = count_of(len(some.branches), "branch", "branches")
        keep_beside(output, words, lambda path: write_branches(path, some, overwrite=True))

    with compiling():
        found = find_branches(result, options.source, options.periods, keep)
    for line in table(found):
        say(line)
    write_branches(output, found, options.overwrite)
    print(output, flush=True)


def _result(source: Path) -> "Result":
    """Return the result of a file, or of a configuration, which is computed."""
    from gearchaos.results.reading.result import open_result

    if source.suffix != ".toml":
        return open_result(source)
    from gearchaos.engine.running import run
    from gearchaos.models import load_config

    return run(load_config(source))


def table(found: "BranchSet") -> list[str]:
    """Return the branches with their special points as lines of a table."""
    from gearchaos.records.branch import notes_of

    name = found.parameter.name
    lines = []
    for number, branch in enumerate(found.branches):
        low, high = float(branch.value.min()), float(branch.value.max())
        lines.append(
            f"branch {number}, period {branch.period}: {name} {low:.6g} to {high:.6g}, "
            f"{count_of(branch.value.size, 'orbit')}, {int(branch.stable.sum())} stable; ends: "
            f"{'; '.join(dict.fromkeys(branch.ends))}"
        )
        lines += [
            f"  {one.kind:16} {name} = {one.value:.10g}{f'  ({one.flank})' if one.flank else ''}"
            for one in branch.specials
        ]
    if not lines:
        return ["no periodic motion to follow"]
    return [*lines, *notes_of(found.metadata)]


main = Command("branches", __doc__, BranchesOptions, _branches).start(__name__)
