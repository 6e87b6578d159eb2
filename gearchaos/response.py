"""Compute the motion of some pitch errors, or of some values of the swept parameter, at every step
of the last mesh periods: displacements, velocities, accelerations, mesh forces and contact. Of a
result, the motion goes on from where one of its lanes ended, with no transient, or is computed
again from where the lane started.

The path of the result goes to stdout, everything else to stderr; python -m gearchaos.plot draws
it.
"""

import os
from argparse import Namespace
from typing import TYPE_CHECKING, Any

from gearchaos.command_line import Command, coordinates
from gearchaos.errors import ConfigurationError
from gearchaos.finishing import ending, output_of

if TYPE_CHECKING:
    from gearchaos.models import Configuration

    Asked = tuple[Configuration, str, list[str], Any]
    """What to compute, the configuration as it was written, what to say of it, and its place."""


def _respond(options: Namespace) -> int:
    from h5py import is_hdf5

    # HDF5 would take the beginning out of a pipe.
    of_result = os.path.isfile(options.config) and is_hdf5(options.config)
    config, text, note, fixed = (_lane if of_result else _configuration)(options)
    from gearchaos.configuration.methods import METHODS
    from gearchaos.engine.response import compute_response, prepared
    from gearchaos.engine.running import choose_threads, prepare
    from gearchaos.outputs.catalogue import DEFAULT_PERIODS
    from gearchaos.results.files.atomic_file import check_output

    choose_threads(options.threads)
    periods = DEFAULT_PERIODS if options.periods is None else options.periods
    simulation = prepared(config, periods)
    output = output_of(options, "_response.h5")
    check_output(output, options.overwrite)
    simulation.notes += note
    prepare(simulation, history_periods=1)
    result = compute_response(simulation, periods, text, fixed)
    result.save(output, overwrite=options.overwrite)
    diverged, lanes = int((result["status"] != 0).sum()), len(simulation.lanes)
    fast = " or too fast" if METHODS[simulation.plan.method].shares_maps else ""
    text = (
        f"{lanes} lane{'s' if lanes != 1 else ''} over {' by '.join(result.axes)}, "
        f"{periods} mesh periods of {simulation.plan.steps_per_period} steps, "
        f"{diverged} diverged{fast}"
    )
    return ending(simulation, output, diverged, text)


def _lane(options: Namespace) -> "Asked":
    """Go on from where one lane of a result ended."""
    from gearchaos.engine.recomputing import continued, stored_text
    from gearchaos.results.reading.result import open_result

    if options.set:
        rule = "is a result, and goes on with its own configuration; leave --set out"
        raise ConfigurationError(f"{options.config}: {rule}")
    result = open_result(options.config)
    lane = result.sel("within", **coordinates(options.at, result.axes))
    if lane.axes:
        rest = " and ".join(f"--at {axis}=VALUE" for axis in lane.axes)
        raise ConfigurationError(f"{options.config}: name one lane, with {rest} as well")
    note = f"goes on from the {options.begin} of the lane {lane.where} of {options.config}"
    config = continued(lane, options.config, options.begin)
    text = stored_text(lane, options.config, "configuration")
    return config, text, [note], lane.metadata["fixed"]


def _configuration(options: Namespace) -> "Asked":
    """Take the place of what a configuration sweeps."""
    from gearchaos.configuration.toml_text import text_of_file, toml_literal
    from gearchaos.models import Configuration

    text = text_of_file(options.config)

    def configured(*more: str) -> Configuration:
        folder = os.path.dirname(options.config) or "."
        return Configuration.from_toml(text, options.config, [*options.set, *more], folder)

    names = {name or configured().sweep.parameter for name, _ in options.at}
    if len(names) != 1:
        rule = f"name one parameter, not {' and '.join(sorted(names)) or 'none'}"
        raise ConfigurationError(f"--at: {rule}; replace other keys with --set")
    # Repeating a value is no mistake worth a message.
    values = sorted({value for _, value in options.at})
    sweep = {"parameter": min(names), "values": values}
    try:
        config = configured(f"sweep={toml_literal(sweep)}")
    except ConfigurationError as error:
        swept = configured().sweep.parameter
        if swept in names:
            raise
        key = swept if "." in swept else f"groups.{swept}"
        hint = (
            f"values of {min(names)} take the place of the sweep over {swept}: give one of it with "
            f"--set {key}=VALUE, or several with --at"
        )
        raise ConfigurationError([hint, *error.problems]) from error
    if config.start.carry != "none":
        raise ConfigurationError(
            f'{options.config}: start.carry = "{config.start.carry}": a lane goes on from the one '
            "before it, and values by themselves have none; run the sweep, then: gearchaos "
            "response RESULT.h5 --at VALUE"
        )
    return config, config.text, [], ""


main = Command("response", __doc__, _respond).start(__name__)
