"""Everything that the gallery shows, computed from two configurations."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gearchaos.configuration import Configuration
from gearchaos.engine.response import respond
from gearchaos.engine.running import run
from gearchaos.errors import ConfigurationError
from gearchaos.paper.hop import HIGH, LOW, STARTS, STEP, Hop, exponents_beside, find_hop
from gearchaos.paper.published import published
from gearchaos.paper.stages import Crisis, crisis_of, lanes_as_printed
from gearchaos.progress import say
from gearchaos.results.result import Result
from gearchaos.results.stage_table import LabelledLanes

KEPT_PERIODS = 64
"""Mesh periods of a response: lines of a spectrum 1/64 of the mesh frequency apart."""


@dataclass(frozen=True, eq=False)
class Reproduction:
    """What was computed to answer the paper.

    ``config``: of the torsional diagram, figure 7; ``sweep``: that diagram; ``hop``: the hop in it,
    with the interval in which two motions coexist; ``exponents``: the largest ones before and after
    it, starting at rest, of all ten states and of six; ``response``: all effects, at rest at the
    start, without pitch error and at those of figures 5, 6, 14 and 15 and of Table 3;
    ``motions``, ``motions_from_contact``: at the pitch errors of figures 8 to 13, by the start;
    ``crisis``: where the diagram of figure 7 widens at once.
    """

    config: Configuration
    sweep: Result
    hop: Hop
    exponents: tuple[list[float], list[float]]
    response: Result
    motions: Result
    motions_from_contact: Result
    crisis: Crisis

    @cached_property
    def lanes(self) -> LabelledLanes:
        """The lanes of the diagram, labelled as the paper does."""
        return lanes_as_printed(self.sweep, self.crisis)

    def motions_at(self, pitch_error: float) -> list[str]:
        """Return the motion at a pitch error, from rest and from contact, as a figure shows it."""
        both = self.motions, self.motions_from_contact
        lanes = [lanes_as_printed(result, self.crisis, strictly=True) for result in both]
        return [str(one.labels[lane_of(self.motions, pitch_error)]) for one in lanes]

    def group(self, name: str) -> float:
        """Return a group that all lanes of the sweep share."""
        return float(self.sweep.parameters[name].value)


def compute(
    config: Configuration,
    full: Configuration,
    *,
    hop_step: float = STEP,
    periods: int = KEPT_PERIODS,
    threads: int | None = None,
) -> Reproduction:
    """Compute the gallery, and say what comes next.

    ``config``, ``full``: ``pan2021.toml`` and ``pan2021_full.toml``; coarser ones give a coarser
    gallery sooner; ``hop_step``: of the carried sweeps between which the hop lies; ``periods``:
    mesh periods of which every step is kept. Raises ConfigurationError if no two motions coexist,
    the starts do not hop from one to the other, or the motion on two bands ends in no crisis.
    """
    say("figure 7: the sweep over the pitch error")
    sweep = run(config, threads)
    say("the hop of figure 7: both motions, upwards and downwards")
    hop = find_hop(config, step=hop_step, threads=threads)
    crisis = crisis_of(sweep)
    if crisis is None or hop is None or hop.changes.keys() != STARTS.keys():
        raise ConfigurationError(
            f"{config.source}: there is no hop as in figure 7 between {LOW:g} and {HIGH:g} e(tau), "
            "or no crisis after it; take back what was changed in it"
        )
    ten, six = (exponents_beside(scene, hop.changes["rest"], threads) for scene in (full, config))
    say("figures 5, 6, 14 and 15: accelerations of all coordinates")
    response = respond(_at(full, [0.0, *published().increments.pitch_errors]), periods, threads)
    say("figures 8 to 13: motions at six pitch errors")
    shown = _at(config, [motion.pitch_error for motion in published().motions])
    motions, from_contact = (
        respond(shown.replace("start", {"kind": kind}), periods, threads)
        for kind in ("rest", "contact")
    )
    return Reproduction(config, sweep, hop, (ten, six), response, motions, from_contact, crisis)


def _at(config: Configuration, pitch_errors: list[float]) -> Configuration:
    return config.replace("sweep", {"parameter": "pitch_error", "values": pitch_errors})


def lane_of(result: Result, pitch_error: float) -> int:
    """Return the number of the lane next to a pitch error."""
    return int(np.argmin(np.abs(result[result.axis] - pitch_error)))


def largest_acceleration(result: Result, pitch_error: float, coordinate: str = "delta_5") -> float:
    """Return the largest acceleration of a coordinate over a response.

    Signed, not in magnitude: so read, the growth between the pitch errors of figure 14 is as even
    as the paper prints it.
    """
    return float(np.max(result[f"{coordinate}_acceleration"][lane_of(result, pitch_error)]))
