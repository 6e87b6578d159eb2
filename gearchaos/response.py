"""Compute the motion at every step of the last mesh periods: displacements, velocities,
accelerations, mesh forces and contact.

With a configuration, the motion of each given value of the swept parameter is computed. With a
result, the motion of one of its lanes continues from the end of the lane, without a transient;
--begin start computes the lane again from its start.

The path of the new result goes to stdout, everything else to stderr; python -m gearchaos.plot draws
it.
"""

import os
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

from gearchaos.command_line import Command
from gearchaos.errors import ConfigurationError
from gearchaos.finishing import ending, output_of
from gearchaos.options import (
    Option,
    OutputFile,
    Overwrite,
    Place,
    Settings,
    Threads,
    placed_coordinates,
)
from gearchaos.progress import count_of

if TYPE_CHECKING:
    from gearchaos.models import Configuration

    Asked = tuple[Configuration, str, list[str], Any]
    """The run, the configuration as written, notes, and the fixed axes."""


class ResponseOptions(NamedTuple):
    """Options of ``gearchaos response``."""

    config: Annotated[
        str,
        Option(
            "configuration, or result with the lane to continue",
            "config.toml|RESULT.h5",
            positional=True,
            file=True,
        ),
    ]
    pitch_error: Annotated[
        tuple[float, ...], Option("multiple of the pitch error; may be repeated", "P")
    ] = ()
    at: Annotated[
        tuple[Place, ...],
        Option(
            "value of the swept parameter; may be repeated. For a result, the nearest lane; with "
            "several axes, NAME=VALUE for each of them",
            "VALUE",
        ),
    ] = ()
    begin: Annotated[
        Literal["end", "start"],
        Option(
            "for a result: continue the lane from its end (default) or repeat it from its start"
        ),
    ] = "end"
    periods: Annotated[int | None, Option("mesh periods to keep (default: 32)", "N")] = None
    output: OutputFile = None
    overwrite: Overwrite = False
    threads: Threads = None
    settings: Settings = ()

    @property
    def places(self) -> tuple[Place, ...]:
        """All given values."""
        return (*self.at, *(Place("pitch_error", value) for value in self.pitch_error))


def _respond(options: ResponseOptions) -> int:
    from h5py import is_hdf5

    # Looking into a pipe would remove its first bytes.
    of_result = os.path.isfile(options.config) and is_hdf5(options.config)
    config, text, note, fixed = (_lane if of_result else _configuration)(options)
    from gearchaos.configuration.methods import METHODS
    from gearchaos.engine.response import compute_response, prepared
    from gearchaos.engine.running import choose_threads, prepare
    from gearchaos.outputs.catalogue import DEFAULT_PERIODS
    from gearchaos.results.files.atomic_file import check_output

    choose_threads(options.threads)
    periods = DEFAULT_PERIODS if options.periods is None else options.periods
    run = prepared(config, periods).with_notes(*note)
    output = output_of(options.output, options.config, "_response.h5")
    check_output(output, options.overwrite)
    run = prepare(run, history_periods=1)
    result = compute_response(run, periods, text, fixed)
    result.save(output, overwrite=options.overwrite)
    diverged, lanes = int((result["status"] != 0).sum()), len(run.lanes)
    fast = " or too fast" if METHODS[run.plan.method].shares_maps else ""
    text = (
        f"{count_of(lanes, 'lane')} over {' by '.join(result.axes)}, "
        f"{periods} periods of {run.plan.steps_per_period} steps, "
        f"{diverged} diverged{fast}"
    )
    return ending(run, output, diverged, text)


def _lane(options: ResponseOptions) -> "Asked":
    """Continue one lane of a result, or repeat it."""
    from gearchaos.engine.recomputing import continued, stored_text
    from gearchaos.results.reading.result import open_result

    if options.settings:
        rule = "is a result, and continues with its own configuration; leave --set out"
        raise ConfigurationError(f"{options.config}: {rule}")
    result = open_result(options.config)
    lane = result.sel("within", **placed_coordinates(options.places, result.axes))
    if lane.axes:
        rest = " and ".join(f"--at {axis}=VALUE" for axis in lane.axes)
        raise ConfigurationError(f"{options.config}: name one lane, with {rest} as well")
    note = f"continues from the {options.begin} of the lane {lane.where} of {options.config}"
    config = continued(lane, options.config, options.begin)
    text = stored_text(lane, options.config, "configuration")
    return config, text, [note], lane.metadata["fixed"]


def _configuration(options: ResponseOptions) -> "Asked":
    """Replace the sweep of a configuration by the given values."""
    from gearchaos.configuration.toml_text import text_of_file, toml_literal
    from gearchaos.models import Configuration

    text = text_of_file(options.config)

    def configured(*more: str) -> Configuration:
        folder = os.path.dirname(options.config) or "."
        return Configuration.from_toml(text, options.config, [*options.settings, *more], folder)

    if not options.places:
        parameter = configured().sweep.parameter
        raise ConfigurationError(
            f"--at: is missing; give one or more values of {parameter}, the swept parameter"
        )
    names = {name or configured().sweep.parameter for name, _ in options.places}
    if len(names) > 1:
        rule = f"name one parameter, not {' and '.join(sorted(names))}"
        raise ConfigurationError(f"--at: {rule}; replace other keys with --set")
    # A repeated value is computed once.
    values = sorted({value for _, value in options.places})
    sweep = {"parameter": min(names), "values": values}
    try:
        config = configured(f"sweep={toml_literal(sweep)}")
    except ConfigurationError as error:
        swept = configured().sweep.parameter
        if swept in names:
            raise
        key = swept if "." in swept else f"groups.{swept}"
        hint = (
            f"values of {min(names)} replace the sweep over {swept}: give one value of {swept} "
            f"with --set {key}=VALUE, or several with --at"
        )
        raise ConfigurationError([hint, *error.problems]) from error
    if config.start.carry != "none":
        raise ConfigurationError(
            f'{options.config}: start.carry = "{config.start.carry}": a lane starts where the lane '
            "before it ends, which single values lack; run the sweep, then: gearchaos response "
            "RESULT.h5 --at VALUE"
        )
    return config, config.text, [], ""


main = Command("response", __doc__, ResponseOptions, _respond).start(__name__)
