"""Comments, docstrings and messages of the package, and the manual, use plain words."""

import io
import json
import re
import tokenize
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

import pytest

CLONE = Path(__file__).resolve().parents[2]
SOURCES = [
    path
    for folder in ("gearchaos", "kernels", "docs", "benchmarks", "sweeps", "tests", ".ci")
    for path in sorted((CLONE / folder).rglob("*"))
    if path.suffix in (".py", ".md", ".ipynb", ".toml") and path != Path(__file__).resolve()
]
SOURCES += [CLONE / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]

PLAIN = {
    r"\btells?\b|\btold\b": "reports, prints, returns, warns",
    r"\bforetells?\b|\bforetold\b": "predicts",
    r"\bso many\b": "n",
    r"^What\b": "name the thing",
    r"\bin another way\b": "differently, on a different motion",
    r"\bbut for\b": "except for, up to",
    r"\bnobody\b": "name the part that does not",
    r"\basks? for\b|\basked for\b": "requests, sets",
    r"\bof which\b": "whose, or a second sentence",
    # "the branch on which it begins" is plain.
    r"(?<!\bon )(?<!\bin )(?<!\bat )(?<!\bfrom )(?<!\bwith )(?<!\bto )\bwhich it\b": "name it",
    r"\bwhatever\b": "any, also with",
    r"\bgo(es)? on\b": "continues",
    r"\bstands? (in|beside|for)\b": "is stored in, is next to, denotes",
    r"\bcomes? to\b": "converges to, becomes",
}
"""Patterns of roundabout words, each with plain ones in its place."""


def texts(path: Path) -> Iterator[str]:
    """Yield every text for readers in a file: comments joined to sentences, and strings."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        text = " ".join("".join(one["source"]) for one in cells if one["cell_type"] == "markdown")
    if path.suffix != ".py":
        yield " ".join(text.split())
        return
    tokens = list(tokenize.generate_tokens(io.StringIO(text).readline))
    comments = [one for one in tokens if one.type == tokenize.COMMENT]
    for _, block in groupby(enumerate(comments), lambda one: one[1].start[0] - one[0]):
        yield " ".join(one.string.lstrip("# ") for _, one in block)
    strings = (tokenize.STRING, getattr(tokenize, "FSTRING_MIDDLE", tokenize.STRING))
    ignored = (tokenize.NL, tokenize.COMMENT, getattr(tokenize, "FSTRING_START", tokenize.NL))
    ignored += (getattr(tokenize, "FSTRING_END", tokenize.NL),)
    joined = [one for one in tokens if one.type not in ignored]
    # Adjacent strings are one text.
    for is_text, run in groupby(joined, lambda one: one.type in strings):
        if is_text:
            yield " ".join("".join(re.sub(r'^[rbf]*"+|"+$', "", one.string) for one in run).split())


def roundabout(text: str) -> list[str]:
    """Return every roundabout phrase of a text with its replacement; questions may begin so."""
    return [
        f"...{text[max(0, found.start() - 40) : found.end() + 30]}...: {plain}"
        for pattern, plain in PLAIN.items()
        for found in re.finditer(pattern, text, re.IGNORECASE)
        if not (pattern.startswith("^") and "?" in text)
    ]


def test_the_words_of_the_package_are_plain():
    found = {
        f"{path.relative_to(CLONE)}: {phrase}"
        for path in SOURCES
        for text in texts(path)
        for phrase in roundabout(text)
    }
    assert len(SOURCES) > 500
    assert found == set()


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("It tells what comes to rest.", 2),
        ("A sweep of which is told", 2),
        ("The branch on which it begins.", 0),
        ("Names whichever, foretelling nothing: intelligible", 0),
        ("Steps stand for nobody.", 2),
    ],
)
def test_roundabout_words_are_found(text, count):
    assert len(roundabout(text)) == count


def test_texts_are_joined_across_lines(tmp_path):
    path = tmp_path / "one.py"
    path.write_text(
        '# it so\n# many\nx = f"as {1} tells " "it stands "\\\n    "for"\n"""So\nmany."""\n'
    )
    found = [one for text in texts(path) for one in roundabout(text)]
    assert len(found) == 4
