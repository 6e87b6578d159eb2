"""Print a script with which the tab key completes the commands, their options and file names.

For bash:

    gearchaos completion bash > ~/.local/share/bash-completion/completions/gearchaos

For zsh, write it to a file named _gearchaos in a folder of $fpath:

    gearchaos completion zsh > FOLDER/_gearchaos

Needs one more package: pip install "gearchaos[completion]".
"""

from argparse import ArgumentParser
from importlib import import_module
from typing import Annotated, Literal, NamedTuple

from gearchaos.command_line import Command
from gearchaos.command_list import COMMANDS
from gearchaos.options import Option


class CompletionOptions(NamedTuple):
    """Options of ``gearchaos completion``."""

    shell: Annotated[Literal["bash", "zsh"], Option("shell that runs the script", positional=True)]


def _complete(options: CompletionOptions) -> None:
    from gearchaos.results.reading.tables import needed

    shtab = needed("shtab", "completion")
    whole = ArgumentParser(prog="gearchaos")
    parsers = whole.add_subparsers()
    for name, summary in COMMANDS.items():
        own = import_module(f"gearchaos.{name}").main.parser()
        for action in own.files:
            action.complete = shtab.FILE
        parsers.add_parser(name, help=summary, parents=[own], add_help=False)
    print(shtab.complete(whole, options.shell))


main = Command("completion", __doc__, CompletionOptions, _complete, writes=False).start(__name__)
