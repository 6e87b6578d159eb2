"""Results for other libraries: an xarray Dataset, a pandas DataFrame."""

import csv
import re
import warnings
from collections.abc import Iterable, Sequence
from importlib import import_module
from io import StringIO
from threading import RLock
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.errors import ConfigurationError, FileError
from gearchaos.outputs.variable import Variable
from gearchaos.results.files.result_file import DIMS

if TYPE_CHECKING:
    from gearchaos.results.reading.result import Result


_IMPORTING = RLock()
"""Held while the filters of warnings are changed, which belong to the whole process."""


def needed(package: str, extra: str = "export") -> Any:
    """Import a package of an extra of gearchaos; raise FileError if it is missing."""
    try:
        with _IMPORTING, warnings.catch_warnings():
            # Warnings about other packages do not concern users of gearchaos.
            warnings.simplefilter("ignore")
            return import_module(package)
    except ImportError as error:
        text = f"the package {package.partition('.')[0]} is not installed"
        raise FileError(f'{text}; pip install "gearchaos[{extra}]"') from error


def to_xarray(result: "Result") -> Any:
    """Return an `xarray.Dataset` of all variables, as `xarray.open_dataset` does of the file.

    Returns
    -------
    xarray.Dataset
        Variables, coordinates and attributes.

    Raises
    ------
    FileError
        If xarray is not installed.

    Examples
    --------
    >>> dict(result.to_xarray().sizes)["pitch_error"] == result["pitch_error"].size
    True
    """
    xarray = needed("xarray")
    arrays = {
        name: (dims, result[name], {**result.attributes(name), DIMS: " ".join(dims)})
        for name, dims in ((name, result.dims(name)) for name in result)
    }
    coordinates = {name: arrays.pop(name) for name in result if result.dims(name) == (name,)}
    return xarray.Dataset(arrays, coordinates, result.metadata)


def to_dataframe(result: "Result", *along: str) -> Any:
    """Return a `pandas.DataFrame` with a row per lane, or per lane and point along a dimension.

    Parameters
    ----------
    *along : str
        Further dimension of the rows, such as ``"section_point"``.

    Returns
    -------
    pandas.DataFrame
        Enumerations are categories; ``attrs["units"]`` holds the units of index and columns.

    Raises
    ------
    ConfigurationError
        If no variable has these dimensions.
    FileError
        If pandas is not installed.

    Examples
    --------
    >>> frame = result.to_dataframe()
    >>> frame.index.name
    'pitch_error'
    """
    pandas, dims = needed("pandas"), (*result.axes, *along)
    columns: dict[str, Any] = {}
    for name in (name for name in result if result.dims(name) == dims and name not in dims):
        columns[name], flags = result[name].ravel(), result.variables[name].flags
        if flags:
            # Signed, since flags are stored unsigned and pandas takes -1 for a missing value.
            codes = columns[name].astype(np.int64)
            codes[(codes < 0) | (codes >= len(flags))] = -1
            columns[name] = pandas.Categorical.from_codes(codes, flags)
    if not columns:
        others = {result.dims(name)[len(result.axes) :] for name in result}
        there = ", ".join(sorted(dim[0] for dim in others if len(dim) == 1 and dim[0] in result))
        raise ConfigurationError(f"{', '.join(along)}: no values along it; there are {there}")
    words = {dim: np.array(result.variables[dim].flags) for dim in dims}
    levels = [words[dim][result[dim]] if words[dim].size else result[dim] for dim in dims]
    index = pandas.MultiIndex.from_product(levels, names=dims)
    frame = pandas.DataFrame(columns, index.get_level_values(0) if len(dims) == 1 else index)
    frame.attrs["units"] = {name: result.variables[name].units for name in (*dims, *columns)}
    return frame


def unit_text(variable: Variable) -> str:
    """Return the unit of a variable as plain text, such as ``N`` or ``k_m b'``; ``1`` for none."""
    if variable.units not in ("", "1"):
        return variable.units
    scale = variable.scale.stands_for.removeprefix("unit ").replace("$", "")
    text = re.sub(r"\^?\{?\\prime\}?", "'", scale)
    return re.sub(r"(k_m|')(?=[a-z\\])", r"\1 ", text).replace("\\", "") or "1"


def csv_text(headings: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Return a table as CSV; numbers that are not finite are empty cells."""
    written = StringIO()
    writer = csv.writer(written, lineterminator="\n")
    writer.writerow(headings)
    for row in rows:
        cells = (one.item() if isinstance(one, np.generic) else one for one in row)
        writer.writerow(
            ["" if isinstance(one, float) and not np.isfinite(one) else one for one in cells]
        )
    return written.getvalue().rstrip("\n")
