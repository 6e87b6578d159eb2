"""Properties of the integration methods for configurations, messages and the choice of steps.

The compiled part of a method and its stability limits are in the kernels, under the same name.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Method:
    """One method of integration.

    Attributes
    ----------
    name : str
        Value of ``integration.method``.
    words : str
        Description for the table of keys.
    steps : int or None
        Default steps per mesh period; None: chosen for the scene.
    exact : bool
        Whether steps have no error between crossings. No steps are then chosen, and any number of
        steps is stable.
    always_resolved : bool
        Whether every crossing is resolved, whatever ``integration.crossings`` is.
    shares_maps : bool
        Whether maps are computed in advance; they take memory, and lanes share them.
    most_elements : int or None
        Largest number of clearance elements of a machine of any number of coordinates; None: any.
    """

    name: str
    words: str
    steps: int | None = None
    exact: bool = False
    always_resolved: bool = False
    shares_maps: bool = False
    most_elements: int | None = None


FLOW_MAP_STEPS = 12
"""Steps per period of flow maps: fewer take longer at crossings, more between them."""

AUTO = "auto"
"""Name of the method that stands for the faster one of the others."""

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
            most_elements=4,
        ),
        Method(AUTO, "whichever of the others is estimated to be faster"),
    )
}
"""All methods by name; the first is the default."""

EXACT = next(one for one in METHODS.values() if one.exact)
"""The method to which others are compared."""
