"""Command options by type: how a command declares them, and those that several commands share.

The options of a command are a NamedTuple in its own file. Each field is Annotated with an `Option`,
and its type decides how the option is read:

=====================  ==========================================================================
type                   on the command line
=====================  ==========================================================================
``bool``               a flag without a value
``str``, ``Path``      any text
``int``, ``float``     a finite number within the bounds of the `Option`
``Place``              ``NAME=VALUE`` or ``VALUE``
``Literal["a", "b"]``  one of these words
``tuple[T, ...]``      an option that may be repeated, or a positional argument with several values
=====================  ==========================================================================

NamedTuple and not dataclass: importing dataclasses takes a third of the time that an otherwise
empty command needs.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Annotated, Literal, NamedTuple

from gearchaos.errors import ConfigurationError


class Option(NamedTuple):
    """How one field of a command's options is given on the command line.

    ``help``: the text of --help; ``%(default)s`` is replaced by the default of the field.
    ``metavar``: name of the value in --help, by default that of the field.
    ``flags``: by default ``--`` and the name of the field, with hyphens.
    ``positional``: an argument without a flag; it is optional if the field has a default.
    ``low``, ``high``: smallest and largest number.
    ``joined``: one value holds all numbers, with commas between them.
    ``file``: the shell completes names of files.
    """

    help: str
    metavar: str | None = None
    flags: tuple[str, ...] = ()
    positional: bool = False
    low: float = -math.inf
    high: float = math.inf
    joined: bool = False
    file: bool = False


class Place(NamedTuple):
    """A value of an axis, as ``NAME=VALUE`` gives it; the name is empty where only VALUE is."""

    axis: str
    value: float


Arguments = Annotated[tuple[str, ...], "as they were given"]
"""Type of the field ``arguments``, which is no option: all arguments as they were given."""

ConfigFile = Annotated[str, Option("configuration file", "config.toml", positional=True, file=True)]
ResultFile = Annotated[
    str, Option("result file of a sweep", "RESULT.h5", positional=True, file=True)
]
OutputFile = Annotated[
    str | None,
    Option(
        "result file (default: named after the configuration, in the current folder)",
        "PATH",
        ("-o", "--output"),
        file=True,
    ),
]
Overwrite = Annotated[bool, Option("replace existing files")]
Threads = Annotated[int | None, Option("number of threads (default: all cores)", "N")]
Settings = Annotated[
    tuple[str, ...],
    Option(
        "replace one key of the configuration, such as integration.steps_per_period=400; "
        "may be repeated",
        "KEY=VALUE",
        ("--set",),
    ),
]
AsCsv = Annotated[
    bool, Option("print a table as CSV, with the unit of each column, instead of text")
]
Units = Annotated[
    Literal["dimensionless", "physical"] | None,
    Option(
        "units of the values; physical ones are um, m/s, N, s and Hz (default: physical for a "
        "response of a physical system, otherwise dimensionless)"
    ),
]


def one_format(as_json: bool, as_csv: bool) -> None:
    """Raise ConfigurationError if a command is given both --json and --csv."""
    if as_json and as_csv:
        raise ConfigurationError("--json and --csv: print one of the two; leave the other out")


def placed_coordinates(
    places: Iterable[Place], axes: Sequence[str], free: str = "", option: str = "--at"
) -> dict[str, float]:
    """Return the value of each axis that an option names.

    A value without a name belongs to the only axis other than ``free``. Raises ConfigurationError
    if there are several such axes, or if an axis is named twice.
    """
    from gearchaos.outputs.names import axis_name

    others = [axis for axis in axes if axis != free]
    found: dict[str, float] = {}
    for name, value in places:
        axis = axis_name(name) or (others[0] if len(others) == 1 else "")
        if not axis or axis in found:
            raise ConfigurationError(
                f"{option} {name}{'=' if name else ''}{value:g}: must be NAME=VALUE, each of the "
                f"axes {', '.join(axes)} once"
            )
        found[axis] = value
    return found
