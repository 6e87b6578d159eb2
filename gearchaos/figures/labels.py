"""Axis labels from what the result file says about its variables."""

import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from functools import cache

from matplotlib.mathtext import MathTextParser

from gearchaos.errors import FigureError
from gearchaos.figures.style import DRAWING
from gearchaos.outputs.names import DIRECTION, REALISATION, START, coordinate_text
from gearchaos.outputs.variable import Variable
from gearchaos.results.reading.excitation import excitation_of
from gearchaos.results.reading.result import Result


def axis_label(result: Result, name: str, line_length: int = 60) -> str:
    """Compose the label of a variable: its long name, symbol and unit, broken into lines.

    For example ``Largest Lyapunov exponent, $\\lambda_1$ (per unit of $\\tau$)``; of a pure number
    there is no unit. Lines are broken after ``line_length`` characters.
    """
    variable = result.variables[name]
    wording = " ".join((variable.long_name or name).split())
    symbol, unit = _formula(variable.symbol), unit_of(result, name)
    words = [plain(word) for word in (wording[:1].upper() + wording[1:]).split(" ")]
    # The symbol stays on the line of the last word.
    if symbol:
        words[-1] += f", {symbol}"
    if unit:
        words.append(f"({unit})")
    # No shorter last line than need be: of those that are as few the narrowest.
    fewest = min((_broken(words, length) for length in range(1, line_length + 1)), key=len)
    return "\n".join(fewest)


def unit_of(result: Result, name: str) -> str:
    """Word the unit of a variable, or what its numbers are multiples of; "" of a pure number."""
    variable = _known(result)[name]
    if variable.units in ("", "1"):
        return variable.scale.stands_for
    words = plain(re.sub(r"\bum\b", "\N{MICRO SIGN}m", variable.units))
    return re.sub(r"\^(-?\d)", r"$^{\1}$", words)


def place_of(result: Result, lane: int) -> dict[str, float]:
    """Return the value of a lane along each axis of its result, and of those it was fixed at."""
    return {**result.fixed, **{axis: result.along(axis)[lane] for axis in result.axes}}


def form_in_words(result: Result) -> str:
    """Name the form of the gaps where it is not the physical one, for the foot of a page."""
    published = result.metadata.get("formulation") == "published"
    return "gaps as printed in Pan 2021 (eqs 6 and 7), not the physical ones" if published else ""


def legend_title(result: Result) -> str | None:
    """Name the form of the gaps and the unit of periods where they need it, above a legend."""
    words = (form_in_words(result), excitation_of(result.metadata).in_words)
    return "\n".join(filter(None, words)) or None


def in_words(result: Result, place: Mapping[str, float]) -> str:
    """Word a place on the axes of a result, such as ``$P$ = 5.86, start 0``."""
    texts = []
    for axis, value in place.items():
        known = _known(result).get(axis)
        wording = (known and known.long_name) or axis.replace("_", " ")
        name = (known and _formula(known.symbol)) or plain(wording)
        unit = f" {unit_of(result, axis).removeprefix('unit ')}".rstrip() if known else ""
        words = {START: f"start {value:g}", REALISATION: f"gear pair {value:g}"}
        words[DIRECTION] = coordinate_text(axis, value)
        texts.append(words.get(axis, f"{name} = {value:.6g}{unit}"))
    return ", ".join(texts)


def in_a_name(place: Mapping[str, float], digits: int = 12) -> str:
    """Word a place for the name of a file: ``_pitch_error_5.86_start_0``."""
    return "".join(f"_{axis}_{coordinate_text(axis, at, digits)}" for axis, at in place.items())


def check_variable(variable: str, there: Sequence[str], where: str) -> None:
    """Raise a FigureError unless there is such a variable, which says what there is instead."""
    if variable not in there:
        hint = "".join(f"; did you mean {one}?" for one in get_close_matches(variable, there, 1))
        rule = f"no variable {variable!r} {where} in the result"
        raise FigureError(f"{rule}; it has {', '.join(there) or 'none'}{hint}")


def short(value: float, digits: int = 4, sign: str = "-") -> str:
    """Write a number in a few digits, with a true minus sign."""
    # Adding zero makes plus zero of minus zero.
    return f"{value + 0.0:{sign}.{digits}g}".replace("-", "\N{MINUS SIGN}")


def plain(text: str) -> str:
    """Return a text in which a dollar sign is a dollar sign, not the start of a formula."""
    return text.replace("$", r"\$")


def _known(result: Result) -> Mapping[str, Variable]:
    """Return all that a result tells of, also what it was fixed at."""
    return result.parameters | result.fixed_axes | result.variables


def _broken(words: list[str], line_length: int) -> list[str]:
    lines = [words[0]]
    for word in words[1:]:
        # Of a formula, however long its source, little is to be seen.
        if len(re.sub(r"\$[^$]*\$", "xx", f"{lines[-1]} {word}")) <= line_length:
            lines[-1] += " " + word
        else:
            lines.append(word)
    return lines


@cache
def _formula(text: str) -> str:
    """Return a symbol that is no formula as plain text."""
    # A file may come from anywhere; a formula that matplotlib cannot read would fail at drawing.
    try:
        with DRAWING:
            MathTextParser("path").parse(text)
    except ValueError:
        return plain(text)
    return text if text.count("$") % 2 == 0 else plain(text)
