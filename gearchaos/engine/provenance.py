"""The provenance of a result: versions, processor, threads, time, commit."""

import platform
import subprocess
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import llvmlite.binding
import numba
from gearchaos_kernels import source_hash

from gearchaos.version import Software, software_version

SOFTWARE = Software(f"gearchaos {software_version()}", source_hash())
"""Software of this process, read at import because sources may be edited afterwards."""


def provenance(seconds: float) -> dict[str, str | int | float]:
    """Return the provenance of a result that took a number of seconds, as metadata."""
    facts: dict[str, str | int | float] = {
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        **SOFTWARE._asdict(),
        "python_version": platform.python_version(),
        **{f"{name}_version": version(name) for name in ("numpy", "numba", "h5py")},
        "system": f"{platform.system()} {platform.machine()}",
        "processor": str(llvmlite.binding.get_host_cpu_name()),
        "threads": int(numba.get_num_threads()),
        "wall_time_seconds": round(seconds, 3),
    }
    commit = commit_of(Path(__file__).parents[2])
    return {**facts, "git_commit": commit} if commit else facts


def commit_of(clone: Path) -> str:
    """Return the commit of a clone, with "-dirty" after changes; empty if it is not a clone."""
    if not (clone / ".git").exists():
        return ""
    command = ["git", "-C", str(clone), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        found = subprocess.run(command, capture_output=True, text=True, timeout=5, check=True)
    except (OSError, subprocess.SubprocessError):
        return ""
    return found.stdout.strip()
