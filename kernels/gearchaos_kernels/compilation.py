"""How the kernels are compiled: flags, vector width, stack alignment and what is cached.

Every flag is named here and nowhere else. Three facts about Numba shape this file:

* a cached caller contains the code of its callees, and would keep it when one is edited in another
  file. The cache folder is therefore named after a hash of all kernel sources;
* every function is optimised and made executable for itself, and again in each function it is
  linked into: five times for the block of lanes. Here only what Python calls is;
* LLVM prefers 256-bit vectors on some AVX-512 processors, and it spills vector registers to an
  unaligned stack. Both cost up to half of the speed of the lane loop.
"""

import gc
import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import llvmlite.binding
import numba
from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.core import ir as numba_ir
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.ir_utils import get_definition, guard
from numba.core.untyped_passes import RewriteSemanticConstants
from numba.extending import intrinsic

from gearchaos_kernels.cache import KernelCache, cache_folder
from gearchaos_kernels.turns import in_turn

# OpenMP asks when it is loaded, with the first parallel loop: a thread that waits shall leave its
# core to others, as calls may be short, a thousand of them, and other processes run beside.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

FASTMATH = {"contract", "nsz"}
"""Fused multiply-add and unsigned zeros only: NaN and infinity keep their meaning."""

CACHE_LINE = 64  # Bytes that one aligned 512-bit vector occupies.


def source_hash() -> str:
    """Return a hash of every source file of this package and of Numba's version."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


CACHE_FOLDER = cache_folder(source_hash())
if config.CPU_FEATURES is None:
    features = llvmlite.binding.get_host_cpu_features().flatten()
    config.CPU_FEATURES = f"{features},-prefer-256-bit"


@register_pass(mutates_CFG=False, analysis_only=False)
class KnownFlags(FunctionPass):  # type: ignore[misc]
    """Make the flags of a record constants, where their types tell whether they are there.

    Numba removes the branches of an argument that is None before it compiles anything. For a field
    of a record only LLVM does, after the absent branch has cost its time too.
    """

    _name = "known_flags"

    def __init__(self) -> None:
        """Keep nothing between functions."""

    def run_pass(self, state: Any) -> bool:
        """Replace ``record.flag`` by None or True; what is there is never False."""
        changed = False
        for part in state.func_ir.blocks.values():
            for assignment in part.find_insts(numba_ir.Assign):
                value = assignment.value
                if not (isinstance(value, numba_ir.Expr) and value.op == "getattr"):
                    continue
                record = guard(get_definition, state.func_ir, value.value)
                kind = state.args[record.index] if isinstance(record, numba_ir.Arg) else None
                if isinstance(kind, types.NamedTuple) and value.attr in kind.fields:
                    field = kind.types[kind.fields.index(value.attr)]
                    if field in (types.none, types.boolean):
                        constant = None if field is types.none else True
                        assignment.value = numba_ir.Const(constant, value.loc)
                        state.func_ir._definitions[assignment.target.name] = [assignment.value]
                        changed = True
        return changed


class _Compiler(CompilerBase):  # type: ignore[misc]
    """Numba's own passes, and `KnownFlags` before it removes branches."""

    def define_pipelines(self) -> list[Any]:
        """Return the one list of passes."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(KnownFlags, RewriteSemanticConstants)
        passes.finalize()
        return [passes]


class _LinkedOnly(JITCodeLibrary):  # type: ignore[misc]
    """Code of functions that no Python calls: a driver that they are linked into optimises it."""

    codegen = SimpleNamespace(set_env=lambda _name, _environment: None)

    def _optimize_final_module(self) -> None:
        """Leave it to the driver."""

    def _finalize_final_module(self) -> None:
        """Make nothing executable."""
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, _name: str) -> int:
        """Return null, as where there is no such function."""
        self._ensure_finalized()
        return 0


class _DriverCompiler(_Compiler):
    """Compile a driver; everything that is compiled on its way is only linked into it."""

    def _compile_core(self) -> Any:
        """Run the passes with a library for the driver, and another kind for all others."""
        codegen = self.state.targetctx.codegen()
        self.state.library = codegen.create_library(self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        codegen._library_class = _LinkedOnly
        # Next to nothing of what a compilation makes is rubbish before its end.
        collecting = gc.isenabled()
        gc.disable()
        try:
            return super()._compile_core()
        finally:
            del codegen._library_class
            if collecting:
                gc.enable()


def _decorate(
    function: Callable[..., Any], compiler: type[CompilerBase] = _Compiler, **flags: Any
) -> Any:
    flags |= {"fastmath": FASTMATH, "error_model": "numpy"}
    dispatcher = numba.njit(pipeline_class=compiler, **flags)(function)
    # Numba would compile for every constant argument anew; LLVM knows them all the same.
    template = dispatcher.get_call_template
    dispatcher.get_call_template = lambda args, kws: template(
        tuple(map(types.unliteral, args)), kws
    )
    return dispatcher


def scalar(function: Callable[..., Any]) -> Any:
    """Compile a formula of plain numbers that is inlined wherever it is used."""
    return _decorate(
        function, forceinline=True, no_cfunc_wrapper=True, no_cpython_wrapper=True, _nrt=False
    )


def part(function: Callable[..., Any]) -> Any:
    """Compile a function that only compiled code calls, and calls rather than copies."""
    return _decorate(function, no_cfunc_wrapper=True, no_cpython_wrapper=True)


def dispatcher_of(function: Callable[..., Any], parallel: bool = True) -> Any:
    """Compile a function that only splits, calls and merges, in parallel and cached on disk."""
    dispatcher = _decorate(
        function, _DriverCompiler, parallel=parallel, nogil=True, no_cfunc_wrapper=True
    )
    dispatcher._cache = KernelCache(function, CACHE_FOLDER)
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
        slot = cgutils.alloca_once(builder, ir.ArrayType(ir.IntType(8), CACHE_LINE))
        slot.align = CACHE_LINE
        takes_pointer = ir.FunctionType(ir.VoidType(), [slot.type])
        builder.asm(takes_pointer, "", "r,~{memory}", [slot], True)
        return context.get_dummy_value()

    return types.void(), generate


@intrinsic
def count_up(_typing_context: Any, counter: Any) -> Any:
    """Add one to a number that threads share, shape (1,), and return what it was."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        return builder.atomic_rmw("add", address, address.type.pointee(1), "monotonic")

    return types.intp(counter), generate
