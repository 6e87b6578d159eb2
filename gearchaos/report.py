"""Write a report of a result: one page for a reader without the program.

The page holds figures, tables of stages, jumps, shares and basins, the measured errors, the
configuration, versions, and a glossary. It is a single HTML file that loads nothing from elsewhere.

A sweep, a map, drawn gear pairs, starts, a response, branches and boundaries have figures of their
own. For a third axis there is a set of figures for each of its values, at most 6; --at chooses one.
"""

from typing import Annotated, NamedTuple

from gearchaos.command_line import Command
from gearchaos.options import Option, Overwrite, Place, Units, placed_coordinates


class ReportOptions(NamedTuple):
    """Options of ``gearchaos report``."""

    result: Annotated[
        str,
        Option(
            "result file of any kind, or a file of branches or boundaries",
            "RESULT.h5",
            positional=True,
            file=True,
        ),
    ]
    output: Annotated[
        str | None,
        Option(
            "the page (default: named after the result, in the current folder)",
            "PAGE.html",
            ("-o", "--output"),
            file=True,
        ),
    ] = None
    at: Annotated[
        tuple[Place, ...],
        Option("use the nearest value of this axis; may be repeated", "NAME=VALUE"),
    ] = ()
    units: Units = None
    overwrite: Overwrite = False


def _report(options: ReportOptions) -> None:
    from gearchaos.figures.response import is_response
    from gearchaos.finishing import output_of
    from gearchaos.progress import notice
    from gearchaos.reporting.page import curves_report, result_report
    from gearchaos.results.files.atomic_file import check_output, replacing
    from gearchaos.results.reading.physical_units import in_units
    from gearchaos.results.reading.result import open_result

    output = output_of(options.output, options.result, ".html")
    check_output(output, options.overwrite)
    with notice(f"drawing {options.result}"):
        content = curves_report(options.result)
        if content is None:
            whole = open_result(options.result)
            part = whole.sel("within", **placed_coordinates(options.at, whole.axes, whole.axis))
            shown = in_units(part, options.units, is_response(part))
            content = result_report(options.result, part, shown)
    with replacing(output, overwrite=options.overwrite) as partial:
        partial.write_text(content, encoding="utf-8")
    print(output, flush=True)


main = Command("report", __doc__, ReportOptions, _report).start(__name__)
