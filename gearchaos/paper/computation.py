"""Everything that the gallery shows, computed from two configurations.

A pair that settles on one of two coexisting motions hops where its start passes from the basin of
one into that of the other. The ends of the interval in which both exist belong to the pair; the
place of a hop between them belongs to the start state as much as to the pair.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from gearchaos.engine.refinement import Boundary, refined_jumps
from gearchaos.engine.response import respond
from gearchaos.engine.running import run
from gearchaos.figures.response import coordinates_of, samples_per_period
from gearchaos.models import Configuration, GearPairConfiguration
from gearchaos.models.gear_pair.derivation import Quantities
from gearchaos.models.gear_pair.geometry import HelicalPair
from gearchaos.outputs.names import CROSSINGS
from gearchaos.paper.published import contact_line_stiffness, printed_coefficients, published
from gearchaos.paper.stages import Widening, crisis_of, lanes_as_printed
from gearchaos.progress import say
from gearchaos.records.amplitude_spectrum import spectral_lines
from gearchaos.records.period import POINTS_NEEDED
from gearchaos.results.reading.jumps import apart
from gearchaos.results.reading.result import Result
from gearchaos.results.reading.stage_table import LabelledLanes
from gearchaos.system import System

LOW, HIGH = 0.5, 2.0
"""Pitch errors between which both motions are followed, in multiples of e(tau)."""

STEP = 0.01  # Step of the carried sweeps.
FINENESS = 10  # Parts of a step between which the place of a hop is told.

FOLLOWING = {"transient_periods": 100, "recorded_periods": POINTS_NEEDED}
"""Mesh periods of a carried sweep per value: its motion changes little from one to the next."""

ACCURACY = 1e-5  # To which the ends of the interval are located, in multiples of e(tau).

KEPT_PERIODS = 64
"""Mesh periods of a response: lines of a spectrum 1/64 of the mesh frequency apart."""


class Hop(NamedTuple):
    """Two coexisting motions, and where they take over from each other.

    ``sweeps``: carried upwards and downwards; ``first``, ``last``: between which they are on
    different motions, as far as their orbits can be followed; ``changes``: by the kind of the
    start, the last pitch error at which the teeth never part, as on the motion of the upward sweep,
    and the next one.
    """

    sweeps: Result
    first: Boundary
    last: Boundary
    changes: dict[str, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Reproduction:
    """What was computed to answer the paper.

    ``config``: of the torsional diagram, figure 7; ``sweep``: that diagram; ``hop``: the hop in it,
    with the interval in which two motions coexist; ``exponents``: the largest ones before and after
    it, starting at rest, of all ten states and of six; ``response``: all effects, at rest at the
    start, without pitch error and at those of figures 5, 6, 14 and 15 and of Table 3;
    ``motions``: at the pitch errors of figures 8 to 13; ``crisis``: where the diagram of figure 7
    widens at once.
    """

    config: Configuration
    sweep: Result
    hop: Hop
    exponents: tuple[list[float], list[float]]
    response: Result
    motions: Result
    crisis: Widening

    @cached_property
    def lanes(self) -> LabelledLanes:
        """The lanes of the diagram, labelled as the paper does."""
        return lanes_as_printed(self.sweep, self.crisis)

    def motion_at(self, pitch_error: float) -> str:
        """Return the motion at a pitch error as a figure shows it."""
        lanes = lanes_as_printed(self.motions, self.crisis, strictly=True)
        return str(lanes.labels[lane_of(self.motions, pitch_error)])

    def group(self, name: str) -> float:
        """Return a group that all lanes of the sweep share."""
        return float(self.sweep.parameters[name].values)

    @cached_property
    def pair(self) -> HelicalPair:
        """The gear pair of the configuration (Table 1)."""
        return Quantities(physical(self.config)).pair

    @cached_property
    def numbers(self) -> dict[str, float]:
        """Our counterpart of each of the `published` numbers, by its key."""
        speed, response, pair = published().driving_speed_rpm, self.response, self.pair
        printed = published().numbers.mean_stiffness.value * printed_coefficients()
        lines = contact_line_stiffness().coefficients(printed.size)
        driven = Quantities(physical(self.config.replace("operation", {"speed_rpm": speed})))
        stiffness, xi = driven.mean_stiffness, self.group("damping_ratio")
        period = response["mesh_period"][0]
        torsion = response["delta_5_acceleration"][lane_of(response, 1.0), :-1]
        order, amplitude = spectral_lines(torsion, samples_per_period(response))
        numbers = {
            "driven_speed": speed * pair.teeth[0] / pair.teeth[1],
            "mesh_frequency_hz": speed / 60.0 * pair.teeth[0],
            "total_contact_ratio": pair.total_contact_ratio,
            # The mean about which Table 2's variation is that of the contact lines, in N/(um mm).
            "mean_stiffness": np.vdot(lines, printed).real / np.vdot(lines, lines).real,
            "damping_ratio": xi,
            # With the stiffness of the whole face width, in N s/m (eq. 20).
            "mesh_damping": 2.0 * xi * math.sqrt(stiffness * pair.equivalent_mass),
            "frequency": driven.mesh_frequency(),
            "mesh_period": period,
            "spectral_peak": order[1:][np.argmax(amplitude[1:])] / period,
            "hop": self.hop.changes["rest"][1],
            "hop_exponent_before": self.exponents[0][0],
            "hop_exponent_after": self.exponents[0][1],
        }
        for name in coordinates_of(response):
            without, once = (largest_acceleration(response, p, name) for p in (0.0, 1.0))
            numbers[f"added_{name}"] = once - without
        return {key: float(number) for key, number in numbers.items()}


def physical(config: Configuration) -> Mapping[str, Any]:
    """Return every key of the physical tables by its path."""
    assert isinstance(config, GearPairConfiguration)
    return config.physical()


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
    mesh periods of which every step is kept.
    """
    say("figure 7: the sweep over the pitch error")
    sweep = run(config, threads)
    say("the hop of figure 7: both motions, upwards and downwards")
    hop = find_hop(config, step=hop_step, threads=threads)
    # Soft axial bearings take long to come to rest: the exponents are those of the orbits.
    ten, six = (
        [System(scene, pitch_error=p).orbit().exponent for p in hop.changes["rest"]]
        for scene in (full, config)
    )
    say("figures 5, 6, 14 and 15: accelerations of all coordinates")
    response = respond(_at(full, [0.0, *published().increments.pitch_errors]), periods, threads)
    say("figures 8 to 13: motions at six pitch errors")
    shown = _at(config, [motion.pitch_error for motion in published().motions])
    motions = respond(shown, periods, threads)
    return Reproduction(config, sweep, hop, (ten, six), response, motions, crisis_of(sweep))


def find_hop(config: Configuration, step: float, threads: int | None) -> Hop:
    """Follow both motions, to the ends of their interval too, and find where starts change over.

    ``config`` sweeps the pitch error; ``step``: of the carried sweeps.
    """
    config = config.replace("outputs", {"section_points": 1, "lyapunov": False})
    values = np.linspace(LOW, HIGH, 1 + round((HIGH - LOW) / step))
    carried = _at(config, values.tolist()).replace("start.carry", "both")
    for key, periods in FOLLOWING.items():
        carried = carried.replace(f"integration.{key}", periods)
    sweeps = run(carried, threads)
    first, *_, last = refined_jumps(carried, sweeps, apart(sweeps), ACCURACY)
    fine, changes = step / FINENESS, {}
    inside = fine * np.arange(math.ceil(first.above / fine), math.ceil(last.below / fine))
    within = _at(config, inside.tolist()).replace("integration.recorded_periods", 1)
    within = within.replace("outputs.motion", False)
    for kind in ("rest", "contact"):
        found = run(within.replace("start", {"kind": kind}), threads)
        held = found[CROSSINGS] == 0.0
        place = int(np.argmax(held[:-1] & ~held[1:]))
        changes[kind] = tuple(found[found.axis][place : place + 2].tolist())
    return Hop(sweeps, first, last, changes)


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
