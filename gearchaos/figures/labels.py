"""Labels and texts of figures, from the metadata of a result."""

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

CLOSE = 0.8
"""Least similarity of a name to one that may have been meant."""

SWITCHED_OFF = (
    "others have to be switched on in [outputs] of the configuration, such as loads = true, before "
    "a run"
)


def axis_label(result: Result, name: str, line_length: int = 60) -> str:
    """Compose the label of a variable: its long name, symbol and unit, broken into lines.

    Parameters
    ----------
    result : Result
        The result that has the variable.
    name : str
        Name of the variable.
    line_length : int
        Most characters of a line; a formula counts as two.

    Returns
    -------
    str
        Such as ``Largest Lyapunov exponent, $\\lambda_1$ (per unit of $\\tau$)``. Pure numbers have
        no unit.
    """
    return label_of(result.variables[name], line_length)


def label_of(variable: Variable, line_length: int = 60) -> str:
    """Compose the label of a variable as `axis_label` does, from its description alone."""
    wording = " ".join((variable.long_name or variable.name).split())
    symbol, unit = _formula(variable.symbol), _unit(variable)
    words = [plain(word) for word in (wording[:1].upper() + wording[1:]).split(" ")]
    # The symbol stays on the line of the last word. A name in upright letters says nothing new.
    if symbol and not _names(variable.symbol, wording):
        words[-1] += f", {symbol}"
    if unit:
        words.append(f"({unit})")
    # The narrowest of all layouts with the fewest lines: its lines have similar lengths.
    fewest = min((_broken(words, length) for length in range(1, line_length + 1)), key=len)
    return "\n".join(fewest)


def symbol_of(variable: Variable) -> str:
    """Compose the symbol of a variable and its unit, for small axes."""
    symbol, unit = _formula(variable.symbol), _unit(variable)
    return f"{symbol} ({unit})" if unit else symbol


def _names(symbol: str, wording: str) -> bool:
    """Whether a symbol is a name in upright letters that the wording contains."""
    name = re.fullmatch(r"\$\\mathrm\{(.+)\}\$", symbol)
    return name is not None and name[1].replace(r"\ ", " ") in wording


def unit_of(result: Result, name: str) -> str:
    """Word the unit or the scale of a variable; the empty string for a pure number."""
    return _unit(_known(result)[name])


def _unit(variable: Variable) -> str:
    """Word the unit or the scale of a variable from its description."""
    if variable.units in ("", "1"):
        return variable.scale.stands_for
    words = plain(re.sub(r"\bum\b", "\N{MICRO SIGN}m", variable.units))
    return re.sub(r"\^(-?\d)", r"$^{\1}$", words)


def place_of(result: Result, lane: int) -> dict[str, float]:
    """Return the coordinates of a lane: along each axis, and along axes fixed by selection."""
    return {**result.fixed, **{axis: result.along(axis)[lane] for axis in result.axes}}


def form_in_words(result: Result) -> str:
    """Name the formulation of the gaps if it is not the physical one, for the foot of a page."""
    published = result.metadata.get("formulation") == "published"
    return "gaps as printed in Pan 2021 (eqs 6 and 7), not the physical ones" if published else ""


def legend_title(result: Result) -> str | None:
    """Name the formulation of the gaps and the unit of periods if they differ from the default."""
    words = (form_in_words(result), excitation_of(result.metadata).in_words)
    return "\n".join(filter(None, words)) or None


def in_words(result: Result, place: Mapping[str, float]) -> str:
    """Word coordinates on the axes of a result, such as ``$P$ = 5.86, start 0``."""
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
    """Word coordinates for the name of a file: ``_pitch_error_5.86_start_0``."""
    return "".join(f"_{axis}_{coordinate_text(axis, at, digits)}" for axis, at in place.items())


def check_variable(variable: str, there: Sequence[str], where: str) -> None:
    """Raise FigureError unless the variable is in ``there``; the message lists the others."""
    if variable not in there:
        near = get_close_matches(variable, there, 1, cutoff=CLOSE)
        hint = "".join(f"did you mean {one}?" for one in near) or SWITCHED_OFF
        rule = f"no variable {variable!r} {where} in the result"
        raise FigureError(f"{rule}; it has {', '.join(there) or 'none'}; {hint}")


def short(value: float, digits: int = 4, sign: str = "-") -> str:
    """Write a number with a few significant digits and a true minus sign."""
    # Adding zero turns minus zero into zero.
    return f"{value + 0.0:{sign}.{digits}g}".replace("-", "\N{MINUS SIGN}")


def plain(text: str) -> str:
    """Escape dollar signs, which would begin a formula."""
    return text.replace("$", r"\$")


def _known(result: Result) -> Mapping[str, Variable]:
    """Return all described quantities of a result, including axes fixed by selection."""
    return result.parameters | result.fixed_axes | result.variables


def _broken(words: list[str], line_length: int) -> list[str]:
    lines = [words[0]]
    for word in words[1:]:
        # A formula is short on paper, however long its source.
        if len(re.sub(r"\$[^$]*\$", "xx", f"{lines[-1]} {word}")) <= line_length:
            lines[-1] += " " + word
        else:
            lines.append(word)
    return lines


@cache
def _formula(text: str) -> str:
    """Return a symbol, with dollar signs escaped if matplotlib cannot parse it as a formula."""
    # Files may come from anywhere, and an invalid formula would raise an error while drawing.
    try:
        with DRAWING:
            MathTextParser("path").parse(text)
    except ValueError:
        return plain(text)
    return text if text.count("$") % 2 == 0 else plain(text)
