"""HTML of the parts of a report: every text is escaped, and nothing is loaded from elsewhere."""

import math
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from gearchaos.figures.page import Page, picture
from gearchaos.results.files.result_reader import printable
from gearchaos.version import software_version

DPI = 150  # Resolution of dots and maps within a figure, doubled for zooming in.
NARROW_MM = 100.0  # Wider figures take the width of the page.
_TEMPLATE = Path(__file__).with_name("template.html")


def document(title: str, sections: Mapping[str, Sequence[str]]) -> str:
    """Return the whole page: a title, links to the sections, and the sections with any parts."""
    there = {name: parts for name, parts in sections.items() if parts}
    links = (f'<a href="#{anchor(name)}">{escape(name)}</a>' for name in there)
    content = [f"<nav>{' '.join(links)}</nav>"]
    for name, parts in there.items():
        content.append(f'<section id="{anchor(name)}"><h2>{escape(name)}</h2>')
        content += [*parts, "</section>"]
    page = Template(_TEMPLATE.read_text(encoding="utf-8"))
    software = f"gearchaos {software_version()}"
    return page.substitute(title=text(title), software=escape(software), content="\n".join(content))


def anchor(name: str) -> str:
    """Return the anchor of a section."""
    return name.lower().replace(" ", "-")


def text(content: object) -> str:
    """Escape a text; characters without a picture become visible."""
    return escape(printable(str(content)))


def paragraph(content: object) -> str:
    """Return a paragraph."""
    return f"<p>{text(content)}</p>"


def picture_of(figure: Page, caption: str) -> str:
    """Return a figure with its caption; letters are outlines, since fonts are those of a reader."""
    drawn = picture(figure, "svg", DPI, {"svg.fonttype": "path"})
    source = f"data:image/svg+xml;base64,{b64encode(drawn).decode()}"
    narrow = ' class="narrow"' if 25.4 * figure.get_size_inches()[0] < NARROW_MM else ""
    image = f'<img src="{source}" alt="{text(caption)}">'
    return f"<figure{narrow}>{image}<figcaption>{text(caption)}</figcaption></figure>"


def table(caption: str, headings: Iterable[str], rows: Iterable[Sequence[Any]]) -> str:
    """Return a table; the unit of a pure number, ``[1]``, is left out of its heading."""
    content = [*rows]
    numeric = [
        all(isinstance(one, int | float) for one in column) for column in zip(*content, strict=True)
    ]
    marks = [' class="number"' if one else "" for one in numeric]
    head = _row("th", marks, (text(one.removesuffix(" [1]")) for one in headings))
    body = "\n".join(_row("td", marks, map(_cell, row)) for row in content)
    return (
        f'<div class="table"><table><caption>{text(caption)}</caption>'
        f"<thead>{head}</thead>\n<tbody>{body}</tbody></table></div>"
    )


def _row(tag: str, marks: Sequence[str], cells: Iterable[str]) -> str:
    """Return a row of a table; ``marks``: attributes of the cells of each column."""
    pairs = zip(marks, cells, strict=True)
    return f"<tr>{''.join(f'<{tag}{mark}>{cell}</{tag}>' for mark, cell in pairs)}</tr>"


def _cell(value: Any) -> str:
    if isinstance(value, int | float):
        return "" if math.isnan(value) else f"{value:.6g}"
    return text(value)


def definitions(entries: Mapping[str, str]) -> str:
    """Return a list of words and what they mean."""
    items = (f"<dt>{text(word)}</dt><dd>{text(meaning)}</dd>" for word, meaning in entries.items())
    return f"<dl>{''.join(items)}</dl>"
