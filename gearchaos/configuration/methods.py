"""What a configuration, its messages and the choice of steps know of a method of integration.

The compiled part of a method, and its limits of stability, are in the kernels under its name.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Method:
    """One method of integration.

    Attributes
    ----------
    name : str
        As ``integration.method`` has it.
    words : str
        What it is, for a table of keys.
    steps : int or None
        Steps per mesh period where a configuration gives none; None: chosen for the scene.
    exact : bool
        Whether steps have no error between crossings, so that none are chosen and no number of
        them is unstable.
    always_resolved : bool
        Whether every crossing is resolved, whatever ``integration.crossings`` says.
    shares_maps : bool
        Whether maps are made beforehand, which take memory and which lanes share.
    """

    name: str
    words: str
    steps: int | None = None
    exact: bool = False
    always_resolved: bool = False
    shares_maps: bool = False


FLOW_MAP_STEPS = 24
"""Steps per period of flow maps: fewer cost more at a crossing, more cost more between them."""

METHODS = {
    one.name: one
    for one in (
        Method("rk4", "classical Runge-Kutta of order 4"),
        Method(
            "flow_map",
            "maps of whole steps that are exact between crossings and at them",
            steps=FLOW_MAP_STEPS,
            exact=True,
            always_resolved=True,
            shares_maps=True,
        ),
    )
}
"""All methods by name; the first is the default."""

EXACT = next(one for one in METHODS.values() if one.exact)
"""The method with which others are compared."""
