"""Configuration files, a third of them with a fault; a number reproduces each file."""

import random
import re
from collections.abc import Callable
from pathlib import Path

from . import commands

Random = random.Random

SMALL = commands.SMALL.replace("phase_deg = 30.0", "phase_deg = 0.0")
"""The small sweep without a phase; with a phase, other loops would have to be compiled."""

PLACE = "[integration]"
SECOND_SWEEPS = tuple(
    SMALL.replace(PLACE, f'[second_sweep]\nparameter = "{parameter}"\n{values}\n\n{PLACE}')
    for parameter, values in (
        ("load", "from = 0.1\nto = 0.4\ncount = 3"),
        ("operation.speed_rpm", "values = [7000.0, 8000.0, 9000.0]"),
    )
)
_SINE = "amplitude_um = 11.0\nmean_um = 2.0\nphase_deg = 0.0"
_TOOTH_BY_TOOTH = (
    'kind = "grade"\ngrade = 7\nrealisations = 2',
    f'kind = "teeth"\ndriving = {{ cumulative_um = {[0.0, 3.0, -1.0] * 7} }}',
    'kind = "teeth"\n[pitch_error.driven]\nfile = "none.csv"\ncolumn = "Fp"',
)
FAULTY = (SMALL, SMALL, *SECOND_SWEEPS, *(SMALL.replace(_SINE, one) for one in _TOOTH_BY_TOOTH))

WORDS = (
    "[", "]", "{", "}", "=", ".", ",", "#", '"', "'", '"""', "\\", "\n", "\r", "\0", "\x1b[31m",
    "nan", "-inf", "1e999", "-0", "0x", "1979-05-27", "true", "[[pair]]", "[sweep]", "\ufeff", "é",
    "\U0001f600", "\u202e", "count = 3\n", "__class__", "../../etc/passwd", "${HOME}", "%s",
)  # fmt: skip
NUMBERS = (
    "0", "-1", "1e308", "-1e308", "5e-324", "1e-300", "nan", "inf", "-inf", "9223372036854775808",
    "1" + "0" * 400, "1" + "0" * 5000, "0x" + "f" * 6000, "1_000_000_000", "1e400", "0.1e-999",
)  # fmt: skip

COMPUTED = "values moved"
"""Kind of change of the files that are computed; most of these files are still sound."""
FACTORS = (0.5, 0.9, 1.1, 2.0, 0.0, -1.0, 1e-3, 1e3, 1e-9, 1e9, 1e-200, 1e150)
OPTIONS = {
    "[integration]": ("error_check = 1.0", 'unstable = "raise"', "tolerance = 0.3"),
    "[outputs]": ("motion = false", "exponents = true", "allowed_diverged_share = 1.0"),
    "[start]": (
        'kind = "contact"', 'carry = "upwards"', 'carry = "downwards"', 'carry = "both"',
        *(f'kind = "random"\n{more}' for more in ("count = 3", "spread = 1e-300", "seed = 1")),
        'kind = "given"\nstate = { delta_5 = -1e9, delta_3_rate = 1e-320 }',
    ),
}  # fmt: skip


def configuration(number: int) -> tuple[str, bytes]:
    """Return the kind of change and the changed configuration file; two in three are computed."""
    source = random.Random(f"configuration {number}")
    kind = COMPUTED if number % 3 else list(KINDS)[number // 3 % len(KINDS)]
    text = source.choice((SMALL, SMALL, *SECOND_SWEEPS) if number % 3 else FAULTY)
    return kind, _values_moved(source, text) if number % 3 else KINDS[kind](source, text)


def large_configuration(path: Path) -> None:
    """Write a configuration of 100 MB."""
    with path.open("w", encoding="utf-8") as file:
        file.write(SMALL)
        for _ in range(100):
            file.write("# a comment\n" * (1_000_000 // 12))


def _bytes_changed(source: Random, text: str) -> bytes:
    content = bytearray(text.encode())
    for _ in range(source.choice((1, 2, 5, 50))):
        content[source.randrange(len(content))] = source.randrange(256)
    return bytes(content)


def _cut(source: Random, text: str) -> bytes:
    return text.encode()[: source.randrange(len(text))]


def _words_inserted(source: Random, text: str) -> bytes:
    for _ in range(source.choice((1, 2, 8))):
        place = source.randrange(len(text))
        text = text[:place] + source.choice(WORDS) + text[place:]
    return text.encode()


def _lines_shuffled(source: Random, text: str) -> bytes:
    lines = text.splitlines(keepends=True)
    for _ in range(source.choice((1, 3, 10))):
        one, other = source.randrange(len(lines)), source.randrange(len(lines))
        how = source.randrange(3)
        if how == 0:
            lines[one], lines[other] = lines[other], lines[one]
        elif how == 1:
            lines[one] = ""
        else:
            lines.insert(one, lines[other])
    return "".join(lines).encode()


def _numbers_replaced(source: Random, text: str) -> bytes:
    return _with_numbers(source, text, (1, 2), lambda _: source.choice(NUMBERS)).encode()


def _values_moved(source: Random, text: str) -> bytes:
    text = text.replace("count = 40", "count = 4")
    tables = source.sample(sorted(OPTIONS), source.choice((0, 1, 1, 2)))
    options = {table: source.choice(OPTIONS[table]) for table in tables}
    # `unstable = "raise"` raises the number of steps: a much stiffer pair would take too long.
    most = 4 if 'unstable = "raise"' in options.values() else len(FACTORS)
    text = _with_numbers(source, text, (0, 1, 2), lambda number: _moved(source, number, most))
    for table, option in options.items():
        text = text if table in text else f"{text}\n{table}"
        text = text.replace(table, f"{table}\n{option}")
    return text.encode()


def _moved(source: Random, number: str, most: int) -> str:
    if number.isdecimal():
        return str(int(number) * source.choice((1, 2, 3)) + source.choice((-1, 0, 0)))
    return repr(float(number) * source.choice(FACTORS[: source.choice((4, 4, most))]))


def _with_numbers(
    source: Random, text: str, counts: tuple[int, ...], new: Callable[[str], str]
) -> str:
    places = list(re.finditer(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?", text))
    for place in sorted(source.sample(places, source.choice(counts)), key=lambda m: -m.start()):
        text = text[: place.start()] + new(place[0]) + text[place.end() :]
    return text


def _values_exchanged(source: Random, text: str) -> bytes:
    lines = text.splitlines()
    keys = [index for index, line in enumerate(lines) if "=" in line]
    one, other = source.sample(keys, 2)
    name, _, _ = lines[one].partition("=")
    _, _, value = lines[other].partition("=")
    lines[one] = f"{name}={value}"
    return "\n".join(lines).encode()


def _random_toml(source: Random, _: str) -> bytes:
    return "\n".join(_line(source) for _ in range(source.randrange(1, 30))).encode()


def _line(source: Random) -> str:
    name = source.choice(("pair", "sweep", "scene", "effects", "x", "a.b", '"q r"', "start.state"))
    if source.random() < 0.3:
        return source.choice((f"[{name}]", f"[[{name}]]"))
    return f"{name} = {_value(source, 0)}"


def _value(source: Random, depth: int) -> str:
    if depth < 4 and source.random() < 0.4:
        inner = [_value(source, depth + 1) for _ in range(source.randrange(4))]
        if source.random() < 0.5:
            return f"[{', '.join(inner)}]"
        return f"{{{', '.join(f'k{index} = {value}' for index, value in enumerate(inner))}}}"
    return source.choice((*NUMBERS[:8], '"text"', "'x'", "true", "1979-05-27T07:32:00Z", "[]"))


def _nested_deeply(source: Random, text: str) -> bytes:
    depth = source.choice((50, 100, 300, 1000, 5000, 100_000))
    opening, inner, closing = source.choice(
        (("[", "1", "]"), ("{a = ", "1", "}"), ("a.", "b = 1", ""), ('"a".', "b = 1", ""))
    )
    key = "" if closing == "" else source.choice(("x = ", "title = ", "[sweep]\nvalues = "))
    if source.random() < 0.3:
        closing = ""
    return (text + f"\n{key}{opening * depth}{inner}{closing * depth}\n").encode()


def _many_keys(source: Random, text: str) -> bytes:
    number = source.choice((100, 3000, 20_000))
    form = source.choice(("key{}=1\n", "[t{}]\n", "[pair.t{}]\n", "values.a{}=[]\n"))
    return (text + "".join(form.format(index) for index in range(number))).encode()


def _long_values(source: Random, text: str) -> bytes:
    entry = source.choice(("1.0,", "true,", '"x",', "[],", "{},", "1e400,", "'delta_5',"))
    key = source.choice(("values", "teeth", "effects", "section", "cosine_N_per_um_mm"))
    rows = ",".join([entry.rstrip(",")] * source.choice((10, 1000, 30_000)))
    return re.sub(rf"(?m)^{key} = .*$|^count = 40$", f"{key} = [{rows}]", text, count=1).encode()


def _encoded_otherwise(source: Random, text: str) -> bytes:
    text = text.replace("a small sweep", "ein kleiner Läüf \U0001f600")
    encoding = source.choice(
        ("utf-16", "utf-32", "utf-16-le", "cp037", "utf-7", "latin-1", "cp1252")
    )
    return text.encode(encoding, "replace")


def _random_bytes(source: Random, _: str) -> bytes:
    return source.randbytes(source.choice((0, 1, 10, 1000, 100_000)))


KINDS: dict[str, Callable[[Random, str], bytes]] = {
    "bytes changed": _bytes_changed,
    "cut": _cut,
    "words inserted": _words_inserted,
    "lines shuffled": _lines_shuffled,
    "numbers replaced": _numbers_replaced,
    "values exchanged": _values_exchanged,
    "random TOML": _random_toml,
    "nested deeply": _nested_deeply,
    "many keys": _many_keys,
    "long values": _long_values,
    "another encoding": _encoded_otherwise,
    "random bytes": _random_bytes,
}
