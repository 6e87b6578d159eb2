"""The whole configuration of a sweep, checked."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cache
from typing import Any, Literal, Self

from pydantic import PrivateAttr, TypeAdapter, ValidationError, ValidationInfo, model_validator

from gearchaos.configuration.files import with_deviation_files
from gearchaos.configuration.keys import Key, Table, key, keys_of
from gearchaos.configuration.lane_rules import lane_faults
from gearchaos.configuration.messages import MOST_SHOWN, Fault, fault_of, texts
from gearchaos.configuration.physical_tables import (
    PHYSICAL_KEYS,
    PHYSICAL_TABLES,
    Bearings,
    GradeError,
    Mesh,
    Operation,
    Pair,
    PitchError,
)
from gearchaos.configuration.rules import RULES
from gearchaos.configuration.run_tables import (
    GivenGroups,
    Integration,
    Outputs,
    Scene,
    Start,
    Sweep,
    states_of,
)
from gearchaos.configuration.sweep_rules import unknown_parameter
from gearchaos.configuration.sweep_values import SWEEPABLE_GROUPS
from gearchaos.configuration.toml_text import (
    flat_tables,
    tables_from_toml,
    toml_text,
    with_overrides,
    with_value,
)
from gearchaos.errors import ConfigurationError
from gearchaos.gear.tooth_deviations import REALISATION


class Configuration(Table):
    """A gear pair, the effects that exist, the sweeps, and what is kept of them.

    A Configuration that exists is sound: every rule has been checked, also those between tables.
    It cannot be changed; `replace` gives a changed copy.
    """

    title: str = key("title of the sweep, for figures and files", default="")
    formulation: Literal["physical", "published"] = key(
        'gaps as the equations of motion give them, or as Pan 2021 prints them ("published")',
        default="physical",
    )
    pair: Pair | None = key("catalogue data of the two gears", default=None)
    operation: Operation | None = key("the point of operation", default=None)
    mesh: Mesh | None = key("stiffness, damping and clearance of the mesh", default=None)
    pitch_error: PitchError | None = key("the pitch error", default=None)
    bearings: Bearings | None = key("the bearings", default=None)
    groups: GivenGroups = key("dimensionless groups given directly", default=GivenGroups())
    scene: Scene = key("which effects exist")
    start: Start = key("the state in which the lanes start", default=Start())
    sweep: Sweep = key("the swept parameter and its values")
    second_sweep: Sweep | None = key(
        "a second swept parameter: every value of it with every one of [sweep]", default=None
    )
    integration: Integration = key("the fixed grid of the integration", default=Integration())
    outputs: Outputs = key("what is kept of every lane", default=Outputs())
    files: dict[str, str] | None = key(
        "files that are named above, word for word, as a result keeps them", default=None
    )

    _source: str = PrivateAttr(default="<python>")
    _text: str | None = PrivateAttr(default=None)

    @property
    def source(self) -> str:
        """Path of the file, or a word in angle brackets for what came from no file."""
        return self._source

    @property
    def text(self) -> str:
        """The TOML text verbatim, before overrides; `resolved_toml` where there was none.

        Files that it names are appended as ``[files]``, so that it stands alone.
        """
        return self.resolved_toml() if self._text is None else self._text

    @property
    def sweeps(self) -> dict[str, Sweep]:
        """The sweeps that are there by the name of their table."""
        tables = {name: self.__dict__.get(name) for name in ("sweep", "second_sweep")}
        return {name: sweep for name, sweep in tables.items() if sweep is not None}

    @property
    def needed_effects(self) -> tuple[str, ...]:
        """The effects of the scene that act on what is kept.

        The axial pair is driven one way: without an axial state in the section and without the
        exponent of the whole system, nothing that is kept depends on it.
        """
        without_axial = states_of({"transverse"})
        if self.outputs.lyapunov or not set(self.outputs.section).issubset(without_axial):
            return self.scene.effects
        return tuple(effect for effect in self.scene.effects if effect != "axial")

    @classmethod
    def from_toml(
        cls, text: str, source: str = "<text>", overrides: Iterable[str] = ()
    ) -> Configuration:
        """Make a configuration from TOML text, which messages call ``source``.

        ``overrides`` are those of `load_config`. Raises ConfigurationError with one message per
        fault, all faults at once.
        """
        tables = with_overrides(tables_from_toml(text, source), overrides, source)
        config = cls.from_tables(tables, source)
        appended = config.files is not None and "files" not in tables
        config._text = text + (toml_text({"files": config.files}) if appended else "")
        return config

    @classmethod
    def from_tables(cls, tables: Mapping[str, Any], source: str = "<python>") -> Configuration:
        """Make a configuration from nested mappings with the keys of the TOML file.

        Raises ConfigurationError with one message per fault, all faults at once.
        """
        tables, faults = with_deviation_files(tables, source)
        if faults:
            raise ConfigurationError(texts(faults, source))
        try:
            config = cls.model_validate(dict(tables), context={"source": source})
        except ValidationError as error:
            found = error.errors(include_url=False)
            # A long list of nonsense can hold a million faults.
            own = [fault_of(one, tables, configuration_keys()) for one in found[:MOST_SHOWN]]
            unreadable = {str(one["loc"][0]) for one in found}
            shared = _broken_rules(_readable(tables, unreadable), unreadable)
            more = len(found) - len(own)
            raise ConfigurationError(texts([*own, *shared], source, more)) from None
        config._source = source
        return config

    def replace(self, path: str, value: Any) -> Configuration:
        """Return a copy in which one key, or table, at its dotted path has another value.

        A value of a table is a mapping; None removes the key. Raises ConfigurationError if the
        changed configuration breaks a rule.
        """
        try:
            tables = with_value(self.tables(), path.split("."), value)
        except KeyError as error:
            raise ConfigurationError(f"{self.source}: {error.args[0]} is not a table") from None
        return type(self).from_tables(tables, self.source)

    def at(self, values: Mapping[str, float]) -> Configuration:
        """Return a copy in which parameters, by name, are fixed at values in their units.

        Where [sweep] swept one, that becomes a sweep of this one value; where [second_sweep] did,
        that goes. ``realisation`` is the number of a drawn gear pair, then the only one. Raises
        ConfigurationError if a parameter cannot be swept, or if a rule is broken.
        """
        drawn = isinstance(self.pitch_error, GradeError)
        names = [name for name in values if not (drawn and name == REALISATION)]
        unknown = [fault for name in names for fault in unknown_parameter("parameter", name)]
        if unknown:
            raise ConfigurationError(texts(unknown, self.source))
        tables = self.tables()
        for parameter, value in values.items():
            if parameter == REALISATION:
                number = int(value) if float(value).is_integer() else value
                tables["pitch_error"] |= {"first_realisation": number, "realisations": 1}
                continue
            path = f"groups.{parameter}" if parameter in SWEEPABLE_GROUPS else parameter
            tables = with_value(tables, path.split("."), float(value))
            if parameter == self.sweep.parameter:
                tables["sweep"] = {"parameter": parameter, "values": [float(value)]}
            elif self.second_sweep is not None and parameter == self.second_sweep.parameter:
                del tables["second_sweep"]
        return type(self).from_tables(tables, self.source)

    def physical(self) -> dict[str, Any]:
        """Return every key of the physical tables by its path, with its value or None."""
        known = self.model_dump(include=set(PHYSICAL_TABLES), exclude_none=True)
        return dict.fromkeys(PHYSICAL_KEYS) | flat_tables(known)

    def tables(self) -> dict[str, Any]:
        """Return the nested mappings of everything that is known, defaults included."""
        return self.model_dump(exclude_none=True)

    def resolved_toml(self) -> str:
        """Return TOML with every default filled in; it loads to an equal configuration."""
        return toml_text(self.tables())

    @model_validator(mode="after")
    def _obeys_the_rules(self, info: ValidationInfo) -> Self:
        faults = list(_broken_rules(self, set()))
        if faults:
            raise ConfigurationError(texts(faults, (info.context or {}).get("source", "<python>")))
        return self

    # Where a configuration came from does not make it another one.
    def __eq__(self, other: object) -> bool:
        return isinstance(other, Configuration) and self.__dict__ == other.__dict__

    __hash__ = None  # type: ignore[assignment]


@cache
def configuration_keys() -> dict[str, Key]:
    """Every key of a configuration by its dotted path."""
    every = [(one.path, one) for one in keys_of(Configuration)]
    # Of a key that several kinds of a table have, the first counts: that of the default.
    return dict(every) | dict(reversed(every))


def _broken_rules(config: Configuration, unreadable: Collection[str]) -> Iterator[Fault]:
    suspect = set(unreadable)
    for tables, broken in RULES:
        if tables.isdisjoint(unreadable):
            for fault in broken(config):
                suspect.add(fault.key.partition(".")[0])
                yield fault
    if suspect.isdisjoint({"sweep", "second_sweep", "scene", "groups", *PHYSICAL_TABLES}):
        yield from lane_faults(config)


def _readable(tables: Mapping[str, Any], unreadable: Collection[str]) -> Configuration:
    """Make a configuration of the tables without a fault of their own, unchecked."""
    readable = {}
    for name, field in Configuration.model_fields.items():
        if name in tables and name not in unreadable:
            annotation: Any = field.annotation
            readable[name] = TypeAdapter(annotation).validate_python(tables[name])
    return Configuration.model_construct(**readable)
