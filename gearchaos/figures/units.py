"""Explanations of the scales that axis labels name as units, at the foot of a page."""

import re

from matplotlib.figure import Figure
from matplotlib.text import Text

from gearchaos.models.gear_pair.derivation import FREQUENCY, LENGTH, SCALES, STIFFNESS

_SYMBOLS = {SCALES[name][2].strip("$"): SCALES[name][1] for name in (LENGTH, FREQUENCY, STIFFNESS)}
_OF_TIME = SCALES[FREQUENCY][2].strip("$")
EXPLAINED = {**_SYMBOLS, r"\tau": rf"${_OF_TIME} t$"}
"""Meaning of each symbol of a unit."""


def explained_units(figure: Figure) -> str:
    """Explain the scales in the units of a page, such as ``unit $b'$``; empty without any."""
    texts = [str(one.get_text()) for one in figure.findobj(Text)]
    units = " ".join(text[text.rfind("(") :] for text in texts if "(unit $" in text)
    units += " ".join(text for text in texts if r"per unit of $\tau$" in text)
    # A value with its unit, such as in a title.
    units += " ".join(" ".join(re.findall(r"= [-+.\de]+ (\$[^$]+\$)", text)) for text in texts)
    found = [symbol for symbol in EXPLAINED if symbol in units]
    if r"\tau" in found and _OF_TIME not in found:
        found.insert(0, _OF_TIME)
    return ", ".join(f"${symbol}$: {EXPLAINED[symbol]}" for symbol in found)
