"""Compute a sweep of a few lanes by flow maps in threads and other processes.

As a script it prints one JSON object of findings; the arguments name the ways to start processes.
"""

import json
import multiprocessing
import os
import signal
import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import numpy as np
from gearchaos_kernels.turns import in_turn

import gearchaos

TINY = """
title = "a spur pair, a few lanes"
[groups]
mesh_frequency = 0.9
load = 0.1
damping_ratio = 0.05
base_helix_angle_deg = 0.0
half_backlash = 1.0
pitch_error_amplitude = 0.1
stiffness_cosine = [0.1]
[scene]
effects = ["pitch_error", "stiffness_variation", "backlash"]
[start]
kind = "contact"
[sweep]
parameter = "mesh_frequency"
from = 0.50
to = 0.51
count = 8
[integration]
method = "flow_map"
transient_periods = 5
recorded_periods = 5
[outputs]
section_points = 5
motion = false
"""


def configuration(number: int, *overrides: str) -> gearchaos.Configuration:
    """Return the tiny sweep; each number has other speeds, and therefore its own maps."""
    ends = [f"sweep.{end}={0.5 + 0.02 * number + at}" for end, at in (("from", 0.0), ("to", 0.01))]
    return gearchaos.Configuration.from_toml(TINY, "tiny", [*ends, *overrides])


def section(number: int) -> np.ndarray:
    """Compute the tiny sweep and return its section."""
    return gearchaos.run(configuration(number))["section_delta_5"]


def in_a_fork_while_a_thread_computes() -> bool:
    """Return whether a process that is forked during the turn of another thread gets a turn too."""
    begun, ended = Event(), Event()
    with ThreadPoolExecutor(1) as pool:
        holding = pool.submit(in_turn(lambda: (begun.set(), ended.wait())))
        begun.wait()
        child = os.fork()
        if child == 0:
            # This is the main thread: a new thread may have the number of the thread that was not
            # copied.
            signal.alarm(60)
            in_turn(lambda: None)()
            os._exit(0)
        ended.set()
        holding.result()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def in_processes(how: str, serial: list) -> bool | str:
    """Return whether processes started in this way compute the same, or their error."""
    try:
        with multiprocessing.get_context(how).Pool(2) as processes:
            sections = processes.map_async(section, range(2)).get(timeout=120.0)
            processes.close()
            processes.join()
    except gearchaos.GearchaosError as error:
        return str(error)
    return all(map(np.array_equal, sections, serial))


def findings(*ways: str) -> dict:
    """Compute in threads and in processes started in these ways, and compare with serial runs."""
    found: dict = {"forked in a turn": in_a_fork_while_a_thread_computes()}
    serial = [section(number) for number in range(4)]
    with ThreadPoolExecutor(4) as threads:
        found["threads"] = all(map(np.array_equal, threads.map(section, range(4)), serial))
    return found | {how: in_processes(how, serial) for how in ways}


if __name__ == "__main__":
    json.dump(findings(*sys.argv[1:]), sys.stdout)
