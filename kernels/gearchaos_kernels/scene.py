"""What a compiled loop is made of, and how its parts find each other.

A scene names a model, a method and recorders. Each is a record of flags, True for what the compiled
loop contains and None for what it leaves out; its class says which implementation it is. The loop
itself calls interfaces, such as ``gaps_at``. While a function is compiled, every interface in it
is replaced by the implementation that the scene among its arguments names, so that nothing is
looked up at run time.
"""

import inspect
from dataclasses import dataclass, is_dataclass, replace
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any
from uuid import uuid4

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
        super().__init__(f"{scene!r}{_sources_of(scene)}")

    @property
    def key(self) -> Scene:
        """Scenes are equal only if the classes of their parts are; their names may be alike."""
        return self.scene


def _sources_of(scene: Scene) -> str:
    """Return hashes of the implementations outside this package that a scene names."""
    parts = type(scene.model), type(scene.method), type(scene.recorders)
    return "".join(_SOURCES[part] for part in parts)


def _hash_of(flags: type) -> str:
    """Return a hash of the sources beside a class outside this package, empty within it.

    Cached code is then not used after they change.
    """
    if flags.__module__.partition(".")[0] == __package__:
        return ""
    digest = sha256(flags.__module__.encode())
    try:
        for source in sorted(Path(inspect.getfile(flags)).parent.glob("*.py")):
            digest.update(source.read_bytes())
    except (TypeError, OSError):
        # Made at a prompt: code that another process keeps is never the same.
        digest.update(uuid4().bytes)
    return f" {flags.__module__} {digest.hexdigest()}"


register_model(SceneType)(models.OpaqueModel)


@typeof_impl.register(Scene)
def _typeof_scene(scene: Scene, _context: Any) -> SceneType:
    for part in (scene.model, scene.method, scene.recorders):
        for name, value in vars(part).items():
            if value is not None and value is not True:
                raise TypeError(f"{type(part).__qualname__}.{name}: is {value!r}, not True or None")
    return SceneType(scene)


@unbox(SceneType)
def _unbox_scene(_kind: Any, _scene: Any, c: Any) -> NativeValue:
    # A scene has no data at run time: its type says everything.
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
_SOURCES: dict[type, str] = {}


def implement(flags: type, provider: Any) -> None:
    """Register what implements the interfaces of scenes that hold flags of this class.

    Parameters
    ----------
    flags : type
        Class of the flags, a frozen dataclass.
    provider : object
        Has a method ``function(name, scene)`` that returns the compiled function of this name.

    Raises
    ------
    TypeError
        If the class is no frozen dataclass, as named tuples equal those of other classes, or is
        defined within a function, as its name does not tell it from others.

    Notes
    -----
    Compiled code is kept between processes. It is found again by a hash of all Python files in the
    folder of the class, taken now; keep what a model is made of there.
    """
    if not (is_dataclass(flags) and flags.__dataclass_params__.frozen):  # type: ignore[attr-defined]
        raise TypeError(f"{flags.__qualname__}: flags have to be a frozen dataclass")
    if "<locals>" in flags.__qualname__:
        raise TypeError(f"{flags.__qualname__}: flags have to be defined in a module")
    _IMPLEMENTATIONS[flags], _SOURCES[flags] = provider, _hash_of(flags)


def provider_of(flags: Any) -> Any:
    """Return what implements the interfaces for these flags."""
    return _IMPLEMENTATIONS[type(flags)]


def flag(present: object) -> bool | None:
    """Return a condition as a flag: True or None, which have different Numba types."""
    return True if present else None


@cache
def _implementation(part: str, name: str, scene: Scene) -> Any:
    return provider_of(getattr(scene, part)).function(name, scene)
