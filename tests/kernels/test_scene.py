"""Scenes identify their implementations by classes that cannot be confused with others."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numba
import pytest
from gearchaos_kernels.methods.registry import METHODS
from gearchaos_kernels.scene import Interface, SceneType, implement

from .scenes import scene_with


class Named(NamedTuple):
    flag: Any = None


@dataclass(frozen=True)
class Flags:
    flag: Any = None


def test_flags_are_a_frozen_dataclass_of_a_module():
    with pytest.raises(TypeError, match="Named: flags have to be a frozen dataclass"):
        implement(Named, None)

    @dataclass(frozen=True)
    class Local:
        flag: Any = None

    with pytest.raises(TypeError, match="Local: flags have to be defined in a module"):
        implement(Local, None)


@pytest.mark.parametrize("flag", [False, 1, "yes"])
def test_a_flag_is_true_or_none(flag):
    with pytest.raises(TypeError, match=r"GearPair\.axial: is .*, not True or None"):
        numba.typeof(scene_with(None, axial=flag))


def test_scenes_of_different_methods_have_different_types():
    scenes = [scene_with(True, method=method.flags()) for method in METHODS.values()]
    assert len({SceneType(scene) for scene in scenes}) == len(METHODS)


def test_the_type_of_a_model_outside_the_package_depends_on_the_sources_beside_it():
    class Provider:
        def function(self, name, scene):
            return name, scene

    implement(Flags, Provider())
    scene = scene_with(None)
    outside = type(scene)(**{**vars(scene), "model": Flags()})
    assert "test_scene" in SceneType(outside).name
    assert "test_scene" not in SceneType(scene).name
    assert Interface("model", "gaps_at").of(outside) == ("gaps_at", outside)


def test_an_interface_is_for_compiled_code():
    with pytest.raises(TypeError, match="gaps_at is an interface for compiled code"):
        Interface("model", "gaps_at")(1.0)
