"""Print the JSON Schema of a configuration file, for completion in editors, or all of its keys."""

from argparse import Namespace

from gearchaos.command_line import Command


def _describe(options: Namespace) -> None:
    import json

    from gearchaos.configuration.schema import json_schema, key_tables
    from gearchaos.models import GearPairConfiguration

    kind = GearPairConfiguration
    print(key_tables(kind) if options.keys else json.dumps(json_schema(kind), indent=2))


main = Command("schema", __doc__, _describe).start(__name__)
