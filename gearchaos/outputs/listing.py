"""The catalogue of one model: which variables a result has, and what a file must hold."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gearchaos.arrays import Floats
from gearchaos.outputs.catalogue import MOTION_IN_TIME_PART, PARTS, UNSWEPT_AXES
from gearchaos.outputs.entries import NO_SUBJECT, SUBJECT, Kind, Output, Part, Subject
from gearchaos.outputs.names import TIME, UNSWEPT, acceleration_of, rate_of
from gearchaos.outputs.scales import PURE, Quantity, Scale
from gearchaos.outputs.variable import Variable

_NOTHING: Mapping[str, Any] = MappingProxyType({})


class Details(NamedTuple):
    """Details of outputs that are known before a run, by their names in the catalogue.

    ``values``: arrays of coordinates. ``meanings``: of the values 0, 1, ... of enumerations.
    ``wordings``: texts that replace `SUBJECT` in the long name of an output without one.
    """

    values: Mapping[str, ArrayLike] = _NOTHING
    meanings: Mapping[str, Sequence[str]] = _NOTHING
    wordings: Mapping[str, str] = _NOTHING


_UNKNOWN = Details()
_NO_ENTRY = "has no entry in the catalogue of outputs; correct the name or add an entry"


@dataclass(frozen=True, eq=False, kw_only=True)
class Catalogue:
    """Every output that results of one model may have, in the order of a file.

    Attributes
    ----------
    parts : tuple of Part
        Generic parts and those of the model.
    subjects : mapping of Kind to tuple of Subject
        The states, accelerations, elements and signals of the model.
    scales : mapping of Quantity to Scale
        Scales that turn results into physical units; quantities without one stay as they are.
    parameters : mapping of str to Quantity
        Quantities of the parameters of the model that are no pure numbers, by name.
    units : mapping of Quantity to str
        Units of quantities that the model computes in physical units; all others are pure numbers.
    long_names : mapping of str to str
        Wordings in place of generic ones, by the name of the output.
    terms : mapping of str to str
        Terms of the model in place of those of gears, which generic wordings use.

    Raises
    ------
    ValueError
        If two outputs have the same name, if an output names an error that is no output, or if
        a wording is for no output.

    Examples
    --------
    >>> from gearchaos.outputs import catalogue
    >>> from gearchaos.outputs.entries import Kind, motion_subjects
    >>> x, x_rate, x_acceleration = motion_subjects("x", "x", "{} of the mass")
    >>> oscillator = Catalogue(
    ...     parts=catalogue.PARTS,
    ...     subjects={Kind.STATE: (x, x_rate), Kind.ACCELERATION: (x_acceleration,)},
    ... )
    >>> axes = [oscillator.axis("start", [0, 1])]
    >>> listed = oscillator.variables(axes, {catalogue.MOTION_IN_TIME_PART: ["x"]})
    >>> [(variable.name, variable.long_name) for variable in listed[1:]]
    [('x', 'displacement of the mass')]
    """

    parts: tuple[Part, ...]
    subjects: Mapping[Kind, tuple[Subject, ...]]
    scales: Mapping[Quantity, Scale] = field(default_factory=dict)
    parameters: Mapping[str, Quantity] = field(default_factory=dict)
    units: Mapping[Quantity, str] = field(default_factory=dict)
    long_names: Mapping[str, str] = field(default_factory=dict)
    terms: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        names = [output.name_for(one) for _, output, one in self._all()]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"{', '.join(twice)}: is the name of two outputs of the catalogue")
        errors = {error for output in self._outputs.values() for error in output.errors}
        if unknown := sorted({*errors, *self.long_names} - self._outputs.keys()):
            raise ValueError(f"{', '.join(unknown)}: {_NO_ENTRY}")

    def axis(self, name: str, numbers: ArrayLike) -> Variable:
        """Return an axis along which no parameter is swept.

        Parameters
        ----------
        name : str
            ``"realisation"``, ``"start"`` or ``"direction"``.
        numbers : array of int, shape (values,)
            Its values, ascending.
        """
        return self.variables((), {UNSWEPT_AXES[name]: True}, Details({name: numbers}))[0]

    def variables(
        self,
        axes: Sequence[Variable],
        parts: Mapping[Part, bool | Sequence[str]],
        details: Details = _UNKNOWN,
    ) -> list[Variable]:
        """List the variables of a result, axes first, the others in the order of the catalogue.

        Parameters
        ----------
        axes : sequence of Variable
            The axes of the result.
        parts : mapping of Part to bool or sequence of str
            The parts that the result has. A part that is repeated has the names of its subjects.
        details : Details
            Values, meanings and wordings that are known beforehand. Those of outputs that the
            result does not have are ignored.

        Raises
        ------
        ValueError
            If the catalogue lacks a part, a subject, or an output that ``details`` names; or if an
            output lacks its wording.
        """
        self._require_known(parts, details)
        lane, listed = tuple(axis.name for axis in axes), list(axes)
        for part in self.parts:
            for subject in self._chosen(part, parts.get(part, False)):
                listed += [self._variable(one, subject, lane, details) for one in part.outputs]
        there = {one.name for one in listed}
        return [replace(v, errors=tuple(e for e in v.errors if e in there)) for v in listed]

    def motion(
        self,
        axes: Sequence[Variable],
        instants: Floats,
        states: Sequence[str],
        elements: Sequence[str],
    ) -> list[Variable]:
        """List the variables that a response adds to those of a sweep, in the order of the file.

        Parameters
        ----------
        axes : sequence of Variable
            The axes of the sweep.
        instants : array, shape (instants,)
            Times in mesh periods.
        states, elements : sequence of str
            States and elements of the scene. Each displacement is followed by its rate.
        """
        in_time = [part for part in self.parts if part.in_time]
        parts = for_each(in_time, elements)
        parts[MOTION_IN_TIME_PART] = [
            name for one in states[::2] for name in (one, rate_of(one), acceleration_of(one))
        ]
        return self.variables(axes, parts, Details({TIME: instants}))[len(axes) :]

    def due(
        self, axes: Sequence[str], found: Collection[str]
    ) -> Iterator[tuple[str, tuple[str, ...], str]]:
        """Give name, dimensions and type of all that a file with these variables must hold.

        These are the axes, the parts that every sweep has, and all outputs of a part whose first
        one is there.
        """
        for axis in axes:
            yield axis, (axis,), "int32" if axis in UNSWEPT else "float64"
        for part in self.parts:
            for subject in self._possible(part) if not part.in_time else ():
                if part.required or part.outputs[0].name_for(subject) in found:
                    for output in part.outputs:
                        yield output.name_for(subject), output.dims_over(axes), output.dtype

    def scale_of(self, name: str) -> Scale:
        """Return the scale of an output or a parameter, that of pure numbers if it is unknown."""
        return self.scales.get(self._quantities.get(name, Quantity.NONE), PURE)

    def subject(self, name: str) -> Subject | None:
        """Return the state, acceleration, element or signal of this name; None if there is none."""
        every = (subject for subjects in self.subjects.values() for subject in subjects)
        return next((subject for subject in every if subject.name == name), None)

    def worded(self, text: str) -> str:
        """Return a text with the terms of the model in place of those of gears."""
        for term, other in self.terms.items():
            text = text.replace(term, other)
        return text

    @cached_property
    def _outputs(self) -> dict[str, Output]:
        return {output.name: output for part in self.parts for output in part.outputs}

    @cached_property
    def _quantities(self) -> dict[str, Quantity]:
        """Quantity of each output and each parameter, by the name in a file."""
        return {
            **{output.name_for(one): _quantity(output, one) for _, output, one in self._all()},
            **self.parameters,
        }

    def _all(self) -> Iterator[tuple[Part, Output, Subject]]:
        """Give every output that is possible, with its part and its subject."""
        for part in self.parts:
            for subject in self._possible(part):
                for output in part.outputs:
                    yield part, output, subject

    def _possible(self, part: Part) -> Sequence[Subject]:
        """Return all subjects of a part; one without a name if the part is not repeated."""
        if not part.repeated_for:
            return [NO_SUBJECT]
        return [one for kind in part.repeated_for for one in self.subjects.get(kind, ())]

    def _chosen(self, part: Part, chosen: bool | Sequence[str]) -> Sequence[Subject]:
        """Return the subjects of a part in the order of their names; ValueError if unknown."""
        if not part.repeated_for:
            return [NO_SUBJECT] if chosen else []
        by_name = {one.name: one for one in self._possible(part)}
        names = chosen if not isinstance(chosen, bool) else ()
        if chosen is True or (unknown := sorted({*names} - by_name.keys())):
            kinds = " or ".join(kind.name.lower() for kind in part.repeated_for)
            what = "True" if chosen is True else ", ".join(unknown)
            raise ValueError(
                f"{part.outputs[0].name}: {what} is not the name of a known {kinds}; there are "
                f"{', '.join(by_name) or 'none'}"
            )
        return [by_name[name] for name in names]

    def _require_known(self, parts: Collection[Part], details: Details) -> None:
        """Raise ValueError if the catalogue lacks a part or an output that somebody names."""
        unknown = sorted(part.outputs[0].name for part in {*parts} - {*self.parts})
        for named in details:
            unknown += sorted(named.keys() - self._outputs.keys())
        if unknown:
            raise ValueError(f"{', '.join(unknown)}: {_NO_ENTRY}")

    def _variable(
        self, output: Output, subject: Subject, axes: Sequence[str], details: Details
    ) -> Variable:
        """Return the variable of an output for a subject, in a result with these axes."""
        values = details.values.get(output.name)
        meanings = details.meanings.get(output.name, output.meanings)
        wording = subject.long_name or details.wordings.get(output.name, "")
        long_name = self.long_names.get(output.name, output.long_name)
        if SUBJECT in long_name and not wording:
            raise ValueError(f"{output.name}: lacks the wording that completes {long_name!r}")
        number = np.dtype(output.dtype).type
        return Variable(
            name=output.name_for(subject),
            dims=output.dims_over(axes),
            dtype=output.dtype,
            units=self.units.get(_quantity(output, subject), "1"),
            long_name=self.worded(long_name).replace(SUBJECT, self.worded(wording)),
            symbol=output.symbol.replace(SUBJECT, subject.symbol),
            fill_value=None if output.fill_value is None else number(output.fill_value),
            flags=tuple("_".join(self.worded(one).split()) for one in meanings),
            errors=output.errors,
            values=None if values is None else np.asarray(values, dtype=output.dtype),
            scale=self.scales.get(_quantity(output, subject), PURE),
        )


def for_each(parts: Iterable[Part], elements: Sequence[str]) -> dict[Part, bool | Sequence[str]]:
    """Return parts as `Catalogue.variables` takes them: repeated parts are for these elements."""
    return {part: elements if part.repeated_for else True for part in parts}


def _quantity(output: Output, subject: Subject) -> Quantity:
    return subject.scale if output.scale is None else output.scale


GENERIC = Catalogue(parts=PARTS, subjects={})
"""The outputs that are the same for all models."""
