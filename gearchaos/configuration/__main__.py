"""``python -m gearchaos.configuration``: the JSON Schema, or with --keys the table of keys."""

from __future__ import annotations

import argparse
import json
import sys

from gearchaos.command_line import OK, run_command, version_text
from gearchaos.configuration.schema import json_schema, key_tables


def main(arguments: list[str] | None = None) -> int:
    """Print the description of the configuration file to stdout."""
    parser = argparse.ArgumentParser(
        prog="gearchaos configuration",
        description="Print the JSON Schema of a configuration file, for completion in editors.",
    )
    parser.add_argument("--keys", action="store_true", help="print Markdown tables of all keys")
    parser.add_argument("--version", action="version", version=version_text())
    options = parser.parse_args(arguments)

    def body() -> int:
        print(key_tables() if options.keys else json.dumps(json_schema(), indent=2))
        return OK

    return run_command("gearchaos configuration", body, writes=False)


if __name__ == "__main__":
    sys.exit(main())
