"""Is there any input, however bad, that ends in a traceback, a hang or a lost file?

    python benchmarks/fuzz.py [--cases 12000] [--output fuzz.json]

Configuration files are given to `load_config` and some of them to `sweep --dry-run`, result files
to `plot`, `info`, `info --verify` and `stages`, forgeries to all of them. Each case runs with 5 s
of the processor and 500 MB in a process that is watched. A case is right if the command succeeds,
or says in one line what is wrong and exits with 2 or 4, and leaves its input as it was.
"""

import argparse
import json
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

from machine import machine_facts, print_machine

sys.path.insert(0, str(Path(__file__).parent.parent))

from tests.gearchaos.fuzz_cases import (
    Case,
    Watch,
    configuration_cases,
    forged_cases,
    result_cases,
)


def main() -> int:
    """Run the cases, print the counts by kind, write JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=12_000)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--output", type=Path, default=Path("fuzz.json"))
    options = parser.parse_args()
    print_machine()
    began = time.monotonic()
    endings: dict[str, Counter[str]] = defaultdict(Counter)
    failures = []
    slowest = 0.0
    with tempfile.TemporaryDirectory() as folder, Watch(Path(folder)) as watch:
        for case, ending in watch.run(_cases(options.first, options.cases, Path(folder))):
            outcome = "failed" if ending.fault else f"exit code {ending.code}"
            endings[f"{case.command}: {case.kind}"][outcome] += 1
            slowest = max(slowest, ending.seconds)
            if ending.fault:
                failures.append({**case._asdict(), "path": str(case.path), "fault": ending.fault})
                print(f"{case.command} {case.number} ({case.kind}): {ending.fault}", flush=True)
    seconds = time.monotonic() - began
    _print(endings, slowest, seconds)
    facts = {
        "machine": machine_facts(),
        "cases": sum(counts.total() for counts in endings.values()),
        "seconds": seconds,
        "slowest_case_seconds": slowest,
        "endings": endings,
        "failures": failures,
    }
    options.output.write_text(json.dumps(facts, indent=1))
    return 1 if failures else 0


def _cases(first: int, number: int, folder: Path) -> Iterator[Case]:
    yield from configuration_cases(range(first, first + number // 2), folder, dry_run_every=25)
    yield from result_cases(range(first, first + number - number // 2), folder)
    yield from forged_cases(folder)


def _print(endings: dict[str, Counter[str]], slowest: float, seconds: float) -> None:
    outcomes = ("exit code 0", "exit code 2", "exit code 4", "failed")
    print(f"{'command and what was done to its input':50}" + "".join(f"{o:>13}" for o in outcomes))
    total: Counter[str] = Counter()
    for kind, counts in sorted(endings.items()):
        print(f"{kind:50}" + "".join(f"{counts[outcome]:13d}" for outcome in outcomes))
        total += counts
    print(f"{'all ' + str(total.total()):50}" + "".join(f"{total[o]:13d}" for o in outcomes))
    print(f"{seconds:.0f} s, the slowest case {slowest:.1f} s")


if __name__ == "__main__":
    sys.exit(main())
