"""Show the contents of a result file: the computed variables, the parameters, the accuracy, and the
software and machine that computed it.

The command reads nothing but the file. With --verify it also reads every array and compares it with
its checksum.
"""

import json
import sys
from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple

from gearchaos.command_line import Command
from gearchaos.options import Option, ResultFile


class InfoOptions(NamedTuple):
    """Options of ``gearchaos info``."""

    result: ResultFile
    verify: Annotated[bool, Option("read all data and check every checksum")] = False
    json: Annotated[bool, Option("print JSON")] = False


def _info(options: InfoOptions) -> None:
    # Imported here: --help and --version answer at once, and an interrupt is caught.
    from gearchaos.progress import notice
    from gearchaos.results.files.result_reader import verify
    from gearchaos.results.reading.overview import overview, overview_page

    verified: list[str] = []
    if options.verify:
        with notice(f"reading all of {options.result}"):
            verified = verify(options.result)
    summary = overview(options.result)
    if options.json:
        text = json.dumps({**summary, "verified": verified}, indent=1)
    else:
        text = overview_page(summary, _settings(summary["metadata"]), verified)
    # A title with characters that the terminal lacks must not become a traceback.
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    print(text.encode(encoding, "replace").decode(encoding))


def _settings(metadata: Mapping[str, Any]) -> list[str]:
    """Return a line for each key of the configuration, with the origin of an unwritten value."""
    from gearchaos.configuration.messages import shown
    from gearchaos.configuration.toml_text import flat_tables, tables_from_toml
    from gearchaos.errors import ConfigurationError
    from gearchaos.models import Configuration

    text = str(metadata.get("configuration", ""))
    resolved = str(metadata.get("configuration_resolved", ""))
    try:
        alone = Configuration.from_toml(text, "configuration").resolved_toml()
        written, by_itself, ran = (
            flat_tables(tables_from_toml(toml, "configuration")) for toml in (text, alone, resolved)
        )
    except ConfigurationError:  # The numbers are readable without a valid configuration.
        return []
    origins = {key: "" if key in written else " (by default)" for key in ran}
    origins |= {key: " (set for this run)" for key in ran if by_itself.get(key) != ran[key]}
    return [f"{key} = {shown(value)}{origins[key]}" for key, value in ran.items()]


main = Command("info", __doc__, InfoOptions, _info, writes=False).start(__name__)
