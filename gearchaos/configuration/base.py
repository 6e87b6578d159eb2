"""The whole configuration of a sweep, read and checked, for any model."""

import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any, ClassVar, Self, TypeAlias

from pydantic import PrivateAttr, TypeAdapter, ValidationError, ValidationInfo, model_validator

from gearchaos.arguments import path_text, texts
from gearchaos.configuration.keys import Key, keys_of
from gearchaos.configuration.messages import Fault, fault_texts, faults_of
from gearchaos.configuration.methods import METHODS
from gearchaos.configuration.plausible import implausible
from gearchaos.configuration.rules import GENERIC_RULES, Rule, unknown_parameter
from gearchaos.configuration.tables import OF_CONTROLLERS, Tables, of_the_machine
from gearchaos.configuration.toml_text import (
    tables_from_toml,
    text_of_file,
    toml_text,
    with_overrides,
    with_value,
)
from gearchaos.errors import ConfigurationError
from gearchaos.outputs.names import REALISATION

DEFAULT_KIND = "gear_pair"
"""Model of a configuration that names none."""


class Configuration(Tables):
    """A checked configuration: a machine, its effects, the sweeps, and the outputs.

    Every rule holds for a Configuration, also rules between tables. It is immutable; `replace`
    returns a changed copy. Each model derives a class with its own tables and rules. The class
    methods of this base class choose among them.

    Attributes
    ----------
    kind : str
        Name of the model.
    rules : sequence
        Rules between tables, each with the tables that must be free of faults before it is checked.

    Examples
    --------
    >>> config = gearchaos.load_config("sweeps/pan2021.toml")
    >>> config.replace("sweep.count", 31).sweep.count
    31
    """

    kind: ClassVar[str] = ""
    rules: ClassVar[Sequence[tuple[frozenset[str], Rule]]] = GENERIC_RULES
    kinds: ClassVar[dict[str, type["Configuration"]]] = {}

    _source: str = PrivateAttr(default="<python>")
    _text: str | None = PrivateAttr(default=None)
    _folder: str | None = PrivateAttr(default=None)

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Register the class of a model by its kind; a class without one is not complete."""
        if "kind" in cls.__dict__:
            Configuration.kinds[cls.kind] = cls

    @classmethod
    def with_files(
        cls, tables: Mapping[str, Any], folder: str | None
    ) -> tuple[Mapping[str, Any], list[Fault]]:
        """Return tables with the contents of the files that they name.

        Parameters
        ----------
        tables : mapping
            The tables by name.
        folder : str or None
            Folder of the files; without it the tables must contain them as ``files``.

        Returns
        -------
        tables : mapping
            The tables, with ``files`` where there are any.
        faults : list of Fault
            What is wrong with the files.

        Examples
        --------
        >>> gearchaos.Configuration.with_files({"title": "none named"}, None)
        ({'title': 'none named'}, [])
        """
        del folder
        return tables, []

    @property
    def source(self) -> str:
        """Path of the file, or a word in angle brackets without a file."""
        return self._source

    @property
    def text(self) -> str:
        """TOML text as given, before overrides; `resolved_toml` if there was no text.

        Contents of files that the text names are appended as ``[files]``, so that the text is
        complete.
        """
        return self.resolved_toml() if self._text is None else self._text

    @classmethod
    def from_toml(
        cls,
        text: str,
        source: str = "<text>",
        overrides: Iterable[str] = (),
        folder: str | None = None,
    ) -> Self:
        """Make a configuration from TOML text.

        Parameters
        ----------
        text : str
            The TOML text.
        source : str
            Name of the text in messages.
        overrides : iterable of str
            Overrides, see `load_config`.
        folder : str, optional
            Folder of the files that the text names. Without it, the text must contain them as
            ``[files]``.

        Returns
        -------
        Configuration
            The checked configuration.

        Raises
        ------
        ConfigurationError
            With one message per fault, all faults at once.

        Examples
        --------
        >>> text = config.text
        >>> gearchaos.Configuration.from_toml(text, overrides=["sweep.count=31"]).sweep.count
        31
        """
        tables = with_overrides(tables_from_toml(text, source), overrides, source)
        config = cls.from_tables(tables, source, folder)
        config._text = text
        if config.files is not None and "files" not in tables:
            config._text += f"\n[files]\n{toml_text(config.files)}"
        return config

    @classmethod
    def from_tables(
        cls, tables: Mapping[str, Any], source: str = "<python>", folder: str | None = None
    ) -> Self:
        """Make a configuration from nested mappings with the keys of the TOML file.

        Parameters
        ----------
        tables : mapping
            The tables by name.
        source : str
            Name of the tables in messages.
        folder : str, optional
            Folder of the files that the tables name. Without it, their text must be given as
            ``files``.

        Returns
        -------
        Configuration
            The checked configuration.

        Raises
        ------
        ConfigurationError
            With one message per fault, all faults at once.

        Examples
        --------
        >>> gearchaos.Configuration.from_tables(config.tables()) == config
        True
        """
        if cls is Configuration:
            chosen: Any = _kind_of(tables, source)
            return chosen.from_tables(tables, source, folder)  # type: ignore[no-any-return]
        tables, faults = cls.with_files(tables, folder)
        if faults:
            raise ConfigurationError(fault_texts(faults, source))
        try:
            config = cls.model_validate(dict(tables), context={"source": source})
        except ValidationError as error:
            own, more = faults_of(error, configuration_keys(cls))
            unreadable = {str(one["loc"][0]) for one in error.errors(include_url=False)}
            shared = _broken_rules(_readable(cls, tables, unreadable), unreadable)
            raise ConfigurationError(fault_texts([*own, *shared], source, more)) from None
        config._source, config._folder = source, folder
        return config

    def replace(self, path: str | Mapping[str, Any], value: Any = None) -> Self:
        """Return a copy with other values of one key or table, or of several.

        Parameters
        ----------
        path : str or mapping
            Dotted path of the key or table; or all new values by path, which are checked together.
        value : object
            The value, a mapping for a table; None removes the key.

        Returns
        -------
        Configuration
            The changed copy.

        Raises
        ------
        ConfigurationError
            If the changed configuration breaks a rule.

        Examples
        --------
        >>> config.replace("integration.recorded_periods", 800).integration.recorded_periods
        800
        """
        tables: dict[str, Any] = self.tables()
        changes = path if isinstance(path, Mapping) else {path: value}
        if wrong := [one for one in changes if not isinstance(one, str)]:
            raise ConfigurationError(
                f"{self.source}: {wrong[0]!r}: a path is a text, such as sweep.to"
            )
        try:
            for one, changed in changes.items():
                tables = with_value(tables, one.split("."), changed)
        except KeyError as error:
            raise ConfigurationError(f"{self.source}: {error.args[0]} is not a table") from None
        return type(self).from_tables(tables, self.source, self._folder)

    def integrated_by(self, method: str) -> Self:
        """Return a copy with the same text and another method of integration.

        Parameters
        ----------
        method : str
            Name of the method. If it has a number of steps of its own, that replaces the given one.

        Returns
        -------
        Configuration
            The changed copy.

        Raises
        ------
        ConfigurationError
            If the method cannot integrate the scene.

        Examples
        --------
        >>> config.integrated_by("flow_map").integration.fixed_steps
        12
        """
        tables = self.tables()
        integration = {**tables["integration"], "method": method}
        if METHODS[method].steps is not None:
            integration.pop("steps_per_period", None)
        tables["integration"] = integration
        changed = type(self).from_tables(tables, self.source, self._folder)
        changed._text = self._text
        return changed

    def at(self, values: Mapping[str, float]) -> Self:
        """Return a copy with parameters fixed at values.

        Parameters
        ----------
        values : mapping of str to float
            Values by the name of the parameter, in its unit. ``realisation`` selects one drawn
            realisation by its number.

        Returns
        -------
        Configuration
            A copy without the sweeps of these parameters. If [sweep] is removed, [second_sweep]
            takes its place; if nothing is left, [sweep] has one value.

        Raises
        ------
        ConfigurationError
            If a parameter cannot be swept, or if a rule is broken.

        Examples
        --------
        >>> config.at({"pitch_error": 5.0}).sweep.values
        (5.0,)
        """
        fixed = {REALISATION: self.keys_of_realisation(values.get(REALISATION, 0.0))}
        for parameter in values:
            if parameter in self.parameters:
                fixed[parameter] = {self.parameters[parameter].path: float(values[parameter])}
        names = [name for name in values if not fixed.get(name)]
        if unknown := [
            fault for name in names for fault in unknown_parameter(self, "parameter", name)
        ]:
            raise ConfigurationError(fault_texts(unknown, self.source))
        tables = self.tables()
        for path, value in (key for name in values for key in fixed[name].items()):
            tables = with_value(tables, path.split("."), value)
        left = [one for one in map(tables.pop, self.sweeps) if one["parameter"] not in values]
        if not left:
            swept = self.sweep.parameter
            left = [{"parameter": swept, "values": [float(values[swept])]}]
        tables |= dict(zip(self.sweeps, left, strict=False))
        if not OF_CONTROLLERS.keys() >= values.keys():
            # The orbit of a controller is then found at the fixed value.
            tables.get("control", {}).pop("found_at", None)
        return type(self).from_tables(tables, self.source, self._folder)

    def without_control(self) -> Self:
        """Return a copy without a controller and without sweeps of its keys.

        Returns
        -------
        Configuration
            A copy; the same configuration if it has no controller.

        Raises
        ------
        ConfigurationError
            If keys of the controller alone are swept.

        Examples
        --------
        >>> config.without_control() == config
        True
        """
        if self.control is None:
            return self
        left = of_the_machine(self)
        if not left:
            raise ConfigurationError(
                f"{self.source}: only keys of [control] are swept; sweep a parameter of the "
                "machine, such as one value of it, to leave out the controller"
            )
        tables = self.tables()
        kept = [tables.pop(name) for name in self.sweeps if name in left]
        tables = {name: table for name, table in tables.items() if name not in self.sweeps}
        del tables["control"]
        tables |= dict(zip(self.sweeps, kept, strict=False))
        return type(self).from_tables(tables, self.source, self._folder)

    def resolved_toml(self) -> str:
        """Return TOML with all defaults; it loads to an equal configuration.

        Returns
        -------
        str
            The TOML text.

        Examples
        --------
        >>> gearchaos.Configuration.from_toml(config.resolved_toml()) == config
        True
        """
        return toml_text(self.tables())

    @model_validator(mode="after")
    def _obeys_the_rules(self, info: ValidationInfo) -> Self:
        """Raise ConfigurationError if a rule between tables is broken."""
        faults = list(_broken_rules(self, set()))
        if faults:
            source = (info.context or {}).get("source", "<python>")
            # A value in another unit may be the cause.
            causes = [f"{source}: {text}" for text in implausible(self)]
            raise ConfigurationError([*fault_texts(faults, source), *causes])
        return self

    # Neither its source nor what was derived from it so far matters.
    def __eq__(self, other: object) -> bool:
        return isinstance(other, Configuration) and self._fields() == other._fields()

    def _fields(self) -> dict[str, Any]:
        """Return the values of all fields by name."""
        return {name: getattr(self, name) for name in type(self).model_fields}

    __hash__ = None  # type: ignore[assignment]


Given: TypeAlias = Configuration | Mapping[str, Any] | str | os.PathLike[str]


def load_config(path: str | os.PathLike[str], overrides: Iterable[str] = ()) -> Configuration:
    """Read a configuration from a TOML file.

    Parameters
    ----------
    path : str or path
        Path of the file; ``-`` is standard input.
    overrides : iterable of str
        Changes such as ``"integration.steps_per_period=100"``. A value that is not TOML is a text.

    Returns
    -------
    Configuration
        The checked configuration.

    Raises
    ------
    FileError
        If the file cannot be read.
    ConfigurationError
        With one message per fault, all faults at once.

    Examples
    --------
    >>> config = gearchaos.load_config("sweeps/pan2021.toml", ["sweep.count=31"])
    >>> config.sweep.count
    31
    """
    source, overrides = path_text(path, "a TOML file"), texts("overrides", overrides)
    folder = os.path.dirname(source) or "."
    return Configuration.from_toml(text_of_file(source), source, overrides, folder)


def configuration_of(given: Given) -> Configuration:
    """Return a configuration as given, from tables, or from a TOML file, see `load_config`."""
    if isinstance(given, Mapping):
        return Configuration.from_tables(given)
    return given if isinstance(given, Configuration) else load_config(given)


def _kind_of(tables: Mapping[str, Any], source: str) -> type[Configuration]:
    """Return the class of configurations that tables name by ``model.kind``.

    Raises
    ------
    ConfigurationError
        If there is no model of this kind.
    """
    model = tables.get("model")
    kind = model.get("kind", DEFAULT_KIND) if isinstance(model, Mapping) else DEFAULT_KIND
    chosen = Configuration.kinds.get(kind) if isinstance(kind, str) else None
    if chosen is None:
        known = ", ".join(f'"{one}"' for one in Configuration.kinds)
        fault = Fault("model.kind", "is the name of no model", f"there are {known}", kind)
        raise ConfigurationError(fault_texts([fault], source))
    return chosen


@cache
def configuration_keys(kind: type[Tables]) -> dict[str, Key]:
    """Return every key of a class of configurations by its dotted path."""
    every = [(one.path, one) for one in keys_of(kind)]
    # If several kinds of a table have a key, the key of the default kind counts.
    return dict(every) | dict(reversed(every))


def _broken_rules(config: Configuration, unreadable: Collection[str]) -> Iterator[Fault]:
    """Yield the faults of all rules whose tables are readable."""
    suspect = set(unreadable)
    for tables, broken in config.rules:
        if tables.isdisjoint(unreadable):
            for fault in broken(config):
                suspect.add(fault.key.partition(".")[0])
                yield fault
    if suspect.isdisjoint(config.tables_of_lanes):
        yield from config.lane_faults()


def _readable(
    kind: type[Configuration], tables: Mapping[str, Any], unreadable: Collection[str]
) -> Configuration:
    """Return the tables without a fault of their own."""
    readable = {}
    for name, field in kind.model_fields.items():
        if name in tables and name not in unreadable:
            annotation: Any = field.annotation
            readable[name] = TypeAdapter(annotation).validate_python(tables[name])
    return kind.model_construct(**readable)
