"""How right are the labels of the motion?

    python benchmarks/labels.py [--output labels]

Lanes of several sweeps are labelled as a sweep does it, and their motion is told in another way:
each goes on from where it ended, ten times as long and with twice as many steps per period.
It is periodic if Newton's method closes an orbit there whose Floquet multipliers lie inside the
unit circle; chaotic if the plain mean growth at the end of the long run exceeds five standard
errors of batch means; quasi-periodic if there is neither growth nor decay and the section has
correlation dimension 1. What is none of these is counted and not
judged. No label can know what follows its record: lanes that are far from their orbit when the long
run begins and arrive in its course are counted for themselves, and the score is given without and
with them.
"""

import argparse
import json
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from gearchaos_kernels import integrate
from machine import machine_facts, print_machine

import gearchaos
from gearchaos.dynamics.orbits import polish
from gearchaos.engine.simulation import Simulation
from gearchaos.records.label import MEANINGS

SWEEPS = Path(__file__).parent.parent / "sweeps"
LONGER = 10
FINER = 2
POINTS = 8192
PAIRED = 2000
LONGEST = 128
SMALLEST_GROWTH = 1e-3
ARRIVED = 0.02
KINDS = ("periodic", "quasi_periodic", "chaotic")
LONG_PERIOD, LATER, NOT_TOLD = "period > 16", "arrives later", "not told"
ROWS = (*KINDS, LONG_PERIOD, LATER, NOT_TOLD)

SOFT = (
    "integration.transient_periods=4000",
    "sweep.from=0.303",
    "sweep.to=2.503",
    "sweep.count=201",
)
SETS = {
    "Pan 2021": ("pan2021", ["sweep.from=0.003", "sweep.to=13.983", "sweep.count=467"]),
    "torsion alone": (
        "pan2021",
        [
            'scene.effects=["pitch_error", "stiffness_variation", "backlash"]',
            "sweep.from=0.003",
            "sweep.to=14.983",
            "sweep.count=151",
        ],
    ),
    "speeds at P = 6": (
        "mesh_frequency",
        ["groups.pitch_error=6.0", "sweep.from=0.203", "sweep.to=2.003", "sweep.count=151"],
    ),
    "soft bearings": (
        "mesh_frequency",
        [
            "groups.pitch_error=2.82",
            "groups.damping_ratio=0.0013",
            "groups.transverse_stiffness_p=0.112",
            "groups.transverse_stiffness_g=0.033",
            "groups.transverse_damping_p=0.00087",
            "groups.transverse_damping_g=0.00148",
            *SOFT,
        ],
    ),
    "light damping": (
        "mesh_frequency",
        [
            "groups.pitch_error=0.23",
            "groups.damping_ratio=0.0014",
            "groups.transverse_stiffness_p=2.56",
            "groups.transverse_stiffness_g=1.239",
            "groups.transverse_damping_p=0.00155",
            "groups.transverse_damping_g=0.00239",
            *SOFT,
        ],
    ),
    "transient chaos": ("pan2021", ["sweep.from=14.003", "sweep.to=14.993", "sweep.count=100"]),
}


class Judged(NamedTuple):
    """Labels and truths of the lanes of one set, both in words and as periods."""

    values: np.ndarray
    labels: np.ndarray
    periods: np.ndarray
    truths: np.ndarray
    true_periods: np.ndarray


def main() -> None:
    """Label, tell in another way, print the confusion matrix, write JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path("labels"))
    options = parser.parse_args()
    print_machine()
    began = time.perf_counter()
    sets = {}
    for name, (file, overrides) in SETS.items():
        sets[name] = judged(gearchaos.load_config(SWEEPS / f"{file}.toml", overrides))
        counts = {row: int(np.sum(sets[name].truths == row)) for row in ROWS}
        print(f"{name}: " + ", ".join(f"{n} {row}" for row, n in counts.items() if n))
    whole = Judged(*(np.concatenate(columns) for columns in zip(*sets.values(), strict=True)))
    matrix = confusion(whole)
    _print(matrix)
    scores = {
        kind: {
            "lasting": f1(whole, kind, without=(LATER, NOT_TOLD)),
            "with_those_that_arrive_later": f1(whole, kind, without=(NOT_TOLD,)),
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
    wrong = disagreements(sets)
    print("\n".join(wrong))
    facts = {
        "machine": machine_facts(),
        "seconds": time.perf_counter() - began,
        "lanes": whole.values.size,
        "confusion": matrix,
        "f1": scores,
        "period_right": [right, int(np.sum(periodic))],
        "disagreements": wrong,
    }
    options.output.with_suffix(".json").write_text(json.dumps(facts, indent=1))


def judged(config: gearchaos.Configuration) -> Judged:
    """Label the lanes of a sweep and tell their motion in another way."""
    result = gearchaos.run(config)
    steps = FINER * config.integration.steps_per_period
    simulation = Simulation(config.replace("integration.steps_per_period", steps))
    truths, true_periods = told(simulation, result["end_state"])
    return Judged(
        result[result.axis],
        np.array(MEANINGS)[result["motion"]],
        result["period"],
        truths,
        true_periods,
    )


def told(simulation: Simulation, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tell the motion of every lane from a long run at fine steps."""
    numbers = np.arange(len(simulation.lanes))
    system, recorded = simulation.lanes.system_of(numbers), simulation.plan.recorded_periods
    plan = simulation.plan._replace(
        transient_periods=0,
        recorded_periods=LONGER * (simulation.plan.transient_periods + recorded),
        section_points=POINTS,
    )
    outcome = integrate(system, start, plan)
    period = _recurrence(outcome.section)
    stable = polish(system, outcome.end_state, period, plan.steps_per_period).stable
    growth, error = _growth(outcome.growth[:, -LONGER * recorded :])
    arrived = _distance(start, outcome.section[:, -LONGEST:]) < ARRIVED
    truths = np.full(numbers.size, NOT_TOLD, dtype="U20")
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


def _recurrence(section: np.ndarray) -> np.ndarray:
    """Return after how many points a section recurs to 1e-7 of its size, 0 for never."""
    scaled = section / np.abs(section).max(axis=1, keepdims=True)
    period = np.zeros(section.shape[0], dtype=np.int32)
    for n in range(LONGEST, 0, -1):
        apart = np.abs(scaled[:, -LONGEST:] - scaled[:, -LONGEST - n : -n]).max(axis=(1, 2))
        period[apart < 1e-7] = n
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
            for label in MEANINGS
        }
        for truth in ROWS
    }


def f1(lanes: Judged, kind: str, without: tuple[str, ...]) -> float:
    """Return the F1 score of one kind of motion; an unresolved lane counts as missed."""
    judged_lanes = ~np.isin(lanes.truths, without)
    # What arrives later is periodic in the end.
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
        for lane in np.flatnonzero(other & ~np.isin(lanes.truths, (LATER, NOT_TOLD))):
            label, truth = lanes.labels[lane], lanes.truths[lane]
            lines.append(
                f"{name}, {lanes.values[lane]:.6g}: labelled {label} {lanes.periods[lane] or ''}, "
                f"is {truth} {lanes.true_periods[lane] or ''}"
            )
    return lines


def _print(matrix: dict[str, dict[str, int]]) -> None:
    print(f"{'motion':16}" + "".join(f"{label:>16}" for label in MEANINGS))
    for truth, row in matrix.items():
        print(f"{truth:16}" + "".join(f"{row[label]:16d}" for label in MEANINGS))


if __name__ == "__main__":
    main()
