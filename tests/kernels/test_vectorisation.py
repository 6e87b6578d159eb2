"""What the compiler makes of the lane loop: wide registers, and nothing that the scene lacks."""

import functools
import platform
import re
from collections import Counter

import llvmlite.binding
import numpy as np
import pytest
from gearchaos_kernels import Effects, Plan, batch, integrate
from gearchaos_kernels.block import integrate_block
from gearchaos_kernels.block_memory import Present
from gearchaos_kernels.compilation import block

from .reference import FULL, pan2021, system_of

pytestmark = pytest.mark.skipif(
    platform.machine().lower() not in ("x86_64", "amd64")
    or not llvmlite.binding.get_host_cpu_features().get("avx2", False),
    reason="reads the assembly of x86 processors with AVX2",
)

ARITHMETIC = re.compile(r"v(add|sub|mul|f(n?)m(add|sub)\d+)(pd|sd)$")
WIDE = ("ymm", "zmm")
TORSION = Effects(*[False] * len(Effects._fields))


@block
def loop(batch, plan, outcome, *flags):
    """Stand in for the driver: the flags are packed in compiled code."""
    integrate_block(0, batch, plan, outcome, Present(*flags))


def arguments(scene: Effects, tangent: bool, resolved: bool) -> tuple:
    """Return what the driver gets for a single lane, as `integrate` makes it."""
    given: list[tuple] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(batch, "_integrate_blocks", lambda *passed: given.append(passed))
        plan = Plan(4, 0, 1, 1, tangent, resolved)
        integrate(system_of(pan2021(1.0), scene), np.zeros((1, len(scene.states))), plan)
    return given[0]


def instructions(scene: Effects, tangent: bool, resolved: bool = False) -> Counter[tuple[str, str]]:
    """Count the vector instructions of one compiled scene by mnemonic and register width."""
    return counted(scene, tangent, resolved)


@functools.cache
def counted(scene: Effects, tangent: bool, resolved: bool) -> Counter[tuple[str, str]]:
    """Compile a scene, once, and count."""
    # Called directly: the driver may come from the cache and then compiles nothing.
    given = arguments(scene, tangent, resolved)
    loop(*given)
    assembly = loop.inspect_asm(loop.signatures[-1])
    counts: Counter[tuple[str, str]] = Counter()
    for mnemonic, operands in re.findall(r"^\s+(v\w+)\s+(.*)$", assembly, re.MULTILINE):
        width = next((name for name in ("zmm", "ymm", "xmm") if name in operands), "")
        counts[mnemonic, width] += 1
    return counts


def wide_arithmetic(counts: Counter[tuple[str, str]]) -> int:
    return sum(
        number
        for (mnemonic, width), number in counts.items()
        if width in WIDE and ARITHMETIC.match(mnemonic)
    )


def wide(counts: Counter[tuple[str, str]], mnemonic: str) -> int:
    """Number of instructions of one kind on wide registers, whatever their suffix."""
    return sum(
        number
        for (found, width), number in counts.items()
        if width in WIDE and found.startswith(mnemonic)
    )


@pytest.mark.parametrize("resolved", [False, True], ids=["whole", "split"])
@pytest.mark.parametrize("tangent", [False, True], ids=["plain", "tangent"])
def test_a_step_is_done_on_many_lanes_at_once(tangent, resolved):
    counts = instructions(FULL, tangent, resolved)
    # 10 states need about 190 operations a step, 350 with tangent, after fusion somewhat less.
    assert wide_arithmetic(counts) > (300 if tangent else 150)
    assert wide(counts, "vfmadd") > 20
    assert wide(counts, "vmul") > 20


@pytest.mark.parametrize("tangent", [False, True], ids=["plain", "tangent"])
def test_scalar_arithmetic_is_left_only_outside_the_lane_loop(tangent):
    counts = instructions(FULL, tangent)
    scalar = sum(n for (mnemonic, _), n in counts.items() if re.match(r"v(add|sub)sd", mnemonic))
    fused = sum(n for (mnemonic, _), n in counts.items() if re.match(r"vfn?m\w+sd", mnemonic))
    assert scalar + fused < 20


def test_the_widest_registers_of_the_processor_are_used():
    if not llvmlite.binding.get_host_cpu_features().get("avx512f", False):
        pytest.skip("needs AVX-512")
    counts = instructions(FULL, False)
    by_width = {
        width: sum(n for (name, w), n in counts.items() if w == width and ARITHMETIC.match(name))
        for width in WIDE
    }
    assert by_width["zmm"] > 10 * by_width["ymm"]


def test_the_clearance_costs_one_minimum_and_one_maximum_for_each_stage_and_direction():
    counts = instructions(FULL, False)
    registers_per_lane_group = wide(counts, "vmax") / 8
    assert registers_per_lane_group == int(registers_per_lane_group) >= 1
    assert wide(counts, "vmin") == wide(counts, "vmax")


def test_on_a_branch_the_stages_need_no_minimum_or_maximum():
    counts = instructions(FULL, False, resolved=True)
    # Two for each direction, in the test for a crossing: the largest and smallest of three points.
    assert wide(counts, "vmax") <= 4
    assert wide(counts, "vmin") <= 4


def test_a_scene_without_backlash_has_no_minimum_or_maximum():
    counts = instructions(FULL._replace(backlash=False), False)
    assert wide(counts, "vmax") == wide(counts, "vmin") == 0
    assert wide_arithmetic(counts) < wide_arithmetic(instructions(FULL, False))


def test_a_torsional_scene_has_none_of_the_arithmetic_of_the_bearings():
    # Its loop may be unrolled four times and is still shorter.
    assert wide_arithmetic(instructions(TORSION, False)) < 0.6 * wide_arithmetic(
        instructions(FULL, False)
    )


def test_a_run_without_exponent_has_none_of_the_arithmetic_of_the_tangent_vector():
    plain, tangent = instructions(FULL, False), instructions(FULL, True)
    assert wide_arithmetic(plain) < 0.65 * wide_arithmetic(tangent)
    assert wide(plain, "vcmp") == 0
