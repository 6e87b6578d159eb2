"""Fit parameters of a pair to what was observed of its bifurcation diagram.

A targets file names stages, jumps, crises, exponents and increments that were observed, and the
parameters that are free within bounds. The best sets that differ go to stdout, with how far each
parameter can move before the fit is worse by one unit; every candidate that was tried goes to a
file. Interrupted or terminated, candidates are kept and --resume goes on from them.
"""

import os
import time
from argparse import ArgumentParser, Namespace
from typing import TYPE_CHECKING

from gearchaos.command_line import COMMON_OPTIONS, OK, Command
from gearchaos.finishing import output_of
from gearchaos.progress import Progress, say

if TYPE_CHECKING:
    from gearchaos.identification.tried import Tried


def _arguments(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("config", metavar="TARGETS.toml", help="what was observed, and what is free")
    add("--resume", action="store_true", help="go on with a search that was stopped")
    replaced = "replace one key of the targets file, such as search.seed=2"
    add("--set", **{**COMMON_OPTIONS["set"], "help": replaced})


def _identify(options: Namespace) -> int:
    from gearchaos.engine.provenance import provenance
    from gearchaos.engine.running import choose_threads
    from gearchaos.identification.evaluation import require_stable
    from gearchaos.identification.loading import load_targets
    from gearchaos.identification.report import report
    from gearchaos.identification.search import MOST_CENTRES, RUNGS, Judge, decisive_facts, search
    from gearchaos.identification.tried import read_tried, write_tried
    from gearchaos.results.atomic_file import check_output
    from gearchaos.results.block_folder import require_same
    from gearchaos.results.tables import needed

    problem = load_targets(options.config, options.set)
    choose_threads(options.threads)
    judge = Judge(problem)
    needed("cma", "identify")
    require_stable(problem.config, judge.values, problem.targets.corners())
    output, keys = output_of(options, ".csv"), [one.name for one in problem.targets.parameter]
    known, kept, facts = None, False, decisive_facts(problem)
    if options.resume and not options.overwrite and os.path.exists(output):
        (known, earlier), kept = read_tried(output, keys), True
        require_same(f"{output}: is the result", earlier, facts, "replace it with --overwrite")
        if earlier.get("complete"):
            say(f"complete already: {output}, {len(known)} candidates")
            print("\n".join(report(judge, known)), flush=True)
            return OK
    else:
        check_output(output, options.overwrite)
    began, texts = time.monotonic(), {"title": problem.targets.title, "targets": problem.text}

    def keep(tried: "Tried", complete: bool = False) -> None:
        nonlocal kept
        computed = provenance(time.monotonic() - began)
        told = {"complete": int(complete), **computed, **facts, **texts}
        write_tried(output, tried, keys, judge.observations, told)
        kept = True

    most = problem.targets.search.candidates + MOST_CENTRES * (1 + 2 * RUNGS * len(keys))
    try:
        with Progress(most, 0 if known is None else len(known), unit="candidate") as bar:
            tried = search(judge, known, keep, bar.advance, output)
    except KeyboardInterrupt as interrupt:
        if kept:
            interrupt.add_note(f"the candidates in {output} are kept; go on with --resume")
        raise
    keep(tried, complete=True)
    say(f"{output}: {len(tried)} candidates, {time.monotonic() - began:.1f} s")
    print("\n".join(report(judge, tried)), flush=True)
    return OK


main = Command("identify", __doc__, _arguments, _identify, ("output", "overwrite", "threads"))
main.start(__name__)
