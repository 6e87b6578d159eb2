"""Lanes of a result that are computed again, refined, or continued from their ends."""

from typing import NamedTuple

import numpy as np
from gearchaos_kernels import Status, integrate

from gearchaos.configuration.methods import METHODS
from gearchaos.dynamics.plans import plan_of
from gearchaos.errors import ConfigurationError, FileError
from gearchaos.interrupts import check
from gearchaos.models import Configuration
from gearchaos.models.registry import system_of
from gearchaos.outputs.names import CONVERTED, REALISATION, axis_name
from gearchaos.records.label import CHAOTIC_GROWTH
from gearchaos.records.lyapunov import largest_exponent
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import labelled_lanes

MOST_CHAOTIC_LANES = (
    25  # Chaotic lanes that are tried, spread evenly over the sweep: they bound the cost.
)
"""Largest number of chaotic lanes that are tried, spread over the sweep: it limits the cost."""


def stored_text(result: Result, name: str, attribute: str) -> str:
    """Return the configuration in an attribute of a result; FileError if it is missing."""
    text = str(result.metadata.get(attribute, ""))
    if not text:
        raise FileError(
            f"{name}: holds no configuration in its attribute {attribute}; run the sweep again"
        )
    return text


def computable(result: Result, name: str) -> Configuration:
    """Return the configuration with which lanes of a result can be recomputed or continued.

    Messages call the result ``name``. Raises FileError if it does not contain its configuration.
    """
    return _as_computed(_stored(result, name), result, name)


def _stored(result: Result, name: str) -> Configuration:
    """Return the configuration in a result."""
    text = stored_text(result, name, "configuration_resolved")
    return Configuration.from_toml(text, f"{name} (configuration_resolved)")


def _as_computed(config: Configuration, result: Result, name: str) -> Configuration:
    """Return the configuration in a result with what is fixed, and with what was computed."""
    if CONVERTED in result.metadata:
        raise ConfigurationError(
            f"{name}: {result.metadata[CONVERTED]}: is in physical units, and lanes are computed "
            "from the values of the configuration; use the result before Result.physical"
        )
    if config.control is not None:
        raise ConfigurationError(
            f"{name}: is a sweep with [control], whose lanes are not recomputed one by one; "
            "compute the sweep without [control] for this"
        )
    parameters = [REALISATION, *(sweep.parameter for sweep in config.sweeps.values())]
    fixed = {p: result.fixed[axis_name(p)] for p in parameters if axis_name(p) in result.fixed}
    if fixed:
        config = config.at(fixed)
    # The steps and periods of the computation, which may differ from the configured ones.
    taken = {
        f"integration.{key}": int(result.metadata[key])
        for key in ("steps_per_period", "transient_periods", "recorded_periods")
        if key in result.metadata
    }
    for key, value in {
        **taken,
        "integration.tolerance": None,
        "integration.error_check": 0.0,
        "outputs.exponents": False,
        "outputs.motion": True,
    }.items():
        config = config.replace(key, value)
    return config


def refinable(result: Result, name: str) -> Configuration:
    """Return the configuration with which lanes between those of a result can be computed.

    Errors are those of `computable`; ConfigurationError if a lane depends on its number or on other
    lanes.
    """
    config = computable(result, name)
    start = config.start
    if config.sweep.parameter in config.discrete_parameters:
        raise ConfigurationError(
            f"{name}: nothing lies between two values of {config.sweep.parameter}; refine a sweep "
            "of another parameter"
        )
    carried = start.carry != "none"
    if carried or start.kind == "random" or start.drawn:
        rule = "nothing lies between lanes whose starts are carried on, random or drawn"
        remedy = "sweep again with another [start]"
        if carried:
            remedy += (
                ', such as carry = "none", or refine the jumps of both directions without --at'
            )
        raise ConfigurationError(f"{name}: {rule}; {remedy}")
    if start.kind == "grid":
        state = zip(result.variables["state"].flags, result["start_state"][0].tolist(), strict=True)
        config = config.replace("start", {"kind": "given", "state": dict(state)})
    return config


def continued(lane: Result, name: str, begin: str = "end") -> Configuration:
    """Return the configuration of the motion that continues from the end of a lane.

    Parameters
    ----------
    lane : Result
        A result with all axes fixed.
    name : str
        Name of the result in messages.
    begin : str
        "end" continues the lane without a transient; "start" repeats it, transient included.

    Returns
    -------
    Configuration
        The configuration, with the whole scene that the lane was computed with.

    Raises
    ------
    FileError
        If the result does not contain its configuration.
    ConfigurationError
        If the lane diverged.
    """
    stored, ended = _stored(lane, name), lane[f"{begin}_state"].tolist()
    config = _as_computed(stored, lane, name)
    if not np.isfinite(ended).all():
        status = lane.variables["status"].flags[lane["status"]].replace("_", " ")
        raise ConfigurationError(
            f"{name}: {lane.where}: the status of this lane is {status}; choose another with --at"
        )
    state = dict(zip(lane.variables["state"].flags, ended, strict=True))
    for key, value in {
        "start": {"kind": "given", "state": state},
        # States that are missing in the file would start far from their orbits.
        "scene.effects": config.needed_effects,
    }.items():
        config = config.replace(key, value)
    method = METHODS.get(config.integration.method)
    given = stored.integration.steps_per_period is not None
    if method is not None and method.exact and not given:
        # The steps do not change the motion, and a response may need more of them.
        config = config.replace("integration.steps_per_period", None)
    return config.replace("integration.transient_periods", 0) if begin == "end" else config


class Survival(NamedTuple):
    """The chaotic lanes that stay chaotic over further records.

    Attributes
    ----------
    records : int
        Number of further records.
    lanes : int
        Number of lanes that were tried.
    outlasting : int
        Number of lanes that are still chaotic.
    """

    records: int
    lanes: int
    outlasting: int

    @property
    def text(self) -> str:
        """The numbers in one line."""
        tried = f"{self.outlasting} of {self.lanes} lanes that were tried"
        return f"chaotic: {tried} outlast {self.records} records"


def survival(config: Configuration, result: Result, records: int) -> Survival:
    """Count the chaotic lanes that are still chaotic after a number of further records.

    A lane is still chaotic if a disturbance grows over the later half of the last record at the
    rate of `CHAOTIC_GROWTH` per record. ``config``: from `computable`, of ``result``, which has one
    axis.
    """
    chaotic = np.flatnonzero(labelled_lanes(result).labels == "chaotic")
    if not chaotic.size:
        return Survival(records, 0, 0)
    chosen = np.linspace(0, chaotic.size - 1, min(MOST_CHAOTIC_LANES, chaotic.size))
    lanes = chaotic[chosen.round().astype(np.intp)]
    values = {config.sweep.parameter: result[result.axis][lanes]}
    system = system_of(config, values, config.needed_effects)
    plan = plan_of(config, transient_periods=0, tangent=True)
    state, tangent = result["end_state"][lanes], None
    for _ in range(records):
        check()
        outcome = integrate(system, state, plan, tangent_start=tangent)
        state, tangent = outcome.end_state, outcome.end_tangent
    later = outcome.growth[:, plan.recorded_periods // 2 :]
    exponent, _ = largest_exponent(later, np.ones(lanes.size))
    growing = exponent * plan.recorded_periods > CHAOTIC_GROWTH
    return Survival(records, lanes.size, int(np.sum(growing & (outcome.status == Status.OK))))
