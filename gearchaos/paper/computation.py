"""Computation of everything that the gallery shows, from two configurations.

Where two motions coexist, a sweep hops when its start state passes from the basin of one motion to
that of the other. The interval in which both exist depends on the gear pair only; the place of the
hop within it depends on the start state too.
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
FINENESS = 10  # Subdivision of a step to locate a hop.

FOLLOWING = {"transient_periods": 100, "recorded_periods": POINTS_NEEDED}
"""Mesh periods per value of a carried sweep: few, since the motion changes little per step."""

ACCURACY = 1e-5  # Accuracy of the ends of the interval in multiples of e(tau).

KEPT_PERIODS = 64
"""Mesh periods of a response; the lines of its spectrum are 1/64 of the mesh frequency apart."""


class Hop(NamedTuple):
    """Two coexisting motions, and where starts change from one to the other.

    Attributes
    ----------
    sweeps : Result
        Sweeps carried upwards and downwards.
    first, last : Boundary
        Ends of the interval with both motions, located by following their orbits.
    changes : dict of str to (float, float)
        By kind of start: the last pitch error without contact loss, as on the motion of the upward
        sweep, and the next pitch error.
    """

    sweeps: Result
    first: Boundary
    last: Boundary
    changes: dict[str, tuple[float, float]]


@dataclass(frozen=True, eq=False)
class Reproduction:
    """All results that are compared with the paper.

    Attributes
    ----------
    config : Configuration
        Configuration of the torsional diagram, figure 7.
    sweep : Result
        The diagram.
    hop : Hop
        The hop in the diagram, and the interval with two coexisting motions.
    exponents : (list of float, list of float)
        Largest exponents before and after the hop from rest, of all ten states and of six.
    response : Result
        Motion from rest with all effects, without pitch error and at the pitch errors of figures
        5, 6, 14, 15 and Table 3.
    motions : Result
        Motions at the pitch errors of figures 8 to 13.
    crisis : Widening
        Where the section in the diagram suddenly widens.
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
        """Return the label of the motion at a pitch error, as in the figures of motions."""
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
        """Our counterparts of the `published` numbers, by key."""
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
            # Fitted: with this mean, Table 2 has the variation of the contact lines; N/(um mm).
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
    return config.physical


def compute_gallery(
    config: Configuration,
    full: Configuration,
    *,
    hop_step: float = STEP,
    periods: int = KEPT_PERIODS,
    threads: int | None = None,
) -> Reproduction:
    """Compute the gallery and report progress.

    Parameters
    ----------
    config, full : Configuration
        ``pan2021.toml`` and ``pan2021_full.toml``, or coarser ones.
    hop_step : float
        Step of the carried sweeps around the hop, in multiples of e(tau).
    periods : int
        Mesh periods of the responses.
    threads : int, optional
        Number of threads; by default all.
    """
    say("figure 7: the sweep over the pitch error")
    sweep = run(config, threads)
    say("the hop of figure 7: both motions, upwards and downwards")
    hop = find_hop(config, step=hop_step, threads=threads)
    # Exponents of the orbits: with soft axial bearings the transient is long.
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
    """Follow both motions to the ends of their interval, and find where starts change between them.

    ``config`` sweeps the pitch error; ``step``: step of the carried sweeps.
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
    """Return the number of the lane nearest to a pitch error."""
    return int(np.argmin(np.abs(result[result.axis] - pitch_error)))


def largest_acceleration(result: Result, pitch_error: float, coordinate: str = "delta_5") -> float:
    """Return the largest acceleration of a coordinate over a response.

    The signed maximum, not the largest magnitude: with it, the increments between the pitch errors
    of figure 14 are as uniform as those printed in the paper.
    """
    return float(np.max(result[f"{coordinate}_acceleration"][lane_of(result, pitch_error)]))
