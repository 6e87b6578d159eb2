"""Show the contents of a result file: the computed variables, the parameters, the accuracy, and the
software and machine that computed it.

The command reads nothing but the file. With --verify it also reads every array and compares it with
its checksum.
"""

import json
import sys
from typing import Annotated, NamedTuple

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
    from gearchaos.results.reading.settings import settings_of

    verified: list[str] = []
    if options.verify:
        with notice(f"reading all of {options.result}"):
            verified = verify(options.result)
    summary = overview(options.result)
    if options.json:
        text = json.dumps({**summary, "verified": verified}, indent=1)
    else:
        settings = [
            f"{one.key} = {one.value}{one.origin and f' ({one.origin})'}"
            for one in settings_of(summary["metadata"])
        ]
        text = overview_page(summary, settings, verified)
    # A title with characters that the terminal lacks must not become a traceback.
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    print(text.encode(encoding, "replace").decode(encoding))


main = Command("info", __doc__, InfoOptions, _info, writes=False).start(__name__)
