"""Names of axes, dimensions and outputs that other modules refer to."""

from collections.abc import Sequence

REALISATION = "realisation"
START = "start"
DIRECTION = "direction"
REPEATS = (REALISATION, START)
"""Axes of the drawn systems and of the starts of one parameter value."""
UNSWEPT = (*REPEATS, DIRECTION)
"""Axes along which no parameter is swept."""
WAYS = ("upwards", "downwards")
"""Meanings of the values 0 and 1 of the axis `DIRECTION`."""

SECTION_POINT = "section_point"
STATE = "state"
EXPONENT_NUMBER = "exponent"
ORDER = "order"
HARMONIC = "harmonic"
TIME = "time"
"""Dimensions that belong to single outputs."""

SECTION = "section_"
"""Beginning of the names of sections; the name of a state follows."""
AMPLITUDE = "amplitude_"
"""Beginning of the names of amplitudes; the name of a state or signal follows."""
EXTREMES = ("smallest", "largest", "peak_to_peak")
"""Endings of the names of the extremes of a state."""

LARGEST_EXPONENT = "lyapunov_exponent"
STANDARD_ERROR = "_standard_error"
"""Ending of the name of a standard error; the name of the exponents comes first."""
STEP_ERROR = "exponent_step_error"
RECORD = "record"
LABELS = ("motion", "period")
BANDS = "bands"
CROSSINGS = "crossings_per_period"
STATUS = "status"
MESH_PERIOD = "mesh_period"

CONTACT_STATE = "contact_state_"
"""Beginning of the names of kinds of contact; the name of an element follows."""

# Metadata.
CONVERTED = "converted_axes"


def rate_of(coordinate: str) -> str:
    """Return the name of the rate of a coordinate such as ``delta_5``."""
    return f"{coordinate}_rate"


def acceleration_of(coordinate: str) -> str:
    """Return the name of the acceleration of a coordinate such as ``delta_5``."""
    return f"{coordinate}_acceleration"


def axis_name(parameter: str) -> str:
    """Return the name of the axis of a swept parameter, such as ``operation_speed_rpm``."""
    return parameter.replace(".", "_")


def coordinate_text(axis: str, value: float, digits: int = 12) -> str:
    """Write the value of an axis as text; a direction is written as its name."""
    named = axis == DIRECTION and value in range(len(WAYS))
    return WAYS[int(value)] if named else f"{value:.{digits}g}"


def diagram_axis(axes: Sequence[str]) -> str:
    """Return the axis along which a diagram runs: the first swept parameter, "" without axes."""
    return ([*axes[:1]] + [name for name in axes if name not in UNSWEPT])[-1] if axes else ""
