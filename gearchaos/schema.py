"""Print the JSON Schema of a configuration file, which editors use to complete and check its keys.

With --keys, print Markdown tables of all keys instead.
"""

from typing import Annotated, NamedTuple

from gearchaos.command_line import Command
from gearchaos.options import Option


class SchemaOptions(NamedTuple):
    """Options of ``gearchaos schema``."""

    keys: Annotated[bool, Option("print Markdown tables of all keys")] = False


def _schema(options: SchemaOptions) -> None:
    import json

    from gearchaos.configuration.schema import json_schema, key_tables
    from gearchaos.models import GearPairConfiguration

    kind = GearPairConfiguration
    print(key_tables(kind) if options.keys else json.dumps(json_schema(kind), indent=2))


main = Command("schema", __doc__, SchemaOptions, _schema, writes=False).start(__name__)
