"""Pages of the manual that are made when the site is built, and the links out.

A hook of MkDocs. The pages of the commands, the keys, the outputs, the public names and the changes
are made from the program, those of the tutorials from notebooks. A link from a page to a file of
the clone that is no page is shown as its path, and equations become MathML.
"""

import importlib
import inspect
import os
import re
from collections.abc import Iterator
from pathlib import Path

CLONE = Path(__file__).resolve().parents[2]
SUBJECTS = {"STATE": "STATE", "ACCELERATION": "COORDINATE_acceleration"}
SUBJECTS |= {"ELEMENT": "ELEMENT", "SIGNAL": "SIGNAL"}
"""Placeholders of a name in an output that exists once for each state, and so on."""


def command_page() -> str:
    """Return the page of all commands: their help texts, and the exit codes."""
    from gearchaos.command_line import EXIT_CODES
    from gearchaos.command_list import COMMANDS

    os.environ["COLUMNS"] = "100"
    parts = ["# All commands", "Made from the program. [Commands](../commands.md) is an overview."]
    for name, summary in COMMANDS.items():
        text = importlib.import_module(f"gearchaos.{name}").main.parser().format_help()
        text = text.partition(EXIT_CODES.partition("\n")[0])[0].rstrip()
        parts += [f"## {name}", f"{summary[0].upper()}{summary[1:]}.", f"```text\n{text}\n```"]
    _, _, codes = EXIT_CODES.partition("\n\n")
    parts += ["## Exit codes", f"```text\n{codes}\n```"]
    return "\n\n".join(parts) + "\n"


def key_page() -> str:
    """Return the page of all keys of a configuration, for each kind of model."""
    from gearchaos import models
    from gearchaos.configuration.schema import key_tables

    kinds = {
        "Gear pairs": models.GearPairConfiguration,
        'Machines: `kind = "linear"`': models.LinearConfiguration,
        'Trains: `kind = "train"`': models.TrainConfiguration,
    }
    parts = [
        "# All keys of a configuration",
        "Made from the program. [Configuration](../configuration.md) explains the tables. "
        "A key without default is optional unless it says required.",
    ]
    for title, kind in kinds.items():
        parts += [f"## {title}", key_tables(kind)]
    return "\n\n".join(parts)


def output_rows(catalogue) -> Iterator[str]:
    """Yield a row for every output of a model."""
    for part in catalogue.parts:
        subject = "/".join(SUBJECTS[kind.name] for kind in part.repeated_for)
        for output in part.outputs:
            name = output.name.replace("@", subject.replace("/COORDINATE_acceleration", ""))
            wording = catalogue.long_names.get(output.name, output.long_name)
            wording = wording.replace("@", subject.partition("/")[0] or "mesh periods")
            wording = catalogue.worded(wording)
            fill = "" if output.fill_value is None else f"`{output.fill_value}`"
            dims = ", ".join(output.dims)
            values = ", ".join(f"{number} {word}" for number, word in enumerate(output.meanings))
            meaning = f"{wording} ({values})" if values else wording
            yield f"| `{name}` | ({dims}) | {output.dtype} | {fill} | {meaning} | {part.when} |"


def code_table() -> str:
    """Return the table of the codes of all flags and their words."""
    from gearchaos.engine.kept import MEANINGS
    from gearchaos.outputs.catalogue import CONTACTS, NO_CONTACT

    rows = MEANINGS | {"contact_@": CONTACTS}
    lines = ["| variable | codes |", "|---|---|"]
    for name, words in rows.items():
        codes = [f"{code} `{'_'.join(word.split())}`" for code, word in enumerate(words)]
        codes += [f"{NO_CONTACT} no value"] if words is CONTACTS else []
        lines.append(f"| `{name.replace('@', 'ELEMENT')}` | {', '.join(codes)} |")
    return "\n".join(lines)


def output_page() -> str:
    """Return the page of all variables of a result."""
    import gearchaos
    from gearchaos.models.gear_pair.outputs import CATALOGUE
    from gearchaos.models.registry import model_of

    machine = model_of(gearchaos.load_config(CLONE / "sweeps" / "two_masses.toml"))
    head = (
        "| variable | dimensions | type | fill value | meaning | when |\n|---|---|---|---|---|---|"
    )
    parts = [
        "# All variables of a result",
        "Made from the program. [The result file](../file-format.md) explains the format. `lanes` "
        "are all axes of the result. `STATE`, `ELEMENT` and `SIGNAL` are replaced by names.",
        "## Gear pairs",
        "\n".join([head, *output_rows(CATALOGUE)]),
        "## Machines and trains",
        "\n".join([head, *output_rows(machine.catalogue)]),
        "## Codes of flags",
        "The attribute `flag_meanings` of a variable holds its words. "
        "[Labels](../numerics.md#labels) has the rules of `motion`.",
        code_table(),
    ]
    return "\n\n".join(parts) + "\n"


def python_page() -> str:
    """Return the page of all public names, with their docstrings."""
    import gearchaos_kernels

    import gearchaos
    from gearchaos import errors, figures, iso1328
    from gearchaos.outputs.variable import Variable

    of_system = [inspect.signature(one) for one in vars(gearchaos.System).values() if callable(one)]
    returned = [one.return_annotation for one in of_system]
    tables = gearchaos.Result.to_dataframe, gearchaos.Result.to_xarray
    homes = {
        "gearchaos": [getattr(gearchaos, name) for name in gearchaos.__all__],
        "Types that systems and results return": [*returned, Variable, *tables],
        "gearchaos.figures": vars(figures).values(),
        "gearchaos.iso1328": vars(iso1328).values(),
        "gearchaos.errors": vars(errors).values(),
        "gearchaos_kernels": vars(gearchaos_kernels).values(),
    }
    parts = ["# Public Python names", "[The Python interface](../api.md) shows how to use them."]
    shown: set[str] = set()
    for home, members in homes.items():
        parts.append(f"## {home}")
        for one in members:
            public = inspect.isclass(one) or inspect.isfunction(one)
            own = (getattr(one, "__module__", "") or "").startswith("gearchaos")
            if not (public and own) or one.__name__.startswith("_"):
                continue
            if home in ("gearchaos.iso1328", "gearchaos.errors") and one.__module__ != home:
                continue
            path = f"{one.__module__}.{one.__qualname__}"
            if path not in shown:
                parts.append(f"::: {path}\n    options:\n      heading_level: 3")
            shown.add(path)
    return "\n\n".join(parts) + "\n"


def change_page() -> str:
    """Return the changelog, with its links as seen from its place among the pages."""
    text = (CLONE / "CHANGELOG.md").read_text(encoding="utf-8")
    return re.sub(r"\]\((?!\w+:)(docs/)?", lambda at: "](../" if at[1] else "](../../", text)


def contributing_page() -> str:
    """Return the rules for contributors, with links as seen from their place among the pages."""
    text = (CLONE / "CONTRIBUTING.md").read_text(encoding="utf-8")
    return re.sub(r"\]\((?!\w+:|#)(docs/)?", lambda at: "](../" if at[1] else "](../../", text)


COPIES = {
    CLONE / "CONTRIBUTING.md": "reference/contributing.md",
    CLONE / "CHANGELOG.md": "reference/changes.md",
}
"""Pages of the site that show files beside the folder of the manual."""

PAGES = {
    "reference/commands.md": command_page,
    "reference/keys.md": key_page,
    "reference/outputs.md": output_page,
    "reference/python.md": python_page,
    "reference/changes.md": change_page,
    "reference/contributing.md": contributing_page,
}


def notebook_pages() -> Iterator[tuple[str, str | bytes]]:
    """Yield path and content of the page of every notebook, and of its pictures."""
    from nbconvert import MarkdownExporter
    from nbconvert.preprocessors import CoalesceStreamsPreprocessor

    exporter = MarkdownExporter(preprocessors=[CoalesceStreamsPreprocessor])
    for notebook in sorted((CLONE / "docs" / "tutorials").glob("*.ipynb")):
        unique = {"unique_key": notebook.stem}
        page, resources = exporter.from_filename(str(notebook), resources=unique)
        yield f"tutorials/{notebook.stem}.md", page
        yield from ((f"tutorials/{name}", data) for name, data in resources["outputs"].items())


def on_files(files, config):
    """Add the pages that are made from the program and from notebooks."""
    from mkdocs.structure.files import File

    made = ((path, page()) for path, page in PAGES.items())
    for path, content in (*made, *notebook_pages()):
        files.append(File.generated(config, path, content=content))
    return files


def on_page_markdown(markdown, page, config, files):
    """Link to the pages of notebooks; show links to files that are no pages as their paths."""
    markdown = re.sub(r"(\]\((?!\w+:)[^)\s#]+)\.ipynb\b", r"\1.md", markdown)
    folder = (Path(config.docs_dir) / page.file.src_uri).parent

    def shown(link):
        target = Path(os.path.normpath(folder / link[2].partition("#")[0]))
        if target in COPIES:
            place = os.path.relpath(COPIES[target], Path(page.file.src_uri).parent)
            return f"[{link[1]}]({place})"
        outside = not target.is_relative_to(config.docs_dir)
        return f"{link[1]} (`{target.relative_to(CLONE)}`)" if outside else link[0]

    return re.sub(r"(?<!!)\[([^\]\n]+)\]\((\.\./[^)\s]+)\)", shown, markdown)


def on_page_content(html, page, config, files):
    """Turn equations into MathML, which browsers draw without a script from the network."""
    from html import unescape

    from latex2mathml.converter import convert

    def drawn(equation):
        source = unescape(equation[2]).strip()
        primes = re.compile("'+")
        source = primes.sub(lambda at: "^{" + r"\prime" * len(at[0]) + "}", source)
        display = "block" if source.startswith("\\[") else "inline"
        tag = equation[1]
        return f'<{tag} class="equation">{convert(source[2:-2], display=display)}</{tag}>'

    pattern = r'<(span|div) class="arithmatex">(.*?)</\1>'
    return re.sub(pattern, drawn, html, flags=re.DOTALL)
