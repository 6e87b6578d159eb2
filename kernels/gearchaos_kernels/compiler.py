"""A compiler pass that specialises functions for the scene among their arguments.

Numba documents how to write and add passes. This one also changes the definitions of names, for
which Numba has no public function. That is why the supported versions of Numba have an upper bound.
"""

from typing import Any

from numba.core import ir as numba_ir
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.ir_utils import get_definition, guard
from numba.core.untyped_passes import RewriteSemanticConstants

from gearchaos_kernels.scene import Interface, SceneType

PARTS: list[Any] = []
"""Dispatchers of all functions that only compiled code calls."""


@register_pass(mutates_CFG=False, analysis_only=False)
class KnownScene(FunctionPass):  # type: ignore[misc]
    """Replace flags of a scene by constants, and interfaces by the implementations of the scene.

    Numba then removes branches on constants that are None before it infers types.
    """

    _name = "known_scene"

    def __init__(self) -> None:
        """Create the pass, which has no state."""

    def run_pass(self, state: Any) -> bool:
        """Replace ``scene.part.flag`` by None or True, and every `Interface` by a function."""
        known = []
        for block in state.func_ir.blocks.values():
            for assignment in block.find_insts(numba_ir.Assign):
                value = _known(state, assignment.value)
                if value is not None:
                    known.append((assignment, value))
        # Replaced only now: the search above follows unchanged definitions back to the scene.
        for assignment, value in known:
            assignment.value = value
            state.func_ir._definitions[assignment.target.name] = [value]
        return bool(known)


def _known(state: Any, value: Any) -> Any:
    """Return what replaces the value of an assignment, or None."""
    if isinstance(value, numba_ir.Global | numba_ir.FreeVar) and isinstance(value.value, Interface):
        scene = state.args[state.func_ir.arg_names.index("scene")].scene
        return numba_ir.Global(value.name, value.value.of(scene), value.loc)
    if isinstance(value, numba_ir.Expr) and value.op == "getattr":
        found = guard(_part_of_scene, state, value)
        if found is not None:
            (part,) = found
            # A record of flags becomes None as well: nothing reads it once its flags are constants.
            return numba_ir.Const(True if part is True else None, value.loc)
    return None


def _part_of_scene(state: Any, value: Any) -> tuple[Any] | None:
    """Return the scene or the part of a scene that a value is, in a tuple, or None."""
    if isinstance(value, numba_ir.Arg):
        kind = state.args[value.index]
        return (kind.scene,) if isinstance(kind, SceneType) else None
    if not (isinstance(value, numba_ir.Expr) and value.op == "getattr"):
        return None
    found = _part_of_scene(state, get_definition(state.func_ir, value.value))
    return found and (getattr(found[0], value.attr),)


class PartCompiler(CompilerBase):  # type: ignore[misc]
    """Numba's passes, with `KnownScene` before the one that removes branches."""

    def define_pipelines(self) -> list[Any]:
        """Return the list of passes."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(KnownScene, RewriteSemanticConstants)
        passes.finalize()
        return [passes]


def forget_scenes() -> None:
    """Drop the compiled code of functions that has been linked into a loop of its scene.

    Nothing else can use it, and it takes 100 MB and more. Numba also compares the arguments of each
    call with all signatures that a function has been compiled for, which grow in number.
    """
    for dispatcher in PARTS:
        kept = []
        for signature, compiled in dispatcher.overloads.items():
            if any(isinstance(kind, SceneType) for kind in signature):
                dispatcher.targetctx.remove_user_function(compiled.entry_point)
            else:
                kept.append(compiled)
        if len(kept) < len(dispatcher.overloads):
            dispatcher._reset_overloads()
            for compiled in kept:
                dispatcher.add_overload(compiled)
