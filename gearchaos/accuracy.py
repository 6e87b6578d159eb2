"""The command that shows what accuracy costs: ``python -m gearchaos.accuracy config.toml``."""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from gearchaos.command_line import OK, run_command, version_text
from gearchaos.errors import ConfigurationError

if TYPE_CHECKING:
    from gearchaos.engine.simulation import Simulation

NAME = "gearchaos accuracy"
MODES = ("plain", "resolved")
TRUTH_STEPS = 3200
ROUNDS = 3
WANTED = (1e-4, 1e-6, 1e-8)

DESCRIPTION = "Measure error and time of step sizes on some lanes of a sweep."

EPILOG = f"""\
The truth is the engine's own finest setting, {TRUTH_STEPS} resolved steps per mesh period. Errors
are those that 95 % of the periodic lanes do not exceed. The table goes to stdout, everything else
to stderr; a figure (PNG and PDF) and the table as JSON are written under the name in --output.
Exit codes: 0 done, 2 usage or configuration, 4 cannot read or write."""


class Setting(NamedTuple):
    """What one step size gives, beside its cost."""

    steps: int
    mode: str
    section_error: float
    exponent_error: float
    changed_share: float
    seconds: float

    @property
    def error(self) -> float:
        """The larger of the two errors."""
        return max(self.section_error, self.exponent_error)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return run_command(NAME, partial(_run, argv))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog=NAME, description=DESCRIPTION, epilog=EPILOG, allow_abbrev=False
    )
    add = parser.add_argument
    add("config", metavar="config.toml", help="the sweep whose lanes are tried")
    add("--steps", type=_steps, default="50,100,200,400,800", metavar="N,N,...")
    add("--lanes", type=int, default=64, metavar="N", help="lanes to try (default: 64)")
    add("-o", "--output", metavar="NAME", help="name of figure and JSON, without its ending")
    add("--overwrite", action="store_true", help="replace existing files")
    add("--threads", type=int, metavar="N", help="threads to use (default: all cores)")
    add("--set", action="append", default=[], metavar="KEY=VALUE", help="replace one key")
    add("-q", "--quiet", action="store_true", help="say nothing on stderr unless something fails")
    add("--version", action="version", version=version_text())
    return parser


def _steps(text: str) -> list[int]:
    try:
        steps = sorted({int(part) for part in text.split(",")})
    except ValueError:
        steps = [0]
    if steps[0] < 1 or steps[-1] > TRUTH_STEPS // 2:
        raise argparse.ArgumentTypeError(
            f"{text!r}: give numbers from 1 to {TRUTH_STEPS // 2}, separated by commas"
        )
    return steps


def _run(argv: Sequence[str] | None) -> int:
    options = _parser().parse_args(argv)
    from gearchaos_kernels import current_threads

    from gearchaos.configuration import load_config
    from gearchaos.engine.provenance import provenance
    from gearchaos.engine.running import choose_threads
    from gearchaos.engine.simulation import Simulation
    from gearchaos.figures.files import FORMATS, save_figure
    from gearchaos.figures.work_precision import work_precision_page
    from gearchaos.results.atomic_file import check_output, replacing

    if options.lanes < 1:
        raise ConfigurationError(f"--lanes {options.lanes}: must be at least 1")
    config = load_config(options.config, options.set)
    stem = options.output or f"{Path(options.config).stem}_accuracy"
    targets = [f"{stem}.{ending}" for ending in (*FORMATS, "json")]
    for target in targets:
        check_output(target, options.overwrite)
    choose_threads(options.threads)
    if not config.outputs.section:
        raise ConfigurationError(
            f"{config.source}: outputs.section: a section is needed to measure errors on; keep a "
            'state, such as "delta_5"'
        )
    for steps in options.steps:
        # Each is refused as a sweep would refuse it.
        stable = config.replace("integration.unstable", "refuse")
        Simulation(stable.replace("integration.steps_per_period", steps))
    settings = measure(Simulation(config), options.steps, options.lanes, options.quiet)
    print("\n".join(table(settings)))
    if not any(setting.error > 0.0 for setting in settings):
        raise ConfigurationError(
            f"{config.source}: none of the lanes that were tried moves periodically, so that no "
            "error can be measured; try more with --lanes, or others with --set"
        )
    for error in WANTED:
        print(recommendation(settings, error))
    page = work_precision_page(
        {
            mode: [(s.seconds, s.error, s.steps) for s in settings if s.mode == mode]
            for mode in MODES
        }
    )
    for ending in FORMATS:
        save_figure(page, f"{stem}.{ending}", title=config.title, overwrite=options.overwrite)
    facts = {
        "title": config.title,
        "truth": f"{TRUTH_STEPS} resolved steps per mesh period",
        "settings": [setting._asdict() for setting in settings],
        "machine": provenance(current_threads(), sum(setting.seconds for setting in settings)),
    }
    with replacing(targets[-1], overwrite=options.overwrite) as partial_file:
        partial_file.write_text(json.dumps(facts, indent=1), encoding="utf-8")
    if not options.quiet:
        print(f"{NAME}: written: {', '.join(targets)}", file=sys.stderr)
    return OK


def measure(
    simulation: Simulation, steps: Sequence[int], lanes: int, quiet: bool = True
) -> list[Setting]:
    """Measure error and time of every number of steps, plain and resolved.

    Parameters
    ----------
    simulation : Simulation
    steps : sequence of int
        Steps per mesh period.
    lanes : int
        Lanes to try, spread evenly over the sweep.
    quiet : bool
        Whether nothing is said on stderr while it takes its time.
    """
    import numpy as np

    from gearchaos.engine.running import COMPILING
    from gearchaos.progress import notice
    from gearchaos.records.difference import bound, difference

    with notice(COMPILING, quiet):
        _, motion = simulation.pilot(lanes, TRUTH_STEPS)
        for mode in MODES:
            motion(steps[0], mode == "resolved")
    with notice(f"{NAME}: computing the truth with {TRUTH_STEPS} steps per period", quiet):
        truth = motion(TRUTH_STEPS, True)
    settings = []
    for mode in MODES:
        for count in steps:
            seconds = []
            for _ in range(ROUNDS):
                began = time.perf_counter()
                found = motion(count, mode == "resolved")
                seconds.append(time.perf_counter() - began)
            apart = difference(found, truth)
            settings.append(
                Setting(
                    count,
                    mode,
                    bound(apart.section_error),
                    bound(apart.exponent_error[apart.period > 0]),
                    float(np.mean(apart.changed)),
                    statistics.median(seconds),
                )
            )
    return settings


def table(settings: Sequence[Setting]) -> list[str]:
    """Word the measurement as lines of a table."""
    cheapest = min(setting.seconds for setting in settings)
    head = "steps  mode      section error  exponent error  changed  seconds   cost"
    return [
        head,
        *(
            f"{s.steps:5d}  {s.mode:8}  {s.section_error:13.1e}  {s.exponent_error:14.1e}"
            f"  {s.changed_share:6.1%}  {s.seconds:7.3f}  {s.seconds / cheapest:5.1f}"
            for s in settings
        ),
    ]


def recommendation(settings: Sequence[Setting], error: float) -> str:
    """Name the cheapest setting that reaches an error."""
    enough = [setting for setting in settings if setting.error <= error]
    if not enough:
        return f"For an error of {error:.0e}: none of these; give finer --steps."
    best = min(enough, key=lambda setting: setting.seconds)
    return f"For an error of {error:.0e}: {best.steps} {best.mode} steps per mesh period."


if __name__ == "__main__":
    sys.exit(main())
