"""The argparse parser of a command, made from the types of its options."""

import math
import re
from argparse import (
    Action,
    ArgumentParser,
    ArgumentTypeError,
    Namespace,
    RawDescriptionHelpFormatter,
)
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from types import NoneType
from typing import Any, Generic, Literal, NoReturn, TypeVar, get_args, get_origin, get_type_hints

from gearchaos.errors import ConfigurationError
from gearchaos.options import Option, Place
from gearchaos.version import version_text

Options = TypeVar("Options")


class OnceOnly(Action):
    """Stores the value of an option that has one value, and refuses a second one."""

    def __call__(
        self,
        parser: ArgumentParser,
        namespace: Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """Store a value; report an error where the option has been given before."""
        given = vars(namespace).setdefault("_given", set())
        if self.dest in given:
            parser.error(f"argument {option_string}: is given twice; it takes one value")
        given.add(self.dest)
        setattr(namespace, self.dest, values)


class OptionParser(ArgumentParser, Generic[Options]):
    """Reads the arguments of one command into its options.

    ``prog`` is the name of the command. ``text`` is what --help prints: its first paragraph before
    the options, the others after them. ``kind`` is the type of the options. Every command also has
    --help, --quiet, --log and --version. ``files`` are the actions whose values are files.
    """

    def __init__(self, prog: str, text: str, kind: type[Options]) -> None:
        super().__init__(prog, allow_abbrev=False, formatter_class=RawDescriptionHelpFormatter)
        self._text, self._kind = text, kind
        self._fields: tuple[str, ...] = vars(kind)["_fields"]
        self._defaults: dict[str, Any] = vars(kind)["_field_defaults"]
        self._repeated: set[str] = set()
        self._flags = ["--help", "--log", "--quiet", "--version"]
        self.files: list[Action] = []
        self.log_file: str | None = None
        for name, hint in get_type_hints(kind, include_extras=True).items():
            held, option = get_args(hint)
            if isinstance(option, Option):
                self._add(name, held, option)
        self.add_argument(
            "-q", "--quiet", action="store_true", help="print only errors and warnings on stderr"
        )
        self.files.append(
            self.add_argument("--log", metavar="FILE", help="append all messages to this file")
        )
        self.add_argument("--version", action="version", help="print the version and exit")

    def _add(self, name: str, held: Any, option: Option) -> None:
        """Add the option of one field, which holds values of a type."""
        rules: dict[str, Any] = {"help": option.help, "default": self._defaults.get(name)}
        one, several = _element(held)
        if option.joined:
            # A default that is a text is read like a given one, and --help shows it as it is.
            rules["default"], several = ",".join(map(str, rules["default"])), False
        elif several:
            self._repeated.add(name)
            rules["default"] = []
        if one is bool:
            rules["action"] = "store_true"
        elif get_origin(one) is Literal:
            rules["choices"] = list(get_args(one))
        else:
            rules["type"] = _reader(one, option)
        if option.metavar is not None:
            rules["metavar"] = option.metavar
        if option.positional:
            flags: tuple[str, ...] = (name,)
            if several or name in self._defaults:
                rules["nargs"] = "+" if several else "?"
        else:
            flags, rules["dest"] = option.flags or (f"--{name.replace('_', '-')}",), name
            self._flags += flags
            rules.setdefault("action", "append" if several else OnceOnly)
        action = self.add_argument(*flags, **rules)
        if option.file:
            self.files.append(action)

    def read(self, arguments: Sequence[str]) -> tuple[Options, bool]:
        """Return the options, and whether --quiet is given; keep the file of --log.

        Raises ConfigurationError for arguments that cannot be read, SystemExit after --help and
        --version.
        """
        # argparse takes negative numbers with an exponent for options.
        given = [re.sub(r"^-(?=[\d.]+[eE][-+]?\d+$)", " -", text) for text in arguments]
        found, unknown = self.parse_known_args(given, Namespace())
        self.log_file = found.log
        if unknown:
            near = self._nearest(unknown[0])
            hint = f" (did you mean {near}?)" if near else ""
            self.error(f"unrecognized arguments: {' '.join(unknown)}{hint}")
        values = {**vars(found), "arguments": arguments}
        for name in (*self._repeated, "arguments"):
            values[name] = tuple(values[name])
        return self._kind(**{name: values[name] for name in self._fields}), found.quiet

    def _nearest(self, unknown: str) -> str | None:
        """Return the flag that was probably meant."""
        from difflib import get_close_matches

        near = get_close_matches(unknown.partition("=")[0], self._flags, 1, cutoff=0.7)
        return near[0] if near and unknown.startswith("--") else None

    @property
    def version(self) -> str:
        """Text of --version; looking it up takes as long as reading all options."""
        return version_text()

    def error(self, message: str) -> NoReturn:
        """Raise a ConfigurationError: one line instead of the whole usage."""
        raise ConfigurationError(f"{message}; see {self.prog} --help")

    def format_help(self) -> str:
        """Return the text of --help, with paragraphs as wide as the terminal."""
        from shutil import get_terminal_size
        from textwrap import fill

        width = max(get_terminal_size().columns - 2, 11)
        paragraphs = [
            # Indented lines, such as commands to copy, stay as they are.
            paragraph if paragraph.startswith(" ") else fill(paragraph, width)
            for paragraph in self._text.strip("\n").split("\n\n")
        ]
        self.description, self.epilog = paragraphs[0], "\n\n".join(paragraphs[1:])
        return super().format_help()


def _element(held: Any) -> tuple[Any, bool]:
    """Return the type of one value of a field, and whether the field holds several."""
    kinds = get_args(held)
    if get_origin(held) is tuple:
        return kinds[0], True
    if NoneType in kinds:
        return next(kind for kind in kinds if kind is not NoneType), False
    return held, False


def _reader(kind: type, option: Option) -> Callable[[str], Any]:
    """Return the function that reads one value, or joined ones, off the command line."""
    low, high = option.low, option.high
    if option.joined:
        return partial(whole_numbers, low=low, high=high)
    readers: dict[type, Callable[[str], Any]] = {
        float: partial(number, low=low, high=high),
        int: partial(read_whole_number, low=low, high=high),
        Place: place,
        Path: Path,
        str: str,
    }
    return readers[kind]


def number(text: str, low: float = -math.inf, high: float = math.inf) -> float:
    """Read a finite number within bounds."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ArgumentTypeError(f"{text.strip()!r} is not a finite number")
    if not low <= value <= high:
        rule = f"between {low:g} and {high:g}" if math.isfinite(high) else f"at least {low:g}"
        raise ArgumentTypeError(f"{text.strip()} must be {rule}")
    return value


def read_whole_number(text: str, low: float = -math.inf, high: float = math.inf) -> int:
    """Read a whole number within bounds."""
    value = number(text, low, high)
    if value % 1.0:
        raise ArgumentTypeError(f"{text.strip()} is not a whole number")
    return int(value)


def whole_numbers(text: str, low: float, high: float) -> tuple[int, ...]:
    """Read whole numbers within bounds, with commas between them, in ascending order."""
    return tuple(sorted({read_whole_number(one, low, high) for one in text.split(",")}))


def place(text: str) -> Place:
    """Read ``NAME=VALUE``, or ``VALUE``, which has an empty name.

    The values "upwards" and "downwards" belong to the direction, also without its name.
    """
    from gearchaos.outputs.names import DIRECTION, WAYS

    name, _, value = text.rpartition("=")
    if name.strip() in ("", DIRECTION) and value in WAYS:
        return Place(DIRECTION, float(WAYS.index(value)))
    return Place(name.strip(), number(value))
