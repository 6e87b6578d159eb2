"""Write a result as a table (.csv, .parquet) or as arrays for MATLAB and Octave (.mat).

A table has one row per lane and one column for each variable that has one number per lane. With
--along section_point it has one row per section point. CSV files give the units in brackets in the
headings; Parquet files give them in the attributes that pandas reads.

The path of the file goes to stdout. Needs more packages: pip install gearchaos[export].
"""

from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from gearchaos.command_line import Command
from gearchaos.errors import ConfigurationError
from gearchaos.options import Option, Overwrite, Units

if TYPE_CHECKING:
    from gearchaos.results.reading.result import Result

ENDINGS = (".csv", ".parquet", ".mat")


class ExportOptions(NamedTuple):
    """Options of ``gearchaos export``."""

    result: Annotated[
        str,
        Option("result file of a sweep or a response", "RESULT.h5", positional=True, file=True),
    ]
    output: Annotated[
        str,
        Option(
            "file to write, ending in .csv, .parquet or .mat", "PATH", positional=True, file=True
        ),
    ]
    along: Annotated[
        tuple[str, ...],
        Option(
            "write one row per point of this dimension too, such as section_point, state or time; "
            "may be repeated",
            "NAME",
        ),
    ] = ()
    overwrite: Overwrite = False
    units: Units = "dimensionless"


def _export(options: ExportOptions) -> None:
    from gearchaos.results.files.atomic_file import check_output, replacing
    from gearchaos.results.reading.result import open_result
    from gearchaos.results.reading.tables import needed

    kind = options.output.lower().rpartition(".")[2]
    if not options.output.lower().endswith(ENDINGS):
        raise ConfigurationError(f"{options.output}: must end in {', '.join(ENDINGS)}")
    result = open_result(options.result)
    result = result.physical() if options.units == "physical" else result
    check_output(options.output, options.overwrite)
    with replacing(options.output, overwrite=options.overwrite) as partial:
        if kind == "mat":
            needed("scipy.io").savemat(partial, _arrays(result), appendmat=False)
        elif kind == "csv":
            frame = result.to_dataframe(*options.along)
            pure, units = ("", "1"), frame.attrs["units"]
            headings = {n: f"{n} [{units[n]}]" for n in units if units[n] not in pure}
            frame.rename(columns=headings).rename_axis(index=headings).to_csv(partial)
        else:
            needed("pyarrow")
            result.to_dataframe(*options.along).to_parquet(partial, engine="pyarrow")
    print(options.output, flush=True)


def _arrays(result: "Result") -> dict[str, Any]:
    """Return the arrays of a result by name, the words of their flags, and the metadata."""
    import numpy as np

    flags = {v.name: v.flags for v in result.variables.values() if v.flags}
    words = {f"{name}_meanings": np.array(flags[name], dtype=object) for name in flags}
    arrays = {name: result[name] for name in result}
    return {**arrays, **words, "metadata": result.metadata}


main = Command("export", __doc__, ExportOptions, _export).start(__name__)
