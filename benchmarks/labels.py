"""How right are the labels of the motion?

    python benchmarks/labels.py [--sets unseen] [--output labels]

Lanes of several sweeps are labelled as a sweep does it, and their motion is identified differently:
each continues from where it ended, ten times as long and for 20,000 periods at least, with twice as
many steps per period.
It is periodic if Newton's method closes an orbit where it ends whose Floquet multipliers lie inside
the unit circle; chaotic if the plain mean growth over the later half of the long run exceeds five
standard errors of batch means; quasi-periodic if there is neither growth nor decay and the section
has correlation dimension 1. What is none of these is counted and not judged. No label can know what
follows its record: lanes that are far from their orbit when the long run begins and arrive in its
course are counted for themselves, and the score is given without and with them.

The sets are those on which the rules were tuned, and others that were fixed before the present
rules and on which nothing is chosen. Each kind has its own score.
"""

import argparse
import json
import time
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import integrate
from machine import machine_facts, print_machine

import gearchaos
from gearchaos.dynamics.orbits import polish
from gearchaos.engine.run_plan import RunPlan, plan_run
from gearchaos.records.label import MOTION_MEANINGS

SWEEPS = Path(__file__).parent.parent / "sweeps"
LONGER = 10
FEWEST_PERIODS = 20_000
FINER = 2
POINTS = 8192
PAIRED = 2000
LONGEST = 128
RECURRING = (1e-7, 1e-3)
SMALLEST_GROWTH = 3e-4
ARRIVED = 0.02
KINDS = ("periodic", "quasi_periodic", "chaotic")
LONG_PERIOD, LATER, NOT_IDENTIFIED = "period > 16", "arrives later", "not identified"
ROWS = (*KINDS, LONG_PERIOD, LATER, NOT_IDENTIFIED)

PAIR = {
    "mesh_frequency": 0.8758760318208343,
    "damping_ratio": 0.025819888974716113,
    "load": 0.26762,
    "half_backlash": 0.94518,
    "pitch_error_amplitude": 0.022749,
    "stiffness_variation_scale": 0.6666666666666666,
    "transverse_stiffness_p": 36.315,
    "transverse_damping_p": 0.084229,
    "transverse_stiffness_g": 6.3545,
    "transverse_damping_g": 0.0058386,
}
"""Groups of all sets, except for those that a set names."""

TORSION = 'scene.effects=["pitch_error", "stiffness_variation", "backlash"]'


class Lanes(NamedTuple):
    """A sweep of the pair: parameter, first and last value, number of lanes; what else differs."""

    parameter: str
    first: float
    last: float
    count: int
    groups: Mapping[str, float] = MappingProxyType({})
    settings: tuple[str, ...] = ()

    def configuration(self) -> gearchaos.Configuration:
        """Return the sweep that computes these lanes."""
        groups = {k: v for k, v in ({**PAIR, **self.groups}).items() if k != self.parameter}
        file = "mesh_frequency" if self.parameter == "mesh_frequency" else "pan2021"
        return gearchaos.load_config(
            SWEEPS / f"{file}.toml",
            [
                *(f"groups.{key}={value!r}" for key, value in groups.items()),
                f"sweep={{parameter='{self.parameter}', from={self.first!r}, "
                f"to={self.last!r}, count={self.count}}}",
                *self.settings,
            ],
        )


def _bearings(p: float, g: float, damping_p: float, damping_g: float) -> dict[str, float]:
    return {
        "transverse_stiffness_p": p,
        "transverse_stiffness_g": g,
        "transverse_damping_p": damping_p,
        "transverse_damping_g": damping_g,
    }


LONG = ("integration.transient_periods=4000",)
TUNED = {
    "Pan 2021": Lanes("pitch_error", 0.003, 13.983, 467),
    "torsion alone": Lanes("pitch_error", 0.003, 14.983, 151, {}, (TORSION,)),
    "speeds at P = 6": Lanes("mesh_frequency", 0.203, 2.003, 151, {"pitch_error": 6.0}),
    "soft bearings": Lanes(
        "mesh_frequency",
        0.303,
        2.503,
        201,
        {"pitch_error": 2.82, "damping_ratio": 0.0013, **_bearings(0.112, 0.033, 0.00087, 0.00148)},
        LONG,
    ),
    "light damping": Lanes(
        "mesh_frequency",
        0.303,
        2.503,
        201,
        {"pitch_error": 0.23, "damping_ratio": 0.0014, **_bearings(2.56, 1.239, 0.00155, 0.00239)},
        LONG,
    ),
    "transient chaos": Lanes("pitch_error", 14.003, 14.993, 100),
    "soft bearings, short record": Lanes(
        "mesh_frequency",
        0.403,
        2.603,
        111,
        {"pitch_error": 3.4, "damping_ratio": 0.0022, **_bearings(0.14, 0.042, 0.0013, 0.0017)},
    ),
    "loads on soft bearings": Lanes(
        "load",
        0.043,
        1.243,
        81,
        {
            "mesh_frequency": 1.17,
            "pitch_error": 2.4,
            "damping_ratio": 0.0027,
            **_bearings(0.31, 0.088, 0.0019, 0.0013),
        },
        ("integration.transient_periods=1500",),
    ),
    "stiffer bearings": Lanes(
        "mesh_frequency",
        0.353,
        2.453,
        106,
        {
            "pitch_error": 1.1,
            "load": 0.15,
            "half_backlash": 0.6,
            "damping_ratio": 0.004,
            **_bearings(1.31, 0.52, 0.0037, 0.0022),
        },
        ("integration.transient_periods=1500",),
    ),
    "errors on softer bearings": Lanes(
        "pitch_error", 0.07, 14.07, 101, _bearings(2.3, 0.9, 0.017, 0.006)
    ),
    "errors at weak damping": Lanes("pitch_error", 0.11, 14.96, 100, {"damping_ratio": 0.013}),
}
"""On these the rules were chosen, or have been looked at while they were."""

UNSEEN = {
    "weak damping": Lanes("pitch_error", 0.21, 14.91, 30, {"damping_ratio": 0.009}),
    "light load": Lanes("pitch_error", 0.13, 11.83, 30, {"load": 0.07}),
    "softer bearings": Lanes("pitch_error", 0.17, 13.97, 30, _bearings(1.7, 0.61, 0.012, 0.0045)),
    "speeds at P = 9": Lanes("mesh_frequency", 0.227, 1.967, 30, {"pitch_error": 9.0}),
    "loads at P = 12": Lanes("load", 0.033, 1.193, 30, {"pitch_error": 12.0}),
    "torsion, weak damping": Lanes(
        "pitch_error", 0.37, 14.47, 30, {"damping_ratio": 0.013}, (TORSION,)
    ),
    "another pair": Lanes(
        "pitch_error",
        0.11,
        14.83,
        30,
        {
            "load": 0.26343,
            "half_backlash": 0.92386,
            "pitch_error_amplitude": 0.022811,
            "damping_ratio": 0.033491,
            **_bearings(47.989, 5.6392, 0.11385, 0.004757),
        },
    ),
    "speeds of another pair": Lanes(
        "mesh_frequency",
        0.311,
        2.399,
        30,
        {
            "pitch_error": 2.0,
            "load": 0.12,
            "half_backlash": 0.5,
            "damping_ratio": 0.006,
            **_bearings(0.83, 0.37, 0.0031, 0.0017),
        },
        ("integration.transient_periods=1500",),
    ),
    "clearances at P = 11": Lanes("half_backlash", 0.041, 1.931, 30, {"pitch_error": 11.0}),
    "very soft bearings": Lanes(
        "mesh_frequency",
        0.417,
        2.737,
        30,
        {"pitch_error": 4.1, "damping_ratio": 0.0021, **_bearings(0.21, 0.055, 0.0011, 0.0009)},
        ("integration.transient_periods=2000",),
    ),
    "tori 1": Lanes(
        "mesh_frequency",
        0.531,
        2.297,
        40,
        {"pitch_error": 1.7, "damping_ratio": 0.0017, **_bearings(0.46, 0.15, 0.0012, 0.0019)},
        ("integration.transient_periods=1000",),
    ),
    "tori 2": Lanes(
        "pitch_error",
        0.23,
        7.93,
        40,
        {"mesh_frequency": 1.31, "damping_ratio": 0.0024, **_bearings(0.095, 0.29, 0.0016, 0.0011)},
        ("integration.transient_periods=1000",),
    ),
    "tori 3": Lanes(
        "load",
        0.061,
        0.931,
        40,
        {
            "mesh_frequency": 1.07,
            "pitch_error": 3.3,
            "damping_ratio": 0.0019,
            **_bearings(0.17, 0.071, 0.001, 0.0014),
        },
        ("integration.transient_periods=1000",),
    ),
    "no helix": Lanes(
        "pitch_error",
        0.29,
        13.67,
        25,
        {"damping_ratio": 0.017},
        ("pair.helix_angle_deg=0.0",),
    ),
}
"""On these nothing is ever chosen: they were fixed before the rules that they judge."""

SETS = {"tuned": TUNED, "unseen": UNSEEN}


class Judged(NamedTuple):
    """Labels and truths of the lanes of one set, both in words and as periods."""

    values: np.ndarray
    labels: np.ndarray
    periods: np.ndarray
    truths: np.ndarray
    true_periods: np.ndarray
    seconds: np.ndarray


def main() -> None:
    """Label, identify the motions differently, print the confusion matrices, write JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", choices=SETS, action="append", help="which (default: all)")
    parser.add_argument("--output", type=Path, default=Path("labels"))
    options = parser.parse_args()
    print_machine()
    facts = {"machine": machine_facts()}
    for kind in options.sets or SETS:
        print(f"\n{kind}")
        facts[kind] = scored(SETS[kind])
    options.output.with_suffix(".json").write_text(json.dumps(facts, indent=1))


def scored(sets: dict[str, Lanes]) -> dict:
    """Judge sets of one kind, print what comes out and return it."""
    began = time.perf_counter()
    found = {}
    for name, lanes in sets.items():
        found[name] = judged(lanes.configuration())
        counts = {row: int(np.sum(found[name].truths == row)) for row in ROWS}
        print(f"{name}: " + ", ".join(f"{n} {row}" for row, n in counts.items() if n), flush=True)
    whole = Judged(*(np.concatenate(columns) for columns in zip(*found.values(), strict=True)))
    matrix = confusion(whole)
    _print(matrix)
    scores = {
        kind: {
            "lasting": f1(whole, kind, without=(LATER, NOT_IDENTIFIED)),
            "with_those_that_arrive_later": f1(whole, kind, without=(NOT_IDENTIFIED,)),
        }
        for kind in KINDS
    }
    scores["macro"] = {
        key: float(np.mean([scores[kind][key] for kind in KINDS])) for key in scores[KINDS[0]]
    }
    for kind, score in scores.items():
        print(f"F1 {kind}: " + ", ".join(f"{key} {value:.4f}" for key, value in score.items()))
    periodic = (whole.truths == "periodic") & (whole.labels == "periodic")
    right = int(np.sum(whole.periods[periodic] == whole.true_periods[periodic]))
    print(f"the period is right in {right} of {np.sum(periodic)} periodic lanes")
    wrong = disagreements(found)
    print("\n".join(wrong))
    return {
        "seconds": time.perf_counter() - began,
        "seconds_of_the_sweeps": float(sum(one.seconds[0] for one in found.values())),
        "lanes": whole.values.size,
        "confusion": matrix,
        "f1": scores,
        "period_right": [right, int(np.sum(periodic))],
        "disagreements": wrong,
    }


def judged(config: gearchaos.Configuration) -> Judged:
    """Label the lanes of a sweep, and identify their motion differently."""
    began = time.perf_counter()
    result = gearchaos.run(config)
    seconds = time.perf_counter() - began
    steps = FINER * config.integration.steps_per_period
    simulation = plan_run(config.replace("integration.steps_per_period", steps))
    truths, true_periods = motions_of(simulation, result["end_state"])
    return Judged(
        result[result.axis],
        np.array(MOTION_MEANINGS)[result["motion"]],
        result["period"],
        truths,
        true_periods,
        np.array([seconds]),
    )


def motions_of(simulation: RunPlan, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Identify the motion of every lane from a long run at fine steps."""
    numbers = np.arange(len(simulation.lanes))
    system, recorded = simulation.lanes.system_of(numbers), simulation.plan.recorded_periods
    periods = LONGER * (simulation.plan.transient_periods + recorded)
    plan = simulation.plan._replace(
        transient_periods=0,
        recorded_periods=max(periods, FEWEST_PERIODS),
        section_points=POINTS,
    )
    outcome = integrate(system, start, plan)
    period = np.zeros(numbers.size, dtype=np.int32)
    stable = np.zeros(numbers.size, dtype=np.bool_)
    for distance in RECURRING:
        nearly = np.where(stable, 0, _recurrence(outcome.section, distance))
        found = polish(system, outcome.end_state, nearly, plan).stable
        period, stable = np.where(found, nearly, period), stable | found
    growth, error = _growth(outcome.growth[:, -plan.recorded_periods // 2 :])
    arrived = _distance(start, outcome.section[:, -LONGEST:]) < ARRIVED
    truths = np.full(numbers.size, NOT_IDENTIFIED, dtype="U20")
    for lane in numbers:
        if stable[lane]:
            truths[lane] = "periodic" if period[lane] <= 16 else LONG_PERIOD
            if not arrived[lane]:
                truths[lane] = LATER
        elif growth[lane] > max(5.0 * error[lane], SMALLEST_GROWTH):
            truths[lane] = "chaotic"
        elif max(abs(growth[lane]), error[lane]) < SMALLEST_GROWTH and _on_a_curve(
            outcome.section[lane]
        ):
            truths[lane] = "quasi_periodic"
    return truths, np.where(stable, period, 0)


def _growth(growth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean growth per period and its standard error from 20 batches."""
    periods = growth.shape[1] // 20 * 20
    batches = growth[:, -periods:].reshape(growth.shape[0], 20, -1).mean(axis=2)
    return batches.mean(axis=1), batches.std(axis=1, ddof=1) / np.sqrt(20.0)


def _distance(states: np.ndarray, section: np.ndarray) -> np.ndarray:
    """Return how far states lie from the nearest point of a section, relative to its size."""
    size = np.abs(section).max(axis=1)
    apart = np.abs(section - states[:, np.newaxis]) / size[:, np.newaxis]
    return apart.max(axis=2).min(axis=1)


def _recurrence(section: np.ndarray, distance: float) -> np.ndarray:
    """Return after how many points a section recurs to a share of its size, 0 for never."""
    scaled = section / np.abs(section).max(axis=1, keepdims=True)
    period = np.zeros(section.shape[0], dtype=np.int32)
    for n in range(LONGEST, 0, -1):
        apart = np.abs(scaled[:, -LONGEST:] - scaled[:, -LONGEST - n : -n]).max(axis=(1, 2))
        period[apart < distance] = n
    return period


def _on_a_curve(section: np.ndarray) -> bool:
    """Whether both halves of a section have dimension 1; with two states none can.

    Damping contracts every area by the same factor over a mesh period, also that which a closed
    curve in the plane would enclose.
    """
    halves = np.array_split(section, 2)
    return section.shape[1] > 2 and all(0.8 < dimension(half) < 1.2 for half in halves)


def dimension(section: np.ndarray) -> float:
    """Estimate the correlation dimension of a set of points (Grassberger, Procaccia 1983).

    The share of pairs closer than r grows like r to the power of the dimension; the exponent is
    read off between one pair in a thousand and one in a hundred, of points in random order.
    """
    scaled = (section - section.mean(axis=0)) / np.maximum(section.std(axis=0), 1e-300)
    points = np.random.default_rng(0).permutation(scaled)[:PAIRED]
    squares = np.sum(points**2, axis=1)
    apart = squares[:, np.newaxis] + squares - 2.0 * points @ points.T
    pairs = np.maximum(apart[np.triu_indices(points.shape[0], 1)], 0.0)
    shares = np.array([1e-3, 3e-3, 1e-2])
    radii = np.sqrt(np.quantile(pairs, shares))
    return float(np.polyfit(np.log(radii), np.log(shares), 1)[0])


def confusion(lanes: Judged) -> dict[str, dict[str, int]]:
    """Count lanes by truth and label."""
    return {
        truth: {
            label: int(np.sum((lanes.truths == truth) & (lanes.labels == label)))
            for label in MOTION_MEANINGS
        }
        for truth in ROWS
    }


def f1(lanes: Judged, kind: str, without: tuple[str, ...]) -> float:
    """Return the F1 score of one kind of motion; an unresolved lane counts as missed."""
    judged_lanes = ~np.isin(lanes.truths, without)
    # Lanes that arrive later are periodic in the end.
    truths = np.where(lanes.truths == LATER, "periodic", lanes.truths)
    true, labelled = truths[judged_lanes] == kind, lanes.labels[judged_lanes] == kind
    return float(2 * np.sum(true & labelled) / (np.sum(true) + np.sum(labelled)))


def disagreements(sets: dict[str, Judged]) -> list[str]:
    """Word every lane whose label is not its motion."""
    lines = []
    for name, lanes in sets.items():
        wanted = np.where(lanes.truths == LONG_PERIOD, "unresolved", lanes.truths)
        other = (lanes.labels != wanted) | (
            (lanes.labels == "periodic") & (lanes.periods != lanes.true_periods)
        )
        for lane in np.flatnonzero(other & ~np.isin(lanes.truths, (LATER, NOT_IDENTIFIED))):
            label, truth = lanes.labels[lane], lanes.truths[lane]
            lines.append(
                f"{name}, {lanes.values[lane]:.6g}: labelled {label} {lanes.periods[lane] or ''}, "
                f"is {truth} {lanes.true_periods[lane] or ''}"
            )
    return lines


def _print(matrix: dict[str, dict[str, int]]) -> None:
    print(f"{'motion':16}" + "".join(f"{label:>16}" for label in MOTION_MEANINGS))
    for truth, row in matrix.items():
        print(f"{truth:16}" + "".join(f"{row[label]:16d}" for label in MOTION_MEANINGS))


if __name__ == "__main__":
    main()
