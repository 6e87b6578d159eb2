"""Compile for a scene: a pass that replaces what the type of a scene decides.

Numba documents how passes are written and added; that this one corrects the definitions of names
has no other way, which is why the versions of Numba are bounded above.
"""

from typing import Any

from numba.core import ir as numba_ir
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.ir_utils import get_definition, guard
from numba.core.untyped_passes import RewriteSemanticConstants

from gearchaos_kernels.scene import Interface, SceneType


@register_pass(mutates_CFG=False, analysis_only=False)
class KnownScene(FunctionPass):  # type: ignore[misc]
    """Replace flags of a scene by constants, and interfaces by the functions that it names.

    Numba removes the branches of an argument that is None before it compiles anything.
    """

    _name = "known_scene"

    def __init__(self) -> None:
        """Keep nothing between functions."""

    def run_pass(self, state: Any) -> bool:
        """Replace ``scene.part.flag`` by None or True, and each `Interface`."""
        known = []
        for part in state.func_ir.blocks.values():
            for assignment in part.find_insts(numba_ir.Assign):
                value = _known(state, assignment.value)
                if value is not None:
                    known.append((assignment, value))
        # All of them at once: a part of a scene is found through the part that it belongs to.
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
            # A record of flags is not needed any more where its flags are known.
            return numba_ir.Const(True if part is True else None, value.loc)
    return None


def _part_of_scene(state: Any, value: Any) -> tuple[Any] | None:
    """Return a scene that is an argument, or a part of it, in a tuple; None if it is neither."""
    if isinstance(value, numba_ir.Arg):
        kind = state.args[value.index]
        return (kind.scene,) if isinstance(kind, SceneType) else None
    if not (isinstance(value, numba_ir.Expr) and value.op == "getattr"):
        return None
    found = _part_of_scene(state, get_definition(state.func_ir, value.value))
    return found and (getattr(found[0], value.attr),)


class PartCompiler(CompilerBase):  # type: ignore[misc]
    """Numba's own passes, and `KnownScene` before it removes branches."""

    def define_pipelines(self) -> list[Any]:
        """Return the one list of passes."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(KnownScene, RewriteSemanticConstants)
        passes.finalize()
        return [passes]
