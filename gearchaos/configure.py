"""Print the JSON Schema of a configuration file, for completion in editors."""

from argparse import ArgumentParser, Namespace

from gearchaos.command_line import OK, Command


def _arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--keys", action="store_true", help="print Markdown tables of all keys")


def _describe(options: Namespace) -> int:
    import json

    from gearchaos.configuration.schema import json_schema, key_tables

    print(key_tables() if options.keys else json.dumps(json_schema(), indent=2))
    return OK


main = Command("configuration", __doc__, _arguments, _describe, writes=False)
main.start(__name__)
