"""What Pan 2021 prints, read from `published.toml`, which says what each entry is."""

import tomllib
from functools import cache
from importlib.resources import files
from types import SimpleNamespace


class Printed(SimpleNamespace):
    """A table of `published.toml`, with its keys as attributes."""


@cache
def published() -> Printed:
    """Read all that the paper prints; ``numbers`` has its tables by their names."""
    text = files("gearchaos.paper").joinpath("published.toml").read_text(encoding="utf-8")
    tables = tomllib.loads(text)
    tables["numbers"] = {key: Printed(**row) for key, row in tables["numbers"].items()}
    for name in ("contact_lines", "harmonics", "increments", "boundaries"):
        tables[name] = Printed(**tables[name])
    for name in ("stages", "motions"):
        # What the paper calls as this project does is written once.
        rows = ({"printed": row["motion"], **row} for row in tables[name])
        tables[name] = [Printed(**row) for row in rows]
    return Printed(**tables)
