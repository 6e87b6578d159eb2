"""Labels of figures as plain Unicode."""

import re
from unicodedata import lookup

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_LETTERS = "0123456789aehijklmnoprstuvxy"
# Unicode has no subscript y: that of gamma has the same shape.
_LOWERED = str.maketrans(
    _LETTERS, "₀₁₂₃₄₅₆₇₈₉ₐₑₕᵢⱼₖₗₘₙₒₚᵣₛₜᵤᵥₓ\N{GREEK SUBSCRIPT SMALL LETTER GAMMA}"
)


def plain_text(label: str) -> str:
    """Write a label in Unicode without formulae, such as δ₅' for ``$\\delta_5'$``."""
    text = re.sub(r"\\mathrm\{([^}]*)\}", lambda found: found[1].replace("\\ ", " "), label)
    text = re.sub(r"\\([A-Za-z]+)", lambda found: _letter(found[1]), text)
    text = re.sub(r"\^\{?(-?\d+)\}?", lambda found: found[1].translate(_RAISED), text)
    text = re.sub(r"_\{([^}]*)\}|_([\da-z])", lambda found: _index(found[1] or found[2]), text)
    return re.sub(r"[${}\\]", "", text)


def _index(text: str) -> str:
    """Return an index as subscript letters, in brackets if Unicode lacks one of them."""
    return text.translate(_LOWERED) if set(text) <= set(_LETTERS) else f" ({text})"


def _letter(name: str) -> str:
    case = "CAPITAL" if name[0].isupper() else "SMALL"
    try:
        return lookup(f"GREEK {case} LETTER {name.replace('lambda', 'lamda')}")
    except KeyError:
        return "\N{PRIME}" if name == "prime" else name
