"""Scenes of the gear pair for tests that call single formulas."""

from typing import Any

from gearchaos_kernels.methods.rk4.method import Rk4
from gearchaos_kernels.models.gear_pair.model import GearPair
from gearchaos_kernels.recorders.registry import Recorded
from gearchaos_kernels.scene import Scene


def scene_with(flag: bool | None, method: Any = None, **flags: bool | None) -> Scene:
    """Return a scene whose flags all have one value, except the given flags of the model."""
    names = GearPair.__dataclass_fields__
    # The only field that is not a flag.
    every = dict.fromkeys(names, flag) | {"harmonics": None}
    return Scene(
        model=GearPair(**{**every, **flags}),
        method=method or Rk4(),
        recorders=Recorded(),
        clearance=flag,
        resolved=flag,
        tangent=flag,
        before=flag,
    )
