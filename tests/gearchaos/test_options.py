"""Every command reads its options from the command line according to their types."""

from functools import partial
from importlib import import_module
from pathlib import Path
from textwrap import wrap
from typing import Annotated, Literal, NamedTuple, get_args, get_type_hints

import pytest

from gearchaos.argument_parser import OptionParser
from gearchaos.command_list import COMMANDS
from gearchaos.errors import ConfigurationError
from gearchaos.options import Arguments, Option, Place

hints_of = partial(get_type_hints, include_extras=True)


class Every(NamedTuple):
    """An option of every type."""

    files: Annotated[tuple[Path, ...], Option("files", positional=True)]
    flag: Annotated[bool, Option("a flag")] = False
    text: Annotated[str | None, Option("a text", flags=("-t", "--text"))] = None
    two_words: Annotated[str, Option("a text (default: %(default)s)")] = "both"
    number: Annotated[float | None, Option("a number", low=-10.0, high=10.0)] = None
    count: Annotated[int, Option("a whole number", low=2, high=9)] = 3
    counts: Annotated[tuple[int, ...], Option("numbers (%(default)s)", low=1, joined=True)] = (5, 7)
    texts: Annotated[tuple[str, ...], Option("repeated texts")] = ()
    at: Annotated[tuple[Place, ...], Option("repeated places")] = ()
    word: Annotated[Literal["red", "blue"], Option("a word")] = "red"
    arguments: Arguments = ()


def parser() -> OptionParser[Every]:
    return OptionParser("gearchaos every", "Take every type.\n\nMore about it.", Every)


def read(*arguments: str) -> Every:
    return parser().read(arguments)[0]


def test_without_options_every_field_has_its_default():
    given = Every((Path("a"),), arguments=("a",))
    assert parser().read(["a"]) == (given, False)


def test_every_type_is_read_as_declared():
    words = "a b.h5 --flag -t x --two-words y --number -2.5 --count 4 --counts 9,2,9 --texts p "
    words += "--texts q=-1 --at load=0.1 --at=-3 --word blue -q"
    found, quiet = parser().read(words.split())
    assert quiet
    assert found == Every(
        files=(Path("a"), Path("b.h5")),
        flag=True,
        text="x",
        two_words="y",
        number=-2.5,
        count=4,
        counts=(2, 9),
        texts=("p", "q=-1"),
        at=(Place("load", 0.1), Place("", -3.0)),
        word="blue",
        arguments=tuple(words.split()),
    )
    assert [type(value) for value in (found.count, found.number)] == [int, float]


@pytest.mark.parametrize("text", ["-1e-3", "-2.5E+0", "-.5", "-3", "1e-300"])
def test_negative_numbers_with_an_exponent_are_values_and_not_options(text):
    assert read("a", "--number", text).number == float(text)
    assert read("a", "--at", text).at == (Place("", float(text)),)


@pytest.mark.parametrize("way", ["upwards", "downwards"])
def test_a_direction_is_named_by_its_value(way):
    assert read("a", "--at", way) == read("a", "--at", f"direction={way}")._replace(
        arguments=("a", "--at", way)
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "the following arguments are required: files"),
        (("a", "--number", "x"), "argument --number: 'x' is not a finite number"),
        (("a", "--number", "nan"), "argument --number: 'nan' is not a finite number"),
        (("a", "--number", "-1e2"), "argument --number: -1e2 must be between -10 and 10"),
        (("a", "--count", "2.5"), "argument --count: 2.5 is not a whole number"),
        (("a", "--count", "1"), "argument --count: 1 must be between 2 and 9"),
        (("a", "--count", "10"), "argument --count: 10 must be between 2 and 9"),
        (("a", "--counts", "3,0"), "argument --counts: 0 must be at least 1"),
        (("a", "--at", "load=x"), "argument --at: 'x' is not a finite number"),
        (("a", "--text"), "argument -t/--text: expected one argument"),
        (("a", "--two-word", "y"), "arguments: --two-word y (did you mean --two-words?)"),
        (("a", "--flg=1"), "unrecognized arguments: --flg=1 (did you mean --flag?)"),
        (("a", "--nonsense"), "unrecognized arguments: --nonsense; see gearchaos every --help"),
    ],
)
def test_a_wrong_argument_is_one_line_with_the_rule_and_the_remedy(arguments, message):
    with pytest.raises(ConfigurationError) as caught:
        read(*arguments)
    (line,) = caught.value.problems
    assert message in line
    assert line.endswith("; see gearchaos every --help")
    assert "\n" not in line


@pytest.mark.parametrize("flag", ["--number", "--word", "--counts"])
def test_an_option_with_one_value_is_given_once(flag):
    values = {"--number": "3", "--word": "blue", "--counts": "2"}
    with pytest.raises(ConfigurationError, match=f"{flag}: is given twice; it takes one value"):
        read("f", flag, values[flag], flag, values[flag])


def test_a_word_that_is_no_choice_is_refused_with_the_choices():
    with pytest.raises(ConfigurationError, match=r"argument --word: .*'green'.*red.*blue"):
        read("a", "--word", "green")


def test_help_fits_the_terminal_and_shows_defaults(monkeypatch):
    monkeypatch.setenv("COLUMNS", "60")
    text = parser().format_help()
    assert max(map(len, text.splitlines())) <= 60
    assert "(default: both)" in text
    assert "numbers (5,7)" in text
    assert text.index("Take every type.") < text.index("\n  --flag ") < text.index("More about it.")


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_an_option_has_at_most_three_lines(name):
    main = import_module(f"gearchaos.{name}").main
    assert main.name == name
    for _, option in (get_args(hint) for hint in hints_of(main.options).values()):
        if isinstance(option, Option):
            # On a terminal of 80 columns argparse leaves 54 columns for the text.
            assert 1 <= len(wrap(option.help, 54)) <= 3, option


@pytest.mark.parametrize("name", COMMANDS)
def test_the_fields_of_a_command_are_all_it_is_given(name):
    main = import_module(f"gearchaos.{name}").main
    required = set(main.options._fields) - set(main.options._field_defaults)
    words = {"paper": "pan2021", "shell": "zsh"}
    given = [words.get(field, f"{field}.x") for field in main.options._fields if field in required]
    options, quiet = main.parser().read(given)
    assert not quiet
    assert isinstance(options, main.options)
    for field, default in main.options._field_defaults.items():
        expected = tuple(given) if field == "arguments" else default
        assert getattr(options, field) == expected
