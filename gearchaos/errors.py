"""Faults a user can cause, each with the exit code the commands give it."""

from __future__ import annotations

from collections.abc import Iterable


class GearchaosError(Exception):
    """A fault that is reported as plain text, never as a traceback.

    Parameters
    ----------
    problems : str or iterable of str
        One message per fault: what, where, the rule, the remedy.
    """

    exit_code = 1

    def __init__(self, problems: str | Iterable[str]) -> None:
        self.problems = [problems] if isinstance(problems, str) else list(problems)
        super().__init__("\n".join(self.problems))


class ConfigurationError(GearchaosError):
    """The configuration or the command line asks for something that cannot be done."""

    exit_code = 2


class FigureError(GearchaosError):
    """What is asked of a figure cannot be drawn from the result."""

    exit_code = 2


class FileError(GearchaosError):
    """A file cannot be read or written, or is not what it should be."""

    exit_code = 4
