"""How the kernels are compiled: flags, vector width, stack alignment and caching.

All flags are set here. Three properties of Numba and LLVM shape this file:

* Cached code of a function contains the code of all functions that it calls. Numba does not notice
  an edit in another file. The cache folder is therefore named after a hash of all kernel sources.
* Numba links and optimises every function on its own, and again in every function that it is
  linked into: five times for the block of lanes. Here this is done once, in the functions that
  Python calls.
* LLVM prefers 256-bit vectors on some AVX-512 processors, and it spills vector registers to an
  unaligned stack. Each costs up to half of the speed of the lane loop.
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
from gearchaos_kernels.compiler import PARTS, PartCompiler
from gearchaos_kernels.turns import in_turn

# Private parts of Numba. In a version without them, kernels compile or run more slowly.
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

# OpenMP reads this variable when the first parallel loop loads it. Waiting threads then sleep
# instead of spinning, which leaves the cores to other processes between short calls.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

FASTMATH = {"contract", "nsz"}
"""Fused multiply-add and unsigned zeros only: NaN and infinity keep their meaning."""

PART = {"pipeline_class": PartCompiler}
NO_WRAPPERS = {"no_cfunc_wrapper": True, "no_cpython_wrapper": True}

CACHE_LINE = 64  # Bytes that one aligned 512-bit vector occupies.


def source_hash() -> str:
    """Return a hash of all source files of this package and of Numba's version.

    Returns
    -------
    str
        16 hexadecimal digits. Equal hashes mean equal compiled code on the same processor.

    Examples
    --------
    >>> len(source_hash())
    16
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(str(source.relative_to(Path(__file__).parent)).encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


CACHE_FOLDER = cache_folder(source_hash())
"""Folder of cached compiled code, a `pathlib.Path` whose name is `source_hash`."""

if getattr(config, "CPU_FEATURES", "") is None:
    features = llvmlite.binding.get_host_cpu_features().flatten()
    config.CPU_FEATURES = f"{features},-prefer-256-bit"


def _decorate(function: Callable[..., Any], *, how: dict[str, Any], **optional: bool) -> Any:
    """Compile a function with options of `numba.njit`, and with flags that this version has."""
    flags = {flag: on for flag, on in optional.items() if hasattr(CPUTargetOptions, flag)}
    dispatcher = numba.njit(fastmath=FASTMATH, error_model="numpy", **how, **flags)(function)
    # Otherwise Numba compiles anew for every constant argument; LLVM propagates constants anyway.
    if template := getattr(dispatcher, "get_call_template", None):
        dispatcher.get_call_template = lambda args, kws: template(
            tuple(map(types.unliteral, args)), kws
        )
    if how is PART:
        PARTS.append(dispatcher)
    return dispatcher


def scalar(function: Callable[..., Any]) -> Any:
    """Compile a formula that only compiled code calls; it is inlined into every caller."""
    return _decorate(function, how=PART, forceinline=True, _nrt=False, **NO_WRAPPERS)


def part(function: Callable[..., Any]) -> Any:
    """Compile a function that only compiled code calls.

    It cannot create arrays. In exchange, references to its arguments are not counted, which takes
    longer than the rest of a short function. It is inlined into its callers if the function whose
    compilation first needs it is, because Numba hands this option down.
    """
    return _decorate(function, how=PART, _nrt=False, **NO_WRAPPERS)


def maker(function: Callable[..., Any]) -> Any:
    """Compile a part that may create arrays."""
    return _decorate(function, how=PART, **NO_WRAPPERS)


def dispatcher_of(function: Callable[..., Any], parallel: bool = True) -> Any:
    """Compile a function that Python calls, in parallel by default; cache it on disk."""
    how = {"pipeline_class": DriverCompiler, "parallel": parallel, "nogil": True}
    dispatcher = _decorate(function, how=how, no_cfunc_wrapper=True)
    keep_compiled(dispatcher, CACHE_FOLDER)
    return dispatcher


def driver(function: Callable[..., Any]) -> Any:
    """Compile a parallel function that Python calls; threads of Python enter it one at a time."""
    return in_turn(dispatcher_of(function))


def evaluator(function: Callable[..., Any]) -> Any:
    """Compile a sequential function that Python calls; cache it on disk."""
    return dispatcher_of(function, parallel=False)


@intrinsic
def align_stack(_typing_context: Any) -> Any:
    """Align the caller's stack frame to a cache line, so that no spilled vector straddles two.

    LLVM realigns a frame only if it contains an over-aligned variable before registers are
    allocated. This variable serves that purpose only; the empty assembly keeps it alive.
    """

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        with builder.goto_entry_block():
            slot = builder.alloca(ir.ArrayType(ir.IntType(8), CACHE_LINE))
        slot.align = CACHE_LINE
        takes_pointer = ir.FunctionType(ir.VoidType(), [slot.type])
        builder.asm(takes_pointer, "", "r,~{memory}", [slot], True)
        return context.get_dummy_value()

    return types.void(), generate


def _marked(*attributes: str) -> Any:
    """Return an intrinsic that gives attributes of LLVM to the function which calls it."""

    @intrinsic
    def mark(_typing_context: Any) -> Any:
        def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
            for attribute in attributes:
                builder.function.attributes.add(attribute)
            return context.get_dummy_value()

        return types.void(), generate

    return mark


apart = _marked("noinline")
"""Keep the calling function out of its callers, so that it is compiled once."""

compact = _marked("noinline", "optsize")
"""Also compile it for size, if it takes a small share of the time of a run.

LLVM otherwise unrolls each of its loops and writes several versions of it. Compiling them takes
longer than all other work on such a function.
"""


def first_element(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    """Return the address of the first element of an array, within an intrinsic."""
    return context.make_array(kind)(context, builder, array).data


@intrinsic
def count_up(_typing_context: Any, counter: Any) -> Any:
    """Add 1 to a number that threads share, shape (1,), atomically; return its old value."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address = first_element(context, builder, signature.args[0], arguments[0])
        one = context.get_value_type(signature.args[0].dtype)(1)
        return builder.atomic_rmw("add", address, one, "monotonic")

    return types.intp(counter), generate


@contextmanager
def on_compilation(announce: Callable[[], None]) -> Iterator[None]:
    """Call a function whenever a compilation begins, if this version of Numba reports that."""
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
