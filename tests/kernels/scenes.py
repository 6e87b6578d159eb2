"""Scenes of the gear pair for formulas that are called by themselves."""

from typing import Any

from gearchaos_kernels.methods.rk4.method import Rk4
from gearchaos_kernels.models.gear_pair.model import GearPair
from gearchaos_kernels.recorders.registry import Recorded
from gearchaos_kernels.scene import Scene


def scene_with(flag: bool | None, method: Any = None, **flags: bool | None) -> Scene:
    """Return a scene all of whose flags are True or None, but for some flags of the model."""
    names = GearPair.__dataclass_fields__
    # The only field that is no flag.
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
