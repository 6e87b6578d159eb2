"""List the ready-made configurations, or copy one of them into the current folder.

A configuration with measured deviations is copied with its CSV file. The names of the copies go to
stdout.
"""

import tomllib
from typing import Annotated, NamedTuple

from gearchaos.command_line import SWEEPS, Command
from gearchaos.errors import ConfigurationError
from gearchaos.options import Option, Overwrite


class ExampleOptions(NamedTuple):
    """Options of ``gearchaos example``."""

    name: Annotated[
        str | None,
        Option("configuration to copy, such as pan2021 (default: list all)", positional=True),
    ] = None
    overwrite: Overwrite = False


def _example(options: ExampleOptions) -> None:
    from gearchaos.results.files.atomic_file import check_output, replacing

    ready = {path.stem: path for path in sorted(SWEEPS.glob("*.toml"))}
    if options.name is None:
        for name, path in ready.items():
            print(f"{name:24} {tomllib.loads(path.read_text(encoding='utf-8'))['title']}")
        return
    if (source := ready.get(options.name.removesuffix(".toml"))) is None:
        raise ConfigurationError(f"{options.name}: is no example; there are {', '.join(ready)}")
    # Measured deviations are in a table next to the configuration that names them.
    files = [source, *source.parent.glob(f"{source.stem}.csv")]
    for file in files:
        check_output(file.name, overwrite=options.overwrite)
    for file in files:
        with replacing(file.name, overwrite=options.overwrite) as partial:
            partial.write_bytes(file.read_bytes())
        print(file.name, flush=True)


main = Command("example", __doc__, ExampleOptions, _example).start(__name__)
