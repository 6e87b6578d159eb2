"""How fast are whole branches of periodic orbits followed?

    python benchmarks/branches.py [--rounds 3] [--other FOLDER]

The sweeps are computed, then their branches are followed up to a longest period. The times are
processor times of `find_branches` in seconds, warm, medians over rounds. With --other, the folder
of another version, both follow the branches of the same results in turn, in processes of their own;
the last column is the median of the ratios of the other version to this one.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from machine import print_machine

import gearchaos

HERE = Path(__file__).parents[1]
ROWS = (
    ("spur_pair", "rk4", 1),
    ("two_masses", "rk4", 1),
    ("two_masses", "taylor", 1),
    ("two_masses", "taylor", 8),
    ("pan2021", "flow_map", 8),
)
"""Configuration, method and longest period of each row."""

MEASURE = """
import sys, time
import gearchaos
from gearchaos.engine.branching import find_branches
result, longest = gearchaos.open_result(sys.argv[1]), int(sys.argv[2])
find_branches(result, longest=longest)
begin = time.process_time()
found = find_branches(result, longest=longest).branches
print(time.process_time() - begin, len(found), sum(one.value.size for one in found))
"""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--other", type=Path, help="folder of another version")
    arguments = parser.parse_args()
    print_machine()
    versions = [HERE, *([arguments.other.resolve()] if arguments.other else [])]
    print("sweep        method    period  branches  orbits  seconds  orbits/s  other/this")
    with tempfile.TemporaryDirectory() as folder:
        for name, method, longest in ROWS:
            path = Path(folder, f"{name}.h5")
            config = gearchaos.load_config(HERE / "sweeps" / f"{name}.toml")
            gearchaos.run(config.replace("integration.method", method)).save(path)
            rounds = [
                [_measured(version, path, longest, folder) for version in versions]
                for _ in range(arguments.rounds)
            ]
            seconds = statistics.median(one[0][0] for one in rounds)
            _, branches, orbits = rounds[0][0]
            ratio = statistics.median(one[-1][0] / one[0][0] for one in rounds)
            print(
                f"{name:12} {method:8}  {longest:6}  {branches:8.0f}  {orbits:6.0f}  "
                f"{seconds:7.2f}  {orbits / seconds:8.0f}  {ratio:10.2f}",
                flush=True,
            )
            path.unlink()


def _measured(version: Path, path: Path, longest: int, folder: str) -> tuple[float, ...]:
    """Return seconds, branches and orbits of one version; NaN if it does not know the method.

    ``folder``: one without a version of the package, which Python would import first.
    """
    sources = os.pathsep.join([str(version), str(version / "kernels")])
    done = subprocess.run(
        [sys.executable, "-c", MEASURE, str(path), str(longest)],
        env={**os.environ, "PYTHONPATH": sources},
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
    )
    return tuple(map(float, done.stdout.split())) or (float("nan"),) * 3


if __name__ == "__main__":
    main()
