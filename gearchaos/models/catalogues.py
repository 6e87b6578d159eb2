"""The catalogues of models whose outputs have the same names in every result, for result files."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from gearchaos.models.gear_pair.outputs import CATALOGUE as GEAR_PAIR
from gearchaos.outputs.entries import Subject
from gearchaos.outputs.scales import PURE, Scale

CATALOGUES = (GEAR_PAIR,)
SCALED = "gear_pair"
"""The kind of model whose results are dimensionless; a result that names no kind is of this one."""


def scale_of(name: str, metadata: Mapping[str, Any]) -> Scale:
    """Return the scale of an output or a parameter by its name, that of pure numbers if unknown.

    ``metadata``: that of the result, which names the kind of its model.
    """
    if metadata.get("model", SCALED) != SCALED:
        return PURE
    scales = (catalogue.scale_of(name) for catalogue in CATALOGUES)
    return next((scale for scale in scales if scale != PURE), PURE)


def subject_of(name: str) -> Subject:
    """Return the state of a model by its name; an unknown one is called by its name."""
    found = (catalogue.subject(name) for catalogue in CATALOGUES)
    return next((one for one in found if one is not None), Subject(name, name.replace("_", " ")))


def due(axes: Sequence[str], found: Collection[str]) -> Iterator[tuple[str, tuple[str, ...], str]]:
    """Give name, dimensions and type of all that a file with these variables must hold."""
    for catalogue in CATALOGUES:
        yield from catalogue.due(axes, found)
