"""List the ready configurations, or copy one of them into the current folder."""

import tomllib
from argparse import Namespace

from gearchaos.command_line import SWEEPS, Command
from gearchaos.errors import ConfigurationError


def _example(options: Namespace) -> None:
    from gearchaos.results.files.atomic_file import check_output, replacing

    ready = {path.stem: path for path in sorted(SWEEPS.glob("*.toml"))}
    if options.name is None:
        for name, path in ready.items():
            print(f"{name:24} {tomllib.loads(path.read_text(encoding='utf-8'))['title']}")
        return
    if (source := ready.get(options.name.removesuffix(".toml"))) is None:
        raise ConfigurationError(f"{options.name}: is no example; there are {', '.join(ready)}")
    # Measured deviations lie beside the configuration that names them.
    files = [source, *source.parent.glob(f"{source.stem}.csv")]
    for file in files:
        check_output(file.name, overwrite=options.overwrite)
    for file in files:
        with replacing(file.name, overwrite=options.overwrite) as partial:
            partial.write_bytes(file.read_bytes())
        print(file.name, flush=True)


main = Command("example", __doc__, _example).start(__name__)
