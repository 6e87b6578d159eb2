"""Scenes: which model, method and recorders a compiled loop consists of.

A scene names a model, a method and recorders. Each is a record of flags: True for what the compiled
loop contains, None for what it leaves out. The class of the record identifies the implementation.
The loop calls interfaces, such as ``gaps_at``. When a function is compiled, the implementation that
belongs to the scene among its arguments replaces every interface, so that nothing is looked up at
run time.
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
    """The contents of a compiled loop. A flag is True if it is contained, otherwise None.

    A flag of a model may also be a frozen dataclass that describes what the formulas contain.

    Attributes
    ----------
    model, method, recorders : records of flags
        Their classes, frozen dataclasses, identify the implementations; see `implement`. Named
        tuples do not serve: those of different classes can be equal.
    clearance : True or None
        Whether some element has a clearance.
    resolved : True or None
        Whether steps that cross a clearance boundary are resolved there.
    tangent : True or None
        Whether a tangent vector is integrated with every lane.
    before : True or None
        Whether the state before a step is kept until its end.
    switches : True or None
        Whether the equations of a lane switch at known moments of the mesh period.
    jumps : True or None
        Whether the force of some element jumps where a contact begins or ends.
    control : True or None
        Whether a controller chooses an input of every lane.
    feedback : Feedback or None
        What the loop contains of the controller, see `control`.
    traced : True or None
        Whether the method follows forces and observed signals along every step.
    stops : True or None
        Whether the method stops a block whose lanes lack maps, and continues it later.
    """

    model: Any
    method: Any
    recorders: Any
    clearance: Any
    resolved: Any
    tangent: Any
    before: Any
    switches: Any = None
    jumps: Any = None
    control: Any = None
    feedback: Any = None
    traced: Any = None
    stops: Any = None

    def bare(self) -> "Scene":
        """Return the scene without tangent vector and recorders, which do not affect flow maps."""
        recorders = type(self.recorders)()
        nothing = dict.fromkeys(("tangent", "before", "control", "feedback"))
        return replace(self, recorders=recorders, **nothing)


class SceneType(types.Opaque):  # type: ignore[misc]
    """The Numba type of one scene: every scene has its own type and its own compiled code."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        super().__init__(f"{scene!r}{_sources_of(scene)}")

    @property
    def key(self) -> Scene:
        """The scene itself, since scenes of different classes may have equal names."""
        return self.scene


def _sources_of(scene: Scene) -> str:
    """Return hashes of those implementations of a scene that are outside this package."""
    parts = type(scene.model), type(scene.method), type(scene.recorders)
    return "".join(_SOURCES[part] for part in parts)


def _hash_of(flags: type) -> str:
    """Return a hash of the Python files beside a class outside this package, "" within it.

    It is part of the scene's type, so that cached code is not used after an edit.
    """
    if flags.__module__.partition(".")[0] == __package__:
        return ""
    digest = sha256(flags.__module__.encode())
    try:
        for source in sorted(Path(inspect.getfile(flags)).parent.glob("*.py")):
            digest.update(source.read_bytes())
    except (TypeError, OSError):
        # Defined at a prompt: a random hash keeps code of other processes from being used.
        digest.update(uuid4().bytes)
    return f" {flags.__module__} {digest.hexdigest()}"


register_model(SceneType)(models.OpaqueModel)


@typeof_impl.register(Scene)
def _typeof_scene(scene: Scene, _context: Any) -> SceneType:
    """Return the Numba type of a scene; raise TypeError if a flag is none."""
    for part in (scene.model, scene.method, scene.recorders):
        for name, value in vars(part).items():
            if not (value is None or value is True or is_dataclass(value)):
                raise TypeError(f"{type(part).__qualname__}.{name}: is {value!r}, not True or None")
    return _scene_type(scene)


@cache
def _scene_type(scene: Scene) -> SceneType:
    """Return the Numba type of a scene, always the same one."""
    return SceneType(scene)


@unbox(SceneType)
def _unbox_scene(_kind: Any, _scene: Any, c: Any) -> NativeValue:
    """Return no data: at run time a scene has none, since its type contains everything."""
    return NativeValue(c.context.get_dummy_value())


class Interface:
    """A function that a part of the scene implements.

    Parameters
    ----------
    part : {"model", "method", "recorders"}
        The part of the scene that implements it.
    name : str
        Name of the function in the implementation.

    Notes
    -----
    Only compiled functions with an argument ``scene`` can call it.
    """

    def __init__(self, part: str, name: str) -> None:
        self.part, self.name = part, name

    def __call__(self, *_arguments: Any) -> Any:
        """Raise TypeError: only the compiler knows the scene that selects the implementation."""
        raise TypeError(f"{self.name} is an interface for compiled code")

    def of(self, scene: Scene) -> Any:
        """Return the implementation for a scene."""
        return _implementation(self.part, self.name, scene)


_IMPLEMENTATIONS: dict[type, Any] = {}
_SOURCES: dict[type, str] = {}


def implement(flags: type, provider: Any) -> None:
    """Register the implementation of scenes that contain flags of a class.

    Parameters
    ----------
    flags : type
        Class of the flags, a frozen dataclass.
    provider : object or callable
        Its method ``function(name, scene)`` returns the compiled function of an interface. If the
        implementation depends on the flags, a function that returns it for flags, always the same
        one for equal flags.

    Raises
    ------
    TypeError
        If the class is not a frozen dataclass, or is defined within a function and therefore has
        no unique name.

    Notes
    -----
    Compiled code is cached between processes under a hash of all Python files in the folder of the
    class. Keep all sources of a model there: an edit elsewhere is not noticed.
    """
    if not (is_dataclass(flags) and flags.__dataclass_params__.frozen):  # type: ignore[attr-defined]
        raise TypeError(f"{flags.__qualname__}: flags have to be a frozen dataclass")
    if "<locals>" in flags.__qualname__:
        raise TypeError(f"{flags.__qualname__}: flags have to be defined in a module")
    _IMPLEMENTATIONS[flags], _SOURCES[flags] = provider, _hash_of(flags)


def provider_of(flags: Any) -> Any:
    """Return the implementation for flags."""
    provider = _IMPLEMENTATIONS[type(flags)]
    return provider(flags) if callable(provider) else provider


def flag(present: object) -> bool | None:
    """Return a condition as a flag: True or None, which have different Numba types."""
    return True if present else None


@cache
def _implementation(part: str, name: str, scene: Scene) -> Any:
    """Return the function that implements an interface for a scene, always the same one."""
    return provider_of(getattr(scene, part)).function(name, scene)
