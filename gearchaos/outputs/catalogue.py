"""The generic entries of the catalogue: outputs of any model, in the order of a file.

A model adds its own parts and wordings; that of the gear pair is
`gearchaos.models.gear_pair.outputs`.
"""

from gearchaos.outputs import names
from gearchaos.outputs.entries import LANE_AXES, Kind, Output, Part, numbers
from gearchaos.outputs.scales import Quantity

CONTACTS = ("apart", "driving flank", "back flank")
"""Meanings of the contacts 0, 1 and 2 of an element at one instant."""
NO_CONTACT = 255
"""Contact of a lane that diverged."""
DEFAULT_PERIODS = 32
"""Mesh periods of a response where their number is not given."""

REALISATION_AXIS = Part(
    "with several drawn systems",
    (numbers(names.REALISATION, "drawn system"),),
)
START_AXIS = Part(
    "with several starts",
    (numbers(names.START, "number of the start among those of one parameter value"),),
)
DIRECTION_AXIS = Part(
    "with states that are carried in both directions",
    (
        numbers(
            names.DIRECTION,
            "direction in which each value starts from the end state of its neighbour",
            meanings=names.WAYS,
        ),
    ),
)
HARMONICS_PART = Part(
    "with parameters that have a value for each harmonic",
    (numbers(names.HARMONIC, "harmonic of the mesh frequency in the mesh stiffness", "$n$"),),
)
SECTION_POINTS_PART = Part(
    "with sections",
    (
        numbers(
            names.SECTION_POINT,
            "number of the section point, one mesh period apart; the last one ends the lane",
        ),
    ),
)
SECTION_PART = Part(
    "with sections, for each of their states",
    (
        Output(
            f"{names.SECTION}@",
            "@ at the stroboscopic section",
            "@",
            dims=(LANE_AXES, names.SECTION_POINT),
            scale=None,
            errors=("section_error",),
        ),
    ),
    repeated_for=(Kind.STATE,),
)
LYAPUNOV_PART = Part(
    "with the largest Lyapunov exponent",
    (
        Output(
            names.LARGEST_EXPONENT,
            "largest Lyapunov exponent",
            r"$\lambda_1$",
            scale=Quantity.GROWTH_RATE,
            errors=(names.LARGEST_EXPONENT + names.STANDARD_ERROR, names.STEP_ERROR),
        ),
        Output(
            names.LARGEST_EXPONENT + names.STANDARD_ERROR,
            "standard error of the largest Lyapunov exponent, 0 where it is that of a periodic "
            "orbit",
            r"$s_{\lambda_1}$",
            scale=Quantity.GROWTH_RATE,
        ),
    ),
)
MOTION_PART = Part(
    "with labels of the motions",
    (
        Output("motion", "kind of motion", dtype="uint8", fill_value=None),
        Output(
            "period",
            "@ after which the motion repeats, 0 where it is not periodic",
            "$n$",
            dtype="int32",
            fill_value=None,
        ),
        Output(
            "return_distance",
            "smallest distance after which the motion returns, of all states, scaled",
        ),
        Output(
            names.BANDS,
            "number of bands that a chaotic or quasi-periodic section visits in turn, 0 otherwise",
            dtype="int32",
            fill_value=None,
        ),
    ),
)
RECORD_PART = Part(
    "with labels of the motions and the largest Lyapunov exponent",
    (
        Output(
            names.RECORD,
            "whether the record holds one kind of motion, or another one before the labelled one",
            dtype="uint8",
            fill_value=None,
        ),
    ),
)
EXPONENTS_PART = Part(
    "with all Lyapunov exponents",
    (
        numbers(names.EXPONENT_NUMBER, "number of the Lyapunov exponent, the largest first", "$i$"),
        Output(
            "lyapunov_exponents",
            "all Lyapunov exponents",
            r"$\lambda_i$",
            dims=(LANE_AXES, names.EXPONENT_NUMBER),
            scale=Quantity.GROWTH_RATE,
            errors=(f"lyapunov_exponents{names.STANDARD_ERROR}",),
        ),
        Output(
            f"lyapunov_exponents{names.STANDARD_ERROR}",
            "standard error of each Lyapunov exponent",
            dims=(LANE_AXES, names.EXPONENT_NUMBER),
            scale=Quantity.GROWTH_RATE,
        ),
        Output(
            "lyapunov_sum",
            "sum of all Lyapunov exponents as the damping gives it, exactly",
            r"$\sum\lambda_i$",
            scale=Quantity.GROWTH_RATE,
        ),
    ),
)
DIMENSION_PART = Part(
    "with all Lyapunov exponents, for their dimension",
    (
        Output(
            "kaplan_yorke_dimension",
            "Kaplan-Yorke dimension of the stroboscopic section",
            r"$D_\mathrm{KY}$",
            errors=(f"kaplan_yorke_dimension{names.STANDARD_ERROR}",),
        ),
        Output(
            f"kaplan_yorke_dimension{names.STANDARD_ERROR}",
            "standard error of the Kaplan-Yorke dimension, an upper bound",
        ),
    ),
)
CROSSINGS_PART = Part(
    "if steps are split where an element is met or left",
    (
        Output(names.CROSSINGS, "clearance boundaries crossed per mesh period"),
        Output(
            "slowest_crossing",
            "smallest speed of a gap at a crossing of its clearance boundary",
            scale=Quantity.SPEED,
        ),
        Output(
            "unsplit_steps",
            "steps with more crossings than they were split at",
            dtype="int32",
            fill_value=None,
        ),
    ),
)
CONTACT_PART = Part(
    "with the contact of elements, for each element",
    (
        Output("time_driving_@", "share of the recorded time on the driving flank, @"),
        Output("time_back_@", "share of the recorded time on the back flank, @"),
        Output("time_apart_@", "share of the recorded time without contact, @"),
        Output("impacts_driving_@", "impacts on the driving flank per mesh period, @"),
        Output("impacts_back_@", "impacts on the back flank per mesh period, @"),
        Output("approach_mean_@", "mean speed of approach at an impact, @", scale=Quantity.SPEED),
        Output(
            "approach_largest_@", "largest speed of approach at an impact, @", scale=Quantity.SPEED
        ),
        Output("contact_state_@", "kind of @ contact", dtype="uint8", fill_value=None),
    ),
    repeated_for=(Kind.ELEMENT,),
)
EXTREMES_PART = Part(
    "for each state whose extremes are kept",
    (
        Output("@_smallest", "smallest @", scale=None),
        Output("@_largest", "largest @", scale=None),
        Output("@_peak_to_peak", "peak to peak @", scale=None),
    ),
    repeated_for=(Kind.STATE,),
)
ORDERS_PART = Part(
    "with amplitudes",
    (Output(names.ORDER, "frequency over mesh frequency", dims=(names.ORDER,), fill_value=None),),
)
AMPLITUDES_PART = Part(
    "with amplitudes, for each state whose extremes are kept and each signal",
    (
        Output(
            f"{names.AMPLITUDE}@",
            "amplitude of the @",
            "@",
            dims=(LANE_AXES, names.ORDER),
            scale=None,
        ),
    ),
    repeated_for=(Kind.STATE, Kind.SIGNAL),
)
CONTROL_PART = Part(
    "with control",
    (
        Output(
            "capture",
            "whether the controller keeps the lane on its orbit in the end",
            dtype="uint8",
            fill_value=None,
        ),
        Output("effort_largest", "largest change of the input, as a share of the steady input"),
        Output(
            "effort_mean",
            "mean size of the change of the input since control began, as a share of the steady "
            "input",
        ),
        Output(
            "effort_recorded",
            "mean size of the change of the input in the recorded periods, as a share of the "
            "steady input",
        ),
    ),
)


def _absolute_efforts(unit: str, what: str, scale: Quantity) -> tuple[Output, ...]:
    """Return the efforts in the unit of the input; ``unit``: end of their names."""
    changes = f"mean size of the change of the {what}"
    return (
        Output(f"effort_largest_{unit}", f"largest change of the {what}", scale=scale),
        Output(f"effort_mean_{unit}", f"{changes} since control began", scale=scale),
        Output(f"effort_recorded_{unit}", f"{changes} in the recorded periods", scale=scale),
    )


CONTROL_TORQUE_PART = Part(
    "with control of a known torque", _absolute_efforts("Nm", "torque", Quantity.TORQUE)
)
CONTROL_FORCE_PART = Part(
    "with control of a force", _absolute_efforts("force", "force", Quantity.FORCE)
)
CHECK_PART = Part(
    "with an error check",
    (
        Output(
            "section_error",
            "error of the section of a periodic lane in its last period, by the step and by what "
            "the transient has left",
        ),
        Output(
            names.STEP_ERROR,
            "error of the largest Lyapunov exponent by the step",
            scale=Quantity.GROWTH_RATE,
        ),
        Output(
            "motion_changed",
            "whether the lane settles on a different motion when the step is halved",
            dtype="uint8",
            fill_value=None,
        ),
    ),
)
EVERY_SWEEP_PART = Part(
    "always",
    (
        Output(names.STATUS, "status of the lane", dtype="uint8", fill_value=None),
        Output(
            "diverged_period",
            "mesh period in which the lane diverged, -1 where it did not",
            dtype="int32",
            fill_value=-1,
        ),
        numbers(names.STATE, "number of the state variable, which its meaning names"),
        Output("start_state", "state at the start of the lane", dims=(LANE_AXES, names.STATE)),
        Output("end_state", "state at the end of the lane", dims=(LANE_AXES, names.STATE)),
    ),
    required=True,
)
TIME_PART = Part(
    "in a response",
    (
        Output(
            names.TIME,
            "time in mesh periods",
            r"$\Omega\tau/2\pi$",
            dims=(names.TIME,),
            fill_value=None,
        ),
        Output(
            names.MESH_PERIOD,
            "mesh period",
            r"$2\pi/\Omega$",
            fill_value=None,
            scale=Quantity.TIME,
        ),
    ),
    in_time=True,
)
MOTION_IN_TIME_PART = Part(
    "in a response, for each state and each acceleration",
    (Output("@", "@", "@", dims=(LANE_AXES, names.TIME), scale=None),),
    repeated_for=(Kind.STATE, Kind.ACCELERATION),
    in_time=True,
)
CONTACT_IN_TIME_PART = Part(
    "in a response, for each element",
    (
        Output(
            "contact_@",
            "contact, @",
            dims=(LANE_AXES, names.TIME),
            dtype="uint8",
            fill_value=NO_CONTACT,
            meanings=CONTACTS,
        ),
    ),
    repeated_for=(Kind.ELEMENT,),
    in_time=True,
)

PARTS = (
    REALISATION_AXIS,
    START_AXIS,
    DIRECTION_AXIS,
    HARMONICS_PART,
    SECTION_POINTS_PART,
    SECTION_PART,
    LYAPUNOV_PART,
    MOTION_PART,
    RECORD_PART,
    EXPONENTS_PART,
    DIMENSION_PART,
    CROSSINGS_PART,
    CONTACT_PART,
    EXTREMES_PART,
    ORDERS_PART,
    AMPLITUDES_PART,
    CONTROL_PART,
    CONTROL_TORQUE_PART,
    CONTROL_FORCE_PART,
    CHECK_PART,
    EVERY_SWEEP_PART,
    TIME_PART,
    MOTION_IN_TIME_PART,
    CONTACT_IN_TIME_PART,
)
"""All generic parts in the order of a file."""

UNSWEPT_AXES = {
    part.outputs[0].name: part for part in (REALISATION_AXIS, START_AXIS, DIRECTION_AXIS)
}
"""Parts of the axes along which no parameter is swept, by the name of the axis."""
