"""Facts about the machine that a measurement is quoted with."""

import os
import platform
from pathlib import Path

import llvmlite.binding
import numba


def machine_facts() -> dict[str, str | int]:
    """Return processor, cores, system and versions."""
    name = str(llvmlite.binding.get_host_cpu_name())
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text().splitlines():
            if line.startswith("model name"):
                name = f"{line.partition(':')[2].strip()} ({name})"
                break
    return {
        "processor": name,
        "cores": os.cpu_count() or 1,
        "threads": numba.config.NUMBA_NUM_THREADS,
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "numba": numba.__version__,
    }


def print_machine() -> None:
    """Print the facts as one line."""
    print(", ".join(f"{key} {value}" for key, value in machine_facts().items()))
