"""Sets of branches whose maps are made on demand: look them up, and report those without.

A set is numbered by the elements that are not engaged: element j adds 2**j. Both flanks of an
element share their maps. A block knows for some sets where their maps begin. When a lane enters any
other set, the lane reports it and the block stops. The maps are then made, and the block continues
from the beginning of the mesh period, so that results are the same whichever maps had been there.
"""

from gearchaos_kernels.compilation import scalar
from gearchaos_kernels.memory.block_memory import read_branches
from gearchaos_kernels.memory.rows import STRIDE
from gearchaos_kernels.methods.flow_map.layout import layout, method_rows

KNOWN = -1
"""Number in place of a set if a lane lacks none."""


@scalar
def number_of(branches, scene):
    """Return the number of a set of branches."""
    number = 0
    for element in range(layout(scene).elements):
        number += 0 if branches[element].engaged != 0.0 else 1 << element
    return number


@scalar
def find_maps(memory, slot, given, scene):
    """Store where the maps of a lane begin; return its set if that has none, otherwise `KNOWN`."""
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
def enter(memory, slot, given, scene):
    """Find the maps of the branches of a lane; report their set if there are none."""
    number = find_maps(memory, slot, given, scene)
    if number != KNOWN:
        memory[method_rows(scene).maps * STRIDE + slot] = 0.0
        report(slot, number, given)
