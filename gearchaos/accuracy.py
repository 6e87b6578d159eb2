"""Measure the error and the time of step sizes on some lanes of a sweep.

The command compares RK4 with plain steps, RK4 with resolved steps, and flow maps, which need few
steps. The reference solution is computed with fine flow maps. The printed error is the one that
95 % of the periodic lanes do not exceed.

The table goes to stdout, everything else to stderr. A figure (PNG and PDF) is written under the
name given by --output.
"""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

from gearchaos.command_line import Command
from gearchaos.errors import ConfigurationError
from gearchaos.interrupts import check
from gearchaos.options import ConfigFile, Option, Overwrite, Settings, Threads
from gearchaos.progress import notice, say

if TYPE_CHECKING:
    from gearchaos.engine.run_plan import RunPlan
    from gearchaos.engine.steps import Candidate
    from gearchaos.models import Configuration

MODES = {"plain": (False, "rk4"), "resolved": (True, "rk4"), "flow map": (True, "flow_map")}
"""Settings of `Plan` for each mode: ``resolved`` and ``method``."""
FLOW_MAP_STEPS = (6, 12, 24, 48, 96, 192)
TRUTH_STEPS = 384
ROUNDS = 3
WANTED = (1e-4, 1e-6, 1e-8)


class AccuracyOptions(NamedTuple):
    """Options of ``gearchaos accuracy``."""

    config: ConfigFile
    steps: Annotated[
        tuple[int, ...],
        Option(
            "steps per mesh period (default: %(default)s)",
            "N,N,...",
            low=1,
            high=1600,
            joined=True,
        ),
    ] = (50, 100, 200, 400, 800)
    lanes: Annotated[int, Option("number of lanes (default: %(default)s)", "N", low=1)] = 64
    output: Annotated[
        str | None,
        Option(
            "name of the figure, without its ending (default: that of the configuration, with "
            "_accuracy)",
            "NAME",
            ("-o", "--output"),
        ),
    ] = None
    overwrite: Overwrite = False
    threads: Threads = None
    settings: Settings = ()


def _accuracy(options: AccuracyOptions) -> None:
    from gearchaos.engine.run_plan import plan_run
    from gearchaos.engine.running import choose_threads
    from gearchaos.figures.page import FORMATS, check_figures, save_figure
    from gearchaos.figures.work_precision import work_precision_page
    from gearchaos.models import load_config

    config = load_config(options.config, options.settings)
    stem = options.output or f"{Path(options.config).stem}_accuracy"
    targets = [f"{stem}.{ending}" for ending in FORMATS]
    check_figures([*map(Path, targets)], [], options.overwrite)
    choose_threads(options.threads)
    config = _measurable(config, options.steps[0])
    settings = measure(plan_run(config), options.steps, options.lanes)
    print("\n".join(table(settings)))
    if not any(setting.error > 0.0 for setting in settings):
        raise ConfigurationError(
            f"{config.source}: no error can be measured, because none of the tried lanes moves "
            "periodically; try more lanes with --lanes, or others with --set"
        )
    print("\n".join(recommendation(settings, error) for error in WANTED))
    points = {m: [(s.steps, s.seconds, s.error) for s in settings if s.mode == m] for m in MODES}
    page = work_precision_page(points)
    for target in targets:
        save_figure(page, target)
    say(f"written: {', '.join(targets)}")


def _measurable(config: "Configuration", fewest: int) -> "Configuration":
    """Return the configuration with RK4.

    Raises ConfigurationError if no error can be measured, or if the fewest steps are unstable.
    """
    import numpy as np

    from gearchaos.engine.lanes import Lanes
    from gearchaos.engine.run_plan import plan_run

    if refusal := Lanes(config).system_of(np.arange(1)).refuses_maps():
        raise ConfigurationError(
            f"{config.source}: the reference solution comes from flow maps, and {refusal}; "
            "measure errors with integration.error_check"
        )
    config = config.replace("integration.method", "rk4")
    # A sweep with an error check raises the same errors for what cannot be measured.
    checks = {"unstable": "refuse", "steps_per_period": fewest, "error_check": 1.0}
    plan_run(config.replace("integration", {**config.tables()["integration"], **checks}))
    return config


def measure(run: "RunPlan", steps: Sequence[int], lanes: int) -> "list[Candidate]":
    """Return error and time of each number of RK4 steps per mesh period, plain and resolved.

    Flow maps are measured with `FLOW_MAP_STEPS`. ``lanes`` is the number of lanes, which are spread
    evenly over the sweep.
    """
    from statistics import median

    from gearchaos.engine.running import compiling
    from gearchaos.engine.steps import candidate, pilot
    from gearchaos.records.difference import difference

    with compiling():
        _, solution = pilot(run.lanes, run.plan, lanes, TRUTH_STEPS)
        for setting in MODES.values():
            solution(steps[0], *setting)
    with notice(f"computing the reference solution with {TRUTH_STEPS} flow maps per period"):
        truth = solution(TRUTH_STEPS, *MODES["flow map"])
    settings = []
    tried = [(mode, count) for mode in ("plain", "resolved") for count in steps]
    for mode, count in tried + [("flow map", count) for count in FLOW_MAP_STEPS]:
        seconds = []
        for _ in range(ROUNDS):
            check()
            began = time.perf_counter()
            found = solution(count, *MODES[mode])
            seconds.append(time.perf_counter() - began)
        apart = difference(found, truth)
        one = candidate(count, apart, apart.period > 0)
        settings.append(one._replace(mode=mode, seconds=median(seconds)))
    return settings


def table(settings: "Sequence[Candidate]") -> list[str]:
    """Return the measurement as lines of a table."""
    cheapest = min(setting.seconds for setting in settings)
    return [
        "steps  mode      section error  exponent error  changed  seconds   cost",
        *(
            f"{s.steps:5d}  {s.mode:8}  {s.section_error:13.1e}  {s.exponent_error:14.1e}"
            f"  {s.changed_share:6.1%}  {s.seconds:7.3f}  {s.seconds / cheapest:5.1f}"
            for s in settings
        ),
    ]


def recommendation(settings: "Sequence[Candidate]", error: float) -> str:
    """Return a sentence with the cheapest setting that reaches an error."""
    enough = [setting for setting in settings if setting.error <= error]
    if not enough:
        return f"For an error of {error:.0e}: none of these; give finer --steps."
    best = min(enough, key=lambda setting: setting.seconds)
    return f"For an error of {error:.0e}: {best.steps} {best.mode} steps per period."


main = Command("accuracy", __doc__, AccuracyOptions, _accuracy).start(__name__)
