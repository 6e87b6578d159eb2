"""Fit parameters of a pair to what was observed of its bifurcation diagram.

A targets file names stages, jumps, crises, exponents and increments that were observed, and the
parameters that are free within bounds. The best sets that differ go to stdout, with how far each
parameter can move before the fit is worse by one unit; every candidate that was tried goes to a
file. Interrupted or terminated, candidates are kept and --resume goes on from them.
"""

import os
import time
from argparse import Namespace

from gearchaos.command_line import Command
from gearchaos.finishing import output_of
from gearchaos.progress import progress, say

SECONDS_BETWEEN_SNAPSHOTS = 20.0


def _identify(options: Namespace) -> None:
    import numpy as np

    from gearchaos.engine.provenance import provenance
    from gearchaos.engine.running import choose_threads
    from gearchaos.identification.evaluation import require_stable
    from gearchaos.identification.loading import load_targets
    from gearchaos.identification.report import report
    from gearchaos.identification.search import decisive_facts, search
    from gearchaos.identification.tried import fields_of, read_tried, write_tried
    from gearchaos.results.files.atomic_file import check_output
    from gearchaos.results.files.block_folder import require_same
    from gearchaos.results.reading.tables import needed

    problem = load_targets(options.config, options.set)
    choose_threads(options.threads)
    needed("cma", "identify")
    targets = problem.targets
    require_stable(problem.config, problem.values, targets.corners())
    output, facts = output_of(options, ".csv"), decisive_facts(problem)
    known = np.empty(0, fields_of(problem))
    if options.resume and not options.overwrite and os.path.exists(output):
        known, earlier = read_tried(output, problem)
        require_same(f"{output}: is the result", earlier, facts, "replace it with --overwrite")
    else:
        check_output(output, options.overwrite)
    began = spoke = time.monotonic()
    tried = known[:0]

    def keep() -> None:
        write_tried(output, tried, problem, {**provenance(time.monotonic() - began), **facts})

    try:
        with progress(targets.search.candidates, len(known), "candidates") as bar:
            for found in search(problem, known, output):
                tried = np.concatenate([tried, found])
                if len(tried) > len(known):
                    bar.update(len(found))
                    if time.monotonic() - spoke > SECONDS_BETWEEN_SNAPSHOTS:
                        keep()
                        spoke = time.monotonic()
    except KeyboardInterrupt as interrupt:
        if len(tried) > len(known):
            keep()
        if len(tried) + len(known) > 0:
            interrupt.add_note(f"the candidates in {output} are kept; go on with --resume")
        raise
    if len(tried) > len(known):
        keep()
    say(f"{output}: {len(tried)} candidates, {time.monotonic() - began:.1f} s")
    print("\n".join(report(problem, tried)), flush=True)


main = Command("identify", __doc__, _identify).start(__name__)
