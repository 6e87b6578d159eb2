"""Write a result as a table (.csv, .parquet) or as arrays for MATLAB and Octave (.mat).

The table of a sweep has one row per lane and one column for each variable that has one number per
lane. With --along section_point it has one row per section point. The table of a response has one
row per instant; --along lane gives its lanes, and --spectrum its amplitude spectra. In physical
units, times and frequencies are those of the speed of each lane; if the speeds differ, a .mat file
has the times in seconds as time_seconds.

CSV files give the units in brackets in the headings, [1] for pure numbers; Parquet files give them
in the attributes that pandas reads.

The path of the file goes to stdout. Needs more packages: pip install "gearchaos[export]".
"""

from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

from gearchaos.command_line import Command
from gearchaos.errors import ConfigurationError
from gearchaos.options import Option, Overwrite, Units

if TYPE_CHECKING:
    from gearchaos.arrays import Floats
    from gearchaos.results.reading.result import Result

ENDINGS = (".csv", ".parquet", ".mat")
SEPARATORS = {".": ",", ",": ";"}
"""Separators of the columns of a CSV file, by its decimal separator."""


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
            "write one row per point of this dimension too, such as section_point, state or time "
            "(default: time for a response; lane: none); may be repeated",
            "NAME",
        ),
    ] = ()
    spectrum: Annotated[
        bool, Option("of a response, write amplitudes over the frequency instead of the motion")
    ] = False
    decimal: Annotated[
        Literal[".", ","],
        Option("decimal separator of a CSV file; with a comma, semicolons separate columns"),
    ] = "."
    overwrite: Overwrite = False
    units: Units = None


def _export(options: ExportOptions) -> None:
    from gearchaos.figures.response import is_response
    from gearchaos.progress import count_of, say
    from gearchaos.results.files.atomic_file import check_output, replacing
    from gearchaos.results.reading.physical_units import in_units
    from gearchaos.results.reading.result import open_result
    from gearchaos.results.reading.tables import needed

    kind = _kind(options)
    result = open_result(options.result)
    over_time = is_response(result)
    if options.spectrum and not over_time:
        rule = "writes a table of a response, which python -m gearchaos.response computes"
        raise ConfigurationError(f"--spectrum: {rule}; {options.result} has no motion")
    result = in_units(result, options.units, over_time)
    check_output(options.output, options.overwrite)
    with replacing(options.output, overwrite=options.overwrite) as partial:
        if kind == "mat":
            seconds = _seconds_per_period(result, options) if over_time else None
            needed("scipy.io").savemat(partial, _arrays(result, seconds), appendmat=False)
        else:
            frame = _table(result, options, over_time)
            if kind == "csv":
                headings = _headings(result, frame)
                separators = {"decimal": options.decimal, "sep": SEPARATORS[options.decimal]}
                named = frame.rename(columns=headings).rename_axis(index=headings)
                named.to_csv(partial, **separators)
            else:
                needed("pyarrow")
                frame.to_parquet(partial, engine="pyarrow")
            rows, columns = frame.shape
            say(
                f"{count_of(rows, 'row')} of {columns} columns and {_index(frame)}",
                *_left(result, frame, options, over_time),
            )
    print(options.output, flush=True)


def _kind(options: ExportOptions) -> str:
    """Return the ending of the file; raise ConfigurationError if options do not fit together."""
    kind = options.output.lower().rpartition(".")[2]
    if not options.output.lower().endswith(ENDINGS):
        raise ConfigurationError(f"{options.output}: must end in {', '.join(ENDINGS)}")
    if options.decimal != "." and kind != "csv":
        raise ConfigurationError(f"--decimal {options.decimal}: is for .csv only; leave it out")
    if options.spectrum and kind == "mat":
        rule = "writes a table of a response; give a path that ends in .csv or .parquet"
        raise ConfigurationError(f"--spectrum: {rule}")
    if options.along and (options.spectrum or kind == "mat"):
        rule = "a spectrum has one row per lane and frequency"
        if kind == "mat":
            rule = "a .mat file has all arrays with all their dimensions"
        raise ConfigurationError(f"--along {options.along[0]}: {rule}; leave --along out")
    return kind


def _left(result: "Result", frame: Any, options: ExportOptions, over_time: bool) -> list[str]:
    """Return lines about amplitudes that a table of lanes lacks, and about states without units."""
    from gearchaos.outputs.names import ORDER

    lines = []
    if ORDER in result.variables and ORDER not in frame.index.names:
        lines.append(
            f"without the amplitudes over {ORDER}, which have a table of their own: --along {ORDER}"
        )
    physical = options.units == "physical" or (options.units is None and over_time)
    if "state" in options.along and physical:
        lines.append(
            "states along state are dimensionless, since one column cannot have several units"
        )
    return lines


def _index(frame: Any) -> str:
    """Return the names of the index of a table in words."""
    return ", ".join(frame.index.names)


def _table(result: "Result", options: ExportOptions, over_time: bool) -> Any:
    """Return the table of the lanes, of points along dimensions, or of amplitude spectra."""
    from gearchaos.outputs.names import TIME

    if options.spectrum:
        return _spectra(result, _seconds_per_period(result, options))
    along = [name for name in options.along if name != "lane"]
    frame = result.to_dataframe(*along or ([TIME] if over_time and not options.along else ()))
    seconds = _seconds_per_period(result, options)
    if TIME in frame.index.names and frame.attrs["units"][TIME] == "1" and seconds is not None:
        units = {**frame.attrs["units"], TIME: "s"}
        frame = frame.reset_index(TIME)
        frame[TIME] *= seconds.repeat(len(frame) // seconds.size)
        frame = frame.set_index(TIME, append=bool(result.axes))
        frame.attrs["units"] = units
    return frame


def _seconds_per_period(result: "Result", options: ExportOptions) -> "Floats | None":
    """Return the mesh period of each lane in seconds, (lanes,), if the table is to have seconds."""
    from gearchaos.outputs.names import MESH_PERIOD
    from gearchaos.results.reading.physical_units import SECONDS

    unit = result.variables[MESH_PERIOD].units if MESH_PERIOD in result else ""
    if options.units == "dimensionless" or unit not in SECONDS:
        return None
    return SECONDS[unit] * result.lanes(MESH_PERIOD)


def _headings(result: "Result", frame: Any) -> dict[str, str]:
    """Return the heading of every column and index level with its unit, [1] for pure numbers."""
    from gearchaos.results.reading.tables import unit_text

    known = result.variables
    words: dict[str, str] = dict(frame.attrs["units"])
    of_spectra = {f"amplitude_{name}": name for name in known}
    for name in words:
        variable = known.get(of_spectra.get(name) or name)
        if variable is not None and variable.units == words[name]:
            words[name] = "" if variable.flags else unit_text(variable)
    return {name: f"{name} [{unit}]" for name, unit in words.items() if unit}


def _spectra(result: "Result", seconds: "Floats | None") -> Any:
    """Return the single-sided amplitude spectra of all variables of a response over time.

    ``seconds``: mesh period of each lane, (lanes,); None gives frequencies as mesh orders.
    """
    import numpy as np

    from gearchaos.figures.response import response_variables_of, spectrum_of
    from gearchaos.outputs.names import STATUS
    from gearchaos.progress import count_of, say
    from gearchaos.results.reading.tables import needed

    pandas, names = needed("pandas"), response_variables_of(result)
    frequency, unit = ("mesh_order", "1") if seconds is None else ("frequency", "Hz")
    frames, windows = [], []
    for lane in np.flatnonzero(result.lanes(STATUS) == 0).tolist():
        found = {name: spectrum_of(result, lane, name) for name in names}
        order, _, window = found[names[0]]
        windows.append(window)
        places = {axis: np.full(order.size, result.along(axis)[lane]) for axis in result.axes}
        columns = {f"amplitude_{name}": found[name][1] for name in names}
        over = {frequency: order if seconds is None else order / seconds[lane]}
        frames.append(pandas.DataFrame({**places, **over, **columns}))
    if not frames:
        raise ConfigurationError("--spectrum: every lane of the response diverged")
    for window in dict.fromkeys(windows):
        say(f"spectrum of {count_of(windows.count(window), 'lane')}: {window}")
    frame = pandas.concat(frames).set_index([*result.axes, frequency])
    units = {axis: result.variables[axis].units for axis in result.axes} | {frequency: unit}
    units |= {f"amplitude_{name}": result.variables[name].units for name in names}
    frame.attrs["units"] = units
    return frame


def _arrays(result: "Result", seconds: "Floats | None") -> dict[str, Any]:
    """Return the arrays of a result by name, the words of their flags, and the metadata.

    ``seconds``: mesh period of each lane, (lanes,). Where times are in mesh periods, those of each
    lane in seconds are added.
    """
    import numpy as np

    from gearchaos.outputs.names import TIME

    flags = {v.name: v.flags for v in result.variables.values() if v.flags}
    words = {f"{name}_meanings": np.array(flags[name], dtype=object) for name in flags}
    arrays = {name: result[name] for name in result}
    if seconds is not None and result.variables[TIME].units == "1":
        shape = *(result[axis].size for axis in result.axes), result[TIME].size
        arrays["time_seconds"] = np.outer(seconds, result[TIME]).reshape(shape)
    return {**arrays, **words, "metadata": result.metadata}


main = Command("export", __doc__, ExportOptions, _export).start(__name__)
