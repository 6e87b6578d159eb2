"""What does each effect cost, and what does the tangent vector cost?

    python benchmarks/effects.py [--rounds 5] [--output effects]

Starting from the bare linear torsion, one effect after the other is switched on. Times are
nanoseconds per Runge-Kutta step and lane on one core, medians over rounds that visit every scene;
the price of an effect is the median of the differences to the scene before it within a round.
"""

import argparse
import json
import statistics
from pathlib import Path

import matplotlib
from gearchaos_kernels import Effects
from machine import machine_facts, print_machine
from matplotlib.figure import Figure
from throughput import engine, nanoseconds_per_step

from gearchaos.figures.style import BLUE, ORANGE, style

SCENES = {
    "linear torsion": Effects(False, False, False, False, False),
    "+ pitch error": Effects(True, False, False, False, False),
    "+ stiffness variation": Effects(True, True, False, False, False),
    "+ backlash": Effects(True, True, True, False, False),
    "+ transverse pair": Effects(True, True, True, True, False),
    "+ axial pair": Effects(True, True, True, True, True),
    "+ friction": Effects(friction=True),
    "its changes within steps": Effects(friction=True),
}
FRICTION = {"friction_coefficient": 0.1, "friction_lever": 0.41}
GROUPS = {
    "+ friction": FRICTION,
    "its changes within steps": {**FRICTION, "pitch_point_phase": 0.01},
}
"""Friction changes its sign where steps end, as by default, and then within two steps a period."""

MODES = {
    "plain": {"tangent": False, "resolved": False},
    "plain, tangent": {"tangent": True, "resolved": False},
    "resolved": {"tangent": False, "resolved": True},
    "resolved, tangent": {"tangent": True, "resolved": True},
}

LOOKS = {
    "plain": {"color": ORANGE},
    "plain, tangent": {"facecolor": "white", "edgecolor": ORANGE, "hatch": "//////"},
    "resolved": {"color": BLUE},
    "resolved, tangent": {"facecolor": "white", "edgecolor": BLUE, "hatch": "//////"},
}


def main() -> None:
    """Measure, print a table, write JSON and a figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--output", type=Path, default=Path("effects"))
    options = parser.parse_args()
    print_machine()
    works = {
        (scene, mode): engine(SCENES[scene], threads=1, **MODES[mode], **GROUPS.get(scene, {}))
        for scene in SCENES
        for mode in MODES
    }
    for work in works.values():
        work()
    rounds = [
        {key: nanoseconds_per_step(work) for key, work in works.items()}
        for _ in range(options.rounds)
    ]
    table = {
        mode: {
            scene: statistics.median(round_[scene, mode] for round_ in rounds) for scene in SCENES
        }
        for mode in MODES
    }
    _print(table)
    facts = {"machine": machine_facts(), "nanoseconds_per_step": table}
    options.output.with_suffix(".json").write_text(json.dumps(facts, indent=1))
    _draw(table, options.output.with_suffix(".png"))


def _print(table: dict[str, dict[str, float]]) -> None:
    print("nanoseconds per step and lane on one core, and what the last effect added\n")
    print(f"{'scene':24}" + "".join(f"{mode:>22}" for mode in table))
    before = dict.fromkeys(table, 0.0)
    for scene in SCENES:
        cells = ""
        for mode, times in table.items():
            cells += f"{times[scene]:12.2f} ({times[scene] - before[mode]:+6.2f})  "
            before[mode] = times[scene]
        print(f"{scene:24}{cells}")


def _draw(table: dict[str, dict[str, float]], path: Path) -> None:
    with matplotlib.rc_context(style()):
        figure = Figure(figsize=(3.35, 2.6), layout="constrained")
        axes = figure.add_subplot()
        rows = range(len(SCENES))
        height = 0.8 / len(table)
        for number, (mode, times) in enumerate(table.items()):
            places = [row + (number - 1.5) * height for row in rows]
            axes.barh(places, list(times.values()), height=height, label=mode, **LOOKS[mode])
        axes.tick_params(axis="y", which="both", left=False, right=False)
        axes.set_yticks(list(rows), list(SCENES))
        axes.invert_yaxis()
        axes.set_xlabel("time per step and lane (ns)")
        axes.legend(frameon=False)
        figure.savefig(path, dpi=300)


if __name__ == "__main__":
    main()
