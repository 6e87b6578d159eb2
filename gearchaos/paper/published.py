"""The numbers printed in Pan 2021, read from `published.toml`, which describes each entry."""

import json
import tomllib
from functools import cache
from importlib.resources import files
from types import SimpleNamespace
from typing import TypeAlias

import numpy as np

from gearchaos.arrays import Complex
from gearchaos.models.gear_pair.contact_lines import TrapezoidalStiffness

Printed: TypeAlias = SimpleNamespace
"""A table of `published.toml`, with its keys as attributes."""


@cache
def published() -> Printed:
    """Read all printed numbers."""
    text = files("gearchaos.paper").joinpath("published.toml").read_text(encoding="utf-8")
    tables = json.dumps(tomllib.loads(text))
    read: Printed = json.loads(tables, object_hook=lambda table: Printed(**table))
    return read


def contact_line_stiffness() -> TrapezoidalStiffness:
    """Return the mesh stiffness from the paper's lengths of contact lines (eqs 15 to 18)."""
    lines = published().contact_lines
    # Half of the variation relative to its mean, with equal rise and fall.
    half_height = (lines.longest - lines.shortest) / (lines.longest + lines.shortest)
    return TrapezoidalStiffness(**vars(lines.parts), half_height=half_height)


def printed_coefficients() -> Complex:
    """Return the coefficients of Table 2 relative to the mean stiffness, as `series_table` does."""
    mean, harmonics = published().numbers.mean_stiffness.value, published().harmonics
    cosine, sine = (np.divide(wave, mean) for wave in (harmonics.cosine, harmonics.sine))
    series: Complex = cosine - 1j * sine
    return series
