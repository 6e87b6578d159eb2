"""Fit parameters of a pair to its observed bifurcation diagram.

A targets file lists the observed stages, jumps, crises, exponents and increments, and the free
parameters with their bounds. The report goes to stdout: the best sets that differ from each other,
and how far each parameter can move before the misfit grows by one unit.

All candidates that the search has tried are written to a CSV file. If the search is interrupted or
terminated, its candidates are kept, and --resume continues from them.
"""

import os
import time
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from gearchaos.command_line import Command
from gearchaos.finishing import output_of
from gearchaos.options import Option, OutputFile, Overwrite, Threads
from gearchaos.progress import count_of, progress, say

if TYPE_CHECKING:
    from gearchaos.identification.loading import Problem
    from gearchaos.identification.tried import Tried

SECONDS_BETWEEN_SNAPSHOTS = 20.0


class IdentifyOptions(NamedTuple):
    """Options of ``gearchaos identify``."""

    config: Annotated[
        str,
        Option(
            "file with the observed targets and the free parameters",
            "TARGETS.toml",
            positional=True,
            file=True,
        ),
    ]
    resume: Annotated[bool, Option("continue a search that was stopped")] = False
    settings: Annotated[
        tuple[str, ...],
        Option(
            "replace one key of the targets file, such as search.seed=2; may be repeated",
            "KEY=VALUE",
            ("--set",),
        ),
    ] = ()
    output: OutputFile = None
    overwrite: Overwrite = False
    threads: Threads = None


def _identify(options: IdentifyOptions) -> None:
    import numpy as np

    from gearchaos.engine.running import choose_threads
    from gearchaos.identification.evaluation import require_stable
    from gearchaos.identification.loading import load_targets
    from gearchaos.identification.report import report
    from gearchaos.identification.search import decisive_facts
    from gearchaos.identification.tried import fields_of, read_tried
    from gearchaos.results.files.atomic_file import check_output
    from gearchaos.results.files.block_folder import require_same
    from gearchaos.results.reading.tables import needed

    problem = load_targets(options.config, options.settings)
    choose_threads(options.threads)
    needed("cma", "identify")
    require_stable(problem.config, problem.values, problem.targets.corners())
    output = output_of(options.output, options.config, ".csv")
    facts = decisive_facts(problem)
    known = np.empty(0, fields_of(problem))
    if options.resume and not options.overwrite and os.path.exists(output):
        known, earlier = read_tried(output, problem)
        require_same(f"{output}: is the result", earlier, facts, "replace it with --overwrite")
    else:
        check_output(output, options.overwrite)
    began = time.monotonic()
    tried = _search(problem, known, output, facts)
    say(f"{output}: {count_of(len(tried), 'candidate')}, {time.monotonic() - began:.1f} s")
    print("\n".join(report(problem, tried)), flush=True)


def _search(problem: "Problem", known: "Tried", output: str, facts: dict[str, Any]) -> "Tried":
    """Run the search, write its candidates from time to time, and return all of them.

    ``known`` are the candidates of an earlier run, which the search yields first.
    """
    import numpy as np

    from gearchaos.engine.provenance import provenance
    from gearchaos.identification.search import search
    from gearchaos.identification.tried import write_tried

    began = written = time.monotonic()
    tried = known[:0]

    def keep() -> None:
        write_tried(output, tried, problem, {**provenance(time.monotonic() - began), **facts})

    try:
        with progress(problem.targets.search.candidates, len(known), "candidates") as bar:
            for found in search(problem, known, output):
                tried = np.concatenate([tried, found])
                if len(tried) > len(known):
                    bar.update(len(found))
                    if time.monotonic() - written > SECONDS_BETWEEN_SNAPSHOTS:
                        keep()
                        written = time.monotonic()
    except KeyboardInterrupt as interrupt:
        if len(tried) > len(known):
            keep()
        if len(tried) + len(known) > 0:
            interrupt.add_note(f"the candidates in {output} are kept; continue with --resume")
        raise
    if len(tried) > len(known):
        keep()
    return tried


main = Command("identify", __doc__, IdentifyOptions, _identify).start(__name__)
