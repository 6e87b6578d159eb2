"""Use every extra once on small scenes, to check that the installed packages work together.

Run ``python .ci/smoke.py`` in an environment where gearchaos is installed with all its extras. The
script prints the versions, then every command with its run time and its output on stderr. It exits
with code 1 at the first command that fails. Warnings of packages do not count as failures. They are
printed because they announce changes of future versions.
"""

import subprocess
import sys
import time
import tomllib
from importlib.metadata import version
from pathlib import Path
from re import match
from tempfile import TemporaryDirectory

import panel  # noqa: F401  Registers the models of the page.
from bokeh.client import pull_session
from bokeh.models import DataRenderer
from bokeh.plotting import figure

CLONE = Path(__file__).resolve().parent.parent
SMALL = ("sweep.count=12", "integration.transient_periods=60", "integration.recorded_periods=40")
SMALL += ("outputs.section_points=20",)
JOB = ["sweep", str(CLONE / "sweeps" / "pan2021.toml"), "--quiet"]
JOB += [word for key in SMALL for word in ("--set", key)]
MACHINE = ["sweep", str(CLONE / "sweeps" / "two_masses.toml"), "--quiet", "--output", "two.h5"]
MACHINE += [word for key in SMALL for word in ("--set", key)]
COMMANDS = (
    [*JOB, "--output", "main.h5"],
    [*JOB, "--set", "integration.method=flow_map", "--output", "map.h5"],
    [*JOB, "--dask", "local:1", "--output", "dask.h5"],
    MACHINE,
    ["info", "main.h5", "--verify"],
    ["plot", "main.h5", "--stages", "--output", "main.png"],
    ["plot", "map.h5", "--output", "map.pdf"],
    ["stages", "main.h5", "--refine", "0.1"],
    # This command reads the configuration that the sweep has stored.
    ["response", "main.h5", "--at", "11.0", "--periods", "20", "--output", "response.h5"],
    ["plot", "response.h5", "--output", "response.svg"],
    *(["export", "main.h5", f"main.{ending}"] for ending in ("csv", "parquet", "mat")),
    ["completion", "bash"],
)


def main() -> None:
    """Print the versions, run all commands, and open the page."""
    declared = tomllib.loads((CLONE / "pyproject.toml").read_text("utf-8"))["project"]
    extras = declared["optional-dependencies"]
    used = [one for name in extras if name != "docs" for one in extras[name]]
    given = [*declared["dependencies"], *used]
    names = dict.fromkeys(match(r"[\w.-]+", one)[0] for one in given)
    found = ", ".join(f"{name} {version(name)}" for name in names if name != "gearchaos")
    print(f"Python {sys.version.split()[0]}, {found}", flush=True)
    with TemporaryDirectory() as folder:
        for words in COMMANDS:
            run(words, folder)
        explore("main.h5", folder)


def command(words: list[str]) -> list[str]:
    """Return the command line that starts a command of gearchaos."""
    return [sys.executable, "-m", f"gearchaos.{words[0]}", *words[1:]]


def run(words: list[str], folder: str) -> None:
    """Run a command in a folder, and print its run time and its output on stderr."""
    began = time.monotonic()
    done = subprocess.run(
        command(words), cwd=folder, stdout=subprocess.DEVNULL, stderr=-1, text=True
    )
    hidden = {"--set", *JOB[1:], *SMALL}
    shown = " ".join(word for word in words if word not in hidden)
    print(f"{time.monotonic() - began:6.1f} s  {shown}", flush=True)
    for line in done.stderr.splitlines():
        print(f"          {line}", flush=True)
    if done.returncode:
        sys.exit(1)


def explore(result: str, folder: str) -> None:
    """Open the page of a result as a browser does, and check that it has charts and no error."""
    words, began = ["explore", result, "--no-browser", "--port", "0"], time.monotonic()
    with subprocess.Popen(command(words), cwd=folder, stdout=subprocess.PIPE, text=True) as server:
        try:
            address = server.stdout.readline().strip()
            session = pull_session(url=address)
            models = list(session.document.models)
            session.close()
        finally:
            server.terminate()
    faults = [one.text for one in models if "color:#D55E00" in str(getattr(one, "text", ""))]
    drawn = [
        one for one in models if isinstance(one, figure) and one.select({"type": DataRenderer})
    ]
    print(f"{time.monotonic() - began:6.1f} s  explore: {len(drawn)} charts", flush=True)
    if faults or len(drawn) != 6:
        print(*faults, sep="\n")
        sys.exit(1)


if __name__ == "__main__":
    main()
