"""The compiled lane loop uses wide registers and has no arithmetic of effects left out."""

import functools
import platform
import re
from collections import Counter
from typing import NamedTuple

import llvmlite.binding
import numpy as np
import pytest
from gearchaos_kernels import Effects, Plan, batch, integrate
from gearchaos_kernels.cache import KernelCache
from gearchaos_kernels.compilation import CACHE_FOLDER, dispatcher_of
from gearchaos_kernels.compiler import PARTS
from gearchaos_kernels.scene import SceneType

from .reference import FULL, NO_BACKLASH, TORSION, pan2021, system_of

pytestmark = pytest.mark.skipif(
    platform.machine().lower() not in ("x86_64", "amd64")
    or not llvmlite.binding.get_host_cpu_features().get("avx2", False),
    reason="reads the assembly of x86 processors with AVX2",
)

ARITHMETIC = re.compile(r"v(add|sub|mul|fn?m(add|sub)\d+)pd$")
SCALAR = re.compile(r"v(add|sub|mul|fn?m(add|sub)\d+)sd$")
LABEL = re.compile(r"^\.LBB\w+:", re.MULTILINE)
INSTRUCTION = re.compile(r"^\s+(v\w+)\s+(.*)$", re.MULTILINE)
STORE = re.compile(r"%[yz]mm\d+, -?\d*\((?!%r[sb]p\))%r\w+")
"""Store of a wide register to memory, but not to the stack, where spilled registers are stored. A
short loop that is completely unrolled has no index."""

WIDE = ("ymm", "zmm")


class Anew(KernelCache):
    """Cache that stores loops but never loads them, because loaded code has no assembly."""

    def load_overload(self, _sig, target_context):
        target_context.refresh()


loop = dispatcher_of(batch._integrate_blocks.__wrapped__.py_func)
loop._cache = Anew(loop.py_func, CACHE_FOLDER)


def arguments(scene: Effects, tangent: bool, resolved: bool) -> tuple:
    """Return the arguments that `integrate` passes to the driver for a single lane."""
    given: list[tuple] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(batch, "_integrate_blocks", lambda *passed: given.append(passed))
        plan = Plan(4, 0, 1, 1, tangent, resolved)
        integrate(system_of(pan2021(1.0), scene), np.zeros((1, len(scene.states))), plan)
    return given[0]


class Loop(NamedTuple):
    """Instruction counts of the compiled loop over the slots of one scene."""

    counts: Counter[tuple[str, str]]
    """Vector instructions by mnemonic and register width."""
    copies: float
    """Number of copies of the loop body, each for one vector of lanes.

    The compiler may unroll or interleave a loop, so counts have to be divided by this number before
    they are compared.
    """
    scalars: int
    """Scalar sums and products in the code that writes the rows, which is the loop itself."""

    def wide(self, mnemonic: str) -> int:
        """Return the number of wide instructions whose name begins with ``mnemonic``."""
        return sum(
            number
            for (found, width), number in self.counts.items()
            if width in WIDE and found.startswith(mnemonic)
        )

    def arithmetic(self, *widths: str) -> int:
        """Return the number of sums and products of wide registers."""
        return sum(
            number
            for (found, width), number in self.counts.items()
            if width in (widths or WIDE) and ARITHMETIC.match(found)
        )

    def per_vector(self) -> float:
        """Return the sums and products for one step of one vector of lanes."""
        return self.arithmetic() / self.copies


def stores_of(instructions: list[tuple[str, str]]) -> int:
    """Return the number of stores of wide registers to memory."""
    return sum(name.startswith("vmov") and bool(STORE.match(to)) for name, to in instructions)


def rows_written(scene: Effects, tangent: bool, resolved: bool) -> int:
    """Return the number of rows of block memory that one step writes."""
    written = len(scene.states) * (2 if tangent else 1)
    # Resolved steps also store the previous values, and mark lanes that may have crossed.
    return 2 * written + 1 if resolved else written


@functools.cache
def loop_of(scene: Effects, tangent: bool, resolved: bool, /) -> Loop:
    """Compile a scene once, and count its instructions."""
    given = arguments(scene, tangent, resolved)
    loop(*given)
    assembly = loop.inspect_asm(loop.signatures[-1])
    rows = rows_written(scene, tangent, resolved)
    blocks = map(INSTRUCTION.findall, LABEL.split(assembly))
    # The code that begins and ends a block also has wide stores, but fewer, or no arithmetic.
    body = [
        one
        for block in blocks
        if stores_of(block) >= rows and any(ARITHMETIC.match(name) for name, _ in block)
        for one in block
    ]
    scalars = sum(bool(SCALAR.match(name)) for name, _ in body)
    counts: Counter[tuple[str, str]] = Counter()
    for mnemonic, operands in body:
        width = next((name for name in ("zmm", "ymm", "xmm") if name in operands), "")
        counts[mnemonic, width] += 1
    return Loop(counts, stores_of(body) / rows, scalars)


LOOPS = pytest.mark.parametrize(
    ("tangent", "resolved"),
    [(True, False), (True, True), (False, True)],
    ids=["tangent-whole", "tangent-split", "plain-split"],
)


@LOOPS
def test_a_step_is_done_on_many_lanes_at_once(tangent, resolved):
    found = loop_of(FULL, tangent, resolved)
    # Every row is written from wide registers, once in each copy of the loop.
    assert found.copies == int(found.copies) >= 1
    # 10 states need about 190 operations per step, and 350 with a tangent vector. Fused operations
    # reduce these numbers.
    assert found.per_vector() > (300 if tangent else 150)
    assert found.wide("vfmadd") / found.copies > 20
    assert found.wide("vmul") / found.copies > 20


@LOOPS
def test_scalar_arithmetic_is_left_only_outside_the_lane_loop(tangent, resolved):
    found = loop_of(FULL, tangent, resolved)
    assert found.scalars < 0.05 * found.per_vector()


def test_the_widest_registers_of_the_processor_are_used():
    if not llvmlite.binding.get_host_cpu_features().get("avx512f", False):
        pytest.skip("needs AVX-512")
    found = loop_of(FULL, True, False)
    assert found.arithmetic("zmm") > 10 * found.arithmetic("ymm")


def test_the_clearance_costs_one_minimum_and_one_maximum_for_each_stage_and_direction():
    found = loop_of(FULL, True, False)
    assert found.wide("vmin") == found.wide("vmax") == 4 * 2 * found.copies


@pytest.mark.parametrize("tangent", [False, True], ids=["plain", "tangent"])
def test_on_a_branch_the_stages_need_no_minimum_or_maximum(tangent):
    found = loop_of(FULL, tangent, True)
    # The test for a crossing has two per direction: the largest and smallest of three points.
    assert found.wide("vmax") <= 4 * found.copies
    assert found.wide("vmin") <= 4 * found.copies


def test_a_scene_without_backlash_has_no_minimum_or_maximum():
    without = loop_of(NO_BACKLASH, True, False)
    assert without.wide("vmax") == without.wide("vmin") == 0
    assert without.per_vector() < loop_of(FULL, True, False).per_vector()


def test_a_torsional_scene_has_none_of_the_arithmetic_of_the_bearings():
    # It has a fifth of the states, and no dampers and springs of the other states.
    torsion = loop_of(TORSION._replace(pitch_error=True), True, False)
    assert torsion.per_vector() < 0.2 * loop_of(FULL, True, False).per_vector()


def test_a_run_without_exponent_has_none_of_the_arithmetic_of_the_tangent_vector():
    plain, tangent = loop_of(FULL, False, True), loop_of(FULL, True, True)
    assert plain.per_vector() < 0.65 * tangent.per_vector()


def test_code_that_was_linked_into_a_loop_is_not_kept():
    loop_of(FULL, True, True)
    kinds = [kind for one in PARTS for signature in one.overloads for kind in signature]
    # Functions without a scene are kept, because they serve other loops.
    assert kinds and not any(isinstance(kind, SceneType) for kind in kinds)
