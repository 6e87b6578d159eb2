"""Which branches of a kernel its scene has: a pass that Numba compiles every kernel with.

Numba documents how passes are written and added; that this one corrects the definitions of names
has no other way, which is why the versions of Numba are bounded above.
"""

from typing import Any

from numba import types
from numba.core import ir as numba_ir
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.ir_utils import get_definition, guard
from numba.core.untyped_passes import RewriteSemanticConstants


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
        changed, definitions = False, state.func_ir._definitions
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
                        definitions[assignment.target.name] = [assignment.value]
                        changed = True
        return changed


class PartCompiler(CompilerBase):  # type: ignore[misc]
    """Numba's own passes, and `KnownFlags` before it removes branches."""

    def define_pipelines(self) -> list[Any]:
        """Return the one list of passes."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(KnownFlags, RewriteSemanticConstants)
        passes.finalize()
        return [passes]
