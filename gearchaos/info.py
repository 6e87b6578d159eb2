"""Show what a result file holds: what was computed, with which parameters, how accurately, and on
what. Only the file is read.

--verify reads all of the file and tries every checksum in it.
"""

import json
import sys
from argparse import Namespace
from collections.abc import Mapping
from typing import Any

from gearchaos.command_line import Command


def _info(options: Namespace) -> None:
    # Imported only now: --help and --version answer at once, and an interrupt is caught.
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
    # Where the terminal knows few characters, a title must not become a traceback.
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    print(text.encode(encoding, "replace").decode(encoding))


def _settings(metadata: Mapping[str, Any]) -> list[str]:
    """Word the keys of the configuration, and where those that were not written come from."""
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
    except ConfigurationError:  # Not ours to judge here: the numbers are there all the same.
        return []
    origins = {key: "" if key in written else " (by default)" for key in ran}
    origins |= {key: " (set for this run)" for key in ran if by_itself.get(key) != ran[key]}
    return [f"{key} = {shown(value)}{origins[key]}" for key, value in ran.items()]


main = Command("info", __doc__, _info).start(__name__)
