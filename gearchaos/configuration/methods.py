"""The table of integration methods: their words and properties for everything above the kernels.

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
    title : str
        Name in messages and figures.
    words : str
        Description for the table of keys, the dry run and the metadata of results.
    steps : int or None
        Default steps per mesh period; None: chosen for the scene.
    exact : bool
        Whether steps have no error between crossings. No steps are then chosen, and any number of
        steps is stable.
    always_resolved : bool
        Whether every crossing is resolved, also with ``integration.crossings = "plain"``.
    shares_maps : bool
        Whether maps are computed in advance; they take memory, and lanes share them.
    most_elements : int or None
        Largest number of clearance elements of a machine of any number of coordinates; None: any.
    for_machines : bool
        Whether it integrates machines only: matrices, trains and planetary sets, no gear pairs.
    """

    name: str
    title: str
    words: str
    steps: int | None = None
    exact: bool = False
    always_resolved: bool = False
    shares_maps: bool = False
    most_elements: int | None = None
    for_machines: bool = False

    def description(self, steps: int, crossings: str) -> str:
        """Return the method with its settings in words, for the dry run and the metadata.

        ``steps``: steps per mesh period; ``crossings``: value of ``integration.crossings``.
        """
        kind = "resolved" if self.always_resolved else crossings
        return f"{self.title}: {self.words}; {steps} steps per period, {kind} crossings"


AUTO = "auto"
"""Value of ``integration.method`` that selects the fastest one of the methods."""

INTEGRATORS = (
    Method("rk4", "RK4", "classical Runge-Kutta of order 4"),
    Method(
        "flow_map",
        "flow maps",
        "maps of whole steps that are exact between crossings and at them",
        # Fewer steps take longer at crossings, more steps take longer between them.
        steps=12,
        exact=True,
        always_resolved=True,
        shares_maps=True,
        most_elements=52,
    ),
    Method(
        "taylor",
        "Taylor series",
        "series of the motion of a machine, exact between crossings and at them",
        # They divide each step by themselves; the ends of steps are only where others may look.
        steps=4,
        exact=True,
        always_resolved=True,
        most_elements=52,
        for_machines=True,
    ),
)
"""The methods that integrate lanes."""

METHODS = {
    one.name: one
    for one in (
        *INTEGRATORS,
        Method(AUTO, AUTO, "whichever of the others is estimated to be faster"),
    )
}
"""All values of ``integration.method``."""

DEFAULT = INTEGRATORS[0]
"""The method that can integrate every scene."""

EXACT = next(one for one in INTEGRATORS if one.exact)
"""The method to which others are compared."""

EXACT_TITLES = " and ".join(one.title for one in INTEGRATORS if one.exact)
"""The exact methods in words."""

OWN_STEPS = ", ".join(f'{one.steps} with method = "{one.name}"' for one in INTEGRATORS if one.steps)
"""Default steps per mesh period of the methods that have some of their own, in words."""

EXACT_STEPS = EXACT.steps or 1
"""Default steps per mesh period of the exact method."""
