"""Axis labels from what the result file says about its variables."""

from __future__ import annotations

from matplotlib.mathtext import MathTextParser

from gearchaos.results.result import Result

DIMENSIONLESS = ("", "1")


def axis_label(result: Result, name: str, line_length: int = 60) -> str:
    """Compose the label of a variable: its long name, symbol and unit, broken into lines.

    Parameters
    ----------
    result : Result
    name : str
        A variable of the result.
    line_length : int
        Characters after which a line is broken.

    Returns
    -------
    str
        For example ``Largest Lyapunov exponent, $\\lambda_1$``; a dimensionless quantity
        gets no unit.
    """
    attributes = result.attributes(name)
    wording = " ".join(str(attributes.get("long_name", "") or name).split())
    symbol = str(attributes.get("symbol", ""))
    units = str(attributes.get("units", ""))
    # The symbol stays on the line of the last word.
    words = [plain(word) for word in (wording[:1].upper() + wording[1:]).split(" ")]
    if symbol:
        words[-1] += ", " + (symbol if _is_mathtext(symbol) else plain(symbol))
    if units not in DIMENSIONLESS:
        words[-1] += f" ({plain(units)})"
    lines = _broken(words, line_length)
    # No shorter last line than need be: the narrowest lines that are as few.
    for shorter in range(line_length, 0, -1):
        narrower = _broken(words, shorter)
        if len(narrower) > len(lines):
            break
        lines = narrower
    return "\n".join(lines)


def number(value: float) -> str:
    """Write a number for a legend, in three digits and with a true minus sign."""
    return f"{value:.3g}".replace("-", "\N{MINUS SIGN}")


def plain(text: str) -> str:
    """Return a text in which a dollar sign is a dollar sign, not the start of a formula."""
    return text.replace("$", r"\$")


def _broken(words: list[str], line_length: int) -> list[str]:
    lines = [words[0]]
    for word in words[1:]:
        # Of a formula, however long its source, little is to be seen.
        if len(lines[-1]) + 1 + len(word.split("$")[0]) <= line_length:
            lines[-1] += " " + word
        else:
            lines.append(word)
    return lines


def _is_mathtext(symbol: str) -> bool:
    # A file may come from anywhere; a formula that matplotlib cannot read would fail at drawing.
    try:
        MathTextParser("path").parse(symbol)
    except ValueError:
        return False
    return symbol.count("$") % 2 == 0
