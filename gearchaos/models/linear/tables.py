"""The tables of a configuration that describe a machine by its matrices."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag

from gearchaos.configuration.keys import AS_LIST, Table, key
from gearchaos.models.stiffness_table import StiffnessTable

Name: TypeAlias = Annotated[str, Field(pattern="^[A-Za-z][A-Za-z0-9_]*$", max_length=64)]
Row: TypeAlias = dict[Name, float]
Matrix: TypeAlias = (
    Annotated[tuple[float, ...], AS_LIST]
    | Annotated[tuple[Annotated[tuple[float, ...], AS_LIST], ...], AS_LIST]
    | str
)
"""The diagonal of a matrix, all of its rows, or the name of a CSV file with the rows."""

MATRICES = ("mass", "stiffness", "damping")
"""Keys of the matrices of a machine."""

MOST_ORDER = 1000


class Shares(Table):
    """Damping in proportion to the mass matrix and to the stiffness matrix."""

    mass: float = key("factor of the mass matrix", default=0.0, ge=0)
    stiffness: float = key("factor of the stiffness matrix", default=0.0, ge=0)


class Fourier(Table):
    """A stiffness as a sum of waves of the mesh phase."""

    shape: Literal["fourier"] = key("form in which the stiffness is given", default="fourier")
    mean: float = key("mean value", ge=0)
    cosine: Annotated[tuple[float, ...], AS_LIST] = key(
        "amplitudes of the cosines of order 1, 2 and so on", default=(), max_length=200
    )
    sine: Annotated[tuple[float, ...], AS_LIST] = key(
        "amplitudes of the sines of order 1, 2 and so on", default=(), max_length=200
    )


def _form_of(given: Any) -> str:
    """Return in which form a stiffness is given."""
    if not isinstance(given, Mapping | Fourier | StiffnessTable):
        return "number"
    shape = given.get("shape", "fourier") if isinstance(given, Mapping) else given.shape
    return shape if shape in ("fourier", "table") else ""


Stiffness: TypeAlias = Annotated[
    Annotated[float, Field(ge=0), Tag("number")]
    | Annotated[Fourier, Tag("fourier")]
    | Annotated[StiffnessTable, Tag("table")],
    Discriminator(
        _form_of,
        custom_error_type="value_error",
        custom_error_context={"error": 'shape must be "fourier" or "table"; choose one of them'},
    ),
]
"""A constant, a sum of waves, or a table over the period."""


class Clearance(Table):
    """A clearance element: a spring behind a clearance, and a damper."""

    gap: Row = key(
        "the gap as a sum of coordinates, each with its factor",
        example={"x1": 1.0, "x2": -1.0},
        min_length=1,
    )
    reaction: Row | None = key(default=None)
    """factor of the force in the equation of each coordinate; by default those of the gap, as for
    any real spring"""
    stiffness: Stiffness = key("stiffness", example=100.0)
    damping: float = key("damping coefficient", default=0.0, ge=0)
    damping_acts: Literal["always", "in_contact"] = key(default="always")
    """whether the damper acts all the time, or only while the element is in contact"""
    half_clearance: float = key("half clearance", default=0.0, ge=0)
    one_sided: bool = key(default=False)
    """whether the element pushes only where the gap exceeds half_clearance; it has no back flank"""
    motion: Fourier | None = key(default=None)
    """a prescribed motion that reduces the gap, such as a pitch error"""

    @property
    def waves(self) -> Fourier:
        """The stiffness as a sum of waves."""
        given = self.stiffness
        if isinstance(given, StiffnessTable):
            series = given.series
            return Fourier.model_construct(mean=series.mean, cosine=series.cosine, sine=series.sine)
        if isinstance(given, Fourier):
            return given
        # A swept value is checked with its sweep.
        return Fourier.model_construct(mean=given, cosine=(), sine=())


class Force(Table):
    """A force that acts on the machine: a mean and a wave."""

    on: Row = key(
        "factor of the force in the equation of each coordinate", example={"x2": 1.0}, min_length=1
    )
    mean: float = key("constant part", default=0.0)
    amplitude: float = key("amplitude of the wave", default=0.0)
    order: int = key("order of the wave", default=1, ge=1, le=MOST_ORDER)
    phase_deg: float = key("phase of the wave", units="deg", default=0.0)
    times_frequency_squared: bool = key(default=False)
    """whether the amplitude is multiplied by the square of the frequency of order 1, as that of an
    error of the gears or of an imbalance that turns once a period is"""


def _named(given: Any) -> Any:
    """Return a list of tables with names as a table of tables."""
    if not isinstance(given, list):
        return given
    named: dict[str, Any] = {}
    for number, one in enumerate(given):
        if not isinstance(one, dict) or not isinstance(one.get("name"), str):
            raise ValueError(f'entry {number + 1} has no name; add one such as name = "stop"')
        if one["name"] in named:
            raise ValueError(f'"{one["name"]}" is the name of two entries; rename one of them')
        named[one["name"]] = {key: value for key, value in one.items() if key != "name"}
    return named


NAMED = BeforeValidator(_named)
"""``[[clearance]]`` with a key ``name`` is the same as ``[clearance.NAME]``."""


def _one_number_each(given: tuple[str, ...]) -> tuple[str, ...]:
    twice = sorted({name for name in given if given.count(name) > 1})
    if twice:
        raise ValueError(f"{', '.join(twice)}: is listed twice; give every coordinate its own name")
    return given


class MachineTable(Table):
    """A machine by its matrices: M x'' + C x' + K x = forces."""

    kind: Literal["linear"] = key("which model the file describes", default="linear")
    coordinates: Annotated[tuple[Name, ...], AS_LIST, AfterValidator(_one_number_each)] = key(
        "names of the coordinates", example=["x1", "x2"], min_length=1, max_length=64
    )
    mass: Matrix = key(
        "mass matrix: its diagonal, its rows, or a CSV file with the rows", example=[1.0, 1.0]
    )
    stiffness: Matrix = key(
        "stiffness matrix without the clearance elements, in one of the same forms",
        example=[[1.0, -1.0], [-1.0, 2.0]],
    )
    damping: Matrix | Shares = key(default=Shares())
    """damping matrix in one of the same forms, or its shares of the mass and stiffness matrices"""
    frequency: float = key("frequency", default=1.0, gt=0)


ClearanceTables: TypeAlias = Annotated[dict[Name, Clearance], NAMED]
ForceTables: TypeAlias = Annotated[dict[Name, Force], NAMED]


def wave_of(force: Force, frequency: float) -> tuple[float, float, float]:
    """Return mean, cosine and sine part of a force."""
    factor = frequency**2 if force.times_frequency_squared else 1.0
    phase = math.radians(force.phase_deg)
    size = factor * force.amplitude
    return force.mean, size * math.cos(phase), -size * math.sin(phase)
