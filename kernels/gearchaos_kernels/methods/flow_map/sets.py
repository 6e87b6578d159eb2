"""Sets of branches whose maps are made on demand: look them up, and stop lanes that lack them.

A set is numbered by the elements that are not engaged: element j adds 2**j. Both flanks of an
element share their maps. A block knows for some sets where their maps begin. A lane that enters
any other set stops: its state becomes NaN, and its block reports the set. The caller then makes
the maps and integrates the lane again from its start, so that its result is the same whichever
maps had been made before.
"""

import math

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import read_branches
from gearchaos_kernels.memory.rows import STATE, STRIDE, rows
from gearchaos_kernels.methods.flow_map.layout import layout, method_rows

KNOWN = -1
"""Stands for no set that a lane lacks."""


@scalar
def number_of(branches, scene):
    """Return the number of a set of branches."""
    number = 0
    for element in range(layout(scene).elements):
        number += 0 if branches[element].engaged != 0.0 else 1 << element
    return number


@scalar
def find_maps(memory, slot, given, scene):
    """Store where the maps of a lane's branches begin; return the set if it has none, or `KNOWN`."""
    number = number_of(read_branches(memory, slot, scene), scene)
    for at in range(0, given.sets.shape[0], 2):
        if given.sets[at] == number:
            memory[method_rows(scene).maps * STRIDE + slot] = given.sets[at + 1]
            return KNOWN
    return number


@scalar
def report(slot, number, given):
    """Report the first set that a lane lacks; slots after those of the lanes report nothing."""
    if slot < given.lacked.shape[0]:
        if given.lacked[slot] == KNOWN:
            given.lacked[slot] = number


@scalar
def stop_lane(memory, slot, scene):
    """Turn state and tangent vector of a lane into NaN."""
    for line in range(layout(scene).states):
        memory[(STATE + line) * STRIDE + slot] = math.nan
        memory[(rows(scene).tangent + line) * STRIDE + slot] = math.nan


@scalar
def enter(memory, slot, given, scene):
    """Find the maps of the branches on which a lane begins; stop the lane if there are none."""
    number = find_maps(memory, slot, given, scene)
    if number != KNOWN:
        memory[method_rows(scene).maps * STRIDE + slot] = 0.0
        report(slot, number, given)
        stop_lane(memory, slot, scene)
