"""A sweep takes memory for a block and for the parameters of its lanes."""

import json
import subprocess
import sys

import pytest

from .commands import small_config

# getrusage is not used: its peak includes the peak of the parent process.
PEAK = """
import sys
from pathlib import Path
from gearchaos.sweep import main
code = main(sys.argv[1:])
print(1024 * int(Path("/proc/self/status").read_text().partition("VmHWM:")[2].split()[0]))
sys.exit(code)
"""
CAPTURED = {"capture_output": True, "text": True, "check": True}
# The sweep has 64 section points, but almost nothing to compute.
WIDE = {
    "scene.effects": ["pitch_error"],
    "pitch_error.phase_deg": 0.0,
    "integration.steps_per_period": 10,
    "integration.transient_periods": 0,
    "integration.recorded_periods": 64,
    "outputs.section": ["delta_5"],
    "outputs.section_points": 64,
    "outputs.motion": False,
}


def command(folder, lanes):
    """Write the configuration and return the sweep command."""
    settings = {**WIDE, "sweep.count": lanes}
    flags = [w for k, v in settings.items() for w in ("--set", f"{k}={json.dumps(v)}")]
    config = str(small_config(folder))
    return [sys.executable, "-c", PEAK, config, *flags, "--output", str(folder / "gears.h5")]


def peak(folder, lanes):
    """Run the sweep command and return its peak memory in bytes."""
    done = subprocess.run([*command(folder, lanes), "--quiet", "--overwrite"], **CAPTURED)
    return int(done.stdout.splitlines()[-1])


def estimate(folder, lanes):
    """Return the peak memory that the dry run estimates, in bytes."""
    done = subprocess.run([*command(folder, lanes), "--dry-run", "--json"], **CAPTURED)
    return json.loads(done.stdout[: done.stdout.rindex("}") + 1])["memory_bytes"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="other systems report the peak elsewhere")
def test_more_lanes_take_no_more_memory_than_their_parameters(tmp_path):
    few, many = 20_000, 80_000
    peak(tmp_path, 100)  # From now on, the kernel is in the cache.
    largest = peak(tmp_path, many)
    growth = largest - peak(tmp_path, few)
    results = (many - few) * 64 * 8
    assert growth < results
    told = estimate(tmp_path, many)
    # The estimate is sufficient. With a much larger one, a job would wait for a node that it
    # does not need.
    assert largest < told < 1.5 * largest
    # At this rate, a million lanes need less than 400 MB besides the interpreter and its packages.
    assert growth * 1_000_000 / (many - few) < 400e6
