"""The kinds of the elements of a scene, as constants of compiled code."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from gearchaos_kernels.models.protocol import ElementKind
from gearchaos_kernels.scene import Scene, provider_of


def kinds_of(scene: Scene) -> tuple[ElementKind, ...]:
    """Return the kind of each element of a scene."""
    found: tuple[ElementKind, ...] = provider_of(scene.model).kinds_of(scene.model)
    return found


@intrinsic
def kinds(_typing_context: Any, scene: Any) -> Any:
    """Return the `ElementKind` of each element of a scene, a tuple of constants."""
    found = kinds_of(scene.scene)
    kind = types.NamedUniTuple(types.boolean, len(ElementKind._fields), ElementKind)
    returned = types.UniTuple(kind, len(found))

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        each_kind = [
            context.make_tuple(builder, kind, [ir.Constant(ir.IntType(1), int(one)) for one in of])
            for of in found
        ]
        return context.make_tuple(builder, returned, each_kind)

    return returned(scene), generate
