"""Faults a user can cause, each with the exit code the commands give it."""

from collections.abc import Iterable


class GearchaosError(Exception):
    """A fault that is reported as plain text, never as a traceback.

    ``problems``: one message or several, one per fault: what, where, the rule, the remedy. What is
    endless in it is cut.
    """

    exit_code = 1

    def __init__(self, problems: str | Iterable[str]) -> None:
        self.problems = [
            _cut(text) for text in ([problems] if isinstance(problems, str) else problems)
        ]
        super().__init__("\n".join(self.problems))


def _cut(text: str) -> str:
    # A key or value of 100 kB stands in the middle, between the file and the remedy.
    return text if len(text) <= 1200 else f"{text[:500]} [...] {text[-690:]}"


class ConfigurationError(GearchaosError):
    """The configuration or the command line asks for something that cannot be done."""

    exit_code = 2


class ExecutionError(GearchaosError):
    """Lanes cannot be computed where they should be."""

    exit_code = 4


class RangeError(ConfigurationError, ValueError):
    """A number lies outside the range of a formula."""


class FigureError(GearchaosError):
    """What is asked of a figure cannot be drawn from the result."""

    exit_code = 2


class FileError(GearchaosError):
    """A file cannot be read or written, or is not what it should be."""

    exit_code = 4
