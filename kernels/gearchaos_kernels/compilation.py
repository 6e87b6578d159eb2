"""How the kernels are compiled: flags, vector width, stack alignment and what is cached.

Every flag is named here and nowhere else. Three facts about Numba shape this file:

* a cached caller contains the code of its callees, and would keep it when one is edited in another
  file. The cache folder is therefore named after a hash of all kernel sources;
* Numba optimises every function on its own, and again in every function that it is linked into:
  five times for the block of lanes. Here only functions that Python calls are optimised;
* LLVM prefers 256-bit vectors on some AVX-512 processors, and it spills vector registers to an
  unaligned stack. Both cost up to half of the speed of the lane loop.
"""

import hashlib
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
from llvmlite import ir
from numba import config, types
from numba.extending import intrinsic

from gearchaos_kernels.cache import cache_folder, keep_compiled
from gearchaos_kernels.compiler import PartCompiler
from gearchaos_kernels.turns import in_turn

# Numba keeps these to itself; kernels of a version without them compile or run more slowly.
try:
    from gearchaos_kernels.linking import DriverCompiler
except (ImportError, AttributeError):
    DriverCompiler = PartCompiler  # type: ignore[misc]
try:
    from numba.core.cpu import CPUTargetOptions
except ImportError:
    CPUTargetOptions = object
try:
    from numba.core import event
except ImportError:
    event = None

# OpenMP reads this when it is loaded, with the first parallel loop. Waiting threads then sleep
# instead of spinning, which leaves cores to other processes between many short calls.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

FASTMATH = {"contract", "nsz"}
"""Fused multiply-add and unsigned zeros only: NaN and infinity keep their meaning."""

PART = {"pipeline_class": PartCompiler}

CACHE_LINE = 64  # Bytes that one aligned 512-bit vector occupies.


def source_hash() -> str:
    """Return a hash of every source file of this package and of Numba's version."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(str(source.relative_to(Path(__file__).parent)).encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


CACHE_FOLDER = cache_folder(source_hash())
if getattr(config, "CPU_FEATURES", "") is None:
    features = llvmlite.binding.get_host_cpu_features().flatten()
    config.CPU_FEATURES = f"{features},-prefer-256-bit"


def _decorate(function: Callable[..., Any], *, how: dict[str, Any], **optional: bool) -> Any:
    """Compile a function with options of `numba.njit`, and flags where Numba knows them."""
    flags = {flag: on for flag, on in optional.items() if hasattr(CPUTargetOptions, flag)}
    dispatcher = numba.njit(fastmath=FASTMATH, error_model="numpy", **how, **flags)(function)
    # Numba would compile for every constant argument anew; LLVM knows them all the same.
    if template := getattr(dispatcher, "get_call_template", None):
        dispatcher.get_call_template = lambda args, kws: template(
            tuple(map(types.unliteral, args)), kws
        )
    return dispatcher


def scalar(function: Callable[..., Any]) -> Any:
    """Compile a formula of plain numbers that is inlined wherever it is used."""
    flags = {"no_cfunc_wrapper": True, "no_cpython_wrapper": True, "_nrt": False}
    return _decorate(function, how=PART, forceinline=True, **flags)


def part(function: Callable[..., Any]) -> Any:
    """Compile a function that only compiled code calls, and calls rather than copies."""
    return _decorate(function, how=PART, no_cfunc_wrapper=True, no_cpython_wrapper=True)


def dispatcher_of(function: Callable[..., Any], parallel: bool = True) -> Any:
    """Compile a function that only splits, calls and merges, in parallel and cached on disk."""
    how = {"pipeline_class": DriverCompiler, "parallel": parallel, "nogil": True}
    dispatcher = _decorate(function, how=how, no_cfunc_wrapper=True)
    keep_compiled(dispatcher, CACHE_FOLDER)
    return dispatcher


def driver(function: Callable[..., Any]) -> Any:
    """Compile a function as `dispatcher_of` does; threads of Python enter it one at a time."""
    return in_turn(dispatcher_of(function))


def evaluator(function: Callable[..., Any]) -> Any:
    """Compile a function that visits lanes one after the other, cached on disk."""
    return dispatcher_of(function, parallel=False)


@intrinsic
def align_stack(_typing_context: Any) -> Any:
    """Align the caller's stack frame to a cache line, so that spilled vectors do not straddle two.

    LLVM realigns a frame only if it holds an over-aligned variable before registers are allocated:
    this one is it. The empty assembly keeps it from being optimised away.
    """

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        with builder.goto_entry_block():
            slot = builder.alloca(ir.ArrayType(ir.IntType(8), CACHE_LINE))
        slot.align = CACHE_LINE
        takes_pointer = ir.FunctionType(ir.VoidType(), [slot.type])
        builder.asm(takes_pointer, "", "r,~{memory}", [slot], True)
        return context.get_dummy_value()

    return types.void(), generate


def first_element(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    """Return, within an intrinsic, the address of the first element of an array of this type."""
    return context.make_array(kind)(context, builder, array).data


@intrinsic
def count_up(_typing_context: Any, counter: Any) -> Any:
    """Add one to a number that threads share, shape (1,), and return what it was."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address = first_element(context, builder, signature.args[0], arguments[0])
        one = context.get_value_type(signature.args[0].dtype)(1)
        return builder.atomic_rmw("add", address, one, "monotonic")

    return types.intp(counter), generate


@contextmanager
def on_compilation(announce: Callable[[], None]) -> Iterator[None]:
    """Call a function whenever something begins to be compiled, if Numba lets that be known."""
    with ExitStack() as stack:
        if event is not None:

            class Listener(event.Listener):  # type: ignore[misc]
                """Calls the function."""

                def on_start(self, _event: Any) -> None:
                    announce()

                def on_end(self, _event: Any) -> None:
                    pass

            stack.enter_context(event.install_listener("numba:compile", Listener()))
        yield
