"""What a compiled loop is made of, and how its parts find each other.

A scene names a model, a method and recorders. Each is a record of flags, True for what the compiled
loop contains and None for what it leaves out; its class says which implementation it is. The loop
itself calls interfaces, such as ``gaps_at``. While a function is compiled, every interface in it
is replaced by the implementation that the scene among its arguments names, so that nothing is
looked up at run time.
"""

import inspect
from dataclasses import dataclass, replace
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba import types
from numba.extending import NativeValue, models, register_model, typeof_impl, unbox


@dataclass(frozen=True)
class Scene:
    """What a compiled loop has; a flag is True where it does, and None where it does not.

    Attributes
    ----------
    model, method, recorders : records of flags
        Their classes, frozen dataclasses, name the implementations; see `implement`. Named tuples
        would be equal to those of other classes.
    clearance : True or None
        Whether some element has a clearance.
    resolved : True or None
        Whether steps that cross a clearance boundary are resolved there.
    tangent : True or None
        Whether a tangent vector is integrated with every lane.
    before : True or None
        Whether the state before a step is kept until its end.
    """

    model: Any
    method: Any
    recorders: Any
    clearance: Any
    resolved: Any
    tangent: Any
    before: Any

    def bare(self) -> "Scene":
        """Return the scene without tangent vector and recorders, for what does not need them."""
        recorders = type(self.recorders)()
        return replace(self, tangent=None, before=None, recorders=recorders)


class SceneType(types.Opaque):  # type: ignore[misc]
    """The Numba type of one scene: every scene is compiled for itself."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        super().__init__(f"{scene!r}{_sources(scene)}")


@cache
def _sources(scene: Scene) -> str:
    """Return a hash of implementations outside this package, for which no other one may stand."""
    classes = [type(part) for part in (scene.model, scene.method, scene.recorders)]
    others = [one for one in classes if one.__module__.partition(".")[0] != __package__]
    hashes = (sha256(Path(inspect.getfile(one)).read_bytes()).hexdigest() for one in others)
    return "".join(
        f" {one.__module__} {digest}" for one, digest in zip(others, hashes, strict=True)
    )


register_model(SceneType)(models.OpaqueModel)


@typeof_impl.register(Scene)
def _typeof_scene(scene: Scene, _context: Any) -> SceneType:
    return SceneType(scene)


@unbox(SceneType)
def _unbox_scene(_kind: Any, _scene: Any, c: Any) -> NativeValue:
    # All there is to know of a scene is its type.
    return NativeValue(c.context.get_dummy_value())


class Interface:
    """A function that one part of the scene implements.

    Parameters
    ----------
    part : {"model", "method", "recorders"}
        The part of the scene that implements it.
    name : str
        Under which name.

    Notes
    -----
    It can only be called in compiled code, by functions that have an argument ``scene``.
    """

    def __init__(self, part: str, name: str) -> None:
        self.part, self.name = part, name

    def __call__(self, *_arguments: Any) -> Any:
        """Refuse calls from Python: without compilation nothing knows the scene's type."""
        raise TypeError(f"{self.name} is an interface for compiled code")

    def of(self, scene: Scene) -> Any:
        """Return the implementation that a scene names."""
        return _implementation(self.part, self.name, scene)


_IMPLEMENTATIONS: dict[type, Any] = {}


def implement(flags: type, provider: Any) -> None:
    """Register what implements the interfaces of scenes that hold flags of this class.

    Parameters
    ----------
    flags : type
        Class of the flags, a frozen dataclass.
    provider : object
        Has a method ``function(name, scene)`` that returns the compiled function of this name.
    """
    _IMPLEMENTATIONS[flags] = provider


def provider_of(flags: Any) -> Any:
    """Return what implements the interfaces for these flags."""
    return _IMPLEMENTATIONS[type(flags)]


def flag(present: object) -> bool | None:
    """Return a condition as a flag: True or None, which have different Numba types."""
    return True if present else None


@cache
def _implementation(part: str, name: str, scene: Scene) -> Any:
    return provider_of(getattr(scene, part)).function(name, scene)
