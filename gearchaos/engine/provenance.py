"""Where a result comes from: versions, processor, threads, time, commit."""

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
"""That of this process. Not asked for later: somebody may edit a source that was imported."""


def provenance(seconds: float) -> dict[str, str | int | float]:
    """Return what a result file says about the run that made it in so many seconds."""
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
    """Return the commit that a folder is at, with "-dirty" after changes; "" if it is no clone."""
    if not (clone / ".git").exists():
        return ""
    command = ["git", "-C", str(clone), "describe", "--always", "--dirty", "--abbrev=40"]
    try:
        found = subprocess.run(command, capture_output=True, text=True, timeout=5, check=True)
    except (OSError, subprocess.SubprocessError):
        return ""
    return found.stdout.strip()
