"""The report as one HTML file that needs no other: the pictures are in it."""

from __future__ import annotations

import base64
import re
from pathlib import Path

from markdown import markdown

STYLE = """\
body { font: 11pt/1.45 Georgia, "Times New Roman", serif; color: #111; background: #fff;
  max-width: 52em; margin: 2em auto; padding: 0 1.2em; }
h1, h2, h3 { font-family: Arial, Helvetica, sans-serif; line-height: 1.2; break-after: avoid; }
h2 { margin-top: 2em; border-bottom: 1px solid #999; }
table { border-collapse: collapse; margin: 1em 0; font-size: 9.5pt; width: 100%; }
th, td { border-bottom: 1px solid #ccc; padding: 0.25em 0.6em; text-align: left;
  vertical-align: top; }
th { border-bottom: 1px solid #111; }
tr { break-inside: avoid; }
img { display: block; width: 85mm; max-width: 100%; margin: 0.5em 0; break-inside: avoid; }
code { font-size: 90%; }
@media print { body { max-width: none; margin: 0; font-size: 10pt; } }
"""


def html(text: str, folder: Path, title: str) -> str:
    """Turn a report into HTML.

    Parameters
    ----------
    text : str
        Markdown with pictures by their names.
    folder : Path
        Where the pictures lie.
    title : str

    Returns
    -------
    str
    """

    def embedded(found: re.Match[str]) -> str:
        picture = base64.b64encode((folder / found[1]).read_bytes()).decode("ascii")
        return f'src="data:image/png;base64,{picture}"'

    body = markdown(text, extensions=["tables"], output_format="html")
    body = re.sub(r'src="([^":]+\.png)"', embedded, body)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )
