"""Faults a user can cause, each with the exit code the commands give it."""

from collections.abc import Iterable


class GearchaosError(Exception):
    """A fault that is reported as plain text, never as a traceback.

    Parameters
    ----------
    problems : str or iterable of str
        One message per fault: what is wrong, where, the rule and the remedy. Messages of more than
        1200 characters are cut.

    Attributes
    ----------
    problems : list of str
        The messages.
    exit_code : int
        Exit code of a command that ends with this error.

    Examples
    --------
    >>> try:
    ...     gearchaos.load_config("sweeps/pan2021.toml", ["sweep.count=0"])
    ... except gearchaos.GearchaosError as error:
    ...     print(len(error.problems), error.exit_code)
    1 2
    """

    exit_code = 1

    def __init__(self, problems: str | Iterable[str]) -> None:
        self.problems = [
            _cut(text) for text in ([problems] if isinstance(problems, str) else problems)
        ]
        super().__init__("\n".join(self.problems))


def _cut(text: str) -> str:
    # A key or value of 100 kB would be in the middle, between the file and the remedy.
    return text if len(text) <= 1200 else f"{text[:500]} [...] {text[-690:]}"


class ConfigurationError(GearchaosError):
    """The configuration or the command line requests something impossible."""

    exit_code = 2


class ExecutionError(GearchaosError):
    """Lanes cannot be computed where they should be."""

    exit_code = 4


class RangeError(ConfigurationError, ValueError):
    """A number lies outside the range of a formula."""


class FigureError(GearchaosError):
    """The result does not contain what a figure needs."""

    exit_code = 2


class FileError(GearchaosError):
    """A file cannot be read or written, or is not what it should be."""

    exit_code = 4
